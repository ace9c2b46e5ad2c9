//! Free flights and transmittance estimators with every bound, against quadrature along rays: means, second moments and
//! lookups, in grey and coloured media. Each estimator is also shown planted errors (tracking.md §4.3).

use glam::{DMat4, DVec3};
use nephele::render::field::Field;
use nephele::render::params::Slice;
use nephele::scene::value::{Auto, Colour};
use nephele::scene::{Control, FreeFlight, MajorantKind, Precision, Scene, Transmittance};
use nephele::volume::Dense;
use nephele::volume::majorant::{Padded, Words};

use super::probe::Probe;
use super::support::statistics::{mean, normal};
use super::support::{Adapter, Dice, adapter, field_of, plant, random_dense};
use super::*;

mod analytic;
mod planted;

/// Rays of every case.
const RAYS: usize = 16;
/// Independent streams along each.
const STREAMS: usize = 256;
/// Samples of each stream.
const SAMPLES: u32 = 64;
/// Steps of the quadrature along a ray.
const STEPS: usize = 4000;
/// Rounding in 32-bit floats along a ray, relative.
const ROUNDING: f64 = 2e-5;

/// What the bounds are, and which control they hold.
type Bound = (MajorantKind, Auto<u32>, Control);

/// Every structure of bounds.
const BOUNDS: [Bound; 5] = [
    (MajorantKind::Global, Auto::Auto, Control::Min),
    (MajorantKind::Grid, Auto::Is(3), Control::Min),
    (MajorantKind::Grid, Auto::Auto, Control::Min),
    (MajorantKind::KdTree, Auto::Auto, Control::Min),
    (MajorantKind::Hierarchy, Auto::Auto, Control::Min),
];

/// A field whose cells have floors, lies askew in the world, and is nowhere symmetric.
fn haze() -> Dense {
    let mut dense = random_dense([13, 10, 17], 5);
    for (i, x) in dense.data.iter_mut().enumerate() {
        *x = 1.5 + 0.6 * *x + 0.05 * (i % 13) as f32;
    }
    dense
}

fn scene(flight: FreeFlight, transmittance: Transmittance, bound: Bound, colour: [f64; 3]) -> Scene {
    let mut scene = Scene::default();
    scene.volume.precision = Precision::F32;
    scene.medium.density_scale = Auto::Is(0.4);
    scene.medium.extinction = Colour(colour);
    scene.tracking.free_flight = flight;
    scene.tracking.transmittance = transmittance;
    (scene.tracking.majorant, scene.tracking.cell, scene.tracking.control) = bound;
    scene
}

const GREY: [f64; 3] = [1.0; 3];
const RGB: [f64; 3] = [1.0, 0.55, 0.2];

/// What quadrature says of a ray.
struct Truth {
    /// Transmittance of each channel.
    escape: [f64; 3],
    /// ∫ t μ T dt of each channel.
    moment: [f64; 3],
    /// Of the first channel: ∫ μ̄ T dt, ∫ (μ̄ − μc) T dt, ∫ μ̄ dt, ∫ (residual bound) dt, ∫ μ²/μ̄ dt, ∫ (μ − μc)²/μ̄r dt.
    walk: [f64; 6],
}

/// A case on the adapter, with the truth along each of its rays.
struct Case {
    probe: Probe,
    inputs: Vec<[f32; 4]>,
    truth: Vec<Truth>,
}

impl Case {
    /// A case in voxels that lie askew in the world.
    fn new(a: &Adapter, scene: &Scene, dense: Dense) -> Case {
        let to_world = DMat4::from_rotation_x(0.4) * DMat4::from_scale(DVec3::new(1.0, 0.8, -1.2));
        let padded = Padded::new(&dense, |x| x);
        let words = (scene.tracking.majorant == MajorantKind::Global)
            .then(|| Words::global(&padded, Some(scene.tracking.control)))
            .or_else(|| match scene.tracking.cell {
                Auto::Is(side) => Some(Words::uniform(&padded, side, Some(scene.tracking.control))),
                Auto::Auto => None,
            });
        Case::of(a, scene, field_of(dense, to_world, false), &|p| padded.trilinear(p.to_array()), words)
    }

