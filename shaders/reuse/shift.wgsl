// Shift maps: a path of one pixel, or of the frame before, as a path of another. Each has an exact inverse.
//!use core/params
//!use core/math
//!use reuse/view
//!use reuse/reservoir

// The path whose first vertex moves from `before` to `after` (local space): all others move with it, so that its legs stay. But
// where what reaches the third is frozen, that one does not move.
fn shift_follow(path: Path, before: vec3f, after: vec3f) -> Path {
    var moved = path;
    if (REUSE_SECOND) {
        moved.third -= select(vec3f(0.0), ray_world(after - before), path.kind == RESERVOIR_FROZEN);
    }
    return moved;
}

// Whether the third vertex may stay: the leg to it is long against the way, before and after. That is the same question from
// either side, so the inverse is defined where the map is.
fn shift_keeps(path: Path, before: vec3f, after: vec3f, least: f32) -> bool {
    if (!REUSE_SECOND || path.kind != RESERVOIR_FROZEN) {
        return true;
    }
    let moved = ray_world(after - before);
    let a = path.third;
    let b = a - moved;
    return min(dot(a, a), dot(b, b)) >= least * least * dot(moved, moved);
}

// The distance along ray `b` of the point nearest to that at distance t along ray `a`, by an affine map: t' = d'·(o − o') + κt
// with κ = d·d' = dt'/dt. Both in the local space of one frame.
struct ShiftAffine {
    kappa: f32,
    offset: f32,
}

fn shift_affine(a: View, b: View) -> ShiftAffine {
    return ShiftAffine(dot(a.world, b.world), dot(b.world, ray_world(a.origin - b.origin)));
}
