//! Voxels: transmittance and single scattering against quadrature through the interpolated field, majorants against one
//! another, and the volume's transform.

use glam::DMat3;
use nephele::scene::value::Auto;
use nephele::scene::{MajorantKind, Precision};
use nephele::volume::Dense;
use nephele::volume::majorant::Padded;

use super::support::statistics::simpson;
use super::support::{field_of, random_dense};
use super::*;

const SAMPLES: u32 = 1536;
const E: f64 = 3.0;
const G: f64 = 0.4;
const ALBEDO: f64 = 0.8;
const SUN: DVec3 = DVec3::new(0.5, 0.8, -0.3);
/// Side of a voxel in the world.
const VOXEL: f64 = 0.25;

fn voxels() -> Dense {
    random_dense([14, 11, 9], 6)
}

/// The field on the CPU: extinction along rays in the world.
struct Oracle {
    padded: Padded,
    nearest: bool,
    density: f64,
}

impl Oracle {
    fn new(dense: &Dense, nearest: bool, density: f64) -> Oracle {
        Oracle { padded: Padded::new(dense, |x| x), nearest, density }
    }

    fn extinction(&self, p: DVec3) -> f64 {
        // Texel space: index 0 has its centre at 1.5.
        let q = (p / VOXEL + 1.5).to_array();
        let size = self.padded.size.as_dvec3().to_array();
        if (0..3).any(|i| q[i] <= 0.5 || q[i] >= size[i] - 0.5) {
            return 0.0;
        }
        let q = if self.nearest { q.map(|x| x.floor() + 0.5) } else { q };
        self.density * f64::from(self.padded.max) * self.padded.trilinear(q)
    }

    /// ∫ extinction dt over `length` from `from` along the unit vector `along`.
    fn depth(&self, from: DVec3, along: DVec3, length: f64) -> f64 {
        let steps = 2 * ((length / VOXEL * if self.nearest { 40.0 } else { 10.0 }).ceil() as usize).max(1);
        if self.nearest {
            let h = length / steps as f64;
            return (0..steps).map(|i| self.extinction(from + along * (h * (i as f64 + 0.5))) * h).sum();
        }
        simpson(|t| self.extinction(from + along * t), 0.0, length, steps)
    }

    /// Radiance of single scattering along a ray, over `length`.
    fn single(&self, from: DVec3, along: DVec3, length: f64) -> f64 {
        const STEPS: usize = 1200;
        let sun = SUN.normalize();
        let h = length / STEPS as f64;
        let mut before = 0.0f64;
        let mut sum = 0.0;
        for i in 0..STEPS {
            let p = from + along * (h * (i as f64 + 0.5));
            let mu = self.extinction(p);
            if mu > 0.0 {
                // Over a step the transmittance falls by exp(−mu h): its mean, not its middle.
                let mean = (-before).exp() * (1.0 - (-mu * h).exp());
                sum += mean * (-self.depth(p, sun, 4.5)).exp();
                before += mu * h;
            }
        }
        sum * ALBEDO * hg_value(G, along.dot(sun)) * E
    }
}

/// Points that rays go through, and their directions.
const RAYS: [(DVec3, DVec3); 3] = [
    (DVec3::new(1.63, 1.27, 1.04), DVec3::new(1.0, 0.03, 0.02)),
    (DVec3::new(1.2, 1.5, 0.7), DVec3::new(0.4, -0.7, 0.6)),
    (DVec3::new(2.1, 0.8, 1.1), DVec3::new(-0.6, 0.2, -0.9)),
];

/// A majorant and the side of its cells.
type Cells = (MajorantKind, Auto<u32>);

/// Cells so small that every ray crosses many.
const SMALL: Cells = (MajorantKind::Grid, Auto::Is(2));

