//! Identities of reuse that no picture shows: shift maps and their inverses, pairs, reservoirs in memory, tables, targets.

use glam::{DMat3, DMat4, DVec3};
use nephele::render::params::Slice;
use nephele::scene::value::Auto;
use nephele::scene::{Constant, Light, Mode, Scene, Sun};

use super::probe::Probe;
use super::support::{Adapter, Dice, adapter, field_of, plant, plant_all, random_dense};
use super::*;

/// Pixels of a probe's picture.
const PIXELS: usize = 64 * 64;

/// Functions of the kernel.
const SHIFT: u32 = 0;
const PAIR: u32 = 1;
const PACK: u32 = 2;
const TABLE: u32 = 3;
const LEG: u32 = 4;
const FLIGHT: u32 = 5;
const TARGET: u32 = 6;

/// Blocks of voxels from a corner, in a sun and a sky; pixels are smaller than voxels.
fn probe(a: &Adapter, distance: f64) -> Probe {
    probe_of(a, distance, random_dense([12, 11, 13], 4))
}

fn probe_of(a: &Adapter, distance: f64, dense: nephele::volume::Dense) -> Probe {
    let mut scene = Scene::default();
    scene.integrator.mode = Mode::Restir;
    scene.medium.density_scale = Auto::Is(2.0);
    scene.camera.position = Auto::Is(DVec3::new(0.5, 0.3, 1.0).normalize() * distance);
    scene.camera.target = Auto::Is(DVec3::splat(1.5));
    scene.lights = vec![Light::Sun(Sun::default()), Light::Constant(Constant::default())];
    let field = field_of(dense, DMat4::IDENTITY, false);
    let mut probe = Probe::with_field(&a.gpu, &scene, field);
    probe.variant = probe.variant.clone().flag("REUSE_SECOND", true).flag("CAMERA_LENS", false);
    probe
}

fn run(probe: &Probe, source: &Source, what: u32, number: u32, inputs: &[[f32; 4]], outputs: usize) -> Vec<[f32; 4]> {
    let slice = Slice { first_group: what, first_sample: number, ..Slice::default() };
    probe.run(source, "reuse", inputs, 2 * outputs, 2, slice)
}

/// Two cameras at most 40° apart, one up to twice as far away, that look at points near the middle; a distance of each.
fn views() -> Vec<[f32; 4]> {
    let mut dice = Dice::new(12);
    let mut all = Vec::new();
    for _ in 0..10_000 {
        let place = dice.direction() * dice.between(3.0, 6.0);
        let turn = DMat3::from_axis_angle(dice.direction(), dice.between(-40.0, 40.0f64).to_radians());
        let other = turn * place * dice.between(0.5, 2.0);
        let aim = |dice: &mut Dice| dice.direction() * dice.between(0.0, 0.5);
        let directions = [aim(&mut dice) - place, aim(&mut dice) - other];
        let point = |p: DVec3, w: f64| [p.x as f32, p.y as f32, p.z as f32, w as f32];
        let t = place.length() * dice.between(0.3, 1.5);
        all.extend([point(place, t), point(directions[0], 0.0), point(other, 0.0), point(directions[1], 0.0)]);
    }
    all
}

/// What is wrong with shifts: there and back, the Jacobian against differences in 64 bits, and the foot of the
/// perpendicular.
fn shift_errors(a: &Adapter, source: &Source) -> [f64; 3] {
    let inputs = views();
    let probe = probe(a, 6.0);
    // Points are given in local space.
    let local = DMat3::from_cols_array_2d(&[
        probe.params.local_from_world_x.map(f64::from),
        probe.params.local_from_world_y.map(f64::from),
        probe.params.local_from_world_z.map(f64::from),
    ]);
    let mut given = inputs.clone();
    for values in given.chunks_mut(2) {
        let p = local * DVec3::new(values[0][0].into(), values[0][1].into(), values[0][2].into());
        values[0] = [p.x as f32, p.y as f32, p.z as f32, values[0][3]];
    }
    let outputs = run(&probe, source, SHIFT, 0, &given, given.len() / 4);
    let mut worst = [0.0f64; 3];
    for (given, out) in inputs.chunks(4).zip(outputs.chunks(2)) {
        let vector = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let (o, d) = (vector(given[0]), vector(given[1]).normalize());
        let (p, e) = (vector(given[2]), vector(given[3]).normalize());
        let t = f64::from(given[0][3]);
        let foot = |t: f64| (o + d * t - p).dot(e);
        let difference = (foot(t + 1e-3) - foot(t - 1e-3)) / 2e-3;
        let [there, back, kappa, inverse] = out[0].map(f64::from);
        worst[0] = worst[0].max((back - t).abs() / t / (1.0 / kappa.abs()).max(1.0));
        worst[1] = worst[1].max((kappa - difference).abs()).max((kappa - inverse).abs());
        worst[2] = worst[2].max((there - foot(t)).abs() / t);
    }
    worst
}

