//! Environment maps: looking them up by direction and drawing directions from them.
//!
//! The shader does the same in single precision; these are its double-precision twins.

use std::f64::consts::{PI, TAU};

use bytemuck::{Pod, Zeroable};
use glam::DVec3;
use rayon::prelude::*;

/// An equirectangular map of radiance, +Y up: `u = ½ + atan2(x, −z)/2π` and `v = acos(y)/π` of a direction (x, y, z).
/// The centre column looks along −Z, u grows towards +X, row 0 is at the zenith.
#[derive(Clone, Debug, PartialEq)]
pub struct Map {
    /// Texels along u; at least 1.
    pub width: u32,
    /// Texels along v; at least 1.
    pub height: u32,
    /// Linear Rec.709 radiance of each texel centre, u fastest, finite and not negative.
    pub texels: Vec<[f32; 3]>,
}

/// Luminance of linear Rec.709.
pub fn luminance(rgb: [f64; 3]) -> f64 {
    0.2126 * rgb[0] + 0.7152 * rgb[1] + 0.0722 * rgb[2]
}

/// The unit direction of longitude `u` (0 … 1) and cosine `y` of the angle from the zenith.
fn direction(u: f64, y: f64) -> DVec3 {
    let (sin, cos) = ((u - 0.5) * TAU).sin_cos();
    let horizontal = (1.0 - y * y).max(0.0).sqrt();
    DVec3::new(horizontal * sin, y, -horizontal * cos)
}

/// Longitude and latitude `(u, v)` of unit vector `direction`, each 0 … 1.
fn coordinates(direction: DVec3) -> (f64, f64) {
    (0.5 + direction.x.atan2(-direction.z) / TAU, direction.y.clamp(-1.0, 1.0).acos() / PI)
}

/// Cosine of the angle from the zenith at the upper edge of `row` of `height`.
fn edge(row: u32, height: u32) -> f64 {
    (PI * f64::from(row) / f64::from(height)).cos()
}

impl Map {
    /// The texel at `column`, `row`.
    fn texel(&self, column: u32, row: u32) -> [f32; 3] {
        self.texels[row as usize * self.width as usize + column as usize]
    }

    /// Radiance from unit vector `direction` (away from the viewer): bilinear between texel centres, wrapping in u and
    /// clamped in v.
    pub fn radiance(&self, direction: DVec3) -> [f32; 3] {
        let (u, v) = coordinates(direction);
        let x = u * f64::from(self.width) - 0.5;
        let y = (v * f64::from(self.height) - 0.5).clamp(0.0, f64::from(self.height - 1));
        let left = (x.floor() as i64).rem_euclid(i64::from(self.width)) as u32;
        let right = (left + 1) % self.width;
        let upper = y.floor() as u32;
        let lower = (upper + 1).min(self.height - 1);
        let (s, t) = (x - x.floor(), y - y.floor());
        let corners = [(left, upper), (right, upper), (left, lower), (right, lower)].map(|(i, j)| self.texel(i, j));
        std::array::from_fn(|c| {
            let [a, b, p, q] = corners.map(|rgb| f64::from(rgb[c]));
            ((a * (1.0 - s) + b * s) * (1.0 - t) + (p * (1.0 - s) + q * s) * t) as f32
        })
    }

    /// Solid angle of each texel of `row`, steradians.
    pub fn solid_angle(&self, row: u32) -> f64 {
        cell_solid_angle(self.width, self.height, row)
    }
}

fn cell_solid_angle(width: u32, height: u32, row: u32) -> f64 {
    TAU / f64::from(width) * (edge(row, height) - edge(row + 1, height))
}

/// A column of an alias table, as the GPU reads it.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
pub struct AliasEntry {
    /// Probability of keeping this texel; else `alias` is taken.
    pub threshold: f32,
    /// Index of the other texel.
    pub alias: u32,
    /// Density of directions in this texel, per steradian.
    pub pdf: f32,
    /// The same for the texel `alias`.
    pub pdf_alias: f32,
}

