//! Figures of frames against a reference, with their spread over seeds.

use crate::render::film::{Counters, Sums};

/// Keeps relative errors finite in the dark, as in `compare`.
const FLOOR: f64 = 0.01;
/// Share of the worst pixels that the robust error leaves out.
const WORST: f64 = 0.01;

/// Mean radiance of all pixels.
pub type Frame = Vec<[f32; 3]>;

/// The frame that a film holds.
pub fn frame(sums: &Sums) -> Frame {
    (0..sums.sum.len()).map(|p| sums.mean(p).map(|x| x as f32)).collect()
}

/// A figure and its standard error over seeds; that is not a number where there is one seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// Of all seeds.
    pub value: f64,
    /// Standard error.
    pub error: f64,
}

/// `figure` of all of `count` seeds, and its error from what it is without each in turn (the jackknife). `figure` is told
/// which one to leave out.
pub fn jackknife(count: usize, figure: impl Fn(Option<usize>) -> f64) -> Estimate {
    let without: Vec<f64> = (0..count).map(|i| figure(Some(i))).collect();
    let n = count as f64;
    let mean = without.iter().sum::<f64>() / n;
    let spread: f64 = without.iter().map(|x| (x - mean) * (x - mean)).sum();
    let error = if count > 1 { ((n - 1.0) / n * spread).sqrt() } else { f64::NAN };
    Estimate { value: figure(None), error }
}

/// Mean of `values` without the one of that number.
pub fn mean_without(values: &[f64], left_out: Option<usize>) -> f64 {
    let kept = || values.iter().enumerate().filter(|(i, _)| Some(*i) != left_out).map(|(_, x)| x);
    kept().sum::<f64>() / kept().count() as f64
}

/// The truth, as far as it is known.
#[derive(Clone, Debug, PartialEq)]
pub struct Reference {
    /// Radiance of each pixel.
    pub mean: Vec<[f64; 3]>,
    /// How far it is known.
    pub quality: Quality,
}

/// How good a reference is.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Quality {
    /// Samples of each pixel.
    pub samples: u32,
    /// Relative mean squared error of the reference itself, from the spread of its samples.
    pub noise: f64,
    /// The same without its worst pixels.
    pub v99: f64,
    /// Standard error of its energy, relative.
    pub energy_error: f64,
}

impl Reference {
    /// Of independent samples.
    pub fn of(sums: &Sums) -> Reference {
        let pixels = sums.sum.len();
        let mean: Vec<[f64; 3]> = (0..pixels).map(|p| sums.mean(p)).collect();
        let (mut errors, mut variance) = (Vec::with_capacity(pixels), 0.0);
        for (p, b) in mean.iter().enumerate() {
            let of_mean = sums.variance(p).unwrap_or([f64::INFINITY; 3]);
            errors.push(of_mean.into_iter().zip(b).map(|(v, b)| v * weight(*b)).sum::<f64>() / 3.0);
            // Channels of a sample go together.
            variance += of_mean.map(f64::sqrt).iter().sum::<f64>().powi(2);
        }
        let energy: f64 = mean.iter().flatten().sum();
        let samples = sums.square.iter().map(|s| s[3]).fold(f64::INFINITY, f64::min) as u32;
        let energy_error = variance.sqrt() / energy.max(f64::MIN_POSITIVE);
        let [noise, v99] = with_and_without_worst(errors);
        Reference { mean, quality: Quality { samples, noise, v99, energy_error } }
    }

    fn energy(&self) -> f64 {
        self.mean.iter().flatten().sum()
    }
}

fn weight(b: f64) -> f64 {
    1.0 / (b * b + FLOOR)
}

/// Mean of the errors of pixels, and that without the worst.
fn with_and_without_worst(mut errors: Vec<f64>) -> [f64; 2] {
    let mean = |errors: &[f64]| errors.iter().sum::<f64>() / errors.len() as f64;
    let all = mean(&errors);
    errors.sort_by(f64::total_cmp);
    let kept = errors.len() - (WORST * errors.len() as f64).ceil() as usize;
    [all, mean(&errors[..kept.max(1)])]
}

/// What a frame is off by.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Error {
    /// Mean of (a − b)² / (b² + 0.01) over pixels and channels.
    pub rel_mse: f64,
    /// The same without the worst hundredth of the pixels: what a few fireflies do not decide.
    pub v99: f64,
    /// Sum of a over sum of b.
    pub energy: f64,
}

impl Error {
    /// Of `frame` against the reference.
    pub fn of(frame: &Frame, reference: &Reference) -> Error {
        let of_pixel = |(a, b): (&[f32; 3], &[f64; 3])| {
            a.iter().zip(b).map(|(&a, &b)| (f64::from(a) - b).powi(2) * weight(b)).sum::<f64>() / 3.0
        };
        let [rel_mse, v99] = with_and_without_worst(frame.iter().zip(&reference.mean).map(of_pixel).collect());
        let energy = frame.iter().flatten().map(|&a| f64::from(a)).sum::<f64>() / reference.energy();
        Error { rel_mse, v99, energy }
    }
}

