// The way to a second vertex: from one of the distances at which a ray may scatter, on to where reuse/suffix takes over.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use light/toward
//!slot proxy
//!use reuse/leg
//!use reuse/target

// One distance of those offered.
struct Onset {
    t: f32,
    strength: f32,
    sum: f32,       // of strength over density
}

// Offers a distance of a strength, drawn with a density.
fn onset_offer(onset: ptr<function, Onset>, t: f32, strength: f32, density: f32, u: f32) {
    let share = select(0.0, strength / density, density > 0.0);
    (*onset).sum += share;
    if (u * (*onset).sum < share) {
        (*onset).t = t;
        (*onset).strength = strength;
    }
}

// A scattering and a flight from afar, so that its density is known. Leaves for reuse/suffix: second vertex, distance;
// 1 / density, and the sum of weights so far.
fn onset_go(pixel: u32, view: View, onset: Onset, sum: f32, rng: ptr<function, Rng>) {
    let vertex = view.origin + ray_local(view.world) * onset.t;
    let onward = toward_sample(vertex, view.world, rng);
    let walk = ray_new(vertex, onward);
    let leg = leg_flight(walk, select(0.0, proxy_end(walk), onset.strength > 0.0), true, rng_next(rng));
    let second = ray_at(walk, leg.t);
    // Per volume: density · r² is the density along the leg.
    let inverse = onset.sum / onset.strength * leg.t * leg.t / (toward_pdf(vertex, view.world, onward) * leg.density);
    let found = leg.met && target_density(second) > 0.0 && inverse > 0.0 && inverse < MATH_FAR;
    reservoir_far[2u * pixel] = vec4u(bitcast<vec3u>(second), bitcast<u32>(onset.t));
    reservoir_far[2u * pixel + 1u] = vec4u(bitcast<u32>(select(0.0, inverse, found)), bitcast<u32>(sum), 0u, 0u);
}
