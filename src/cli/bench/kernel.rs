//! `bench kernel`: the path tracer against a bare tracking kernel and its CPU twin, majorants, and what settings cost.

use std::sync::Arc;

use wgpu::util::DeviceExt;

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, Variant};
use crate::render::Renderer;
use crate::render::field::{Field, Shape};
use crate::render::film::{BLOCK, Film};
use crate::render::lights::{LightData, Lights};
use crate::render::medium::Medium;
use crate::render::params::{Params, Slice};
use crate::render::pipeline::{self, Layouts};
use crate::scene::value::Auto;
use crate::scene::{MajorantKind, Scene};
use crate::volume::majorant::Padded;

use super::clock::Watch;
use super::progress;
use super::report::{Ratio, Report, Round, Side, Volume};
use super::trace::trace;
use super::twin;

/// Pixels along a side of the picture.
const SIZE: u32 = 256;
/// Voxels along the longest side of the volumes; `--quick` takes the first.
const RESOLUTIONS: [u32; 2] = [128, 256];
/// Rounds, and those of `--quick`.
const ROUNDS: u32 = 7;
const QUICK_ROUNDS: u32 = 3;
/// Samples of each pixel in a round at least: enough for lanes to even out.
const LEAST_SAMPLES: u32 = 16;
/// Seconds that a round of the default side takes at least: far above the resolution of clocks and the cost of a submit.
const LEAST_SECONDS: f64 = 0.05;
/// Sides of uniform cells that the default is compared with.
const CELLS: [u32; 4] = [4, 8, 16, 32];
/// Tracking steps of the bare kernels between looks at events.
const BARE_STEPS: [u32; 3] = [1, 2, 4];
/// The bare kernel that the aims are for: flat, as the performance guide defines it.
const BARE_AIM: u32 = 1;

/// Aims; see the performance guide.
const STEPS_OVER_LOOKUPS: f64 = 0.6;
const BARE_OVER_TWIN: [f64; 2] = [1.5, 1.8];
const DEFAULT_OVER_GLOBAL: f64 = 2.2;
const DEFAULT_OVER_CELLS: f64 = 0.95;
const SUN_EFFICIENCY: f64 = 1.25;

/// Something that can be timed.
enum Runner {
    Path(Box<Renderer>),
    Bare(Box<Bare>),
    Twin { params: Box<Params>, field: Padded },
}

/// The bare kernel on the adapter.
struct Bare {
    gpu: Arc<Gpu>,
    pipeline: wgpu::ComputePipeline,
    groups: [wgpu::BindGroup; 4],
    film: Film,
    params: Params,
    params_buffer: wgpu::Buffer,
    slice_buffer: wgpu::Buffer,
}

impl Bare {
    fn new(gpu: &Arc<Gpu>, scene: &Scene, field: &Arc<Field>, steps: u32) -> Result<Bare> {
        let layouts = Layouts::new(gpu, &Source::standard())?;
        let medium = Medium::new(gpu, field.clone(), scene)?;
        let lights = Lights::of(scene, &LightData::load(scene)?, field, medium.unit, None);
        let params = Params::of(scene, &medium, &lights, SIZE, SIZE);
        let film = Film::new(gpu, SIZE, SIZE, false)?;
        let filterable = medium.filterable(gpu);
        let layout = layouts.tracer(gpu, filterable);
        let variant = Variant::default().slot("phase", "phase/hg").flag("CAMERA_LENS", false);
        let variant = medium.variant(variant).count("TRACK_STEPS", steps);
        let pipeline = pipeline::compute(gpu, &Source::standard(), "bench/bare", "bare_main", &variant, Some(&layout))?;
        let uniform = |bytes: &[u8]| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("bare"),
                contents: bytes,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        };
        let params_buffer = uniform(bytemuck::bytes_of(&params));
        let slice_buffer = uniform(bytemuck::bytes_of(&Slice::default()));
        let groups = [
            layouts.frame_group(gpu, &params_buffer, &slice_buffer, &params_buffer),
            medium.bind_group(gpu, layouts.medium(filterable)),
            lights.bind_group(gpu, &layouts.lights, &mut None, &[]),
            layouts.film_group(gpu, &film),
        ];
        Ok(Bare { gpu: gpu.clone(), pipeline, groups, film, params, params_buffer, slice_buffer })
    }

    /// Walks of `samples` samples of every pixel; waits for the end.
    fn run(&mut self, samples: u32, seed: u32) -> Result<()> {
        self.params.seed = seed;
        let slice = Slice { samples, ..Slice::default() };
        self.gpu.queue.write_buffer(&self.params_buffer, 0, bytemuck::bytes_of(&self.params));
        self.gpu.queue.write_buffer(&self.slice_buffer, 0, bytemuck::bytes_of(&slice));
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&self.film.counters, 0, None);
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.pipeline);
            (0..).zip(&self.groups).for_each(|(i, group)| pass.set_bind_group(i, group, &[]));
            pass.dispatch_workgroups(self.params.tiles, 1, 1);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.gpu.wait()
    }
}

