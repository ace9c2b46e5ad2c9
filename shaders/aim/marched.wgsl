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
// 2 · (mip + 1) voxels on mip maps of the density, of which the finest cells here are the density itself.
const MARCHED_REUSE: vec2f = vec2f(1.0, 4.0);
const MARCHED_FIRST: vec2f = vec2f(2.0, 6.0);

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

// Transmittance of legs from number `first` to the one before number `end` from afar, channels averaged. One loop for all legs, as
// in reuse/target.
fn marched_seen(parts: Target, t: f32, first: u32, end: u32, look: vec2f) -> f32 {
    let level = min(look.x, params.proxy_last);
    let deep = MARCHED_DEEP / params.proxy_weakest;
    var seen = 1.0;
    var depth = 0.0;
    var steps = 0u;
    var i = first;
    var way = target_way(parts, t, i);
    while (i < end) {
        let ray = way.ray;
        let far = min(ray.exit, way.reach);
        if (ray.t < far && depth <= deep && steps < MARCHED_MOST) {
            let step = look.y / (params.proxy_inv_cell * math_max3(abs(ray.direction)));
            let next = select(min(ray.t + step, far), far, PROXY_EXACT);
            depth += proxy_depth(ray, ray.t, next, level);
            way.ray.t = next;
            steps += 1u;
        } else {
            seen *= max(marched_mean(depth), MARCHED_FLOOR);
            depth = 0.0;
            steps = 0u;
            i += 1u;
            way = target_way(parts, t, i);
        }
    }
    return seen;
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

// Transmittance of all legs after the camera's; those of a path of no `strength` are not looked along.
fn marched_onward(parts: Target, strength: f32, look: vec2f) -> f32 {
    return marched_seen(parts, 0.0, 1u, select(0u, parts.legs + 1u, strength > 0.0), look);
}

// What a path is worth to a pixel.
fn marched_value(pixel: vec2u, path: Path) -> f32 {
    let through = path.kind == MARCHED_THROUGH;
    let parts = target_parts(pixel, path);
    var strength = marched_strength(parts);
    let legs = select(select(0u, parts.legs, strength > 0.0), 0u, through);
    if (through) {
        strength = marched_behind(parts.view);
    }
    let t = select(path.t, MATH_FAR, through);
    let aim = strength * marched_seen(parts, t, 0u, select(0u, legs + 1u, strength > 0.0), MARCHED_REUSE);
    return select(0.0, aim, aim < MATH_FAR);
}

// A path whose first vertex moves from `before` to `after` (local space) and no other.
fn marched_stay(path: Path, before: vec3f, after: vec3f) -> Path {
    var moved = path;
    if (REUSE_SECOND) {
        moved.second -= ray_world(after - before);
    }
    return moved;
}

// What the known factors of a path that scatters make of it.
fn aim_strength(parts: Target) -> f32 {
    return marched_strength(parts);
}

// The transmittance of all of its legs; flights have `seen` another.
fn aim_legs(pixel: vec2u, path: Path, parts: Target, seen: f32) -> f32 {
    return marched_seen(parts, path.t, 0u, parts.legs + 1u, MARCHED_REUSE);
}
