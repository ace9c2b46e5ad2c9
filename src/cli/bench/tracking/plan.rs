//! What is measured: volumes, settings and rows.

use glam::{DMat4, DVec3, UVec3};

use crate::error::Result;
use crate::render::field::{Field, Shape};
use crate::render::tracking;
use crate::scene::value::{Auto, Colour, FilePath, Limit, Pair};
use crate::scene::{
    Analytic, Axis, Constant, Control, FreeFlight, Light, MajorantKind, Scene, Sun, Tracking, Transmittance, Volume,
};
use crate::volume::Dense;

/// Names of the volumes that are measured where none is named, and how many of them `--quick` takes.
pub const VOLUMES: [&str; 6] = ["cumulus", "homogeneous", "fire", "disney-cloud", "haze", "linear"];
pub const QUICK_VOLUMES: usize = 2;
/// Mean optical thickness of a thin and of a dense medium.
pub const THICKNESSES: [(&str, f64); 2] = [("thin", 2.0), ("dense", 40.0)];
/// Extinction of red, green and blue in the coloured settings.
const COLOURED: [f64; 3] = [1.0, 0.6, 0.3];
/// Sides of uniform cells, and those of `--quick`.
const CELLS: [u32; 4] = [4, 8, 16, 32];
const QUICK_CELLS: [u32; 1] = [8];
/// A majorant factor below 1 for the weighted flight, which does not need bounds.
const LOOSE: f64 = 0.9;
/// Voxels along a side of the haze, and along its waves.
const HAZE_SIZE: u32 = 96;
const HAZE_WAVE: f64 = 8.0;
/// Least density of the haze among the volumes.
const HAZE_FLOOR: f64 = 0.5;

/// What a row is there for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// What the others are compared with: delta, ratio and a global majorant.
    Baseline,
    /// A free flight with the default transmittance and bound.
    FreeFlight,
    /// A transmittance with the default free flight and bound.
    Transmittance,
    /// A bound with the default estimators and with those that take a control.
    Bound,
    /// Winners of the other groups together.
    Crossed,
}

impl Group {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Group::Baseline => "baseline",
            Group::FreeFlight => "free flight",
            Group::Transmittance => "transmittance",
            Group::Bound => "bound",
            Group::Crossed => "crossed",
        }
    }
}

/// One thing to measure.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Why.
    pub group: Group,
    /// How.
    pub tracking: Tracking,
}

/// A bound in words.
pub fn bound_name(t: &Tracking) -> String {
    match (t.majorant, t.cell) {
        (MajorantKind::Grid, Auto::Auto) => "grid auto".into(),
        (MajorantKind::Grid, Auto::Is(side)) => format!("grid {side}"),
        (kind, _) => kind.name().into(),
    }
}

/// Estimators, bound and control in words: the same for equal settings, another for different ones.
pub fn name(t: &Tracking) -> String {
    let mut name = format!("{} · {} · {}", t.free_flight.name(), t.transmittance.name(), bound_name(t));
    if tracking::needs_control(t) {
        name += &format!(" · {}", t.control.name());
    }
    if t.majorant_factor != 1.0 {
        name += &format!(" · µ̄ × {}", t.majorant_factor);
    }
    name
}

/// What the others are compared with.
pub fn baseline() -> Tracking {
    Tracking { majorant: MajorantKind::Global, ..Tracking::default() }
}

/// The bounds to measure.
pub fn bounds(quick: bool) -> Vec<(MajorantKind, Auto<u32>)> {
    let sides = if quick { &QUICK_CELLS[..] } else { &CELLS[..] };
    let mut all = Vec::new();
    for &kind in MajorantKind::ALL {
        all.push((kind, Auto::Auto));
        if kind == MajorantKind::Grid {
            all.extend(sides.iter().map(|&side| (kind, Auto::Is(side))));
        }
    }
    all
}

/// Appends a row unless it is there already or does not fit.
fn push(rows: &mut Vec<Row>, analytic: bool, group: Group, tracking: Tracking) {
    let known = rows.iter().any(|r| name(&r.tracking) == name(&tracking));
    if !known && tracking.check(analytic).is_ok() {
        rows.push(Row { group, tracking });
    }
}

