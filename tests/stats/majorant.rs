//! Walks through the majorant cells: their segments cover the ray without gaps, and each bound holds on its segment.

use glam::{DMat4, DVec3};
use nephele::render::params::Slice;
use nephele::scene::value::Auto;
use nephele::scene::{MajorantKind, Precision, Scene};
use nephele::volume::majorant::Padded;

use super::probe::Probe;
use super::support::{Adapter, Dice, adapter, field_of, plant, random_dense};
use super::*;

const SIZE: [u32; 3] = [37, 18, 25];
const RAYS: usize = 3000;
/// More segments than any ray here can cross.
const MOST: usize = 256;

/// A ray: origin in local space, direction in the world.
#[derive(Clone, Copy, Debug)]
struct Ray {
    origin: DVec3,
    direction: DVec3,
}

/// Rays of every nasty kind: random, along the axes, along faces, edges and through corners of cells, from inside, from
/// far away.
fn rays(local_from_world: DMat4, low: DVec3, high: DVec3) -> Vec<Ray> {
    let mut dice = Dice::new(11);
    let world_from_local = local_from_world.inverse();
    (0..RAYS)
        .map(|i| {
            let inside = low + (high - low) * DVec3::new(dice.next(), dice.next(), dice.next());
            let corner = (inside / 4.0).round() * 4.0;
            let axis = DVec3::AXES[i / 8 % 3] * if i / 24 % 2 == 0 { 1.0 } else { -1.0 };
            // Directions along local axes, taken to the world.
            let along = |local: DVec3| world_from_local.transform_vector3(local).normalize();
            let (origin, direction) = match i % 8 {
                0 => (inside, dice.direction()),
                1 => (inside - axis * 100.0, along(axis)),
                2 => (corner - axis * 100.0, along(axis)), // along an edge of cells
                3 => (DVec3::new(corner.x, inside.y, inside.z) - axis * 50.0, along(axis)), // in or across a face
                4 => {
                    let diagonal = DVec3::new(1.0, if i / 8 % 2 == 0 { 1.0 } else { -1.0 }, 1.0);
                    (corner - diagonal * 40.0, along(diagonal)) // through corners
                }
                5 => {
                    let from = corner - axis * 30.0 + dice.direction() * 20.0;
                    (from, along(corner - from)) // at a corner from anywhere
                }
                6 => {
                    let from = inside + dice.direction() * 1e4; // far away
                    (from, along(inside - from))
                }
                _ => (corner.clamp(low, high), dice.direction()), // from a corner
            };
            Ray { origin, direction }
        })
        .collect()
}

struct Faults {
    gaps: usize,
    unfinished: usize,
    above: usize,
    above_cpu: usize,
    segments: usize,
}

fn walk(a: &Adapter, source: &Source, scene: &Scene, to_world: DMat4, nearest: bool) -> Faults {
    let dense = random_dense(SIZE, 4);
    let padded = Padded::new(&dense, |x| match scene.volume.precision {
        Precision::F32 => x,
        Precision::U8 => (x * 255.0).round() / 255.0,
        Precision::F16 | Precision::Auto => half::f16::from_f32(x).to_f32(),
    });
    let probe = Probe::with_field(&a.gpu, scene, field_of(dense, to_world, nearest));
    let (low, high) = probe.medium.field.local_box();
    let local_from_world = probe.medium.field.local_from_world();
    let rays = rays(local_from_world, low, high);
    let four = |v: DVec3| [v.x as f32, v.y as f32, v.z as f32, 0.0];
    let inputs: Vec<[f32; 4]> = rays.iter().flat_map(|r| [four(r.origin), four(r.direction)]).collect();
    let slice = Slice { samples: MOST as u32, ..Slice::default() };
    let out = probe.run(source, "majorant", &inputs, MOST * rays.len(), MOST, slice);
    let mut faults = Faults { gaps: 0, unfinished: 0, above: 0, above_cpu: 0, segments: 0 };
    let local_from_unit = glam::DMat3::from_mat4(local_from_world) * probe.medium.unit;
    for (ray, found) in rays.iter().zip(out.chunks(MOST)) {
        let [start, exit, epsilon, travelled] = found[0].map(f64::from);
        if exit <= start {
            continue;
        }
        let mut t = start;
        for &[bound, from, to, excess] in &found[1..] {
            if t >= exit || (bound, to) == (0.0, 0.0) {
                break;
            }
            let (bound, from, to) = (f64::from(bound), f64::from(from), f64::from(to));
            faults.segments += 1;
            faults.gaps += usize::from(from != t || to < from);
            faults.above += usize::from(excess > 0.0);
            // The same on the CPU, at the middle of the segment.
            let p = ray.origin + local_from_unit * ray.direction * (travelled + 0.5 * (from + to));
            let density = if nearest { 0.0 } else { padded.trilinear(p.clamp(low, high).to_array()) };
            // A ray from afar is a little off where it enters.
            faults.above_cpu += usize::from(density > bound + if travelled > 1e3 { 0.01 } else { 1e-3 });
            t = to.max(t);
        }
        faults.unfinished += usize::from(t < exit - epsilon);
    }
    faults
}

