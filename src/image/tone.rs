//! Display: linear Rec.709 to encoded sRGB by exposure and tone map. The twin of `shaders/display/tone_map.wgsl`, which
//! has the same constants under the same names; a test compares the two texts.
//!
//! Every map takes linear Rec.709 after exposure and gives sRGB-encoded values in [0, 1]. Negative values and NaN count
//! as 0, values above [`MAX_INPUT`] (infinity too) as that.

use crate::scene;
pub use crate::scene::ToneMap;

/// How a picture is shown; never changes the data.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Display {
    /// EV: values are multiplied by 2^exposure.
    pub exposure: f32,
    /// The curve from linear light to the screen.
    pub tone_map: ToneMap,
}

impl Default for Display {
    fn default() -> Display {
        Display { exposure: 0.0, tone_map: ToneMap::Agx }
    }
}

impl Display {
    /// The display that a scene asks for.
    pub fn of(display: &scene::Display) -> Display {
        Display { exposure: display.exposure as f32, tone_map: display.tone_map }
    }

    /// sRGB-encoded values in [0, 1] of linear Rec.709.
    pub fn apply(&self, rgb: [f32; 3]) -> [f32; 3] {
        let gain = self.exposure.exp2();
        self.tone_map.apply(rgb.map(|x| x * gain))
    }

    /// 8-bit sRGB of linear Rec.709, rounded to nearest.
    pub fn apply_8bit(&self, rgb: [f32; 3]) -> [u8; 3] {
        self.apply(rgb).map(|x| (x * 255.0).round() as u8)
    }
}

impl ToneMap {
    /// The first argument of `tone_map_apply` in the shader.
    pub fn index(self) -> u32 {
        self as u32
    }

    /// sRGB-encoded values in [0, 1] of exposed linear Rec.709.
    pub fn apply(self, rgb: [f32; 3]) -> [f32; 3] {
        match self {
            ToneMap::Agx => agx(rgb),
            ToneMap::Neutral => neutral(rgb),
            ToneMap::Aces => aces(rgb),
            ToneMap::Linear => linear(rgb),
            ToneMap::FalseColour => false_colour(rgb),
        }
    }
}

/// Larger inputs count as this: the largest finite half, far above what any map tells from white.
pub const MAX_INPUT: f32 = 65504.0;
/// Luminance of linear Rec.709 (ITU-R BT.709).
pub const LUMINANCE: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// The slope of the straight part of the sRGB curve, IEC 61966-2-1.
const SRGB_SLOPE: f32 = 12.92;
/// Where the straight part ends, linear.
const SRGB_END: f32 = 0.0031308;
/// Offset of the curved part.
const SRGB_OFFSET: f32 = 0.055;
/// Exponent of the curved part.
const SRGB_GAMMA: f32 = 2.4;

/// AgX: the rows of the matrix from Rec.709 into the inset space.
const AGX_INSET: [[f32; 3]; 3] =
    [[0.842_479_05, 0.0784336, 0.07922375], [0.04232824, 0.878_468_6, 0.07916613], [0.04237565, 0.0784336, 0.879_143]];
/// AgX: the rows of its inverse.
const AGX_OUTSET: [[f32; 3]; 3] = [
    [1.196_879, -0.098_020_88, -0.099_029_74],
    [-0.052_896_86, 1.151_903_2, -0.098_961_18],
    [-0.052_971_635, -0.098_043_45, 1.151_073_7],
];
/// AgX: the darkest input, log2.
const AGX_MIN_EV: f32 = -12.47393;
/// AgX: the brightest input, log2.
const AGX_MAX_EV: f32 = 4.026069;
/// AgX: the sigmoid as a polynomial, highest power first.
const AGX_CURVE: [f32; 7] = [15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232];

/// PBR Neutral: reflectance of the base reflection at normal incidence.
const NEUTRAL_F90: f32 = 0.04;
/// PBR Neutral: where the compression begins, before the offset.
const NEUTRAL_START: f32 = 0.8;
/// PBR Neutral: how fast highlights lose their colour.
const NEUTRAL_DESATURATION: f32 = 0.15;

/// ACES: the rows of sRGB → XYZ → D60 → AP1 → saturation of the RRT.
const ACES_INPUT: [[f32; 3]; 3] =
    [[0.59719, 0.35458, 0.04823], [0.07600, 0.90834, 0.01566], [0.02840, 0.13383, 0.83777]];
