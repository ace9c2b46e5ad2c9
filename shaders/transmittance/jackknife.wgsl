// Slot @transmittance: two marches whose difference removes most of the bias of either (Peters 2025):
// exp(−(X₁ + X₂)/2) · cos((X₁ − X₂)/2), exact for normally distributed X. Biased.
//!slot spectrum
//!use majorant/segment
//!use transmittance/walk
//!use track/march

// Optical depths so far by either march, over the factors of the channels.
struct Transmittance {
    first: f32,
    second: f32,
}

fn transmittance_begin() -> Transmittance {
    return Transmittance(0.0, 0.0);
}

fn transmittance_value(t: Transmittance) -> Spectrum {
    let mean = spectrum_extinction() * (0.5 * (t.first + t.second));
    return exp(-mean) * cos(spectrum_extinction() * (0.5 * (t.first - t.second)));
}

// The segment from `ray.t` to `far`.
fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
    (*t).first += march_depth(ray, far, segment, rng, count);
    (*t).second += march_depth(ray, far, segment, rng, count);
}
