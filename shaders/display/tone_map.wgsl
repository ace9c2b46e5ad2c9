// Exposed linear Rec.709 to sRGB-encoded values in [0, 1]. The twin of src/image/tone.rs, which has the same constants
// under the same names; a test there compares the two texts. Negative values and NaN count as 0, values above
// tone_map_MAX_INPUT (infinity too) as that. Matrices are three rows.

const tone_map_MAX_INPUT: f32 = 65504.0;
const tone_map_LUMINANCE: vec3f = vec3f(0.2126, 0.7152, 0.0722);

// sRGB: IEC 61966-2-1.
const tone_map_SRGB_SLOPE: f32 = 12.92;
const tone_map_SRGB_END: f32 = 0.0031308;
const tone_map_SRGB_OFFSET: f32 = 0.055;
const tone_map_SRGB_GAMMA: f32 = 2.4;

const tone_map_AGX_INSET = array<vec3f, 3>(
    vec3f(0.84247905, 0.0784336, 0.07922375),
    vec3f(0.04232824, 0.8784686, 0.07916613),
    vec3f(0.04237565, 0.0784336, 0.879143),
);
const tone_map_AGX_OUTSET = array<vec3f, 3>(
    vec3f(1.196879, -0.09802088, -0.09902974),
    vec3f(-0.05289686, 1.1519032, -0.09896118),
    vec3f(-0.052971635, -0.09804345, 1.1510737),
);
const tone_map_AGX_MIN_EV: f32 = -12.47393;
const tone_map_AGX_MAX_EV: f32 = 4.026069;
const tone_map_AGX_CURVE = array<f32, 7>(15.5, -40.14, 31.96, -6.868, 0.4298, 0.1191, -0.00232);

const tone_map_NEUTRAL_F90: f32 = 0.04;
const tone_map_NEUTRAL_START: f32 = 0.8;
const tone_map_NEUTRAL_DESATURATION: f32 = 0.15;

const tone_map_ACES_INPUT = array<vec3f, 3>(
    vec3f(0.59719, 0.35458, 0.04823),
    vec3f(0.07600, 0.90834, 0.01566),
    vec3f(0.02840, 0.13383, 0.83777),
);
const tone_map_ACES_OUTPUT = array<vec3f, 3>(
    vec3f(1.60475, -0.53108, -0.07367),
    vec3f(-0.10208, 1.10813, -0.00605),
    vec3f(-0.00327, -0.07276, 1.07602),
);
const tone_map_ACES_NUMERATOR: vec2f = vec2f(0.0245786, -0.000090537);
const tone_map_ACES_DENOMINATOR: vec3f = vec3f(0.983729, 0.432951, 0.238081);

const tone_map_FALSE_COLOUR_GREY: f32 = 0.18;
const tone_map_FALSE_COLOUR_STOPS: f32 = 8.0;
const tone_map_FALSE_COLOUR_HUE: f32 = 4.607669;
const tone_map_FALSE_COLOUR_TURN: f32 = 3.4208453;
const tone_map_FALSE_COLOUR_CHROMA: f32 = 0.16;
const tone_map_OKLAB_ROOTS = array<vec2f, 3>(
    vec2f(0.39633778, 0.21580376),
    vec2f(-0.105561346, -0.06385417),
    vec2f(-0.08948418, -1.2914855),
);
const tone_map_OKLAB_RGB = array<vec3f, 3>(
    vec3f(4.0767417, -3.3077116, 0.23096994),
    vec3f(-1.268438, 2.6097574, -0.34131938),
    vec3f(-0.0041960863, -0.7034186, 1.7076147),
);

// The tone map of that ToneMap::index.
fn tone_map_apply(kind: u32, c: vec3f) -> vec3f {
    switch kind {
        case 0u: { return tone_map_agx(c); }
        case 1u: { return tone_map_neutral(c); }
        case 2u: { return tone_map_aces(c); }
        case 3u: { return tone_map_linear(c); }
        default: { return tone_map_false_colour(c); }
    }
}

// T. Sobotka's AgX in the sixth-order fit of B. Wrensch, "Minimal AgX implementation" (2023), without a look: inset
// matrix, log2, sigmoid, outset matrix. Its result, encoded for a display of exponent 2.2, is shown as sRGB.
fn tone_map_agx(c: vec3f) -> vec3f {
    let inset = max(tone_map_multiply(tone_map_AGX_INSET, tone_map_safe(c)), vec3f(exp2(tone_map_AGX_MIN_EV)));
    let ev = clamp(log2(inset), vec3f(tone_map_AGX_MIN_EV), vec3f(tone_map_AGX_MAX_EV));
    let t = (ev - tone_map_AGX_MIN_EV) / (tone_map_AGX_MAX_EV - tone_map_AGX_MIN_EV);
    const k = tone_map_AGX_CURVE;
    let curve = (((((k[0] * t + k[1]) * t + k[2]) * t + k[3]) * t + k[4]) * t + k[5]) * t + k[6];
    return clamp(tone_map_multiply(tone_map_AGX_OUTSET, curve), vec3f(0.0), vec3f(1.0));
}