/// Draws directions in proportion to the luminance of a map, in constant time (A. J. Walker 1977; built as in M. D. Vose
/// 1991).
///
/// A texel's probability is its solid angle times the mean luminance of the bilinear map over it, which the weights
/// 1/8, 3/4, 1/8 along each axis give, and at least [`FLOOR`](Self::FLOOR) of the map's mean. The density is therefore
/// above 0 everywhere. Within a texel directions are uniform in solid angle: u is uniform and so is cos θ between the
/// edges of its row.
#[derive(Clone, Debug, PartialEq)]
pub struct AliasTable {
    /// Texels along u.
    pub width: u32,
    /// Texels along v.
    pub height: u32,
    /// One a texel, in the map's order.
    pub entries: Vec<AliasEntry>,
}

impl AliasTable {
    /// Least luminance that a texel is drawn with, relative to the mean over the sphere: bounds radiance / density of
    /// what the luminance misses.
    pub const FLOOR: f64 = 1e-3;

    /// The table of `map`; `None` if the map is black, so that there is nothing to draw.
    pub fn new(map: &Map) -> Option<AliasTable> {
        let (width, height) = (map.width, map.height);
        // Weight of each texel, filtered along u and v.
        let mut weights: Vec<f64> = map.texels.par_iter().map(|t| luminance(t.map(f64::from))).collect();
        let horizontal = filtered(&weights, width, height, |i, j| {
            let left = if i == 0 { width - 1 } else { i - 1 };
            let right = if i + 1 == width { 0 } else { i + 1 };
            ((left, j), (right, j))
        });
        weights = filtered(&horizontal, width, height, |i, j| ((i, j.saturating_sub(1)), (i, (j + 1).min(height - 1))));

        // Sums by row, then over rows: the same bits for any number of threads.
        let solid_angles: Vec<f64> = (0..height).map(|row| cell_solid_angle(width, height, row)).collect();
        let total = |weights: &[f64]| {
            let rows: Vec<f64> = weights.par_chunks(width as usize).map(|row| row.iter().sum()).collect();
            rows.iter().zip(&solid_angles).map(|(row, solid_angle)| row * solid_angle).sum::<f64>()
        };
        let power = total(&weights);
        if power.is_nan() || power <= 0.0 {
            return None;
        }
        let least = AliasTable::FLOOR * power / (4.0 * PI);
        weights.par_iter_mut().for_each(|w| *w = w.max(least));
        let power = total(&weights);

        let texels = weights.len();
        let mut entries = Vec::with_capacity(texels);
        for (row, solid_angle) in weights.chunks_mut(width as usize).zip(&solid_angles) {
            for weight in row {
                let (pdf, alias) = ((*weight / power) as f32, entries.len() as u32);
                entries.push(AliasEntry { threshold: 1.0, alias, pdf, pdf_alias: pdf });
                *weight *= solid_angle * texels as f64 / power; // its probability relative to the mean one
            }
        }
        pair(&mut weights, &mut entries);
        Some(AliasTable { width, height, entries })
    }

    /// A unit vector and its density per steradian, from three uniform numbers in [0, 1): `u[0]` chooses the texel,
    /// `u[1]` and `u[2]` the place in it along u and v.
    ///
    /// One number chooses both the entry and whether to keep it. That takes more than 24 bits for maps of any size: the
    /// shader must use two numbers.
    pub fn sample(&self, u: [f64; 3]) -> (DVec3, f64) {
        let scaled = u[0] * self.entries.len() as f64;
        let chosen = (scaled as usize).min(self.entries.len() - 1);
        let entry = &self.entries[chosen];
        let kept = scaled - (chosen as f64) < f64::from(entry.threshold);
        let (texel, pdf) = if kept { (chosen as u32, entry.pdf) } else { (entry.alias, entry.pdf_alias) };
        let (column, row) = (texel % self.width, texel / self.width);
        let (upper, lower) = (edge(row, self.height), edge(row + 1, self.height));
        let longitude = (f64::from(column) + u[1]) / f64::from(self.width);
        (direction(longitude, upper + (lower - upper) * u[2]), f64::from(pdf))
    }

    /// Density per steradian with which [`sample`](Self::sample) draws unit vector `direction`.
    pub fn pdf(&self, direction: DVec3) -> f64 {
        let (u, v) = coordinates(direction);
        let column = ((u * f64::from(self.width)) as u32).min(self.width - 1);
        let row = ((v * f64::from(self.height)) as u32).min(self.height - 1);
        f64::from(self.entries[row as usize * self.width as usize + column as usize].pdf)
    }
}

