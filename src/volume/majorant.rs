//! Majorants: bounds of the interpolated density in cells.
//!
//! Cells cover the texture of [`Padded`] texels from the centre of the first to that of the last: cell c holds the points
//! p with c·side + ½ ≤ p < (c+1)·side + ½ in texel space, where texel i has its centre at i + ½. Interpolation there reads
//! the texels c·side … (c+1)·side and no others; cells whose faces lie between centres would read one more. Bounds are of
//! the *stored* values: what 16 or 8 bits decode to.

use glam::UVec3;
use rayon::prelude::*;

use super::Dense;
use crate::scene::Control;

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
    /// Mean of the texels.
    pub mean: Vec<f32>,
}

/// Interpolation in 32-bit floats may overshoot its corners by a few units in the last place.
const ULPS: f32 = 1.0 / (1 << 20) as f32;
/// How far outside its cell along an axis a point may be, in texels, that the walk or a sampler's rounded weights take
/// for one inside.
const SLACK: f32 = 1.0 / 128.0;

/// Least and greatest value, of a cell's own texels and of those with one more layer around.
#[derive(Clone, Copy, Debug)]
struct Range {
    min: f32,
    max: f32,
    wide_min: f32,
    wide_max: f32,
    sum: f32,
    count: f32,
}

impl Range {
    const NONE: Range =
        Range { min: f32::INFINITY, max: 0.0, wide_min: f32::INFINITY, wide_max: 0.0, sum: 0.0, count: 0.0 };

    /// Joins another range, whose own part counts only where `own`.
    fn join(&mut self, other: Range, own: bool) {
        self.wide_min = self.wide_min.min(other.wide_min);
        self.wide_max = self.wide_max.max(other.wide_max);
        if own {
            self.min = self.min.min(other.min);
            self.max = self.max.max(other.max);
            self.sum += other.sum;
            self.count += other.count;
        }
    }

    /// Least and greatest value at the points within [`SLACK`] of the cell, and the mean of its texels. Each axis lends at
    /// most that weight to the layer around.
    fn bounds(self) -> [f32; 3] {
        let weight = 3.0 * SLACK;
        let (down, up) = (self.min - self.wide_min, self.wide_max - self.max);
        let min = (self.min - weight * down) * (1.0 - ULPS);
        [min, (self.max + weight * up) * (1.0 + ULPS), self.sum / self.count]
    }
}

/// The texels along one axis of `n` that cell `c` bounds, with one more to either side, and whether each is its own.
fn texels(c: u32, side: u32, n: u32) -> impl Iterator<Item = (u32, bool)> {
    let own = c * side..=(c + 1) * side;
    let wide = own.start().saturating_sub(1)..=(own.end() + 1).min(n - 1);
    wide.map(move |i| (i, own.contains(&i)))
}

impl Bounds {
    /// Bounds of cells of `side` texels.
    pub fn new(field: &Padded, side: u32) -> Bounds {
        let size = field.size;
        let cells = ((size.max(UVec3::splat(2)) - 1) + (side - 1)) / side;
        let layers: Vec<[f32; 3]> = (0..cells.z)
            .into_par_iter()
            .flat_map_iter(|cz| {
                // First along x for every row of texels, then across rows.
                let plane = cells.x as usize * size.y as usize;
                let mut rows: Vec<(Vec<Range>, bool)> = Vec::new();
                for (z, own) in texels(cz, side, size.z) {
                    let mut ranges = Vec::with_capacity(plane);
                    for y in 0..size.y {
                        let line = &field.data[(size.x * (y + size.y * z)) as usize..][..size.x as usize];
                        ranges.extend((0..cells.x).map(|cx| {
                            let mut range = Range::NONE;
                            for (x, own) in texels(cx, side, size.x) {
                                let v = line[x as usize];
                                let one = Range { min: v, max: v, wide_min: v, wide_max: v, sum: v, count: 1.0 };
                                range.join(one, own);
                            }
                            range
                        }));
                    }
                    rows.push((ranges, own));
                }
                let mut layer = vec![Range::NONE; cells.x as usize * cells.y as usize];
                for (cy, line) in layer.chunks_exact_mut(cells.x as usize).enumerate() {
                    for (ranges, own_z) in &rows {
                        for (y, own_y) in texels(cy as u32, side, size.y) {
                            let from = &ranges[y as usize * cells.x as usize..][..cells.x as usize];
                            line.iter_mut().zip(from).for_each(|(a, b)| a.join(*b, own_y && *own_z));
                        }
                    }
                }
                layer.into_iter().map(Range::bounds)
            })
            .collect();
        let part = |i: usize| layers.iter().map(|b| b[i]).collect();
        Bounds { cells, side, min: part(0), max: part(1), mean: part(2) }
    }

