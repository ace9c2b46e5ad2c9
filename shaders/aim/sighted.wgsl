// Slot @aim: what a path is worth to a pixel, both legs looked along from afar.
//!use reuse/target

// What the known factors of a path make of it.
fn aim_strength(parts: Target) -> f32 {
    return target_strength(parts);
}

// The transmittance of both legs.
fn aim_legs(pixel: vec2u, path: Path, parts: Target) -> f32 {
    return target_camera(pixel, path.film, path.t) * target_onward(parts, 1.0);
}
