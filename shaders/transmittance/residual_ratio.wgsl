// Slot @transmittance: residual ratio tracking (Novák et al. 2014): the control in closed form, ratio tracking for what is
// left. With a control above the density the estimate may be above 1 or below 0.
//!slot spectrum
//!use majorant/segment
//!use transmittance/collide

struct Transmittance {
    product: Spectrum,  // of the residual's collisions
    control: f32,       // ∫ control dt · sigma
}

fn transmittance_begin() -> Transmittance {
    return Transmittance(Spectrum(1.0), 0.0);
}

fn transmittance_value(t: Transmittance) -> Spectrum {
    return t.product * exp(-spectrum_extinction() * t.control);
}

// Rate of tentative collisions over `params.sigma`.
fn transmittance_rate(segment: Segment) -> f32 {
    return segment.residual;
}

// A stretch of the segment, of length · sigma.
fn transmittance_pass(t: ptr<function, Transmittance>, segment: Segment, stretch: f32) {
    (*t).control += stretch * segment.control;
}

// A tentative collision at a density; u is uniform in [0, 1).
fn transmittance_event(t: ptr<function, Transmittance>, segment: Segment, u: f32, density: f32) {
    (*t).product *= Spectrum(1.0) - spectrum_extinction() * ((density - segment.control) / segment.residual);
}
