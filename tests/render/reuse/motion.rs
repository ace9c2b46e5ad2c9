//! Histories of a cloud in the sun: standing still, and in motion.

use super::*;

/// Samples of a reference's pixels.
const SAMPLES: u32 = 4096;

#[test]
fn frames_of_one_scattering_are_the_path_tracers() {
    let Some(a) = adapter() else { return };
    let scene = sunny(1);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("sun, 1 bounce", &mut r, &scene, SAMPLES);
    let still = |_| scene.clone();
    stage.holds(&Course { name: "frame 0", last: 0, histories: 200, at: &still });
    stage.holds(&Course { name: "frame 1", last: 1, histories: 150, at: &still });
    stage.holds(&Course { name: "frame 8", last: 8, histories: 60, at: &still });
    stage.holds(&Course { name: "frame 24", last: 24, histories: 20, at: &still });
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "orbit and dolly, frame 1", last: 1, histories: 150, at: &moving });
    stage.holds(&Course { name: "orbit and dolly, frame 8", last: 8, histories: 60, at: &moving });
}

#[test]
fn frames_of_three_scatterings_are_the_path_tracers() {
    let Some(a) = adapter() else { return };
    let scene = sunny(3);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let mut stage = Stage::new("sun, 3 bounces", &mut r, &scene, SAMPLES);
    let still = |_| scene.clone();
    stage.holds(&Course { name: "frame 0", last: 0, histories: 200, at: &still });
    stage.holds(&Course { name: "frame 8", last: 8, histories: 60, at: &still });
    let moving = |left| orbit(&scene, left);
    stage.holds(&Course { name: "orbit and dolly, frame 1", last: 1, histories: 150, at: &moving });
    stage.holds(&Course { name: "orbit and dolly, frame 8", last: 8, histories: 60, at: &moving });
}