#[test]
fn shifts_go_there_and_back() {
    let Some(a) = adapter() else { return };
    let errors = shift_errors(&a, &standard());
    assert!(errors.iter().all(|e| *e < 1e-5), "{errors:?}");
    let plants = [
        ("the Jacobian dropped", "dot(a.world, b.world), dot", "1.0, dot"),
        (
            "the offset along the other ray",
            "dot(b.world, ray_world(a.origin - b.origin))",
            "dot(a.world, ray_world(a.origin - b.origin))",
        ),
    ];
    for (what, from, to) in plants {
        let errors = shift_errors(&a, &plant("reuse/shift", from, to).source);
        assert!(errors.iter().any(|e| *e > 1e-2), "{what}: {errors:?}");
    }
}

/// Whether pairs of many frames are pairs; and how often each offset of the smallest reach came.
fn pairs(a: &Adapter, source: &Source) -> (bool, Vec<f64>) {
    let probe = probe(a, 6.0);
    let mut counts = vec![0.0; 9];
    let mut fine = true;
    for frame in 0..60 {
        let outputs = run(&probe, source, PAIR, frame, &[], PIXELS);
        let mut inside = 0;
        for out in outputs.chunks(2) {
            let ([x, y, back_x, back_y], [px, py, side, _]) = (out[0], out[1]);
            if x < 0.0 {
                continue;
            }
            inside += 1;
            fine &= (back_x, back_y) == (px, py) && (x, y) != (px, py) && (x - px).abs().max((y - py).abs()) < side;
            if side == 2.0 {
                counts[((x - px) + 1.0 + 3.0 * (y - py + 1.0)) as usize] += 1.0 / PIXELS as f64;
            }
        }
        // Few pixels have none: those near the edges.
        fine &= inside > PIXELS / 4;
    }
    (fine, counts)
}

#[test]
fn partners_are_one_anothers() {
    let Some(a) = adapter() else { return };
    let (fine, counts) = pairs(&a, &standard());
    assert!(fine);
    // A dozen frames of the smallest reach, where offsets are along either axis or both.
    assert_eq!(counts[4], 0.0, "an offset of none");
    let sides = counts[1] + counts[3] + counts[5] + counts[7];
    let corners = counts[0] + counts[2] + counts[6] + counts[8];
    assert!(sides > 1.0 && corners > 1.0 && sides + corners > 11.0, "{counts:?}");
    let planted = plant(
        "reuse/pair",
        "let mask = vec2u(place % side, place / side);",
        "let mask = vec2u(place % side, (place + position.x) % side);",
    );
    assert!(!pairs(&a, &planted.source).0);
    let planted = plant(
        "reuse/pair",
        "let place = 1u + ((key >> 16u) + round) % (side * side - 1u);",
        "let place = ((key >> 16u) + round) % (side * side);",
    );
    assert!(!pairs(&a, &planted.source).0);
}

#[test]
fn reservoirs_are_what_was_stored() {
    let Some(a) = adapter() else { return };
    let probe = probe(&a, 6.0);
    let fine = |source: &Source| {
        let outputs = run(&probe, source, PACK, 1, &[], 500_000);
        outputs.chunks(2).all(|o| o[0][0] == 0.0 && o[0][1] < 2e-6 && o[0][2] < 1e-6 && o[1][0] == 0.0)
    };
    assert!(fine(&standard()));
    let plants = [
        ("(b.z >> 4u) & 15u, age", "(b.z >> 4u) & 1u, age"),
        ("b.z >> 16u,\n", "b.z >> 16u & 255u,\n"),
        ("(min(r.age, 255u) << 8u)", "(r.age << 8u)"),
        // At the edge of a sun the next direction is another.
        ("RESERVOIR_GRID: f32 = 2097152.0;", "RESERVOIR_GRID: f32 = 4294967296.0;"),
        ("let z = 1.0 - abs(p.x) - abs(p.y);", "let z = abs(1.0 - abs(p.x) - abs(p.y));"),
    ];
    for (from, to) in plants {
        assert!(!fine(&plant("reuse/reservoir", from, to).source), "{to}");
    }
}

