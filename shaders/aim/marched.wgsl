// Slot @aim, for the method of 2021 (Lin, Wyman, Yuksel): the luminance of a path, with transmittances that are marched through
// the density from afar at steps of one size. What lies behind the medium is a path as well, one that meets nothing.
//!use core/params
//!use core/math
//!use core/ray
//!slot proxy
//!slot spectrum
//!use light/light
//!use reuse/view
//!use reuse/reservoir
//!use reuse/target

// The kind of a path that meets nothing. Where there is anything on the way its `t` is a distance drawn at random, else 0.
const MARCHED_THROUGH: u32 = RESERVOIR_NONE;
// The part of a typical radiance that such a path is worth, at least: where the background is black it still tells the opacity.
const MARCHED_VEIL: f32 = 0.01;

// How coarsely a leg is seen: the level of the density from afar, and the step in its finest cells. The release marches
// 2 · (mip + 1) voxels on mip maps of the density, of which the finest cells here are the first.
const MARCHED_REUSE: vec2f = vec2f(0.0, 2.0);
const MARCHED_FIRST: vec2f = vec2f(1.0, 3.0);

const MARCHED_MOST: u32 = 2048u;   // steps of a leg, a guard
const MARCHED_DEEP: f32 = 12.0;    // optical depth beyond which nothing is seen
const MARCHED_FLOOR: f32 = 1e-5;   // least transmittance of a target: no path may be impossible

// Transmittance of an optical depth of the strongest channel, channels averaged.
fn marched_mean(depth: f32) -> f32 {
    return spectrum_mean(exp(-spectrum_extinction() * depth));
}

fn marched_luminance(v: vec3f) -> f32 {
    return dot(abs(v), vec3f(0.2126, 0.7152, 0.0722));
}

// Transmittance from `ray.t` to `far` from afar, channels averaged.
fn marched_seen(ray: Ray, far: f32, look: vec2f) -> f32 {
    if (PROXY_EXACT) {
        return max(marched_mean(select(0.0, proxy_depth(ray, ray.t, far, look.x), far > ray.t)), MARCHED_FLOOR);
    }
    let level = min(look.x, params.proxy_last);
    let step = look.y / (params.proxy_inv_cell * math_max3(abs(ray.direction)));
    let deep = MARCHED_DEEP / params.proxy_weakest;
    var t = ray.t;
    var depth = 0.0;
    for (var i = 0u; i < MARCHED_MOST; i++) {
        if (t >= far || depth > deep) {
            break;
        }
        let next = min(t + step, far);
        depth += proxy_depth(ray, t, next, level);
        t = next;
    }
    return max(marched_mean(depth), MARCHED_FLOOR);
}

// What a pixel sees that looks through the medium, but for the transmittance.
fn marched_behind(view: View) -> f32 {
    return marched_luminance(light_background(view.world, -1.0)) + MARCHED_VEIL * params.light_reference;
}

// The value of a path that scatters, but for the transmittances.
fn marched_strength(parts: Target) -> f32 {
    let strength = marched_luminance(parts.value);
    return select(0.0, strength, strength < MATH_FAR);
}

// Transmittance of all legs after the camera's.
fn marched_onward(parts: Target, strength: f32, look: vec2f) -> f32 {
    var seen = 1.0;
    for (var i = 0u; i < select(0u, parts.legs, strength > 0.0); i++) {
        let leg = target_take(parts, i);
        let ray = ray_new(leg.origin, leg.world);
        seen *= marched_seen(ray, min(ray.exit, leg.reach), look);
    }
    return seen;
}

// What a path is worth to a pixel.
fn marched_value(pixel: vec2u, path: Path) -> f32 {
    let through = path.kind == MARCHED_THROUGH;
    let parts = target_parts(pixel, path);
    var strength = marched_strength(parts);
    let onward = marched_onward(parts, strength, MARCHED_REUSE);
    if (through) {
        strength = marched_behind(parts.view);
    }
    let ray = ray_new(parts.view.origin, parts.view.world);
    let reach = select(select(0.0, path.t, strength > 0.0), ray.exit, through);
    let aim = strength * marched_seen(ray, min(ray.exit, reach), MARCHED_REUSE) * onward;
    return select(0.0, aim, aim < MATH_FAR);
}

// What the known factors of a path that scatters make of it.
fn aim_strength(parts: Target) -> f32 {
    return marched_strength(parts);
}

// The transmittance of all of its legs; flights have `seen` another.
fn aim_legs(pixel: vec2u, path: Path, parts: Target, seen: f32) -> f32 {
    let ray = ray_new(parts.view.origin, parts.view.world);
    return marched_seen(ray, min(ray.exit, path.t), MARCHED_REUSE) * marched_onward(parts, 1.0, MARCHED_REUSE);
}
