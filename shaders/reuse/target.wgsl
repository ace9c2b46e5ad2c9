// The target of resampling: the light of a path with transmittances as they look from afar. Deterministic, and above 0
// wherever a path carries light. What it leaves to the last step are two transmittances.
//!use core/params
//!use core/math
//!use core/ray
//!slot medium
//!slot phase
//!use light/light
//!use reuse/view
//!use reuse/leg
//!use reuse/reservoir

// A leg after the camera's, in the medium.
struct TargetLeg {
    origin: vec3f,  // local space
    world: vec3f,   // unit, world space
    reach: f32,     // how far, world units
}

// What a path carries but for the transmittances, and where they are.
struct Target {
    value: vec3f,      // radiance per (film · distance · what drew the rest), RGB
    view: View,        // the camera's ray
    first: TargetLeg,  // from the first vertex to the next, or to the light
    second: TargetLeg,
    third: TargetLeg,
    legs: u32,         // how many of those there are
}

// Stored density, 0 outside the support.
fn target_density(p: vec3f) -> f32 {
    let inside = all(p >= params.box_min) && all(p <= params.box_max);
    return select(0.0, medium_density(p), inside);
}

// Phase function times radiance, by how the direction was found: the balance heuristic shares the bright sky out between light
// samples and scattering.
fn target_arriving(how: u32, radiance: vec3f, omega: vec3f, phase: f32) -> vec3f {
    let of_light = how == RESERVOIR_BRIGHT;
    let of_phase = how == RESERVOIR_ESCAPE;
    var weight = 1.0;
    if (LIGHT_HAS_MAP || LIGHT_HAS_DISC) {
        let pdf = light_pdf(omega);
        weight = select(select(1.0, phase / max(pdf + phase, 1e-30), of_phase), pdf / max(pdf + phase, 1e-30), of_light);
    }
    return phase * (radiance * weight + select(vec3f(0.0), params.constant_radiance, of_phase));
}

// From a vertex (local space) on, by so much in world space.
fn target_leg(origin: vec3f, to: vec3f) -> TargetLeg {
    let reach = sqrt(max(dot(to, to), 1e-20));
    return TargetLeg(origin, to / reach, reach);
}

// The share of light that turns from `before` into a leg at its end, per volume.
fn target_scatters(before: vec3f, leg: TargetLeg, vertex: vec3f) -> f32 {
    return phase_value(dot(before, leg.world)) * (target_density(vertex) * params.sigma) / (leg.reach * leg.reach);
}

fn target_parts(pixel: vec2u, path: Path) -> Target {
    let view = view_ray(pixel, path.film);
    let colour = params.albedo * params.extinction;
    var parts = Target();
    parts.view = view;
    var vertex = view_at(view, path.t);
    var before = view.world;
    var value = colour * (target_density(vertex) * params.sigma);
    let depth = reservoir_depth(path.kind);
    if (REUSE_SECOND && depth > 1u) {
        parts.first = target_leg(vertex, path.second);
        vertex += ray_local(path.second);
        value *= colour * target_scatters(before, parts.first, vertex);
        before = parts.first.world;
    }
    if (REUSE_SECOND && depth > 2u) {
        parts.second = target_leg(vertex, path.third);
        vertex += ray_local(path.third);
        value *= colour * target_scatters(before, parts.second, vertex);
        before = parts.second.world;
    }
    let how = path.kind & RESERVOIR_HOW;
    var last = TargetLeg(vertex, path.omega, MATH_FAR);
    var radiance = vec3f(0.0);
    if (REUSE_SECOND && path.kind == RESERVOIR_FROZEN) {
        radiance = path.value;
    } else if (how == RESERVOIR_DELTA && LIGHT_HAS_LIST) {
        let light = light_at(path.id);
        let is_point = LIGHT_HAS_POINT && light.kind == LIGHT_POINT;
        let to = target_leg(vertex, ray_world(light.axis - vertex));
        last.world = select(light.axis, to.world, is_point);
        last.reach = select(MATH_FAR, to.reach, is_point);
        radiance = light.value / select(1.0, to.reach * to.reach, is_point);
    } else {
        radiance = light_bright(path.omega);
    }
    value *= target_arriving(how, radiance, last.world, phase_value(dot(before, last.world)));
    parts.legs = select(depth, 2u, REUSE_SECOND && path.kind == RESERVOIR_FROZEN);
    if (depth == 1u) {
        parts.first = last;
    } else if (depth == 2u) {
        parts.second = last;
    } else {
        parts.third = last;
    }
    let known = path.kind != RESERVOIR_NONE && path.t > 0.0;
    parts.value = select(vec3f(0.0), value, known);
    return parts;
}

// Number i of the legs after the camera's.
fn target_take(parts: Target, i: u32) -> TargetLeg {
    if (!REUSE_SECOND || i == 0u) {
        return parts.first;
    }
    if (i == 1u) {
        return parts.second;
    }
    return parts.third;
}

// What the known factors of a path make of it.
fn target_strength(parts: Target) -> f32 {
    return math_mean3(abs(parts.value));
}

// A ray with a leg on it: part of a way through all of the medium, so that a flight along it (leg_flight) finds the same.
struct TargetWay {
    ray: Ray,
    reach: f32,  // where the leg ends, if not where the ray does
}

// Number i of all legs of a path whose first vertex is at t, the camera's first.
fn target_way(parts: Target, t: f32, i: u32) -> TargetWay {
    if (i == 0u) {
        return TargetWay(ray_new(parts.view.origin, parts.view.world), t);
    }
    let leg = target_take(parts, i - 1u);
    return TargetWay(ray_new(leg.origin, leg.world), leg.reach);
}

// The transmittance of all legs from number `first` on, from afar. One loop for all of them: those of neighbouring pixels are of
// different lengths, together less so.
fn target_seen(parts: Target, t: f32, first: u32) -> f32 {
    var grey = 0.0;
    var i = first;
    var way = target_way(parts, t, i);
    var march = leg_begin(way.ray, proxy_end(way.ray), i > 0u);
    while (i <= parts.legs) {
        let end = min(march.far, way.reach);
        if (leg_goes_on(march) && march.t < end) {
            leg_advance(way.ray, &march);
        } else {
            grey += leg_within(march, end);
            i += 1u;
            way = target_way(parts, t, i);
            march = leg_begin(way.ray, proxy_end(way.ray), true);
        }
    }
    return exp(-grey);
}

// The target of a path of whose legs those before number `first` let `seen` through.
fn target_beyond(pixel: vec2u, path: Path, seen: f32, first: u32) -> f32 {
    let parts = target_parts(pixel, path);
    let strength = target_strength(parts);
    if (!(strength > 0.0)) {
        return 0.0;
    }
    let aim = strength * seen * target_seen(parts, path.t, first);
    return select(0.0, aim, aim < MATH_FAR);
}

// The target of a path in a pixel.
fn target_value(pixel: vec2u, path: Path) -> f32 {
    return target_beyond(pixel, path, 1.0, 0u);
}
