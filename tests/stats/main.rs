//! Statistics of single shader functions, called by the kernels in shaders/probe. Seeds are fixed; thresholds follow
//! from the number of checks; every check is also shown a planted error that it must see.

use nephele::gpu::shader::Source;

#[path = "../support/mod.rs"]
mod support;

mod light;
mod majorant;
mod medium;
mod phase;
mod probe;
mod reuse;
mod rng;
mod tone_map;
mod tracking;

use support::statistics::{Check, all_hold, one_sees};

/// The shaders as they are.
fn standard() -> Source {
    Source::standard()
}