/// Of rays' tables: the greatest error of the integral of the density, of the numbers that draw distances, and of the
/// transmittance to them; and the share of the medium that distances do not reach.
fn table_errors(source: &Source, probe: &Probe) -> [f64; 4] {
    let mut worst = [0.0f64; 3];
    let (mut met, mut missed) = (0.0, 0.0);
    for number in 0..2 {
        for out in run(probe, source, TABLE, number, &[], PIXELS).chunks(2) {
            let [sum, difference, any, ratio] = out[0].map(f64::from);
            if any > 0.0 {
                worst[0] = worst[0].max((sum - 1.0).abs());
                worst[1] = worst[1].max(difference.abs());
                worst[2] = worst[2].max(ratio.abs());
            }
            met += f64::from(out[1][0]);
            missed += f64::from(out[1][1]);
        }
    }
    [worst[0], worst[1], worst[2], missed / met]
}

#[test]
fn tables_draw_distances_by_the_density_that_they_tell() {
    let Some(a) = adapter() else { return };
    let probe = probe(&a, 6.0);
    let errors = table_errors(&standard(), &probe);
    assert!(errors[0] < 0.02 && errors[1] < 1e-3 && errors[2] < 1e-3, "{errors:?}");
    let plants = [
        ("reuse/table", "rate * exp(-wanted) / max(opacity, 1e-30)", "exp(-wanted) / max(opacity, 1e-30)"),
        ("reuse/table", "let wanted = leg_inverse(u * opacity);", "let wanted = leg_inverse(u * u * opacity);"),
        ("reuse/leg", "return mix(m.before_grey, m.grey, share);", "return m.grey;"),
    ];
    for (file, from, to) in plants {
        let errors = table_errors(&plant(file, from, to).source, &probe);
        assert!(errors[0] > 0.1 || errors[1] > 0.01 || errors[2] > 0.01, "{to}: {errors:?}");
    }
}

/// Distances reach all that a ray meets: where they do not, light is lost.
#[test]
fn tables_reach_all_that_a_ray_meets() {
    let Some(a) = adapter() else { return };
    let probes = [probe(&a, 6.0), probe(&a, 60.0), probe_of(&a, 500.0, slices([120, 70, 220], 40, 1))];
    for probe in &probes {
        assert_eq!(table_errors(&standard(), probe)[3], 0.0);
    }
    let late = plant("reuse/leg", "return LegMarch(ray.t, 0.0", "return LegMarch(mix(ray.t, far, 0.2), 0.0");
    assert!(table_errors(&late.source, &probes[0])[3] > 1e-3);
}

/// Blocks of voxels in slices `every` voxels apart and so many thick.
fn slices(size: [u32; 3], every: u32, thick: u32) -> nephele::volume::Dense {
    let mut dense = random_dense(size, 4);
    for (i, value) in (0..).zip(&mut dense.data) {
        if i % size[0] % every >= thick {
            *value = 0.0;
        }
    }
    dense
}

/// The share of the medium that legs pass without loss of light, in slices of a volume of `size` voxels.
fn passed_by_legs(a: &Adapter, source: &Source, size: [u32; 3]) -> f64 {
    let probe = probe_of(a, 6.0, slices(size, 190, 6));
    let outputs = run(&probe, source, LEG, 5, &[], 100_000);
    let sum = |i: usize| outputs.chunks(2).map(|o| f64::from(o[0][i])).sum::<f64>();
    sum(1) / sum(0)
}

#[test]
fn legs_miss_nothing_of_the_medium() {
    let Some(a) = adapter() else { return };
    for size in [[13, 12, 11], [70, 60, 50], [1100, 9, 8]] {
        assert_eq!(passed_by_legs(&a, &standard(), size), 0.0, "{size:?}");
    }
    let planted = plant("reuse/leg", "min(wanted, proxy_coarsest())", "wanted + 4.0");
    assert!(passed_by_legs(&a, &planted.source, [1100, 9, 8]) > 0.01);
}

