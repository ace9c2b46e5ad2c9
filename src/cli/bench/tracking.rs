//! `bench tracking`: every free flight, transmittance, bound and control on real, procedural and analytic volumes, in
//! rounds that take each in turn.

use std::sync::Arc;

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::render::Renderer;
use crate::render::field::{Field, Shape};
use crate::render::film::BLOCK;
use crate::render::medium::Medium;
use crate::render::params::Params;
use crate::scene::value::{Auto, Limit};
use crate::scene::{FreeFlight, MajorantKind, Scene, Tracking, Transmittance};
use crate::volume::majorant::{Bounds, Padded};

pub mod chart;
mod figures;
mod plan;
mod report;

use super::trace::trace;
use super::twin;
use super::{bar, progress};
use figures::{Case, March, Measured, Round, Saving};
use plan::Row;
use report::Report;

/// Pixels along a side of the picture, and those of `--quick`.
const SIZE: u32 = 64;
const QUICK_SIZE: u32 = 32;
/// Rounds, and those of `--quick`.
const ROUNDS: u32 = 3;
const QUICK_ROUNDS: u32 = 2;
/// Wall seconds of one row in one round, and those of `--quick`.
const ROUND_SECONDS: f64 = 0.2;
const QUICK_ROUND_SECONDS: f64 = 0.08;
/// Samples of a pixel in a round at least; two tell a variance.
const LEAST_SAMPLES: u32 = 2;
/// Optical thickness of the haze that shows decomposition's savings: walks from its middle hardly see its border.
const HAZE_THICKNESS: f64 = 80.0;
/// Least densities of that haze: the shares of control that explain the published ratios 0.58 and 0.42.
const HAZE_FLOORS: [f64; 2] = [0.42, 0.58];
/// Sides of the cells there: one wave of the haze.
const HAZE_CELL: u32 = 8;
/// Steps of ray marching, in voxels, and how many of them `--quick` takes. Through the 74 of an analytic box they are 1, 2,
/// 4, 8 and 15 steps.
const MARCH_STEPS: [f64; 5] = [5.0, 10.0, 20.0, 40.0, 80.0];
const QUICK_MARCH_STEPS: usize = 2;
/// Volumes on which marching is measured, and their optical thickness.
const MARCH_VOLUMES: [&str; 2] = ["linear", "cumulus"];
const MARCH_THICKNESS: f64 = 4.0;
/// Rounds of a block of samples of every pixel for each point there.
const MARCH_ROUNDS: u32 = 4;

/// How much is measured.
struct Effort {
    size: u32,
    rounds: u32,
    seconds: f64,
    quick: bool,
}

/// The renderer that draws everything, so that each shader is built once, and how time is taken.
struct Session {
    renderer: Renderer,
    cpu_time: bool,
    effort: Effort,
    /// Parts done, of all, for the progress bar.
    done: usize,
    all: usize,
}

/// Measures everything; some ten minutes on a software adapter, less with `quick`. `volumes` are names or files in place of
/// the usual ones, `size` pixels along a side in place of the usual number.
///
/// # Errors
/// Those of volumes that cannot be read, of shaders and of the adapter.
pub fn measure(quick: bool, volumes: &[String], size: Option<u32>) -> Result<Report> {
    let usual = if quick { &plan::VOLUMES[..plan::QUICK_VOLUMES] } else { &plan::VOLUMES[..] };
    let chosen = !volumes.is_empty();
    let volumes: Vec<&str> = if chosen { volumes.iter().map(String::as_str).collect() } else { usual.to_vec() };
    let effort = Effort {
        size: size.unwrap_or(if quick { QUICK_SIZE } else { SIZE }),
        rounds: if quick { QUICK_ROUNDS } else { ROUNDS },
        seconds: if quick { QUICK_ROUND_SECONDS } else { ROUND_SECONDS },
        quick,
    };
    let gpu = Arc::new(Gpu::headless()?);
    // Any medium serves until the first volume comes.
    let first = plan::scene("homogeneous");
    let medium = Medium::new(&gpu, Arc::new(Field::load(&first.volume)?), &first)?;
    let square = (effort.size, effort.size);
    let renderer = Renderer::new(gpu.clone(), Source::standard(), &first, medium, square, false)?;
    let settings = plan::THICKNESSES.len() * volumes.len() * if quick { 1 } else { 2 };
    let all = settings + if chosen { 0 } else { HAZE_FLOORS.len() + MARCH_VOLUMES.len() };
    let mut session = Session { renderer, cpu_time: gpu.is_software(), effort, done: 0, all };
    let (mut cases, mut savings, mut marches) = (Vec::new(), Vec::new(), Vec::new());
    for volume in volumes {
        session.volume(volume, &mut cases, &mut savings)?;
    }
    if !chosen {
        for floor in HAZE_FLOORS {
            savings.push(session.haze(floor)?);
        }
        for volume in MARCH_VOLUMES {
            marches.extend(session.march(volume)?);
        }
    }
    progress("");
    Ok(Report {
        adapter: gpu.info.name.clone(),
        backend: gpu.backend(),
        cpu_time: session.cpu_time,
        size: session.effort.size,
        cases,
        savings,
        marches,
    })
}

