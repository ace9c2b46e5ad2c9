//! The self-test: small pictures and probes on an adapter against closed forms, quadrature and one another. It tells
//! whether a driver computes as it should; `nephele doctor --self-test` and the window run the same list.
//!
//! [`CHECKS`] is the list. Each check is run by itself, so that the caller can show progress and stop between two:
//!
//! ```no_run
//! # fn main() -> nephele::error::Result<()> {
//! use nephele::gpu::{device::Gpu, shader::Source};
//! use nephele::render::self_test::CHECKS;
//! let gpu = std::sync::Arc::new(Gpu::headless()?);
//! for check in CHECKS {
//!     let found = check.run(&gpu, &Source::standard())?;
//!     assert!(found.passes(), "{}: {found:?}", check.name);
//! }
//! # Ok(()) }
//! ```
//!
//! A check blocks until the adapter is done, a fraction of a second on two cores without a GPU; a window runs it on a
//! thread.

use std::sync::Arc;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::readback;
use crate::gpu::shader::Source;
use crate::scene::{FreeFlight, MajorantKind, Precision, Scene, Transmittance};

use super::field::Field;
use super::film::Sums;
use super::medium::Medium;
use super::{Renderer, Work, pipeline};

mod media;
mod phase;
mod pictures;
#[cfg(test)]
mod tests;

/// Something that an adapter must get right.
pub struct Check {
    /// A few words; no two checks share them.
    pub name: &'static str,
    /// What passing it shows.
    pub proves: &'static str,
    /// How it is measured.
    pub measure: Measure,
}

/// How a check is measured.
pub enum Measure {
    /// By a function of its own.
    By(fn(&Lab) -> Result<Outcome>),
    /// By a ray through a small cloud, drawn with these settings, against quadrature on the CPU: light from behind it and
    /// single scattering, of both in three channels what is off most.
    Estimator(fn(&mut Scene)),
}

/// What a check found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Outcome {
    /// What the adapter gave.
    pub measured: f64,
    /// What it should give.
    pub expected: f64,
    /// How far off it may be.
    pub within: f64,
}

/// Where checks run.
pub struct Lab {
    /// The adapter.
    pub gpu: Arc<Gpu>,
    /// The shaders.
    pub source: Source,
}

/// Every check. A new estimator is one more `estimator` line: it must be unbiased.
pub const CHECKS: &[Check] = &[
    by("density, 32-bit floats", "the field is interpolated as on the CPU", |lab| media::density(lab, Precision::F32)),
    by("density, as stored by default", "the field is interpolated as on the CPU", |lab| {
        media::density(lab, Precision::Auto)
    }),
    by("phase function, mean sampled cosine", "Henyey–Greenstein angles are drawn by their law", phase::sampled),
    by("phase function, integral", "Henyey–Greenstein values integrate to 1", phase::integral),
    by("phase function, mean cosine", "Henyey–Greenstein values point forward by g", phase::mean_cosine),
    by("daylight on a white floor", "samples of sky and sun carry their light", pictures::daylight),
    by("transmittance of depth 1", "free flights are exponential", pictures::transmittance),
    by("single scattering, sun at the side", "shadow rays are attenuated", pictures::side),
    by("single scattering, sun behind", "directions have the right sign", pictures::behind),
    by("single scattering, sun in front", "directions have the right sign", pictures::in_front),
    by("single scattering, point light", "nearby light falls with the square", pictures::point),
    by("white furnace, worst tile", "no light is lost or made", pictures::white_furnace),
    by("white furnace by light samples", "samples of lights and angles add up to all light", pictures::sampled_furnace),
    by("layer of coloured albedo", "paths of many bounces carry their colour", pictures::layer),
    by("coloured extinction", "each channel is the grey picture of its own extinction", pictures::extinction),
    by("grid against global majorant", "bounds of the density do not change a picture", media::majorants),
    estimator("cloud, default settings", |_| {}),
    estimator("cloud, global majorant", |s| s.tracking.majorant = MajorantKind::Global),
    estimator("cloud, coloured extinction", |s| s.medium.extinction.0 = [1.0, 0.7, 0.4]),
    estimator("cloud, weighted delta", |s| s.tracking.free_flight = FreeFlight::WeightedDelta),
    estimator("cloud, decomposition", |s| s.tracking.free_flight = FreeFlight::Decomposition),
    estimator("cloud, weighted decomposition", |s| s.tracking.free_flight = FreeFlight::WeightedDecomposition),
    estimator("cloud, spectral tracking with history", |s| s.tracking.free_flight = FreeFlight::SpectralHistory),
    estimator("cloud, regular tracking", |s| s.tracking.free_flight = FreeFlight::Regular),
    estimator("cloud, residual ratio", |s| s.tracking.transmittance = Transmittance::ResidualRatio),
    estimator("cloud, delta shadows", |s| s.tracking.transmittance = Transmittance::Delta),
    estimator("cloud, next flight", |s| s.tracking.transmittance = Transmittance::NextFlight),
    estimator("cloud, unbiased ray marching", |s| s.tracking.transmittance = Transmittance::UnbiasedRayMarching),
    estimator("cloud, telescoping", |s| s.tracking.transmittance = Transmittance::Telescoping),
    estimator("cloud, power series", |s| s.tracking.transmittance = Transmittance::PowerSeries),
    estimator("cloud, regular shadows", |s| s.tracking.transmittance = Transmittance::Regular),
    estimator("cloud, kd-tree", |s| s.tracking.majorant = MajorantKind::KdTree),
    estimator("cloud, hierarchy", |s| s.tracking.majorant = MajorantKind::Hierarchy),
    by("pixels changed by slicing the work", "the same samples give the same bits", pictures::slicing),
];

