//! Majorants: bounds of the interpolated density in cells.
//!
//! Cells cover the texture of [`Padded`] texels: cell c holds the points p with c·side ≤ p < (c+1)·side in texel space,
//! where texel i has its centre at i + ½. Interpolation there reads texels c·side − 1 … (c+1)·side at most, so those are
//! bounded (the apron). Bounds are of the *stored* values: what 16 or 8 bits decode to.

use glam::UVec3;
use rayon::prelude::*;

use super::Dense;

/// A density with a border of one empty texel on all sides, as the adapter stores it, relative to the greatest density.
#[derive(Clone, Debug)]
pub struct Padded {
    /// Texels along x, y, z.
    pub size: UVec3,
    /// Stored values in 0 … 1, x fastest.
    pub data: Vec<f32>,
    /// The density that a stored value of 1 stands for.
    pub max: f32,
}

impl Padded {
    /// Pads `dense` and rounds every value as `store` says.
    pub fn new(dense: &Dense, store: impl Fn(f32) -> f32 + Sync) -> Padded {
        let size = dense.size + 2;
        let max = dense.max();
        let scale = if max > 0.0 { 1.0 / f64::from(max) } else { 0.0 };
        let mut data = vec![0.0; size.x as usize * size.y as usize * size.z as usize];
        let row = dense.size.x as usize;
        let plane = size.x as usize * size.y as usize;
        data.par_chunks_mut(plane).enumerate().skip(1).take(dense.size.z as usize).for_each(|(z, out)| {
            for y in 0..dense.size.y as usize {
                let from = row * (y + dense.size.y as usize * (z - 1));
                let to = 1 + size.x as usize * (y + 1);
                for (o, &d) in out[to..to + row].iter_mut().zip(&dense.data[from..from + row]) {
                    *o = store((f64::from(d) * scale) as f32);
                }
            }
        });
        Padded { size, data, max }
    }

    /// The stored value interpolated at a point in texel space, as the shader does it; the twin of `medium_density`.
    pub fn trilinear(&self, p: [f64; 3]) -> f64 {
        let size = self.size.to_array();
        let mut sum = 0.0;
        let base = p.map(|x| (x - 0.5).floor());
        for corner in 0..8 {
            let mut weight = 1.0;
            let mut index = 0;
            let mut stride = 1;
            for axis in 0..3 {
                let up = f64::from(corner >> axis & 1);
                let f = p[axis] - 0.5 - base[axis];
                weight *= if up > 0.0 { f } else { 1.0 - f };
                let i = (base[axis] + up).clamp(0.0, f64::from(size[axis] - 1)) as usize;
                index += i * stride;
                stride *= size[axis] as usize;
            }
            sum += weight * f64::from(self.data[index]);
        }
        sum
    }
}

/// Bounds of each cell.
#[derive(Clone, Debug)]
pub struct Bounds {
    /// Cells along x, y, z.
    pub cells: UVec3,
    /// Texels along the side of a cell.
    pub side: u32,
    /// Least stored value that interpolation can give in each cell.
    pub min: Vec<f32>,
    /// Greatest.
    pub max: Vec<f32>,
}

/// Interpolation in 32-bit floats may overshoot its corners by a few units in the last place.
const ULPS: f32 = 1.0 / (1 << 20) as f32;

impl Bounds {
    /// Bounds of cells of `side` texels.
    pub fn new(field: &Padded, side: u32) -> Bounds {
        let cells = (field.size + (side - 1)) / side;
        let index = |x: u32, y: u32, z: u32| (x + field.size.x * (y + field.size.y * z)) as usize;
        let rows: Vec<(f32, f32)> = (0..cells.z * cells.y)
            .into_par_iter()
            .flat_map_iter(|row| {
                let (cy, cz) = (row % cells.y, row / cells.y);
                let range = |c: u32, n: u32| (c * side).saturating_sub(1)..=((c + 1) * side).min(n - 1);
                let mut bounds = vec![(f32::INFINITY, 0.0f32); cells.x as usize];
                for z in range(cz, field.size.z) {
                    for y in range(cy, field.size.y) {
                        let line = &field.data[index(0, y, z)..][..field.size.x as usize];
                        for (cx, b) in bounds.iter_mut().enumerate() {
                            for &v in &line[*range(cx as u32, field.size.x).start() as usize
                                ..=*range(cx as u32, field.size.x).end() as usize]
                            {
                                b.0 = b.0.min(v);
                                b.1 = b.1.max(v);
                            }
                        }
                    }
                }
                bounds
            })
            .collect();
        Bounds {
            cells,
            side,
            min: rows.iter().map(|b| b.0 * (1.0 - ULPS)).collect(),
            max: rows.iter().map(|b| b.1 * (1.0 + ULPS)).collect(),
        }
    }