// The Khronos PBR Neutral tone mapper (Khronos ToneMapping repository, 2024): colours below 0.8 are kept but for the
// base reflection, peaks are compressed towards 1 and lose their colour.
fn tone_map_neutral(c: vec3f) -> vec3f {
    let safe = tone_map_safe(c);
    let lowest = min(safe.r, min(safe.g, safe.b));
    let toe = lowest - lowest * lowest / (4.0 * tone_map_NEUTRAL_F90);
    let rgb = safe - select(tone_map_NEUTRAL_F90, toe, lowest < 2.0 * tone_map_NEUTRAL_F90);
    let peak = max(rgb.r, max(rgb.g, rgb.b));
    const start = tone_map_NEUTRAL_START - tone_map_NEUTRAL_F90;
    if peak < start {
        return tone_map_linear(rgb);
    }
    const room = 1.0 - start;
    let new_peak = 1.0 - room * room / (peak + room - start);
    let white = 1.0 - 1.0 / (tone_map_NEUTRAL_DESATURATION * (peak - new_peak) + 1.0);
    return tone_map_linear(rgb * new_peak / peak * (1.0 - white) + new_peak * white);
}

// S. Hill's fit of the ACES RRT and sRGB ODT (2016, published in BakingLab by M. Pettineo and D. Neubelt).
fn tone_map_aces(c: vec3f) -> vec3f {
    let v = tone_map_multiply(tone_map_ACES_INPUT, tone_map_safe(c));
    const n = tone_map_ACES_NUMERATOR;
    const d = tone_map_ACES_DENOMINATOR;
    return tone_map_linear(tone_map_multiply(tone_map_ACES_OUTPUT, (v * (v + n.x) + n.y) / (v * (d.x * v + d.y) + d.z)));
}

// sRGB of values clipped to [0, 1].
fn tone_map_linear(c: vec3f) -> vec3f {
    let x = min(tone_map_safe(c), vec3f(1.0));
    let curved = (1.0 + tone_map_SRGB_OFFSET) * pow(x, vec3f(1.0 / tone_map_SRGB_GAMMA)) - tone_map_SRGB_OFFSET;
    return select(curved, tone_map_SRGB_SLOPE * x, x <= vec3f(tone_map_SRGB_END));
}

// Luminance in stops round middle grey as a colour, black at -8 stops, white at +8: Oklab (B. Ottosson, 2020) with
// lightness linear in the stops and a hue that turns from blue through purple, red and orange to yellow. Own map.
fn tone_map_false_colour(c: vec3f) -> vec3f {
    const darkest = tone_map_FALSE_COLOUR_GREY * exp2(-tone_map_FALSE_COLOUR_STOPS);
    let luminance = max(dot(tone_map_LUMINANCE, tone_map_safe(c)), darkest);
    let stops = log2(luminance / tone_map_FALSE_COLOUR_GREY);
    let t = clamp(0.5 + stops / (2.0 * tone_map_FALSE_COLOUR_STOPS), 0.0, 1.0);
    let chroma = tone_map_FALSE_COLOUR_CHROMA * 4.0 * t * (1.0 - t);
    let hue = tone_map_FALSE_COLOUR_HUE + tone_map_FALSE_COLOUR_TURN * t;
    let ab = chroma * vec2f(cos(hue), sin(hue));
    const k = tone_map_OKLAB_ROOTS;
    let roots = t + vec3f(dot(k[0], ab), dot(k[1], ab), dot(k[2], ab));
    return tone_map_linear(tone_map_multiply(tone_map_OKLAB_RGB, roots * roots * roots));
}

// NaN and negative values as 0, the rest at most tone_map_MAX_INPUT. On bits, as compilers may assume that there is no
// NaN: read as an integer, everything with a sign and every NaN lies above infinity (0x7f800000).
fn tone_map_safe(c: vec3f) -> vec3f {
    return select(min(c, vec3f(tone_map_MAX_INPUT)), vec3f(0.0), bitcast<vec3u>(c) > vec3u(0x7f800000u));
}

// Matrix (rows) times vector.
fn tone_map_multiply(rows: array<vec3f, 3>, v: vec3f) -> vec3f {
    return vec3f(dot(rows[0], v), dot(rows[1], v), dot(rows[2], v));
}
