//! How far a picture A is from a reference B.

use super::flip::{self, Flip};
use super::{Image, Layer};

/// Keeps relative errors finite in the dark: added to b² (relMSE) or |b| (MAPE).
const RELATIVE_FLOOR: f64 = 0.01;
/// Side of the tiles whose means are tested, pixels.
pub const TILE: usize = 8;

/// All figures of A against B.
#[derive(Clone, Debug, PartialEq)]
pub struct Comparison {
    /// Mean of (a − b)² over pixels and channels; `None` where no pixel is finite in both.
    pub mse: Option<f64>,
    /// Mean of (a − b)² / (b² + 0.01).
    pub rel_mse: Option<f64>,
    /// Mean of |a − b| / (|b| + 0.01).
    pub mape: Option<f64>,
    /// Sum of a / sum of b for R, G, B; `None` where the sum of b is 0.
    pub energy_ratio: [Option<f64>; 3],
    /// ꟻLIP.
    pub flip: FlipFigures,
    /// Differences of tile means in standard errors, where both pictures know their variance.
    pub z: Option<TileZ>,
    /// Pixels of A and of B with a NaN or infinite channel. Such pixels are left out of all other figures.
    pub non_finite: [u64; 2],
}

/// ꟻLIP over the pixels that are finite in both pictures.
#[derive(Clone, Debug, PartialEq)]
pub struct FlipFigures {
    /// Mean over pixels; `None` without pixels.
    pub mean: Option<f64>,
    /// The greatest of a pixel.
    pub max: f64,
    /// HDR-ꟻLIP: first and last exposure in EV and their number; `None` for LDR-ꟻLIP.
    pub exposures: Option<(f32, f32, u32)>,
}

/// z = (mean a − mean b) / √(variance of both means), per 8×8 tile and channel. Pixels are taken as independent of each
/// other: where pixels share samples (reuse), |z| is too large.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TileZ {
    /// The greatest |z|; infinite where two means without variance differ.
    pub max_abs: f64,
    /// Mean of z²: about 1 where the pictures differ by noise alone.
    pub mean_square: f64,
    /// Tiles times channels with a z.
    pub count: u64,
    /// Tiles times channels without: no variance and no difference, or a variance that is not a number ≥ 0.
    pub unknown: u64,
}

/// Which ꟻLIP suits the pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Range {
    /// Values in [0, 1], as shown: LDR-ꟻLIP.
    Display,
    /// Scene radiance: HDR-ꟻLIP.
    Scene,
}

/// Compares `a` with the reference `b`, which must have the same size. `runs` are the numbers of independent runs whose
/// spread each `variance` layer states (1: it is the variance of the picture's own mean).
pub fn compare(a: &Image, b: &Image, range: Range, runs: [f64; 2]) -> Comparison {
    assert_eq!((a.width, a.height), (b.width, b.height), "pictures of different sizes cannot be compared");
    let finite = |rgb: &[f32; 3]| rgb.iter().all(|x| x.is_finite());
    let good: Vec<bool> = a.rgb().zip(b.rgb()).map(|(a, b)| finite(&a) && finite(&b)).collect();
    let used = good.iter().filter(|good| **good).count() as f64;

    let (mut square, mut relative, mut absolute) = (0.0, 0.0, 0.0);
    let mut energy = [[0.0f64; 3]; 2];
    for ((a, b), _) in a.rgb().zip(b.rgb()).zip(&good).filter(|(_, good)| **good) {
        for c in 0..3 {
            let (a, b) = (f64::from(a[c]), f64::from(b[c]));
            let d = a - b;
            square += d * d;
            relative += d * d / (b * b + RELATIVE_FLOOR);
            absolute += d.abs() / (b.abs() + RELATIVE_FLOOR);
            energy[0][c] += a;
            energy[1][c] += b;
        }
    }
    let mean = |sum: f64| (used > 0.0).then_some(sum / (3.0 * used));
    let z = match (a.layer("variance"), b.layer("variance")) {
        (Some(va), Some(vb)) if va.channels.len() == 3 && vb.channels.len() == 3 => {
            Some(tile_z([a, b], [va, vb], runs, &good))
        }
        _ => None,
    };
    Comparison {
        mse: mean(square),
        rel_mse: mean(relative),
        mape: mean(absolute),
        energy_ratio: std::array::from_fn(|c| (energy[1][c] != 0.0).then(|| energy[0][c] / energy[1][c])),
        flip: flip_figures(a, b, range, &good),
        z,
        non_finite: [a, b].map(|image| image.rgb().filter(|rgb| !finite(rgb)).count() as u64),
    }
}