/// How many times darker legs look than they are, at worst but for one in a hundred, where a thousandth of the light or more is
/// left: in slices of blocks, a voxel of which takes a tenth of the light to a half.
fn darkness_of_legs(a: &Adapter, source: &Source) -> f64 {
    let mut dense = slices([64, 64, 256], 24, 6);
    dense.data.iter_mut().for_each(|value| *value *= 0.2);
    let outputs = run(&probe_of(a, 6.0, dense), source, LEG, 5, &[], 100_000);
    let legs = outputs.chunks(2).map(|o| (f64::from(o[1][2]), f64::from(o[1][3])));
    let mut darker: Vec<f64> = legs.filter(|leg| leg.1 < 1e3f64.ln()).map(|leg| (leg.0 - leg.1).exp()).collect();
    darker.sort_by(f64::total_cmp);
    darker[darker.len() * 99 / 100]
}

#[test]
fn legs_look_hardly_darker_than_they_are() {
    let Some(a) = adapter() else { return };
    let honest = darkness_of_legs(&a, &standard());
    assert!(honest < 12.0, "{honest}");
    for (from, to) in
        [("LEG_DIM: f32 = 0.02;", "LEG_DIM: f32 = 1.0;"), ("LEG_LOSS: f32 = 0.1;", "LEG_LOSS: f32 = 0.5;")]
    {
        let planted = darkness_of_legs(&a, &plant("reuse/leg", from, to).source);
        assert!(planted > 2.0 * honest, "{to} {honest} {planted}");
    }
}

/// Flights that end where they should not, and the greatest error of their densities in the mean over many.
fn flight_errors(a: &Adapter, source: &Source) -> [f64; 2] {
    const FLIGHTS: usize = 100_000;
    let outputs = run(&probe(a, 6.0), source, FLIGHT, 7, &[], FLIGHTS);
    let sum = |i: usize| outputs.chunks(2).map(|o| f64::from(o[0][i])).sum::<f64>() / FLIGHTS as f64;
    [sum(0), sum(1).abs()]
}

#[test]
fn flights_have_the_density_that_they_tell() {
    let Some(a) = adapter() else { return };
    let errors = flight_errors(&a, &standard());
    assert!(errors[0] < 1e-3 && errors[1] < 0.01, "{errors:?}");
    let plants =
        [("return (m.grey - m.before_grey) /", "return m.grey /"), ("let wanted = leg_inverse(u);", "let wanted = u;")];
    for (from, to) in plants {
        let errors = flight_errors(&a, &plant("reuse/leg", from, to).source);
        assert!(errors[0] > 0.01 || errors[1] > 0.05, "{to}: {errors:?}");
    }
}

#[test]
fn targets_are_not_random_and_nowhere_zero() {
    let Some(a) = adapter() else { return };
    let probe = probe(&a, 6.0);
    let draw = || run(&probe, &standard(), TARGET, 3, &[], PIXELS);
    let (first, second) = (draw(), draw());
    let bits = |all: &[[f32; 4]]| all.iter().flat_map(|v| v.map(f32::to_bits)).collect::<Vec<_>>();
    assert!(bits(&first) == bits(&second));
    let (mut carrying, mut lost) = (0, 0);
    for out in first.chunks(2) {
        carrying += i32::from(out[0][1] > 0.0);
        lost += i32::from(out[0][1] > 0.0 && out[0][0] <= 0.0);
    }
    assert!(carrying > 500 && lost == 0, "{lost} of {carrying}");
    let redrawn = |all: &[[f32; 4]]| all.chunks(2).filter(|out| out[0][0].to_bits() != out[0][2].to_bits()).count();
    assert_eq!(redrawn(&first), 0);
    // Another number each time, as of random estimates.
    let random = "let drawn = exp(-grey) * fract(0.618 * target_drawn);\n    target_drawn += 1.0;\n    return drawn;";
    let planted = plant_all(&[
        ("reuse/target", "    return exp(-grey);", random),
        (
            "reuse/target",
            "// What a path carries but",
            "var<private> target_drawn: f32 = 1.0;\n// What a path carries but",
        ),
    ]);
    assert!(redrawn(&run(&probe, &planted.source, TARGET, 3, &[], PIXELS)) > carrying as usize / 2);
}
