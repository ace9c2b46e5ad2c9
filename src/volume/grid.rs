//! A sparse scalar grid as a file stores it: leaf bricks of 8³ voxels, constant tiles, a background.

use std::collections::HashMap;

use glam::{DMat4, DVec3, IVec3};
use rayon::prelude::*;

use super::IndexBox;

/// Voxels along the side of a leaf.
pub const LEAF_SIDE: i32 = 8;
/// Voxels of a leaf.
pub const LEAF_VOXELS: usize = 512;

/// What the values mean.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Class {
    /// A density.
    Fog,
    /// Signed distances.
    LevelSet,
    /// Anything else, by the word in the file; drawn as a density.
    Other(String),
}

/// The scalar values of all leaves, 512 a leaf; within a leaf the voxel (x, y, z) is at `x·64 + y·8 + z`.
#[derive(Clone, Debug)]
pub enum Values {
    /// Single precision (also what half and quantised grids decode to).
    F32(Vec<f32>),
    /// Double precision.
    F64(Vec<f64>),
}

/// A brick of 8³ voxels.
#[derive(Clone, Debug)]
pub struct Leaf {
    /// Index coordinates of its lowest voxel, multiples of 8.
    pub origin: IVec3,
    /// One bit a voxel, in the order of [`Values`]: bit `n & 63` of word `n >> 6`.
    pub active: [u64; 8],
}

/// A cube of constant value.
#[derive(Clone, Copy, Debug)]
pub struct Tile {
    /// Index coordinates of its lowest voxel, multiples of the side.
    pub origin: IVec3,
    /// Voxels along its side, a power of two: 8, 128 or 4096 in the usual tree.
    pub side: i32,
    /// The value of each voxel in it.
    pub value: f64,
    /// Whether its voxels are active.
    pub active: bool,
}

/// A scalar grid of a volume file.
#[derive(Clone, Debug)]
pub struct Grid {
    /// What the values mean.
    pub class: Class,
    /// World from index coordinates.
    pub world_from_index: DMat4,
    /// The value wherever no leaf and no tile lies.
    pub background: f64,
    /// The bricks; no two at one place.
    pub leaves: Vec<Leaf>,
    /// The values of the bricks, 512 for each, in the order of `leaves`.
    pub values: Values,
    /// Constant cubes; neither overlapping one another nor a leaf. Inactive tiles of background value are left out.
    pub tiles: Vec<Tile>,
}

/// A grid of a file: what is known without reading its values, and the grid or why it cannot be drawn.
#[derive(Clone, Debug)]
pub struct Entry {
    /// The name as stored; bytes that are not UTF-8 stand as U+FFFD.
    pub name: String,
    /// The name that tells equal names apart: `density[0]`, `density[1]`; an empty name is `[0]`.
    pub unique_name: String,
    /// The value type as the library names it: `float`, `double`, `half`, `vec3s`, `Float4`, `FloatN`, …
    pub value_type: String,
    /// Class as the library names it: `fog volume`, `level set`, `unknown`, …
    pub class_name: String,
    /// World from index where the transform is affine.
    pub world_from_index: Option<DMat4>,
    /// The grid, or why it is not drawn.
    pub grid: crate::error::Result<Grid>,
}

/// Everything that one volume file holds.
#[derive(Clone, Debug)]
pub struct VolumeFile {
    /// `"vdb"` or `"nvdb"`.
    pub format: &'static str,
    /// File version: 224 …; for NanoVDB as `32.9`.
    pub version: String,
    /// The grids in the order in which the format's library lists them.
    pub grids: Vec<Entry>,
    /// Oddities of the file as a whole.
    pub warnings: Vec<crate::error::Warning>,
}

/// Figures over the active voxels of a grid (a tile counts once for each voxel that it covers).
#[derive(Clone, Debug, PartialEq)]
pub struct Stats {
    /// Active voxels.
    pub active_voxels: u64,
    /// Their bounds, if any.
    pub active_box: Option<IndexBox>,
    /// Least finite active value; not a number where there is none.
    pub min: f64,
    /// Greatest finite active value; not a number where there is none.
    pub max: f64,
    /// Sum of the finite active values.
    pub sum: f64,
    /// Active voxels that are not a number.
    pub nan_voxels: u64,
    /// Active voxels that are infinite.
    pub inf_voxels: u64,
    /// Active voxels below zero (−∞ counts as infinite only).
    pub negative_voxels: u64,
    /// Active voxels that are zero.
    pub zero_voxels: u64,
}

/// Leaves whose figures are summed up in one go; sums do not depend on the number of threads.
const STATS_LEAVES: usize = 256;

impl Values {
    /// Value `n`, counted over all leaves.
    pub fn get(&self, n: usize) -> f64 {
        match self {
            Values::F32(values) => values[n].into(),
            Values::F64(values) => values[n],
        }
    }