fn quadrature_checks(a: &Adapter, source: &Source, nearest: bool, cells: Cells) -> Vec<Check> {
    let density = 0.5;
    let mut checks = Vec::new();
    // The last case: voxels that are all the same, so that majorants are tight.
    let mut flat = voxels();
    flat.data.fill(2.0);
    let cases = RAYS.map(|ray| (voxels(), ray)).into_iter().chain([(flat, RAYS[1])]);
    for (i, (dense, (through, along))) in cases.enumerate() {
        let oracle = Oracle::new(&dense, nearest, density);
        let mut scene = unit_cube(density);
        scene.volume.analytic = Analytic::None;
        scene.volume.precision = Precision::F32;
        (scene.tracking.majorant, scene.tracking.cell) = cells;
        hg(&mut scene, G);
        albedo(&mut scene, ALBEDO);
        scene.lights = vec![sun(SUN, E)];
        scene.integrator.max_bounces = Limit::AtMost(1);
        let along = along.normalize();
        look(&mut scene, through - 5.0 * along, through, 0.1);
        let field = field_of(dense, DMat4::IDENTITY, nearest);
        let picture = draw_with(a, source, &scene, Some(field), SAMPLES, false);
        let (from, length) = (through - 5.0 * along, 10.0);
        let name = format!("ray {i}, nearest {nearest}, {cells:?}");
        checks.push(picture.against_depth(&name, oracle.depth(from, along, length)));
        checks.push(picture.against(&format!("single scattering, {name}"), oracle.single(from, along, length)));
    }
    checks
}

#[test]
fn voxels_scatter_what_quadrature_says() {
    let Some(a) = adapter() else { return };
    for nearest in [false, true] {
        for cells in [(MajorantKind::Global, Auto::Auto), (MajorantKind::Grid, Auto::Auto), SMALL] {
            all_hold(&quadrature_checks(&a, &standard(), nearest, cells));
        }
    }
    let plants = [
        ("half a voxel aside", "medium/dense", "medium_sampler, p * params", "medium_sampler, (p + 0.5) * params"),
        (
            "density 2 % up",
            "track/step",
            "density = medium_density(ray_at(*ray, t));",
            "density = 1.02 * medium_density(ray_at(*ray, t));",
        ),
        (
            "majorant a tenth down",
            "majorant/grid",
            "bitcast<f32>(words.x & ~GRID_LEVEL_BITS)",
            "0.9 * bitcast<f32>(words.x & ~GRID_LEVEL_BITS)",
        ),
        (
            "shadow roulette without its weight",
            "track/step",
            "select(0.0, *played * roulette / strongest, survives)",
            "select(0.0, *played, survives)",
        ),
        ("acceptance the other way", "flight/delta", "u * segment.bound < density;", "u * segment.bound > density;"),
        (
            "shadows see the majorant",
            "transmittance/ratio",
            "*t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);",
            "*t *= Spectrum(1.0) - spectrum_extinction() * (0.5 * (1.0 + density / segment.bound));",
        ),
        ("depth kept over a face", "track/step", "    *depth -= available;\n", ""),
        (
            "one number for distance and acceptance",
            "track/step",
            "let u = rng_next(rng);\n        var density = 0.0;",
            "let u = exp(-*depth);\n        var density = 0.0;",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &quadrature_checks(&a, &plant(file, from, to).source, false, SMALL));
    }
}

fn cloud(seed: u32) -> Scene {
    let mut scene = Scene::default();
    scene.volume.resolution = 24;
    // Thin enough for light to come through: in thick clouds errors hide.
    scene.medium.density_scale = Auto::Is(6.0);
    (scene.film.width, scene.film.height) = (SIDE, SIDE);
    scene.integrator.seed = seed;
    scene
}