/// ACES: the rows of saturation of the ODT → XYZ → D65 → sRGB.
const ACES_OUTPUT: [[f32; 3]; 3] =
    [[1.60475, -0.53108, -0.07367], [-0.10208, 1.10813, -0.00605], [-0.00327, -0.07276, 1.07602]];
/// ACES: numerator of the fit, `v (v + a) + b`.
const ACES_NUMERATOR: [f32; 2] = [0.0245786, -0.000090537];
/// ACES: denominator of the fit, `v (a v + b) + c`.
const ACES_DENOMINATOR: [f32; 3] = [0.983729, 0.432951, 0.238081];

/// False colour: middle grey, the centre of the scale.
pub const FALSE_COLOUR_GREY: f32 = 0.18;
/// False colour: stops from the centre to either end of the scale.
pub const FALSE_COLOUR_STOPS: f32 = 8.0;
/// False colour: hue at the dark end, radians in Oklab (blue).
const FALSE_COLOUR_HUE: f32 = 4.607669;
/// False colour: hue gained up to the bright end, radians (through purple, red and orange to yellow).
const FALSE_COLOUR_TURN: f32 = 3.4208453;
/// False colour: the greatest chroma, at the centre; just inside sRGB all along the scale.
const FALSE_COLOUR_CHROMA: f32 = 0.16;
/// Oklab: what a and b add to the cube roots of l, m, s (B. Ottosson, "A perceptual color space", 2020).
const OKLAB_ROOTS: [[f32; 2]; 3] =
    [[0.396_337_78, 0.215_803_76], [-0.105_561_346, -0.063_854_17], [-0.089_484_18, -1.291_485_5]];
/// Oklab: the rows of the matrix from l, m, s to linear sRGB.
const OKLAB_RGB: [[f32; 3]; 3] = [
    [4.076_741_7, -3.307_711_6, 0.230_969_94],
    [-1.268_438, 2.609_757_4, -0.341_319_38],
    [-0.0041960863, -0.703_418_6, 1.707_614_7],
];

/// AgX: inset matrix, log2 between −12.47 and 4.03 (middle grey −10 and +6.5 stops), sigmoid, outset matrix. Sources:
/// T. Sobotka, AgX; B. Wrensch, "Minimal AgX implementation" (2023), the sixth-order fit (mean squared error 3.7·10⁻⁶)
/// without a look. Its result is encoded for a display of exponent 2.2, which is shown as sRGB, as its author does.
pub fn agx(rgb: [f32; 3]) -> [f32; 3] {
    let darkest = AGX_MIN_EV.exp2();
    let curve = multiply(&AGX_INSET, safe(rgb)).map(|x| {
        let t = (x.max(darkest).log2().clamp(AGX_MIN_EV, AGX_MAX_EV) - AGX_MIN_EV) / (AGX_MAX_EV - AGX_MIN_EV);
        AGX_CURVE.iter().fold(0.0, |sum, c| sum * t + c)
    });
    multiply(&AGX_OUTSET, curve).map(|x| x.clamp(0.0, 1.0))
}

/// The Khronos PBR Neutral tone mapper (Khronos ToneMapping repository, specification of 2024): colours below 0.8 are
/// kept but for the base reflection, peaks are compressed towards 1 and lose their colour.
pub fn neutral(rgb: [f32; 3]) -> [f32; 3] {
    let rgb = safe(rgb);
    let lowest = rgb[0].min(rgb[1]).min(rgb[2]);
    let offset = if lowest < 2.0 * NEUTRAL_F90 { lowest - lowest * lowest / (4.0 * NEUTRAL_F90) } else { NEUTRAL_F90 };
    let rgb = rgb.map(|x| x - offset);
    let peak = rgb[0].max(rgb[1]).max(rgb[2]);
    let start = NEUTRAL_START - NEUTRAL_F90;
    if peak < start {
        return linear(rgb);
    }
    let room = 1.0 - start;
    let new_peak = 1.0 - room * room / (peak + room - start);
    let white = 1.0 - 1.0 / (NEUTRAL_DESATURATION * (peak - new_peak) + 1.0);
    linear(rgb.map(|x| x * new_peak / peak * (1.0 - white) + new_peak * white))
}

