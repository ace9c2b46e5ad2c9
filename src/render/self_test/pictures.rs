//! Pictures of homogeneous boxes and layers, where closed forms are known.

use std::f64::consts::PI;

use glam::DVec3;

use super::media::cloud;
use super::*;
use crate::light::environment::luminance;
use crate::scene::value::{Auto, Bounds, Colour, Limit};
use crate::scene::{Analytic, Constant, Light, Phase, Point, SkyLight, Sun};

/// Pixels along the side of most pictures.
pub(super) const PIXELS: u32 = 32;
/// Pixels along the side of a tile of the white furnace.
const TILE: usize = 8;
/// How far a tile of the white furnace may be from 1.
const FURNACE: f64 = 3e-3;

/// A homogeneous box of density 1 without lights, seen by nobody yet.
fn boxed(low: DVec3, high: DVec3, extinction: f64) -> Scene {
    let mut scene = Scene::default();
    scene.volume.analytic = Analytic::Homogeneous;
    scene.volume.bounds = Bounds([low, high]);
    scene.medium.density_scale = Auto::Is(extinction);
    scene.medium.albedo = Colour([1.0; 3]);
    scene.medium.phase = Phase::Isotropic;
    scene.lights.clear();
    (scene.film.width, scene.film.height) = (PIXELS, PIXELS);
    scene.integrator.max_bounces = Limit::Unlimited;
    scene
}

fn unit_cube(extinction: f64) -> Scene {
    boxed(DVec3::ZERO, DVec3::ONE, extinction)
}

pub(super) fn look(scene: &mut Scene, from: DVec3, to: DVec3, degrees: f64) {
    (scene.camera.position, scene.camera.target) = (Auto::Is(from), Auto::Is(to));
    scene.camera.fov_y = degrees;
    scene.camera.up = if (to - from).normalize().y.abs() > 0.99 { DVec3::Z } else { DVec3::Y };
}

/// All rays of the picture are this one, about: a narrow view from a little before `through`.
pub(super) fn one_ray(scene: &mut Scene, through: DVec3, direction: DVec3) {
    look(scene, through - 5.0 * direction.normalize(), through, 0.1);
}

/// A sun of `degrees` across.
pub(super) fn sun(direction: DVec3, irradiance: f64, degrees: f64) -> Light {
    Light::Sun(Sun { direction, irradiance: Colour([irradiance; 3]), angular_diameter: degrees })
}

/// A sun that fills the half of the sky round `direction` with radiance 1.
fn half_sky(direction: DVec3) -> Light {
    sun(direction, PI, 180.0)
}

pub(super) fn white_sky() -> Light {
    Light::Constant(Constant { radiance: Colour([1.0; 3]) })
}

pub(super) fn hg(scene: &mut Scene, g: f64) {
    (scene.medium.phase, scene.medium.g) = (Phase::Hg, g);
}

/// Henyey and Greenstein's phase function per steradian, by the cosine between directions of travel.
pub(super) fn hg_value(g: f64, cosine: f64) -> f64 {
    (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * cosine).powf(1.5))
}

/// The ray of the cube's pictures.
const RAY: DVec3 = DVec3::NEG_X;
const CENTRE: DVec3 = DVec3::splat(0.5);

/// Beer and Lambert: light through a black cube of depth 1.
pub(super) fn transmittance(lab: &Lab) -> Result<Outcome> {
    let mut scene = unit_cube(1.0);
    scene.medium.albedo = Colour([0.0; 3]);
    scene.lights = vec![white_sky()];
    one_ray(&mut scene, CENTRE, RAY);
    Ok(Outcome::by_chance(mean(&lab.draw(&scene, 4096)?, 0), (-1f64).exp()))
}

/// Single scattering of a sun of irradiance 1 in a cube of extinction 1; `k` is the integral of both transmittances
/// along the ray.
fn single(lab: &Lab, towards: DVec3, k: f64) -> Result<Outcome> {
    const G: f64 = 0.5;
    let mut scene = unit_cube(1.0);
    hg(&mut scene, G);
    scene.lights = vec![sun(towards, 1.0, 0.0)];
    scene.integrator.max_bounces = Limit::AtMost(1);
    one_ray(&mut scene, CENTRE, RAY);
    Ok(Outcome::by_chance(mean(&lab.draw(&scene, 2048)?, 0), hg_value(G, RAY.dot(towards)) * k))
}

