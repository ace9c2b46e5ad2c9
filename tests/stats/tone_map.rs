//! Tone maps of the shader against those of the CPU, which write PNG files.

use nephele::image::tone::ToneMap;
use nephele::scene::{Analytic, Scene};

use super::probe::{self, Probe};
use super::support::{Adapter, Dice, adapter, plant};
use super::*;

/// Half a step of 8 bits would be 2·10⁻³; drivers' logarithms and powers are good to a tenth of that.
const TOLERANCE: f32 = 2e-4;

/// Colours from black to beyond white, and what is no colour.
fn colours() -> Vec<[f32; 3]> {
    let mut dice = Dice::new(17);
    let mut all: Vec<[f32; 3]> = (0..8192)
        .map(|i| {
            let base = dice.between(-18.0, 17.0);
            // Grey, near grey, and any colour.
            let spread = [0.0, 0.3, 6.0][i % 3];
            std::array::from_fn(|_| (base + dice.between(-spread, spread)).exp2() as f32)
        })
        .collect();
    let odd = [0.0, -0.0, -1.0, 1e-30, 1.0, 65504.0, 1e30, f32::INFINITY, f32::NEG_INFINITY, f32::NAN, -f32::NAN];
    for r in odd {
        for g in odd {
            all.push([r, g, 0.18]);
            all.push([0.5, r, g]);
        }
    }
    // Round the ends of the sRGB curve's straight part and of the neutral map's compression.
    all.extend([0.003_130_8f32, 0.08, 0.76, 0.8].iter().flat_map(|&x| [0.999, 1.0, 1.001].map(|k| [x * k; 3])));
    all
}

fn farthest(a: &Adapter, source: &Source, map: ToneMap) -> (f32, [f32; 3]) {
    let mut scene = Scene::default();
    scene.volume.analytic = Analytic::Homogeneous;
    let colours = colours();
    let inputs: Vec<[f32; 4]> = colours.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
    let probe = Probe::new(&a.gpu, &scene);
    let found = probe.run(source, "tone_map", &inputs, inputs.len(), 1, probe::sample(map.index()));
    let mut worst = (0.0, [0.0; 3]);
    for (v, &colour) in found.iter().zip(&colours) {
        let exact = map.apply(colour);
        let off =
            (0..3).map(|c| (v[c] - exact[c]).abs()).fold(0.0, |m: f32, x| if x.is_nan() { 9.0 } else { m.max(x) });
        if off > worst.0 {
            worst = (off, colour);
        }
    }
    worst
}

#[test]
fn tone_maps_are_those_of_the_cpu() {
    let Some(a) = adapter() else { return };
    for &map in ToneMap::ALL {
        let (off, colour) = farthest(&a, &standard(), map);
        eprintln!("{}: {off:e} at {colour:?}", map.name());
        assert!(off < TOLERANCE, "{} is {off:e} off at {colour:?}", map.name());
    }
    let plants = [
        (ToneMap::Linear, "const tone_map_SRGB_GAMMA: f32 = 2.4;", "const tone_map_SRGB_GAMMA: f32 = 2.41;"),
        (ToneMap::Agx, "(-6.868", "(-6.9"),
        (ToneMap::Agx, "0.84247905", "0.8525"),
        (ToneMap::Aces, "0.432951", "0.44"),
        (
            ToneMap::Neutral,
            "const tone_map_NEUTRAL_DESATURATION: f32 = 0.15;",
            "const tone_map_NEUTRAL_DESATURATION: f32 = 0.2;",
        ),
        (
            ToneMap::FalseColour,
            "const tone_map_FALSE_COLOUR_CHROMA: f32 = 0.16;",
            "const tone_map_FALSE_COLOUR_CHROMA: f32 = 0.17;",
        ),
        (
            ToneMap::Linear,
            "vec3f(0.0), bitcast<vec3u>(c) > vec3u(0x7f800000u)",
            "c, bitcast<vec3u>(c) > vec3u(0x7f800000u)",
        ),
    ];
    for (map, from, to) in plants {
        let from = from.trim_start_matches('(');
        let to = to.trim_start_matches('(');
        let (off, _) = farthest(&a, &plant("display/tone_map", from, to).source, map);
        assert!(off > 8.0 * TOLERANCE, "{to} is not seen: {off:e}");
    }
}