/// ꟻLIP with pixels that are not finite black in both pictures, and left out of the figures.
fn flip_figures(a: &Image, b: &Image, range: Range, good: &[bool]) -> FlipFigures {
    let [a_rgb, b_rgb] = [a, b]
        .map(|image| image.rgb().zip(good).map(|(rgb, good)| if *good { rgb } else { [0.0; 3] }).collect::<Vec<_>>());
    let width = a.width as usize;
    let Flip { map, exposures } = match range {
        Range::Display => flip::ldr(width, &a_rgb, &b_rgb),
        Range::Scene => flip::hdr(width, &a_rgb, &b_rgb),
    };
    let values = || map.iter().zip(good).filter(|(_, good)| **good).map(|(value, _)| f64::from(*value));
    let count = values().count();
    FlipFigures {
        mean: (count > 0).then(|| values().sum::<f64>() / count as f64),
        max: values().fold(0.0, f64::max),
        exposures,
    }
}

fn tile_z(images: [&Image; 2], variances: [&Layer; 2], runs: [f64; 2], good: &[bool]) -> TileZ {
    let (width, height) = (images[0].width as usize, images[0].height as usize);
    let mut z = TileZ { max_abs: 0.0, mean_square: 0.0, count: 0, unknown: 0 };
    for (tile_y, tile_x) in (0..height).step_by(TILE).flat_map(|y| (0..width).step_by(TILE).map(move |x| (y, x))) {
        let mut difference = [0.0f64; 3];
        let mut variance = [0.0f64; 3];
        for y in tile_y..(tile_y + TILE).min(height) {
            for pixel in (y * width + tile_x..y * width + (tile_x + TILE).min(width)).filter(|pixel| good[*pixel]) {
                for c in 0..3 {
                    let value = |layer: &Layer| f64::from(layer.data[pixel * layer.channels.len() + c]);
                    difference[c] += value(&images[0].layers[0]) - value(&images[1].layers[0]);
                    variance[c] += value(variances[0]) / runs[0] + value(variances[1]) / runs[1];
                }
            }
        }
        // Sums in place of means: the number of pixels cancels.
        for (d, v) in difference.into_iter().zip(variance) {
            if !(v >= 0.0 && v.is_finite()) || (v == 0.0 && d == 0.0) {
                z.unknown += 1;
                continue;
            }
            let value = d / v.sqrt();
            z.count += 1;
            z.max_abs = z.max_abs.max(value.abs());
            z.mean_square += value * value;
        }
    }
    z.mean_square /= z.count.max(1) as f64;
    z
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(rgb: &[[f32; 3]], width: u32) -> Image {
        let data = rgb.iter().flat_map(|p| [p[0], p[1], p[2], 0.0]).collect();
        Image::from_rgba(width, rgb.len() as u32 / width, data)
    }

    fn with_variance(mut image: Image, variance: Vec<f32>) -> Image {
        let channels = ["R", "G", "B"].map(String::from).to_vec();
        image.layers.push(Layer { name: "variance".into(), channels, data: variance });
        image
    }

    #[track_caller]
    fn near(value: Option<f64>, expected: f64) {
        let value = value.expect("a value");
        assert!((value - expected).abs() < 1e-6, "{value} is not {expected}");
    }

    #[test]
    fn errors_are_those_computed_by_hand() {
        let a = image(&[[1.0, 2.0, 0.0], [0.5, 0.0, 3.0]], 2);
        let b = image(&[[1.5, 2.0, 0.0], [0.5, 0.1, 1.0]], 2);
        let found = compare(&a, &b, Range::Scene, [1.0; 2]);
        near(found.mse, (0.25 + 0.01 + 4.0) / 6.0);
        near(found.rel_mse, (0.25 / 2.26 + 0.01 / 0.02 + 4.0 / 1.01) / 6.0);
        near(found.mape, (0.5 / 1.51 + 0.1 / 0.11 + 2.0 / 1.01) / 6.0);
        near(found.energy_ratio[0], 0.75);
        near(found.energy_ratio[1], 2.0 / 2.1);
        near(found.energy_ratio[2], 3.0);
        assert_eq!(found.z, None);
        // B is the reference: the other way round relMSE differs.
        near(compare(&b, &a, Range::Scene, [1.0; 2]).rel_mse, (0.25 / 1.01 + 0.01 / 0.01 + 4.0 / 9.01) / 6.0);
        let black = image(&[[0.0; 3]; 2], 2);
        assert_eq!(compare(&a, &black, Range::Scene, [1.0; 2]).energy_ratio, [None; 3]);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_in_either_and_left_out() {
        let a = image(&[[f32::NAN, 0.0, 0.0], [1.0; 3], [1.0; 3], [3.0; 3]], 2);
        let b = image(&[[1.0; 3], [1.0, f32::INFINITY, 1.0], [1.0, f32::NEG_INFINITY, 1.0], [2.0; 3]], 2);
        let found = compare(&a, &b, Range::Scene, [1.0; 2]);
        assert_eq!(found.non_finite, [1, 2]);
        near(found.mse, 1.0);
        near(found.energy_ratio[1], 1.5);
        assert!(found.flip.mean.is_some_and(|mean| mean > 0.0));
        let none = compare(&image(&[[f32::NAN; 3]; 4], 2), &b, Range::Display, [1.0; 2]);
        assert_eq!((none.mse, none.rel_mse, none.mape, none.flip.mean), (None, None, None, None));
        assert_eq!(none.energy_ratio, [None; 3]);
    }

    #[test]
    fn z_of_noise_is_about_one_and_a_shift_shows() {
        // 64x64 pixels whose deviation from 1 is uniform in ±0.3: variance 0.03.
        let mut state = 1u64;
        let mut noisy = |shift: f32| {
            let pixels: Vec<[f32; 3]> = (0..64 * 64)
                .map(|_| {
                    std::array::from_fn(|_| {
                        state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
                        1.0 + shift + 0.6 * ((state >> 40) as f32 / (1 << 24) as f32 - 0.5)
                    })
                })
                .collect();
            with_variance(image(&pixels, 64), vec![0.03; 64 * 64 * 3])
        };
        let b = noisy(0.0);
        let alike = compare(&noisy(0.0), &b, Range::Scene, [1.0; 2]).z.expect("z");
        assert_eq!((alike.count, alike.unknown), (192, 0));
        assert!((alike.mean_square - 1.0).abs() < 0.4 && alike.max_abs < 4.5, "{alike:?}");
        // The standard error of a tile's difference is sqrt(2 * 0.03 / 64) = 0.0306.
        let shifted = compare(&noisy(0.1), &b, Range::Scene, [1.0; 2]).z.expect("z");
        assert!((shifted.mean_square - 1.0 - (0.1f64 / 0.0306).powi(2)).abs() < 3.0, "{shifted:?}");
    }

    #[test]
    fn z_says_where_it_is_unknown_or_infinite() {
        // Tiles of 8x1 and 1x1 pixels.
        let a = with_variance(image(&[[1.0, 1.0, 2.0]; 9], 9), vec![0.0; 27]);
        let mut variance = vec![0.0; 27];
        variance[25] = f32::NAN;
        let b = with_variance(image(&[[1.0; 3]; 9], 9), variance);
        let z = compare(&a, &b, Range::Scene, [1.0; 2]).z.expect("z");
        assert_eq!((z.count, z.unknown, z.max_abs), (2, 4, f64::INFINITY));
    }
}
