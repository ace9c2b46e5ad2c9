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