    /// Bytes that they take in memory.
    pub fn bytes(&self) -> usize {
        match self {
            Values::F32(values) => size_of_val(&**values),
            Values::F64(values) => size_of_val(&**values),
        }
    }
}

impl Leaf {
    /// Whether voxel `n` is active, in the order of [`Values`].
    pub fn is_active(&self, n: usize) -> bool {
        self.active[n >> 6] >> (n & 63) & 1 == 1
    }

    /// Bounds of its active voxels.
    pub fn active_box(&self) -> Option<IndexBox> {
        // A word is a slice in x; its bytes are rows in y, their bits run in z.
        let slices = (0..LEAF_SIDE).filter(|&x| self.active[x as usize] != 0);
        let (first, last) = (slices.clone().min()?, slices.max()?);
        let rows = self.active.iter().fold(0, |all, word| all | word);
        let columns = rows.to_le_bytes().iter().fold(0, |all, row| all | row);
        let low = IVec3::new(first, rows.trailing_zeros() as i32 / LEAF_SIDE, columns.trailing_zeros() as i32);
        let high = IVec3::new(last, 7 - rows.leading_zeros() as i32 / LEAF_SIDE, 7 - columns.leading_zeros() as i32);
        Some(IndexBox { min: self.origin + low, max: self.origin + high })
    }
}

impl Tile {
    /// All of its voxels.
    pub fn bounds(&self) -> IndexBox {
        IndexBox { min: self.origin, max: self.origin.saturating_add(IVec3::splat(self.side - 1)) }
    }
}

impl Grid {
    /// Bytes that leaves, values and tiles take in memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.leaves) + self.values.bytes() + size_of_val(&*self.tiles)
    }

    /// Bounds of the active voxels; `None` where there is none.
    pub fn active_box(&self) -> Option<IndexBox> {
        let tiles = self.tiles.iter().filter(|tile| tile.active).map(Tile::bounds);
        (self.leaves.iter().filter_map(Leaf::active_box).chain(tiles))
            .reduce(|a, b| IndexBox { min: a.min.min(b.min), max: a.max.max(b.max) })
    }

    /// Figures over the active voxels.
    pub fn stats(&self) -> Stats {
        fn leaves<T: Copy + Into<f64> + Sync>(leaves: &[Leaf], values: &[T]) -> Stats {
            let parts: Vec<Stats> = (leaves.par_chunks(STATS_LEAVES))
                .zip(values.par_chunks(STATS_LEAVES * LEAF_VOXELS))
                .map(|(leaves, values)| {
                    let mut stats = Stats::none();
                    for (leaf, values) in leaves.iter().zip(values.chunks_exact(LEAF_VOXELS)) {
                        for (n, &value) in values.iter().enumerate() {
                            if leaf.is_active(n) {
                                stats.count(value.into(), 1);
                            }
                        }
                    }
                    stats
                })
                .collect();
            parts.into_iter().fold(Stats::none(), Stats::and)
        }
        let mut stats = match &self.values {
            Values::F32(values) => leaves(&self.leaves, values),
            Values::F64(values) => leaves(&self.leaves, values),
        };
        for tile in self.tiles.iter().filter(|tile| tile.active) {
            stats.count(tile.value, (tile.side as u64).pow(3));
        }
        stats.active_box = self.active_box();
        if stats.min > stats.max {
            (stats.min, stats.max) = (f64::NAN, f64::NAN);
        }
        stats
    }

    /// An index over leaves and tiles, for values at many places.
    pub fn lookup(&self) -> Lookup<'_> {
        let leaves = self.leaves.iter().enumerate().map(|(i, leaf)| (leaf.origin, i)).collect();
        let mut tiles: Vec<(i32, HashMap<IVec3, f64>)> = Vec::new();
        for tile in &self.tiles {
            let known = tiles.iter().position(|(side, _)| *side == tile.side).unwrap_or_else(|| {
                tiles.push((tile.side, HashMap::new()));
                tiles.len() - 1
            });
            tiles[known].1.insert(tile.origin, tile.value);
        }
        Lookup { grid: self, leaves, tiles }
    }
}

impl Stats {
    /// Those of no voxels; least and greatest value are infinities of the wrong sign.
    fn none() -> Stats {
        Stats {
            active_voxels: 0,
            active_box: None,
            min: f64::INFINITY,
            max: f64::NEG_INFINITY,
            sum: 0.0,
            nan_voxels: 0,
            inf_voxels: 0,
            negative_voxels: 0,
            zero_voxels: 0,
        }
    }

