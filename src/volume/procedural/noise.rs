//! Random numbers, gradient noise and billows, by + − × ÷ √ and floor alone: the same bits on every platform.
//!
//! Points are in cells of the noise's lattice. Feature positions come from hashes of whole cell numbers, so they do not
//! move when a grid is refined.

use glam::{IVec3, Vec3};

/// The step of the generator's counter, 2³² / golden ratio.
const GOLDEN: u32 = 0x9E37_79B9;

/// Mixes all bits of `x` (a bijection; constants of C. Wellons' hash prospector, "lowbias32").
fn mix(mut x: u32) -> u32 {
    x ^= x >> 16;
    x = x.wrapping_mul(0x7feb_352d);
    x ^= x >> 15;
    x = x.wrapping_mul(0x846c_a68b);
    x ^ (x >> 16)
}

/// A sequential generator of uniform numbers.
pub struct Random {
    state: u32,
}

impl Random {
    /// The generator of stream `s`.
    pub fn new(s: u32) -> Random {
        const MULTIPLIER: u32 = 747_796_405;
        const DROPPED: usize = 8;
        let mut random = Random { state: s.wrapping_mul(MULTIPLIER) };
        for _ in 0..DROPPED {
            random.next();
        }
        random
    }

    /// The next number in [0, 1), a multiple of 2⁻²⁴.
    pub fn next(&mut self) -> f32 {
        self.state = self.state.wrapping_add(GOLDEN);
        (mix(self.state) >> 8) as f32 / (1u32 << 24) as f32
    }

    /// A unit vector, uniform over the sphere, by rejection.
    pub fn direction(&mut self) -> Vec3 {
        loop {
            let x = 2.0 * self.next() - 1.0;
            let y = 2.0 * self.next() - 1.0;
            let z = 2.0 * self.next() - 1.0;
            let v = Vec3::new(x, y, z);
            let squared = v.length_squared();
            if squared > 0.001 && squared < 1.0 {
                return v / squared.sqrt();
            }
        }
    }
}

