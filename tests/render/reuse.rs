//! Reuse of paths: pictures of many independent histories against the path tracer's of the same frame, and what planted
//! errors do to them. A history ends at the same view and lights however it got there, so that one reference serves many.

use std::sync::Arc;

use super::*;
use nephele::render::reservoir::{self, Reservoir};
use nephele::scene::value::Colour;
use nephele::scene::{Environment, Mode, Point};
use nephele::volume::Dense;

mod bytes;
mod edits;
mod ensemble;
mod gates;
mod light;
mod motion;
mod partition;
mod planted;
mod published;
mod views;

use ensemble::{Course, Stage};

/// Pixels along the side.
const PICTURE: u32 = 24;
/// Voxels along the sides of the cloud, and their size.
const VOXELS: [u32; 3] = [20, 17, 19];
const VOXEL: f64 = 0.1;
/// Where the camera ends.
const EYE: DVec3 = DVec3::new(0.9, 0.6, 3.4);

/// Three soft balls with rough voxels and much that is empty; an optical depth of 4 through the middle, about.
fn cloud() -> Dense {
    let balls = [([9.0, 8.0, 9.0], 5.0, 1.0), ([14.0, 11.0, 6.0], 3.0, 1.6), ([5.0, 5.0, 14.0], 2.5, 1.3)];
    let mut dice = support::Dice::new(5);
    let mut data = Vec::new();
    for z in 0..VOXELS[2] {
        for y in 0..VOXELS[1] {
            for x in 0..VOXELS[0] {
                let p = [x, y, z].map(f64::from);
                let ball = |(centre, radius, peak): ([f64; 3], f64, f64)| {
                    let square: f64 = (0..3).map(|i| (p[i] - centre[i]).powi(2)).sum();
                    peak * (1.0 - square / (radius * radius)).max(0.0)
                };
                data.push((balls.into_iter().map(ball).sum::<f64>() * dice.between(0.4, 1.6)) as f32);
            }
        }
    }
    let half = DVec3::from(VOXELS.map(f64::from)) * 0.5 * VOXEL;
    let world_from_index = DMat4::from_translation(-half) * DMat4::from_scale(DVec3::splat(VOXEL));
    Dense { size: VOXELS.into(), data, world_from_index, warnings: Vec::new() }
}

fn cloud_field() -> Field {
    support::field_of(cloud(), DMat4::IDENTITY, false)
}

/// The cloud in the sun, paths of `bounces`.
fn sunny(bounces: u32) -> Scene {
    let mut scene = Scene::default();
    scene.medium.density_scale = nephele::scene::value::Auto::Is(7.0);
    hg(&mut scene, 0.3);
    albedo(&mut scene, 0.9);
    scene.lights = vec![sun(DVec3::new(-0.8, 0.6, -0.2), 3.0)];
    (scene.film.width, scene.film.height) = (PICTURE, PICTURE);
    scene.integrator.max_bounces = Limit::AtMost(bounces);
    scene.integrator.mode = Mode::Restir;
    look(&mut scene, EYE, DVec3::ZERO, 36.0);
    scene
}

/// A map with a bright lobe, and a scene that it lights.
fn under_map(bounces: u32) -> (tempfile::TempDir, Scene) {
    const WIDTH: u32 = 32;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("lobe.exr");
    let texel = |i: u32| {
        let (x, y) = (f64::from(i % WIDTH) - 9.0, f64::from(i / WIDTH) - 4.0);
        let lobe = 40.0 * (-(x * x + y * y) / 3.0).exp();
        [0.25 + lobe, 0.3 + 0.8 * lobe, 0.4 + 0.5 * lobe].map(|v| v as f32)
    };
    support::write_map(&path, WIDTH, WIDTH / 2, &(0..WIDTH * WIDTH / 2).map(texel).collect::<Vec<_>>());
    let file = nephele::scene::value::FilePath(path.to_string_lossy().into_owned());
    let mut scene = sunny(bounces);
    scene.lights = vec![Light::Environment(Environment { file, scale: 1.0, rotation: 20.0 })];
    (folder, scene)
}

/// With a point light in a gap of the cloud: paths that come near one within the medium have tails that no ensemble tames.
fn lit_inside(bounces: u32) -> Scene {
    let mut scene = sunny(bounces);
    scene.lights =
        vec![Light::Point(Point { position: DVec3::new(-0.6, 0.05, -0.45), intensity: Colour([1.0, 0.8, 0.6]) })];
    scene
}

/// The camera `left` frames before it reaches its place: it goes round by 2.9° a frame and comes nearer.
fn orbit(scene: &Scene, left: u32) -> Scene {
    turned(scene, left, 2.9, 1.03)
}

/// The same, by so many degrees a frame, from so many times as far.
fn turned(scene: &Scene, left: u32, degrees: f64, farther: f64) -> Scene {
    let mut scene = scene.clone();
    let turn = glam::DMat3::from_rotation_y(degrees.to_radians() * f64::from(left));
    let fov_y = scene.camera.fov_y;
    look(&mut scene, turn * EYE * farther.powi(left as i32), DVec3::ZERO, fov_y);
    scene
}

/// What the pixels of a frame keep.
fn kept(r: &Renderer) -> Vec<Reservoir> {
    reservoir::read(&r.gpu, r.reservoirs().expect("a frame was drawn")).expect("reads")
}
