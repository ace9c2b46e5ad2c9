//! Settings of the modes that reuse paths.

use super::Scene;
use super::row::{Effect, section};
use super::value::{Auto, Limit, choice};

choice! {
    /// How the picture is made.
    Mode {
        Path = "path", "Path", "The unbiased path tracer; samples are independent.";
        Restir = "restir", "Reuse", "Paths are resampled from frame to frame and from neighbours (ReSTIR); unbiased. Still pictures go on as in mode path.";
        Restir2021 = "restir-2021", "Reuse, 2021", "Reuse as Lin, Wyman and Yuksel published it in 2021, to compare with: through pixel centres, without a lens. Biased while the camera moves.", biased("reuse as it was published in 2021");
    }
}

impl Mode {
    /// Whether pixels keep reservoirs.
    pub fn reuses(self) -> bool {
        self != Mode::Path
    }

    /// Whether rays have a place on the lens, and in their pixel, of their own.
    pub fn has_lens(self) -> bool {
        self != Mode::Restir2021
    }

    /// Whether paths outlive a change of anything but the camera.
    pub fn survives_edits(self) -> bool {
        self != Mode::Restir2021
    }

    /// Whether a setting of `[restir]` means anything to it.
    pub fn takes(self, key: &str) -> bool {
        match self {
            Mode::Path => false,
            Mode::Restir => true,
            Mode::Restir2021 => ["candidates", "temporal", "spatial", "proxy_cell"].contains(&key),
        }
    }
}

impl Scene {
    /// The settings of `[restir]` as the mode takes them: the method of 2021 leaves few to choose.
    pub fn resampling(&self) -> Restir {
        let own = self.restir.clone();
        if self.integrator.mode != Mode::Restir2021 {
            return own;
        }
        /// Frames that a history counts for at most.
        const CAP: u32 = 4;
        /// Of each pixel.
        const NEIGHBOURS: u32 = 3;
        Restir {
            suffixes: 1,
            cap: CAP,
            neighbours: NEIGHBOURS,
            history: History::Spatial,
            still_cap: CAP,
            permute: false,
            ..own
        }
    }

    /// New paths of one scattering that a pixel chooses from in each frame.
    pub fn candidates(&self) -> u32 {
        /// Where all paths are such paths, and the rest of a frame costs little.
        const ALONE: u32 = 8;
        /// Where there are others.
        const AMONG: u32 = 4;
        let alone = matches!(self.integrator.max_bounces, Limit::AtMost(0 | 1)) && self.integrator.mode == Mode::Restir;
        match self.restir.candidates {
            Auto::Is(count) => count,
            Auto::Auto if alone => ALONE,
            Auto::Auto => AMONG,
        }
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
    /// Resampling of light paths over frames and neighbours (modes "restir" and "restir-2021").
    Restir {
        /// New paths of one scattering that a pixel chooses from in each frame. Auto: 8 where paths scatter no more than once, else 4.
        candidates: Auto<u32> = Auto::Auto, label("Candidates"), symbol("M"), range(1.0, 32.0), effect(Effect::Reuse);
        /// Second vertices that a pixel tries in each frame, where paths may scatter more than once.
        suffixes: u32 = 2, label("Suffixes"), range(1.0, 3.0), effect(Effect::Reuse);
        /// Each pixel's path of the frame before is a candidate too.
        temporal: bool = true, label("Temporal"), effect(Effect::Reuse);
        /// Paths of neighbouring pixels are candidates too.
        spatial: bool = true, label("Spatial"), effect(Effect::Reuse);
        /// Neighbours of each pixel.
        neighbours: u32 = 2, label("Neighbours"), symbol("k"), range(0.0, 8.0), effect(Effect::Reuse);
        /// Neighbours are less than 2 to this power pixels away.
        reach: u32 = 1, label("Reach"), symbol("h"), range(1.0, 5.0), effect(Effect::Reuse);
        /// Frames that a history counts for at most: more is smoother, and slower to follow what changes.
        cap: u32 = 8, label("Cap"), unit("frames"), range(0.0, 64.0), effect(Effect::Reuse);
        /// Which reservoirs the next frame starts from.
        history: History = History::Spatial, label("History"), effect(Effect::Reuse);
        /// Voxels along the side of the finest cell of the density from afar, by which paths are weighed. Larger ones take less memory, and pictures are noisier.
        proxy_cell: u32 = 1, label("Proxy cell"), unit("voxels"), range(1.0, 8.0), effect(Effect::Method);
        /// The last step estimates true transmittances along the paths that a pixel shows by so many looks at the density for an optical depth of 2 of the majorant. 0: exactly, from voxel to voxel.
        final_samples: u32 = 0, label("Final looks"), range(0.0, 16.0), effect(Effect::Reuse);
        /// Where light is frozen at the third vertex, it stays if the leg to it is longer than this times the way that the others move, before and after.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn modes_take_settings_that_there_are() {
        let keys: Vec<&str> = Restir::ROWS.iter().map(|row| row.key).collect();
        let taken = |mode: Mode| keys.iter().filter(|key| mode.takes(key)).count();
        assert_eq!([Mode::Path, Mode::Restir, Mode::Restir2021].map(taken), [0, keys.len(), 4]);
    }

    #[test]
    fn what_the_method_of_2021_does_not_take_changes_nothing() {
        let mut scene = Scene::default();
        scene.integrator.mode = Mode::Restir2021;
        let usual = scene.resampling();
        (scene.restir.cap, scene.restir.neighbours, scene.restir.still_cap) = (20, 7, 0);
        (scene.restir.history, scene.restir.permute) = (History::Temporal, true);
        assert_eq!(scene.resampling(), usual);
        for (mode, bounces, count) in [(Mode::Restir, 1, 8), (Mode::Restir, 2, 4), (Mode::Restir2021, 1, 4)] {
            let mut auto = Scene::default();
            (auto.integrator.mode, auto.integrator.max_bounces) = (mode, Limit::AtMost(bounces));
            assert_eq!(auto.candidates(), count, "{bounces}");
        }
        scene.restir.candidates = Auto::Is(9);
        assert_eq!(scene.candidates(), 9);
        scene.integrator.mode = Mode::Restir;
        assert_eq!(scene.resampling(), scene.restir);
    }
}
