// The method of 2021, third pass of a frame: each pixel's path meets one of the frame before, found by the place where its own
// path scatters. Talbot's weights over two domains. Vertices keep their distance from the camera, and no Jacobian is known:
// both are the method's, and biased while the camera moves.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use reuse/frame
//!use aim/marched

@group(3) @binding(10) var<storage, read_write> reproject_near: array<vec4u>;
@group(3) @binding(11) var<storage, read_write> reproject_far: array<vec4u>;

const REPROJECT_STREAM: u32 = 0x297a2d39u;

fn reproject_load(pixel: u32) -> Reservoir {
    var c = vec4u(0u);
    var d = vec4u(0u);
    if (REUSE_SECOND) {
        c = reproject_far[2u * pixel];
        d = reproject_far[2u * pixel + 1u];
    }
    return reservoir_unpack(reproject_near[2u * pixel], reproject_near[2u * pixel + 1u], c, d);
}

// A path with its first vertex as far from another camera as it is; paths that meet nothing need no distance but the pixel's.
fn reproject_shift(path: Path, vertex: vec3f, view: View, elsewhere: f32) -> Path {
    var shifted = path;
    shifted.t = select(length(ray_world(vertex - view.origin)), elsewhere, path.kind == MARCHED_THROUGH);
    return marched_stay(shifted, vertex, view_at(view, shifted.t));
}

@compute @workgroup_size(8, 8)
fn reproject_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ REPROJECT_STREAM);
    var own = reservoir_load(pixel);
    let here = view_ray(position, VIEW_CENTRE);
    let vertex = view_at(here, own.path.t);

    params = params_vary(frame_previous, id.z);
    // Off the screen, and where a ray meets nothing: the same pixel.
    let place = view_place(vertex);
    let found = own.path.t > 0.0 && place.x >= 0.0;
    let q = select(position, min(vec2u(max(place, vec2f(0.0))), vec2u(params.width, params.height) - 1u), found);
    var old = reproject_load(q.y * params.width + q.x);
    let there = view_ray(q, VIEW_CENTRE);
    let old_vertex = view_at(there, old.path.t);
    let own_there = marched_value(q, reproject_shift(own.path, vertex, there, own.path.t));
    params = params_vary(params_uniform, id.z);
    let old_path = reproject_shift(old.path, old_vertex, here, own.path.t);
    let old_here = marched_value(position, old_path);

    let c = min(old.confidence, frame.cap);
    let own_part = own.confidence * own.aim;
    let own_m = own_part / max(own_part + c * own_there, 1e-37);
    let own_w = select(0.0, own_m * own.aim * own.weight, own.aim > 0.0);
    let old_part = c * old.aim;
    let old_m = old_part / max(old_part + own.confidence * old_here, 1e-37);
    let old_w = select(0.0, old_m * old_here * old.weight, old.aim > 0.0 && old_here > 0.0);
    let sum = own_w + old_w;
    if (rng_next(&rng) * sum < old_w) {
        own.path = old_path;
        own.aim = old_here;
        own.origin = RESERVOIR_HISTORY;
        own.age = old.age + 1u;
    }
    own.weight = select(0.0, sum / own.aim, own.aim > 0.0);
    own.confidence += c;
    reservoir_store(pixel, own);
}
