// What flights share that draw one channel and weigh the others (slot @spectrum): their state is the hero's.
//!slot spectrum
//!use majorant/segment

alias Flight = SpectrumHero;

fn flight_start(rng: ptr<function, Rng>) -> Flight {
    return spectrum_hero(rng);
}

fn flight_weight(flight: Flight) -> Spectrum {
    return spectrum_weight(flight);
}

// The state as three numbers, and back.
fn flight_pack(flight: Flight) -> vec3f {
    return spectrum_pack_hero(flight);
}

fn flight_unpack(v: vec3f) -> Flight {
    return spectrum_unpack_hero(v);
}
