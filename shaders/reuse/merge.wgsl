// Neighbours' paths are merged by pairwise MIS with a defensive share of the pixel's own (Bitterli 2022; Lin et al. 2022).
// With the aims of both paths at both places known, nothing is evaluated but what was chosen.
//!use core/params
//!use core/rng
//!use reuse/pair

@group(3) @binding(10) var<storage, read_write> merge_near: array<vec4u>;
@group(3) @binding(11) var<storage, read_write> merge_far: array<vec4u>;

const MERGE_STREAM: u32 = 0x1b56c4e9u;

@compute @workgroup_size(8, 8)
fn merge_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixels = params.width * params.height;
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ MERGE_STREAM);
    var kept = reservoir_load(pixel);
    let own = kept;

    var others = 0.0;  // C: confidence of all partners
    for (var round = 0u; round < frame.neighbours; round++) {
        let partner = pair_partner(position, round, frame);
        let q = vec2u(max(partner, vec2i(0)));
        let confidence = bitcast<f32>(reservoir_near[2u * (q.y * params.width + q.x) + 1u].w);
        others += select(0.0, confidence, partner.x >= 0);
    }
    let total = own.confidence + others;
    let own_part = own.confidence * own.aim;
    var own_m = own.confidence / total;
    var sum = 0.0;
    for (var round = 0u; round < frame.neighbours; round++) {
        let partner = pair_partner(position, round, frame);
        let q = vec2u(max(partner, vec2i(0)));
        let other_pixel = q.y * params.width + q.x;
        var other = reservoir_load(other_pixel);
        let share = select(0.0, other.confidence / total, partner.x >= 0);
        // Of our path at the partner's place, and of theirs here.
        let there = pair_aims[round * pixels + pixel];
        let here = pair_aims[round * pixels + other_pixel];
        own_m += share * own_part / max(others * there + own_part, 1e-37);
        let part = others * other.aim;
        let m = share * part / max(part + own.confidence * here, 1e-37);
        let w = select(0.0, m * here * other.weight, partner.x >= 0 && here > 0.0 && other.aim > 0.0);
        sum += w;
        if (rng_next(&rng) * sum < w) {
            kept.path = pair_shift(other.path, q, position, frame.reconnect).path;
            kept.aim = here;
            kept.origin = RESERVOIR_NEIGHBOUR;
            kept.age = other.age;
        }
    }
    let own_w = select(0.0, own_m * own.aim * own.weight, own.aim > 0.0);
    sum += own_w;
    if (rng_next(&rng) * sum < own_w) {
        kept = own;
    }
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    kept.confidence = total;

    let words = reservoir_pack(kept);
    merge_near[2u * pixel] = words[0];
    merge_near[2u * pixel + 1u] = words[1];
    if (REUSE_SECOND) {
        let far = reservoir_pack_far(kept.path);
        merge_far[2u * pixel] = far[0];
        merge_far[2u * pixel + 1u] = far[1];
    }
}
