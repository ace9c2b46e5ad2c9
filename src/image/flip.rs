//! ꟻLIP: how strongly a person notices the difference of two pictures when flipping between them, per pixel in [0, 1].
//!
//! LDR-ꟻLIP after P. Andersson, J. Nilsson, T. Akenine-Möller et al., "FLIP: A Difference Evaluator for Alternating
//! Images", HPG 2020; HDR-ꟻLIP after P. Andersson, J. Nilsson, P. Shirley, T. Akenine-Möller, "Visualizing Errors in
//! Rendered High Dynamic Range Images", Eurographics 2021. Names follow the papers. Own implementation; tests compare it
//! with values of the authors' program (`flip-evaluator` 1.7).

use rayon::prelude::*;

/// Pixels per degree of visual angle: 0.7 m in front of a 0.7 m wide, 3840 pixels wide display.
const PIXELS_PER_DEGREE: f32 = 67.020_64;

/// Contrast sensitivity of the eye as sums of Gaussians `a √(π/b) exp(−π² r²/b)`, r in degrees (2020, table 1): (a, b).
const CSF_ACHROMATIC: [(f32, f32); 1] = [(1.0, 0.0047)];
const CSF_RED_GREEN: [(f32, f32); 1] = [(1.0, 0.0053)];
const CSF_BLUE_YELLOW: [(f32, f32); 2] = [(34.1, 0.04), (13.5, 0.025)];
/// The widest b: all kernels have its radius, three standard deviations.
const CSF_WIDEST: f32 = 0.04;

/// Exponent of the colour difference (q_c).
const COLOUR_EXPONENT: f32 = 0.7;
/// Differences up to this part of the greatest (p_c) …
const KNEE_INPUT: f32 = 0.4;
/// … are spread over this part of the result (p_t).
const KNEE_OUTPUT: f32 = 0.95;
/// Width of the feature detectors, degrees (w).
const FEATURE_WIDTH: f32 = 0.082;
/// Exponent of the feature difference (q_f).
const FEATURE_EXPONENT: f32 = 0.5;

/// HDR: the tone map, a fit to ACES with its exposure folded in: `(k0 x² + k1 x + k2) / (k3 x² + k4 x + k5)`.
const TONE_MAP: [f32; 6] = [0.6 * 0.6 * 2.51, 0.6 * 0.03, 0.0, 0.6 * 0.6 * 2.43, 0.6 * 0.59, 0.14];
/// HDR: exposures run from where the brightest pixel to where the median pixel reaches this tone-mapped value.
const EXPOSURE_TARGET: f32 = 0.85;

/// The rows of linear Rec.709 to XYZ, exact for the sRGB primaries and D65.
const XYZ_FROM_RGB: [[f32; 3]; 3] = [
    [0.412_390_8, 0.357_584_33, 0.180_480_8],
    [0.212_639, 0.715_168_65, 0.072_192_32],
    [0.019_330_819, 0.119_194_78, 0.950_532_14],
];
/// The rows of its inverse.
const RGB_FROM_XYZ: [[f32; 3]; 3] = [
    [3.240_97, -1.537_383_2, -0.498_610_76],
    [-0.969_243_65, 1.875_967_5, 0.041_555_06],
    [0.055_630_08, -0.203_976_96, 1.056_971_5],
];

/// A map of differences and how it was made.
#[derive(Clone, Debug, PartialEq)]
pub struct Flip {
    /// The difference of every pixel in [0, 1], rows from the top.
    pub map: Vec<f32>,
    /// The exposures (EV) of HDR-ꟻLIP: first, last, and how many; `None` for LDR-ꟻLIP.
    pub exposures: Option<(f32, f32, u32)>,
}