    /// A case in a field whose stored density at points in local space is `density`; `words` are its bounds where they
    /// are known.
    fn of(a: &Adapter, scene: &Scene, field: Field, density: &dyn Fn(DVec3) -> f64, words: Option<Words>) -> Case {
        let mut probe = Probe::with_field(&a.gpu, scene, field);
        probe.params.seed = 9;
        let (low, high) = probe.medium.field.local_box();
        let to_local = glam::DMat3::from_mat4(probe.medium.field.local_from_world()) * probe.medium.unit;
        let sigma = probe.medium.sigma(scene);
        let strongest = scene.medium.extinction.0.into_iter().fold(0.0, f64::max);
        let mut dice = Dice::new(77);
        let mut inputs = Vec::new();
        let mut truth = Vec::new();
        while truth.len() < RAYS {
            let inside = low + (high - low) * DVec3::new(dice.next(), dice.next(), dice.next());
            let direction = dice.direction();
            let local = to_local * direction;
            // Half of the rays begin inside.
            let origin = if truth.len() % 2 == 0 { inside - local * 2.0 } else { inside };
            let (from, to) = ((low - origin) / local, (high - origin) / local);
            let near = from.min(to).max_element().max(0.0);
            let length = from.max(to).min_element() - near;
            let mut depth = 0.0;
            let mut t = Truth { escape: [0.0; 3], moment: [0.0; 3], walk: [0.0; 6] };
            let step = length / STEPS as f64;
            for i in 0..STEPS {
                let s = (i as f64 + 0.5) * step;
                let p = origin + local * (near + s);
                let density = density(p);
                let middle = depth + 0.5 * sigma * density * step;
                for c in 0..3 {
                    let k = scene.medium.extinction.0[c] / strongest;
                    t.moment[c] += s * k * sigma * density * (-k * middle).exp() * step;
                }
                if let Some(words) = &words {
                    let [max, control, residual] = bounds_at(words, p);
                    let carried = (-middle).exp() * sigma * step;
                    t.walk[0] += max * carried;
                    t.walk[1] += (max - control) * carried;
                    t.walk[2] += max * sigma * step;
                    t.walk[3] += residual * sigma * step;
                    t.walk[4] += if max > 0.0 { density * density / max * sigma * step } else { 0.0 };
                    let left = density - control;
                    t.walk[5] += if residual > 0.0 { left * left / residual * sigma * step } else { 0.0 };
                }
                depth += sigma * density * step;
            }
            if depth > 0.3 {
                t.escape = scene.medium.extinction.0.map(|k| (-k / strongest * depth).exp());
                truth.push(t);
                let four = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
                inputs.extend([four(origin), four(direction)]);
            }
        }
        Case { probe, inputs, truth }
    }

    /// The values of each ray, stream by stream.
    fn run(&self, source: &Source, kernel: &str, each: usize, samples: u32) -> Vec<Vec<Vec<[f64; 4]>>> {
        let slice = Slice { samples, ..Slice::default() };
        let out = self.probe.run(source, kernel, &self.inputs, RAYS * STREAMS * each, each, slice);
        let streams: Vec<Vec<[f64; 4]>> =
            out.chunks(each).map(|values| values.iter().map(|v| v.map(f64::from)).collect()).collect();
        (0..RAYS).map(|ray| streams.iter().skip(ray).step_by(RAYS).cloned().collect()).collect()
    }
}

/// Majorant, control and residual bound of a uniform grid at a point in local space.
fn bounds_at(words: &Words, p: DVec3) -> [f64; 3] {
    let c = ((p - 0.5) / f64::from(words.side)).floor().as_uvec3().min(words.cells - 1);
    let i = 2 * (c.x + words.cells.x * (c.y + words.cells.y * c.z)) as usize;
    let half = |bits: u32| f64::from(half::f16::from_bits(bits as u16));
    [f64::from(f32::from_bits(words.words[i] & !15)), half(words.words[i + 1]), half(words.words[i + 1] >> 16)]
}

/// z of values against their truths over all rays: χ² of the rays' own z, and the mean of the relative differences.
fn pooled(name: &str, rays: &[(f64, f64, f64)]) -> Vec<Check> {
    let z = |(mean, error, truth): &(f64, f64, f64)| (mean - truth) / error.hypot(ROUNDING * truth);
    let square: f64 = rays.iter().map(|r| z(r).powi(2)).sum();
    let sum: f64 = rays.iter().map(z).sum();
    vec![
        (format!("{name}: all rays"), normal(square, rays.len() as f64).max(0.0)),
        (format!("{name}: together"), sum / (rays.len() as f64).sqrt()),
    ]
}

