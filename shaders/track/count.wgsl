// What tracking counts.

struct Count {
    lookups: u32,     // of the density
    nulls: u32,       // null collisions of free flights
    steps: u32,       // segments walked
    violations: u32,  // lookups above their bound
    rounds: u32,      // of loops inside segments
    caps: u32,        // segments in which fewer looks were taken than wanted
}
