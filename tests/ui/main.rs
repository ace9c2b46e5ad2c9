//! The window without a window: panels and widgets driven by their accessible names.
//!
//! The harness also panics on any input without an accessible name, and on any sign that no font has.

mod app;
mod cards;
mod closer;
mod harness;
mod invalidation;
mod lab;
mod method;
mod snapshots;
mod widgets;
