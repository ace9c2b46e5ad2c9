// Slot @phase: the same in all directions, 1/(4π).
//!use core/params
//!use core/math
//!use core/rng

// Per steradian, by the cosine between the directions of travel.
fn phase_value(cos_theta: f32) -> f32 {
    return 0.25 / MATH_PI;
}

// The 1 − cosθ of a scattering angle with that density.
fn phase_drop(rng: ptr<function, Rng>) -> f32 {
    return 2.0 * rng_next(rng);
}
