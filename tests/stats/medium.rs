//! The density as the shader reads it against interpolation on the CPU.

use glam::{DMat4, DVec3};
use nephele::scene::{Precision, Scene};
use nephele::volume::majorant::Padded;

use super::probe::{self, Probe};
use super::support::{Adapter, Dice, adapter, field_of, plant, random_dense};
use super::*;

const SIZE: [u32; 3] = [9, 6, 11];
const POINTS: usize = 20_000;

/// Software samplers keep all digits of the weights, but for textures of 8 bits; those of devices keep 8 bits of them.
fn sampler_tolerance(a: &Adapter, precision: Precision) -> f64 {
    if a.gpu.is_software() && precision != Precision::U8 { 1e-5 } else { 1.0 / 128.0 }
}

/// Points in the support: many at random, every texel's centre, points on faces, edges and corners.
fn points(low: DVec3, high: DVec3) -> Vec<DVec3> {
    let mut dice = Dice::new(3);
    let mut all: Vec<DVec3> = (0..POINTS)
        .map(|i| {
            let p = low + (high - low) * DVec3::new(dice.next(), dice.next(), dice.next());
            // A few on whole and half coordinates.
            match i % 10 {
                0 => p.round(),
                1 => p.floor() + 0.5,
                2 => DVec3::new(p.x.round(), p.y, p.z),
                _ => p,
            }
            .clamp(low, high)
        })
        .collect();
    for corner in 0..8 {
        let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
        all.push(DVec3::new(pick(0), pick(1), pick(2)));
    }
    all
}

/// Greatest difference between the shader's density in `slot` and the CPU's.
fn difference(a: &Adapter, source: &Source, precision: Precision, slot: Option<&'static str>, nearest: bool) -> f64 {
    let mut scene = Scene::default();
    scene.volume.precision = precision;
    let dense = random_dense(SIZE, 8);
    let store = |x: f32| match precision {
        Precision::F32 => x,
        Precision::U8 => (x * 255.0).round() / 255.0,
        Precision::F16 | Precision::Auto => half::f16::from_f32(x).to_f32(),
    };
    let padded = Padded::new(&dense, store);
    let mut probe = Probe::with_field(&a.gpu, &scene, field_of(dense, DMat4::IDENTITY, nearest));
    if let Some(file) = slot {
        probe.choose("medium", file);
    }
    let (low, high) = probe.medium.field.local_box();
    // Where the shader rounds to the nearest voxel, points on the faces between have two right answers.
    let on_face = |p: &DVec3| p.to_array().iter().any(|x| (x - x.round()).abs() < 1e-4);
    let points: Vec<DVec3> = points(low, high).into_iter().filter(|p| !nearest || !on_face(p)).collect();
    let inputs: Vec<[f32; 4]> = points.iter().map(|p| [p.x as f32, p.y as f32, p.z as f32, 0.0]).collect();
    let found = probe.run(source, "medium", &inputs, inputs.len(), 1, probe::sample(0));
    let exact = |p: &[f32; 4]| {
        let p = [f64::from(p[0]), f64::from(p[1]), f64::from(p[2])];
        if nearest { padded.trilinear(p.map(|x| x.floor() + 0.5)) } else { padded.trilinear(p) }
    };
    found.iter().zip(&inputs).map(|(v, p)| (f64::from(v[0]) - exact(p)).abs()).fold(0.0, f64::max)
}

#[test]
fn densities_are_those_of_the_cpu() {
    let Some(a) = adapter() else { return };
    for precision in [Precision::F32, Precision::F16, Precision::U8, Precision::Auto] {
        let sampled = difference(&a, &standard(), precision, Some("medium/dense"), false);
        assert!(sampled < sampler_tolerance(&a, precision), "{precision:?} by the sampler: {sampled:e}");
        let exact = difference(&a, &standard(), precision, Some("medium/dense_exact"), false);
        assert!(exact < 1e-5, "{precision:?} by the formula: {exact:e}");
        let chosen = difference(&a, &standard(), precision, None, false);
        assert!(chosen < sampler_tolerance(&a, precision), "{precision:?} as the program chooses: {chosen:e}");
        let nearest = difference(&a, &standard(), precision, None, true);
        assert!(nearest < 1e-6, "{precision:?}, the nearest voxel: {nearest:e}");
    }
}

#[test]
fn a_field_that_is_shifted_is_seen() {
    let Some(a) = adapter() else { return };
    let plants = [
        ("medium/dense", "medium_sampler, p * params", "medium_sampler, (p + 0.5) * params", false),
        ("medium/dense", "medium_sampler, p * params", "medium_sampler, p.zyx * params", false),
        ("medium/dense", ", 0.0).x;", ", 0.0).x * 1.01;", false),
        ("medium/dense_exact", "let q = p - 0.5;", "let q = p;", false),
        ("medium/dense_exact", "let b = min(a + 1, last);", "let b = min(a + 1, last - 1);", false),
        ("medium/dense_nearest", "vec3i(floor(p))", "vec3i(floor(p + 0.5))", true),
        ("medium/dense_nearest", "vec3i(0), last)", "vec3i(0), last - 2)", true),
    ];
    for (file, from, to, nearest) in plants {
        let planted = plant(file, from, to);
        let found = difference(&a, &planted.source, Precision::F32, Some(file), nearest);
        assert!(found > 8.0 * sampler_tolerance(&a, Precision::F32), "{to} in {file} is not seen: {found:e}");
    }
}
