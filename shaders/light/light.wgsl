// Lights: what an escaped ray sees, and samples towards lights that are small or uneven.
//
// Three kinds of light meet here. Constant radiance is found by phase sampling alone. The environment map and sun discs
// ("the bright sky") are sampled by a mixture and by the phase function, weighed by the balance heuristic. Delta suns
// and point lights can only be sampled.
//!use core/params
//!use core/math
//!use core/rng
//!use core/ray
//!use light/environment

struct Light {
    axis: vec3f,      // unit direction towards a sun, world space; or the place of a point light, local space
    kind: u32,
    value: vec3f,     // irradiance of a delta sun, radiance of a disc, intensity of a point
    share: f32,       // chance that this light is the one sampled
    chord2: f32,      // of a disc: square of the chord from its axis to its edge, 4 sin²(α/4)
    unused0: f32,
    unused1: f32,
    unused2: f32,
}

const LIGHT_DELTA_SUN: u32 = 0u;
const LIGHT_DISC: u32 = 1u;
const LIGHT_POINT: u32 = 2u;

@group(2) @binding(0) var<storage, read> lights: array<Light>;

// The light where there is only one, read once; see `params` for why.
var<private> light_only: Light;

// Where the lights in use begin in the list.
var<private> light_base: u32;

// Begins every kernel that uses lights, those from `base` on: 0 for those of the picture.
fn light_begin(base: u32) {
    light_base = base;
    if (LIGHT_HAS_LIST && !LIGHT_HAS_MANY) {
        light_only = lights[base];
    }
}

fn light_count() -> u32 {
    return select(1u, params.light_count, LIGHT_HAS_MANY);
}

fn light_at(i: u32) -> Light {
    if (LIGHT_HAS_MANY) {
        return lights[light_base + i];
    }
    return light_only;
}

struct LightSample {
    direction: vec3f,  // unit, world space, towards the light
    distance: f32,     // world units; MATH_FAR where there is no end
    value: vec3f,      // radiance, which `light_factor` divides by the density; a delta's irradiance over its share
    pdf: f32,          // per steradian, all techniques that could have drawn the direction; 0 for a delta
    id: u32,           // of the light in the list
    share: f32,        // chance that this light was the one sampled
}

// Whether `w` points into a disc. By the chord: the cosine of a small angle has no digits left.
fn light_in_disc(light: Light, w: vec3f) -> bool {
    let chord = w - light.axis;
    return light.kind == LIGHT_DISC && dot(chord, chord) <= light.chord2;
}

// Radiance of the bright sky (map and discs) in direction `w`.
fn light_bright(w: vec3f) -> vec3f {
    var sum = vec3f(0.0);
    if (LIGHT_HAS_MAP) {
        sum += environment_radiance(w);
    }
    if (LIGHT_HAS_DISC) {
        for (var i = 0u; i < light_count(); i++) {
            let light = light_at(i);
            if (light_in_disc(light, w)) {
                sum += light.value;
            }
        }
    }
    return sum;
}

// Density per steradian with which `light_sample` draws the direction `w` of the bright sky.
fn light_pdf(w: vec3f) -> f32 {
    var sum = 0.0;
    if (LIGHT_HAS_MAP) {
        sum += params.environment_share * environment_pdf(w);
    }
    if (LIGHT_HAS_DISC) {
        for (var i = 0u; i < light_count(); i++) {
            let light = light_at(i);
            if (light_in_disc(light, w)) {
                sum += light.share / (MATH_PI * light.chord2); // the cap's solid angle
            }
        }
    }
    return sum;
}

// What a ray that leaves the medium along `w` sees. `phase_pdf` is the density with which scattering chose `w`;
// negative for a camera ray, which nothing else could have drawn.
fn light_background(w: vec3f, phase_pdf: f32) -> vec3f {
    var weight = 1.0;
    if (phase_pdf >= 0.0 && (LIGHT_HAS_MAP || LIGHT_HAS_DISC)) {
        weight = phase_pdf / (phase_pdf + light_pdf(w));
    }
    return params.constant_radiance + light_bright(w) * weight;
}

// A direction uniform over the cap of a disc: 1 − cosθ is uniform.
fn light_cap(light: Light, rng: ptr<function, Rng>) -> vec3f {
    let h = 0.5 * light.chord2 * rng_next(rng);
    return math_around_drop(light.axis, h, 2.0 * MATH_PI * rng_next(rng));
}

// A sample towards one light, from `p` (local space).
fn light_sample(p: vec3f, rng: ptr<function, Rng>) -> LightSample {
    var sample = LightSample(vec3f(0.0, 1.0, 0.0), MATH_FAR, vec3f(0.0), 0.0, 0u, 1.0);
    var u = rng_next(rng);
    if (LIGHT_HAS_MAP) {
        if (u < params.environment_share) {
            sample.direction = environment_sample(rng);
            sample.pdf = 1.0;
        }
        u -= params.environment_share;
    }
    if (LIGHT_HAS_LIST) {
        var i = 0u;
        if (LIGHT_HAS_MANY) {
            while (i + 1u < params.light_count && u >= lights[light_base + i].share) {
                u -= lights[light_base + i].share;
                i++;
            }
        }
        let light = light_at(i);
        sample.id = i;
        sample.share = light.share;
        if (!LIGHT_HAS_MAP || u >= 0.0) {
            if (LIGHT_HAS_DISC && light.kind == LIGHT_DISC) {
                sample.direction = light_cap(light, rng);
                sample.pdf = 1.0;
            } else if (LIGHT_HAS_POINT && light.kind == LIGHT_POINT) {
                let world = ray_world(light.axis - p);
                let square = max(dot(world, world), 1e-20);
                sample.distance = sqrt(square);
                sample.direction = world / sample.distance;
                sample.value = light.value / (square * light.share);
            } else {
                sample.direction = light.axis;
                sample.value = light.value / light.share;
            }
        }
    }
    if ((LIGHT_HAS_MAP || LIGHT_HAS_DISC) && sample.pdf > 0.0) {
        sample.pdf = light_pdf(sample.direction);
        sample.value = light_bright(sample.direction);
    }
    return sample;
}

// The factor on a light sample's value for the phase density towards it: phase · balance weight / density.
fn light_factor(sample: LightSample, phase: f32) -> f32 {
    return select(phase, phase / (sample.pdf + phase), sample.pdf > 0.0);
}
