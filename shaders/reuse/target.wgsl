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

// What a path carries but for the transmittances, and where they are.
struct Target {
    value: vec3f,      // radiance per (film · distance · what drew the rest), RGB
    view: View,        // the camera's ray
    vertex: vec3f,     // first vertex, local space
    onward: vec3f,     // unit, world space: to the light or the second vertex
    reach: f32,        // how far, world units
}

// Stored density, 0 outside the support.
fn target_density(p: vec3f) -> f32 {
    let inside = all(p >= params.box_min) && all(p <= params.box_max);
    return select(0.0, medium_density(p), inside);
}

// Phase function times radiance, by what found the direction: the balance heuristic shares the bright sky out between light
// samples and scattering.
fn target_arriving(kind: u32, radiance: vec3f, omega: vec3f, phase: f32) -> vec3f {
    let of_light = kind == RESERVOIR_BRIGHT || kind == RESERVOIR_BRIGHT_2;
    let of_phase = kind == RESERVOIR_ESCAPE || kind == RESERVOIR_ESCAPE_2;
    var weight = 1.0;
    if (LIGHT_HAS_MAP || LIGHT_HAS_DISC) {
        let pdf = light_pdf(omega);
        weight = select(select(1.0, phase / max(pdf + phase, 1e-30), of_phase), pdf / max(pdf + phase, 1e-30), of_light);
    }
    return phase * (radiance * weight + select(vec3f(0.0), params.constant_radiance, of_phase));
}

fn target_parts(pixel: vec2u, path: Path) -> Target {
    let view = view_ray(pixel, path.film);
    let vertex = view.origin + ray_local(view.world) * path.t;
    let colour = params.albedo * params.extinction;
    var value = colour * (target_density(vertex) * params.sigma);
    var onward = path.omega;
    var reach = MATH_FAR;
    if (REUSE_SECOND && reservoir_has_second(path.kind)) {
        let to = view_world(path.second - vertex);
        let square = max(dot(to, to), 1e-20);
        reach = sqrt(square);
        onward = to / reach;
        let seen = select(vec3f(1.0), light_bright(path.omega), path.kind == RESERVOIR_ESCAPE_2);
        let phase = phase_value(dot(onward, path.omega));
        let arriving = path.value * target_arriving(path.kind, seen, path.omega, phase);
        let second = target_density(path.second) * params.sigma;
        value *= colour * arriving * (phase_value(dot(view.world, onward)) * second / square);
    } else {
        var radiance = vec3f(0.0);
        if (path.kind == RESERVOIR_DELTA && LIGHT_HAS_LIST) {
            let light = light_at(path.id);
            let to = view_world(light.axis - vertex);
            let square = max(dot(to, to), 1e-20);
            let is_point = LIGHT_HAS_POINT && light.kind == LIGHT_POINT;
            reach = select(MATH_FAR, sqrt(square), is_point);
            onward = select(light.axis, to / sqrt(square), is_point);
            radiance = light.value / select(1.0, square, is_point);
        } else {
            radiance = light_bright(path.omega);
        }
        value *= target_arriving(path.kind, radiance, onward, phase_value(dot(view.world, onward)));
    }
    let known = path.kind != RESERVOIR_NONE && path.t > 0.0;
    return Target(select(vec3f(0.0), value, known), view, vertex, onward, reach);
}

// What the known factors of a path make of it.
fn target_strength(parts: Target) -> f32 {
    return math_mean3(abs(parts.value));
}

// The transmittance of the onward leg from afar; a leg of no `strength` is not looked along.
fn target_onward(parts: Target, strength: f32) -> f32 {
    let ray = ray_new(parts.vertex, parts.onward);
    return exp(-leg_march(ray, min(ray.exit, select(0.0, parts.reach, strength > 0.0))).grey);
}

// The transmittance from the camera to distance t, from afar.
fn target_camera(pixel: vec2u, film: u32, t: f32) -> f32 {
    let view = view_ray(pixel, film);
    return exp(-leg_within(leg_camera(ray_new(view.origin, view.world), t), t));
}

// The target of a path whose camera leg has that transmittance.
fn target_given(pixel: vec2u, path: Path, camera: f32) -> f32 {
    let parts = target_parts(pixel, path);
    let strength = target_strength(parts);
    let aim = strength * camera * target_onward(parts, strength);
    return select(0.0, aim, aim < MATH_FAR);
}

// The target of a path in a pixel.
fn target_value(pixel: vec2u, path: Path) -> f32 {
    return target_given(pixel, path, target_camera(pixel, path.film, path.t));
}
