//! Partition of unity, through the passes themselves: where all that a pixel meets is its own path, shifted to where it comes
//! from, with the weight that this path has, the weights of all techniques add up to 1, and so does what is left.

use super::*;
use ensemble::frame;

/// Relative error of a target after a shift there and back, about: voxels are rough. So many in a thousand may have more.
const ROUNDING: f64 = 1e-3;
const ROUGH: usize = 10;

/// An edit of a kernel.
type Edit = (&'static str, &'static str, &'static str);

/// The pixel's own path counts 1.
const OWN: &str = "own.weight = select(0.0, 1.0 / own.aim, own.aim > 0.0);\n";

/// The temporal pass where the frame before holds the own path: as it is there by the inverse shift.
fn of_the_frame_before() -> [(&'static str, &'static str, String); 2] {
    let shifted = "
        let there_view = view_ray(q, view_turn(own.path.film, -turn));
        params = params_uniform;
        let here_view = view_ray(position, own.path.film);
        let map = shift_affine(there_view, here_view);
        let t = (own.path.t - map.offset) / map.kappa;
        let here_place = view_at(here_view, own.path.t);
        let there_place = view_at(there_view, t);
        let keeps = shift_keeps(own.path, here_place, there_place, frame.reconnect);
        old.path = shift_follow(own.path, here_place, there_place);
        old.path.film = view_turn(own.path.film, -turn);
        old.path.t = t;
        params = frame_previous;
        light_begin(frame.old_lights);
        old.aim = target_value(q, old.path);
        light_begin(0u);
        let meets = own.aim > 0.0 && map.kappa > 0.0 && t > 0.0 && keeps && temporal_holds(frame, own.path.kind);
        old.weight = select(0.0, 1.0 / (own.aim * map.kappa), meets);
    // The rays of both film samples in both frames.
";
    let loads = "var own = reservoir_load(pixel);\n";
    [
        ("reuse/temporal", loads, format!("{loads}    {OWN}")),
        ("reuse/temporal", "    // The rays of both film samples in both frames.\n", shifted.to_owned()),
    ]
}

/// The merging pass where all neighbours hold the own path: it has the aim there that the pass before found.
fn of_all_neighbours() -> [(&'static str, &'static str, String); 3] {
    let loads = "var kept = reservoir_load(pixel);\n";
    let count = "kept.weight = select(0.0, 1.0 / kept.aim, kept.aim > 0.0);\n";
    let other = "let other = reservoir_load(other_pixel);\n";
    let here = "let here = pair_aims[round * pixels + other_pixel];\n";
    let shifted = "
    let here = select(0.0, own.aim, partner.x >= 0 && there > 0.0);
    other.aim = there;
    other.weight = 1.0 / own.aim;
";
    [
        ("reuse/merge", loads, format!("{loads}    {count}")),
        ("reuse/pairwise", other, "var other = reservoir_load(other_pixel);\n".to_owned()),
        ("reuse/pairwise", here, shifted.to_owned()),
    ]
}

/// Pixels whose weights do not add up to 1 after the last of `frames` along a course, and those that hold a path.
fn torn(
    a: &Adapter,
    edits: &[(&str, &str, String)],
    plant: Option<Edit>,
    frames: u32,
    at: &dyn Fn(u32) -> Scene,
) -> [usize; 2] {
    let mut all: Vec<(&str, &str, &str)> = edits.iter().map(|(file, from, to)| (*file, *from, to.as_str())).collect();
    all.extend(plant);
    let planted = support::plant_all(&all);
    let mut r = renderer(a, &planted.source, &at(0), Some(cloud_field()), false);
    (0..frames).rev().for_each(|left| frame(&mut r, &at(left), left + 1 == frames));
    let kept = kept(&r);
    let holding: Vec<&Reservoir> = kept.iter().filter(|kept| kept.holds()).collect();
    let torn = holding.iter().filter(|kept| (kept.weight() - 1.0).abs() > ROUNDING).count();
    [torn, holding.len()]
}

/// Fails unless weights add up to 1, and do not with any of `plants`.
fn holds(
    a: &Adapter,
    name: &str,
    edits: &[(&str, &str, String)],
    frames: u32,
    plants: &[Edit],
    at: &dyn Fn(u32) -> Scene,
) {
    let [wrong, holding] = torn(a, edits, None, frames, at);
    eprintln!("{name}: {wrong} of {holding}");
    assert!(holding > 100 && 1000 * wrong <= ROUGH * holding, "{name}: {wrong} of {holding}");
    for plant in plants {
        let [wrong, holding] = torn(a, edits, Some(*plant), frames, at);
        eprintln!("{name}, {}: {wrong} of {holding}", plant.2.trim());
        assert!(10 * wrong > holding, "{name}: {} is not seen: {wrong} of {holding}", plant.2);
    }
}

#[test]
fn weights_of_the_frame_before_add_up() {
    let Some(a) = adapter() else { return };
    let edits = of_the_frame_before();
    let plants = [
        ("reuse/temporal", "select(ask_aim / back.kappa, own.aim, known)", "select(ask_aim, own.aim, known)"),
        ("reuse/temporal", "let old_b = c_old * old.aim;", "let old_b = old.aim;"),
        (
            "reuse/temporal",
            "let old_a = own.confidence * old_aim_here * kappa;",
            "let old_a = old_aim_here * kappa * 2.0;",
        ),
        // As far as the vertex is from the new camera: a map without an inverse.
        (
            "reuse/temporal",
            "let old_t = forth.offset + forth.kappa * old.path.t;",
            "let old_t = length(ray_world(view_at(old_there, old.path.t) - old_here.origin));",
        ),
    ];
    for bounces in [1, 3, 6] {
        let mut scene = sunny(bounces);
        scene.restir.spatial = false;
        scene.lights.push(constant(0.3));
        let moving = |left| {
            // 25° and a fifth of the way a frame: a Jacobian to be seen. The density grows, the sun turns.
            let mut scene = turned(&scene, left, 25.0, 1.2);
            scene.medium.density_scale = Auto::Is(7.0 - f64::from(left));
            scene.lights[0] = sun(DVec3::new(-0.8, 0.6, -0.2 + 0.3 * f64::from(left)), 3.0);
            scene.restir.edit_confidence = 8.0;
            scene
        };
        holds(&a, &format!("moving, bounces {bounces}"), &edits, 4, if bounces == 1 { &plants } else { &[] }, &moving);
        let still = |_| scene.clone();
        holds(&a, &format!("still, bounces {bounces}"), &edits, 4, &[], &still);
    }
}

/// The pixels of the frame before that those of a frame of a moving camera ask, with candidates of one stream or another.
fn asked(a: &Adapter, plant: Option<Edit>, stream: &str) -> Vec<f64> {
    let mut edits = vec![
        ("reuse/candidates", "CANDIDATES_STREAM: u32 = 0x68bc21ebu;", stream),
        ("reuse/temporal", "own.confidence += c_old;", "own.confidence = f32(q.y * params.width + q.x);"),
    ];
    edits.extend(plant);
    let mut scene = sunny(1);
    scene.restir.spatial = false;
    let planted = support::plant_all(&edits);
    let mut r = renderer(a, &planted.source, &scene, Some(cloud_field()), false);
    (0..2).rev().for_each(|left| frame(&mut r, &turned(&scene, left, 25.0, 1.2), left == 1));
    kept(&r).iter().map(Reservoir::confidence).collect()
}

/// Weights of a pixel and the one that it asks add up to 1 for all paths only if no path says which one that is.
#[test]
fn the_pixel_asked_does_not_depend_on_what_was_found() {
    let Some(a) = adapter() else { return };
    let streams = ["CANDIDATES_STREAM: u32 = 1u;", "CANDIDATES_STREAM: u32 = 2u;"];
    let differ = |plant| {
        let [one, other] = streams.map(|stream| asked(&a, plant, stream));
        one.iter().zip(&other).filter(|(one, other)| one != other).count()
    };
    assert_eq!(differ(None), 0);
    let own = ("reuse/temporal", "let place = ray_at(sight, flight.t);", "let place = ray_at(sight, own.path.t);");
    let seen = differ(Some(own));
    assert!(seen > 50, "{seen}");
}

#[test]
fn weights_of_neighbours_add_up() {
    let Some(a) = adapter() else { return };
    let edits = of_all_neighbours();
    let plants = [
        ("reuse/pairwise", "let part = others * other.aim;", "let part = other.confidence * other.aim;"),
        ("reuse/pairwise", "total, own.confidence / total)", "total, 0.0)"),
        ("reuse/pairwise", "own_m += share * own_part", "own_m += own_part"),
    ];
    for (bounces, neighbours) in [(1, 1), (1, 3), (3, 8), (6, 2)] {
        let mut scene = sunny(bounces);
        scene.restir.neighbours = neighbours;
        let still = |_| scene.clone();
        let plants: &[Edit] = if neighbours == 3 { &plants } else { &[] };
        holds(&a, &format!("{neighbours} neighbours, bounces {bounces}"), &edits, 3, plants, &still);
    }
}
