// Slot @medium: density linear along an axis.
//!use medium/profile

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    return max(profile_at(p), 0.0);
}

// ∫ density dt from `a` to `b`.
fn medium_depth(ray: Ray, a: f32, b: f32) -> f32 {
    return (b - a) * 0.5 * (medium_density(ray_at(ray, a)) + medium_density(ray_at(ray, b)));
}

// The t at which the integral from `a` on reaches `depth`. The root in the form that holds at slope 0 too
// (tracking.md §1.1); negative below the root, where the ray has too little left, so never asked for.
fn medium_invert(ray: Ray, a: f32, depth: f32) -> f32 {
    let start = medium_density(ray_at(ray, a));
    return a + 2.0 * depth / (start + sqrt(max(start * start + 2.0 * profile_slope(ray) * depth, 0.0)));
}
