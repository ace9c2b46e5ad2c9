//! Volumes on the CPU: the sparse [`Grid`](grid::Grid) that readers make, and the [`Dense`] box that is drawn.

use glam::{DMat4, DVec3, IVec3, UVec3};

use crate::error::Warning;

pub mod densify;
pub mod grid;
pub mod majorant;
pub mod procedural;
pub mod proxy;
pub mod tree;

/// A dense box of densities, ready for the renderer: sanitised, non-negative and finite.
#[derive(Clone, Debug)]
pub struct Dense {
    /// Voxels along x, y, z; at least 1 each.
    pub size: UVec3,
    /// Density of each voxel, x fastest: index `x + size.x · (y + size.y · z)`.
    pub data: Vec<f32>,
    /// World from index, where `(0,0,0)` is the point (centre) of the first voxel of `data`.
    pub world_from_index: DMat4,
    /// What was changed on the way from the file.
    pub warnings: Vec<Warning>,
}

impl Dense {
    /// An empty medium: one zero voxel that fills the unit cube at the origin.
    pub fn empty(warnings: Vec<Warning>) -> Dense {
        Dense { size: UVec3::ONE, data: vec![0.0], world_from_index: DMat4::IDENTITY, warnings }
    }

    /// The greatest density.
    pub fn max(&self) -> f32 {
        self.data.iter().copied().fold(0.0, f32::max)
    }

    /// The corners, in world space, of the box whose faces lie half a voxel outside the outermost index points.
    pub fn corners(&self) -> [DVec3; 8] {
        let hi = self.size.as_dvec3() - 0.5;
        std::array::from_fn(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { -0.5 } else { hi[axis] };
            self.world_from_index.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
        })
    }
}

/// A box of index coordinates, both corners inclusive.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct IndexBox {
    /// Lowest corner.
    pub min: IVec3,
    /// Highest corner, inclusive.
    pub max: IVec3,
}
