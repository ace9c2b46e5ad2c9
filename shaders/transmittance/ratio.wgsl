// Slot @transmittance: ratio tracking (Novák et al. 2014). Unbiased for any majorant above 0.
//!use transmittance/product
//!use transmittance/collide

// Rate of tentative collisions over `params.sigma`.
fn transmittance_rate(segment: Segment) -> f32 {
    return segment.bound;
}

// A stretch of the segment, of length · sigma.
fn transmittance_pass(t: ptr<function, Transmittance>, segment: Segment, stretch: f32) {
}

// A tentative collision at a density; u is uniform in [0, 1).
fn transmittance_event(t: ptr<function, Transmittance>, segment: Segment, u: f32, density: f32) {
    *t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);
}
