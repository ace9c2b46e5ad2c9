// Slot @spectrum: the same extinction in all channels; one number does for the three, and there is nothing to weigh.
//!use core/rng

// A quantity of each channel.
alias Spectrum = f32;

// What a path remembers to weigh its channels.
struct SpectrumHero {
    rate: f32,  // extinction factor of the channel that draws the path
}

fn spectrum_hero(rng: ptr<function, Rng>) -> SpectrumHero {
    return SpectrumHero(1.0);
}

// A stretch of `depth` = ∫ rate dt over the factor of the strongest channel, ended by a collision or not.
fn spectrum_step(hero: ptr<function, SpectrumHero>, depth: f32, event: bool) {
}

// The weight of what the path carries.
fn spectrum_weight(hero: SpectrumHero) -> Spectrum {
    return 1.0;
}

// Extinction factors, greatest 1.
fn spectrum_extinction() -> Spectrum {
    return 1.0;
}

// The greatest magnitude.
fn spectrum_max(x: Spectrum) -> f32 {
    return abs(x);
}

fn spectrum_mean(x: Spectrum) -> f32 {
    return x;
}

// −log of the transmittance, channels averaged, of an optical depth of the strongest.
fn spectrum_depth(depth: f32) -> f32 {
    return depth;
}

// A quantity of each channel and a hero as three numbers, and back.
fn spectrum_pack(x: Spectrum) -> vec3f {
    return vec3f(x, 0.0, 0.0);
}

fn spectrum_unpack(v: vec3f) -> Spectrum {
    return v.x;
}

fn spectrum_pack_hero(hero: SpectrumHero) -> vec3f {
    return vec3f(hero.rate, 0.0, 0.0);
}

fn spectrum_unpack_hero(v: vec3f) -> SpectrumHero {
    return SpectrumHero(v.x);
}
