//! nephele: an interactive, unbiased volume path tracer.
pub mod app;
pub mod cli;
pub mod error;
pub mod gpu;
pub mod image;
pub mod input;
pub mod io;
pub mod light;
pub mod render;
pub mod save;
pub mod scene;
pub mod volume;
