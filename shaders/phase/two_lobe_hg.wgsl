// Slot @phase: a mixture of two Henyey–Greenstein lobes.
//!use core/params
//!use core/rng
//!use phase/lobe

// Per steradian, by the cosine between the directions of travel.
fn phase_value(cos_theta: f32) -> f32 {
    return mix(lobe_value(params.g2, cos_theta), lobe_value(params.g, cos_theta), params.lobe_weight);
}

// The 1 − cosθ of a scattering angle with that density: a lobe by its weight, then its angle.
fn phase_drop(rng: ptr<function, Rng>) -> f32 {
    let g = select(params.g2, params.g, rng_next(rng) < params.lobe_weight);
    return lobe_drop(g, rng_next(rng));
}
