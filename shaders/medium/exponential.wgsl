// Slot @medium: density exp(−h / scale height), h along an axis.
//!use medium/profile

const MEDIUM_FLAT: f32 = 1e-4;  // change of the exponent below which a stretch is taken as even

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    return exp(-profile_at(p));
}

// ∫ density dt from `a` to `b`.
fn medium_depth(ray: Ray, a: f32, b: f32) -> f32 {
    let slope = profile_slope(ray);
    let x = slope * (b - a);
    let start = medium_density(ray_at(ray, a));
    if (abs(x) < MEDIUM_FLAT) {
        return start * (b - a) * (1.0 - 0.5 * x);
    }
    return (start - medium_density(ray_at(ray, b))) / slope;
}

// The t at which the integral from `a` on reaches `depth`.
fn medium_invert(ray: Ray, a: f32, depth: f32) -> f32 {
    let slope = profile_slope(ray);
    let even = depth / medium_density(ray_at(ray, a));
    let x = slope * even;
    if (abs(x) < MEDIUM_FLAT) {
        return a + even * (1.0 + 0.5 * x);
    }
    return a - log(max(1.0 - x, 0x1p-126)) / slope;
}
