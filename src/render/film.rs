//! The film: sums of each pixel on the adapter, and what they mean on the CPU.

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::readback;
use crate::image::{Image, Layer};

use super::reservoir::Reservoir;

/// Samples in a block sum before it is added to the totals.
pub const BLOCK: u32 = 256;

/// Pairs of words in the counter buffer; the order is that of shaders/film/film.wgsl.
const COUNTERS: usize = 9;

/// Bytes of a paused path; see shaders/film/pause.wgsl.
const PAUSE_BYTES: u64 = 4 * 28;
/// Paused paths at most; there are few.
const PAUSE_SLOTS: u64 = 1 << 17;

/// Events of all rays since the film was cleared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    /// Density lookups of every ray.
    pub lookups: u64,
    /// Null collisions of free flights.
    pub null_collisions: u64,
    /// Real collisions.
    pub real_collisions: u64,
    /// Majorant segments walked.
    pub cell_steps: u64,
    /// Shadow rays.
    pub shadow_rays: u64,
    /// Samples that were not finite and count as black.
    pub nonfinite: u64,
    /// Times that a lane left samples or a path to the next dispatch.
    pub behind: u64,
    /// Lookups of a density above its bound.
    pub violations: u64,
    /// Segments in which an estimator took fewer looks than it wanted, for their number is limited; and paths that were
    /// stuck.
    pub capped: u64,
}

/// Sums of each pixel: four values a pixel in every buffer (the extra layers: eight).
pub struct Film {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Whether the extra layers are kept.
    pub aov: bool,
    /// Radiance and opacity, block sums.
    pub sum: wgpu::Buffer,
    /// Squares and sample counts, block sums.
    pub square: wgpu::Buffer,
    /// Extra layers, block sums.
    pub extra: wgpu::Buffer,
    /// Totals of the three.
    pub totals: [wgpu::Buffer; 3],
    /// Event counters.
    pub counters: wgpu::Buffer,
    /// Cost of each pixel's paths (see [`Sums::cost`]), while it is counted.
    pub cost: wgpu::Buffer,
    /// Whether it is counted.
    pub counts_cost: bool,
    /// Paths that go on in the next dispatch (shaders/film/pause.wgsl).
    pub paused: wgpu::Buffer,
}

/// Bytes of a buffer that nothing is kept in: an extra layer's or cost's one pixel.
const EMPTY: u64 = 32;

impl Film {
    /// A cleared film.
    pub fn new(gpu: &Gpu, width: u32, height: u32, aov: bool) -> Result<Film> {
        let pixels = u64::from(width) * u64::from(height);
        let bytes = 16 * pixels;
        let largest = if aov { 2 * bytes } else { bytes };
        if largest > gpu.limits.max_storage_buffer_binding_size || largest > gpu.limits.max_buffer_size {
            let most = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
            return Err(Error::new(Code::TooLarge, format!("A picture of {width} × {height} pixels is too large."))
                .why(format!("It takes a buffer of {largest} bytes; {} lends {most}.", gpu.info.name))
                .hint("Choose a smaller film.width and film.height."));
        }
        let buffer = |label: &str, size: u64| buffer(gpu, label, size);
        let extra = if aov { 2 * bytes } else { EMPTY };
        let film = Film {
            width,
            height,
            aov,
            sum: buffer("film sum", bytes),
            square: buffer("film square", bytes),
            extra: buffer("film layers", extra),
            totals: [
                buffer("film sum total", bytes),
                buffer("film square total", bytes),
                buffer("layers total", extra),
            ],
            counters: buffer("counters", 8 * COUNTERS as u64),
            cost: buffer("cost", EMPTY),
            counts_cost: false,
            paused: buffer("paused paths", PAUSE_BYTES * pixels.min(PAUSE_SLOTS)),
        };
        gpu.check()?;
        Ok(film)
    }