pub(super) fn side(lab: &Lab) -> Result<Outcome> {
    // Half the cube to the sun from everywhere on the ray.
    single(lab, DVec3::Y, (-0.5f64).exp() * -(-1f64).exp_m1())
}

pub(super) fn behind(lab: &Lab) -> Result<Outcome> {
    // There and back: ∫ exp(−2t) dt.
    single(lab, -RAY, -(-2f64).exp_m1() / 2.0)
}

pub(super) fn in_front(lab: &Lab) -> Result<Outcome> {
    // Every way is as long as the cube.
    single(lab, RAY, (-1f64).exp())
}

/// Single scattering of a point light beside a cube of extinction 1, against Simpson's rule.
pub(super) fn point(lab: &Lab) -> Result<Outcome> {
    const INTENSITY: f64 = 10.0;
    /// From the ray to the light, and from the ray to the cube's face.
    const ASIDE: f64 = 1.5;
    const INSIDE: f64 = 0.5;
    const STEPS: usize = 200;
    let mut scene = unit_cube(1.0);
    let position = CENTRE + DVec3::Y * ASIDE;
    scene.lights = vec![Light::Point(Point { position, intensity: Colour([INTENSITY; 3]) })];
    scene.integrator.max_bounces = Limit::AtMost(1);
    one_ray(&mut scene, CENTRE, RAY);
    let radiance = |t: f64| {
        let distance = (t - 0.5).hypot(ASIDE);
        (-t - distance * INSIDE / ASIDE).exp() * INTENSITY / (4.0 * PI * distance * distance)
    };
    let weight = |i: usize| if i == 0 || i == STEPS { 1.0 } else { [2.0, 4.0][i % 2] };
    let h = 1.0 / STEPS as f64;
    let expected = (0..=STEPS).map(|i| weight(i) * radiance(h * i as f64)).sum::<f64>() * h / 3.0;
    Ok(Outcome::by_chance(mean(&lab.draw(&scene, 1024)?, 0), expected))
}

/// A cloud that absorbs nothing, in light of radiance 1 from everywhere; of the tiles the one that is off most.
pub(super) fn white_furnace(lab: &Lab) -> Result<Outcome> {
    let mut scene = cloud();
    // Thick: many bounces add up what each loses.
    scene.medium.density_scale = Auto::Auto;
    scene.medium.albedo = Colour([1.0; 3]);
    scene.lights = vec![white_sky()];
    scene.integrator.max_bounces = Limit::Unlimited;
    let drawn = lab.draw(&scene, 16)?;
    let (width, tiles) = (drawn.width as usize, drawn.width as usize / TILE);
    let tile = |i: usize| {
        let pixel = |p: usize| (i / tiles * TILE + p / TILE) * width + i % tiles * TILE + p % TILE;
        let sum: f64 = (0..TILE * TILE).flat_map(|p| drawn.mean(pixel(p))).sum();
        Outcome { measured: sum / (3 * TILE * TILE) as f64, expected: 1.0, within: FURNACE }
    };
    Ok(Outcome::worst((0..tiles * tiles).map(tile)))
}

/// The same where light is sampled too: two suns that are half of the sky each.
pub(super) fn sampled_furnace(lab: &Lab) -> Result<Outcome> {
    let mut scene = unit_cube(4.0);
    hg(&mut scene, 0.5);
    let axis = DVec3::new(0.4, 0.8, -0.3);
    scene.lights = vec![half_sky(axis), half_sky(-axis)];
    look(&mut scene, DVec3::new(0.7, 0.9, 2.5), CENTRE, 30.0);
    Ok(Outcome::by_chance(mean(&lab.draw(&scene, 256)?, 0), 1.0))
}