/// Checks of means against the truth: `value` of each stream, per sample.
fn means(
    name: &str,
    case: &Case,
    values: &[Vec<Vec<[f64; 4]>>],
    samples: u32,
    place: (usize, usize),
    truth: impl Fn(&Truth) -> f64,
) -> Vec<Check> {
    let rays: Vec<(f64, f64, f64)> = values
        .iter()
        .zip(&case.truth)
        .map(|(streams, t)| {
            let (m, e) = mean(streams.iter().map(|s| s[place.0][place.1] / f64::from(samples)));
            (m, e, truth(t))
        })
        .collect();
    pooled(name, &rays)
}

/// Relative difference of two numbers that should agree to a few percent, as a z that fails at about a tenth.
fn close(name: String, measured: f64, truth: f64) -> Check {
    (name, (measured / truth - 1.0) / 0.02)
}

fn transmittance_checks(a: &Adapter, source: &Source, scene: &Scene, samples: u32) -> Vec<Check> {
    transmittance_of(&Case::new(a, scene, haze()), source, scene, samples)
}

fn transmittance_of(case: &Case, source: &Source, scene: &Scene, samples: u32) -> Vec<Check> {
    let values = case.run(source, "transmittance", 4, samples);
    let mut checks = Vec::new();
    let t = &scene.tracking;
    let name = format!("{:?} {:?} {:?} {:?}", t.transmittance, t.majorant, t.cell, t.control);
    for c in 0..3 {
        checks.extend(means(&format!("{name}, channel {c}"), case, &values, samples, (0, c), |t| t.escape[c]));
    }
    let total = |place: (usize, usize)| values.iter().flatten().map(|s| s[place.0][place.1]).sum::<f64>();
    let n = f64::from(samples) * STREAMS as f64;
    if t.majorant_factor >= 1.0 {
        checks.push((format!("{name}: lookups above their bound"), 10.0 * total((2, 3))));
    }
    let has_walk = case.truth[0].walk[2] > 0.0 && t.majorant_factor == 1.0;
    let expected = |i: usize| case.truth.iter().map(|t| t.walk[i]).sum::<f64>();
    let variance = |i: usize| -> (f64, f64) {
        let pairs = values.iter().zip(&case.truth).map(|(streams, t)| {
            let second = streams.iter().map(|s| s[1][0]).sum::<f64>() / n;
            let truth = t.escape[0].powi(2) * t.walk[i].exp();
            second / truth
        });
        mean(pairs)
    };
    match t.transmittance {
        Transmittance::Ratio if has_walk => {
            checks.push(close(format!("{name}: lookups"), total((0, 3)) / n, expected(2)));
            checks.push(close(format!("{name}: second moment"), variance(4).0, 1.0));
        }
        Transmittance::Delta if has_walk => {
            checks.push(close(format!("{name}: lookups"), total((0, 3)) / n, expected(2)));
        }
        Transmittance::ResidualRatio if has_walk => {
            checks.push(close(format!("{name}: lookups"), total((0, 3)) / n, expected(3)));
            checks.push(close(format!("{name}: second moment"), variance(5).0, 1.0));
            if t.control == Control::Min {
                let outside = values.iter().flatten().filter(|s| s[2][0] < 0.0 || s[3][0] > 1.0).count();
                checks.push((format!("{name}: estimates outside 0 … 1"), 10.0 * outside as f64));
            }
        }
        _ => {}
    }
    checks
}

fn flight_checks(a: &Adapter, source: &Source, scene: &Scene, samples: u32) -> Vec<Check> {
    flights_of(&Case::new(a, scene, haze()), source, scene, samples)
}

fn flights_of(case: &Case, source: &Source, scene: &Scene, samples: u32) -> Vec<Check> {
    let values = case.run(source, "flight", 6, samples);
    let mut checks = Vec::new();
    let t = &scene.tracking;
    let name = format!("{:?} {:?} {:?} {:?}", t.free_flight, t.majorant, t.cell, t.control);
    for c in 0..3 {
        let of = format!("{name}, channel {c}");
        checks.extend(means(&format!("{of}, escape"), case, &values, samples, (0, c), |t| t.escape[c]));
        checks.extend(means(&format!("{of}, collision"), case, &values, samples, (2, c), |t| 1.0 - t.escape[c]));
        checks.extend(means(&format!("{of}, moment"), case, &values, samples, (4, c), |t| t.moment[c]));
    }
    if t.majorant_factor >= 1.0 {
        let above: f64 = values.iter().flatten().map(|s| s[3][3]).sum();
        checks.push((format!("{name}: lookups above their bound"), 10.0 * above));
    }
    if case.truth[0].walk[2] > 0.0 && scene.medium.extinction.0 == GREY && t.majorant_factor == 1.0 {
        let lookups = values.iter().flatten().map(|s| s[0][3]).sum::<f64>() / (f64::from(samples) * STREAMS as f64);
        let expected = |i: usize| case.truth.iter().map(|t| t.walk[i]).sum::<f64>();
        match t.free_flight {
            FreeFlight::Delta => checks.push(close(format!("{name}: lookups"), lookups, expected(0))),
            FreeFlight::Decomposition => checks.push(close(format!("{name}: lookups"), lookups, expected(1))),
            _ => {}
        }
    }
    checks
}

