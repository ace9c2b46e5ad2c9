// Neighbours meet in pairs: the partner's partner is the pixel itself, so that each evaluates its own path at the other's
// place and both are served.
//!use core/params
//!use core/rng
//!use core/math
//!use reuse/target
//!use reuse/frame
//!use reuse/shift

@group(3) @binding(12) var<storage, read_write> pair_aims: array<f32>;

// The partner in a round: ((p + origin) xor mask) − origin, with origin and mask those of seed, frame and round; negative outside.
fn pair_partner(position: vec2u, round: u32, frame: Frame) -> vec2i {
    let side = 1u << frame.reach;
    let key = rng_mix(rng_mix(frame.frame * 747796405u + 2891336453u) ^ params.seed);
    let bits = rng_mix(key ^ (round * 277803737u));
    let origin = vec2u(bits & 255u, (bits >> 8u) & 255u);
    // Any offset but none, another in each round.
    let place = 1u + ((key >> 16u) + round) % (side * side - 1u);
    let mask = vec2u(place % side, place / side);
    let partner = vec2i((position + origin) ^ mask) - vec2i(origin);
    let inside = all(partner >= vec2i(0)) && all(partner < vec2i(vec2u(params.width, params.height)));
    return select(vec2i(-1), partner, inside);
}

// The path of one pixel as one of another, if it may be that. The distance stays, so the Jacobian is 1.
struct PairShift {
    path: Path,
    keeps: bool,
}

fn pair_shift(path: Path, own: vec2u, other: vec2u, least: f32) -> PairShift {
    let here = view_ray(own, path.film);
    let there = view_ray(other, path.film);
    let before = view_at(here, path.t);
    let after = view_at(there, path.t);
    return PairShift(shift_follow(path, before, after), shift_keeps(path, before, after, least));
}

// The first pass: the aim of a pixel's path at its partners, a number a round.
@compute @workgroup_size(8, 8)
fn pair_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    let own = reservoir_load(pixel);
    for (var round = 0u; round < frame.neighbours; round++) {
        let partner = pair_partner(position, round, frame);
        let q = vec2u(max(partner, vec2i(0)));
        var shifted = pair_shift(own.path, position, q, frame.reconnect);
        let valid = partner.x >= 0 && own.aim > 0.0 && shifted.keeps;
        shifted.path.t = select(-1.0, shifted.path.t, valid);
        pair_aims[round * params.width * params.height + pixel] = target_value(q, shifted.path);
    }
}