#[test]
fn every_majorant_gives_the_same_picture() {
    let Some(a) = adapter() else { return };
    // Blocks of even density: majorants of small cells are tight in them.
    let shot = |source: &Source, cells: Cells, seed| {
        let (mut scene, field) = placed(DMat4::IDENTITY, DMat3::IDENTITY, seed, voxels());
        (scene.tracking.majorant, scene.tracking.cell) = cells;
        draw_with(&a, source, &scene, Some(field), 512, false)
    };
    let reference = shot(&standard(), (MajorantKind::Global, Auto::Auto), 1);
    let cells = [Auto::Auto, Auto::Is(1), Auto::Is(3), Auto::Is(8)];
    let mut lookups = Vec::new();
    for (i, cell) in cells.into_iter().enumerate() {
        let picture = shot(&standard(), (MajorantKind::Grid, cell), 2 + i as u32);
        all_hold(&same(&format!("global and cells of {cell:?}"), &reference, &picture));
        lookups.push(picture.counters.lookups);
    }
    // Tighter majorants save lookups.
    assert!(lookups[1] < lookups[2] && lookups[2] < lookups[3], "{lookups:?}");
    assert!(lookups.iter().all(|&n| n < reference.counters.lookups), "{lookups:?} {:?}", reference.counters);
    let low = plant(
        "majorant/grid",
        "bitcast<f32>(words.x & ~GRID_LEVEL_BITS)",
        "0.5 * bitcast<f32>(words.x & ~GRID_LEVEL_BITS)",
    );
    let wrong = shot(&low.source, (MajorantKind::Grid, Auto::Is(1)), 9);
    one_sees("half the majorant", &same("global and a wrong grid", &reference, &wrong));
}

#[test]
fn precisions_give_the_same_picture_but_for_their_rounding() {
    let Some(a) = adapter() else { return };
    let with = |precision, seed| {
        let mut scene = cloud(seed);
        scene.volume.precision = precision;
        draw(&a, &standard(), &scene, 128)
    };
    let reference = with(Precision::F32, 1);
    all_hold(&same("32 and 16 bits", &reference, &with(Precision::F16, 2)));
    all_hold(&same("32 and 8 bits", &reference, &with(Precision::U8, 3)));
}

/// Voxels in a sun and a little sky, placed by `to_world`; the camera and the sun moved along by `rigid`.
fn placed(to_world: DMat4, rigid: DMat3, seed: u32, dense: Dense) -> (Scene, Field) {
    let mut scene = unit_cube(1.0);
    scene.volume.analytic = Analytic::None;
    place(&mut scene, to_world);
    hg(&mut scene, 0.6);
    albedo(&mut scene, 0.9);
    scene.lights = vec![sun(rigid * SUN, E), constant(0.3)];
    scene.integrator.seed = seed;
    look(&mut scene, rigid * DVec3::new(2.0, 1.0, 9.0), rigid * DVec3::new(1.7, 1.3, 1.0), 28.0);
    scene.camera.up = rigid * DVec3::Y;
    (scene, field_of(dense, to_world, false))
}

#[test]
fn a_transform_moves_turns_stretches_and_mirrors() {
    let Some(a) = adapter() else { return };
    let shot = |to_world, rigid, seed, dense| {
        let (scene, field) = placed(to_world, rigid, seed, dense);
        draw_with(&a, &standard(), &scene, Some(field), 128, false)
    };
    let reference = shot(DMat4::IDENTITY, DMat3::IDENTITY, 1, voxels());
    let turn = DMat3::from_rotation_x(0.8) * DMat3::from_rotation_z(-1.9);
    let turned = shot(DMat4::from_mat3(turn), turn, 2, voxels());
    all_hold(&same("turned volume, camera and sun", &reference, &turned));
    // What stands in the file's own transform may as well stand in the scene.
    let stretch = DMat4::from_scale(DVec3::new(1.3, 0.7, 1.1)) * DMat4::from_rotation_y(0.2);
    let by_scene = shot(stretch, DMat3::IDENTITY, 3, voxels());
    let mut dense = voxels();
    dense.world_from_index = stretch * dense.world_from_index;
    let by_file = shot(DMat4::IDENTITY, DMat3::IDENTITY, 4, dense);
    all_hold(&same("stretched by the scene and by the file", &by_scene, &by_file));
    one_sees("no stretch", &same("stretched and not", &by_scene, &reference));
    // A mirrored volume, camera and sun show the mirrored picture.
    let flip = DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0));
    let mirrored = shot(DMat4::from_mat3(flip), flip, 5, voxels());
    let side = SIDE as usize;
    let to = |p: usize| p / side * side + side - 1 - p % side;
    all_hold(&same_mapped("mirrored", &reference, &mirrored, to));
    one_sees("not mirrored", &same("mirrored", &reference, &mirrored));
}