/// What one seed of a side gave.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Run {
    /// The last frame but one, and the last, which is judged.
    pub frames: [Frame; 2],
    /// Seconds of a steady frame: CPU time on software adapters, else wall time.
    pub seconds: f64,
    /// Events of the last frame per pixel, in the order of [`EVENTS`].
    pub events: [f64; 4],
}

/// Names of what is counted per pixel and frame.
pub const EVENTS: [&str; 4] = ["lookups", "cell_steps", "shadow_rays", "null_collisions"];

/// Those counts.
pub fn events(c: &Counters, pixels: usize) -> [f64; 4] {
    [c.lookups, c.cell_steps, c.shadow_rays, c.null_collisions].map(|n| n as f64 / pixels as f64)
}

/// Correlation of the errors of the last two frames, over all pixels, channels and seeds, each pixel weighed as in the
/// relative error; and the same without the worst hundredth of the pixels, for one firefly that stays makes it 1. The mean
/// over seeds stands for the truth, which costs both sums the same factor.
pub fn lag(runs: &[Run], reference: &Reference) -> [Estimate; 2] {
    let n = runs.len() as f64;
    let pixels = reference.mean.len();
    // Of each pixel and seed the sums of products over channels: both frames, the first, the second.
    let mut products = vec![[0.0f64; 3]; pixels * runs.len()];
    for (p, products) in products.chunks_mut(runs.len()).enumerate() {
        for c in 0..3 {
            let value = |run: &Run, which: usize| f64::from(run.frames[which][p][c]);
            let means = [0, 1].map(|which| runs.iter().map(|run| value(run, which)).sum::<f64>() / n);
            for (run, sums) in runs.iter().zip(products.iter_mut()) {
                let [a, b] = [0, 1].map(|which| value(run, which) - means[which]);
                for (sum, product) in sums.iter_mut().zip([a * b, a * a, b * b]) {
                    *sum += weight(reference.mean[p][c]) * product;
                }
            }
        }
    }
    let mut order: Vec<usize> = (0..pixels).collect();
    let size = |p: &usize| products[p * runs.len()..][..runs.len()].iter().map(|[_, aa, bb]| aa + bb).sum::<f64>();
    order.sort_by_cached_key(|p| size(p).to_bits());
    let kept = pixels - (WORST * pixels as f64).ceil() as usize;
    [&order[..], &order[..kept.max(1)]].map(|chosen| {
        let column = |i: usize| -> Vec<f64> {
            (0..runs.len()).map(|r| chosen.iter().map(|p| products[p * runs.len() + r][i]).sum()).collect()
        };
        let columns = [0, 1, 2].map(column);
        jackknife(runs.len(), |left_out| {
            let [ab, aa, bb] = [0, 1, 2].map(|i| mean_without(&columns[i], left_out));
            ab / (aa * bb).sqrt()
        })
    })
}

/// Relative mean squared error of one sample, from `sums` of independent ones, against the pooled mean `truth`.
pub fn noise_of_sample(sums: &Sums, truth: &[[f64; 3]]) -> f64 {
    let pixels = sums.sum.len();
    let mut noise = 0.0;
    for (p, b) in truth.iter().enumerate() {
        let of_mean = sums.variance(p).unwrap_or([f64::INFINITY; 3]);
        noise += of_mean.iter().zip(b).map(|(v, b)| v * sums.square[p][3] * weight(*b)).sum::<f64>();
    }
    noise / (3 * pixels) as f64
}

/// Error and cost of one side, seed by seed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Scores {
    /// Relative mean squared errors.
    pub rel_mse: Vec<f64>,
    /// The same without the worst pixels.
    pub v99: Vec<f64>,
    /// Energy over that of the reference.
    pub energy: Vec<f64>,
    /// Seconds.
    pub seconds: Vec<f64>,
}

impl Scores {
    /// Adds a seed.
    pub fn push(&mut self, error: Error, seconds: f64) {
        self.rel_mse.push(error.rel_mse);
        self.v99.push(error.v99);
        self.energy.push(error.energy);
        self.seconds.push(seconds);
    }

    fn count(&self) -> usize {
        self.seconds.len()
    }

    /// Mean of a figure.
    pub fn mean(&self, of: fn(&Scores) -> &Vec<f64>) -> Estimate {
        jackknife(self.count(), |i| mean_without(of(self), i))
    }

    /// Error times time of this side over that of `other`: how many times better the other is at equal time, where this
    /// one's error falls as 1 / time.
    pub fn over(&self, other: &Scores, of: fn(&Scores) -> &Vec<f64>) -> Estimate {
        let cost = |s: &Scores, i| mean_without(of(s), i) * mean_without(&s.seconds, i);
        jackknife(self.count().min(other.count()), |i| cost(self, i) / cost(other, i))
    }