    /// Place of a cell in the lists.
    pub fn index(&self, c: UVec3) -> usize {
        (c.x + self.cells.x * (c.y + self.cells.y * c.z)) as usize
    }

    /// Bounds of cells twice the side.
    fn halve(&self) -> Bounds {
        let cells = (self.cells + 1) / 2;
        let count = (cells.x * cells.y * cells.z) as usize;
        let zeros = || vec![0.0; count];
        let mut coarse =
            Bounds { cells, side: self.side * 2, min: vec![f32::INFINITY; count], max: zeros(), mean: zeros() };
        let mut parts = vec![0.0f32; count];
        let mut i = 0;
        for z in 0..self.cells.z {
            for y in 0..self.cells.y {
                for x in 0..self.cells.x {
                    let j = coarse.index(UVec3::new(x, y, z) / 2);
                    coarse.min[j] = coarse.min[j].min(self.min[i]);
                    coarse.max[j] = coarse.max[j].max(self.max[i]);
                    coarse.mean[j] += self.mean[i];
                    parts[j] += 1.0;
                    i += 1;
                }
            }
        }
        coarse.mean.iter_mut().zip(parts).for_each(|(mean, n)| *mean /= n);
        coarse
    }

    /// Bounds of cells of `side` texels, of twice that, and so on, to at least `largest`.
    pub(super) fn pyramid(field: &Padded, side: u32, largest: u32) -> Vec<Bounds> {
        let mut pyramid = vec![Bounds::new(field, side)];
        while pyramid[pyramid.len() - 1].side < largest {
            pyramid.push(pyramid[pyramid.len() - 1].halve());
        }
        pyramid
    }

    /// What the shader reads for cell `i`: its majorant with `level`, and control and residual bound if asked for.
    pub(super) fn words(&self, i: usize, level: u32, control: Option<Control>) -> [u32; 2] {
        [word(self.max[i], level), control.map_or(0, |c| control_word(self.min[i], self.max[i], self.mean[i], c))]
    }
}

/// The words that the shader reads for each cell.
#[derive(Clone, Debug, PartialEq)]
pub struct Words {
    /// Cells along x, y, z.
    pub cells: UVec3,
    /// Texels along the side of a cell.
    pub side: u32,
    /// Words of a cell: 1, 2 or 4.
    pub channels: u32,
    /// Of each cell the majorant (f32 bits, rounded up) with the level in its lowest [`LEVEL_BITS`] bits; with two
    /// channels also control and residual bound, as two 16-bit floats. With four: see [`super::tree`].
    pub words: Vec<u32>,
}

/// Bits of a word that hold the level.
pub const LEVEL_BITS: u32 = 4;
/// Texels along the side of the largest cube that a level grid walks at once.
const LARGEST_SIDE: u32 = 64;
/// Texels along the side of a level grid's finest cell at most; in dense media smaller ones reject fewer candidates.
const FINEST_SIDE: f64 = 4.0;
/// Optical thickness of a cell's side for the greatest density, beyond which a finer cell pays.
const FINEST_THICKNESS: f64 = 4.0;
/// Cells of a level grid at most: 2 MiB, about what a core's own cache holds. More cost more than they save.
const MOST_CELLS: u32 = 1 << 19;
/// Cost of walking a segment over the cost of a lookup.
pub(super) const STEP_COST: f64 = 1.0;
/// Mean chord of a cube over its side.
const CHORD: f64 = 0.66;