/// The rows for a volume; the baseline is the first, the default the second. In an `analytic` medium bounds are its own.
pub fn rows(analytic: bool, coloured: bool, quick: bool) -> Vec<Row> {
    let default = Tracking::default();
    let mut rows = Vec::new();
    push(&mut rows, analytic, Group::Baseline, baseline());
    push(&mut rows, analytic, Group::FreeFlight, default.clone());
    for &free_flight in FreeFlight::ALL {
        for &control in controls(tracking::flight(free_flight).control) {
            push(&mut rows, analytic, Group::FreeFlight, Tracking { free_flight, control, ..default.clone() });
        }
    }
    let loose = Tracking { free_flight: FreeFlight::WeightedDelta, majorant_factor: LOOSE, ..default.clone() };
    push(&mut rows, analytic, Group::FreeFlight, loose);
    for &transmittance in Transmittance::ALL {
        for &control in controls(tracking::transmittance(transmittance).control) {
            push(&mut rows, analytic, Group::Transmittance, Tracking { transmittance, control, ..default.clone() });
        }
    }
    // Colour changes nothing about bounds but a factor.
    if analytic || coloured {
        return rows;
    }
    for (majorant, cell) in bounds(quick) {
        let bound = Tracking { majorant, cell, ..default.clone() };
        push(&mut rows, analytic, Group::Bound, bound.clone());
        let decomposition = Tracking { free_flight: FreeFlight::Decomposition, ..bound.clone() };
        push(&mut rows, analytic, Group::Bound, decomposition);
        for &control in Control::ALL {
            let residual = Tracking { transmittance: Transmittance::ResidualRatio, control, ..bound.clone() };
            push(&mut rows, analytic, Group::Bound, residual);
        }
    }
    rows
}

fn controls(used: bool) -> &'static [Control] {
    if used { Control::ALL } else { &[Control::Min] }
}

/// The winners of each kind together, in all ways that `rows` has not yet: the best free flight, transmittance (with its
/// control) and bound in place of the default one, each or not.
pub fn crossed(rows: &[Row], analytic: bool, flight: &Tracking, shadow: &Tracking, bound: &Tracking) -> Vec<Row> {
    let mut all = rows.to_vec();
    for choice in 0..8u32 {
        let mut t = Tracking::default();
        if choice & 1 != 0 {
            t.free_flight = flight.free_flight;
            t.majorant_factor = flight.majorant_factor;
            t.control = flight.control;
        }
        if choice & 2 != 0 {
            t.transmittance = shadow.transmittance;
            // Analog decomposition takes no mean.
            let min = t.free_flight == FreeFlight::Decomposition;
            t.control = if min { Control::Min } else { shadow.control };
        }
        if choice & 4 != 0 {
            (t.majorant, t.cell) = (bound.majorant, bound.cell);
        }
        push(&mut all, analytic, Group::Crossed, t);
    }
    all.split_off(rows.len())
}

/// The scene of a volume by its name, or of a file. Lights and albedo are grey, so that in grey media all channels are the
/// same and the variance of one is that of the luminance.
pub fn scene(volume: &str) -> Scene {
    let mut scene = match volume {
        "cumulus" | "haze" => Scene::default(),
        "fire" => Scene::of_volume("asset:fire"),
        "disney-cloud" => Scene::of_volume("asset:disney-cloud"),
        "homogeneous" => analytic(Analytic::Homogeneous),
        "linear" => analytic(Analytic::Linear),
        file => Scene { volume: Volume { file: FilePath(file.to_owned()), ..Volume::default() }, ..Scene::default() },
    };
    // A sun far brighter than the sky and a phase function that is not too narrow: shadow rays matter.
    let sun = Sun { irradiance: Colour([5.0; 3]), ..Sun::default() };
    let sky = Constant { radiance: Colour([0.2; 3]) };
    scene.medium.g = 0.5;
    scene.lights = vec![Light::Sun(sun), Light::Constant(sky)];
    scene
}

fn analytic(analytic: Analytic) -> Scene {
    let volume = Volume { analytic, axis: Axis::Z, density: Pair([0.2, 1.0]), ..Volume::default() };
    Scene { volume, ..Scene::default() }
}

/// The field of that scene.
pub fn field(name: &str, scene: &Scene) -> Result<Field> {
    if name == "haze" { Ok(haze(HAZE_FLOOR)) } else { Field::load(&scene.volume) }
}

/// A cube of waves between `floor` and 1; every cell of at least [`HAZE_WAVE`] texels that does not touch the border holds
/// both, so that their least density is a share `floor` of their bound.
pub fn haze(floor: f64) -> Field {
    let wave = |i: u32| (std::f64::consts::PI * f64::from(i) / HAZE_WAVE).sin().powi(2);
    let side = 0..HAZE_SIZE;
    let data = side
        .clone()
        .flat_map(|z| side.clone().map(move |y| (y, z)))
        .flat_map(|(y, z)| side.clone().map(move |x| [x, y, z]))
        .map(|p| (floor + (1.0 - floor) * p.map(wave).iter().product::<f64>()) as f32)
        .collect();
    // A cube of side 2 about the origin.
    let scale = 2.0 / f64::from(HAZE_SIZE);
    let world_from_index =
        DMat4::from_translation(DVec3::splat(0.5 * scale - 1.0)) * DMat4::from_scale(DVec3::splat(scale));
    let shape = Shape::Dense(Dense { size: UVec3::splat(HAZE_SIZE), data, world_from_index, warnings: Vec::new() });
    let (grids, grid) = (Vec::new(), String::new());
    Field { shape, to_world: DMat4::IDENTITY, nearest: false, grids, grid, warnings: Vec::new() }
}