/// Every estimator of transmittance that is unbiased on voxels.
const TRANSMITTANCES: [Transmittance; 8] = [
    Transmittance::Ratio,
    Transmittance::ResidualRatio,
    Transmittance::Delta,
    Transmittance::NextFlight,
    Transmittance::UnbiasedRayMarching,
    Transmittance::Telescoping,
    Transmittance::PowerSeries,
    Transmittance::Regular,
];

/// Every free flight that is unbiased on voxels.
const FLIGHTS: [FreeFlight; 9] = [
    FreeFlight::Delta,
    FreeFlight::Hero,
    FreeFlight::WeightedDelta,
    FreeFlight::Decomposition,
    FreeFlight::WeightedDecomposition,
    FreeFlight::SpectralMax,
    FreeFlight::SpectralAvg,
    FreeFlight::SpectralHistory,
    FreeFlight::Regular,
];

#[test]
fn unbiased_transmittance_is_that_of_quadrature_with_every_bound() {
    let Some(a) = adapter() else { return };
    for estimator in TRANSMITTANCES {
        for bound in BOUNDS {
            for colour in [GREY, RGB] {
                let scene = scene(FreeFlight::Delta, estimator, bound, colour);
                all_hold(&transmittance_checks(&a, &standard(), &scene, SAMPLES));
            }
        }
        if matches!(estimator, Transmittance::ResidualRatio | Transmittance::Telescoping) {
            let bound = (MajorantKind::Grid, Auto::Is(3), Control::Mean);
            all_hold(&transmittance_checks(&a, &standard(), &scene(FreeFlight::Delta, estimator, bound, RGB), SAMPLES));
        }
    }
}

#[test]
fn unbiased_flights_are_those_of_quadrature_with_every_bound() {
    let Some(a) = adapter() else { return };
    for flight in FLIGHTS {
        for bound in BOUNDS {
            for colour in [GREY, RGB] {
                let scene = scene(flight, Transmittance::Ratio, bound, colour);
                all_hold(&flight_checks(&a, &standard(), &scene, SAMPLES));
            }
        }
    }
    let bound = (MajorantKind::Grid, Auto::Is(3), Control::Mean);
    let scene = scene(FreeFlight::WeightedDecomposition, Transmittance::Ratio, bound, RGB);
    all_hold(&flight_checks(&a, &standard(), &scene, SAMPLES));
}

#[test]
fn bounds_that_do_not_bound_are_borne_by_signed_weights() {
    let Some(a) = adapter() else { return };
    for colour in [GREY, RGB] {
        for flight in [FreeFlight::WeightedDelta, FreeFlight::SpectralHistory, FreeFlight::Regular] {
            let mut scene = scene(flight, Transmittance::Ratio, BOUNDS[1], colour);
            scene.tracking.majorant_factor = 0.8;
            all_hold(&flight_checks(&a, &standard(), &scene, 4 * SAMPLES));
        }
        for estimator in [Transmittance::Ratio, Transmittance::ResidualRatio, Transmittance::NextFlight] {
            let mut scene = scene(FreeFlight::Regular, estimator, BOUNDS[1], colour);
            scene.tracking.majorant_factor = 0.8;
            all_hold(&transmittance_checks(&a, &standard(), &scene, SAMPLES));
        }
    }
    let mut broken = scene(FreeFlight::WeightedDelta, Transmittance::Ratio, BOUNDS[1], GREY);
    broken.tracking.majorant_factor = 0.8;
    let case = Case::new(&a, &broken, haze());
    let above: f64 = case.run(&standard(), "flight", 6, 4).iter().flatten().map(|s| s[3][3]).sum();
    assert!(above > 100.0, "lookups above their bound are counted: {above}");
}

