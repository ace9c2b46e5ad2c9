// What estimators share that add up an optical depth.
//!slot spectrum
//!use majorant/segment
//!use transmittance/walk

// The optical depth so far, over the factors of the channels.
struct Transmittance {
    depth: f32,
}

fn transmittance_begin() -> Transmittance {
    return Transmittance(0.0);
}

fn transmittance_value(t: Transmittance) -> Spectrum {
    return exp(-spectrum_extinction() * t.depth);
}
