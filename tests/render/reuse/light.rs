//! Histories under other lights, in other media, and with other settings.

use super::*;

#[test]
fn a_map_lights_frames_as_it_lights_the_path_tracers() {
    let Some(a) = adapter() else { return };
    let (_folder, scene) = under_map(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    for (bounces, samples) in [(1, 8192), (3, 4096)] {
        let (_folder, scene) = under_map(bounces);
        let mut stage = Stage::new(&format!("map, bounces {bounces}"), &mut r, &scene, samples);
        let still = |_| scene.clone();
        stage.holds(&Course { name: "frame 8", last: 8, histories: 100, at: &still });
        // The camera moves, the map turns.
        let moving = |left| {
            let mut scene = orbit(&scene, left);
            if let Light::Environment(e) = &mut scene.lights[0] {
                e.rotation += 4.0 * f64::from(left);
                e.scale *= 1.05f64.powi(left as i32);
            }
            scene
        };
        stage.holds(&Course { name: "moving, frame 8", last: 8, histories: 100, at: &moving });
    }
}

#[test]
fn a_light_within_lights_frames_as_it_lights_the_path_tracers() {
    let Some(a) = adapter() else { return };
    let scene = lit_inside(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    for (bounces, samples) in [(1, 8192), (3, 4096)] {
        let scene = lit_inside(bounces);
        let mut stage = Stage::new(&format!("point within, bounces {bounces}"), &mut r, &scene, samples);
        let still = |_| scene.clone();
        stage.holds(&Course { name: "frame 8", last: 8, histories: 100, at: &still });
        let moving = |left| {
            let mut scene = orbit(&scene, left);
            if let Light::Point(p) = &mut scene.lights[0] {
                p.position += DVec3::new(0.02, -0.01, 0.015) * f64::from(left);
            }
            scene
        };
        stage.holds(&Course { name: "moving, frame 8", last: 8, histories: 100, at: &moving });
    }
}

#[test]
fn lights_of_all_kinds_together() {
    let Some(a) = adapter() else { return };
    let (_folder, mut scene) = under_map(2);
    let disc = Sun { direction: DVec3::new(0.5, 0.5, 0.4), irradiance: Colour([1.0, 0.9, 0.8]), angular_diameter: 9.0 };
    scene.lights.extend([sun(DVec3::new(-0.8, 0.6, -0.2), 1.0), Light::Sun(disc), constant(0.2)]);
    scene.lights.extend(lit_inside(1).lights);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("all lights", &mut r, &scene, 4096);
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "moving, frame 4", last: 4, histories: 150, at: &moving });
}

/// Pixels as wide as several voxels: rays of one pixel meet different parts of the medium, and what its centre's misses.
#[test]
fn far_clouds_keep_their_edges() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(2);
    scene.medium.density_scale = nephele::scene::value::Auto::Is(2.0);
    let middle = DVec3::new(1.5, 1.4, 1.6);
    look(&mut scene, middle + DVec3::new(9.0, 6.0, 14.0), middle, 40.0);
    let field = || support::field_of(support::random_dense([12, 11, 13], 4), DMat4::IDENTITY, false);
    let mut r = renderer(&a, &standard(), &scene, Some(field()), false);
    let mut stage = Stage::new("far", &mut r, &scene, 16384);
    let still = |_| scene.clone();
    let course = Course { name: "frame 1", last: 1, histories: 800, at: &still };
    stage.holds(&course);
    let planted = support::plant(
        "reuse/candidates",
        "    table_build(ray);\n",
        "    let centre = view_ray(position, VIEW_CENTRE);\n    table_build(ray_new(centre.origin, centre.world));\n",
    );
    let mut r = renderer(&a, &planted.source, &scene, Some(field()), false);
    assert!(stage.with(&mut r).sees(&Course { name: "edges of the centre's ray", ..course }));
}

#[test]
fn coloured_extinction_and_a_lens() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(2);
    scene.medium.extinction = Colour([1.0, 0.6, 0.25]);
    scene.medium.albedo = Colour([0.95, 0.8, 0.6]);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("coloured", &mut r, &scene, 8192);
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "moving, frame 8", last: 8, histories: 100, at: &moving });
    scene.camera.aperture_radius = 0.25;
    scene.camera.focus_distance = nephele::scene::value::Auto::Is(3.0);
    let mut stage = Stage::new("coloured, lens", &mut r, &scene, 8192);
    let still = |_| scene.clone();
    stage.holds(&Course { name: "still, frame 4", last: 4, histories: 100, at: &still });
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "moving, frame 4", last: 4, histories: 100, at: &moving });
}

#[test]
fn formulas_and_infinite_boxes() {
    let Some(a) = adapter() else { return };
    let lit = |mut scene: Scene, bounces| {
        let from = sunny(bounces);
        scene.lights = from.lights.clone();
        scene.integrator = from.integrator.clone();
        scene.medium = nephele::scene::Medium { density_scale: scene.medium.density_scale, ..from.medium.clone() };
        (scene.film.width, scene.film.height) = (PICTURE, PICTURE);
        look(&mut scene, EYE, DVec3::ZERO, 40.0);
        scene
    };
    let scene = lit(boxed([-0.8, -0.7, -0.9], [0.9, 0.8, 0.7], 2.5), 2);
    let mut r = renderer(&a, &standard(), &scene, None, false);
    let mut stage = Stage::new("box", &mut r, &scene, 2048);
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "moving, frame 8", last: 8, histories: 60, at: &moving });
    let mut scene = slab(2.0);
    scene = lit(scene, 2);
    look(&mut scene, DVec3::new(0.0, 2.5, 3.0), DVec3::new(0.0, 0.5, 0.0), 40.0);
    let mut r = renderer(&a, &standard(), &scene, None, false);
    let mut stage = Stage::new("slab", &mut r, &scene, 1024);
    let still = |_| scene.clone();
    stage.holds(&Course { name: "still, frame 4", last: 4, histories: 40, at: &still });
}

#[test]
fn settings_change_the_noise_alone() {
    let Some(a) = adapter() else { return };
    let scene = sunny(2);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("sun, 2 bounces", &mut r, &scene, 8192);
    let mut look_at = |name: &str, change: &dyn Fn(&mut nephele::scene::Restir)| {
        let moving = |left| {
            let mut scene = orbit(&scene, left);
            change(&mut scene.restir);
            scene
        };
        stage.holds(&Course { name, last: 4, histories: 100, at: &moving });
    };
    look_at("1 final walk, no neighbour", &|s| (s.final_samples, s.neighbours) = (1, 0));
    look_at("3 neighbours", &|s| s.neighbours = 3);
    look_at("8 near neighbours", &|s| (s.neighbours, s.reach) = (8, 1));
    look_at("no history, 1 candidate", &|s| (s.temporal, s.candidates) = (false, nephele::scene::value::Auto::Is(1)));
    look_at("temporal history, permuted", &|s| {
        (s.history, s.permute) = (nephele::scene::History::Temporal, true);
    });
    look_at("cap 30", &|s| s.cap = 30);
}

#[test]
fn still_pictures_converge_to_the_path_tracers() {
    let Some(a) = adapter() else { return };
    let mut scene = sunny(2);
    (scene.restir.still_after, scene.restir.still_cap) = (8, 8);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("still, 16 samples", &mut r, &scene, 8192);
    stage.holds_still(16, 60, &scene);
    scene.restir.still_cap = 0;
    stage.holds_still(16, 60, &scene);
}