    /// Energy less 1, with the reference's own error.
    pub fn bias(&self, reference: Quality) -> Estimate {
        let energy = self.mean(|s| &s.energy);
        Estimate { value: energy.value - 1.0, error: energy.error.hypot(reference.energy_error) }
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A reference of one grey for all pixels.
    pub fn grey(pixels: usize, value: f64) -> Reference {
        Reference {
            mean: vec![[value; 3]; pixels],
            quality: Quality { samples: 100, noise: 0.001, v99: 0.001, energy_error: 0.0 },
        }
    }

    fn near(a: f64, b: f64) {
        assert!((a - b).abs() < 1e-6 * b.abs().max(1e-3), "{a} {b}");
    }

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = [1.0, 2.0, 4.0, 9.0];
        let e = jackknife(4, |i| mean_without(&values, i));
        let variance = values.iter().map(|x| (x - 4.0f64).powi(2)).sum::<f64>() / 3.0;
        near(e.value, 4.0);
        near(e.error, (variance / 4.0).sqrt());
        assert!(jackknife(1, |_| 3.0).error.is_nan());
    }

    #[test]
    fn errors_follow_their_definitions() {
        // 200 pixels: two are fireflies, the worst hundredth.
        let reference = grey(200, 1.0);
        let mut frame: Frame = vec![[1.1, 1.1, 0.9]; 200];
        frame[3] = [101.0; 3];
        frame[7] = [51.0; 3];
        let e = Error::of(&frame, &reference);
        near(e.v99, 0.01 / 1.01);
        near(e.rel_mse, (198.0 * 0.01 + 100.0 * 100.0 + 50.0 * 50.0) / 200.0 / 1.01);
        near(e.energy, (198.0 * 3.1 + 3.0 * 101.0 + 3.0 * 51.0) / 600.0);
        // In the dark the floor holds.
        near(Error::of(&vec![[0.1; 3]; 4], &grey(4, 0.0)).rel_mse, 1.0);
    }

    #[test]
    fn ratios_are_of_error_times_time() {
        let side = |rel_mse: [f64; 2], seconds: f64| {
            let mut s = Scores::default();
            for r in rel_mse {
                s.push(Error { rel_mse: r, v99: 0.5 * r, energy: 1.01 }, seconds);
            }
            s
        };
        let (a, b) = (side([3.0, 5.0], 1.0), side([1.0, 1.0], 2.0));
        let gain = a.over(&b, |s| &s.rel_mse);
        near(gain.value, 2.0);
        near(gain.error, 0.5);
        near(a.over(&b, |s| &s.v99).value, 2.0);
        near(b.over(&b, |s| &s.rel_mse).value, 1.0);
        let bias = a.bias(Quality { energy_error: 0.003, ..Quality::default() });
        near(bias.value, 0.01);
        near(bias.error, 0.003);
    }

    /// Runs whose second frame shares `share` of the first one's noise.
    pub fn runs(count: usize, pixels: usize, share: f32) -> Vec<Run> {
        let mut state = 1u32;
        let mut random = move || {
            state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
            (state >> 8) as f32 / 8_388_608.0 - 1.0
        };
        (0..count)
            .map(|_| {
                let first: Frame = (0..pixels).map(|_| [0.0; 3].map(|_: f32| 1.0 + 0.1 * random())).collect();
                let other = (1.0 - share * share).sqrt();
                let mut second = |x: f32| 1.0 + share * (x - 1.0) + other * 0.1 * random();
                let last = first.iter().map(|x| x.map(&mut second)).collect();
                Run { frames: [first, last], seconds: 0.5, ..Run::default() }
            })
            .collect()
    }

    #[test]
    fn shared_noise_is_found_by_the_lag() {
        let reference = grey(500, 1.0);
        for share in [0.0, 0.5, 1.0] {
            for lag in lag(&runs(6, 500, share), &reference) {
                assert!((lag.value - f64::from(share)).abs() < 0.05, "{share} {lag:?}");
                assert!(lag.error < 0.05);
            }
        }
        // A firefly that stays.
        let mut runs = runs(6, 500, 0.0);
        runs[2].frames.iter_mut().for_each(|frame| frame[7] = [1000.0; 3]);
        let [all, robust] = lag(&runs, &reference);
        assert!(all.value > 0.99 && robust.value.abs() < 0.05, "{all:?} {robust:?}");
    }

    #[test]
    fn a_reference_knows_its_noise() {
        // Samples 0 and 2 in equal numbers: mean 1, variance of the mean of n of them 1 / (n − 1).
        let sums = Sums {
            width: 2,
            height: 1,
            sum: vec![[10.0; 4]; 2],
            square: vec![[20.0, 20.0, 20.0, 10.0]; 2],
            extra: vec![],
            cost: vec![],
            reservoirs: vec![],
        };
        let reference = Reference::of(&sums);
        near(reference.quality.noise, 1.0 / 9.0 / 1.01);
        near(reference.quality.energy_error, (2.0 * 9.0 / 9.0f64).sqrt() / 6.0);
        assert_eq!(reference.quality.samples, 10);
        near(noise_of_sample(&sums, &reference.mean), 10.0 / 9.0 / 1.01);
        assert_eq!(frame(&sums), vec![[1.0; 3]; 2]);
    }
}
