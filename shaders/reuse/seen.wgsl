// The true transmittance of a path: of all its legs together, from the camera on.
//!use core/params
//!use core/rng
//!use core/ray
//!use track/comb
//!use track/exact
//!use reuse/target

const SEEN_SPACING: f32 = 2.0;    // optical depth of the majorant between looks, times the setting's walks
const SEEN_DEEP: f32 = 0.1;       // the same as a share of a leg's own, for legs that hardly let light through

// Exactly. One loop for all legs: those of neighbouring pixels are of different lengths, together less so.
fn seen_exactly(parts: Target, t: f32, count: ptr<function, Count>) -> Spectrum {
    let deep = EXACT_DEEP / params.proxy_weakest;
    var depth = 0.0;
    var i = 0u;
    var way = target_way(parts, t, i);
    if (PROXY_EXACT) {
        for (; i <= parts.legs; i++) {
            way = target_way(parts, t, i);
            depth += exact_depth(way.ray, min(way.ray.exit, way.reach), deep, count);
        }
        return exp(-spectrum_extinction() * depth);
    }
    var walk = exact_begin(way.ray, way.reach);
    while (i <= parts.legs && depth <= deep) {
        if (exact_goes_on(walk)) {
            depth += exact_step(&walk, count);
        } else {
            i += 1u;
            way = target_way(parts, t, i);
            walk = exact_begin(way.ray, way.reach);
        }
    }
    return exp(-spectrum_extinction() * depth);
}

// An unbiased estimate, by so many looks for each SEEN_SPACING of the majorant's optical depth.
fn seen_by_looks(
    parts: Target, t: f32, walks: u32, rng: ptr<function, Rng>, count: ptr<function, Count>,
) -> Spectrum {
    var seen = Spectrum(1.0);
    for (var i = 0u; i <= parts.legs; i++) {
        let way = target_way(parts, t, i);
        let near = exact_near(way.ray, way.reach);
        let spacing = max(SEEN_SPACING / f32(walks), SEEN_DEEP * leg_march(near, near.exit).depth);
        seen *= comb_transmittance(near, near.exit, spacing, rng, count);
    }
    return seen;
}
