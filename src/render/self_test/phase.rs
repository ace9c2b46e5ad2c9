//! The Henyey–Greenstein phase function by itself: angles that it draws, and its values.

use std::f64::consts::{PI, TAU};

use super::*;
use crate::scene::{Analytic, Phase};

/// Mean cosine: that of clouds, where a wrong sign or a lost factor shows most.
const G: f64 = 0.85;
/// Angles that are drawn, and at which values are taken.
const ANGLES: usize = 1 << 18;
/// Error of the midpoint rule over that many angles and of 32-bit floats: a hundred times what exact roots give, for
/// those of drivers may be rougher.
const QUADRATURE: f64 = 1e-4;

/// The polar angle of a value.
fn angle(i: usize) -> f64 {
    PI * (i as f64 + 0.5) / ANGLES as f64
}

/// For each angle: a drawn cosine, the value there, and the value at the angle.
fn probed(lab: &Lab) -> Result<Vec<[f32; 4]>> {
    let mut scene = Scene::default();
    scene.volume.analytic = Analytic::Homogeneous;
    (scene.medium.phase, scene.medium.g) = (Phase::Hg, G);
    let inputs: Vec<[f32; 4]> = (0..ANGLES).map(|i| [angle(i).cos() as f32, 0.0, 0.0, 0.0]).collect();
    probe(&lab.renderer(&scene, None)?, "phase", &inputs, ANGLES, 1)
}

/// The integral of the values times `factor(cosine)` over the sphere.
fn integrate(lab: &Lab, factor: fn(f64) -> f64) -> Result<f64> {
    let values = probed(lab)?;
    let term = |(i, v): (usize, &[f32; 4])| f64::from(v[2]) * factor(angle(i).cos()) * angle(i).sin();
    Ok(values.iter().enumerate().map(term).sum::<f64>() * TAU * PI / ANGLES as f64)
}

pub(super) fn sampled(lab: &Lab) -> Result<Outcome> {
    let drawn = probed(lab)?;
    Ok(Outcome::by_chance(mean_of(drawn.iter().map(|v| f64::from(v[0]))), G))
}

pub(super) fn integral(lab: &Lab) -> Result<Outcome> {
    Ok(Outcome { measured: integrate(lab, |_| 1.0)?, expected: 1.0, within: QUADRATURE })
}

pub(super) fn mean_cosine(lab: &Lab) -> Result<Outcome> {
    Ok(Outcome { measured: integrate(lab, |cosine| cosine)?, expected: G, within: QUADRATURE })
}
