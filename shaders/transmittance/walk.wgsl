// For estimators that walk through the density: no tentative collisions.
//!use core/ray
//!use core/rng
//!use track/count

fn transmittance_rate(segment: Segment) -> f32 {
    return 0.0;
}

fn transmittance_pass(t: ptr<function, Transmittance>, segment: Segment, stretch: f32) {
}

fn transmittance_event(t: ptr<function, Transmittance>, segment: Segment, u: f32, density: f32) {
}
