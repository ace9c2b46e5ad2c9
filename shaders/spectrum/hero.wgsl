// Slot @spectrum: coloured extinction. One channel, the hero, draws the path; the balance heuristic over the three
// channels that could have drawn it weighs each (Wilkie et al. 2014; Miller et al. 2019). With extinction μ_c = σ_c ρ and
// majorant σ_c m, real and null collisions alike change the ratio of densities by σ_c/σ_hero, and a stretch of
// majorant depth D = ∫ m dt by exp(−(σ_c − σ_hero) D): count and depth are all the path has to remember.
//!use core/params
//!use core/math

struct Spectrum {
    rate: f32,    // σ of the hero channel
    depth: f32,   // ∫ majorant dt · sigma so far
    events: f32,  // tentative collisions so far
}

// Stands for log 0: a channel that does not interact keeps no weight after a collision.
const SPECTRUM_LOG_ZERO: f32 = -1e4;

fn spectrum_log(x: vec3f) -> vec3f {
    return select(log(x), vec3f(SPECTRUM_LOG_ZERO), x <= vec3f(0.0));
}

fn spectrum_start(u: f32) -> Spectrum {
    let hero = min(u32(u * 3.0), 2u);
    return Spectrum(params.extinction[hero], 0.0, 0.0);
}

// A tentative collision after `depth` = ∫ majorant dt · sigma, or a stretch without one.
fn spectrum_step(s: ptr<function, Spectrum>, depth: f32, event: bool) {
    (*s).depth += depth;
    (*s).events += select(0.0, 1.0, event);
}

// The weight of what the path carries, for each channel: p_c / mean(p).
fn spectrum_weight(s: Spectrum) -> vec3f {
    let log_p = spectrum_log(params.extinction) * s.events - params.extinction * s.depth;
    let p = exp(log_p - math_max3(log_p));
    return p / math_mean3(p);
}

// The transmittance of a shadow ray, one number a channel.
fn spectrum_clear() -> vec3f {
    return vec3f(1.0);
}

// The factor that a null collision of a shadow ray leaves, from density over majorant. Shadow rays are driven by the
// strongest channel, whose factor is 1.
fn spectrum_ratio(share: f32) -> vec3f {
    return vec3f(1.0) - params.extinction * share;
}

fn spectrum_strongest(transmittance: vec3f) -> f32 {
    return math_max3(transmittance);
}