    /// Bounds of cells twice the side.
    fn halve(&self) -> Bounds {
        let cells = (self.cells + 1) / 2;
        let count = (cells.x * cells.y * cells.z) as usize;
        let mut coarse = Bounds { cells, side: self.side * 2, min: vec![f32::INFINITY; count], max: vec![0.0; count] };
        let mut i = 0;
        for z in 0..self.cells.z {
            for y in 0..self.cells.y {
                for x in 0..self.cells.x {
                    let j = (x / 2 + cells.x * (y / 2 + cells.y * (z / 2))) as usize;
                    coarse.min[j] = coarse.min[j].min(self.min[i]);
                    coarse.max[j] = coarse.max[j].max(self.max[i]);
                    i += 1;
                }
            }
        }
        coarse
    }
}

/// The word that the shader reads for each cell: the majorant with its lowest bits replaced by a level.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// Cells along x, y, z.
    pub cells: UVec3,
    /// Texels along the side of a cell.
    pub side: u32,
    /// Majorant (f32 bits, rounded up) with the level in its lowest [`LEVEL_BITS`] bits.
    pub words: Vec<u32>,
}

/// Bits of a word that hold the level.
pub const LEVEL_BITS: u32 = 4;
/// The highest level of a level grid: cubes of 2⁴ cells a side.
const MAX_LEVEL: u32 = 4;
/// Texels along the side of the level grid's finest cell.
const LEVEL_SIDE: u32 = 4;
/// Cost of walking a segment over the cost of a lookup.
const STEP_COST: f64 = 1.0;
/// Mean chord of a cube over its side.
const CHORD: f64 = 0.66;

fn word(max: f32, level: u32) -> u32 {
    let mask = (1u32 << LEVEL_BITS) - 1;
    // Positive floats order like their bits, so rounding the bits up rounds the value up.
    let up = if max > 0.0 { (max.to_bits() + mask) & !mask } else { 0 };
    up | level
}

impl Words {
    /// A uniform grid of cells of `side` texels.
    pub fn uniform(field: &Padded, side: u32) -> Words {
        let bounds = Bounds::new(field, side);
        Words { cells: bounds.cells, side, words: bounds.max.iter().map(|&m| word(m, 0)).collect() }
    }

    /// One cell for all.
    pub fn global(field: &Padded) -> Words {
        Words::uniform(field, field.size.max_element())
    }

    /// A level grid: each finest cell names the cube that is cheapest to walk from there, where a stored value of 1
    /// gives an extinction of `sigma` per texel. The choice follows `sigma` in steps of two, so that the same settings
    /// give the same grid however they were reached.
    pub fn levels(field: &Padded, sigma: f64) -> Words {
        let sigma = level_sigma(sigma);
        let mut pyramid = vec![Bounds::new(field, LEVEL_SIDE)];
        while pyramid.len() <= MAX_LEVEL as usize {
            pyramid.push(pyramid[pyramid.len() - 1].halve());
        }
        let fine = pyramid[0].cells;
        let words = (0..fine.x * fine.y * fine.z)
            .into_par_iter()
            .map(|i| {
                let c = UVec3::new(i % fine.x, i / fine.x % fine.y, i / (fine.x * fine.y));
                let mut best = (f64::INFINITY, 0);
                for (level, b) in pyramid.iter().enumerate() {
                    let j = c >> UVec3::splat(level as u32);
                    let max = b.max[(j.x + b.cells.x * (j.y + b.cells.y * j.z)) as usize];
                    let length = CHORD * f64::from(b.side);
                    let cost = (STEP_COST + sigma * f64::from(max) * length) / length;
                    if cost < best.0 {
                        best = (cost, word(max, level as u32));
                    }
                }
                best.1
            })
            .collect();
        Words { cells: fine, side: LEVEL_SIDE, words }
    }

    /// Bytes on the adapter.
    pub fn bytes(&self) -> u64 {
        4 * self.words.len() as u64
    }
}

