// Slot @majorant: a grid of cells, each with a majorant and a level. Level l means: walk the aligned cube of 2^l cells a
// side, whose majorant is stored. Level 0 everywhere is a uniform grid; a single cell is a global majorant.
// A grid of one level, a level grid and an octree differ in these words only. With MAJORANT_CONTROL the second channel
// holds control and residual bound. The walk keeps no state: every segment is found anew from the point where the ray is.
//!use core/params
//!use core/ray
//!use core/math
//!use majorant/segment

@group(1) @binding(2) var grid_cells: texture_3d<u32>;

const GRID_ORIGIN: f32 = 0.5;        // cells begin at the centre of the first texel
const GRID_LEVEL_BITS: u32 = 15u;    // low bits of a word: the level; the rest is the majorant, rounded up

// The bounds where the ray is; they hold to a t of more than `ray.t`.
fn majorant_segment(ray: Ray) -> Segment {
    // A nudge along each axis rather than along the ray: from a face that the ray hardly leaves, it would not get away.
    let nudge = select(vec3f(-params.epsilon), vec3f(params.epsilon), ray.direction > vec3f(0.0)) - GRID_ORIGIN;
    let p = ray_at(ray, ray.t) + nudge;
    let c = clamp(vec3i(floor(p * params.inv_cell)), vec3i(0), params.last_cell);
    let words = textureLoad(grid_cells, c, 0);
    let level = words.x & GRID_LEVEL_BITS;
    let side = params.cell * f32(1u << level);
    let low = vec3f(c >> vec3u(level)) * side + GRID_ORIGIN;
    let face = select(low, low + side, ray.direction > vec3f(0.0));
    let exit = math_min3((face - ray.origin) * ray.inverse);
    let bound = bitcast<f32>(words.x & ~GRID_LEVEL_BITS);
    let control = select(vec2f(0.0, bound), unpack2x16float(words.y), MAJORANT_CONTROL);
    return segment_new(bound, max(exit, ray.t + ray.epsilon), control.x, control.y);
}
