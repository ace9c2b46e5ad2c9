// Slot @phase: one Henyey–Greenstein lobe.
//!use core/params
//!use core/rng
//!use phase/lobe

// Per steradian, by the cosine between the directions of travel.
fn phase_value(cos_theta: f32) -> f32 {
    return lobe_value(params.g, cos_theta);
}

// The 1 − cosθ of a scattering angle with that density.
fn phase_drop(rng: ptr<function, Rng>) -> f32 {
    return lobe_drop(params.g, rng_next(rng));
}
