// For estimators of tentative collisions: no walk inside a segment.
//!use core/ray
//!use track/count

fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
}
