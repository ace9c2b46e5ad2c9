// Slot @flight: the closed form of analytic media (tracking.md §1.1).
//!use flight/walk
//!slot medium

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
    let whole = medium_depth(ray, ray.t, far);
    let hit = whole * rate > *depth;
    let passed = select(whole, *depth / rate, hit);
    spectrum_step(flight, passed * params.sigma, hit);
    *depth = select(*depth - whole * rate, FLIGHT_SPENT, hit);
    return select(far, clamp(medium_invert(ray, ray.t, passed), ray.t, far), hit);
}