impl Session {
    /// The share that is done, the part under way counting by its own share, and what is done now.
    fn show(&self, share: f64, what: &str) {
        progress(&bar((self.done as f64 + share) / self.all as f64, what));
    }

    /// Makes `field` the medium.
    fn place(&mut self, field: Field, scene: &Scene) -> Result<()> {
        let medium = Medium::new(&self.renderer.gpu, Arc::new(field), scene)?;
        self.renderer.update(scene, self.renderer.size(), Some(medium))?;
        Ok(())
    }

    /// One run.
    fn run(&mut self, scene: &Scene, samples: u32, seed: u32) -> Result<Round> {
        let run = trace(&mut self.renderer, scene, samples, seed)?;
        self.cpu_time &= run.cpu.is_some();
        Ok(Round::of(&run, if self.cpu_time { run.cpu.unwrap_or(run.wall) } else { run.wall }))
    }

    /// Everything about a volume.
    fn volume(&mut self, volume: &str, cases: &mut Vec<Case>, savings: &mut Vec<Saving>) -> Result<()> {
        self.show(0.0, &format!("{volume}: setting up"));
        let scene = plan::scene(volume);
        let field = plan::field(volume, &scene)?;
        self.place(field, &scene)?;
        let column = self.renderer.medium.mean_column;
        let colours: &[bool] = if self.effort.quick { &[false] } else { &[false, true] };
        for (label, thickness) in plan::THICKNESSES {
            for &coloured in colours {
                let scene = plan::at_thickness(&scene, thickness, column, coloured);
                let setting = format!("{label}, {}", if coloured { "coloured" } else { "grey" });
                let rows = self.rows(&scene, &format!("{volume}, {setting}"), coloured)?;
                let case = Case { volume: volume.into(), setting, thickness, rows };
                savings.extend(self.savings(&case, &scene)?);
                cases.push(case);
                self.done += 1;
            }
        }
        Ok(())
    }

    /// All rows in one setting, and then the winners together.
    fn rows(&mut self, scene: &Scene, label: &str, coloured: bool) -> Result<Vec<Measured>> {
        let analytic = self.renderer.medium.is_analytic();
        let rows = plan::rows(analytic, coloured, self.effort.quick);
        let new = |row: Row| Measured { row, bound_bytes: 0, bound_seconds: f64::INFINITY, rounds: Vec::new() };
        let mut all: Vec<Measured> = rows.iter().cloned().map(new).collect();
        let share = 0.9;
        self.rounds(scene, &mut all, label, [0.0, share])?;
        let case = Case { volume: String::new(), setting: String::new(), thickness: 0.0, rows: all };
        let in_group = |group| move |r: &Row| r.group == group;
        let default_pair = |r: &Row| {
            let t = Tracking { majorant: r.tracking.majorant, cell: r.tracking.cell, ..Tracking::default() };
            t == r.tracking && r.group != plan::Group::Baseline
        };
        let best = |which: &dyn Fn(&Row) -> bool| case.best(which, Measured::efficiency).row.tracking.clone();
        let flight = best(&in_group(plan::Group::FreeFlight));
        let shadow = best(&in_group(plan::Group::Transmittance));
        let crossed = plan::crossed(&rows, analytic, &flight, &shadow, &best(&default_pair));
        let mut all = case.rows;
        let mut late: Vec<Measured> = crossed.into_iter().map(new).collect();
        self.rounds(scene, &mut late, label, [share, 1.0])?;
        all.extend(late);
        Ok(all)
    }

