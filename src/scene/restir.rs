//! Settings of mode "restir".

use super::Mode;
use super::row::{Effect, section};
use super::value::choice;

impl Mode {
    /// Whether pixels keep reservoirs.
    pub fn reuses(self) -> bool {
        self == Mode::Restir
    }
}

choice! {
    /// Which reservoirs the next frame starts from.
    History {
        Spatial = "spatial", "Spatial", "Those with neighbours' paths: more variety.";
        Temporal = "temporal", "Temporal", "Those of the pixel alone: neighbouring pixels stay more independent.";
    }
}

section! {
    /// Resampling of light paths over frames and neighbours (mode "restir").
    Restir {
        /// New paths of one scattering that a pixel chooses from in each frame.
        candidates: u32 = 4, label("Candidates"), symbol("M"), range(1.0, 32.0), effect(Effect::Reuse);
        /// Each pixel's path of the frame before is a candidate too.
        temporal: bool = true, label("Temporal"), effect(Effect::Reuse);
        /// Paths of neighbouring pixels are candidates too.
        spatial: bool = true, label("Spatial"), effect(Effect::Reuse);
        /// Neighbours of each pixel.
        neighbours: u32 = 1, label("Neighbours"), symbol("k"), range(0.0, 8.0), effect(Effect::Reuse);
        /// Neighbours are less than 2 to this power pixels away.
        reach: u32 = 2, label("Reach"), symbol("h"), range(1.0, 5.0), effect(Effect::Reuse);
        /// Frames that a history counts for at most: more is smoother, and slower to follow what changes.
        cap: u32 = 8, label("Cap"), unit("frames"), range(0.0, 64.0), effect(Effect::Reuse);
        /// Which reservoirs the next frame starts from.
        history: History = History::Spatial, label("History"), effect(Effect::Reuse);
        /// Voxels along the side of the finest cell of the density from afar, by which paths are weighed.
        proxy_cell: u32 = 2, label("Proxy cell"), unit("voxels"), range(2.0, 8.0), effect(Effect::Method);
        /// Looks at the density in the last step, which estimates true transmittances along the chosen path: so many for an optical depth of 2 of the majorant.
        final_samples: u32 = 2, label("Final looks"), range(1.0, 16.0), effect(Effect::Reuse);
        /// A second vertex is kept where the leg to it is longer than this times the way that the first vertex moved, before and after.
        reconnect_distance: f64 = 1.0, label("Reconnect"), range(0.0, 8.0), effect(Effect::Reuse);
        /// Frames of a still picture that reuse paths.
        still_after: u32 = 0, label("Still after"), unit("frames"), range(0.0, 256.0), effect(Effect::Reuse);
        /// Cap from then on. At 0 the picture goes on with independent paths, as in mode "path": their mean converges faster.
        still_cap: u32 = 0, label("Still cap"), unit("frames"), range(0.0, 64.0), effect(Effect::Reuse);
        /// Histories are read from a pixel next to the one that saw the same.
        permute: bool = false, label("Permute"), effect(Effect::Reuse);
        /// Frames that a history counts for right after medium or lights changed.
        edit_confidence: f64 = 1.0, label("After edits"), unit("frames"), range(0.0, 64.0), effect(Effect::Reuse);
    }
}