/// `x` smoothly from 0 at `a` to 1 at `b`: 3t² − 2t³ of the clamped fraction.
pub fn smoothstep(a: f32, b: f32, x: f32) -> f32 {
    let t = ((x - a) / (b - a)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

/// The hash of lattice cell `cell` for noise `n`.
fn hash(cell: IVec3, n: u32) -> u32 {
    mix((cell.x as u32).wrapping_mul(0x8da6_b343)
        ^ (cell.y as u32).wrapping_mul(0xd816_3841)
        ^ (cell.z as u32).wrapping_mul(0xcb1a_b31f)
        ^ n.wrapping_mul(GOLDEN))
}

/// Three 10-bit numbers of a hash, each less their mean: −511.5 … 511.5.
fn signed_thirds(hash: u32) -> Vec3 {
    const LOW: u32 = 1023;
    Vec3::new((hash & LOW) as f32, (hash >> 10 & LOW) as f32, (hash >> 20 & LOW) as f32) - 511.5
}

/// Gradient noise number `n` at `p`: about ±1, mean 0, feature size 1 (K. Perlin, "Improving Noise", 2002, with hashed
/// gradients).
pub fn gradient(p: Vec3, n: u32) -> f32 {
    const GRADIENT_SCALE: f32 = 1.0 / 330.0;
    let floor = p.floor();
    let cell = floor.as_ivec3();
    let t = p - floor;
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let corner = |x: i32, y: i32, z: i32| {
        let offset = IVec3::new(x, y, z);
        (signed_thirds(hash(cell + offset, n)) * GRADIENT_SCALE).dot(t - offset.as_vec3())
    };
    let lerp = |a: f32, b: f32, t: f32| a + (b - a) * t;
    let row = |y: i32, z: i32| lerp(corner(0, y, z), corner(1, y, z), fade.x);
    let face = |z: i32| lerp(row(0, z), row(1, z), fade.y);
    lerp(face(0), face(1), fade.z)
}

/// What [`billow`] finds.
pub struct Billow {
    /// 1 on the feature point, 0 far from all of them; 0.37 on average.
    pub value: f32,
    /// From the nearest feature point to the point asked for.
    pub offset: Vec3,
    /// The hash of that feature point's cell.
    pub hash: u32,
}

/// Billow number `n` at `p`: paraboloids round one feature point a cell, with sharp creases where they meet.
///
/// The value is 1 − min(1, 2.44 · m), m the least squared distance to a feature point of the 2×2×2 nearest cells. Any
/// other feature point is at least 0.64 = 1/√2.44 away, as points stray at most 0.36 from their cell's centre, so the
/// value is exact and continuous.
pub fn billow(p: Vec3, n: u32) -> Billow {
    const STRAY: f32 = 0.36;
    const FALL: f32 = 2.44;
    let corner = (p - 0.5).floor();
    let (mut least, mut offset, mut of) = (f32::INFINITY, Vec3::ZERO, 0);
    for i in 0..8 {
        let cell = corner.as_ivec3() + IVec3::new(i & 1, i >> 1 & 1, i >> 2);
        let h = hash(cell, n);
        let v = p - (cell.as_vec3() + 0.5 + signed_thirds(h) * (STRAY / 511.5));
        let squared = v.length_squared();
        if squared < least {
            (least, offset, of) = (squared, v, h);
        }
    }
    Billow { value: 1.0 - (FALL * least).min(1.0), offset, hash: of }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_uniform_and_directions_unit() {
        let mut random = Random::new(3);
        let n = 10_000;
        let mean = (0..n).map(|_| random.next()).sum::<f32>() / n as f32;
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        let sum: Vec3 = (0..n).map(|_| random.direction()).inspect(|d| assert!((d.length() - 1.0).abs() < 1e-6)).sum();
        assert!((sum / n as f32).length() < 0.03);
    }

    /// Points along a line that crosses many cells.
    fn walk() -> impl Iterator<Item = (Vec3, Vec3)> {
        let step = Vec3::new(1e-3, 0.7e-3, 0.4e-3);
        (0..20_000).map(move |i| (Vec3::new(-9.0, -7.0, -5.0) + i as f32 * step, step))
    }

    #[test]
    fn noise_is_continuous_centred_and_about_one() {
        let (mut sum, mut greatest) = (0.0, 0.0f32);
        for (p, step) in walk() {
            let (a, b) = (gradient(p, 5), gradient(p + step, 5));
            assert!((a - b).abs() < 0.02, "jump of {} at {p}", a - b);
            sum += a / 20_000.0;
            greatest = greatest.max(a.abs());
        }
        assert!(sum.abs() < 0.15 && (0.5..2.0).contains(&greatest), "{sum} {greatest}");
    }

    #[test]
    fn billows_are_exact_and_centred() {
        let mut random = Random::new(2);
        let mut sum = 0.0;
        for _ in 0..20_000 {
            let p = 40.0 * Vec3::new(random.next(), random.next(), random.next()) - 20.0;
            // The nearest of 4×4×4 cells, not of the 8 nearest.
            let corner = (p - 0.5).floor().as_ivec3() - 1;
            let least = (0..64)
                .map(|i| corner + IVec3::new(i & 3, i >> 2 & 3, i >> 4))
                .map(|c| (p - (c.as_vec3() + 0.5 + signed_thirds(hash(c, 7)) * (0.36 / 511.5))).length_squared())
                .fold(f32::INFINITY, f32::min);
            let found = billow(p, 7);
            assert_eq!(found.value, 1.0 - (2.44 * least).min(1.0), "at {p}");
            assert_eq!(found.offset.length_squared().min(0.4), least.min(0.4), "at {p}");
            sum += found.value / 20_000.0;
        }
        assert!((sum - 0.37).abs() < 0.01, "{sum}");
    }
}
