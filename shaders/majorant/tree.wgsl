// Slot @majorant: a kd-tree, flattened: every finest cell holds the bounds of the leaf that it lies in and where that
// leaf begins and ends, so that a walk needs one fetch a leaf and no stack.
//!use core/params
//!use core/ray
//!use core/math
//!use majorant/segment

@group(1) @binding(2) var tree_cells: texture_3d<u32>;

const TREE_ORIGIN: f32 = 0.5;       // cells begin at the centre of the first texel
const TREE_SPAN_BITS: u32 = 5u;     // bits of each of the six numbers that tell a leaf's place
const TREE_SPAN: u32 = 31u;

// The bounds where the ray is; they hold to a t of more than `ray.t`.
fn majorant_segment(ray: Ray) -> Segment {
    let nudge = select(vec3f(-params.epsilon), vec3f(params.epsilon), ray.direction > vec3f(0.0)) - TREE_ORIGIN;
    let p = ray_at(ray, ray.t) + nudge;
    let c = clamp(vec3i(floor(p * params.inv_cell)), vec3i(0), params.last_cell);
    let words = textureLoad(tree_cells, c, 0);
    let shifts = vec3u(0u, TREE_SPAN_BITS, 2u * TREE_SPAN_BITS);
    let before = vec3i((vec3u(words.y) >> shifts) & vec3u(TREE_SPAN));
    let span = vec3i((vec3u(words.y) >> (shifts + 3u * TREE_SPAN_BITS)) & vec3u(TREE_SPAN)) + 1;
    let low = vec3f(c - before) * params.cell + TREE_ORIGIN;
    let face = select(low, low + vec3f(span) * params.cell, ray.direction > vec3f(0.0));
    let exit = math_min3((face - ray.origin) * ray.inverse);
    let control = unpack2x16float(words.z);
    return segment_new(bitcast<f32>(words.x), max(exit, ray.t + ray.epsilon), control.x, control.y);
}