impl Runner {
    fn path(gpu: &Arc<Gpu>, scene: &Scene, field: &Arc<Field>, plants: &[(&str, &str)]) -> Result<Runner> {
        let plants = plants.iter().map(|(from, to)| ((*from).to_owned(), (*to).to_owned())).collect();
        let source = Source { plants, ..Source::standard() };
        let medium = Medium::new(gpu, field.clone(), scene)?;
        let mut renderer = Renderer::new(gpu.clone(), source, scene, medium, (SIZE, SIZE), false)?;
        renderer.prepare()?;
        Ok(Runner::Path(Box::new(renderer)))
    }

    /// One timed run. Seconds are wall time; the caller chooses.
    fn run(&mut self, samples: u32, seed: u32) -> Result<(Round, Option<f64>)> {
        let paths = f64::from(SIZE) * f64::from(SIZE) * f64::from(samples);
        let timed = |watch: Watch, lookups: f64| {
            let (wall, cpu) = watch.seconds();
            (Round { seconds: wall, wall, paths, lookups, steps: lookups, variance: 0.0 }, cpu)
        };
        match self {
            Runner::Path(renderer) => {
                let scene = renderer.scene.clone();
                let run = trace(renderer, &scene, samples, seed)?;
                let pixels = run.sums.sum.len();
                let of_means = (0..pixels).filter_map(|p| run.sums.variance(p)).map(|v| v.iter().sum::<f64>() / 3.0);
                let variance = of_means.sum::<f64>() / pixels as f64 * f64::from(samples);
                let (lookups, steps) = (run.counters.lookups as f64, run.counters.cell_steps as f64);
                Ok((Round { seconds: run.wall, wall: run.wall, paths, lookups, steps, variance }, run.cpu))
            }
            Runner::Bare(bare) => {
                let watch = Watch::start();
                bare.run(samples, seed)?;
                let (mut round, cpu) = timed(watch, 0.0);
                round.lookups = bare.film.count(&bare.gpu)?.lookups as f64;
                round.steps = round.lookups;
                Ok((round, cpu))
            }
            Runner::Twin { params, field } => {
                params.seed = seed;
                let watch = Watch::start();
                let lookups = twin::run(params, field, 0, samples) as f64;
                Ok(timed(watch, lookups))
            }
        }
    }
}

/// The default cloud at a resolution.
fn scene(resolution: u32) -> Scene {
    let mut scene = Scene::default();
    scene.volume.resolution = resolution;
    scene
}

const DEFAULT: &str = "default";
const GLOBAL: &str = "majorant global";
const TWIN: &str = "bare, CPU twin";
const EVERY_RAY: &str = "every shadow ray";
const THIN: &str = "density × ¼";
const THICK: &str = "density × 4";
const COLOURED: &str = "coloured extinction";

fn cell_name(side: u32) -> String {
    format!("cells of {side} voxels")
}

fn bare_name(steps: u32) -> String {
    format!("bare, {steps} per look")
}

