//! The box of the active voxels, and how it is cut into the voxels of the result.

use std::ops::Range;

use glam::{DMat4, DVec3, IVec3, UVec3};

use crate::error::{Code, Error, Result};
use crate::volume::IndexBox;

/// Bytes of a dense voxel.
const VOXEL_BYTES: u128 = size_of::<f32>() as u128;
/// Resolutions that a message may offer, best first.
const OFFERS: [u32; 7] = [2048, 1024, 512, 256, 128, 64, 32];

/// The box of the active voxels and the new voxels that it is cut into.
pub(super) struct Frame {
    /// Index coordinates of the first voxel.
    pub(super) min: [i64; 3],
    /// Voxels along the sides as stored, and of the result.
    pub(super) source: [i64; 3],
    pub(super) target: [i64; 3],
}

impl Frame {
    pub(super) fn new(bounds: &IndexBox, max_resolution: u32) -> Frame {
        let (min, max) = (bounds.min.to_array().map(i64::from), bounds.max.to_array().map(i64::from));
        let source = std::array::from_fn(|axis| max[axis] - min[axis] + 1);
        Frame { min, source, target: Self::target(source, max_resolution) }
    }

    fn target(source: [i64; 3], max_resolution: u32) -> [i64; 3] {
        let longest = source[0].max(source[1]).max(source[2]);
        if max_resolution == 0 || longest <= max_resolution.into() {
            return source;
        }
        let scale = f64::from(max_resolution) / longest as f64;
        source.map(|side| ((side as f64 * scale).round() as i64).max(1))
    }

    pub(super) fn resamples(&self) -> bool {
        self.source != self.target
    }

    /// The size of the result, if it has at most `max_voxels`.
    pub(super) fn affordable(&self, name: &str, max_voxels: u64) -> Result<UVec3> {
        let voxels = |sides: [i64; 3]| sides.iter().map(|&side| side as u128).product::<u128>();
        let needed = voxels(self.target);
        let [x, y, z] = self.target;
        if let ([Ok(x), Ok(y), Ok(z)], true) = (self.target.map(u32::try_from), needed <= max_voxels.into()) {
            return Ok(UVec3::new(x, y, z));
        }
        let bytes = needed * VOXEL_BYTES;
        let error =
            Error::new(Code::TooLarge, format!("The box of the grid {name:?} is too large: {x} × {y} × {z} voxels."))
                .why(format!("It would take {bytes} bytes; {} are allowed.", u128::from(max_voxels) * VOXEL_BYTES));
        let fits = |offer: &&u32| voxels(Self::target(self.source, **offer)) <= u128::from(max_voxels).min(needed - 1);
        Err(match OFFERS.iter().find(fits) {
            Some(offer) => error.hint(format!("Resample it: --set volume.max_resolution={offer}")),
            None => error.hint("Choose another grid or a machine with more memory."),
        })
    }

    /// Index coordinates as stored from those of the new voxels.
    pub(super) fn index_from_new(&self) -> DMat4 {
        let step = DVec3::from_array(std::array::from_fn(|axis| self.source[axis] as f64 / self.target[axis] as f64));
        let min = DVec3::from_array(self.min.map(|min| min as f64));
        DMat4::from_translation(min - 0.5 + 0.5 * step) * DMat4::from_scale(step)
    }

    /// The part of a cube that lies in the box: for each axis, stored voxels counted from the first of the box.
    pub(super) fn clip(&self, origin: IVec3, side: i32) -> [Range<i64>; 3] {
        let origin = origin.to_array().map(i64::from);
        std::array::from_fn(|axis| {
            let start = origin[axis] - self.min[axis];
            start.max(0)..(start + i64::from(side)).min(self.source[axis])
        })
    }

    /// The new voxels along an axis that hold any part of these stored voxels.
    pub(super) fn cells(&self, axis: usize, voxels: &Range<i64>) -> Range<i64> {
        if voxels.is_empty() {
            return 0..0;
        }
        let (source, target) = (i128::from(self.source[axis]), i128::from(self.target[axis]));
        let (start, end) = (i128::from(voxels.start) * target, i128::from(voxels.end) * target);
        (start / source) as i64..((end - 1) / source + 1) as i64
    }

    /// How many stored voxels of these lie in a new voxel along an axis, parts included.
    pub(super) fn overlap(&self, axis: usize, cell: i64, voxels: &Range<i64>) -> f64 {
        let edge = |cell: i64| cell as f64 * self.source[axis] as f64 / self.target[axis] as f64;
        (edge(cell + 1).min(voxels.end as f64) - edge(cell).max(voxels.start as f64)).max(0.0)
    }

    /// The at most two new voxels along an axis that hold a stored one, and how much of it.
    pub(super) fn split(&self, axis: usize, voxel: i64) -> [(usize, f64); 2] {
        let voxels = voxel..voxel + 1;
        let cells = self.cells(axis, &voxels);
        let part = |cell: i64| (cell as usize, self.overlap(axis, cell, &voxels));
        let last = cells.end - 1;
        if last == cells.start { [part(last), (last as usize, 0.0)] } else { [part(cells.start), part(last)] }
    }
}
