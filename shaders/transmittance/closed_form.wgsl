// Slot @transmittance: the closed form of analytic media (tracking.md §1.1).
//!use transmittance/depth
//!slot medium

// The segment from `ray.t` to `far`.
fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
    (*t).depth += medium_depth(ray, ray.t, far) * params.sigma;
}
