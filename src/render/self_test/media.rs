//! Voxels: interpolation against the CPU, majorants, and estimators against quadrature.

use std::f64::consts::PI;

use glam::{DMat4, DVec3, UVec3};

use super::pictures::{PIXELS, hg, hg_value, look, one_ray, sun, white_sky};
use super::*;
use crate::render::field::Shape;
use crate::scene::Procedural;
use crate::scene::value::{Auto, Colour, Limit};
use crate::volume::Dense;
use crate::volume::majorant::Padded;

/// Voxels of the field whose interpolation is tested: three unlike sides, so that none can stand for another.
const SIDES: UVec3 = UVec3::new(9, 6, 11);
/// Points at which it is.
const POINTS: usize = 1 << 14;

/// Steps along the axes for [`spread`]: powers of 1/g where g⁴ = g + 1 (M. Roberts 2018).
const STEPS: [f64; 3] = [0.819_172_513_396_164_4, 0.671_043_606_703_789_2, 0.549_700_477_901_97];

/// Numbers in 0 … 1 that cover it evenly and repeat nothing: multiples of an irrational `step`.
fn spread(step: f64) -> impl Fn(usize) -> f64 {
    move |i| (i as f64 * step).fract()
}

/// The greatest difference between the stored field as the shader reads it and as the CPU does.
pub(super) fn density(lab: &Lab, precision: Precision) -> Result<Outcome> {
    /// Samplers of devices round the weights to 8 bits.
    const SAMPLER: f64 = 1.0 / 128.0;
    /// Everything else keeps 32-bit floats.
    const EXACT: f64 = 1e-5;
    /// Values are whole parts of 1, so that 16-bit floats store them as they are.
    const PARTS: f64 = 1024.0;
    let value = |i| if i == 0 { 1.0 } else { ((spread(STEPS[0])(i) * PARTS).round() / PARTS) as f32 };
    let dense = Dense {
        size: SIDES,
        data: (0..SIDES.element_product() as usize).map(value).collect(),
        world_from_index: DMat4::IDENTITY,
        warnings: Vec::new(),
    };
    let field = Field {
        shape: Shape::Dense(dense.clone()),
        to_world: DMat4::IDENTITY,
        nearest: false,
        grids: Vec::new(),
        grid: String::new(),
        warnings: Vec::new(),
    };
    let mut scene = Scene::default();
    scene.volume.precision = precision;
    let renderer = lab.renderer(&scene, Some(field))?;
    let (low, high) = renderer.medium.field.local_box();
    let point = |i| low + (high - low) * DVec3::from(STEPS.map(|step| spread(step)(i)));
    let inputs: Vec<[f32; 4]> = (0..POINTS).map(point).map(|p| p.as_vec3().extend(0.0).to_array()).collect();
    let found = probe(&renderer, "medium", &inputs, POINTS, 1)?;
    let padded = Padded::new(&dense, |x| x);
    let difference = |(v, p): (&[f32; 4], &[f32; 4])| {
        let exact = padded.trilinear([p[0], p[1], p[2]].map(f64::from));
        (f64::from(v[0]) - exact).abs()
    };
    // A maximum that keeps what is not a number.
    let worst = |worst: f64, x: f64| if worst.is_nan() || x <= worst { worst } else { x };
    let measured = found.iter().zip(&inputs).map(difference).fold(0.0, worst);
    let by_sampler = renderer.variant().slots.contains(&("medium", "medium/dense"));
    let within = if by_sampler && !lab.gpu.is_software() { SAMPLER } else { EXACT };
    Ok(Outcome { measured, expected: 0.0, within })
}

/// Extinction of the cloud where it is densest: thin enough that light comes from everywhere in it, thick enough that
/// every estimator counts.
const DENSITY: f64 = 3.0;

/// A small cumulus in the default light.
pub(super) fn cloud() -> Scene {
    let mut scene = Scene::default();
    scene.medium.density_scale = Auto::Is(DENSITY);
    scene.volume.procedural = Procedural::Cumulus;
    scene.volume.resolution = 32;
    (scene.film.width, scene.film.height) = (PIXELS, PIXELS);
    scene
}

/// Two pictures in sunlight alone: a white sky would hide what is lost.
pub(super) fn majorants(lab: &Lab) -> Result<Outcome> {
    const SAMPLES: u32 = 512;
    let mut scene = cloud();
    hg(&mut scene, 0.0);
    scene.lights = vec![sun(DVec3::new(0.5, 0.8, 0.3), PI, 0.0)];
    look(&mut scene, DVec3::Z * 5.0, DVec3::ZERO, 8.0);
    let grid = mean(&lab.draw(&scene, SAMPLES)?, 0);
    scene.tracking.majorant = MajorantKind::Global;
    scene.integrator.seed = 1;
    let global = mean(&lab.draw(&scene, SAMPLES)?, 0);
    Ok(Outcome::of_two(grid, global))
}

