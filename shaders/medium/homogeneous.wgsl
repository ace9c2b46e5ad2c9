// Slot @medium: density 1 everywhere in the box.
//!use core/ray

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    return 1.0;
}

// ∫ density dt from `a` to `b`, and its inverse: the t at which it reaches `depth`, from `a` on.
fn medium_depth(ray: Ray, a: f32, b: f32) -> f32 {
    return b - a;
}

fn medium_invert(ray: Ray, a: f32, depth: f32) -> f32 {
    return a + depth;
}