    /// Runs each of `all` in turn, in rounds, after one that builds the shaders and tells how many samples fit the time.
    fn rounds(&mut self, scene: &Scene, all: &mut [Measured], label: &str, [from, to]: [f64; 2]) -> Result<()> {
        let with = |row: &Row| Scene { tracking: row.tracking.clone(), ..scene.clone() };
        let turns = (all.len() * (self.effort.rounds as usize + 1)) as f64;
        let mut turn = 0.0;
        let mut samples = Vec::new();
        for round in 0..=self.effort.rounds {
            for (i, m) in all.iter_mut().enumerate() {
                self.show(from + (to - from) * turn / turns, &format!("{label}: {}", plan::name(&m.row.tracking)));
                turn += 1.0;
                let scene = with(&m.row);
                if round == 0 {
                    let wall = self.run(&scene, LEAST_SAMPLES, round)?.wall / f64::from(LEAST_SAMPLES);
                    samples.push(((self.effort.seconds / wall) as u32).clamp(LEAST_SAMPLES, BLOCK));
                    continue;
                }
                m.rounds.push(self.run(&scene, samples[i], round)?);
                m.bound_bytes = self.renderer.medium.majorant_bytes;
                m.bound_seconds = m.bound_seconds.min(self.renderer.medium.majorant_seconds);
            }
        }
        Ok(())
    }

    /// What decomposition saved on a volume with voxels, by every uniform grid that has both rows.
    fn savings(&mut self, case: &Case, scene: &Scene) -> Result<Vec<Saving>> {
        let field = self.renderer.medium.field.clone();
        let Shape::Dense(dense) = &field.shape else { return Ok(Vec::new()) };
        let padded = Padded::new(dense, |x| half::f16::from_f32(x).to_f32());
        let mut all = Vec::new();
        for m in case.rows.iter().filter(|m| m.row.tracking.free_flight == FreeFlight::Decomposition) {
            let t = &m.row.tracking;
            let Auto::Is(side) = t.cell else { continue };
            let default = Tracking { free_flight: FreeFlight::Delta, ..t.clone() };
            let Some(delta) = case.row(&default) else { continue };
            let predicted = 1.0 - self.control_share(scene, &padded, side)?;
            all.push(Saving::of(&format!("{}, {}", case.volume, case.setting), delta, m, predicted));
        }
        Ok(all)
    }

    /// ⟨µc/µ̄⟩ in cells of `side` texels on walks through `scene`.
    fn control_share(&mut self, scene: &Scene, padded: &Padded, side: u32) -> Result<f64> {
        self.renderer.update(scene, self.renderer.size(), None)?;
        let (width, height) = self.renderer.size();
        let r = &self.renderer;
        let params = Params::of(&r.scene, &r.medium, r.lights(), width, height);
        Ok(twin::control_share(&params, padded, &Bounds::new(padded, side)))
    }

