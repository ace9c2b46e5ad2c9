// Neighbours' paths are merged: one of those that a pixel meets is kept.
//!use core/params
//!use core/rng
//!use reuse/pairwise

@group(3) @binding(10) var<storage, read_write> merge_near: array<vec4u>;
@group(3) @binding(11) var<storage, read_write> merge_far: array<vec4u>;

const MERGE_STREAM: u32 = 0x1b56c4e9u;

@compute @workgroup_size(8, 8)
fn merge_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ MERGE_STREAM);
    var kept = reservoir_load(pixel);
    var all = pairwise_begin(position, kept, frame);
    var sum = 0.0;
    for (var round = 0u; round < frame.neighbours; round++) {
        let offer = pairwise_meet(&all, position, round, frame);
        sum += offer.w;
        if (rng_next(&rng) * sum < offer.w) {
            kept.path = offer.path;
            kept.aim = offer.aim;
            kept.origin = RESERVOIR_NEIGHBOUR;
            kept.age = offer.age;
        }
    }
    let own_w = pairwise_own(all).w;
    sum += own_w;
    if (rng_next(&rng) * sum < own_w) {
        kept = all.own;
    }
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    kept.confidence = all.total;

    let words = reservoir_pack(kept);
    merge_near[2u * pixel] = words[0];
    merge_near[2u * pixel + 1u] = words[1];
    if (REUSE_SECOND) {
        let far = reservoir_pack_far(kept.path);
        merge_far[2u * pixel] = far[0];
        merge_far[2u * pixel + 1u] = far[1];
    }
}
