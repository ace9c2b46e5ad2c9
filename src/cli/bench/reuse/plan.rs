//! What is measured: volumes, sides and cameras.

use glam::DVec2;

use crate::app::orbit;
use crate::app::presets::PRESETS;
use crate::render::field::Field;
use crate::render::params::View;
use crate::scene::value::{Auto, FilePath, Limit};
use crate::scene::{Mode, Scene, Transmittance, Volume};

/// Names of the volumes that are measured where none is named. The first is what the window opens with; of the others it
/// is the look that the window's menu has for them.
pub const VOLUMES: [&str; 3] = ["cumulus", "disney-cloud", "smoke-column"];
/// Those looks.
const LOOKS: [(&str, &str); 2] = [("disney-cloud", "Disney cloud"), ("smoke-column", "Smoke")];
/// Scatterings at most.
pub const BOUNCES: [u32; 2] = [1, 3];
/// Shadow estimators that the path tracer may choose from.
pub const SHADOWS: [Transmittance; 4] =
    [Transmittance::Ratio, Transmittance::Delta, Transmittance::ResidualRatio, Transmittance::Regular];
/// Degrees that a moving camera turns about its target from one frame to the next.
pub const TURN: f64 = 1.0;
/// Frames of a still picture that are averaged.
pub const MEANS: [u32; 3] = [1, 4, 16];

/// Lines of a window's picture.
pub const WINDOW_LINES: f64 = 720.0;

/// What of a window's picture is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Framing {
    /// The middle of it, pixel by pixel.
    Middle,
    /// All of it, in few large pixels: frames have less in common.
    Whole,
}

impl Framing {
    /// Both of them.
    pub const ALL: [Framing; 2] = [Framing::Middle, Framing::Whole];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Framing::Middle => "middle",
            Framing::Whole => "whole",
        }
    }

    /// The scene with the camera that draws that in `size` pixels.
    pub fn of(self, scene: &Scene, field: &Field, size: (u32, u32)) -> Scene {
        let mut scene = scene.clone();
        if self == Framing::Middle {
            // An angle alone would move the camera, which stands where the volume fits the picture.
            let view = View::of(&scene.camera, field, f64::from(size.0) / f64::from(size.1));
            (scene.camera.position, scene.camera.target) = (Auto::Is(view.position), Auto::Is(view.target));
            let half = (scene.camera.fov_y / 2.0).to_radians().tan();
            scene.camera.fov_y = 2.0 * (half * f64::from(size.1) / WINDOW_LINES).atan().to_degrees();
        }
        scene
    }
}

/// What the camera does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// Nothing.
    Still,
    /// It orbits.
    Moving,
}

impl Motion {
    /// Both of them.
    pub const ALL: [Motion; 2] = [Motion::Still, Motion::Moving];

    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Motion::Still => "still",
            Motion::Moving => "moving",
        }
    }

    /// So many seeds, others for each motion: the last camera is the same.
    pub fn seeds(self, count: u32) -> std::ops::Range<u32> {
        let first = 1 + self as u32 * count;
        first..first + count
    }
}

/// A way to draw frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Its name in tables and files.
    pub name: String,
    /// How the picture is made.
    pub mode: Mode,
    /// Whether frames or pixels share anything.
    pub shares: bool,
    /// Whether a frame takes as many samples (of the path tracer) or candidates as fit the time of one of ours.
    pub matched: bool,
}

/// Name of the side that the others are compared with.
pub const OURS: &str = "ours";
/// Name of the path tracer's side at equal time.
pub const PATH: &str = "path";

/// All sides: the path tracer, first at equal time (on many adapters, samples cost less together) and then of one sample a
/// frame, candidates alone, and every mode that reuses paths.
pub fn sides() -> Vec<Side> {
    let side = |name: &str, mode, shares, matched| Side { name: name.into(), mode, shares, matched };
    let mut all = vec![
        side(PATH, Mode::Path, false, true),
        side("path-1", Mode::Path, false, false),
        side("control", Mode::Restir, false, true),
    ];
    for &mode in Mode::ALL.iter().filter(|mode| mode.reuses()) {
        // "restir-2021" is the method of 2021.
        let name = mode.name().strip_prefix("restir-").unwrap_or(if mode == Mode::Restir { OURS } else { mode.name() });
        all.push(side(name, mode, true, false));
    }
    all
}

/// The scene of a volume by its name, or of a file.
pub fn scene(volume: &str) -> Scene {
    let mut scene = Scene::default();
    let look = LOOKS.iter().find(|(name, _)| *name == volume);
    match look.and_then(|(_, look)| PRESETS.iter().find(|preset| preset.name == *look)) {
        Some(preset) => preset.apply(&mut scene, None),
        None if volume == VOLUMES[0] => {}
        None => scene.volume = Volume { file: FilePath(volume.to_owned()), ..Volume::default() },
    }
    scene
}

