// Slot @medium: density 1 everywhere in the box.

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    return 1.0;
}