    /// Decomposition in a haze whose cells hold a share `floor` of control, on flights from its middle.
    fn haze(&mut self, floor: f64) -> Result<Saving> {
        let medium = format!("haze, control {floor}");
        self.show(0.0, &medium);
        let mut scene = plan::scene("haze");
        let field = plan::haze(floor);
        let column = field.mean_column();
        self.place(field, &scene)?;
        scene = plan::at_thickness(&scene, HAZE_THICKNESS, column, false);
        scene.camera.position = Auto::Is(glam::DVec3::ZERO);
        scene.camera.target = Auto::Is(glam::DVec3::new(0.3, 0.2, 1.0));
        scene.integrator.max_bounces = Limit::AtMost(0);
        scene.tracking = Tracking { majorant: MajorantKind::Grid, cell: Auto::Is(HAZE_CELL), ..Tracking::default() };
        let decomposition = Tracking { free_flight: FreeFlight::Decomposition, ..scene.tracking.clone() };
        let row = |tracking: &Tracking| Row { group: plan::Group::Bound, tracking: tracking.clone() };
        let mut all: Vec<Measured> = [row(&scene.tracking), row(&decomposition)]
            .map(|row| Measured { row, bound_bytes: 0, bound_seconds: f64::INFINITY, rounds: Vec::new() })
            .into();
        self.rounds(&scene, &mut all, &medium, [0.0, 1.0])?;
        self.done += 1;
        let field = self.renderer.medium.field.clone();
        let Shape::Dense(dense) = &field.shape else { return Ok(Saving::of(&medium, &all[0], &all[1], 1.0)) };
        let padded = Padded::new(dense, |x| half::f16::from_f32(x).to_f32());
        let predicted = 1.0 - self.control_share(&scene, &padded, HAZE_CELL)?;
        Ok(Saving::of(&medium, &all[0], &all[1], predicted))
    }

    /// Error of marching flights (in unscattered light), marching shadow rays and the jackknife (in light scattered once) on a
    /// volume, against regular tracking; one bound for all, so that no cell cuts a step.
    fn march(&mut self, volume: &str) -> Result<Vec<March>> {
        self.show(0.0, &format!("{volume}: ray marching"));
        let scene = plan::scene(volume);
        let field = plan::field(volume, &scene)?;
        self.place(field, &scene)?;
        let column = self.renderer.medium.mean_column;
        let mut scene = plan::at_thickness(&scene, MARCH_THICKNESS, column, false);
        if self.renderer.medium.is_analytic() {
            plan::close_up(&mut scene);
        }
        let (flights, shadows) = (plan::unscattered(&scene), plan::single(&scene));
        let exact =
            Tracking { free_flight: FreeFlight::Regular, transmittance: Transmittance::Regular, ..plan::baseline() };
        let steps = if self.effort.quick { &MARCH_STEPS[..QUICK_MARCH_STEPS] } else { &MARCH_STEPS[..] };
        let samples = if self.effort.quick { LEAST_SAMPLES } else { BLOCK };
        let mut mean = |scene: &Scene, tracking: &Tracking, seed: u32| -> Result<(f64, f64)> {
            let scene = Scene { tracking: tracking.clone(), ..scene.clone() };
            let mut rounds = Vec::new();
            for round in 0..MARCH_ROUNDS {
                rounds.push(self.run(&scene, samples, seed + round)?);
            }
            let row = Row { group: plan::Group::Baseline, tracking: tracking.clone() };
            let m = Measured { row, bound_bytes: 0, bound_seconds: 0.0, rounds };
            Ok((m.mean(), m.error()))
        };
        let kinds = [
            ("marching flights", &flights, Tracking { free_flight: FreeFlight::RayMarching, ..exact.clone() }),
            ("marching shadow rays", &shadows, Tracking { transmittance: Transmittance::RayMarching, ..exact.clone() }),
            ("jackknife shadow rays", &shadows, Tracking { transmittance: Transmittance::Jackknife, ..exact.clone() }),
        ];
        let mut all = Vec::new();
        // Seeds of their own, so that errors are independent.
        let mut seed = 0;
        for (estimator, scene, tracking) in kinds {
            let (truth, truth_error) = mean(scene, &exact, seed)?;
            seed += MARCH_ROUNDS;
            let mut points = Vec::new();
            for &step in steps {
                let (value, error) = mean(scene, &Tracking { step, ..tracking.clone() }, seed)?;
                seed += MARCH_ROUNDS;
                points.push([step, value / truth - 1.0, error.hypot(truth_error) / truth]);
            }
            all.push(March { medium: volume.into(), estimator: estimator.into(), points });
        }
        self.done += 1;
        Ok(all)
    }
}
