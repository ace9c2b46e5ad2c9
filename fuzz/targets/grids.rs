//! What the program does with the grids of a file.

use glam::{DVec3, IVec3};
use nephele::volume::densify::densify;
use nephele::volume::grid::VolumeFile;

/// Longest side and number of voxels of the dense box.
const MAX_RESOLUTION: u32 = 32;
const MAX_VOXELS: u64 = 1 << 20;

/// Uses every grid that was read; each may hold `max_bytes`.
pub fn use_all(file: &VolumeFile, max_bytes: usize) {
    for grid in file.grids.iter().filter_map(|entry| entry.grid.as_ref().ok()) {
        assert!(grid.bytes() <= max_bytes, "a grid of {} bytes, {max_bytes} allowed", grid.bytes());
        grid.stats();
        let lookup = grid.lookup();
        for at in [IVec3::ZERO, IVec3::MIN, IVec3::MAX] {
            lookup.value(at);
        }
        for at in [DVec3::splat(0.5), DVec3::new(0.5, 1e9, -1e300), DVec3::splat(f64::NAN)] {
            lookup.trilinear(at);
        }
        // Too large a box is an answer as good as any.
        let _ = densify(grid, "fuzzed", MAX_RESOLUTION, MAX_VOXELS);
    }
    for wanted in [None, Some("density"), Some("#1")] {
        let _ = file.select(wanted);
    }
}
