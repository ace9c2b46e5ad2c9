// Slot @phase: one Henyey–Greenstein lobe.
//!use core/params
//!use core/rng
//!use phase/lobe

// Per steradian, by the cosine between the directions of travel.
fn phase_value(cos_theta: f32) -> f32 {
    return lobe_value(params.g, cos_theta);
}

// The cosine of a scattering angle with that density.
fn phase_cosine(rng: ptr<function, Rng>) -> f32 {
    return lobe_cosine(params.g, rng_next(rng));
}
