//! Lights on the CPU: environment maps, their sampling tables, the daylight sky.

pub mod environment;
pub mod sky;
