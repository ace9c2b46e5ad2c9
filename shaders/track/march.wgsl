// Even steps through a segment.
//!use core/params
//!use core/rng
//!use core/ray
//!use track/count
//!use majorant/segment
//!slot medium

const MARCH_MOST: f32 = 8192.0;  // steps through one segment at most

// Steps from `ray.t` to `far` of at most `params.step`; none where nothing is.
fn march_steps(ray: Ray, far: f32, segment: Segment, count: ptr<function, Count>) -> u32 {
    let wanted = ceil((far - ray.t) / params.step);
    let steps = clamp(wanted, 1.0, MARCH_MOST);
    (*count).caps += select(0u, 1u, wanted > MARCH_MOST && segment.bound > 0.0);
    return select(0u, u32(steps), far > ray.t && segment.bound > 0.0);
}

// ∫ density dt · sigma from `ray.t` to `far` by one look at a random place in each step.
fn march_depth(ray: Ray, far: f32, segment: Segment, rng: ptr<function, Rng>, count: ptr<function, Count>) -> f32 {
    let steps = march_steps(ray, far, segment, count);
    let step = (far - ray.t) / f32(max(steps, 1u));
    var sum = 0.0;
    for (var i = 0u; i < steps; i++) {
        sum += medium_density(ray_at(ray, ray.t + (f32(i) + rng_next(rng)) * step));
    }
    (*count).lookups += steps;
    (*count).rounds += steps;
    return sum * step * params.sigma;
}

// The same by `steps` even looks, all shifted by the same share of a step.
fn march_comb(ray: Ray, far: f32, steps: u32, shift: f32) -> f32 {
    let step = (far - ray.t) / f32(steps);
    var sum = 0.0;
    for (var i = 0u; i < steps; i++) {
        sum += medium_density(ray_at(ray, ray.t + (f32(i) + shift) * step));
    }
    return sum * step * params.sigma;
}
