//! The voxels of the dense box from the leaves and tiles of the sparse grid, in slabs along z, all cores at work.

use std::ops::Range;

use rayon::prelude::*;

use super::Density;
use super::frame::Frame;
use crate::volume::grid::{Grid, LEAF_SIDE, LEAF_VOXELS};

/// Voxels along the side of a leaf.
const SIDE: i64 = LEAF_SIDE as i64;

/// The densities of the box, and how many stored values in it are bad.
pub(super) fn fill<T: Copy + Into<f64> + Sync>(
    grid: &Grid,
    values: &[T],
    frame: &Frame,
    density: &Density,
) -> (Vec<f32>, u64) {
    let source = Source { grid, values, frame, density };
    (if frame.resamples() { source.resample() } else { source.copy() }, source.bad_voxels())
}

/// A slab, and the number of a leaf in it, or of a tile, counted on after all leaves.
type InSlab = (i64, usize);

/// A coordinate of a voxel of a leaf: in the box and in the leaf.
#[derive(Clone, Copy)]
struct Voxel {
    place: i64,
    local: i64,
}

impl Voxel {
    fn range(&self) -> Range<i64> {
        self.place..self.place + 1
    }
}

/// A leaf by its number with the coordinates of its voxels in the box, or a tile's density with its part of the box.
enum Item<V> {
    Leaf(usize, [V; 3]),
    Tile(f32, [Range<i64>; 3]),
}

/// What the box is filled from.
struct Source<'a, T> {
    grid: &'a Grid,
    /// Those of the leaves.
    values: &'a [T],
    frame: &'a Frame,
    density: &'a Density,
}

