//! One timed run of the path tracer.

use crate::error::Result;
use crate::render::film::{Counters, Sums};
use crate::render::{Renderer, Work};
use crate::scene::Scene;

use super::clock::Watch;

/// What a run took and gave.
pub struct Trace {
    /// Wall seconds.
    pub wall: f64,
    /// CPU seconds of the process, where they are known.
    pub cpu: Option<f64>,
    /// Events of all rays.
    pub counters: Counters,
    /// The film.
    pub sums: Sums,
}

/// Draws `samples` samples of every pixel of `scene` with `seed`. Neither the builder of shaders nor that of bounds is in
/// the time.
pub fn trace(renderer: &mut Renderer, scene: &Scene, samples: u32, seed: u32) -> Result<Trace> {
    let mut scene = scene.clone();
    scene.integrator.seed = seed;
    renderer.update(&scene, renderer.size(), None)?;
    renderer.prepare()?;
    renderer.restart();
    renderer.gpu.wait()?;
    let watch = Watch::start();
    while renderer.progress().samples < samples {
        let left = samples - renderer.progress().samples;
        renderer.submit(Work { samples: left, groups: u32::MAX })?;
    }
    renderer.gpu.wait()?;
    let (wall, cpu) = watch.seconds();
    let counters = renderer.film.count(&renderer.gpu)?;
    let sums = renderer.sums()?;
    Ok(Trace { wall, cpu, counters, sums })
}