pub(super) fn word(max: f32, level: u32) -> u32 {
    let mask = (1u32 << LEVEL_BITS) - 1;
    // Positive floats order like their bits, so rounding the bits up rounds the value up.
    let up = if max > 0.0 { (max.to_bits() + mask) & !mask } else { 0 };
    up | level
}

/// Control and residual bound: the greatest difference between the density and the control. Both as they decode; a
/// minimum never rounds up.
pub(super) fn control_word(min: f32, max: f32, mean: f32, control: Control) -> u32 {
    let control = match control {
        Control::Min => f16_below(min.max(0.0)),
        Control::Mean => half::f16::from_f32(mean),
    };
    let c = control.to_f32();
    let residual = -f16_below(-(max - c).max(c - min)).to_f32();
    u32::from(control.to_bits()) | u32::from(half::f16::from_f32(residual).to_bits()) << 16
}

/// The greatest 16-bit float that is not above `x`, a finite number of at most 1 in magnitude.
fn f16_below(x: f32) -> half::f16 {
    let near = half::f16::from_f32(x);
    if near.to_f32() <= x {
        return near;
    }
    // Towards −∞: the magnitude of a positive float falls, that of a negative one grows.
    let bits = near.to_bits();
    let below = if near.to_f32() > 0.0 { bits - 1 } else { (bits | 0x8000) + 1 };
    half::f16::from_bits(below)
}

impl Words {
    pub(super) fn of(
        bounds: &Bounds,
        control: Option<Control>,
        cell: impl Fn(usize) -> [u32; 2] + Sync + Send,
    ) -> Words {
        let count = bounds.max.len();
        let words: Vec<[u32; 2]> = (0..count).into_par_iter().map(cell).collect();
        let words = match control {
            None => words.into_iter().map(|w| w[0]).collect(),
            Some(_) => words.into_flattened(),
        };
        Words { cells: bounds.cells, side: bounds.side, channels: 1 + u32::from(control.is_some()), words }
    }

    /// A uniform grid of cells of `side` texels.
    pub fn uniform(field: &Padded, side: u32, control: Option<Control>) -> Words {
        let bounds = Bounds::new(field, side);
        Words::of(&bounds, control, |i| bounds.words(i, 0, control))
    }

    /// One cell for all.
    pub fn global(field: &Padded, control: Option<Control>) -> Words {
        Words::uniform(field, field.size.max_element(), control)
    }

    /// A level grid: each finest cell names the cube that is cheapest to walk from there, where a stored value of 1
    /// gives an extinction of `sigma` per texel. The choice follows `sigma` in steps of two, so that the same settings
    /// give the same grid however they were reached.
    pub fn levels(field: &Padded, sigma: f64, control: Option<Control>) -> Words {
        let sigma = level_sigma(sigma);
        let pyramid = Bounds::pyramid(field, finest_side(field.size, sigma), LARGEST_SIDE);
        let fine = pyramid[0].cells;
        Words::of(&pyramid[0], control, |i| {
            let i = i as u32;
            let c = UVec3::new(i % fine.x, i / fine.x % fine.y, i / (fine.x * fine.y));
            let mut best = (f64::INFINITY, [0; 2]);
            for (level, b) in pyramid.iter().enumerate() {
                let j = b.index(c >> UVec3::splat(level as u32));
                let length = CHORD * f64::from(b.side);
                let cost = (STEP_COST + sigma * f64::from(b.max[j]) * length) / length;
                if cost < best.0 {
                    best = (cost, b.words(j, level as u32, control));
                }
            }
            best.1
        })
    }