    /// Begins to count the cost of each pixel, from nothing, or ends it; whether that is a change. The picture stays.
    pub fn count_cost(&mut self, gpu: &Gpu, on: bool) -> Result<bool> {
        if on == self.counts_cost {
            return Ok(false);
        }
        let bytes = 2 * self.sum.size();
        if on && bytes > gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size) {
            return Err(Error::new(Code::TooLarge, "The picture is too large to count what each pixel costs.")
                .why(format!("It takes a buffer of {bytes} bytes, more than {} lends.", gpu.info.name))
                .hint("Choose a smaller film.width and film.height."));
        }
        self.cost = buffer(gpu, "cost", if on { bytes } else { EMPTY });
        gpu.check()?;
        self.counts_cost = on;
        Ok(true)
    }

    /// Block buffers, in the order of `totals`.
    pub fn blocks(&self) -> [&wgpu::Buffer; 3] {
        [&self.sum, &self.square, &self.extra]
    }

    /// Clears everything.
    pub fn clear(&self, encoder: &mut wgpu::CommandEncoder) {
        let more = [&self.counters, &self.cost, &self.paused];
        for buffer in self.blocks().into_iter().chain(&self.totals).chain(more) {
            encoder.clear_buffer(buffer, 0, None);
        }
    }

    /// Bytes on the adapter.
    pub fn bytes(&self) -> u64 {
        self.blocks().into_iter().chain(&self.totals).chain([&self.cost]).map(wgpu::Buffer::size).sum()
    }

    /// The counters so far; blocks.
    pub fn count(&self, gpu: &Gpu) -> Result<Counters> {
        let words: Vec<u64> = readback::values(gpu, &self.counters)?;
        Ok(Counters {
            lookups: words[0],
            null_collisions: words[1],
            real_collisions: words[2],
            cell_steps: words[3],
            shadow_rays: words[4],
            nonfinite: words[5],
            behind: words[6],
            violations: words[7],
            capped: words[8],
        })
    }

    /// The sums so far; blocks.
    pub fn read(&self, gpu: &Gpu) -> Result<Sums> {
        let total = |i: usize| -> Result<Vec<[f64; 4]>> {
            let block: Vec<[f32; 4]> = readback::values(gpu, self.blocks()[i])?;
            let total: Vec<[f32; 4]> = readback::values(gpu, &self.totals[i])?;
            let add = |(a, b): (&[f32; 4], &[f32; 4])| std::array::from_fn(|c| f64::from(a[c]) + f64::from(b[c]));
            Ok(block.iter().zip(&total).map(add).collect())
        };
        let extra = if self.aov { total(2)? } else { Vec::new() };
        let cost = if self.counts_cost { readback::values(gpu, &self.cost)? } else { Vec::new() };
        let (sum, square) = (total(0)?, total(1)?);
        Ok(Sums { width: self.width, height: self.height, sum, square, extra, cost, reservoirs: Vec::new() })
    }
}

