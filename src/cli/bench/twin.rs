//! The bare kernel on the CPU: the same walk as shaders/bench/bare.wgsl in scalar Rust, on all cores.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::render::params::Params;
use crate::volume::majorant::Padded;

/// Twin of shaders/core/rng.wgsl.
struct Rng {
    state: u32,
    increment: u32,
}

const MULTIPLIER: u32 = 747_796_405;

fn mix(word: u32) -> u32 {
    let x = ((word >> ((word >> 28) + 4)) ^ word).wrapping_mul(277_803_737);
    (x >> 22) ^ x
}

impl Rng {
    fn new(pixel: u32, sample: u32, seed: u32) -> Rng {
        let scramble = |x: u32| mix(x.wrapping_mul(MULTIPLIER).wrapping_add(2_891_336_453));
        let c = scramble(seed ^ scramble(sample ^ scramble(pixel)));
        Rng { state: c, increment: mix(c ^ 0x9e37_79b9) << 1 | 1 }
    }

    fn next(&mut self) -> f32 {
        let old = self.state;
        self.state = old.wrapping_mul(MULTIPLIER).wrapping_add(self.increment);
        (mix(old) >> 8) as f32 * (1.0 / (1 << 24) as f32)
    }
}

/// Stored value at a point in local space.
fn density(field: &Padded, p: Vec3) -> f32 {
    let q = p - 0.5;
    let base = q.floor();
    let f = q - base;
    let last = field.size.as_ivec3() - 1;
    let a = base.as_ivec3().clamp(IVec3::ZERO, last);
    let b = (a + 1).min(last);
    let (row, plane) = (field.size.x as usize, field.size.x as usize * field.size.y as usize);
    let line = |y: i32, z: i32| {
        let from = row * y as usize + plane * z as usize;
        let (left, right) = (field.data[from + a.x as usize], field.data[from + b.x as usize]);
        left + (right - left) * f.x
    };
    let (y0, y1) = (line(a.y, a.z), line(b.y, a.z));
    let (z0, z1) = (line(a.y, b.z), line(b.y, b.z));
    let (low, high) = (y0 + (y1 - y0) * f.y, z0 + (z1 - z0) * f.y);
    low + (high - low) * f.z
}

/// A direction whose cosine with `w` is 1 − `drop`; twin of `math_around_drop`.
fn around(w: Vec3, drop: f32, phi: f32) -> Vec3 {
    let s = if w.z >= 0.0 { 1.0 } else { -1.0 };
    let a = -1.0 / (s + w.z);
    let b = w.x * w.y * a;
    let x = Vec3::new(1.0 + s * w.x * w.x * a, s * b, -s * w.x);
    let y = Vec3::new(b, s + w.y * w.y * a, -w.y);
    let r = (drop * (2.0 - drop)).max(0.0).sqrt();
    (x * (r * phi.cos()) + y * (r * phi.sin()) + w * (1.0 - drop)).normalize()
}

/// One walk; its lookups.
fn walk(params: &Params, field: &Padded, x: u32, y: u32, sample: u32) -> u64 {
    let vec = Vec3::from_array;
    let (low, high) = (vec(params.box_min), vec(params.box_max));
    let to_local = |w: Vec3| {
        vec(params.local_from_world_x) * w.x
            + vec(params.local_from_world_y) * w.y
            + vec(params.local_from_world_z) * w.z
    };
    let mut rng = Rng::new(y * params.width + x, sample, params.seed);
    let film = [(x, params.inv_width), (y, params.inv_height)].map(|(i, inverse)| (i as f32 + rng.next()) * inverse);
    let right = vec(params.camera_right) * (2.0 * film[0] - 1.0);
    let mut world = (vec(params.camera_forward) + right + vec(params.camera_up) * (1.0 - 2.0 * film[1])).normalize();
    let mut origin = vec(params.camera_local);
    let mut lookups = 0;
    for bounce in 0..=params.max_bounces {
        let direction = to_local(world);
        let (a, b) = ((low - origin) / direction, (high - origin) / direction);
        let exit = a.max(b).min_element();
        let mut t = if bounce == 0 { a.min(b).max_element().max(0.0) } else { 0.0 };
        loop {
            t += -(1.0 - rng.next()).ln() / params.sigma;
            // A ray along a face may have no number for its exit.
            if t >= exit || exit.is_nan() {
                return lookups;
            }
            lookups += 1;
            if rng.next() < density(field, origin + direction * t) {
                break;
            }
        }
        origin += direction * t;
        // Henyey–Greenstein; twin of `lobe_drop`.
        let (g, xi) = (params.g, rng.next());
        let p = 2.0 * (1.0 - xi);
        let a = (1.0 - g) / (1.0 - g + 2.0 * g * xi);
        let drop = (p * a * a * (1.0 + g * (1.0 - 0.5 * p))).min(2.0);
        world = around(world, drop, std::f32::consts::TAU * rng.next());
    }
    lookups
}

/// Lookups of all walks of samples `first` … `first + samples − 1` of every pixel.
pub fn run(params: &Params, field: &Padded, first: u32, samples: u32) -> u64 {
    (0..params.height)
        .into_par_iter()
        .map(|y| {
            let row = |x| (first..first + samples).map(|s| walk(params, field, x, y, s)).sum::<u64>();
            (0..params.width).map(row).sum::<u64>()
        })
        .sum()
}
