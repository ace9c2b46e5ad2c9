// Slot @transmittance: regular tracking, exact: from cell to cell of the interpolated density.
//!use transmittance/depth
//!use medium/dual

const TRANSMITTANCE_TAPS: u32 = 2u;  // lookups of a cell

// The segment from `ray.t` to `far`.
fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
    var start = ray.t;
    while (start < far && segment.bound > 0.0) {
        let next = min(dual_exit(ray, start), far);
        (*t).depth += dual_depth(ray, start, next) * params.sigma;
        (*count).lookups += TRANSMITTANCE_TAPS;
        (*count).rounds += 1u;
        start = next;
    }
}