/// The extinction that levels are chosen for: the nearest power of two.
pub fn level_sigma(sigma: f64) -> f64 {
    if sigma > 0.0 && sigma.is_finite() { sigma.log2().round().exp2() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DMat4;

    /// A field with empty parts, steep edges and odd sizes.
    fn field(store: impl Fn(f32) -> f32 + Sync) -> Padded {
        let size = UVec3::new(21, 13, 34);
        let data = (0..size.x * size.y * size.z)
            .map(|i| {
                let x = (i as f32 * 0.37).sin() * (i as f32 * 0.011).cos();
                if x > 0.2 { x * 7.0 } else { 0.0 }
            })
            .collect();
        Padded::new(&Dense { size, data, world_from_index: DMat4::IDENTITY, warnings: vec![] }, store)
    }

    /// Every texel's centre, where interpolation meets its extremes, and many points between.
    fn points(field: &Padded) -> impl Iterator<Item = [f64; 3]> {
        let size = field.size;
        let centres = (0..size.x * size.y * size.z)
            .map(move |i| [i % size.x, i / size.x % size.y, i / (size.x * size.y)].map(|c| f64::from(c) + 0.5));
        let between = (0..100_000u32).map(move |i| {
            let u = |k: f64, side: u32| f64::from(side) * (f64::from(i) * k).fract();
            [u(0.754_877, size.x), u(0.569_840, size.y), u(0.362_431, size.z)]
        });
        centres.chain(between)
    }

    fn violations(field: &Padded, words: &Words) -> usize {
        points(field)
            .filter(|p| {
                let c = p.map(|x| (x / f64::from(words.side)) as u32);
                let word = words.words[(c[0] + words.cells.x * (c[1] + words.cells.y * c[2])) as usize];
                field.trilinear(*p) > f64::from(f32::from_bits(word & !15))
            })
            .count()
    }

    #[test]
    fn majorants_bound_the_interpolated_stored_field() {
        let half = |x: f32| half::f16::from_f32(x).to_f32();
        let byte = |x: f32| (x * 255.0).round() / 255.0;
        for field in [field(|x| x), field(half), field(byte)] {
            for side in [1, 3, 4, 8, 64] {
                assert_eq!(violations(&field, &Words::uniform(&field, side)), 0, "side {side}");
            }
            assert_eq!(violations(&field, &Words::global(&field)), 0);
            for sigma in [0.01, 1.0, 100.0] {
                assert_eq!(violations(&field, &Words::levels(&field, sigma)), 0, "sigma {sigma}");
            }
        }
    }

    #[test]
    fn a_missing_apron_or_rounding_down_is_seen() {
        let field = field(|x| x);
        let words = Words::uniform(&field, 4);
        let mut low = words.clone();
        for w in &mut low.words {
            *w = word(f32::from_bits(*w & !15) * 0.999, 0);
        }
        assert!(violations(&field, &low) > 0);
        let mut bare = words;
        for (i, w) in bare.words.iter_mut().enumerate() {
            let i = i as u32;
            let c = UVec3::new(i % bare.cells.x, i / bare.cells.x % bare.cells.y, i / (bare.cells.x * bare.cells.y));
            let (low, high) = (c * 4, (c * 4 + 4).min(field.size));
            let mut max = 0.0f32;
            for (x, y, z) in
                (low.x..high.x).flat_map(|x| (low.y..high.y).flat_map(move |y| (low.z..high.z).map(move |z| (x, y, z))))
            {
                max = max.max(field.data[(x + field.size.x * (y + field.size.y * z)) as usize]);
            }
            *w = word(max, 0);
        }
        assert!(violations(&field, &bare) > 0);
    }

    #[test]
    fn a_level_is_the_cube_that_holds_the_cell() {
        let field = field(|x| x);
        let words = Words::levels(&field, 0.05);
        assert!(words.words.iter().any(|w| w & 15 > 0), "thin media are walked in large cubes");
        let fine = Words::levels(&field, 1e3);
        assert!(fine.words.iter().filter(|w| **w & 15 == 0).count() > fine.words.len() / 4);
        assert_eq!(Words::levels(&field, 0.9), Words::levels(&field, 1.1));
    }

    #[test]
    fn minima_bound_from_below() {
        let field = field(|x| x);
        let bounds = Bounds::new(&field, 4);
        for p in points(&field) {
            let c = p.map(|x| x as u32 / 4);
            let i = (c[0] + bounds.cells.x * (c[1] + bounds.cells.y * c[2])) as usize;
            assert!(field.trilinear(p) >= f64::from(bounds.min[i]));
        }
    }
}
