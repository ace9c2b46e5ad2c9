// Third pass of a frame: each pixel's reservoir meets that of the frame before, in the pixel that saw the same part of the
// medium. Two domains, the generalised balance heuristic (Lin et al. 2022), targets of either frame by that frame's own
// camera, medium and lights.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use reuse/target
//!use reuse/frame
//!use reuse/shift

@group(3) @binding(10) var<storage, read_write> temporal_near: array<vec4u>;
@group(3) @binding(11) var<storage, read_write> temporal_far: array<vec4u>;

const TEMPORAL_STREAM: u32 = 0x297a2d39u;
const TEMPORAL_KNOWN: u32 = 1u;    // bits of Frame::history
const TEMPORAL_FROZEN: u32 = 2u;

fn temporal_load(pixel: u32) -> Reservoir {
    var c = vec4u(0u);
    var d = vec4u(0u);
    if (REUSE_SECOND) {
        c = temporal_far[2u * pixel];
        d = temporal_far[2u * pixel + 1u];
    }
    return reservoir_unpack(temporal_near[2u * pixel], temporal_near[2u * pixel + 1u], c, d);
}

// Whether histories hold paths of that kind.
fn temporal_holds(frame: Frame, kind: u32) -> bool {
    let bit = select(TEMPORAL_KNOWN, TEMPORAL_FROZEN, kind == RESERVOIR_FROZEN);
    return (frame.history & bit) != 0u;
}

@compute @workgroup_size(8, 8)
fn temporal_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ TEMPORAL_STREAM);
    var own = reservoir_load(pixel);

    // The pixel of the frame before is chosen by a distance of its own: by the sample's, weights would not add up to 1.
    let centre = view_ray(position, VIEW_CENTRE);
    let sight = ray_new(centre.origin, centre.world);
    let u = rng_next(&rng);
    // Where it meets nothing, a place between the ends of what there is.
    let flight = leg_flight(sight, select(0.0, proxy_end(sight), frame.still == 0u), false, u);
    let place = ray_at(sight, flight.t);
    let jump = vec2i(vec2f(rng_next(&rng), rng_next(&rng)) * 3.0) - 1;
    params = params_vary(frame_previous, id.z);
    let old_size = vec2f(f32(params.width), f32(params.height));
    let same = vec2i(vec2f(position) * old_size * vec2f(params_uniform.inv_width, params_uniform.inv_height));
    let film_place = view_place(place);
    let projected = sight.exit > sight.t && frame.still == 0u;
    let found = select(same, vec2i(floor(film_place)), projected);
    // Film samples move with the film, so that vertices hardly do.
    let turn = select(vec2i(0), vec2i((0.5 - fract(film_place)) * 65536.0), projected && film_place.x >= 0.0);
    let old_position = select(found, found + jump, frame.permute != 0u);
    let size = vec2i(vec2u(params.width, params.height));
    let inside = all(old_position >= vec2i(0)) && all(old_position < size) && frame.history != 0u;
    let q = vec2u(clamp(old_position, vec2i(0), size - 1));
    var old = temporal_load(q.y * params.width + q.x);
    let c_old = select(0.0, min(old.confidence, frame.cap), inside);
    if (!temporal_holds(frame, old.path.kind)) {
        old.weight = 0.0;
    }

    // The rays of both film samples in both frames.
    let own_film = view_turn(own.path.film, -turn);
    let old_film = view_turn(old.path.film, turn);
    let own_there = view_ray(q, own_film);
    let old_there = view_ray(q, old.path.film);
    params = params_vary(params_uniform, id.z);
    let own_here = view_ray(position, own.path.film);
    let old_here = view_ray(position, old_film);

    // Our own path in the frame before, by the inverse of the map that brings theirs here.
    let back = shift_affine(own_there, own_here);
    let own_t = (own.path.t - back.offset) / back.kappa;
    let own_from = view_at(own_here, own.path.t);
    let own_to = view_at(own_there, own_t);
    var own_shifted = shift_follow(own.path, own_from, own_to);
    own_shifted.film = own_film;
    own_shifted.t = own_t;
    let own_keeps = shift_keeps(own.path, own_from, own_to, frame.reconnect);
    let own_valid = c_old > 0.0 && back.kappa > 0.0 && own_shifted.t > 0.0 && own_keeps && own.aim > 0.0
        && temporal_holds(frame, own.path.kind);

    // Theirs here.
    let forth = shift_affine(old_there, old_here);
    let old_t = forth.offset + forth.kappa * old.path.t;
    let old_from = view_at(old_there, old.path.t);
    let old_to = view_at(old_here, old_t);
    var old_shifted = shift_follow(old.path, old_from, old_to);
    old_shifted.film = old_film;
    old_shifted.t = old_t;
    let old_keeps = shift_keeps(old.path, old_from, old_to, frame.reconnect);
    let old_valid = c_old > 0.0 && forth.kappa > 0.0 && old_shifted.t > 0.0 && old_keeps && old.weight > 0.0;

    // Where nothing moved all four values are known.
    let known = frame.still != 0u && all(q == position);
    let asked = select(own_shifted.t, -1.0, known || !own_valid);
    let wanted = select(old_shifted.t, -1.0, known || !old_valid);
    var ask = own_shifted;
    ask.t = asked;
    var want = old_shifted;
    want.t = wanted;
    let want_aim = target_value(position, want);
    params = params_vary(frame_previous, id.z);
    light_begin(frame.old_lights);
    let ask_aim = target_value(q, ask);
    params = params_vary(params_uniform, id.z);

    let own_aim_there = select(0.0, select(ask_aim / back.kappa, own.aim, known), own_valid);
    let old_aim_here = select(0.0, select(want_aim, old.aim, known), old_valid);
    let kappa = select(forth.kappa, 1.0, known);
    let own_a = own.confidence * own.aim;
    let own_m = own_a / max(own_a + c_old * own_aim_there, 1e-37);
    let own_w = select(0.0, own_m * own.aim * own.weight, own.aim > 0.0);
    let old_a = own.confidence * old_aim_here * kappa;
    let old_b = c_old * old.aim;
    let old_w = select(0.0, old_b / max(old_a + old_b, 1e-37) * old_aim_here * kappa * old.weight, old_valid && old.aim > 0.0);
    let sum = own_w + old_w;
    if (rng_next(&rng) * sum < old_w) {
        own.path = old_shifted;
        own.aim = old_aim_here;
        own.origin = RESERVOIR_HISTORY;
        own.age = old.age + 1u;
    }
    own.weight = select(0.0, sum / own.aim, own.aim > 0.0);
    own.confidence += c_old;
    reservoir_store(pixel, own);
}