/// LDR-ꟻLIP of two pictures of linear Rec.709 in [0, 1] (values outside are clipped), rows from the top.
pub fn ldr(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Flip {
    let clip = |image: &[[f32; 3]]| image.iter().map(|rgb| rgb.map(|x| x.clamp(0.0, 1.0))).collect::<Vec<_>>();
    Flip { map: difference(width, &clip(test), &clip(reference)), exposures: None }
}

/// HDR-ꟻLIP of two pictures of linear Rec.709, finite: the greatest LDR-ꟻLIP over the exposures that show the
/// reference's range.
pub fn hdr(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Flip {
    let (start, stop) = exposure_range(reference);
    let count = (stop - start).ceil().max(2.0) as u32;
    let step = (stop - start) / (count - 1) as f32;
    let mut map = vec![0.0f32; test.len()];
    for index in 0..count {
        let gain = (start + step * index as f32).exp2();
        let expose = |image: &[[f32; 3]]| image.iter().map(|rgb| rgb.map(|x| tone_map(x * gain))).collect::<Vec<_>>();
        for (most, here) in map.iter_mut().zip(difference(width, &expose(test), &expose(reference))) {
            *most = most.max(here);
        }
    }
    Flip { map, exposures: Some((start, stop, count)) }
}

/// The exposures at which the brightest and the median pixel reach [`EXPOSURE_TARGET`].
fn exposure_range(reference: &[[f32; 3]]) -> (f32, f32) {
    let [k0, k1, k2, k3, k4, k5] = TONE_MAP;
    let (a, b, c) = (k0 - k3 * EXPOSURE_TARGET, k1 - k4 * EXPOSURE_TARGET, k2 - k5 * EXPOSURE_TARGET);
    let target = (-b + (b * b - 4.0 * a * c).sqrt()) / (2.0 * a);
    let mut luminance: Vec<f32> = reference.iter().map(|rgb| dot(XYZ_FROM_RGB[1], *rgb)).collect();
    luminance.sort_unstable_by(f32::total_cmp);
    let ev = |luminance: f32| (target / luminance.clamp(f32::EPSILON, f32::MAX)).log2();
    (ev(luminance[luminance.len() - 1]), ev(luminance[luminance.len() / 2]))
}

fn tone_map(x: f32) -> f32 {
    // Beyond this the curve is flat and squares would overflow.
    const FLAT: f32 = 1e6;
    let [k0, k1, k2, k3, k4, k5] = TONE_MAP;
    let x = x.clamp(0.0, FLAT);
    (((k0 * x + k1) * x + k2) / ((k3 * x + k4) * x + k5)).clamp(0.0, 1.0)
}

/// LDR-ꟻLIP of values in [0, 1].
fn difference(width: usize, test: &[[f32; 3]], reference: &[[f32; 3]]) -> Vec<f32> {
    let (test, reference) = (Seen::of(width, test), Seen::of(width, reference));
    let hyab_max = hyab(hunt_lab([0.0, 1.0, 0.0]), hunt_lab([0.0, 0.0, 1.0])).powf(COLOUR_EXPONENT);
    let knee = KNEE_INPUT * hyab_max;
    (0..test.lab.len())
        .into_par_iter()
        .map(|i| {
            let colour = hyab(test.lab[i], reference.lab[i]).powf(COLOUR_EXPONENT);
            let colour = match colour < knee {
                true => colour * KNEE_OUTPUT / knee,
                false => KNEE_OUTPUT + (colour - knee) / (hyab_max - knee) * (1.0 - KNEE_OUTPUT),
            };
            let edge = (test.edges[i] - reference.edges[i]).abs();
            let point = (test.points[i] - reference.points[i]).abs();
            let feature = (edge.max(point) * std::f32::consts::FRAC_1_SQRT_2).powf(FEATURE_EXPONENT);
            colour.powf(1.0 - feature.min(1.0)).clamp(0.0, 1.0)
        })
        .collect()
}

/// A picture as the eye takes it in.
struct Seen {
    /// Hunt-adjusted CIELAB of the picture blurred by the contrast sensitivity.
    lab: Vec<[f32; 3]>,
    /// Strength of edges.
    edges: Vec<f32>,
    /// Strength of points.
    points: Vec<f32>,
}

impl Seen {
    fn of(width: usize, rgb: &[[f32; 3]]) -> Seen {
        // Opponent space YCxCz; Y here is the relative luminance, without the linear map 116 Y − 16.
        let opponent: Vec<[f32; 3]> = rgb
            .par_iter()
            .map(|rgb| {
                let [x, y, z] = relative_xyz(*rgb);
                [y, x - y, y - z]
            })
            .collect();
        let plane = |c: usize| opponent.iter().map(|v| v[c]).collect::<Vec<f32>>();
        let luminance = plane(0);
        let y = contrast_filter(width, &luminance, &CSF_ACHROMATIC);
        let cx = contrast_filter(width, &plane(1), &CSF_RED_GREEN);
        let cz = contrast_filter(width, &plane(2), &CSF_BLUE_YELLOW);
        let lab = (0..rgb.len())
            .into_par_iter()
            .map(|i| {
                let white = relative_white();
                let xyz = [(cx[i] + y[i]) * white[0], y[i] * white[1], (y[i] - cz[i]) * white[2]];
                hunt_lab(RGB_FROM_XYZ.map(|row| dot(row, xyz).clamp(0.0, 1.0)))
            })
            .collect();
        let (edges, points) = features(width, &luminance);
        Seen { lab, edges, points }
    }
}

/// Blurs by a normalised sum of Gaussians.
fn contrast_filter(width: usize, plane: &[f32], csf: &[(f32, f32)]) -> Vec<f32> {
    use std::f32::consts::PI;
    let radius = (3.0 * (CSF_WIDEST / (2.0 * PI * PI)).sqrt() * PIXELS_PER_DEGREE).ceil() as i32;
    let kernels: Vec<Vec<f32>> = csf
        .iter()
        .map(|(_, b)| {
            let taps = (-radius..=radius).map(|i| i as f32 / PIXELS_PER_DEGREE);
            taps.map(|r| (-PI * PI * r * r / b).exp()).collect()
        })
        .collect();
    // A two-dimensional Gaussian is a product; its sum is the square of the row's.
    let amounts: Vec<f32> =
        csf.iter().zip(&kernels).map(|((a, b), k)| a * (PI / b).sqrt() * k.iter().sum::<f32>().powi(2)).collect();
    let total: f32 = amounts.iter().sum();
    let mut sum = vec![0.0; plane.len()];
    for (kernel, amount) in kernels.iter().zip(&amounts) {
        let norm: f32 = kernel.iter().sum();
        let kernel: Vec<f32> = kernel.iter().map(|k| k / norm).collect();
        let blurred = columns(width, &rows(width, plane, &kernel), &kernel);
        sum.iter_mut().zip(blurred).for_each(|(s, v)| *s += v * amount / total);
    }
    sum
}

/// Strengths of edges and points: first and second derivatives of a Gaussian along both axes.
fn features(width: usize, luminance: &[f32]) -> (Vec<f32>, Vec<f32>) {
    let deviation = 0.5 * FEATURE_WIDTH * PIXELS_PER_DEGREE;
    let radius = (3.0 * deviation).ceil() as i32;
    let taps = |f: &dyn Fn(f32, f32) -> f32| -> Vec<f32> {
        let raw: Vec<f32> =
            (-radius..=radius).map(|i| f(i as f32, (-(i * i) as f32 / (2.0 * deviation * deviation)).exp())).collect();
        // Positive weights sum to 1, negative ones to −1.
        let positive: f32 = raw.iter().filter(|w| **w > 0.0).sum();
        let negative: f32 = -raw.iter().filter(|w| **w < 0.0).sum::<f32>();
        raw.iter()
            .map(|w| {
                if *w > 0.0 {
                    w / positive
                } else if *w < 0.0 {
                    w / negative
                } else {
                    0.0
                }
            })
            .collect()
    };
    let gauss = taps(&|_, g| g);
    let strength = |derivative: &[f32]| -> Vec<f32> {
        let along_x = columns(width, &rows(width, luminance, derivative), &gauss);
        let along_y = columns(width, &rows(width, luminance, &gauss), derivative);
        along_x.iter().zip(&along_y).map(|(x, y)| x.hypot(*y)).collect()
    };
    let edges = strength(&taps(&|x, g| -x * g));
    let points = strength(&taps(&|x, g| (x * x / (deviation * deviation) - 1.0) * g));
    (edges, points)
}

/// Correlates every row with the kernel; pixels beyond the border are those on it.
fn rows(width: usize, plane: &[f32], kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_exact_mut(width).zip(plane.par_chunks_exact(width)).for_each(|(out, row)| {
        let (first, last) = (row[0], row[width - 1]);
        let mut padded = vec![first; radius];
        padded.extend_from_slice(row);
        padded.resize(width + 2 * radius, last);
        for (tap, weight) in kernel.iter().enumerate() {
            out.iter_mut().zip(&padded[tap..]).for_each(|(o, v)| *o += weight * v);
        }
    });
    result
}

/// Correlates every column with the kernel; pixels beyond the border are those on it.
fn columns(width: usize, plane: &[f32], kernel: &[f32]) -> Vec<f32> {
    let radius = kernel.len() / 2;
    let height = plane.len() / width;
    let mut result = vec![0.0; plane.len()];
    result.par_chunks_exact_mut(width).enumerate().for_each(|(y, out)| {
        for (tap, weight) in kernel.iter().enumerate() {
            let source = (y + tap).saturating_sub(radius).min(height - 1);
            out.iter_mut().zip(&plane[source * width..][..width]).for_each(|(o, v)| *o += weight * v);
        }
    });
    result
}

/// CIELAB of linear Rec.709 with a and b scaled by lightness, as colour matters less in the dark (Hunt).
fn hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    /// CIELAB is linear below the cube of this.
    const DELTA: f32 = 6.0 / 29.0;
    let [x, y, z] = relative_xyz(rgb)
        .map(|t| if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 });
    let lightness = 116.0 * y - 16.0;
    [lightness, 0.01 * lightness * 500.0 * (x - y), 0.01 * lightness * 200.0 * (y - z)]
}

