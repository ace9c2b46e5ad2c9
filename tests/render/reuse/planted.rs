//! Errors planted in the passes, each of which histories must see. Those that they cannot see are the identity tests' of
//! tests/stats/reuse.rs.

use super::*;

/// Histories of each look at an error.
const HISTORIES: u32 = 150;

/// A planted error: its name, its file, what stands there and what is there instead.
type Plant = (&'static str, &'static str, &'static str, &'static str);

/// Fails unless histories see each of `plants` and hold without any.
fn all_are_seen(a: &Adapter, stage: &mut Stage, course: &Course, plants: &[Plant]) {
    stage.holds(course);
    for (name, file, from, to) in plants {
        let planted = support::plant(file, from, to);
        let mut other = renderer(a, &planted.source, &(course.at)(0), Some(cloud_field()), false);
        assert!(stage.with(&mut other).sees(&Course { name, ..*course }), "{name} is not seen");
    }
}

#[test]
fn errors_of_merging_are_seen() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(1);
    // One neighbour's confidence is that of all of them.
    scene.restir.neighbours = 4;
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("merging", &mut r, &scene, 16384);
    let still = |_| scene.clone();
    let course = Course { name: "nothing planted", last: 0, histories: 2 * HISTORIES, at: &still };
    let plants = [
        (
            "neighbours without MIS weights",
            "reuse/pairwise",
            "    let m = share * part / max(part + own.confidence * here, 1e-37);\n",
            "    let m = share;\n    (*all).own_m = own.confidence / (*all).total;\n",
        ),
        (
            "neighbours by their own confidence",
            "reuse/pairwise",
            "let part = others * other.aim;",
            "let part = other.confidence * other.aim;",
        ),
        (
            "the own path by a neighbour's confidence",
            "reuse/pairwise",
            "own_part / max(others * there + own_part, 1e-37)",
            "own_part / max(other.confidence * there + own_part, 1e-37)",
        ),
        (
            "the partner's aim of its own path",
            "reuse/pairwise",
            "let here = pair_aims[round * pixels + other_pixel];",
            "let here = other.aim;",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
}

#[test]
fn errors_of_histories_are_seen() {
    let Some(a) = adapter() else { return };
    let scene = sunny(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("histories", &mut r, &scene, 16384);
    let moving = |left| orbit(&scene, left);
    let course = Course { name: "nothing planted", last: 4, histories: HISTORIES, at: &moving };
    let plants = [
        (
            "shading with the proxy",
            "reuse/shade",
            "vec3f(seen_exactly(parts, path.t, count))",
            "target_seen(parts, path.t, 0u)",
        ),
        (
            "shading the own path alone",
            "reuse/shade",
            "if (offer.w != 0.0) {",
            "if (offer.w != 0.0 && i == frame.neighbours) {",
        ),
        (
            "shading by the own path's aim",
            "reuse/shade",
            "(offer.w / offer.aim)",
            "(offer.w / max(all.own.aim, 0.5 * offer.aim))",
        ),
        (
            "temporal without MIS weights",
            "reuse/temporal",
            "    let own_m = own_a / max(own_a + c_old * own_aim_there, 1e-37);\n",
            "    let own_m = own.confidence / (own.confidence + c_old);\n",
        ),
        (
            "histories by this frame's target",
            "reuse/temporal",
            "    let old_b = c_old * old.aim;\n",
            "    let old_b = c_old * old_aim_here;\n",
        ),
        (
            "the table's density",
            "reuse/table",
            "rate * exp(-wanted) / max(opacity, 1e-30)",
            "0.9 * rate * exp(-wanted) / max(opacity, 1e-30)",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
}

#[test]
fn errors_of_fast_motion_are_seen() {
    let Some(a) = adapter() else { return };
    let scene = sunny(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("25° a frame", &mut r, &scene, 16384);
    let fast = |left| turned(&scene, left, 25.0, 1.0);
    let course = Course { name: "nothing planted", last: 4, histories: 4 * HISTORIES, at: &fast };
    let plants = [(
        "the Jacobian dropped",
        "reuse/temporal",
        "let kappa = select(forth.kappa, 1.0, known);",
        "let kappa = 1.0;",
    )];
    all_are_seen(&a, &mut stage, &course, &plants);
}

#[test]
fn errors_of_more_scatterings_are_seen() {
    let Some(a) = adapter() else { return };
    // More than vertices are kept, so that some light is frozen; and a sky, which each of them sees.
    let mut scene = sunny(6);
    scene.lights.push(constant(0.3));
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("more scatterings", &mut r, &scene, 16384);
    let still = |_| scene.clone();
    let course = Course { name: "nothing planted", last: 0, histories: 2 * HISTORIES, at: &still };
    let plants = [
        ("no square of the distance", "reuse/suffix", "inverse *= leg.t * leg.t *", "inverse *= leg.t *"),
        (
            "no phase function in the density",
            "reuse/suffix",
            "leg.inverse / toward_pdf(vertex, before, onward)",
            "leg.inverse / 0.5",
        ),
        (
            "places of a stretch as if there were no choice",
            "reuse/onward",
            "sum / (f32(ONWARD_PLACES) * here * rate * seen)",
            "1.0 / (rate * seen)",
        ),
        ("no density of the first distance", "reuse/onset", "words.w / onset_strength(view, t, seen)", "words.w"),
        ("suffixes that count in full", "reuse/onset", "onset.sum / f32(count)", "onset.sum"),
        (
            "no density of the last direction",
            "reuse/suffix",
            "inverse / toward_pdf(vertex, before, path.omega)",
            "inverse",
        ),
        ("looks for the sky that count in full", "reuse/look", "sky.inverse / max(1.0 - chance, 1e-30)", "sky.inverse"),
        ("looks for lights that count in full", "reuse/look", "light.inverse / chance", "light.inverse"),
        (
            "albedo of the second vertex",
            "reuse/target",
            "value *= colour * target_scatters(before, parts.first, vertex);",
            "value *= params.extinction * target_scatters(before, parts.first, vertex);",
        ),
        (
            "albedo of the third vertex",
            "reuse/target",
            "value *= colour * target_scatters(before, parts.second, vertex);",
            "value *= params.extinction * target_scatters(before, parts.second, vertex);",
        ),
        (
            "the light that the third vertex sees, twice",
            "reuse/frozen",
            "select(vec3f(0.0), seen, bounces > RESERVOIR_VERTICES)",
            "seen",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
}

#[test]
fn weights_that_grow_from_one_scattering_to_the_next_are_seen() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(256);
    scene.medium.density_scale = nephele::scene::value::Auto::Is(800.0);
    hg(&mut scene, 0.85);
    albedo(&mut scene, 0.999);
    scene.lights.push(constant(0.2));
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("many scatterings", &mut r, &scene, 1024);
    let still = |_| scene.clone();
    let course = Course { name: "nothing planted", last: 0, histories: 2 * HISTORIES, at: &still };
    let honest = stage.until(&course, 0.0);
    // No error of any mean, but weights of up to 1.25 to the power of the scatterings: most histories are too dark, and few
    // very bright.
    let planted = support::plant(
        "reuse/frozen",
        "let onward = toward_turn(world, rng);
            phase_pdf = phase_value(dot(world, onward));",
        "let onward = toward_sample(ray.origin, world, rng);
            phase_pdf = phase_value(dot(world, onward));
            throughput *= phase_pdf / toward_pdf(ray.origin, world, onward);",
    );
    let mut other = renderer(&a, &planted.source, &scene, Some(cloud_field()), false);
    let course = Course { name: "towards lights at every scattering", ..course };
    let planted = stage.with(&mut other).until(&course, 0.0);
    assert!(!honest.trips() && planted.trips(), "{honest:?} {planted:?}");
}

#[test]
fn errors_of_moved_vertices_are_seen() {
    let Some(a) = adapter() else { return };
    let scene = sunny(3);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("moved vertices", &mut r, &scene, 16384);
    let moving = |left| orbit(&scene, left);
    let course = Course { name: "nothing planted", last: 4, histories: 4 * HISTORIES, at: &moving };
    let plants = [
        (
            "vertices stay where a neighbour had them",
            "reuse/pairwise",
            "let path = pair_shift(other.path, q, position, frame.reconnect).path;",
            "var path = pair_shift(other.path, q, position, frame.reconnect).path;
             path.second += (view_ray(q, path.film).world - view_ray(position, path.film).world) * path.t;",
        ),
        (
            "our own vertices stay in the frame before",
            "reuse/temporal",
            "var own_shifted = shift_follow(own.path, own_from, own_to);",
            "var own_shifted = own.path;
             own_shifted.second += ray_world(own_from - own_to);",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
}

#[test]
fn errors_of_what_is_behind_are_seen() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(1);
    scene.lights.push(constant(1.0));
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("behind", &mut r, &scene, 16384);
    let still = |_| scene.clone();
    let course = Course { name: "nothing planted", last: 1, histories: 2 * HISTORIES, at: &still };
    let plants = [
        (
            "the background along the path's camera ray",
            "reuse/shade",
            "let view = view_ray(position, rng_bits(&rng));",
            "let view = view_ray(position, reservoir_load(pixel).path.film);",
        ),
        (
            "the chance to get through all of the depth",
            "track/exact",
            "let chance = exp(-params.proxy_weakest * max(depth - sure, 0.0));",
            "let chance = exp(-params.proxy_weakest * depth);",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
}

/// The frame after an edit, of histories that count whole.
fn edited(scene: &Scene, before: impl Fn(&mut Scene)) -> impl Fn(u32) -> Scene {
    move |left| {
        let mut scene = scene.clone();
        scene.restir.edit_confidence = 8.0;
        if left >= 1 {
            before(&mut scene);
        }
        scene
    }
}

#[test]
fn errors_after_edits_are_seen() {
    let Some(a) = adapter() else { return };
    let scene = sunny(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("after an edit", &mut r, &scene, 16384);
    let turned = edited(&scene, |s| s.lights = vec![sun(DVec3::new(0.7, -0.3, 0.6), 3.0)]);
    let course = Course { name: "nothing planted", last: 5, histories: HISTORIES, at: &turned };
    let plants = [
        (
            "this frame's medium and lights for the frame before",
            "reuse/temporal",
            "    params = params_vary(frame_previous, id.z);\n    light_begin(frame.old_lights);\n",
            "",
        ),
        (
            "this frame's lights for the frame before",
            "reuse/temporal",
            "light_begin(frame.old_lights);",
            "light_begin(0u);",
        ),
    ];
    all_are_seen(&a, &mut stage, &course, &plants);
    // So many scatterings that much of the light is frozen.
    let mut scene = sunny(16);
    albedo(&mut scene, 1.0);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("after an edit of the density", &mut r, &scene, 16384);
    let thicker = edited(&scene, |s| s.medium.density_scale = nephele::scene::value::Auto::Is(1.0));
    let course = Course { name: "nothing planted", last: 5, histories: 3 * HISTORIES, at: &thicker };
    let plants = [(
        "estimates of before the edit kept",
        "reuse/temporal",
        "return (frame.history & bit) != 0u;",
        "return (frame.history | bit) != 0u;",
    )];
    all_are_seen(&a, &mut stage, &course, &plants);
}
