//! Bounds in trees, flattened to tables that the shaders read with one fetch: an octree as a grid of levels, and a
//! kd-tree whose finest cells name the leaf that they lie in.

use glam::UVec3;

use super::majorant::{Bounds, Padded, STEP_COST, Words, finest_side, level_sigma, word};
use crate::scene::Control;

/// Optical depth across a node, from its least to its greatest density, from which an octree splits it: 1/ln 2 (the rule
/// of Cycles 5, after "Volume Rendering for Pixar's Elemental").
const SPLIT_DEPTH: f64 = std::f64::consts::LOG2_E;
/// Bits of each number that tells a leaf's place (shaders/majorant/tree.wgsl).
const SPAN_BITS: u32 = 5;
/// Finest cells along a leaf at most.
const MOST_SPAN: u32 = 1 << SPAN_BITS;
/// Levels that a word has room for.
const MOST_LEVEL: u32 = 15;

impl Words {
    /// An octree: nodes split while the density varies much in them, where a stored value of 1 gives an extinction of
    /// `sigma` per texel; written as a grid of levels.
    pub fn octree(field: &Padded, sigma: f64, control: Option<Control>) -> Words {
        let sigma = level_sigma(sigma);
        let side = finest_side(field.size, sigma);
        let pyramid = Bounds::pyramid(field, side, field.size.max_element().min(side << MOST_LEVEL));
        let fine = pyramid[0].cells;
        Words::of(&pyramid[0], control, |i| {
            let i = i as u32;
            let c = UVec3::new(i % fine.x, i / fine.x % fine.y, i / (fine.x * fine.y));
            let (level, b) = pyramid
                .iter()
                .enumerate()
                .rev()
                .find(|(level, b)| {
                    let j = b.index(c >> UVec3::splat(*level as u32));
                    let diagonal = f64::from(b.side) * 3f64.sqrt();
                    *level == 0 || sigma * f64::from(b.max[j] - b.min[j]) * diagonal < SPLIT_DEPTH
                })
                .expect("the finest level is always a leaf");
            b.words(b.index(c >> UVec3::splat(level as u32)), level as u32, control)
        })
    }

    /// A kd-tree whose leaves minimise the expected cost of a ray, surface · step + 4 · volume · majorant · lookup
    /// (tracking.md §3.4), where a stored value of 1 gives an extinction of `sigma` per texel. Each finest cell has four
    /// words: the majorant, where its leaf lies, control and residual bound, and 0. The second has six numbers of
    /// [`SPAN_BITS`] bits: cells of the leaf before this one along x, y, z, and its cells along x, y, z less one.
    pub fn kd_tree(field: &Padded, sigma: f64, control: Option<Control>) -> Words {
        let sigma = level_sigma(sigma);
        let bounds = Bounds::new(field, finest_side(field.size, sigma));
        let mut leaves = Vec::new();
        let tree = Builder { bounds: &bounds, sigma };
        tree.split(UVec3::ZERO, bounds.cells, &mut leaves);
        let mut words = vec![0; 4 * bounds.max.len()];
        for (low, high) in leaves {
            let range = tree.range(low, high);
            let held = control.map_or(0, |c| super::majorant::control_word(range[0], range[1], range[2], c));
            for c in cells(low, high) {
                let place: [u32; 6] = {
                    let (before, span) = (c - low, high - low - 1);
                    [before.x, before.y, before.z, span.x, span.y, span.z]
                };
                let packed = place.iter().rev().fold(0, |word, &n| word << SPAN_BITS | n);
                words[4 * bounds.index(c)..][..3].copy_from_slice(&[word(range[1], 0), packed, held]);
            }
        }
        Words { cells: bounds.cells, side: bounds.side, channels: 4, words }
    }
}

/// All cells of a box.
fn cells(low: UVec3, high: UVec3) -> impl Iterator<Item = UVec3> {
    (low.z..high.z)
        .flat_map(move |z| (low.y..high.y).flat_map(move |y| (low.x..high.x).map(move |x| UVec3::new(x, y, z))))
}

struct Builder<'a> {
    bounds: &'a Bounds,
    sigma: f64,
}