fn buffer(gpu: &Gpu, label: &str, size: u64) -> wgpu::Buffer {
    gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size,
        usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// What a pixel's paths did since counting began, as shaders/film/film.wgsl lays it out; the events of [`Counters`].
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Cost {
    /// Density lookups.
    pub lookups: u32,
    /// Majorant segments walked.
    pub steps: u32,
    /// Null collisions of free flights.
    pub nulls: u32,
    /// Real collisions.
    pub reals: u32,
    /// Shadow rays.
    pub shadows: u32,
    /// Lookups of a density above its bound.
    pub violations: u32,
    /// Samples that were not finite.
    pub nonfinite: u32,
    /// Samples that all of this belongs to.
    pub samples: u32,
}

impl Cost {
    /// A count per sample; `None` before the first.
    pub fn per_sample(&self, count: u32) -> Option<f64> {
        (self.samples > 0).then(|| f64::from(count) / f64::from(self.samples))
    }

    /// Share of null collisions among those of free flights; `None` where there were none.
    pub fn null_share(&self) -> Option<f64> {
        let all = f64::from(self.nulls) + f64::from(self.reals);
        (all > 0.0).then(|| f64::from(self.nulls) / all)
    }

    fn add(&mut self, other: &Cost) {
        self.lookups += other.lookups;
        self.steps += other.steps;
        self.nulls += other.nulls;
        self.reals += other.reals;
        self.shadows += other.shadows;
        self.violations += other.violations;
        self.nonfinite += other.nonfinite;
        self.samples += other.samples;
    }
}

/// The film's sums on the CPU.
#[derive(Clone, Debug, PartialEq)]
pub struct Sums {
    /// Pixels in a row.
    pub width: u32,
    /// Rows.
    pub height: u32,
    /// Sums of radiance (RGB) and of samples that met the medium.
    pub sum: Vec<[f64; 4]>,
    /// Sums of squares (RGB) and of samples.
    pub square: Vec<[f64; 4]>,
    /// Two for each pixel where layers are kept: single scattering and first free flights; multiple scattering and
    /// their squares.
    pub extra: Vec<[f64; 4]>,
    /// Cost of each pixel where it is counted.
    pub cost: Vec<Cost>,
    /// What each pixel keeps of paths, where an overlay shows it.
    pub reservoirs: Vec<Reservoir>,
}

impl Sums {
    /// Adds an independent run of the same size; what is kept of paths is that run's.
    pub fn add(&mut self, other: &Sums) {
        let add = |a: &mut Vec<[f64; 4]>, b: &[[f64; 4]]| {
            for (a, b) in a.iter_mut().zip(b) {
                (0..4).for_each(|c| a[c] += b[c]);
            }
        };
        add(&mut self.sum, &other.sum);
        add(&mut self.square, &other.square);
        add(&mut self.extra, &other.extra);
        self.cost.iter_mut().zip(&other.cost).for_each(|(a, b)| a.add(b));
        self.reservoirs.clone_from(&other.reservoirs);
    }

    /// Mean radiance of a pixel.
    pub fn mean(&self, pixel: usize) -> [f64; 3] {
        let n = self.square[pixel][3].max(1.0);
        std::array::from_fn(|c| self.sum[pixel][c] / n)
    }

    /// Variance of a pixel's mean, from the spread of its samples; `None` under two samples.
    pub fn variance(&self, pixel: usize) -> Option<[f64; 3]> {
        let n = self.square[pixel][3];
        let mean = self.mean(pixel);
        (n > 1.0).then(|| std::array::from_fn(|c| (self.square[pixel][c] / n - mean[c] * mean[c]).max(0.0) / (n - 1.0)))
    }

    /// Root mean square over pixels of the standard error, over the picture's mean (channels averaged).
    pub fn relative_error(&self) -> Option<f64> {
        let mut variance = 0.0;
        let mut mean = 0.0;
        for pixel in 0..self.sum.len() {
            variance += self.variance(pixel)?.iter().sum::<f64>() / 3.0;
            mean += self.mean(pixel).iter().sum::<f64>() / 3.0;
        }
        let n = self.sum.len() as f64;
        (mean > 0.0).then(|| (variance / n).sqrt() / (mean / n))
    }

    /// The picture with the layers that `names` lists, for an albedo of `albedo` and `variance` in place of the
    /// samples' own where it is given.
    pub fn image(&self, names: &[Aov], albedo: [f64; 3], variance: Option<&[[f64; 3]]>) -> Image {
        let pixels = self.sum.len();
        let samples = |p: usize| self.square[p][3].max(1.0);
        let rgba = (0..pixels)
            .flat_map(|p| {
                let [r, g, b] = self.mean(p);
                [r, g, b, self.sum[p][3] / samples(p)].map(|x| x as f32)
            })
            .collect();
        let mut image = Image::from_rgba(self.width, self.height, rgba);
        for &name in names {
            let value = |p: usize| -> Vec<f64> {
                let n = samples(p);
                let hits = self.sum[p][3];
                let cost = self.cost.get(p).copied().unwrap_or_default();
                match name {
                    Aov::Transmittance => vec![1.0 - hits / n],
                    Aov::Albedo => albedo.map(|a| a * hits / n).to_vec(),
                    Aov::Samples => vec![self.square[p][3]],
                    Aov::Variance => {
                        variance.map(|v| v[p]).or_else(|| self.variance(p)).unwrap_or([f64::INFINITY; 3]).to_vec()
                    }
                    Aov::Single => (0..3).map(|c| self.extra[2 * p][c] / n).collect(),
                    Aov::Multiple => (0..3).map(|c| self.extra[2 * p + 1][c] / n).collect(),
                    Aov::Depth => {
                        let mean = self.extra[2 * p][3] / hits.max(1.0);
                        let square = self.extra[2 * p + 1][3] / hits.max(1.0);
                        vec![mean, (square - mean * mean).max(0.0).sqrt()]
                    }
                    Aov::Lookups => vec![cost.per_sample(cost.lookups).unwrap_or(0.0)],
                    Aov::Steps => vec![cost.per_sample(cost.steps).unwrap_or(0.0)],
                }
            };
            let channels = name.channels().iter().map(|c| (*c).to_owned()).collect();
            let data = (0..pixels).flat_map(value).map(|x| x as f32).collect();
            image.layers.push(Layer { name: name.name().into(), channels, data });
        }
        image
    }
}

/// An extra layer of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Aov {
    /// Mean transmittance of the camera ray.
    Transmittance,
    /// Mean and spread of the first free flight, scene units.
    Depth,
    /// Albedo of the first collision, times opacity.
    Albedo,
    /// Light that was scattered once.
    Single,
    /// Light that was scattered more often.
    Multiple,
    /// Variance of the pixel's mean.
    Variance,
    /// Samples.
    Samples,
    /// Density lookups per sample.
    Lookups,
    /// Majorant segments walked per sample.
    Steps,
}

impl Aov {
    /// All of them.
    pub const ALL: [Aov; 9] = [
        Aov::Transmittance,
        Aov::Depth,
        Aov::Albedo,
        Aov::Single,
        Aov::Multiple,
        Aov::Variance,
        Aov::Samples,
        Aov::Lookups,
        Aov::Steps,
    ];

    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Aov::Transmittance => "transmittance",
            Aov::Depth => "depth",
            Aov::Albedo => "albedo",
            Aov::Single => "single",
            Aov::Multiple => "multiple",
            Aov::Variance => "variance",
            Aov::Samples => "samples",
            Aov::Lookups => "lookups",
            Aov::Steps => "steps",
        }
    }

    /// Its channels.
    pub fn channels(self) -> &'static [&'static str] {
        match self {
            Aov::Transmittance | Aov::Samples | Aov::Lookups | Aov::Steps => &[""],
            Aov::Depth => &["mean", "spread"],
            _ => &["R", "G", "B"],
        }
    }

    /// Whether the film must keep extra sums for it.
    pub fn needs_sums(self) -> bool {
        matches!(self, Aov::Depth | Aov::Single | Aov::Multiple)
    }

    /// Whether the film must count what each pixel costs for it.
    pub fn needs_cost(self) -> bool {
        matches!(self, Aov::Lookups | Aov::Steps)
    }
}
