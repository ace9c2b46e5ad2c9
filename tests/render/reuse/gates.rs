//! How far frames of scripted motion are from the path tracer's, to a tenth of a percent. It takes long, so it is run by hand:
//! `cargo test --release --test render gates -- --ignored --nocapture --test-threads 1`; docs/restir.md has what it said.

use super::*;
use nephele::scene::animation::Track;
use nephele::scene::value::Value;

/// The frames that are looked at.
const FRAMES: [u32; 3] = [1, 8, 24];
/// How far the whole picture and a tile of it may be off.
const WHOLE_GATE: f64 = 0.003;
const TILE_GATE: f64 = 0.015;
/// Histories are drawn until the whole picture is known so well, or so many.
const KNOWN: f64 = 0.001;
const HISTORIES: u32 = 4000;
/// A tile is off where noise of so many standard errors does not explain it.
const NOISE: f64 = 3.0;
/// Samples of a reference's pixels.
const SAMPLES: u32 = 65536;

/// The camera of [`orbit`] and a light that goes from `from` to `to` as tracks of a scene, up to the last frame.
fn scripted(mut scene: Scene, key: &str, from: Value, to: Value) -> Scene {
    let last = FRAMES[FRAMES.len() - 1];
    let track = |key: &str, frames: Vec<f64>, values| Track { key: key.into(), frames, values };
    let eye = |left: u32| {
        let position = orbit(&scene, left).camera.position.unwrap_or_else(|| EYE);
        numbers(position.to_array())
    };
    let frames = (0..=last).map(f64::from).collect();
    let tracks = [
        track("camera.position", frames, (0..=last).map(|frame| eye(last - frame)).collect()),
        track(key, vec![0.0, f64::from(last)], vec![from, to]),
    ];
    scene.animation.extend(tracks);
    scene.animation.iter().for_each(|track| track.check(&scene).expect("a track that fits"));
    scene
}

fn pass(name: &str, scene: &Scene) {
    let Some(a) = adapter() else { return };
    let last = FRAMES[FRAMES.len() - 1];
    let at = |left| scene.at_frame(f64::from(last - left)).expect("tracks that fit");
    let mut r = renderer(&a, &standard(), &at(0), Some(cloud_field()), false);
    let mut stage = Stage::new(name, &mut r, &at(0), SAMPLES);
    for frames in FRAMES {
        let course = Course { name: &format!("frame {frames}"), last: frames, histories: HISTORIES, at: &at };
        let verdict = stage.until(&course, KNOWN);
        let [tile, error] = verdict.tile;
        assert!(verdict.bias.abs() < WHOLE_GATE, "{name}, frame {frames}: {verdict:?}");
        assert!(tile < TILE_GATE + NOISE * error, "{name}, frame {frames}: {verdict:?}");
    }
}

/// Numbers as a value.
fn numbers(values: [f64; 3]) -> Value {
    Value::List(values.map(Value::Float).to_vec())
}

#[test]
#[ignore = "an hour"]
fn gates_in_the_sun() {
    for bounces in [1, 3] {
        let (from, to) = (numbers([0.4, 0.7, -0.6]), numbers([-0.8, 0.6, -0.2]));
        pass(&format!("sun, bounces {bounces}"), &scripted(sunny(bounces), "lights.0.direction", from, to));
    }
}

#[test]
#[ignore = "an hour"]
fn gates_under_a_map() {
    for bounces in [1, 3] {
        let (_folder, scene) = under_map(bounces);
        let scene = scripted(scene, "lights.0.rotation", Value::Float(-76.0), Value::Float(20.0));
        pass(&format!("map, bounces {bounces}"), &scene);
    }
}

#[test]
#[ignore = "an hour"]
fn gates_with_a_light_inside() {
    for bounces in [1, 3] {
        let (from, to) = (numbers([-0.36, -0.07, -0.27]), numbers([-0.6, 0.05, -0.45]));
        pass(&format!("point, bounces {bounces}"), &scripted(lit_inside(bounces), "lights.0.position", from, to));
    }
}
