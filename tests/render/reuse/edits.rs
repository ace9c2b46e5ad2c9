//! Frames after something changed.

use super::*;
use ensemble::frame;

/// Frames before the change, and after it: the last of them is looked at.
const BEFORE: u32 = 5;
const AFTER: u32 = 2;

fn edited(stage: &mut Stage, name: &str, scene: &Scene, before: impl Fn(&mut Scene)) {
    let at = |left| {
        let mut scene = scene.clone();
        // Histories that count for little hide what is wrong with them.
        scene.restir.edit_confidence = 8.0;
        if left >= AFTER {
            before(&mut scene);
        }
        scene
    };
    stage.holds(&Course { name, last: BEFORE + AFTER - 1, histories: 150, at: &at });
}

#[test]
fn edits_leave_no_glow_behind() {
    let Some(a) = adapter() else { return };
    let scene = sunny(2);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("two frames after", &mut r, &scene, 16384);
    edited(&mut stage, "g", &scene, |s| s.medium.g = -0.4);
    edited(&mut stage, "density up", &scene, |s| s.medium.density_scale = nephele::scene::value::Auto::Is(2.0));
    edited(&mut stage, "density down", &scene, |s| s.medium.density_scale = nephele::scene::value::Auto::Is(20.0));
    edited(&mut stage, "albedo", &scene, |s| albedo(s, 0.3));
    edited(&mut stage, "sun's direction", &scene, |s| s.lights = vec![sun(DVec3::new(0.7, -0.3, 0.6), 3.0)]);
    edited(&mut stage, "sun's strength", &scene, |s| s.lights = vec![sun(DVec3::new(-0.8, 0.6, -0.2), 30.0)]);
    edited(&mut stage, "sun switched on", &scene, |s| s.lights = vec![sun(DVec3::new(-0.8, 0.6, -0.2), 0.0)]);
    edited(&mut stage, "sky switched off", &scene, |s| s.lights.push(constant(1.0)));
    edited(&mut stage, "colour of extinction", &scene, |s| s.medium.extinction = Colour([1.0, 0.5, 0.2]));
    edited(&mut stage, "more bounces", &scene, |s| s.integrator.max_bounces = Limit::AtMost(5));
}

/// Lights that share a map: what the frame before was lit by is no longer there to look at.
#[test]
fn edits_of_maps_leave_no_glow_behind() {
    let Some(a) = adapter() else { return };
    let (_folder, mut scene) = under_map(1);
    scene.lights.push(constant(0.5));
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("two frames after, one map", &mut r, &scene, 8192);
    let map = |scene: &mut Scene, scale: f64, rotation: f64| {
        if let Light::Environment(e) = &mut scene.lights[0] {
            (e.scale, e.rotation) = (scale, rotation);
        }
    };
    edited(&mut stage, "rotation", &scene, |s| map(s, 1.0, 130.0));
    edited(&mut stage, "switched on", &scene, |s| map(s, 0.0, 20.0));
    let mut two = scene.clone();
    two.lights.push(scene.lights[0].clone());
    if let Light::Environment(e) = &mut two.lights[2] {
        e.rotation = 200.0;
    }
    let mut stage = Stage::new("two frames after, two maps", &mut r, &two, 8192);
    edited(&mut stage, "rotation of one", &two, |s| map(s, 1.0, 130.0));
    edited(&mut stage, "strength of one", &two, |s| map(s, 8.0, 20.0));
    let mut off = scene.clone();
    map(&mut off, 0.0, 20.0);
    let mut stage = Stage::new("two frames after, map switched off", &mut r, &off, 8192);
    edited(&mut stage, "switched off", &off, |s| map(s, 1.0, 20.0));
}

/// Something that changes a renderer or its scene.
type Change<'a> = &'a dyn Fn(&mut Renderer, &mut Scene);

/// The frame after `change` in a renderer with a history, and what a renderer without one draws.
fn after(a: &Adapter, change: impl Fn(&mut Renderer, &mut Scene)) -> (Sums, Sums) {
    let mut scene = sunny(3);
    let mut old = renderer(a, &standard(), &scene, Some(cloud_field()), false);
    (0..3).for_each(|i| frame(&mut old, &scene, i == 0));
    change(&mut old, &mut scene);
    frame(&mut old, &scene, false);
    let mut fresh = renderer(a, &standard(), &sunny(3), Some(cloud_field()), false);
    change(&mut fresh, &mut scene);
    frame(&mut fresh, &scene, true);
    (old.sums().expect("a film"), fresh.sums().expect("a film"))
}

#[test]
fn another_volume_forgets_all_paths() {
    let Some(a) = adapter() else { return };
    let volume = |r: &mut Renderer, scene: &mut Scene| {
        let mut dense = cloud();
        dense.data.reverse();
        let field = support::field_of(dense, DMat4::IDENTITY, false);
        let medium = Medium::new(&a.gpu, Arc::new(field), scene).expect("a small medium");
        let size = (scene.film.width, scene.film.height);
        r.update(scene, size, Some(medium)).unwrap_or_else(|e| panic!("{e}"));
    };
    let seed = |_: &mut Renderer, scene: &mut Scene| scene.integrator.seed = 9;
    let placed = |_: &mut Renderer, scene: &mut Scene| place(scene, DMat4::from_scale(DVec3::splat(1.2)));
    let phase = |_: &mut Renderer, scene: &mut Scene| scene.medium.phase = Phase::Isotropic;
    let bounces = |_: &mut Renderer, scene: &mut Scene| scene.integrator.max_bounces = Limit::AtMost(2);
    let resized = |_: &mut Renderer, scene: &mut Scene| scene.film.width = 40;
    let changes: [(&str, Change); 6] = [
        ("volume", &volume),
        ("seed", &seed),
        ("placement", &placed),
        ("phase function", &phase),
        ("bounces", &bounces),
        ("size", &resized),
    ];
    for (what, change) in changes {
        let (old, fresh) = after(&a, change);
        assert!(old.sum == fresh.sum, "{what}: paths of before are left");
    }
    // What a camera saw is kept: the test can tell.
    let (old, fresh) = after(&a, |_, scene| scene.camera.fov_y = 37.0);
    assert!(old.sum != fresh.sum);
}