/// HyAB distance: city block in lightness, Euclidean in colour.
fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + (p[1] - q[1]).hypot(p[2] - q[2])
}

/// XYZ relative to white.
fn relative_xyz(rgb: [f32; 3]) -> [f32; 3] {
    let white = relative_white();
    std::array::from_fn(|i| dot(XYZ_FROM_RGB[i], rgb) / white[i])
}

/// XYZ of white (1, 1, 1).
fn relative_white() -> [f32; 3] {
    XYZ_FROM_RGB.map(|row| dot(row, [1.0; 3]))
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDTH: usize = 48;
    const HEIGHT: usize = 32;

    /// Uniform numbers of a linear congruential generator, so that the authors' program can be given the same pictures.
    fn noise() -> impl FnMut() -> f32 {
        let mut state = 1u32;
        move || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        }
    }

    fn picture(mut value: impl FnMut(f32, f32) -> [f32; 3]) -> Vec<[f32; 3]> {
        (0..WIDTH * HEIGHT).map(|i| value((i % WIDTH) as f32, (i / WIDTH) as f32)).collect()
    }

    fn ramp(x: f32, y: f32) -> [f32; 3] {
        let (w, h) = (WIDTH as f32, HEIGHT as f32);
        [x / w, y / h, (x + y) / (w + h)]
    }

    fn mean(flip: &Flip) -> f32 {
        flip.map.iter().sum::<f32>() / flip.map.len() as f32
    }

    fn max(flip: &Flip) -> f32 {
        flip.map.iter().copied().fold(0.0, f32::max)
    }

    #[track_caller]
    fn near(value: f32, expected: f32) {
        assert!((value - expected).abs() < 5e-5, "{value} is not {expected}");
    }

    // Expected values: flip_evaluator.evaluate(reference, test, "LDR" or "HDR", inputsRGB=False, applyMagma=False) of the
    // Python package flip-evaluator 1.7 on the same 48x32 pictures.

    #[test]
    fn ldr_equals_the_authors_program_on_noise() {
        let mut random = noise();
        let reference = picture(ramp);
        let test = picture(|x, y| ramp(x, y).map(|v| (v + 0.2 * (random() - 0.5)).clamp(0.0, 1.0)));
        let flip = ldr(WIDTH, &test, &reference);
        near(mean(&flip), 0.113_263_12);
        near(max(&flip), 0.367_745_3);
    }

    #[test]
    fn ldr_equals_the_authors_program_on_an_edge() {
        let reference = picture(ramp);
        let inside = |x: f32, y: f32| (20.0..25.0).contains(&x) && (10.0..14.0).contains(&y);
        let test = picture(|x, y| if inside(x, y) { [1.0, 0.0, 0.0] } else { ramp(x, y) });
        let flip = ldr(WIDTH, &test, &reference);
        near(mean(&flip), 0.027_785_29);
        near(flip.map[12 * WIDTH + 22], 0.911_392_6);
        near(flip.map[8 * WIDTH + 18], 0.120_261_06);
        assert_eq!(flip.map[0], 0.0);
    }

    #[test]
    fn hdr_equals_the_authors_program() {
        let radiance = |x: f32, y: f32| ramp(x, y).map(|v| (4.0 * v).powi(3) * 0.3);
        for (dark_rows, expected_mean, expected_max, start, stop, count) in [
            (0.0, 0.080_281_93, 0.266_28, -3.054_306_3, -0.606_784_76, 3),
            (20.0, 0.037_012_41, 0.219_317_6, -3.054_306_3, 24.083_298, 28),
        ] {
            let mut random = noise();
            let reference = picture(|x, y| if y < dark_rows { [0.0; 3] } else { radiance(x, y) });
            let mut pixels = reference.iter();
            let test = picture(|_, _| pixels.next().expect("as many pixels").map(|v| v * (0.75 + 0.5 * random())));
            let flip = hdr(WIDTH, &test, &reference);
            near(mean(&flip), expected_mean);
            near(max(&flip), expected_max);
            let (first, last, exposures) = flip.exposures.expect("HDR");
            assert!((first - start).abs() < 1e-3 && (last - stop).abs() < 1e-3, "{first} {last}");
            assert_eq!(exposures, count);
        }
    }

    #[test]
    fn equal_pictures_differ_by_nothing_and_pure_colours_by_most() {
        let all = |rgb: [f32; 3]| picture(|_, _| rgb);
        assert_eq!(max(&ldr(WIDTH, &picture(ramp), &picture(ramp))), 0.0);
        assert_eq!(max(&hdr(WIDTH, &picture(ramp), &picture(ramp))), 0.0);
        // Green against blue defines 1; black against white is a little less.
        near(mean(&ldr(WIDTH, &all([0.0, 1.0, 0.0]), &all([0.0, 0.0, 1.0]))), 1.0);
        near(mean(&ldr(WIDTH, &all([0.0; 3]), &all([1.0; 3]))), 0.967_399_1);
        // Order does not matter to LDR.
        near(mean(&ldr(WIDTH, &all([1.0; 3]), &all([0.0; 3]))), 0.967_399_1);
    }

    #[test]
    fn any_size_and_brightness_stays_in_range() {
        for (width, pixels) in [(1, 1), (1, 7), (7, 7), (3, 9)] {
            let dark = vec![[0.0; 3]; pixels];
            let bright = vec![[f32::MAX, 1e30, 0.0]; pixels];
            for flip in [hdr(width, &bright, &dark), hdr(width, &dark, &bright), ldr(width, &bright, &dark)] {
                assert!(flip.map.iter().all(|v| (0.0..=1.0).contains(v)), "{:?}", flip.map);
            }
        }
    }
}