/// Plane albedo R and transmittance T of an endless layer, by reciprocity: under the upper half of the sky a ray from
/// above sees R, one from below T. The figures are from adding–doubling (64 points).
pub(super) fn layer(lab: &Lab) -> Result<Outcome> {
    const DEPTH: f64 = 4.0;
    const G: f64 = 0.5;
    const ALBEDO: [f64; 3] = [0.5, 0.9, 1.0];
    const R: [f64; 3] = [0.047_467, 0.261_179, 0.508_967];
    const T: [f64; 3] = [0.055_463, 0.250_532, 0.491_033];
    let inf = f64::INFINITY;
    let mut scene = boxed(DVec3::new(-inf, 0.0, -inf), DVec3::new(inf, 1.0, inf), DEPTH);
    hg(&mut scene, G);
    scene.medium.albedo = Colour(ALBEDO);
    scene.lights = vec![half_sky(DVec3::Y)];
    let mut all = Vec::new();
    for (ray, expected) in [(DVec3::NEG_Y, R), (DVec3::Y, T)] {
        one_ray(&mut scene, DVec3::new(0.0, 0.5, 0.0), ray);
        let drawn = lab.draw(&scene, 256)?;
        all.extend((0..3).map(|c| Outcome::by_chance(mean(&drawn, c), expected[c])));
    }
    Ok(Outcome::worst(all))
}

/// A cube of coloured extinction against three of grey; of the channels the one that is off most.
pub(super) fn extinction(lab: &Lab) -> Result<Outcome> {
    const FACTORS: [f64; 3] = [1.0, 2.0, 4.0];
    const SAMPLES: u32 = 128;
    let mut scene = unit_cube(1.0);
    hg(&mut scene, 0.4);
    scene.medium.albedo = Colour([0.95, 0.8, 0.6]);
    scene.lights = vec![sun(DVec3::new(0.3, 1.0, 0.4), 3.0, 0.0), white_sky()];
    look(&mut scene, DVec3::new(1.5, 1.0, 3.0), CENTRE, 20.0);
    scene.medium.extinction = Colour(FACTORS);
    // One channel in three draws the path.
    let coloured = lab.draw(&scene, 4 * SAMPLES)?;
    let mut all = Vec::new();
    for (c, seed) in (0..3).zip(1..) {
        scene.medium.extinction = Colour([FACTORS[c]; 3]);
        scene.integrator.seed = seed;
        all.push(Outcome::of_two(mean(&coloured, c), mean(&lab.draw(&scene, SAMPLES)?, c)));
    }
    Ok(Outcome::worst(all))
}

/// Luminance of a white horizontal surface under the default sky, by samples of its light: 1 by the sky's definition.
pub(super) fn daylight(lab: &Lab) -> Result<Outcome> {
    const SAMPLES: usize = 1 << 16;
    /// Values that the kernel writes for a sample.
    const EACH: usize = 3;
    let mut scene = unit_cube(1.0);
    scene.lights = vec![Light::Sky(SkyLight::default())];
    let inputs = vec![[0.0, 1.0, 0.0, 0.0]; 2 * SAMPLES];
    let found = probe(&lab.renderer(&scene, None)?, "light", &inputs, EACH * SAMPLES, EACH)?;
    let lit = |v: &[[f32; 4]]| {
        let ([_, cosine, _, density], [r, g, b, _]) = (v[0].map(f64::from), v[1]);
        // The very edge of the sun may round to the outside, where the density is 0.
        if density > 0.0 { luminance([r, g, b].map(f64::from)) * cosine.max(0.0) / density / PI } else { 0.0 }
    };
    Ok(Outcome::by_chance(mean_of(found.chunks_exact(EACH).map(lit)), 1.0))
}

/// Pixels that differ where the same samples are drawn in other pieces.
pub(super) fn slicing(lab: &Lab) -> Result<Outcome> {
    /// More than one block of the film, and pieces that divide neither samples nor tiles.
    const SAMPLES: u32 = 300;
    const PIECES: Work = Work { samples: 19, groups: 5 };
    let scene = cloud();
    let whole = lab.draw(&scene, SAMPLES)?;
    let pieces = lab.draw_in(&scene, SAMPLES, PIECES)?;
    let differ = |p: &usize| whole.sum[*p] != pieces.sum[*p] || whole.square[*p] != pieces.square[*p];
    let measured = (0..whole.sum.len()).filter(differ).count() as f64;
    Ok(Outcome { measured, expected: 0.0, within: 0.0 })
}