#[test]
fn decomposition_draws_the_flights_of_delta_tracking() {
    let Some(a) = adapter() else { return };
    for bound in BOUNDS {
        let run = |flight| {
            let case = Case::new(&a, &scene(flight, Transmittance::Ratio, bound, RGB), haze());
            let values = case.run(&standard(), "flight", 6, SAMPLES);
            let sums: Vec<[f64; 3]> = values.iter().flatten().flatten().map(|v| [v[0], v[1], v[2]]).collect();
            (sums, values.iter().flatten().map(|s| s[0][3]).sum::<f64>())
        };
        let (delta, delta_lookups) = run(FreeFlight::Delta);
        let (decomposition, lookups) = run(FreeFlight::Decomposition);
        assert_eq!(delta, decomposition, "{bound:?}");
        assert!(lookups <= delta_lookups, "{bound:?}: {lookups} against {delta_lookups}");
    }
}

/// Relative bias of an estimator at a step, its standard error, and half its relative variance, over all rays.
fn bias(a: &Adapter, estimator: Transmittance, step: f64) -> (f64, f64, f64) {
    let mut scene = scene(FreeFlight::Delta, estimator, BOUNDS[0], GREY);
    scene.tracking.step = step;
    scene.medium.density_scale = Auto::Is(0.1);
    let case = Case::new(a, &scene, haze());
    let samples = 256;
    let values = case.run(&standard(), "transmittance", 4, samples);
    let n = f64::from(samples) * STREAMS as f64;
    let rays: Vec<(f64, f64, f64)> = values
        .iter()
        .zip(&case.truth)
        .map(|(streams, t)| {
            let (m, e) = mean(streams.iter().map(|s| s[0][0] / f64::from(samples) / t.escape[0]));
            let second = streams.iter().map(|s| s[1][0]).sum::<f64>() / n / t.escape[0].powi(2);
            (m - 1.0, e, 0.5 * (second - m * m))
        })
        .collect();
    let n = rays.len() as f64;
    let sum = |f: &dyn Fn(&(f64, f64, f64)) -> f64| rays.iter().map(f).sum::<f64>();
    (sum(&|r| r.0) / n, sum(&|r| r.1 * r.1).sqrt() / n, sum(&|r| r.2) / n)
}

#[test]
fn marching_is_biased_as_theory_says() {
    let Some(a) = adapter() else { return };
    let mut before = f64::INFINITY;
    for step in [4.0, 2.0, 1.0] {
        let (found, error, predicted) = bias(&a, Transmittance::RayMarching, step);
        eprintln!("step {step}: bias {found:.5} ± {error:.5}, half the variance {predicted:.5}");
        assert!(found > 5.0 * error, "too bright: {found} ± {error} at {step}");
        assert!((found / predicted - 1.0).abs() < 0.35, "bias {found} against half the variance {predicted} at {step}");
        assert!(found < 0.5 * before, "falls faster than the step: {found} after {before}");
        let (jackknife, jackknife_error, _) = bias(&a, Transmittance::Jackknife, step);
        assert!(jackknife.abs() < 0.3 * found + 4.0 * jackknife_error, "jackknife {jackknife} against {found}");
        before = found;
    }
}

/// Mean relative errors of escape and moment of marched flights, over all rays.
fn marched(a: &Adapter, source: &Source, step: f64) -> (f64, f64) {
    let mut scene = scene(FreeFlight::RayMarching, Transmittance::Ratio, BOUNDS[2], GREY);
    scene.tracking.step = step;
    let case = Case::new(a, &scene, haze());
    let values = case.run(source, "flight", 6, 4 * SAMPLES);
    let n = f64::from(4 * SAMPLES) * STREAMS as f64;
    let total = |k: usize| values.iter().flatten().map(|s| s[k][0]).sum::<f64>() / n;
    let truth = |f: &dyn Fn(&Truth) -> f64| case.truth.iter().map(f).sum::<f64>();
    (total(0) / truth(&|t| t.escape[0]) - 1.0, total(4) / truth(&|t| t.moment[0]) - 1.0)
}

#[test]
fn marched_flights_end_inside_their_step() {
    let Some(a) = adapter() else { return };
    let (escape, moment) = marched(&a, &standard(), 0.25);
    assert!(escape.abs() < 0.01 && moment.abs() < 0.005, "{escape} {moment}");
    let edges = plant("flight/ray_marching", "return start + passed / density;", "return start + step;");
    let (_, moment) = marched(&a, &edges.source, 0.25);
    assert!(moment.abs() > 0.02, "{moment}");
    let near = plant("flight/ray_marching", "start + rng_next(rng) * step", "start");
    let (escape, moment) = marched(&a, &near.source, 1.0);
    assert!(escape.abs() > 0.02 || moment.abs() > 0.02, "{escape} {moment}");
}
