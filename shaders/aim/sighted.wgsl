// Slot @aim: what a path is worth to a pixel, its legs looked along from afar.
//!use reuse/target

// What the known factors of a path make of it.
fn aim_strength(parts: Target) -> f32 {
    return target_strength(parts);
}

// The transmittance of all legs, of which flights have `seen` that to the last vertex.
fn aim_legs(pixel: vec2u, path: Path, parts: Target, seen: f32) -> f32 {
    if (path.kind == RESERVOIR_FROZEN) {
        return seen;
    }
    return seen * target_seen(parts, path.t, parts.legs);
}
