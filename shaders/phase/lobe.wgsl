// One Henyey–Greenstein lobe (1941): p = (1 − g²) / (4π (1 + g² − 2g cosθ)^{3/2}), cosθ between directions of travel.
//!use core/math

fn lobe_value(g: f32, cos_theta: f32) -> f32 {
    let d = max(1.0 + g * g - 2.0 * g * cos_theta, 1e-12);
    return (1.0 - g * g) / (4.0 * MATH_PI * d * sqrt(d));
}

// The 1 − cosθ at which the cumulative density of cosθ is xi. With p = 2(1 − xi) the textbook's inverse becomes
// p (1−g)² (1 + g − gp/2) / (1 + g − gp)², which cancels nowhere: exact for g = 0, for sharp peaks, and at their tips.
fn lobe_drop(g: f32, xi: f32) -> f32 {
    let p = 2.0 * (1.0 - xi);
    let a = (1.0 - g) / (1.0 - g + 2.0 * g * xi);
    return min(p * a * a * (1.0 + g * (1.0 - 0.5 * p)), 2.0);
}