const fn by(name: &'static str, proves: &'static str, measure: fn(&Lab) -> Result<Outcome>) -> Check {
    Check { name, proves, measure: Measure::By(measure) }
}

const fn estimator(name: &'static str, settings: fn(&mut Scene)) -> Check {
    Check { name, proves: "voxels attenuate and scatter as quadrature says", measure: Measure::Estimator(settings) }
}

impl Check {
    /// Runs it on `gpu` with the shaders of `source`; blocks. An error where it could not be measured.
    pub fn run(&self, gpu: &Arc<Gpu>, source: &Source) -> Result<Outcome> {
        let lab = Lab { gpu: gpu.clone(), source: source.clone() };
        match self.measure {
            Measure::By(measure) => measure(&lab),
            Measure::Estimator(settings) => media::estimator(&lab, settings),
        }
    }
}

/// Standard errors that a measurement by chance may be off: one in two million runs is.
const SIGMAS: f64 = 5.0;
/// Share of the expected value that chance may excuse at most, so that noise hides no error.
const EXCUSED: f64 = 0.03;
/// Relative error that sums of 32-bit floats leave.
const ROUNDING: f64 = 1e-5;

impl Outcome {
    /// Whether it is as it should be; never where it is not a number.
    pub fn passes(&self) -> bool {
        (self.measured - self.expected).abs() <= self.within
    }

    /// For a mean with its standard error.
    fn by_chance((measured, error): (f64, f64), expected: f64) -> Outcome {
        let within = (SIGMAS * error).min(EXCUSED * expected.abs()) + ROUNDING * expected.abs();
        Outcome { measured, expected, within }
    }

    /// For two independent means of the same.
    fn of_two((measured, a): (f64, f64), (expected, b): (f64, f64)) -> Outcome {
        Outcome::by_chance((measured, a.hypot(b)), expected)
    }

    /// How far off, in units of what is allowed.
    fn excess(&self) -> f64 {
        let off = (self.measured - self.expected).abs();
        if off.is_nan() { f64::INFINITY } else { off / self.within.max(f64::MIN_POSITIVE) }
    }

    /// The one that is off most.
    fn worst(all: impl IntoIterator<Item = Outcome>) -> Outcome {
        let worst = all.into_iter().max_by(|a, b| a.excess().total_cmp(&b.excess()));
        worst.expect("there is at least one")
    }
}

/// Everything in one pass where that is allowed.
const WHOLE: Work = Work { samples: u32::MAX, groups: u32::MAX };

