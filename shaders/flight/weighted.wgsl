// Tentative collisions of signed flights: real with extinction μ, null with majorant − μ, which may be below 0.
//!use flight/signed

// Whether a collision needs the density to be decided.
fn flight_looks(flight: Flight, segment: Segment, u: f32) -> bool {
    return true;
}

// A tentative collision at a density; whether it is real.
fn flight_event(flight: ptr<function, Flight>, segment: Segment, u: f32, density: f32) -> bool {
    let real = spectrum_extinction() * (density / segment.bound);
    return flight_choose(flight, real, Spectrum(1.0) - real, u, 1.0);
}