/// The mean over a texel of the linear interpolation between it and two neighbours.
fn filtered(
    values: &[f64],
    width: u32,
    height: u32,
    neighbours: impl Fn(u32, u32) -> ((u32, u32), (u32, u32)) + Sync,
) -> Vec<f64> {
    let at = |(i, j): (u32, u32)| values[j as usize * width as usize + i as usize];
    let row = |j: u32| {
        let neighbours = &neighbours;
        (0..width).map(move |i| {
            let (a, b) = neighbours(i, j);
            0.75 * at((i, j)) + 0.125 * (at(a) + at(b))
        })
    };
    let mut out = vec![0.0; values.len()];
    out.par_chunks_mut(width as usize).zip((0..height).into_par_iter()).for_each(|(out, j)| {
        out.iter_mut().zip(row(j)).for_each(|(out, value)| *out = value);
    });
    out
}

/// Fills the thresholds and aliases for probabilities `shares`, relative to their mean. Entries start out as kept whole.
///
/// Two cursors run upwards, over texels below the mean and over those that still have more than it; one that falls below
/// the mean behind the first cursor is served at once.
fn pair(shares: &mut [f64], entries: &mut [AliasEntry]) {
    let from = |start: usize, shares: &[f64], heavy: bool| {
        shares[start..].iter().position(|&s| (s >= 1.0) == heavy).map(|i| start + i)
    };
    let (Some(mut light), Some(mut heavy)) = (from(0, shares, false), from(0, shares, true)) else { return };
    let mut passed = light;
    loop {
        let pdf_alias = entries[heavy].pdf;
        entries[light] =
            AliasEntry { threshold: shares[light] as f32, alias: heavy as u32, pdf_alias, ..entries[light] };
        shares[heavy] -= 1.0 - shares[light];
        if shares[heavy] < 1.0 {
            let fallen = heavy;
            let Some(next) = from(heavy + 1, shares, true) else { return };
            heavy = next;
            if fallen < passed {
                light = fallen;
                continue;
            }
        }
        let Some(next) = from(passed + 1, shares, false) else { return };
        (light, passed) = (next, next);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Uniform numbers (SplitMix64).
    struct Uniform(u64);

    impl Uniform {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
        }
    }

    /// Dim noise with a sun, a black patch and a bright pole.
    fn map(width: u32, height: u32) -> Map {
        let mut random = Uniform(7);
        let mut texels: Vec<[f32; 3]> =
            (0..width * height).map(|_| std::array::from_fn(|_| random.next() as f32)).collect();
        texels[(2 * width + 3) as usize] = [300.0, 250.0, 100.0];
        texels[..4].fill([5.0; 3]);
        texels[(4 * width) as usize..][..9].fill([0.0; 3]);
        texels[(5 * width) as usize..][..9].fill([0.0; 3]);
        Map { width, height, texels }
    }

    #[test]
    fn the_centre_looks_along_minus_z() {
        let mut map = Map { width: 4, height: 2, texels: vec![[0.0; 3]; 8] };
        // Column 2 spans u ½ … ¾: azimuths 0° … 90° from −Z towards +X. Its upper texel's centre is 45° up.
        map.texels[2] = [1.0, 2.0, 3.0];
        let half = 0.5f64.sqrt();
        let centre = DVec3::new(0.5, half, -0.5);
        assert!(map.radiance(centre).iter().zip([1.0, 2.0, 3.0]).all(|(a, b)| (a - b).abs() < 1e-6));
        assert!((map.radiance(DVec3::new(0.0, half, -half))[0] - 0.5).abs() < 1e-6, "half way to column 1");
        assert!((map.radiance(DVec3::X)[0] - 0.25).abs() < 1e-6, "half way to column 3 and row 1");
        assert_eq!(map.radiance(DVec3::new(-0.5, half, 0.5)), [0.0; 3]);
        // Wraps in u and is clamped in v.
        (map.texels[0], map.texels[3]) = ([8.0; 3], [4.0; 3]);
        let back = map.radiance(DVec3::new(0.0, half, half))[0];
        assert!((back - 6.0).abs() < 1e-6, "half way from column 3 to column 0: {back}");
        map.texels = vec![[1.0; 3]; 8];
        for direction in [DVec3::Y, DVec3::NEG_Y, DVec3::Z, DVec3::new(1e-9, 0.0, 1.0).normalize()] {
            assert_eq!(map.radiance(direction), [1.0; 3]);
        }
    }

    #[test]
    fn coordinates_invert_directions() {
        for (u, y) in [(0.1, 0.9), (0.5, 0.0), (0.77, -0.6), (0.999, 0.3)] {
            let (back, v) = coordinates(direction(u, y));
            assert!((back - u).abs() < 1e-12 && ((v * PI).cos() - y).abs() < 1e-12);
        }
    }

    #[test]
    fn densities_integrate_to_one_and_agree_with_the_table() {
        let map = map(32, 16);
        let table = AliasTable::new(&map).expect("the map is not black");
        let integral = |extra: f64| {
            let cells = table.entries.iter().enumerate();
            cells.map(|(i, e)| f64::from(e.pdf) * map.solid_angle(i as u32 / 32) * (1.0 + extra)).sum::<f64>()
        };
        assert!((integral(0.0) - 1.0).abs() < 1e-6, "{}", integral(0.0));
        assert!((integral(1e-5) - 1.0).abs() > 1e-6, "an error of 1e-5 must show");
        // What the entries draw, texel by texel.
        let mut drawn = vec![0.0; table.entries.len()];
        for (i, e) in table.entries.iter().enumerate() {
            assert!((0.0..=1.0).contains(&e.threshold) && e.pdf > 0.0, "{e:?}");
            assert_eq!(e.pdf_alias, table.entries[e.alias as usize].pdf);
            drawn[i] += f64::from(e.threshold) / 512.0;
            drawn[e.alias as usize] += (1.0 - f64::from(e.threshold)) / 512.0;
        }
        for (i, (drawn, e)) in drawn.iter().zip(&table.entries).enumerate() {
            let expected = f64::from(e.pdf) * map.solid_angle(i as u32 / 32);
            assert!((drawn / expected - 1.0).abs() < 1e-5, "texel {i}: {drawn} for {expected}");
        }
    }

    #[test]
    fn densities_are_those_of_the_filtered_map() {
        let mut map = Map { width: 16, height: 8, texels: vec![[0.0; 3]; 128] };
        map.texels[2 * 16] = [1.0; 3]; // in the first column: neighbours wrap
        let table = AliasTable::new(&map).expect("the map is not black");
        let pdf = |column: usize, row: usize| f64::from(table.entries[row * 16 + column].pdf);
        let centre = pdf(0, 2);
        for (column, row, weight) in [(1, 2, 1.0 / 6.0), (15, 2, 1.0 / 6.0), (0, 3, 1.0 / 6.0), (15, 1, 1.0 / 36.0)] {
            assert!((pdf(column, row) / centre - weight).abs() < 1e-6, "{column} {row}");
        }
        // The rest: the floor, 1e-3 of the mean.
        let power: f64 = [(1, 0.125), (2, 0.75), (3, 0.125)].iter().map(|(row, w)| w * map.solid_angle(*row)).sum();
        let least = AliasTable::FLOOR * power / (4.0 * PI) / 0.5625;
        assert!((pdf(8, 5) / centre / least - 1.0).abs() < 1e-5);
    }

    /// χ² of samples over quarter texels against the density, in standard deviations above its mean.
    fn chi_squared(table: &AliasTable, sample: impl Fn([f64; 3]) -> DVec3) -> f64 {
        const SAMPLES: usize = 400_000;
        const LEAST_EXPECTED: f64 = 8.0;
        let (width, height) = (table.width, table.height);
        let mut random = Uniform(1);
        let mut counts = vec![0.0; table.entries.len() * 4];
        for _ in 0..SAMPLES {
            let d = sample([random.next(), random.next(), random.next()]);
            let (u, v) = coordinates(d);
            let column = ((u * f64::from(2 * width)) as usize).min(2 * width as usize - 1);
            let row = ((v * f64::from(height)) as u32).min(height - 1);
            let (upper, lower) = (edge(row, height), edge(row + 1, height));
            let below = usize::from(d.y < 0.5 * (upper + lower));
            counts[(2 * row as usize + below) * 2 * width as usize + column] += 1.0;
        }
        let (mut sum, mut cells) = (0.0, -1.0);
        for (i, count) in counts.iter().enumerate() {
            let (column, row) = (i % (2 * width as usize) / 2, i / (4 * width as usize));
            let pdf = f64::from(table.entries[row * width as usize + column].pdf);
            let expected = SAMPLES as f64 * pdf * cell_solid_angle(width, height, row as u32) / 4.0;
            if expected >= LEAST_EXPECTED {
                sum += (count - expected) * (count - expected) / expected;
                cells += 1.0;
            }
        }
        assert!(cells > 100.0, "{cells} cells");
        (sum - cells) / (2.0 * cells).sqrt()
    }

    #[test]
    fn samples_follow_the_density() {
        let mut map = map(16, 8);
        map.texels[35] = [3.0; 3]; // a tame sun: most samples are to land elsewhere
        let table = AliasTable::new(&map).expect("the map is not black");
        let z = chi_squared(&table, |u| table.sample(u).0);
        assert!(z.abs() < 4.0, "{z}");
        let uniform_in_angle = |u: [f64; 3]| {
            let d = table.sample([u[0], u[1], 0.0]).0;
            direction(coordinates(d).0, (d.y.acos() + PI / 8.0 * u[2]).cos())
        };
        let z = chi_squared(&table, uniform_in_angle);
        assert!(z > 8.0, "planted: uniform in the angle, not in its cosine: {z}");
        let mut planted = table.clone();
        planted.entries.iter_mut().for_each(|e| e.threshold *= 0.97);
        let z = chi_squared(&table, |u| planted.sample(u).0);
        assert!(z > 8.0, "planted: thresholds 3 % too low: {z}");
    }

    #[test]
    fn samples_carry_their_density() {
        let map = map(32, 16);
        let table = AliasTable::new(&map).expect("the map is not black");
        let mut random = Uniform(2);
        for _ in 0..10_000 {
            // Off the texels' edges, which rounding may put into the neighbour.
            let u = [random.next(), 0.01 + 0.98 * random.next(), 0.01 + 0.98 * random.next()];
            let (d, pdf) = table.sample(u);
            assert!((d.length() - 1.0).abs() < 1e-12);
            assert_eq!(table.pdf(d), pdf);
        }
    }

    #[test]
    fn importance_sampling_integrates_the_radiance() {
        const SAMPLES: u32 = 100_000;
        let map = map(32, 16);
        let table = AliasTable::new(&map).expect("the map is not black");
        // Quadrature of the bilinear map on 16 × 16 points a texel.
        let (columns, rows) = (32 * 16, 16 * 16);
        let mut truth = 0.0;
        for j in 0..rows {
            let y = ((f64::from(j) + 0.5) / f64::from(rows) * PI).cos();
            let solid_angle = cell_solid_angle(columns, rows, j);
            for i in 0..columns {
                let d = direction((f64::from(i) + 0.5) / f64::from(columns), y);
                truth += solid_angle * luminance(map.radiance(d).map(f64::from));
            }
        }
        let estimate = |factor: f64| {
            let mut random = Uniform(3);
            let (mut sum, mut squares) = (0.0, 0.0);
            for _ in 0..SAMPLES {
                let (d, pdf) = table.sample([random.next(), random.next(), random.next()]);
                let x = luminance(map.radiance(d).map(f64::from)) / (pdf * factor);
                sum += x;
                squares += x * x;
            }
            let mean = sum / f64::from(SAMPLES);
            let error = ((squares / f64::from(SAMPLES) - mean * mean) / f64::from(SAMPLES)).sqrt();
            ((mean - truth) / error, error / truth)
        };
        let (z, relative_error) = estimate(1.0);
        assert!(z.abs() < 4.0 && relative_error < 0.004, "{z} {relative_error}");
        let (z, _) = estimate(1.03);
        assert!(z.abs() > 8.0, "planted: a density 3 % too high: {z}");
    }

    #[test]
    fn black_and_tiny_maps_are_handled() {
        assert_eq!(AliasTable::new(&Map { width: 4, height: 2, texels: vec![[0.0; 3]; 8] }), None);
        let one =
            AliasTable::new(&Map { width: 1, height: 1, texels: vec![[0.0, 0.0, 2.0]] }).expect("blue is not black");
        let (_, pdf) = one.sample([0.3, 0.4, 0.5]);
        assert!((pdf * 4.0 * PI - 1.0).abs() < 1e-6);
    }
}
