// Slot @flight: analog decomposition tracking (Kutz et al. 2017). Of the tentative collisions the share control/majorant
// is real without a look at the density; the others are those of the residual. The law is delta tracking's, draw by draw;
// it takes a control that is nowhere above the density.
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
    return u * segment.bound >= segment.control;
}

// A tentative collision at a density, 0 where it was not looked at; whether it is real.
fn flight_event(flight: ptr<function, Flight>, segment: Segment, u: f32, density: f32) -> bool {
    return u * segment.bound < max(density, segment.control);
}
