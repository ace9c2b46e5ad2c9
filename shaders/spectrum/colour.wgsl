// Slot @spectrum: coloured extinction. One channel, the hero, draws the path; the balance heuristic over the three
// channels that could have drawn it weighs each (Wilkie et al. 2014; Miller et al. 2019). With extinction μ_c = σ_c ρ and
// rate σ_c m of collisions, real and null collisions alike change the ratio of densities by σ_c/σ_hero, and a stretch of
// depth D = ∫ m dt by exp(−(σ_c − σ_hero) D): count and depth are all the path has to remember.
//!use core/params
//!use core/math
//!use core/rng

// A quantity of each channel.
alias Spectrum = vec3f;

// What a path remembers to weigh its channels.
struct SpectrumHero {
    rate: f32,    // extinction factor of the hero channel
    depth: f32,   // ∫ m dt so far
    events: f32,  // collisions so far
}

// Stands for log 0: a channel that does not interact keeps no weight after a collision.
const SPECTRUM_LOG_ZERO: f32 = -1e4;
// The optical depth below which its first power is more precise than a logarithm of a mean near 1.
const SPECTRUM_THIN: f32 = 1e-3;

fn spectrum_log(x: vec3f) -> vec3f {
    return select(log(x), vec3f(SPECTRUM_LOG_ZERO), x <= vec3f(0.0));
}

fn spectrum_hero(rng: ptr<function, Rng>) -> SpectrumHero {
    let hero = min(u32(rng_next(rng) * 3.0), 2u);
    return SpectrumHero(params.extinction[hero], 0.0, 0.0);
}

// A stretch of `depth` = ∫ m dt, ended by a collision or not.
fn spectrum_step(hero: ptr<function, SpectrumHero>, depth: f32, event: bool) {
    (*hero).depth += depth;
    (*hero).events += select(0.0, 1.0, event);
}

// The weight of what the path carries, for each channel: p_c / mean(p).
fn spectrum_weight(hero: SpectrumHero) -> Spectrum {
    let log_p = spectrum_log(params.extinction) * hero.events - params.extinction * hero.depth;
    let p = exp(log_p - math_max3(log_p));
    return p / math_mean3(p);
}

// Extinction factors, greatest 1.
fn spectrum_extinction() -> Spectrum {
    return params.extinction;
}

// The greatest magnitude.
fn spectrum_max(x: Spectrum) -> f32 {
    return math_max3(abs(x));
}

fn spectrum_mean(x: Spectrum) -> f32 {
    return math_mean3(x);
}

// −log of the transmittance, channels averaged, of an optical depth of the strongest.
fn spectrum_depth(depth: f32) -> f32 {
    let mean = -log(math_mean3(exp(-params.extinction * depth)));
    return select(mean, math_mean3(params.extinction) * depth, depth < SPECTRUM_THIN);
}

// A quantity of each channel and a hero as three numbers, and back.
fn spectrum_pack(x: Spectrum) -> vec3f {
    return x;
}

fn spectrum_unpack(v: vec3f) -> Spectrum {
    return v;
}

fn spectrum_pack_hero(hero: SpectrumHero) -> vec3f {
    return vec3f(hero.rate, hero.depth, hero.events);
}

fn spectrum_unpack_hero(v: vec3f) -> SpectrumHero {
    return SpectrumHero(v.x, v.y, v.z);
}
