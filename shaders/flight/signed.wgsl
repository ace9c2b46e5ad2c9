// What flights share whose tentative collisions carry weights: any probabilities do, and the majorant need not bound
// (tracking.md §1.6, §1.8; Galtier et al. 2013, Kutz et al. 2017). `flight_measure` makes one flight differ from another.
//!slot spectrum
//!use majorant/segment
//!use flight/collide

// The weight of the path in each channel.
alias Flight = Spectrum;

fn flight_start(rng: ptr<function, Rng>) -> Flight {
    return Flight(1.0);
}

fn flight_weight(flight: Flight) -> Spectrum {
    return flight;
}

// Rate of tentative collisions over `params.sigma`.
fn flight_rate(flight: Flight, segment: Segment) -> f32 {
    return segment.bound;
}

// A stretch of the segment: nothing to remember.
fn flight_pass(flight: ptr<function, Flight>, segment: Segment, stretch: f32, collides: bool) {
}

// Takes one of two events by u, in proportion to their measures; whether it was the first. `scale` is one over the chance
// to be asked.
fn flight_choose(flight: ptr<function, Flight>, first: Spectrum, second: Spectrum, u: f32, scale: f32) -> bool {
    let a = flight_measure(*flight, first);
    let b = flight_measure(*flight, second);
    let chance = a / max(a + b, 0x1p-126);
    let is_first = u < chance;
    *flight *= scale * select(second / (1.0 - chance), first / chance, is_first);
    return is_first;
}

// The state as three numbers, and back.
fn flight_pack(flight: Flight) -> vec3f {
    return spectrum_pack(flight);
}

fn flight_unpack(v: vec3f) -> Flight {
    return spectrum_unpack(v);
}
