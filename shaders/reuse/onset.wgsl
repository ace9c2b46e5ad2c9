// The way to second vertices: some of the distances at which a ray may scatter, for reuse/suffix to go on from.
//!use core/params

// Two words for a pixel: of up to four distances each with the weight that choosing it has left; 0 where there is none, or none
// any more.
@group(3) @binding(14) var<storage, read_write> onset_list: array<vec4f>;

const ONSET_MOST: u32 = 4u;

// Of all distances that were offered, four drawn one by one (resampled importance sampling).
struct Onset {
    t: vec4f,
    strength: vec4f,
    sum: f32,         // of strength over density
}

// Offers a distance of a strength, drawn with a density; `u`: random numbers.
fn onset_offer(onset: ptr<function, Onset>, t: f32, strength: f32, density: f32, u: vec4f) {
    let share = select(0.0, strength / density, density > 0.0);
    (*onset).sum += share;
    let takes = u * (*onset).sum < vec4f(share);
    (*onset).t = select((*onset).t, vec4f(t), takes);
    (*onset).strength = select((*onset).strength, vec4f(strength), takes);
}

// Leaves the first `count` for a pixel.
fn onset_leave(pixel: u32, onset: Onset, count: u32) {
    let good = (onset.strength > vec4f(0.0)) & (vec4u(0u, 1u, 2u, 3u) < vec4u(count));
    let weight = onset.sum / (onset.strength * f32(count));
    let t = select(vec4f(0.0), onset.t, good);
    onset_list[2u * pixel] = vec4f(t.x, weight.x, t.y, weight.y);
    onset_list[2u * pixel + 1u] = vec4f(t.z, weight.z, t.w, weight.w);
}

// Number i of a pixel: distance and weight.
fn onset_take(pixel: u32, i: u32) -> vec2f {
    let words = onset_list[2u * pixel + i / 2u];
    return select(words.xy, words.zw, (i & 1u) == 1u);
}

// Strikes it out.
fn onset_strike(pixel: u32, i: u32) {
    if ((i & 1u) == 1u) {
        onset_list[2u * pixel + i / 2u].z = 0.0;
    } else {
        onset_list[2u * pixel + i / 2u].x = 0.0;
    }
}
