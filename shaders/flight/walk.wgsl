// For flights that walk through the density and invert its integral: no tentative collisions.
//!use flight/hero
//!use core/ray
//!use track/count

// The depth that a walk leaves when it found its collision.
const FLIGHT_SPENT: f32 = -1.0;

fn flight_rate(flight: Flight, segment: Segment) -> f32 {
    return 0.0;
}

fn flight_pass(flight: ptr<function, Flight>, segment: Segment, stretch: f32, collides: bool) {
}

fn flight_looks(flight: Flight, segment: Segment, u: f32) -> bool {
    return true;
}

fn flight_event(flight: ptr<function, Flight>, segment: Segment, u: f32, density: f32) -> bool {
    return false;
}
