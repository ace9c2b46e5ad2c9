//! The bare kernel on the CPU: the same walk as shaders/bench/bare.wgsl in scalar Rust, on all cores.

use glam::{IVec3, Vec3};
use rayon::prelude::*;

use crate::render::params::Params;
use crate::volume::majorant::{Bounds, Padded};

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

/// One walk by a majorant of 1; `look` meets every place where it looks at the density, in local space.
fn walk(params: &Params, field: &Padded, x: u32, y: u32, sample: u32, mut look: impl FnMut(Vec3)) {
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
    for bounce in 0..=params.max_bounces {
        let direction = to_local(world);
        let (a, b) = ((low - origin) / direction, (high - origin) / direction);
        let exit = a.max(b).min_element();
        let mut t = if bounce == 0 { a.min(b).max_element().max(0.0) } else { 0.0 };
        loop {
            t += -(1.0 - rng.next()).ln() / params.sigma;
            // A ray along a face may have no number for its exit.
            if t >= exit || exit.is_nan() {
                return;
            }
            let place = origin + direction * t;
            look(place);
            if rng.next() < density(field, place) {
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
}

/// Lookups of all walks of samples `first` … `first + samples − 1` of every pixel.
pub fn run(params: &Params, field: &Padded, first: u32, samples: u32) -> u64 {
    over_walks(params, first, samples, |x, y, s| {
        let mut lookups = 0;
        walk(params, field, x, y, s, |_| lookups += 1);
        [lookups, 0]
    })[0]
}

/// ⟨µc/µ̄⟩, the mean share of the least density in the bound, weighted by bound and transmittance: what decomposition
/// tracking by the cells of `bounds` saves of delta tracking's lookups on the walks of one sample of every pixel. The walks'
/// own majorant is 1, so their lookups lie where transmittance is, whatever the cells are.
pub fn control_share(params: &Params, field: &Padded, bounds: &Bounds) -> f64 {
    let [min, max] = over_walks(params, 0, 1, |x, y, s| {
        let mut sums = [0.0; 2];
        walk(params, field, x, y, s, |p| {
            let cell = ((p - 0.5) / bounds.side as f32).max(Vec3::ZERO).as_uvec3().min(bounds.cells - 1);
            let i = bounds.index(cell);
            sums[0] += f64::from(bounds.min[i]);
            sums[1] += f64::from(bounds.max[i]);
        });
        sums
    });
    if max > 0.0 { min / max } else { 0.0 }
}

/// Sums over all walks.
fn over_walks<T: Send + Default + Copy + std::ops::AddAssign>(
    params: &Params,
    first: u32,
    samples: u32,
    walk: impl Fn(u32, u32, u32) -> [T; 2] + Sync,
) -> [T; 2] {
    let add = |mut a: [T; 2], b: [T; 2]| {
        a[0] += b[0];
        a[1] += b[1];
        a
    };
    let rows = (0..params.height).into_par_iter().map(|y| {
        let of_pixel = |x| (first..first + samples).map(move |s| (x, s));
        (0..params.width).flat_map(of_pixel).map(|(x, s)| walk(x, y, s)).fold([T::default(); 2], add)
    });
    // In order, so that floating sums are the same in every run.
    rows.collect::<Vec<_>>().into_iter().fold([T::default(); 2], add)
}
