//! Small pictures by the renderer itself against closed forms, quadrature and one another. Seeds are fixed, thresholds
//! follow from the number of checks, and every statistical check is also shown planted errors that it must see.

use std::sync::Arc;

use glam::{DMat4, DVec3};
use nephele::gpu::shader::Source;
use nephele::render::field::Field;
use nephele::render::film::{Counters, Sums};
use nephele::render::medium::Medium;
use nephele::render::{Renderer, Work};
use nephele::scene::value::{Auto, Bounds, Colour, Limit, Matrix};
use nephele::scene::{Analytic, Constant, Light, Phase, Scene, Sun};

#[path = "../support/mod.rs"]
mod support;

mod camera;
mod closed;
mod colour;
mod cost;
mod engine;
mod film;
mod furnace;
mod lights;
mod media;
mod reuse;
mod slab;

use support::statistics::{CHECKS, Check, all_hold, limit, normal, one_sees};
use support::{Adapter, adapter, plant};

/// Pixels along the side of most pictures.
const SIDE: u32 = 32;

/// The shaders as they are.
fn standard() -> Source {
    Source::standard()
}

/// A homogeneous box without lights, seen by nobody yet.
fn boxed(low: [f64; 3], high: [f64; 3], density: f64) -> Scene {
    let mut scene = Scene::default();
    scene.volume.analytic = Analytic::Homogeneous;
    scene.volume.bounds = Bounds([low.into(), high.into()]);
    scene.medium.density_scale = Auto::Is(density);
    scene.lights.clear();
    (scene.film.width, scene.film.height) = (SIDE, SIDE);
    scene.integrator.max_bounces = Limit::Unlimited;
    scene
}

/// The cube from 0 to 1.
fn unit_cube(density: f64) -> Scene {
    boxed([0.0; 3], [1.0; 3], density)
}

/// A layer from y = 0 to 1, without end along x and z.
fn slab(density: f64) -> Scene {
    let inf = f64::INFINITY;
    boxed([-inf, 0.0, -inf], [inf, 1.0, inf], density)
}

/// Puts the camera at `from`, with `degrees` from the bottom to the top of the picture.
fn look(scene: &mut Scene, from: DVec3, to: DVec3, degrees: f64) {
    scene.camera.position = Auto::Is(from);
    scene.camera.target = Auto::Is(to);
    scene.camera.fov_y = degrees;
    scene.camera.up = if (to - from).normalize().y.abs() > 0.99 { DVec3::Z } else { DVec3::Y };
}

/// All rays of the picture are this one, about: a narrow view from a little before `through`.
fn one_ray(scene: &mut Scene, through: DVec3, direction: DVec3) {
    look(scene, through - 5.0 * direction.normalize(), through, 0.1);
}

fn sun(direction: DVec3, irradiance: f64) -> Light {
    Light::Sun(Sun { direction, irradiance: Colour([irradiance; 3]), angular_diameter: 0.0 })
}

fn constant(radiance: f64) -> Light {
    Light::Constant(Constant { radiance: Colour([radiance; 3]) })
}

fn hg(scene: &mut Scene, g: f64) {
    scene.medium.phase = Phase::Hg;
    scene.medium.g = g;
}

fn albedo(scene: &mut Scene, albedo: f64) {
    scene.medium.albedo = Colour([albedo; 3]);
}

fn place(scene: &mut Scene, to_world: DMat4) {
    scene.volume.to_world = Matrix(to_world.transpose().to_cols_array());
}