    /// Counts `voxels` of one value.
    fn count(&mut self, value: f64, voxels: u64) {
        let add = |sum: &mut u64| *sum = sum.saturating_add(voxels);
        add(&mut self.active_voxels);
        if value.is_nan() {
            add(&mut self.nan_voxels);
        } else if value.is_infinite() {
            add(&mut self.inf_voxels);
        } else {
            self.min = self.min.min(value);
            self.max = self.max.max(value);
            self.sum += value * voxels as f64;
            if value < 0.0 {
                add(&mut self.negative_voxels);
            } else if value == 0.0 {
                add(&mut self.zero_voxels);
            }
        }
    }

    /// Those of these and other voxels, boxes aside.
    fn and(self, other: Stats) -> Stats {
        Stats {
            active_voxels: self.active_voxels + other.active_voxels,
            active_box: None,
            min: self.min.min(other.min),
            max: self.max.max(other.max),
            sum: self.sum + other.sum,
            nan_voxels: self.nan_voxels + other.nan_voxels,
            inf_voxels: self.inf_voxels + other.inf_voxels,
            negative_voxels: self.negative_voxels + other.negative_voxels,
            zero_voxels: self.zero_voxels + other.zero_voxels,
        }
    }
}

/// Finds the value at any place of a [`Grid`].
#[derive(Clone, Debug)]
pub struct Lookup<'a> {
    grid: &'a Grid,
    leaves: HashMap<IVec3, usize>,
    /// For each side that occurs, values by origin.
    tiles: Vec<(i32, HashMap<IVec3, f64>)>,
}

