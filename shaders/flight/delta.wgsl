// Slot @flight: delta tracking (Woodcock 1965). Unbiased where the majorant bounds; all weights of the channels are the
// hero's.
//!use flight/hero
//!use flight/collide

// Rate of tentative collisions over `params.sigma`.
fn flight_rate(flight: Flight, segment: Segment) -> f32 {
    return segment.bound * flight.rate;
}

// A stretch of the segment, of length · sigma, ended by a tentative collision or not.
fn flight_pass(flight: ptr<function, Flight>, segment: Segment, stretch: f32, collides: bool) {
    spectrum_step(flight, stretch * segment.bound, collides);
}

// Whether a collision needs the density to be decided; u is uniform in [0, 1).
fn flight_looks(flight: Flight, segment: Segment, u: f32) -> bool {
    return true;
}

// A tentative collision at a density; whether it is real.
fn flight_event(flight: ptr<function, Flight>, segment: Segment, u: f32, density: f32) -> bool {
    return u * segment.bound < density;
}