/// Henyey and Greenstein's phase function per steradian.
fn hg_value(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * std::f64::consts::PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// A renderer for `scene`, on `field` where it is given.
fn renderer(a: &Adapter, source: &Source, scene: &Scene, field: Option<Field>, aov: bool) -> Renderer {
    let field = field.unwrap_or_else(|| Field::load(&scene.volume).expect("a field without files"));
    let medium = Medium::new(&a.gpu, Arc::new(field), scene).expect("a small medium");
    let size = (scene.film.width, scene.film.height);
    Renderer::new(a.gpu.clone(), source.clone(), scene, medium, size, aov).unwrap_or_else(|e| panic!("{e}"))
}

/// Goes on until every pixel has `samples`, in pieces of `work`.
fn accumulate(r: &mut Renderer, samples: u32, work: Work) {
    while r.progress().samples < samples {
        let left = samples - r.progress().samples;
        r.submit(Work { samples: work.samples.min(left), groups: work.groups }).unwrap_or_else(|e| panic!("{e}"));
    }
    r.gpu.wait().unwrap_or_else(|e| panic!("{e}"));
}

/// Everything in one pass where that is allowed.
const WHOLE: Work = Work { samples: u32::MAX, groups: u32::MAX };

/// A finished picture.
struct Picture {
    sums: Sums,
    counters: Counters,
}

fn draw_with(a: &Adapter, source: &Source, scene: &Scene, field: Option<Field>, samples: u32, aov: bool) -> Picture {
    let mut r = renderer(a, source, scene, field, aov);
    accumulate(&mut r, samples, WHOLE);
    let sums = r.sums().expect("a film");
    let counters = r.film.count(&r.gpu).expect("counters");
    assert_eq!(counters.nonfinite, 0, "samples that are not finite");
    assert!(sums.square.iter().all(|s| s[3] == f64::from(samples)), "samples that are lost");
    Picture { sums, counters }
}

fn draw(a: &Adapter, source: &Source, scene: &Scene, samples: u32) -> Picture {
    draw_with(a, source, scene, None, samples, false)
}

impl Picture {
    fn pixels(&self) -> usize {
        self.sums.sum.len()
    }

    fn variance(&self, pixel: usize) -> [f64; 3] {
        self.sums.variance(pixel).expect("more than one sample")
    }

    /// Mean of a channel over the picture, and its standard error.
    fn mean(&self, channel: usize) -> (f64, f64) {
        let n = self.pixels() as f64;
        let mean = (0..self.pixels()).map(|p| self.sums.mean(p)[channel]).sum::<f64>() / n;
        let variance = (0..self.pixels()).map(|p| self.variance(p)[channel]).sum::<f64>() / (n * n);
        (mean, variance.sqrt())
    }

    /// The picture's mean against the truth, first channel.
    fn against(&self, name: &str, truth: f64) -> Check {
        let (mean, error) = self.mean(0);
        (format!("{name}: {mean:.6} for {truth:.6}"), (mean - truth) / error)
    }

    /// Share of the samples that met the medium, and its standard error.
    fn opacity(&self) -> (f64, f64) {
        let n: f64 = self.sums.square.iter().map(|s| s[3]).sum();
        let share = self.sums.sum.iter().map(|s| s[3]).sum::<f64>() / n;
        (share, (share * (1.0 - share) / n).sqrt())
    }

    /// That share against an optical depth.
    fn against_depth(&self, name: &str, depth: f64) -> Check {
        let (share, error) = self.opacity();
        let truth = 1.0 - (-depth).exp();
        (format!("opacity of {name}: {share:.6} for {truth:.6}"), (share - truth) / error)
    }
}

/// Relative error of a pixel's sum of squares in 32 bits, about: variances below it are noise.
const SQUARE_ROUNDING: f64 = 1e-5;

/// Two independent pictures of what should be the same: means of the whole and of its quarters for each channel, the sum
/// of squares and the greatest of the pixels' z.
fn same(name: &str, a: &Picture, b: &Picture) -> Vec<Check> {
    same_mapped(name, a, b, |p| p)
}

/// The same where pixel p of `a` is pixel `to(p)` of `b`.
fn same_mapped(name: &str, a: &Picture, b: &Picture, to: impl Fn(usize) -> usize) -> Vec<Check> {
    let (width, height) = (a.sums.width as usize, a.sums.height as usize);
    let mut checks = Vec::new();
    for c in 0..3 {
        let mut quarters = [(0.0, 0.0); 4];
        let (mut square, mut count, mut largest, mut unresolved) = (0.0, 0.0, 0.0f64, 0.0f64);
        for p in 0..a.pixels() {
            let q = to(p);
            let difference = a.sums.mean(p)[c] - b.sums.mean(q)[c];
            let variance = a.variance(p)[c] + b.variance(q)[c];
            let brightness = a.sums.mean(p)[c].abs().max(b.sums.mean(q)[c].abs());
            let quarter = &mut quarters[(p % width * 2 / width) + 2 * (p / width * 2 / height)];
            *quarter = (quarter.0 + difference, quarter.1 + variance);
            let resolved = 20.0 * brightness.powi(2) * SQUARE_ROUNDING / a.sums.square[p][3].min(b.sums.square[q][3]);
            if variance > resolved {
                let z = difference / variance.sqrt();
                square += z * z;
                count += 1.0;
                largest = largest.max(z.abs());
            } else {
                // Pixels of hardly anything but sky: equal but for rounding and a few samples.
                unresolved = unresolved.max(difference.abs() / (10.0 * resolved.sqrt().max(f64::MIN_POSITIVE)));
            }
        }
        let whole = quarters.iter().fold((0.0, 0.0), |sum, q| (sum.0 + q.0, sum.1 + q.1));
        let z =
            |(difference, variance): (f64, f64)| if variance > 0.0 { difference / f64::sqrt(variance) } else { 0.0 };
        checks.push((format!("{name}, channel {c}: mean"), z(whole)));
        for (i, quarter) in quarters.into_iter().enumerate() {
            checks.push((format!("{name}, channel {c}: quarter {i}"), z(quarter)));
        }
        checks.push((format!("{name}, channel {c}: even pixels"), unresolved * limit(CHECKS)));
        if count > 20.0 {
            checks.push((format!("{name}, channel {c}: z² of pixels"), normal(square, count)));
            let scale = limit(CHECKS) / limit(CHECKS * a.pixels() as u32);
            checks.push((format!("{name}, channel {c}: largest z"), largest * scale));
        }
    }
    checks
}
