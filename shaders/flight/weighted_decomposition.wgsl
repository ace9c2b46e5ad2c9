// Slot @flight: weighted decomposition tracking (Kutz et al. 2017): the control may lie above the density, where the
// residual is below 0. Weights are unbounded.
//!use flight/signed

// The most that is left to the control, so that the residual keeps a chance.
const FLIGHT_MOST_CONTROL: f32 = 0.95;

// The chance that a collision is the control's: by what the path would carry on, as spectral tracking with history does; for
// grey extinction control over majorant.
fn flight_control(flight: Flight, segment: Segment) -> f32 {
    let control = spectrum_extinction() * (segment.control / segment.bound);
    let a = flight_measure(flight, control);
    let b = flight_measure(flight, Spectrum(1.0) - control);
    return min(a / max(a + b, 0x1p-126), FLIGHT_MOST_CONTROL);
}

fn flight_measure(weight: Spectrum, event: Spectrum) -> f32 {
    return spectrum_mean(abs(weight * event));
}

// Whether a collision needs the density to be decided; u is uniform in [0, 1).
fn flight_looks(flight: Flight, segment: Segment, u: f32) -> bool {
    return u >= flight_control(flight, segment);
}

// A tentative collision at a density, 0 where it was not looked at; whether it is real.
fn flight_event(flight: ptr<function, Flight>, segment: Segment, u: f32, density: f32) -> bool {
    let chance = flight_control(*flight, segment);
    if (u < chance) {
        *flight *= spectrum_extinction() * (segment.control / (segment.bound * chance));
        return true;
    }
    let residual = spectrum_extinction() * ((density - segment.control) / segment.bound);
    let nothing = Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);
    return flight_choose(flight, residual, nothing, (u - chance) / (1.0 - chance), 1.0 / (1.0 - chance));
}
