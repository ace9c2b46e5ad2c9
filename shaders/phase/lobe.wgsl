// One Henyey–Greenstein lobe (1941): p = (1 − g²) / (4π (1 + g² − 2g cosθ)^{3/2}), cosθ between directions of travel.
//!use core/math

fn lobe_value(g: f32, cos_theta: f32) -> f32 {
    let d = max(1.0 + g * g - 2.0 * g * cos_theta, 1e-12);
    return (1.0 - g * g) / (4.0 * MATH_PI * d * sqrt(d));
}

// The cosine at which the cumulative density is xi. Two forms of one map: the textbook's loses digits at small g, the
// other at large g.
fn lobe_cosine(g: f32, xi: f32) -> f32 {
    let q = 1.0 - 2.0 * xi;
    let n = 1.0 - g * q;
    let small = ((1.0 + g * g) * (0.5 * g * q * q - q) + 0.5 * g * (3.0 - g * g)) / (n * n);
    let s = (1.0 - g * g) / (1.0 - g + 2.0 * g * xi);
    let large = (1.0 + g * g - s * s) / (2.0 * select(g, 1.0, g == 0.0));
    return clamp(select(large, small, abs(g) < 0.5), -1.0, 1.0);
}