/// `scene` as `side` draws it, with the shadow estimator `shadow` where that is the path tracer, and `amount` candidates
/// where nothing is shared.
pub fn drawn(scene: &Scene, side: &Side, bounces: u32, shadow: Transmittance, amount: u32) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.mode = side.mode;
    scene.integrator.max_bounces = Limit::AtMost(bounces);
    if side.mode == Mode::Path {
        scene.tracking.transmittance = shadow;
    } else if !side.shares {
        (scene.restir.temporal, scene.restir.spatial) = (false, false);
        scene.restir.candidates = Auto::Is(amount);
    }
    scene
}

/// The camera `frames` frames before it comes to where the scene has it.
pub fn before(scene: &Scene, field: &Field, aspect: f64, frames: u32) -> Scene {
    let mut scene = scene.clone();
    if frames > 0 {
        let view = View::of(&scene.camera, field, aspect);
        let turn = (TURN * f64::from(frames)).to_radians();
        orbit::orbit(&mut scene.camera, &view, DVec2::new(turn / std::f64::consts::PI, 0.0));
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_mode_has_a_side_and_ours_is_there_once() {
        let all = sides();
        assert_eq!(all.iter().filter(|s| s.name == OURS).count(), 1);
        assert!(Mode::ALL.iter().filter(|mode| mode.reuses()).all(|mode| all.iter().any(|s| s.mode == *mode)));
        let mut names: Vec<&str> = all.iter().map(|s| s.name.as_str()).collect();
        names.dedup();
        assert_eq!(names.len(), all.len());
        assert_eq!(names[..4], [PATH, "path-1", "control", OURS]);
        assert!(all.iter().all(|s| !(s.shares && s.matched)));
    }

    #[test]
    fn usual_volumes_are_there_and_looks_are_known() {
        for volume in VOLUMES {
            let scene = scene(volume);
            assert!(Field::load(&Volume { resolution: 16, ..scene.volume.clone() }).is_ok(), "{volume}");
        }
        assert!(LOOKS.iter().all(|(_, look)| PRESETS.iter().any(|preset| preset.name == *look)));
        assert_eq!(scene("a.vdb").volume.file.0, "a.vdb");
    }

    #[test]
    fn the_camera_turns_by_equal_steps_and_ends_at_its_place() {
        let scene = scene("smoke-column");
        let field = Field::load(&scene.volume).expect("a built-in volume");
        let arm = |frames| {
            let scene = before(&scene, &field, 1.5, frames);
            let view = View::of(&scene.camera, &field, 1.5);
            view.position - view.target
        };
        for frames in 0..4 {
            let (a, b) = (arm(frames), arm(frames + 1));
            assert!((a.length() - b.length()).abs() < 1e-9 * a.length());
            let turned = (b.z.atan2(b.x) - a.z.atan2(a.x)).to_degrees().abs();
            assert!((turned - TURN).abs() < 1e-6, "{turned}");
        }
        assert_eq!(before(&scene, &field, 1.5, 0), scene);
    }

    #[test]
    fn the_middle_has_a_window_s_pixels_from_the_same_place() {
        let scene = scene("cumulus");
        let field = Field::load(&Volume { resolution: 16, ..scene.volume.clone() }).expect("a built-in volume");
        let [middle, whole] = Framing::ALL.map(|framing| framing.of(&scene, &field, (120, 90)));
        assert_eq!(whole, scene);
        let [a, b] = [&middle, &whole].map(|s| View::of(&s.camera, &field, 4.0 / 3.0));
        assert!((a.position - b.position).length() < 1e-9 && (a.target - b.target).length() < 1e-9);
        let [a, b] = [middle, whole].map(|s| (s.camera.fov_y / 2.0).to_radians().tan());
        assert!((b / a - 8.0).abs() < 1e-9, "{}", b / a);
    }

    #[test]
    fn motions_share_no_seed() {
        let [still, moving] = Motion::ALL.map(|motion| motion.seeds(5));
        assert_eq!((still.len(), moving.len()), (5, 5));
        assert!(moving.into_iter().all(|seed| !still.contains(&seed)));
    }

    #[test]
    fn sides_differ_in_what_they_share_alone() {
        let all = sides();
        let of = |i: usize| drawn(&Scene::default(), &all[i], 3, Transmittance::Delta, 7);
        assert_eq!(of(0).tracking.transmittance, Transmittance::Delta);
        assert_eq!((of(2).candidates(), of(2).restir.temporal, of(2).restir.spatial), (7, false, false));
        assert_eq!(of(3).restir, Scene::default().restir);
        assert!(all.iter().enumerate().all(|(i, s)| of(i).integrator.mode == s.mode));
    }
}
