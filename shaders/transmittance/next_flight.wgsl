// Slot @transmittance: the next-flight estimator: at each tentative collision the majorant's transmittance of all that is
// left, times the null shares so far (tracking.md §2.10). The sum decays along the ray, so that one pass is enough.
//!slot spectrum
//!use majorant/segment
//!use transmittance/collide

struct Transmittance {
    product: Spectrum,  // of null shares
    sum: Spectrum,      // of products, each times the majorant's transmittance since
}

fn transmittance_begin() -> Transmittance {
    return Transmittance(Spectrum(1.0), Spectrum(1.0));
}

fn transmittance_value(t: Transmittance) -> Spectrum {
    return t.sum;
}

// Rate of tentative collisions over `params.sigma`.
fn transmittance_rate(segment: Segment) -> f32 {
    return segment.bound;
}

// A stretch of the segment, of length · sigma.
fn transmittance_pass(t: ptr<function, Transmittance>, segment: Segment, stretch: f32) {
    (*t).sum *= exp(-stretch * segment.bound);
}

// A tentative collision at a density; u is uniform in [0, 1).
fn transmittance_event(t: ptr<function, Transmittance>, segment: Segment, u: f32, density: f32) {
    (*t).product *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);
    (*t).sum += (*t).product;
}