/// S. Hill's fit of the ACES RRT and sRGB ODT (2016, published in BakingLab by M. Pettineo and D. Neubelt), without an
/// extra exposure factor.
pub fn aces(rgb: [f32; 3]) -> [f32; 3] {
    let fitted = multiply(&ACES_INPUT, safe(rgb)).map(|v| {
        (v * (v + ACES_NUMERATOR[0]) + ACES_NUMERATOR[1])
            / (v * (ACES_DENOMINATOR[0] * v + ACES_DENOMINATOR[1]) + ACES_DENOMINATOR[2])
    });
    linear(multiply(&ACES_OUTPUT, fitted))
}

/// sRGB of values clipped to [0, 1].
pub fn linear(rgb: [f32; 3]) -> [f32; 3] {
    safe(rgb).map(|x| encode_srgb(x.min(1.0)))
}

/// Luminance in stops round middle grey (0.18) as a colour: the scale runs from −8 stops (black) to +8 stops (white).
/// Its lightness in Oklab rises linearly with the stops, so equal steps look equal and prints in grey stay readable,
/// while the hue turns from blue through purple (−4), red (0) and orange (+4) to yellow. Own map.
pub fn false_colour(rgb: [f32; 3]) -> [f32; 3] {
    let rgb = safe(rgb);
    let luminance = LUMINANCE[0] * rgb[0] + LUMINANCE[1] * rgb[1] + LUMINANCE[2] * rgb[2];
    let darkest = FALSE_COLOUR_GREY * (-FALSE_COLOUR_STOPS).exp2();
    let stops = (luminance.max(darkest) / FALSE_COLOUR_GREY).log2();
    let t = (0.5 + stops / (2.0 * FALSE_COLOUR_STOPS)).clamp(0.0, 1.0);
    let chroma = FALSE_COLOUR_CHROMA * 4.0 * t * (1.0 - t);
    let hue = FALSE_COLOUR_HUE + FALSE_COLOUR_TURN * t;
    let (a, b) = (chroma * hue.cos(), chroma * hue.sin());
    let lms = OKLAB_ROOTS.map(|root| {
        let r = t + root[0] * a + root[1] * b;
        r * r * r
    });
    linear(multiply(&OKLAB_RGB, lms))
}

/// The sRGB curve (IEC 61966-2-1): encoded value of linear light in [0, 1].
pub fn encode_srgb(x: f32) -> f32 {
    if x <= SRGB_END { SRGB_SLOPE * x } else { (1.0 + SRGB_OFFSET) * x.powf(1.0 / SRGB_GAMMA) - SRGB_OFFSET }
}

/// The inverse of [`encode_srgb`]: linear light of an encoded value in [0, 1].
pub fn decode_srgb(x: f32) -> f32 {
    if x <= SRGB_SLOPE * SRGB_END { x / SRGB_SLOPE } else { ((x + SRGB_OFFSET) / (1.0 + SRGB_OFFSET)).powf(SRGB_GAMMA) }
}

/// NaN and negative values as 0, the rest at most [`MAX_INPUT`]. On bits, as shader compilers may assume that there is
/// no NaN: read as an integer, everything with a sign and every NaN lies above infinity.
fn safe(rgb: [f32; 3]) -> [f32; 3] {
    rgb.map(|x| if x.to_bits() > f32::INFINITY.to_bits() { 0.0 } else { x.min(MAX_INPUT) })
}

