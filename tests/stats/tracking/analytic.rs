//! Analytic media: linear, exponential and homogeneous, by closed forms and by every other estimator that fits them.

use glam::{DMat4, DVec3};
use nephele::render::field::Field;
use nephele::render::params::Slice;
use nephele::scene::value::{Auto, Bounds, Matrix, Pair};
use nephele::scene::{Analytic, Axis, FreeFlight, Scene, Transmittance};

use super::super::probe::Probe;
use super::super::support::statistics::{Check, all_hold, one_sees};
use super::super::support::{Adapter, adapter, plant};
use super::super::{Source, standard};
use super::{BOUNDS, Case, RGB, SAMPLES, flights_of, scene, transmittance_of};

/// What the density is, over the greatest, at a point of the box.
type Formula = fn(DVec3) -> f64;

const LOW: DVec3 = DVec3::new(-1.0, 0.5, 2.0);
const HIGH: DVec3 = DVec3::new(2.0, 1.5, 4.0);

/// Media that lie askew in the world: kind, axis, formula.
const MEDIA: [(Analytic, Axis, Formula); 4] = [
    (Analytic::Homogeneous, Axis::Y, |_| 1.0),
    (Analytic::Linear, Axis::X, |p| (0.5 + 2.5 * (p.x - LOW.x) / (HIGH.x - LOW.x)) / 3.0),
    (Analytic::Exponential, Axis::Z, |p| (-(p.z - LOW.z) / 0.6).exp()),
    (Analytic::Exponential, Axis::Y, |p| (-(p.y - LOW.y) / 0.6).exp()),
];

fn medium((kind, axis, _): (Analytic, Axis, Formula), flight: FreeFlight, transmittance: Transmittance) -> Scene {
    let mut scene = scene(flight, transmittance, BOUNDS[0], RGB);
    scene.volume.analytic = kind;
    scene.volume.axis = axis;
    scene.volume.bounds = Bounds([LOW, HIGH]);
    scene.volume.density = Pair([0.5, 3.0]);
    scene.volume.scale_height = 0.6;
    let to_world = DMat4::from_rotation_z(0.3) * DMat4::from_scale(DVec3::new(0.5, -1.0, 1.5));
    scene.volume.to_world = Matrix(std::array::from_fn(|i| to_world.row(i / 4)[i % 4]));
    scene.medium.density_scale = Auto::Is(0.7);
    scene
}

fn case(a: &Adapter, of: (Analytic, Axis, Formula), scene: &Scene) -> Case {
    Case::of(a, scene, Field::load(&scene.volume).expect("a formula"), &of.2, None)
}

fn checks(a: &Adapter, source: &Source, of: (Analytic, Axis, Formula), scene: &Scene) -> Vec<Check> {
    let case = case(a, of, scene);
    let mut checks = transmittance_of(&case, source, scene, SAMPLES);
    checks.extend(flights_of(&case, source, scene, SAMPLES));
    checks
}

#[test]
fn analytic_media_are_their_formulas() {
    let Some(a) = adapter() else { return };
    use FreeFlight as F;
    use Transmittance as T;
    let pairs = [
        (F::ClosedForm, T::ClosedForm),
        (F::Delta, T::Ratio),
        (F::Regular, T::Regular),
        (F::Decomposition, T::ResidualRatio),
        (F::WeightedDelta, T::NextFlight),
        (F::WeightedDecomposition, T::Telescoping),
        (F::SpectralHistory, T::UnbiasedRayMarching),
        (F::SpectralAvg, T::PowerSeries),
        (F::Hero, T::Delta),
    ];
    for of in MEDIA {
        for (flight, transmittance) in pairs {
            all_hold(&checks(&a, &standard(), of, &medium(of, flight, transmittance)));
        }
    }
}

#[test]
fn wrong_formulas_are_seen() {
    let Some(a) = adapter() else { return };
    let plants = [
        (1, "medium/linear", "2.0 * profile_slope(ray) * depth", "1.0 * profile_slope(ray) * depth"),
        (1, "medium/linear", "(b - a) * 0.5 *", "(b - a) * 0.505 *"),
        (2, "medium/exponential", "return a - log(max(1.0 - x, 0x1p-126)) / slope;", "return a + even;"),
        (
            2,
            "medium/exponential",
            "medium_density(ray_at(ray, b))) / slope",
            "medium_density(ray_at(ray, b))) / abs(slope)",
        ),
        (2, "majorant/profile", "select(exp(-step) *", "select(exp(-step - 0.3) *"),
        (3, "medium/profile", "params.profile_offset + dot", "params.profile_offset + 0.01 + dot"),
        (
            0,
            "flight/closed_form",
            "spectrum_step(flight, passed * params.sigma, hit);",
            "spectrum_step(flight, 0.0, hit);",
        ),
    ];
    for (i, file, from, to) in plants {
        let exact = (FreeFlight::ClosedForm, Transmittance::ClosedForm);
        let bounded = (FreeFlight::Delta, Transmittance::Delta);
        let (flight, transmittance) = if file.starts_with("majorant") { bounded } else { exact };
        let scene = medium(MEDIA[i], flight, transmittance);
        one_sees(to, &checks(&a, &plant(file, from, to).source, MEDIA[i], &scene));
    }
}

#[test]
fn an_infinite_atmosphere_ends() {
    let Some(a) = adapter() else { return };
    let mut scene = medium(MEDIA[3], FreeFlight::Delta, Transmittance::Ratio);
    let infinite = f64::INFINITY;
    scene.volume.bounds = Bounds([DVec3::new(-infinite, 0.0, -infinite), DVec3::INFINITY]);
    scene.volume.to_world = Matrix::IDENTITY;
    let mut probe = Probe::with_field(&a.gpu, &scene, Field::load(&scene.volume).expect("a formula"));
    probe.params.seed = 4;
    // Up from below, aslant, down from far above: the optical depth of each is H over the sine of its height.
    let rays = [
        ([0.0, 0.0, 0.0f32], [0.0, 1.0, 0.0f32]),
        ([3.0, 0.0, 1.0], [0.8, 0.6, 0.0]),
        ([0.0, 9e4, 0.0], [0.0, -1.0, 0.0]),
    ];
    let inputs: Vec<[f32; 4]> =
        rays.iter().flat_map(|(o, d)| [[o[0], o[1], o[2], 0.0], [d[0], d[1], d[2], 0.0]]).collect();
    const STREAMS: usize = 128;
    let slice = Slice { samples: 32, ..Slice::default() };
    let out = probe.run(&standard(), "transmittance", &inputs, 4 * rays.len() * STREAMS, 4, slice);
    for (i, (_, d)) in rays.iter().enumerate() {
        let truth = (-0.7 * 0.6 / f64::from(d[1].abs())).exp();
        let total = |k: usize, c: usize| {
            out.chunks(4).skip(i).step_by(rays.len()).map(|v| f64::from(v[k][c])).sum::<f64>() / (32 * STREAMS) as f64
        };
        let (mean, steps) = (total(0, 0), total(1, 3));
        assert!((mean / truth - 1.0).abs() < 0.05, "{d:?}: {mean} for {truth}");
        assert!(steps < 200.0, "{d:?}: {steps} segments a ray");
    }
}
