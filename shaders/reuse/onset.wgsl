// The way to second vertices: some of the distances at which a ray may scatter, for reuse/suffix to go on from.
//!use core/params
//!use reuse/view
//!use reuse/target

// Two words for a pixel: up to three distances, each with the transmittance to there, 0 where there is none or none any more;
// and what they have in common.
@group(3) @binding(14) var<storage, read_write> onset_list: array<vec4f>;

// Of all distances that were offered, a few drawn one by one (resampled importance sampling).
struct Onset {
    t: vec3f,
    seen: vec3f,
    sum: f32,     // of strength over density
}

// What a distance is worth: the density there times the transmittance to there.
fn onset_strength(view: View, t: f32, seen: f32) -> f32 {
    return target_density(view_at(view, t)) * seen;
}

// Offers a distance with the transmittance to there, drawn with a density; `u`: random numbers.
fn onset_offer(onset: ptr<function, Onset>, view: View, t: f32, seen: f32, density: f32, u: vec3f) {
    let share = select(0.0, onset_strength(view, t, seen) / density, density > 0.0);
    (*onset).sum += share;
    let takes = u * (*onset).sum < vec3f(share);
    (*onset).t = select((*onset).t, vec3f(t), takes);
    (*onset).seen = select((*onset).seen, vec3f(seen), takes);
}

// Leaves the first `count` for a pixel.
fn onset_leave(pixel: u32, onset: Onset, count: u32) {
    let seen = select(vec3f(0.0), onset.seen, vec3u(0u, 1u, 2u) < vec3u(count));
    onset_list[2u * pixel] = vec4f(onset.t, onset.sum / f32(count));
    onset_list[2u * pixel + 1u] = vec4f(seen, 0.0);
}

// Whether there is one of that number.
fn onset_waits(pixel: u32, i: u32) -> bool {
    return onset_list[2u * pixel + 1u][i] > 0.0;
}

// One of them.
struct OnsetTaken {
    t: f32,
    seen: f32,
    inverse: f32,  // of the density that it was drawn with, and of the number of those like it
}

fn onset_take(pixel: u32, i: u32, view: View) -> OnsetTaken {
    let words = onset_list[2u * pixel];
    let t = words[i];
    let seen = onset_list[2u * pixel + 1u][i];
    return OnsetTaken(t, seen, words.w / onset_strength(view, t, seen));
}

// Strikes it out.
fn onset_strike(pixel: u32, i: u32) {
    onset_list[2u * pixel + 1u][i] = 0.0;
}