fn scene(majorant: MajorantKind, cell: Auto<u32>, density: f64, precision: Precision) -> Scene {
    let mut scene = Scene::default();
    scene.tracking.majorant = majorant;
    scene.tracking.cell = cell;
    scene.medium.density_scale = Auto::Is(density);
    scene.volume.precision = precision;
    scene
}

fn placements() -> [DMat4; 2] {
    let turned = DMat4::from_rotation_x(0.7) * DMat4::from_rotation_y(-0.4);
    [
        DMat4::IDENTITY,
        turned * DMat4::from_scale(DVec3::new(-2.0, 0.5, 1.0)) * DMat4::from_translation(DVec3::splat(3.0)),
    ]
}

/// Every structure of majorants, in thin and thick media.
fn scenes() -> Vec<Scene> {
    let mut all = vec![scene(MajorantKind::Global, Auto::Auto, 1.0, Precision::F32)];
    for side in [1, 3, 4, 8, 64] {
        all.push(scene(MajorantKind::Grid, Auto::Is(side), 1.0, Precision::F32));
    }
    all.push(scene(MajorantKind::Grid, Auto::Is(2), 1.0, Precision::U8));
    for density in [0.01, 1.0, 100.0] {
        for kind in [MajorantKind::Grid, MajorantKind::KdTree, MajorantKind::Hierarchy] {
            all.push(scene(kind, Auto::Auto, density, Precision::F16));
        }
    }
    all
}

#[test]
fn segments_cover_the_ray_and_bound_the_density() {
    let Some(a) = adapter() else { return };
    for to_world in placements() {
        for scene in scenes() {
            for nearest in [false, true] {
                let f = walk(&a, &standard(), &scene, to_world, nearest);
                let what = format!("{:?}, density {:?}", scene.tracking, scene.medium.density_scale);
                assert!(f.segments > RAYS / 2, "rays meet the volume: {} segments, {what}", f.segments);
                assert_eq!(f.gaps, 0, "gaps: {what}");
                assert_eq!(f.unfinished, 0, "rays that do not reach their end: {what}");
                assert_eq!(f.above, 0, "points above their bound: {what}");
                assert_eq!(f.above_cpu, 0, "points above their bound on the CPU: {what}");
            }
        }
    }
}

#[test]
fn wrong_walks_are_seen() {
    let Some(a) = adapter() else { return };
    let faults = |cell: Auto<u32>, from: &str, to: &str| {
        let planted = plant("majorant/grid", from, to);
        let scene = scene(MajorantKind::Grid, cell, 30.0, Precision::F16);
        walk(&a, &planted.source, &scene, placements()[1], false)
    };
    let uniform = Auto::Is(4);
    // A majorant that is a tenth too low, one of the neighbour, one that is held too long, a level that is not read.
    let f =
        faults(uniform, "bitcast<f32>(words.x & ~GRID_LEVEL_BITS)", "0.9 * bitcast<f32>(words.x & ~GRID_LEVEL_BITS)");
    assert!(f.above > 100 && f.above_cpu > 100, "{} {}", f.above, f.above_cpu);
    let f = faults(uniform, "floor(p * params.inv_cell)", "floor(p * params.inv_cell + 0.5)");
    assert!(f.above > 100, "{}", f.above);
    let f = faults(uniform, "let face = select(low, low + side,", "let face = select(low - side, low + 2.0 * side,");
    assert!(f.above > 100, "{}", f.above);
    let f = faults(Auto::Auto, "let low = vec3f(c >> vec3u(level)) * side", "let low = vec3f(c) * side");
    assert!(f.above + f.unfinished + f.gaps > 100);
    let f = faults(Auto::Auto, "f32(1u << level)", "f32(2u << level)");
    assert!(f.above + f.unfinished > 100, "{} {}", f.above, f.unfinished);
    // Leaves of a kd-tree that begin a cell early, that end a cell late, of axes that are mixed up.
    let tree = |from: &str, to: &str| {
        let planted = plant("majorant/tree", from, to);
        let scene = scene(MajorantKind::KdTree, Auto::Auto, 30.0, Precision::F16);
        let f = walk(&a, &planted.source, &scene, placements()[1], false);
        assert!(f.above + f.unfinished + f.gaps > 100, "{to}: {} {} {}", f.above, f.unfinished, f.gaps);
    };
    tree("vec3f(c - before)", "vec3f(c - before - 1)");
    tree("& vec3u(TREE_SPAN)) + 1;", "& vec3u(TREE_SPAN)) + 2;");
    tree("vec3u(0u, TREE_SPAN_BITS, 2u * TREE_SPAN_BITS)", "vec3u(2u * TREE_SPAN_BITS, TREE_SPAN_BITS, 0u)");
    // The last layers of cells are never looked at.
    let f = faults(Auto::Is(3), "vec3i(0), params.last_cell)", "vec3i(0), params.last_cell - 1)");
    assert!(f.above + f.unfinished > 100, "{} {}", f.above, f.unfinished);
}