impl<T: Copy + Into<f64> + Sync> Source<'_, T> {
    /// The density of a voxel of a leaf.
    fn density(&self, leaf: usize, x: &Voxel, y: &Voxel, z: &Voxel) -> f32 {
        let n = (x.local * SIDE + y.local) * SIDE + z.local;
        self.density.at(self.values[leaf * LEAF_VOXELS + n as usize].into())
    }

    /// A leaf, or a tile by its number after all leaves, with its part of the box.
    fn item(&self, item: usize) -> Item<impl Iterator<Item = Voxel>> {
        match self.grid.leaves.get(item) {
            Some(leaf) => {
                let start = leaf.origin.to_array().map(i64::from);
                let clip = self.frame.clip(leaf.origin, LEAF_SIDE);
                let mut axis = 0..3;
                Item::Leaf(
                    item,
                    clip.map(|side| {
                        let axis = axis.next().expect("there are three sides");
                        let offset = self.frame.min[axis] - start[axis];
                        side.map(move |place| Voxel { place, local: place + offset })
                    }),
                )
            }
            None => {
                let tile = &self.grid.tiles[item - self.grid.leaves.len()];
                Item::Tile(self.density.at(tile.value), self.frame.clip(tile.origin, tile.side))
            }
        }
    }

    /// All leaves and tiles in the box by slabs along z, where `slabs` gives those of a range of stored voxels.
    fn by_slab(&self, slabs: impl Fn(&Range<i64>) -> Range<i64>) -> Vec<InSlab> {
        let leaves = self.grid.leaves.iter().map(|leaf| (leaf.origin, LEAF_SIDE));
        let tiles = self.grid.tiles.iter().map(|tile| (tile.origin, tile.side));
        let mut items = Vec::new();
        for (item, (origin, side)) in leaves.chain(tiles).enumerate() {
            let [x, y, z] = self.frame.clip(origin, side);
            if !x.is_empty() && !y.is_empty() {
                items.extend(slabs(&z).map(|slab| (slab, item)));
            }
        }
        items.par_sort_unstable();
        items
    }

    /// Runs `work` with each slab that holds something: its part of `data` (where `layers` says the layers of a slab),
    /// its items, and the first of its layers.
    fn each_slab(
        &self,
        data: &mut [f32],
        items: &[InSlab],
        layers: impl Fn(i64) -> Range<i64>,
        work: impl Fn(&mut [f32], &[InSlab], i64) + Sync,
    ) {
        let layer = (self.frame.target[0] * self.frame.target[1]) as usize;
        let (mut rest, mut at) = (data, 0);
        let mut tasks = Vec::new();
        for items in items.chunk_by(|a, b| a.0 == b.0) {
            let layers = layers(items[0].0);
            let (_, from) = std::mem::take(&mut rest).split_at_mut((layers.start - at) as usize * layer);
            let (slab, after) = from.split_at_mut((layers.end - layers.start) as usize * layer);
            tasks.push((slab, items, layers.start));
            (rest, at) = (after, layers.end);
        }
        tasks.into_par_iter().for_each(|(slab, items, first)| work(slab, items, first));
    }

    fn background(&self) -> Vec<f32> {
        vec![self.density.background; self.frame.target.iter().product::<i64>() as usize]
    }

    /// The box, voxel for voxel. A slab is a layer of leaves.
    fn copy(&self) -> Vec<f32> {
        let mut data = self.background();
        let [width, height, depth] = self.frame.source;
        let min = self.frame.min[2];
        let slab = |z: i64| (z + min).div_euclid(SIDE);
        let items = self.by_slab(|z| if z.is_empty() { 0..0 } else { slab(z.start)..slab(z.end - 1) + 1 });
        let layers = |slab: i64| (slab * SIDE - min).max(0)..((slab + 1) * SIDE - min).min(depth);
        self.each_slab(&mut data, &items, layers, |data, items, first| {
            let end = first + data.len() as i64 / (width * height);
            let row = |y: i64, z: i64| ((z - first) * height + y) * width;
            for &(_, item) in items {
                match self.item(item) {
                    Item::Leaf(leaf, voxels) => {
                        let [x, y, z] = voxels.map(|side| side.collect::<Vec<Voxel>>());
                        for z in &z {
                            for y in &y {
                                let row = row(y.place, z.place);
                                for x in &x {
                                    data[(row + x.place) as usize] = self.density(leaf, x, y, z);
                                }
                            }
                        }
                    }
                    Item::Tile(value, [x, y, z]) => {
                        for z in z.start.max(first)..z.end.min(end) {
                            for y in y.clone() {
                                let row = row(y, z);
                                data[(row + x.start) as usize..(row + x.end) as usize].fill(value);
                            }
                        }
                    }
                }
            }
        });
        data
    }

    /// The box as means over larger voxels. A slab is a layer of those.
    fn resample(&self) -> Vec<f32> {
        let mut data = self.background();
        let frame = self.frame;
        let background = f64::from(self.density.background);
        let volume: f64 = (0..3).map(|axis| frame.source[axis] as f64 / frame.target[axis] as f64).product();
        let width = frame.target[0] as usize;
        let items = self.by_slab(|z| frame.cells(2, z));
        self.each_slab(
            &mut data,
            &items,
            |slab| slab..slab + 1,
            |data, items, slab| {
                // What stands there beyond the background, summed over the stored voxels.
                let mut sums = vec![0.0_f64; data.len()];
                for &(_, item) in items {
                    match self.item(item) {
                        Item::Leaf(leaf, [x, y, z]) => {
                            let z: Vec<(Voxel, f64)> = z
                                .map(|z| (z, frame.overlap(2, slab, &z.range())))
                                .filter(|(_, part)| *part > 0.0)
                                .collect();
                            let split = |axis: usize, voxel: Voxel| (voxel, frame.split(axis, voxel.place));
                            let x: Vec<_> = x.map(|x| split(0, x)).collect();
                            for (y, rows) in y.map(|y| split(1, y)) {
                                for (x, columns) in &x {
                                    let excess = |z: &Voxel| f64::from(self.density(leaf, x, &y, z)) - background;
                                    let sum: f64 = z.iter().map(|(z, part)| part * excess(z)).sum();
                                    for (row, y_part) in rows {
                                        for (column, x_part) in columns {
                                            sums[row * width + column] += x_part * y_part * sum;
                                        }
                                    }
                                }
                            }
                        }
                        Item::Tile(value, [x, y, z]) => {
                            let sum = frame.overlap(2, slab, &z) * (f64::from(value) - background);
                            let columns: Vec<(usize, f64)> =
                                frame.cells(0, &x).map(|cell| (cell as usize, frame.overlap(0, cell, &x))).collect();
                            for row in frame.cells(1, &y) {
                                let sum = sum * frame.overlap(1, row, &y);
                                for (column, x_part) in &columns {
                                    sums[row as usize * width + column] += x_part * sum;
                                }
                            }
                        }
                    }
                }
                for (value, sum) in data.iter_mut().zip(sums) {
                    // Rounding may leave a hair below zero.
                    *value = (background + sum / volume).max(0.0) as f32;
                }
            },
        );
        data
    }

    /// Voxels of leaves and tiles in the box whose values cannot stand for densities; those that merely repeat the
    /// background do not count.
    fn bad_voxels(&self) -> u64 {
        let background = self.grid.background;
        let bad =
            |value: f64| self.density.is_bad(value) && value != background && !(value.is_nan() && background.is_nan());
        let leaves: u64 = (self.values.par_chunks_exact(LEAF_VOXELS).zip(&self.grid.leaves))
            .map(|(values, leaf)| {
                let box_ = self.frame.clip(leaf.origin, LEAF_SIDE);
                let start = leaf.origin.to_array().map(i64::from);
                let inside = |n: usize| {
                    (0..3).all(|axis| {
                        let local = (n >> (6 - 3 * axis)) as i64 & 7;
                        box_[axis].contains(&(start[axis] + local - self.frame.min[axis]))
                    })
                };
                values.iter().enumerate().filter(|&(n, &value)| bad(value.into()) && inside(n)).count() as u64
            })
            .sum();
        self.grid.tiles.iter().filter(|tile| bad(tile.value)).fold(leaves, |sum, tile| {
            let sides = self.frame.clip(tile.origin, tile.side).map(|side| (side.end - side.start).max(0) as u64);
            sum.saturating_add(sides.iter().product())
        })
    }
}
