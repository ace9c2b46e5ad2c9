// Slot @flight: regular tracking, exact: from cell to cell of the interpolated density.
//!use flight/walk
//!use medium/dual

const FLIGHT_TAPS: u32 = 2u;    // lookups of a cell that is passed
const FLIGHT_ROOT: u32 = 4u;    // of one that holds the collision

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
    var t = ray.t;
    while (t < far && segment.bound > 0.0) {
        let next = min(dual_exit(ray, t), far);
        let whole = dual_depth(ray, t, next);
        (*count).lookups += FLIGHT_TAPS;
        (*count).rounds += 1u;
        let hit = whole * rate > *depth;
        let passed = select(whole, *depth / rate, hit);
        spectrum_step(flight, passed * params.sigma, hit);
        if (hit) {
            *depth = FLIGHT_SPENT;
            (*count).lookups += FLIGHT_ROOT;
            (*count).rounds += DUAL_ROUNDS;
            return dual_invert(ray, t, next, passed);
        }
        *depth -= whole * rate;
        t = next;
    }
    return far;
}