fn runners(gpu: &Arc<Gpu>, scene: &Scene, field: &Arc<Field>) -> Result<Vec<(String, Runner)>> {
    let mut all = Vec::new();
    let with = |change: &dyn Fn(&mut Scene)| {
        let mut scene = scene.clone();
        change(&mut scene);
        scene
    };
    all.push((DEFAULT.into(), Runner::path(gpu, scene, field, &[])?));
    for steps in BARE_STEPS {
        all.push((bare_name(steps), Runner::Bare(Box::new(Bare::new(gpu, scene, field, steps)?))));
    }
    if let (Shape::Dense(dense), Runner::Bare(bare)) = (&field.shape, &all[1].1) {
        let params = Box::new(bare.params);
        let padded = Padded::new(dense, |x| half::f16::from_f32(x).to_f32());
        all.push((TWIN.into(), Runner::Twin { params, field: padded }));
    }
    let global = with(&|s| s.tracking.majorant = MajorantKind::Global);
    all.push((GLOBAL.into(), Runner::path(gpu, &global, field, &[])?));
    for side in CELLS {
        let cells = with(&|s| s.tracking.cell = Auto::Is(side));
        all.push((cell_name(side), Runner::path(gpu, &cells, field, &[])?));
    }
    let every = ("clamp(PATH_SHADOW_SHARE * expected, PATH_SHADOW_FLOOR, 1.0)", "1.0");
    all.push((EVERY_RAY.into(), Runner::path(gpu, scene, field, &[every])?));
    let density = Medium::new(gpu, field.clone(), scene)?.density_scale(scene);
    for (name, factor) in [(THIN, 0.25), (THICK, 4.0)] {
        let dense = with(&|s| s.medium.density_scale = Auto::Is(factor * density));
        all.push((name.into(), Runner::path(gpu, &dense, field, &[])?));
    }
    let coloured = with(&|s| s.medium.extinction.0 = [1.0, 0.9, 0.8]);
    all.push((COLOURED.into(), Runner::path(gpu, &coloured, field, &[])?));
    Ok(all)
}

fn ratios(sides: &[Side], bare_over_twin: f64) -> Vec<Ratio> {
    let side = |name: &str| sides.iter().find(|s| s.name == name).expect("every side was measured");
    let paths: fn(&Round) -> f64 = Round::paths_per_second;
    let steps: fn(&Round) -> f64 = Round::steps_per_second;
    let efficiency: fn(&Round) -> f64 = Round::efficiency;
    let speed = |s: &Side| s.spread(paths).median;
    let cells = CELLS.map(|c| side(&cell_name(c))).into_iter().max_by(|a, b| speed(a).total_cmp(&speed(b)));
    let cells = cells.expect("there are several");
    let default = side(DEFAULT);
    let over = |name: &str| format!("paths/s: {name} ÷ default");
    let aim = |k: u32, target: f64| (k == BARE_AIM).then_some(target);
    let shares = BARE_STEPS.map(|k| {
        let bare = side(&bare_name(k));
        let name = format!("segments/s: default ÷ lookups/s: {}", bare.name);
        Ratio::new(&name, aim(k, STEPS_OVER_LOOKUPS), (default, steps), (bare, steps))
    });
    let twins = BARE_STEPS.map(|k| {
        let bare = side(&bare_name(k));
        let name = format!("lookups/s: {} ÷ CPU twin", bare.name);
        Ratio::new(&name, aim(k, bare_over_twin), (bare, steps), (side(TWIN), steps))
    });
    let others = [
        Ratio::new(
            "paths/s: default ÷ global majorant",
            Some(DEFAULT_OVER_GLOBAL),
            (default, paths),
            (side(GLOBAL), paths),
        ),
        Ratio::new(
            &format!("paths/s: default ÷ {}, the best", cells.name),
            Some(DEFAULT_OVER_CELLS),
            (default, paths),
            (cells, paths),
        ),
        Ratio::new(
            "1/(variance · time): default ÷ every shadow ray",
            Some(SUN_EFFICIENCY),
            (default, efficiency),
            (side(EVERY_RAY), efficiency),
        ),
        Ratio::new(&over(THIN), None, (side(THIN), paths), (default, paths)),
        Ratio::new(&over(THICK), None, (side(THICK), paths), (default, paths)),
        Ratio::new(&over(COLOURED), None, (side(COLOURED), paths), (default, paths)),
    ];
    shares.into_iter().chain(twins).chain(others).collect()
}

/// Samples a round that keep the default side busy for long enough.
fn calibrate(runner: &mut Runner) -> Result<u32> {
    let mut samples = LEAST_SAMPLES;
    // The first run also warms up.
    while runner.run(samples, 0)?.0.wall < LEAST_SECONDS && samples < BLOCK {
        samples *= 2;
    }
    Ok(samples)
}

