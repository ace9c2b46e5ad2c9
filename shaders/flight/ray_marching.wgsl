// Slot @flight: ray marching with a random place in each step; biased by the size of the steps.
//!use flight/walk
//!use track/march

// From `ray.t` to `far`: the t of the collision, where `depth`, the optical depth left over the hero's factor, is used up
// (FLIGHT_SPENT); else `far`.
fn flight_walk(
    flight: ptr<function, Flight>,
    ray: Ray,
    far: f32,
    segment: Segment,
    depth: ptr<function, f32>,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) -> f32 {
    let rate = params.sigma * (*flight).rate;
    let steps = march_steps(ray, far, segment, count);
    let step = (far - ray.t) / f32(max(steps, 1u));
    for (var i = 0u; i < steps; i++) {
        let start = ray.t + f32(i) * step;
        let density = medium_density(ray_at(ray, start + rng_next(rng) * step));
        (*count).lookups += 1u;
        (*count).rounds += 1u;
        let whole = density * step;
        let hit = whole * rate > *depth;
        let passed = select(whole, *depth / rate, hit);
        spectrum_step(flight, passed * params.sigma, hit);
        if (hit) {
            *depth = FLIGHT_SPENT;
            return start + passed / density;
        }
        *depth -= whole * rate;
    }
    return far;
}