impl Builder<'_> {
    /// Least, greatest and mean density of a box of cells.
    fn range(&self, low: UVec3, high: UVec3) -> [f32; 3] {
        let mut range = [f32::INFINITY, 0.0, 0.0f32];
        let mut sum = 0.0f64;
        for c in cells(low, high) {
            let i = self.bounds.index(c);
            range[0] = range[0].min(self.bounds.min[i]);
            range[1] = range[1].max(self.bounds.max[i]);
            sum += f64::from(self.bounds.mean[i]);
        }
        range[2] = (sum / (high - low).as_dvec3().element_product()) as f32;
        range
    }

    /// Cost of a leaf of these cells and majorant.
    fn cost(&self, side: UVec3, max: f32) -> f64 {
        let s = side.as_dvec3() * f64::from(self.bounds.side);
        let surface = 2.0 * (s.x * s.y + s.y * s.z + s.z * s.x);
        surface * STEP_COST + 4.0 * s.element_product() * self.sigma * f64::from(max)
    }

    /// Appends the leaves of a box; their cost. The box is split to the bottom and taken as one leaf where that is no dearer:
    /// often no single plane pays, but several together do.
    fn split(&self, low: UVec3, high: UVec3, leaves: &mut Vec<(UVec3, UVec3)>) -> f64 {
        let side = high - low;
        let mut best: Option<(f64, usize, u32)> = None;
        let mut whole = 0.0f32;
        for axis in 0..3 {
            let mut slices = vec![0.0f32; side[axis] as usize];
            for c in cells(low, high) {
                let max = &mut slices[(c - low)[axis] as usize];
                *max = max.max(self.bounds.max[self.bounds.index(c)]);
            }
            let mut after = slices.clone();
            for i in (1..after.len()).rev() {
                after[i - 1] = after[i - 1].max(after[i]);
            }
            whole = after[0];
            let mut before = 0.0f32;
            for plane in 1..side[axis] {
                before = before.max(slices[plane as usize - 1]);
                let (mut left, mut right) = (side, side);
                left[axis] = plane;
                right[axis] -= plane;
                let cost = self.cost(left, before) + self.cost(right, after[plane as usize]);
                if best.is_none_or(|b| cost < b.0) {
                    best = Some((cost, axis, plane));
                }
            }
        }
        let too_long = side.max_element() > MOST_SPAN;
        let leaf = self.cost(side, whole);
        // A plane adds two faces; all that it can save is the lookups.
        let lookups = leaf - self.cost(side, 0.0);
        let s = side.as_dvec3() * f64::from(self.bounds.side);
        let least_face = (s.x * s.y).min(s.y * s.z).min(s.z * s.x);
        let hopeless = lookups <= 2.0 * least_face * STEP_COST;
        let start = leaves.len();
        let Some((_, mut axis, mut plane)) = best.filter(|_| too_long || !hopeless) else {
            leaves.push((low, high));
            return leaf;
        };
        if hopeless {
            axis = side.to_array().iter().position(|&n| n == side.max_element()).expect("one of the three");
            plane = side[axis] / 2;
        }
        let (mut middle, mut next) = (high, low);
        middle[axis] = low[axis] + plane;
        next[axis] = low[axis] + plane;
        let parts = self.split(low, middle, leaves) + self.split(next, high, leaves);
        if parts < leaf || too_long {
            return parts;
        }
        leaves.truncate(start);
        leaves.push((low, high));
        leaf
    }
}

#[cfg(test)]
mod tests {
    use super::super::majorant::tests::{cell_of, field, points};
    use super::*;

    /// The leaf that a finest cell names: lowest and highest finest cell, and its majorant.
    fn leaf(words: &Words, c: UVec3) -> (UVec3, UVec3, f32) {
        let i = 4 * (c.x + words.cells.x * (c.y + words.cells.y * c.z)) as usize;
        let part = |k: u32| words.words[i + 1] >> (SPAN_BITS * k) & (MOST_SPAN - 1);
        let low = c - UVec3::new(part(0), part(1), part(2));
        (low, low + UVec3::new(part(3), part(4), part(5)) + 1, f32::from_bits(words.words[i]))
    }

    #[test]
    fn leaves_tile_the_field_and_bound_it() {
        let field = field(|x| x);
        for sigma in [0.01, 1.0, 100.0] {
            let words = Words::kd_tree(&field, sigma, None);
            let mut volume = 0.0;
            for c in cells(UVec3::ZERO, words.cells) {
                let (low, high, _) = leaf(&words, c);
                assert!(c.cmpge(low).all() && c.cmplt(high).all() && high.cmple(words.cells).all(), "{c} {low} {high}");
                // All cells of a leaf name it.
                assert!(cells(low, high).all(|d| leaf(&words, d) == leaf(&words, c)), "{low} {high}");
                volume += 1.0 / (high - low).as_dvec3().element_product();
            }
            // One per leaf.
            assert!(volume >= 1.0 && (volume - f64::round(volume)).abs() < 1e-6, "{volume} leaves");
            let above = points(&field)
                .filter(|p| field.trilinear(*p) > f64::from(leaf(&words, UVec3::from(cell_of(*p, words.side))).2))
                .count();
            assert_eq!(above, 0, "sigma {sigma}");
        }
    }

    #[test]
    fn trees_are_finer_where_it_is_dense() {
        let field = field(|x| x);
        let leaves = |sigma| {
            let words = Words::kd_tree(&field, sigma, None);
            let parts = cells(UVec3::ZERO, words.cells).map(|c| {
                let (low, high, _) = leaf(&words, c);
                1.0 / (high - low).as_dvec3().element_product()
            });
            parts.sum::<f64>()
        };
        // Longer than a leaf may be, so two.
        assert!(leaves(0.001) < 2.5, "few leaves are enough in a thin medium: {}", leaves(0.001));
        assert!(leaves(100.0) > 20.0, "{}", leaves(100.0));
        let levels = |sigma| Words::octree(&field, sigma, None).words.iter().map(|w| w & 15).max();
        assert!(levels(0.001) > levels(100.0));
    }

    #[test]
    fn octree_nodes_are_leaves_as_a_whole() {
        let field = field(|x| x);
        let words = Words::octree(&field, 0.2, None);
        for c in cells(UVec3::ZERO, words.cells) {
            let at = |c: UVec3| words.words[(c.x + words.cells.x * (c.y + words.cells.y * c.z)) as usize];
            let level = UVec3::splat(at(c) & 15);
            let low = (c >> level) << level;
            let high = (low + (UVec3::ONE << level)).min(words.cells);
            assert!(cells(low, high).all(|d| at(d) == at(c)), "{c}");
        }
    }
}