/// Measures everything; some minutes on a software adapter, less with `quick`.
pub fn measure(quick: bool) -> Result<Report> {
    let gpu = Arc::new(Gpu::headless()?);
    let rounds = if quick { QUICK_ROUNDS } else { ROUNDS };
    let resolutions = if quick { &RESOLUTIONS[..1] } else { &RESOLUTIONS[..] };
    let mut volumes = Vec::new();
    let mut samples = LEAST_SAMPLES;
    let mut cpu_time = gpu.is_software();
    for (&resolution, bare_over_twin) in resolutions.iter().zip(BARE_OVER_TWIN) {
        let name = format!("cumulus {resolution}³");
        progress(&format!("{name}: setting up"));
        let scene = scene(resolution);
        let field = Arc::new(Field::load(&scene.volume)?);
        let mut runners = runners(&gpu, &scene, &field)?;
        if volumes.is_empty() {
            samples = calibrate(&mut runners[0].1)?;
        }
        let mut sides: Vec<Side> =
            runners.iter().map(|(name, _)| Side { name: name.clone(), rounds: Vec::new() }).collect();
        for round in 0..rounds {
            for ((label, runner), side) in runners.iter_mut().zip(&mut sides) {
                progress(&format!("{name}: round {} of {rounds}, {label}", round + 1));
                let (mut measured, cpu) = runner.run(samples, round)?;
                match cpu {
                    Some(cpu) if cpu_time => measured.seconds = cpu,
                    _ => cpu_time = false,
                }
                side.rounds.push(measured);
            }
        }
        let ratios = ratios(&sides, bare_over_twin);
        volumes.push(Volume { name, sides, ratios });
    }
    progress("");
    Ok(Report {
        adapter: gpu.info.name.clone(),
        backend: gpu.backend(),
        cpu_time,
        size: (SIZE, SIZE),
        samples,
        volumes,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Resolution and samples of the comparison: small, but thousands of walks.
    const SMALL: u32 = 32;
    const SAMPLES: u32 = 1;

    #[test]
    fn the_bare_kernel_and_its_twin_walk_the_same_walk() {
        let Ok(gpu) = Gpu::headless().map(Arc::new) else { return };
        let scene = scene(SMALL);
        let field = Arc::new(Field::load(&scene.volume).expect("the cumulus"));
        let Shape::Dense(dense) = &field.shape else { panic!("the cumulus has voxels") };
        let mut lookups = Vec::new();
        for steps in BARE_STEPS {
            let mut bare = Bare::new(&gpu, &scene, &field, steps).expect("valid shaders");
            bare.run(SAMPLES, 3).expect("it runs");
            lookups.push(bare.film.count(&gpu).expect("it counts").lookups as f64);
            if steps == BARE_STEPS[0] {
                bare.params.seed = 3;
                let padded = Padded::new(dense, |x| half::f16::from_f32(x).to_f32());
                lookups.push(twin::run(&bare.params, &padded, 0, SAMPLES) as f64);
            }
        }
        // The same random numbers; a rounding turns a walk now and then.
        let [one, cpu, two, four] = lookups[..] else { panic!("four counts") };
        assert_eq!([one, one], [two, four], "the same walks, however they are cut");
        assert!(one > 1e5 && (one / cpu - 1.0).abs() < 0.01, "{one} on the adapter, {cpu} on the CPU");
    }

    #[test]
    fn every_side_has_its_ratio() {
        let round = |paths: f64| Round { seconds: 1.0, wall: 1.0, paths, lookups: 1.0, steps: paths, variance: 2.0 };
        let names: Vec<String> = [DEFAULT, TWIN, GLOBAL, EVERY_RAY, THIN, THICK, COLOURED]
            .into_iter()
            .map(str::to_owned)
            .chain(CELLS.map(cell_name))
            .chain(BARE_STEPS.map(bare_name))
            .collect();
        let sides: Vec<Side> =
            (1..).zip(&names).map(|(i, name)| Side { name: name.clone(), rounds: vec![round(f64::from(i))] }).collect();
        let ratios = ratios(&sides, 1.5);
        let value = |start: &str| ratios.iter().find(|r| r.name.starts_with(start)).expect("listed").value.median;
        // Sides count up from 1 in the order of `names`; the last cells are the fastest.
        assert_eq!(value("segments/s: default ÷ lookups/s: bare, 2"), 1.0 / 13.0);
        assert_eq!(value("lookups/s: bare, 2"), 13.0 / 2.0);
        let aims: Vec<f64> = ratios.iter().filter_map(|r| r.target).collect();
        let all = [STEPS_OVER_LOOKUPS, 1.5, DEFAULT_OVER_GLOBAL, DEFAULT_OVER_CELLS, SUN_EFFICIENCY];
        assert_eq!(aims, all, "each aim once");
        assert_eq!(value("paths/s: default ÷ global"), 1.0 / 3.0);
        assert_eq!(value("paths/s: default ÷ cells of 32"), 1.0 / 11.0);
        assert_eq!(value("1/(variance"), 1.0 / 4.0);
    }
}
