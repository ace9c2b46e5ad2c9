// For flights of tentative collisions: no walk inside a segment.
//!use core/ray
//!use track/count

fn flight_walk(
    flight: ptr<function, Flight>,
    ray: Ray,
    far: f32,
    segment: Segment,
    depth: ptr<function, f32>,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) -> f32 {
    return far;
}