impl Lab {
    /// A renderer for `scene`, on `field` where it is given.
    fn renderer(&self, scene: &Scene, field: Option<Field>) -> Result<Renderer> {
        let field = field.map_or_else(|| Field::load(&scene.volume), Ok)?;
        let medium = Medium::new(&self.gpu, Arc::new(field), scene)?;
        let size = (scene.film.width, scene.film.height);
        Renderer::new(self.gpu.clone(), self.source.clone(), scene, medium, size, false)
    }

    /// The sums of `samples` for each pixel, in pieces of `work`.
    fn draw_in(&self, scene: &Scene, samples: u32, work: Work) -> Result<Sums> {
        let mut renderer = self.renderer(scene, None)?;
        while renderer.progress().samples < samples {
            let left = samples - renderer.progress().samples;
            renderer.submit(Work { samples: work.samples.min(left), groups: work.groups })?;
        }
        let sums = renderer.sums()?;
        let counters = renderer.film.count(&self.gpu)?;
        let whole = sums.square.iter().all(|s| s[3] == f64::from(samples));
        if counters.nonfinite > 0 || !whole {
            let why = format!("{} samples are not finite; all are there: {whole}.", counters.nonfinite);
            return Err(Error::new(Code::Failed, "A picture of the self-test is not whole.").why(why));
        }
        Ok(sums)
    }

    fn draw(&self, scene: &Scene, samples: u32) -> Result<Sums> {
        self.draw_in(scene, samples, WHOLE)
    }
}

/// Mean of a channel over the picture, and its standard error.
fn mean(sums: &Sums, channel: usize) -> (f64, f64) {
    let n = sums.sum.len() as f64;
    let mean = (0..sums.sum.len()).map(|p| sums.mean(p)[channel]).sum::<f64>() / n;
    let variance = (0..sums.sum.len()).filter_map(|p| sums.variance(p)).map(|v| v[channel]).sum::<f64>() / (n * n);
    (mean, variance.sqrt())
}

/// Mean of independent values, and its standard error.
fn mean_of(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (n, sum, square) = values.fold((0.0, 0.0, 0.0), |(n, s, q), x| (n + 1.0, s + x, q + x * x));
    let mean = sum / n;
    (mean, ((square / n - mean * mean).max(0.0) / (n - 1.0)).sqrt())
}

/// Runs the kernel `shaders/probe/probe_{kernel}.wgsl` on the renderer's medium, lights and parameters: `outputs` values
/// from `inputs`, `each` of them by one invocation. Blocks.
fn probe(renderer: &Renderer, kernel: &str, inputs: &[[f32; 4]], outputs: usize, each: usize) -> Result<Vec<[f32; 4]>> {
    use wgpu::util::DeviceExt;
    /// Threads of a workgroup of every probe.
    const GROUP: usize = 64;
    let gpu = &renderer.gpu;
    let values = pipeline::values_layout(gpu);
    let layouts = &renderer.layouts;
    let medium = layouts.medium(renderer.medium.filterable(gpu));
    let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
        label: Some("probe"),
        bind_group_layouts: &[Some(&layouts.frame), Some(medium), Some(&layouts.lights), Some(&values)],
        immediate_size: 0,
    });
    let (file, entry) = (format!("probe/probe_{kernel}"), format!("probe_{kernel}_main"));
    let kernel = pipeline::compute(gpu, &renderer.source, &file, &entry, &renderer.variant(), Some(&layout))?;
    let input = gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some("probe"),
        contents: bytemuck::cast_slice(inputs),
        usage: wgpu::BufferUsages::STORAGE,
    });
    let output = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("probe"),
        size: size_of::<[f32; 4]>() as u64 * outputs as u64,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
        mapped_at_creation: false,
    });
    let values = pipeline::group(gpu, &values, &[&input, &output]);
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&kernel);
        let groups = [&renderer.frame_group, &renderer.medium_group, &renderer.light_group, &values];
        (0..).zip(groups).for_each(|(i, group)| pass.set_bind_group(i, group, &[]));
        pass.dispatch_workgroups((outputs / each).div_ceil(GROUP) as u32, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
    readback::values(gpu, &output)
}