/// Matrix (rows) times vector.
fn multiply(rows: &[[f32; 3]; 3], v: [f32; 3]) -> [f32; 3] {
    rows.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

#[cfg(test)]
mod tests {
    use super::*;

    const SHADER: &str = include_str!("../../shaders/display/tone_map.wgsl");
    const RUST: &str = include_str!("tone.rs");

    fn grey(map: ToneMap, x: f32) -> [f32; 3] {
        map.apply([x; 3])
    }

    #[track_caller]
    fn near(value: [f32; 3], expected: [f32; 3], tolerance: f32) {
        let off = (0..3).any(|c| (value[c] - expected[c]).abs() > tolerance);
        assert!(!off, "{value:?} is not {expected:?}");
    }

    #[test]
    fn every_input_gives_a_colour_and_black_stays_black() {
        let odd =
            [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX, f32::MIN, -0.0, 1e-45, 1e30, -1.0, 0.3];
        for &map in ToneMap::ALL {
            for i in 0..odd.len().pow(3) {
                let rgb = [odd[i % odd.len()], odd[i / odd.len() % odd.len()], odd[i / odd.len() / odd.len()]];
                let shown = map.apply(rgb);
                assert!(shown.iter().all(|x| (0.0..=1.0).contains(x)), "{map:?} {rgb:?}: {shown:?}");
            }
            for black in [0.0, -0.0, -5.0, f32::NAN, f32::NEG_INFINITY] {
                assert_eq!(Display { exposure: 3.0, tone_map: map }.apply_8bit([black; 3]), [0; 3], "{map:?}");
            }
            assert_eq!(grey(map, f32::INFINITY), grey(map, MAX_INPUT));
        }
    }

    #[test]
    fn greys_stay_grey_and_brighter_is_never_darker() {
        for &map in ToneMap::ALL {
            let mut before = -1.0;
            for step in 0..4000 {
                // 36 stops.
                let shown = grey(map, (step as f32 * 0.009 - 20.0).exp2());
                let light = shown.map(decode_srgb);
                let luminance: f32 = (0..3).map(|c| LUMINANCE[c] * light[c]).sum();
                // The sigmoid of AgX, a polynomial, falls by 10⁻⁵ of white somewhere; a byte is 400 times that.
                assert!(luminance >= before - 1e-5, "{map:?} falls at step {step}: {before} to {luminance}");
                before = luminance;
                let spread = shown.iter().fold(0.0, |most: f32, x| most.max((x - shown[0]).abs()));
                assert!(map == ToneMap::FalseColour || spread < 2e-3, "{map:?}: {shown:?}");
            }
            assert!(before > 0.97, "{map:?} ends at {before}");
        }
    }

    #[test]
    fn known_values() {
        // sRGB: IEC 61966-2-1.
        near(grey(ToneMap::Linear, 0.5), [0.735_357; 3], 1e-5);
        near(ToneMap::Linear.apply([0.002, 1.0, 7.0]), [0.02584, 1.0, 1.0], 1e-5);
        // Neutral: below 0.8 − 0.04 only the reflection of 0.04 goes, in the dark x − 6.25 x² of it.
        near(ToneMap::Neutral.apply([0.7, 0.3, 0.2]), [0.66, 0.26, 0.16].map(encode_srgb), 1e-6);
        near(grey(ToneMap::Neutral, 0.05), [encode_srgb(6.25 * 0.05 * 0.05); 3], 1e-6);
        // Above: peak 1.04 − 0.04 gives 1 − 0.24² / (1 + 0.24 − 0.76) = 0.88.
        near(grey(ToneMap::Neutral, 1.04), [encode_srgb(0.88); 3], 1e-5);
        // ACES at 1: (1.0245786 − 0.000090537) / (0.983729 + 0.432951 + 0.238081) = 0.61912, times about 1.
        near(grey(ToneMap::Aces, 1.0), [encode_srgb(0.6191); 3], 1e-3);
        // The sigmoid of AgX turns at middle grey, at half the code values; the scale ends 6.5 stops above.
        near(grey(ToneMap::Agx, 0.18), [0.5; 3], 4e-3);
        near(grey(ToneMap::Agx, 0.18 * 6.5f32.exp2()), [0.998_48; 3], 1e-3);
        // False colour: the centre is red of lightness ½; two stops are an eighth of the scale.
        let [r, g, b] = grey(ToneMap::FalseColour, 0.18);
        assert!(r > 0.6 && g < 0.3 && b < 0.4, "{r} {g} {b}");
        assert_eq!(grey(ToneMap::FalseColour, 0.18 / 256.0), [0.0; 3]);
        near(grey(ToneMap::FalseColour, 0.18 * 256.0), [1.0; 3], 1e-3);
    }

    #[test]
    fn false_colour_has_lightness_linear_in_stops_and_no_clipping() {
        for step in 1..160 {
            let t = step as f32 / 160.0;
            let stops = (t - 0.5) * 2.0 * FALSE_COLOUR_STOPS;
            // Green of the same luminance looks the same.
            let value = FALSE_COLOUR_GREY * stops.exp2();
            near(ToneMap::FalseColour.apply([0.0, value / LUMINANCE[1], 0.0]), grey(ToneMap::FalseColour, value), 1e-4);
            // Oklab lightness from linear sRGB (Ottosson 2020), the direction that the map does not use.
            let [r, g, b] = grey(ToneMap::FalseColour, value).map(decode_srgb);
            let l = 0.412_221_46 * r + 0.536_332_55 * g + 0.051_445_995 * b;
            let m = 0.211_903_5 * r + 0.680_699_5 * g + 0.107_396_96 * b;
            let s = 0.088_302_46 * r + 0.281_718_85 * g + 0.629_978_7 * b;
            let lightness = 0.210_454_26 * l.cbrt() + 0.793_617_8 * m.cbrt() - 0.004_072_047 * s.cbrt();
            assert!((lightness - t).abs() < 2e-3, "at {t}: {lightness}");
        }
    }

    #[test]
    fn agx_matrices_are_inverse_to_each_other() {
        for c in 0..3 {
            let unit = std::array::from_fn(|i| if i == c { 1.0 } else { 0.0 });
            near(multiply(&AGX_OUTSET, multiply(&AGX_INSET, unit)), unit, 1e-5);
        }
    }

    #[test]
    fn names_and_numbers_go_both_ways() {
        use crate::scene::value::{Setting, Value};
        let named = |name: &str| ToneMap::from_value(&Value::Text(name.into()));
        for (index, map) in ToneMap::ALL.iter().copied().enumerate() {
            assert_eq!((named(map.name()), map.index()), (Some(map), index as u32));
        }
        assert_eq!(named("filmic"), None);
        for byte in 0..=255u8 {
            assert_eq!((encode_srgb(decode_srgb(f32::from(byte) / 255.0)) * 255.0).round() as u8, byte);
        }
    }

    /// `NAME` and the numbers of every constant of a source text whose declaration starts with `prefix`.
    fn constants(text: &str, prefix: &str) -> Vec<(String, Vec<f32>)> {
        let declarations = text.split(prefix).skip(1).filter_map(|rest| {
            rest.split_once('=').map(|(head, tail)| {
                let name: String =
                    head.chars().take_while(|c| c.is_ascii_uppercase() || "_0123456789".contains(*c)).collect();
                let value = tail.split_once(';').expect("a declaration ends").0;
                let bare = value.replace(['_', '\n'], "").replace("vec3f", "").replace("vec2f", "");
                let bare = bare.replace("array<, 3>", "").replace("array<f32, 7>", "");
                let words = bare.split(|c: char| !(c.is_ascii_digit() || ".-".contains(c)));
                (name, words.filter(|word| !word.is_empty()).map(|word| word.parse().expect("a number")).collect())
            })
        });
        declarations.filter(|(name, _): &(String, Vec<f32>)| !name.is_empty()).collect()
    }

    #[test]
    fn the_shader_has_the_same_constants() {
        let code = RUST.split("mod tests").next().expect("the code");
        let mut ours = constants(code, "\nconst ");
        ours.extend(constants(code, "\npub const "));
        let mut theirs = constants(SHADER, "\nconst tone_map_");
        ours.sort_by(|a, b| a.0.cmp(&b.0));
        theirs.sort_by(|a, b| a.0.cmp(&b.0));
        assert_eq!(ours.len(), 25, "{ours:?}");
        assert_eq!(ours, theirs);
    }

    #[test]
    fn the_shader_is_valid_and_has_every_map() {
        let module =
            wgpu::naga::front::wgsl::parse_str(SHADER).unwrap_or_else(|e| panic!("{}", e.emit_to_string(SHADER)));
        let (flags, capabilities) =
            (wgpu::naga::valid::ValidationFlags::all(), wgpu::naga::valid::Capabilities::empty());
        wgpu::naga::valid::Validator::new(flags, capabilities).validate(&module).expect("a valid module");
        let functions: Vec<&str> = module.functions.iter().filter_map(|(_, f)| f.name.as_deref()).collect();
        for &map in ToneMap::ALL {
            let name = format!("tone_map_{}", map.name().replace('-', "_"));
            assert!(functions.contains(&name.as_str()), "no {name}");
            // The numbers in tone_map_apply are those of ToneMap::index; the last is the default.
            let case = format!("case {}u: {{ return {name}(c); }}", map.index());
            let default = format!("default: {{ return {name}(c); }}");
            assert!(SHADER.contains(&case) || map.index() == 4 && SHADER.contains(&default), "no {case}");
        }
        assert!(functions.iter().all(|name| name.starts_with("tone_map_")) && module.global_variables.is_empty());
    }
}
