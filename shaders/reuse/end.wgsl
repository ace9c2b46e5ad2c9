// How paths end: a light sample, or a direction that scattering chooses.
//!use core/params
//!use core/rng
//!use core/math
//!slot phase
//!use light/light
//!use light/toward
//!use reuse/reservoir

// Whether scattering may find light.
fn end_finds() -> bool {
    return LIGHT_HAS_MAP || LIGHT_HAS_DISC || math_max3(params.constant_radiance) > 0.0;
}

// The end of a path in the direction that scattering chooses after travelling along `before`, at a vertex `deeper` after the first;
// and the density that drew it.
fn end_scattered(path: ptr<function, Path>, before: vec3f, deeper: u32, rng: ptr<function, Rng>) -> f32 {
    (*path).kind = deeper + RESERVOIR_ESCAPE;
    (*path).omega = reservoir_unfold(reservoir_fold(toward_turn(before, rng)));
    return phase_value(dot(before, (*path).omega));
}

// The end of a path at a vertex (local space), `deeper` after the first, by a light sample; and the density that drew it.
fn end_lit(path: ptr<function, Path>, vertex: vec3f, deeper: u32, rng: ptr<function, Rng>) -> f32 {
    let sample = light_sample(vertex, rng);
    (*path).kind = deeper + select(RESERVOIR_DELTA, RESERVOIR_BRIGHT, sample.pdf > 0.0);
    (*path).id = sample.id;
    (*path).omega = reservoir_unfold(reservoir_fold(sample.direction));
    // Where rounding takes a direction over a disc's edge, it has the density of where it is.
    return select(sample.share, light_pdf((*path).omega), sample.pdf > 0.0);
}
