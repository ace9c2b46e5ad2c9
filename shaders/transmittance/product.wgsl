// What estimators share that are a product over segments or collisions.
//!slot spectrum
//!use majorant/segment

alias Transmittance = Spectrum;

fn transmittance_begin() -> Transmittance {
    return Transmittance(1.0);
}

fn transmittance_value(t: Transmittance) -> Spectrum {
    return t;
}
