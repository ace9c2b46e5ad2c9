// Slot @phase: Rayleigh scattering, 3(1 + cos²θ)/(16π).
//!use core/params
//!use core/math
//!use core/rng

// Per steradian, by the cosine between the directions of travel.
fn phase_value(cos_theta: f32) -> f32 {
    return (3.0 / 16.0) * (1.0 + cos_theta * cos_theta) / MATH_PI;
}

// The 1 − cosθ of a scattering angle with that density: the root of c³ + 3c = 8ξ − 4 (Cardano).
fn phase_drop(rng: ptr<function, Rng>) -> f32 {
    let z = 4.0 * rng_next(rng) - 2.0;
    // For negative z the sum below would cancel: solve for |z| and restore the sign.
    let a = pow(abs(z) + sqrt(z * z + 1.0), 1.0 / 3.0);
    return clamp(1.0 - sign(z) * (a - 1.0 / a), 0.0, 2.0);
}