impl Lookup<'_> {
    /// The value of the voxel `at`, as stored: of a leaf, a tile or the background.
    pub fn value(&self, at: IVec3) -> f64 {
        if let Some(leaf) = self.leaves.get(&(at & !(LEAF_SIDE - 1))) {
            let local = at & (LEAF_SIDE - 1);
            return self.grid.values.get(leaf * LEAF_VOXELS + (local.x * 64 + local.y * 8 + local.z) as usize);
        }
        let tile = self.tiles.iter().find_map(|(side, values)| values.get(&(at & !(side - 1))));
        *tile.unwrap_or(&self.grid.background)
    }

    /// The value at index coordinates `at`, interpolated between the eight voxels around; the voxel's own value at
    /// whole numbers. Voxels of no weight do not count, whatever their value. Beyond 32 bits lies the background.
    pub fn trilinear(&self, at: DVec3) -> f64 {
        let low = at.floor();
        if !at.is_finite() || low.min_element() < f64::from(i32::MIN) || low.max_element() > f64::from(i32::MAX) {
            return self.grid.background;
        }
        let (corner, fraction) = (low.as_ivec3(), at - low);
        (0..8)
            .map(|i| {
                let step = IVec3::new(i >> 2 & 1, i >> 1 & 1, i & 1);
                let weights = DVec3::select(step.cmpeq(IVec3::ONE), fraction, 1.0 - fraction);
                (corner.saturating_add(step), weights.element_product())
            })
            .filter(|&(_, weight)| weight > 0.0)
            .map(|(voxel, weight)| weight * self.value(voxel))
            .sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Leaves at these origins, all voxels active, of values that `value` gives for their places.
    fn leaves(origins: &[IVec3], value: impl Fn(IVec3) -> f32) -> Grid {
        let mut values = Vec::new();
        for origin in origins {
            for n in 0..LEAF_VOXELS as i32 {
                values.push(value(origin + IVec3::new(n / 64, n / 8 % 8, n % 8)));
            }
        }
        let leaves = origins.iter().map(|&origin| Leaf { origin, active: [u64::MAX; 8] }).collect();
        Grid {
            class: Class::Fog,
            world_from_index: DMat4::IDENTITY,
            background: 0.125,
            leaves,
            values: Values::F32(values),
            tiles: Vec::new(),
        }
    }

    #[test]
    fn lookup_finds_leaves_tiles_and_background() {
        let place = |at: IVec3| (at.x * 10_000 + at.y * 100 + at.z) as f32;
        let mut grid = leaves(&[IVec3::new(8, 0, -8), IVec3::new(-16, 8, 0)], place);
        for (side, value) in [(8, 1.0), (128, 2.0), (4096, 3.0)] {
            grid.tiles.push(Tile { origin: IVec3::new(-side, side, 0), side, value, active: false });
        }
        let lookup = grid.lookup();
        for at in [IVec3::new(9, 2, -5), IVec3::new(15, 7, -1), IVec3::new(-16, 8, 0), IVec3::new(-9, 15, 7)] {
            assert_eq!(lookup.value(at), f64::from(place(at)), "{at}");
        }
        for (side, value) in [(8, 1.0), (128, 2.0), (4096, 3.0)] {
            assert_eq!(lookup.value(IVec3::new(-1, side, 0)), value);
            assert_eq!(lookup.value(IVec3::new(-side, 2 * side - 1, side - 1)), value);
            assert_eq!(lookup.value(IVec3::new(-side, side, -1)), 0.125);
        }
        assert_eq!(lookup.value(IVec3::new(7, 0, -8)), 0.125);
        assert_eq!(lookup.value(IVec3::MIN), 0.125);
    }

    #[test]
    fn trilinear_is_exact_for_linear_fields_and_at_voxels() {
        let field = |at: DVec3| 3.0 + 0.5 * at.x - 2.0 * at.y + 0.25 * at.z;
        let mut grid = leaves(&[IVec3::splat(-8), IVec3::new(-8, -8, 0)], |at| field(at.as_dvec3()) as f32);
        for at in [[-7.25, -1.5, -0.125], [-6.0, -2.5, -0.75], [-3.0, -4.0, 6.0]].map(DVec3::from_array) {
            assert_eq!(grid.lookup().trilinear(at), field(at), "{at}");
        }
        assert_eq!(
            grid.lookup().trilinear(DVec3::new(-8.5, -4.0, 0.0)),
            0.5 * (0.125 + field(DVec3::new(-8.0, -4.0, 0.0)))
        );
        // A neighbour of no weight does not count, not even if it is not a number.
        let Values::F32(values) = &mut grid.values else { panic!("leaves() makes single precision") };
        values[64 + 8 + 2] = f32::NAN;
        assert!(grid.lookup().trilinear(DVec3::new(-7.0, -7.0, -6.5)).is_nan());
        assert_eq!(grid.lookup().trilinear(DVec3::new(-7.0, -7.0, -7.0)), field(DVec3::splat(-7.0)));
        for at in [DVec3::splat(1e10), DVec3::splat(f64::NAN), DVec3::splat(f64::from(i32::MAX) + 0.5)] {
            assert_eq!(grid.lookup().trilinear(at), 0.125, "{at}");
        }
    }

    #[test]
    fn stats_count_each_kind_of_active_value() {
        let specials = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, -2.0, 0.0, -0.0, 5.0];
        let origin = IVec3::new(-8, 0, 16);
        let mut grid = leaves(&[origin, IVec3::splat(512)], |at| *specials.get((at.z - 16) as usize).unwrap_or(&100.0));
        // Row z of (1, 2) in the first leaf; nothing in the second.
        grid.leaves[0].active = [0, 0x7f << 16, 0, 0, 0, 0, 0, 0];
        grid.leaves[1].active = [0; 8];
        grid.tiles.push(Tile { origin: IVec3::new(4096, 0, 0), side: 4096, value: 0.5, active: true });
        grid.tiles.push(Tile { origin: IVec3::new(-4096, 0, 0), side: 4096, value: 9.0, active: false });
        let tile = 4096_u64.pow(3);
        let expected = Stats {
            active_voxels: 7 + tile,
            active_box: Some(IndexBox { min: IVec3::new(-7, 0, 0), max: IVec3::new(8191, 4095, 4095) }),
            min: -2.0,
            max: 5.0,
            sum: 3.0 + 0.5 * tile as f64,
            nan_voxels: 1,
            inf_voxels: 2,
            negative_voxels: 1,
            zero_voxels: 2,
        };
        assert_eq!(grid.stats(), expected);
        grid.tiles.clear();
        grid.leaves[0].active = [0; 8];
        let none = grid.stats();
        assert!(none.active_voxels == 0 && none.active_box.is_none() && none.min.is_nan() && none.max.is_nan());
    }

    #[test]
    fn stats_over_many_leaves_take_all_of_them() {
        let origins: Vec<IVec3> = (0..600).map(|i| IVec3::new(8 * i, 0, 0)).collect();
        let stats = leaves(&origins, |at| if at.x == 4799 { 2.0 } else { 1.0 }).stats();
        assert_eq!((stats.active_voxels, stats.sum, stats.max), (600 * 512, 600.0 * 512.0 + 64.0, 2.0));
    }

    #[test]
    fn the_box_of_a_leaf_is_tight() {
        let mut leaf = Leaf { origin: IVec3::new(-8, 16, 0), active: [0; 8] };
        assert_eq!(leaf.active_box(), None);
        for n in 0..LEAF_VOXELS {
            leaf.active = [0; 8];
            leaf.active[n / 64] = 1 << (n % 64);
            let at = leaf.origin + IVec3::new((n / 64) as i32, (n / 8 % 8) as i32, (n % 8) as i32);
            assert_eq!(leaf.active_box(), Some(IndexBox { min: at, max: at }));
        }
        // (1, 5, 2) and (6, 3, 4).
        leaf.active = [0; 8];
        (leaf.active[1], leaf.active[6]) = (1 << 42, 1 << 28);
        let (min, max) = (IVec3::new(1, 3, 2), IVec3::new(6, 5, 4));
        assert_eq!(leaf.active_box(), Some(IndexBox { min: leaf.origin + min, max: leaf.origin + max }));
    }
}