/// `scene` at a mean optical thickness, for a medium whose columns have a mean of `column`.
pub fn at_thickness(scene: &Scene, thickness: f64, column: Option<f64>, coloured: bool) -> Scene {
    let mut scene = scene.clone();
    scene.medium.density_scale = Auto::Is(column.map_or(1.0, |c| thickness / c));
    if coloured {
        scene.medium.extinction = Colour(COLOURED);
    }
    scene
}

/// `scene` for marching flights: only what is not scattered, before a background of 1, so that the picture is the
/// transmittance.
pub fn unscattered(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.max_bounces = Limit::AtMost(0);
    scene.lights = vec![Light::Constant(Constant { radiance: Colour([1.0; 3]) })];
    scene
}

/// `scene` for marching shadow rays: one scattering of the light of a sun that mostly stands behind the volume.
pub fn single(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.integrator.max_bounces = Limit::AtMost(1);
    let sun = Sun { irradiance: Colour([5.0; 3]), direction: DVec3::new(0.3, 0.2, -1.0), ..Sun::default() };
    scene.lights = vec![Light::Sun(sun)];
    scene
}

/// Brings the camera so near to an analytic box that it fills the picture; a look at the sky beside it tells nothing about
/// steps.
pub fn close_up(scene: &mut Scene) {
    scene.camera.position = Auto::Is(DVec3::new(0.0, 0.0, 4.0));
    scene.camera.fov_y = 15.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::majorant::{Bounds, Padded};

    #[test]
    fn every_estimator_bound_and_control_has_a_row_somewhere() {
        for quick in [false, true] {
            let all: Vec<Row> =
                [rows(false, false, quick), rows(false, true, quick), rows(true, false, quick)].concat();
            for &kind in FreeFlight::ALL {
                assert!(all.iter().any(|r| r.tracking.free_flight == kind), "{kind:?}");
            }
            for &kind in Transmittance::ALL {
                assert!(all.iter().any(|r| r.tracking.transmittance == kind), "{kind:?}");
            }
            for &kind in MajorantKind::ALL {
                for free_flight in [FreeFlight::Delta, FreeFlight::Decomposition] {
                    let fits = |r: &&Row| r.tracking.majorant == kind && r.tracking.free_flight == free_flight;
                    assert!(all.iter().any(|r| fits(&r)), "{kind:?} with {free_flight:?}");
                }
            }
            for &control in Control::ALL {
                assert!(all.iter().any(|r| tracking::needs_control(&r.tracking) && r.tracking.control == control));
            }
        }
    }

    #[test]
    fn rows_are_valid_and_none_stands_twice() {
        for (analytic, coloured) in [(false, false), (false, true), (true, false)] {
            let mut rows = rows(analytic, coloured, false);
            assert_eq!((&rows[0].tracking, &rows[1].tracking), (&baseline(), &Tracking::default()));
            let mean =
                Tracking { transmittance: Transmittance::ResidualRatio, control: Control::Mean, ..Tracking::default() };
            let flight = Tracking { free_flight: FreeFlight::Decomposition, ..Tracking::default() };
            let bound = Tracking { majorant: MajorantKind::KdTree, ..Tracking::default() };
            rows.extend(crossed(&rows, analytic, &flight, &mean, &bound));
            assert!(rows.iter().any(|r| r.group == Group::Crossed));
            let all_three = rows.iter().any(|r| {
                let t = &r.tracking;
                (t.free_flight, t.transmittance, t.majorant)
                    == (FreeFlight::Decomposition, Transmittance::ResidualRatio, MajorantKind::KdTree)
            });
            assert!(all_three, "the winners together");
            let mut names: Vec<String> = rows.iter().map(|r| name(&r.tracking)).collect();
            assert!(rows.iter().all(|r| r.tracking.check(analytic).is_ok()));
            let count = names.len();
            names.sort();
            names.dedup();
            assert_eq!(names.len(), count);
        }
    }

    #[test]
    fn cells_of_the_haze_hold_its_floor_and_its_peak() {
        let Shape::Dense(dense) = haze(0.25).shape else { panic!("voxels") };
        let bounds = Bounds::new(&Padded::new(&dense, |x| x), HAZE_WAVE as u32);
        let middle = bounds.index(bounds.cells / 2);
        assert!((bounds.min[middle] - 0.25).abs() < 1e-3 && bounds.max[middle] > 0.999, "{bounds:?}");
    }
}
