// Directions that are likely to be followed by a scattering towards a light: the phase function's lobe about the direction to
// it. Where scattering is strongly forward, the last but one leg of most light runs there, and scattering alone hardly finds it.
//!use core/params
//!use core/math
//!use core/rng
//!use core/ray
//!slot phase
//!use light/light

const TOWARD_SHARE: f32 = select(0.0, 0.2, LIGHT_HAS_LIST);  // of directions that are drawn so

// To a light's middle from `p` (local space): unit, world space.
fn toward_axis(light: Light, p: vec3f) -> vec3f {
    if (LIGHT_HAS_POINT && light.kind == LIGHT_POINT) {
        let world = ray_world(light.axis - p);
        return world / sqrt(max(dot(world, world), 1e-20));
    }
    return light.axis;
}

// A direction that the phase function draws about an axis.
fn toward_turn(axis: vec3f, rng: ptr<function, Rng>) -> vec3f {
    let drop = phase_drop(rng);
    return math_around_drop(axis, drop, 2.0 * MATH_PI * rng_next(rng));
}

// Density per steradian with which `toward_sample` draws `onward`, at `p` (local space) after travelling along `before`.
fn toward_pdf(p: vec3f, before: vec3f, onward: vec3f) -> f32 {
    let phase = phase_value(dot(before, onward));
    if (!LIGHT_HAS_LIST) {
        return phase;
    }
    var sum = 0.0;
    for (var i = 0u; i < light_count(); i++) {
        let light = light_at(i);
        sum += light.share * phase_value(dot(toward_axis(light, p), onward));
    }
    // Maps have no direction of their own.
    let all = select(1.0, 1.0 - params.environment_share, LIGHT_HAS_MAP);
    return mix(phase, sum / all, TOWARD_SHARE);
}

fn toward_sample(p: vec3f, before: vec3f, rng: ptr<function, Rng>) -> vec3f {
    var axis = before;
    if (LIGHT_HAS_LIST && rng_next(rng) < TOWARD_SHARE) {
        var i = 0u;
        if (LIGHT_HAS_MANY) {
            var u = rng_next(rng) * select(1.0, 1.0 - params.environment_share, LIGHT_HAS_MAP);
            while (i + 1u < params.light_count && u >= light_at(i).share) {
                u -= light_at(i).share;
                i++;
            }
        }
        axis = toward_axis(light_at(i), p);
    }
    return toward_turn(axis, rng);
}
