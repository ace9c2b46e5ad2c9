// Slot @transmittance: ray marching with a random place in each step; biased by the size of the steps.
//!use transmittance/depth
//!use track/march

// The segment from `ray.t` to `far`.
fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
    (*t).depth += march_depth(ray, far, segment, rng, count);
}