/// One ray through the cloud with `settings`: light from behind it, and single scattering of a sun; of both in three
/// channels what is off most.
pub(super) fn estimator(lab: &Lab, settings: fn(&mut Scene)) -> Result<Outcome> {
    const SAMPLES: u32 = 512;
    const SUN: DVec3 = DVec3::new(0.5, 0.8, 0.3);
    const G: f64 = 0.5;
    const ALBEDO: f64 = 0.8;
    const IRRADIANCE: f64 = 3.0;
    let mut scene = cloud();
    scene.volume.precision = Precision::F32;
    scene.medium.albedo = Colour([ALBEDO; 3]);
    hg(&mut scene, G);
    let ray = DVec3::new(0.3, -0.1, -1.0).normalize();
    one_ray(&mut scene, DVec3::ZERO, ray);
    settings(&mut scene);
    scene.integrator.max_bounces = Limit::AtMost(1);
    scene.lights = vec![sun(SUN, IRRADIANCE, 0.0)];
    let scattered = lab.draw(&scene, SAMPLES)?;
    scene.integrator.max_bounces = Limit::AtMost(0);
    scene.lights = vec![white_sky()];
    let behind = lab.draw(&scene, SAMPLES)?;
    let field = Field::load(&scene.volume)?;
    let oracle = Oracle::new(&field);
    let source = ALBEDO * IRRADIANCE * hg_value(G, ray.dot(SUN.normalize()));
    let channel = |c: usize| {
        let (single, transmittance) = oracle.integrate(ray, SUN.normalize(), DENSITY * scene.medium.extinction.0[c]);
        [Outcome::by_chance(mean(&scattered, c), source * single), Outcome::by_chance(mean(&behind, c), transmittance)]
    };
    Ok(Outcome::worst((0..3).flat_map(channel)))
}

/// A field on the CPU, integrated along rays in the world.
struct Oracle<'a> {
    field: &'a Field,
    padded: Padded,
}

impl Oracle<'_> {
    /// For a field of voxels.
    fn new(field: &Field) -> Oracle<'_> {
        let Shape::Dense(dense) = &field.shape else { panic!("the cumulus has voxels") };
        Oracle { field, padded: Padded::new(dense, |x| x) }
    }

    /// The density at the middles of `steps` equal parts of the way from `from` along the unit vector `along` to the
    /// end of the support, and their length. A start before the support is moved to it.
    fn walk(&self, from: DVec3, along: DVec3, steps: usize) -> (DVec3, f64, Vec<f64>) {
        let local = self.field.local_from_world();
        let (o, d) = (local.transform_point3(from), local.transform_vector3(along));
        let (low, high) = self.field.local_box();
        let (a, b) = ((low - o) / d, (high - o) / d);
        let near = a.min(b).max_element().max(0.0);
        let h = (a.max(b).min_element() - near).max(0.0) / steps as f64;
        let at = |i: usize| self.padded.trilinear((o + d * (near + h * (i as f64 + 0.5))).to_array());
        (from + along * near, h, (0..steps).map(|i| at(i) * f64::from(self.padded.max)).collect())
    }

    /// ∫ μ(t) T(t) T_sun(t) dt along `ray` through the origin, of extinction `scale` · density; and T at its end.
    fn integrate(&self, ray: DVec3, sun: DVec3, scale: f64) -> (f64, f64) {
        /// Steps along the ray, each with half as many to the sun: some a voxel.
        const STEPS: usize = 512;
        /// Surely before the cloud.
        const BEFORE: f64 = 5.0;
        let (start, h, densities) = self.walk(ray * -BEFORE, ray, STEPS);
        let mut depth = 0.0f64;
        let mut sum = 0.0;
        for (i, density) in densities.into_iter().enumerate().filter(|(_, density)| *density > 0.0) {
            let step = scale * density * h;
            let (_, length, to_sun) = self.walk(start + ray * (h * (i as f64 + 0.5)), sun, STEPS / 2);
            let shadow = scale * length * to_sun.iter().sum::<f64>();
            // ∫ μ T dt over the step, for an extinction that is even there.
            sum += (-depth - shadow).exp() * -(-step).exp_m1();
            depth += step;
        }
        (sum, (-depth).exp())
    }
}
