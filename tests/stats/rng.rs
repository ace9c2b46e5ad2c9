//! The random numbers: their bits, their law, and that no two streams have anything in common.

use nephele::scene::Scene;

use super::probe::Probe;
use super::support::statistics::{chi_square, uniform, z_of};
use super::support::{Adapter, adapter, plant};
use super::*;
use nephele::render::params::Slice;

const PIXELS: usize = 1 << 17;

/// The generator on the CPU, from its description: PCG-RXS-M-XS 32.
struct Twin {
    state: u32,
    increment: u32,
}

fn mix(word: u32) -> u32 {
    let x = ((word >> ((word >> 28) + 4)) ^ word).wrapping_mul(277_803_737);
    (x >> 22) ^ x
}

impl Twin {
    fn new(pixel: u32, sample: u32, seed: u32) -> Twin {
        let step = |word: u32| mix(word.wrapping_mul(747_796_405).wrapping_add(2_891_336_453));
        let c = step(seed ^ step(sample ^ step(pixel)));
        Twin { state: c, increment: (mix(c ^ 0x9e37_79b9) << 1) | 1 }
    }

    fn next(&mut self) -> f32 {
        let old = self.state;
        self.state = old.wrapping_mul(747_796_405).wrapping_add(self.increment);
        (mix(old) >> 8) as f32 / (1 << 24) as f32
    }
}

/// `words` values (three uniform, one exponential) of the stream of each of `pixels` pixels from `first`.
fn draw(a: &Adapter, source: &Source, [first, sample, seed]: [u32; 3], pixels: usize, words: usize) -> Vec<[f32; 4]> {
    let mut scene = Scene::default();
    scene.volume.analytic = nephele::scene::Analytic::Homogeneous;
    scene.integrator.seed = seed;
    let probe = Probe::new(&a.gpu, &scene);
    let slice = Slice { first_group: first, first_sample: sample, samples: words as u32, unused: 0 };
    probe.run(source, "rng", &[], pixels * words, words, slice)
}

fn firsts(a: &Adapter, source: &Source, key: [u32; 3]) -> Vec<[f32; 4]> {
    draw(a, source, key, PIXELS, 1)
}

/// χ² of pairs over 64 × 64 bins.
fn pairs(x: impl Iterator<Item = f32>, y: impl Iterator<Item = f32>) -> f64 {
    const SIDE: usize = 64;
    let mut counts = vec![0.0; SIDE * SIDE];
    let mut n = 0.0;
    let bin = |u: f32| (u * SIDE as f32) as usize;
    for (x, y) in x.zip(y) {
        counts[bin(x) + SIDE * bin(y)] += 1.0;
        n += 1.0;
    }
    chi_square(&counts, &vec![n / (SIDE * SIDE) as f64; SIDE * SIDE], 1)
}

fn checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let mut all: Vec<Check> = Vec::new();
    let mut add = |name: &str, z: f64| all.push((name.to_owned(), z));
    // Long streams: values, successive values at several distances, exponentials.
    let words = 1 << 10;
    let streams = draw(a, source, [77, 3, 9], 256, words);
    let line: Vec<f32> = streams.iter().flat_map(|w| [w[0], w[1], w[2]]).collect();
    add("4096 bins of long streams", uniform(line.iter().map(|&u| f64::from(u)), 4096));
    for lag in [1, 2, 3, 7] {
        add(&format!("pairs at lag {lag}"), pairs(line.iter().copied(), line[lag..].iter().copied()));
    }
    add("mean of long streams", z_of(line.iter().map(|&u| f64::from(u)), 0.5));
    let low = line.iter().map(|&u| f64::from((u * 4096.0).fract()));
    add("the lower bits", uniform(low, 1024));
    let depth = || streams.iter().map(|w| f64::from(w[3]));
    add("mean of exponentials", z_of(depth(), 1.0));
    add("mean square of exponentials", z_of(depth().map(|d| d * d), 2.0));
    add("bins of exponentials", uniform(depth().map(|d| 1.0 - (-d).exp()), 1024));
    // First draws of many streams, alone and against those of neighbours in the picture, in time, in the seed.
    let base = [0, 40, 5];
    let first = firsts(a, source, base);
    for c in 0..3 {
        add(&format!("draw {c} of each pixel"), uniform(first.iter().map(|w| f64::from(w[c])), 1024));
    }
    let neighbours = [
        ("next pixel", [1, 40, 5]),
        ("next row", [1280, 40, 5]),
        ("next sample", [0, 41, 5]),
        ("next seed", [0, 40, 6]),
        ("next pixel, sample before", [1, 39, 5]),
        ("next pixel, next sample", [1, 41, 5]),
        ("next sample, seed before", [0, 41, 4]),
    ];
    for (name, key) in neighbours {
        let other = firsts(a, source, key);
        let x = || first.iter().map(|w| w[0]);
        add(&format!("{name}, first draws"), pairs(x(), other.iter().map(|w| w[0])));
        add(&format!("{name}, second draws"), pairs(first.iter().map(|w| w[1]), other.iter().map(|w| w[1])));
        add(&format!("{name}, draws one apart"), pairs(x(), other.iter().map(|w| w[1])));
        // Common draws, wherever the bins are blind to them.
        let common = first.iter().zip(&other).filter(|(a, b)| a[..3] == b[..3]).count();
        add(&format!("{name}, equal streams"), if common > 0 { 1e3 } else { 0.0 });
    }
    all
}

#[test]
fn streams_are_independent_and_uniform() {
    let Some(a) = adapter() else { return };
    all_hold(&checks(&a, &standard()));
    let plants = [
        ("10 bits", "f32(rng_bits(rng) >> 8u) * 0x1p-24", "f32(rng_bits(rng) >> 22u) * 0x1p-10"),
        ("no sample in the stream", "(sample ^ a)", "(7u ^ a)"),
        ("no seed in the stream", "(seed ^ b)", "(7u ^ b)"),
        ("pixels not mixed", "let a = rng_mix(pixel * 747796405u + 2891336453u);", "let a = pixel;"),
        (
            "uniform to the power of 1.02",
            "return f32(rng_bits(rng) >> 8u) * 0x1p-24;",
            "return pow(f32(rng_bits(rng) >> 8u) * 0x1p-24, 1.02);",
        ),
        ("free flights 2 % too long", "return -log(1.0 - rng_next(rng));", "return -1.02 * log(1.0 - rng_next(rng));"),
    ];
    for (what, from, to) in plants {
        one_sees(what, &checks(&a, &plant("core/rng", from, to).source));
    }
}

#[test]
fn bits_are_those_of_the_generator() {
    let Some(a) = adapter() else { return };
    let key = [12_345, 678, 4_000_000_000];
    let found = draw(&a, &standard(), key, 512, 8);
    for (i, words) in found.chunks(8).enumerate() {
        let mut twin = Twin::new(key[0] + i as u32, key[1], key[2]);
        for word in words {
            assert_eq!(word[..3], [twin.next(), twin.next(), twin.next()], "stream {i}");
            let exact = -(1.0 - f64::from(twin.next())).ln();
            assert!((f64::from(word[3]) - exact).abs() <= 1e-6 + 1e-5 * exact, "{} {exact}", word[3]);
        }
    }
    assert!(found.iter().all(|w| w[..3].iter().all(|u| (0.0..1.0).contains(u)) && w[3] >= 0.0 && w[3].is_finite()));
}