    /// Bytes on the adapter.
    pub fn bytes(&self) -> u64 {
        4 * self.words.len() as u64
    }
}

/// Texels along the side of the finest cell of a level grid over `size` texels.
pub(super) fn finest_side(size: UVec3, sigma: f64) -> u32 {
    let mut side = (FINEST_THICKNESS / sigma).clamp(1.0, FINEST_SIDE) as u32;
    while (size / side).as_u64vec3().element_product() > u64::from(MOST_CELLS) {
        side *= 2;
    }
    side
}

/// The extinction that levels are chosen for: the nearest power of two.
pub fn level_sigma(sigma: f64) -> f64 {
    if sigma > 0.0 && sigma.is_finite() { sigma.log2().round().exp2() } else { 0.0 }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use glam::DMat4;

    /// A field with empty parts, steep edges and odd sizes.
    pub fn field(store: impl Fn(f32) -> f32 + Sync) -> Padded {
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
    pub fn points(field: &Padded) -> impl Iterator<Item = [f64; 3]> {
        let size = field.size;
        // The last centres lie on the far faces of the last cells.
        let centres = (0..(size.x - 1) * (size.y - 1) * (size.z - 1)).map(move |i| {
            [i % (size.x - 1), i / (size.x - 1) % (size.y - 1), i / ((size.x - 1) * (size.y - 1))]
                .map(|c| f64::from(c) + 0.5)
        });
        let between = (0..100_000u32).map(move |i| {
            let u = |k: f64, side: u32| 0.5 + f64::from(side - 1) * (f64::from(i) * k).fract();
            [u(0.754_877, size.x), u(0.569_840, size.y), u(0.362_431, size.z)]
        });
        centres.chain(between)
    }

    /// The cell that holds a point of the support.
    pub fn cell_of(p: [f64; 3], side: u32) -> [u32; 3] {
        p.map(|x| ((x - 0.5) / f64::from(side)) as u32)
    }

    fn violations(field: &Padded, words: &Words) -> usize {
        points(field)
            .filter(|p| {
                let c = cell_of(*p, words.side);
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
                assert_eq!(violations(&field, &Words::uniform(&field, side, None)), 0, "side {side}");
            }
            assert_eq!(violations(&field, &Words::global(&field, None)), 0);
            for sigma in [0.01, 1.0, 100.0] {
                assert_eq!(violations(&field, &Words::levels(&field, sigma, None)), 0, "sigma {sigma}");
            }
        }
    }

    /// Points where control and residual bound of their cell do not hold; of a minimum also those below the control.
    pub fn broken_controls(field: &Padded, words: &Words, control: Control) -> usize {
        let half = |bits: u32| f64::from(half::f16::from_bits(bits as u16));
        points(field)
            .filter(|p| {
                let c = cell_of(*p, words.side);
                let cell = (c[0] + words.cells.x * (c[1] + words.cells.y * c[2])) as usize * words.channels as usize;
                let held = words.words[cell + words.channels as usize / 2];
                let (level, residual) = (half(held), half(held >> 16));
                let density = field.trilinear(*p);
                let below = control == Control::Min && density < level;
                below || (density - level).abs() > residual
            })
            .count()
    }

    #[test]
    fn controls_and_residual_bounds_hold_as_they_decode() {
        let half = |x: f32| half::f16::from_f32(x).to_f32();
        for field in [field(|x| x), field(half)] {
            for control in [Control::Min, Control::Mean] {
                for words in [
                    Words::uniform(&field, 3, Some(control)),
                    Words::global(&field, Some(control)),
                    Words::levels(&field, 1.0, Some(control)),
                    Words::octree(&field, 1.0, Some(control)),
                    Words::kd_tree(&field, 1.0, Some(control)),
                ] {
                    assert_eq!(broken_controls(&field, &words, control), 0, "{control:?}, cells {}", words.cells);
                }
            }
        }
        // To the nearest 16-bit float, some controls lie above their minimum and some residuals below.
        let field = self::field(|x| x);
        let mut near = Words::uniform(&field, 3, Some(Control::Min));
        let bounds = Bounds::new(&field, 3);
        for (i, pair) in near.words.chunks_exact_mut(2).enumerate() {
            let c = half::f16::from_f32(bounds.min[i]);
            let r = half::f16::from_f32(bounds.max[i] - c.to_f32());
            pair[1] = u32::from(c.to_bits()) | u32::from(r.to_bits()) << 16;
        }
        assert!(broken_controls(&field, &near, Control::Min) > 0);
    }

    #[test]
    fn sixteen_bit_floats_round_down() {
        for x in [0.0, 1e-9, 0.1, 0.333_333, 1.0, -0.1, -1e-9, -0.333_333, -1.0f32] {
            let down = f16_below(x);
            let up = half::f16::from_bits(if down.to_f32() < 0.0 { down.to_bits() - 1 } else { down.to_bits() + 1 });
            assert!(down.to_f32() <= x && (x < up.to_f32() || down.to_f32() == x), "{x}: {down} {up}");
        }
    }

    #[test]
    fn a_missing_apron_or_rounding_down_is_seen() {
        let field = field(|x| x);
        let words = Words::uniform(&field, 4, None);
        let mut low = words.clone();
        for w in &mut low.words {
            *w = word(f32::from_bits(*w & !15) * 0.999, 0);
        }
        assert!(violations(&field, &low) > 0);
        let mut bare = words;
        for (i, w) in bare.words.iter_mut().enumerate() {
            let i = i as u32;
            let c = UVec3::new(i % bare.cells.x, i / bare.cells.x % bare.cells.y, i / (bare.cells.x * bare.cells.y));
            // Its own texels without the layer on the far faces.
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
        let words = Words::levels(&field, 0.05, None);
        assert!(words.words.iter().any(|w| w & 15 > 0), "thin media are walked in large cubes");
        let fine = Words::levels(&field, 1e3, None);
        assert!(fine.words.iter().filter(|w| **w & 15 == 0).count() > fine.words.len() / 4);
        assert_eq!(Words::levels(&field, 0.9, None), Words::levels(&field, 1.1, None));
    }

    #[test]
    fn bounds_reach_a_little_beyond_the_cell() {
        // One bright texel outside a dark cell: the bound allows for what a point just outside would see, no more.
        let mut field = field(|x| x);
        field.data.fill(0.0);
        let at = |x: u32, y: u32, z: u32| (x + field.size.x * (y + field.size.y * z)) as usize;
        let bright = at(9, 6, 6);
        field.data[bright] = 1.0;
        let bounds = Bounds::new(&field, 4);
        let max = |x: u32, y: u32, z: u32| bounds.max[(x + bounds.cells.x * (y + bounds.cells.y * z)) as usize];
        assert!(max(1, 1, 1) >= SLACK && max(1, 1, 1) < 4.0 * SLACK, "{}", max(1, 1, 1));
        assert!(max(2, 1, 1) >= 1.0 && max(2, 1, 1) < 1.001);
        assert_eq!(max(0, 1, 1), 0.0);
    }

    #[test]
    fn finest_cells_follow_thickness_and_size() {
        let small = UVec3::splat(66);
        assert_eq!([0.1, 1.0, 2.0, 16.0].map(|sigma| finest_side(small, sigma)), [4, 4, 2, 1]);
        assert_eq!(finest_side(UVec3::splat(258), 16.0), 4, "the table stays small");
        assert_eq!(finest_side(small, 0.0), 4);
    }

    #[test]
    fn minima_bound_from_below() {
        let field = field(|x| x);
        let bounds = Bounds::new(&field, 4);
        for p in points(&field) {
            let c = cell_of(p, 4);
            let i = (c[0] + bounds.cells.x * (c[1] + bounds.cells.y * c[2])) as usize;
            assert!(field.trilinear(p) >= f64::from(bounds.min[i]));
        }
    }
}
