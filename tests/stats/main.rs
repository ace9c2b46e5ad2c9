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
mod rng;
mod tone_map;

/// Statistical checks in this binary, about; more would raise the threshold only a little.
const CHECKS: u32 = 300;

/// A check against chance: its name and its z.
type Check = (String, f64);

/// Fails where one of `checks` is further from the truth than chance allows.
fn all_hold(checks: &[Check]) {
    let limit = support::statistics::limit(CHECKS);
    let bad: Vec<&Check> = checks.iter().filter(|(_, z)| z.is_nan() || z.abs() >= limit).collect();
    assert!(bad.is_empty(), "beyond {limit:.2} standard errors: {bad:.2?}");
}

/// Fails where none of `checks` sees the planted error clearly.
fn one_sees(what: &str, checks: &[Check]) {
    let (name, z) = checks.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).expect("there are checks");
    eprintln!("planted: {what}: {name} says {z:.1}");
    assert!(z.abs() > support::statistics::SEEN, "{what} is not seen: {checks:.2?}");
}

/// The shaders as they are.
fn standard() -> Source {
    Source::standard()
}
