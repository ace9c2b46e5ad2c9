// Second pass of a frame, where paths may scatter more than once: from each distance that was left for it a flight to a second
// vertex and one to a third. Each of them looks for light, and what is scattered on at the third is frozen (reuse/frozen).
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use light/toward
//!use reuse/onward
//!use reuse/onset
//!use reuse/look
//!use reuse/frame
//!use reuse/frozen
//!slot aim
//!use film/film

const SUFFIX_STREAM: u32 = 0x2c1b3c6du;
const SUFFIX_NEXT: u32 = 0x9e3779b9u;   // tells one suffix of a pixel from the next

// What a pixel has chosen so far.
struct SuffixChoice {
    kept: Reservoir,
    sum: f32,         // of weights
}

// Offers a path whose legs to the last vertex flights have `seen`; `inverse` is one over the density that drew it.
fn suffix_offer(
    pixel: vec2u, choice: ptr<function, SuffixChoice>, path: Path, parts: Target, strength: f32, seen: f32, inverse: f32, u: f32,
) {
    var aim = 0.0;
    if (strength > 0.0 && strength < MATH_FAR) {
        aim = strength * aim_legs(pixel, path, parts, seen);
    }
    let w = aim * inverse;
    let good = w > 0.0 && w < MATH_FAR;
    (*choice).sum += select(0.0, w, good);
    if (good && u * (*choice).sum < w) {
        (*choice).kept.path = path;
        (*choice).kept.aim = aim;
    }
}

// One suffix of a pixel from a distance. False: it goes on in the next dispatch.
fn suffix_follow(
    position: vec2u, number: u32, choice: ptr<function, SuffixChoice>, work: ptr<function, FrozenWork>,
) -> bool {
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform.frame;
    var rng = rng_start(pixel, frame, params.seed ^ (SUFFIX_STREAM + number * SUFFIX_NEXT));
    // Nothing counts before all of it is done.
    var mine = *choice;
    var path = Path(0u, 0u, mine.kept.path.film, 0.0, vec3f(0.0, 1.0, 0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
    let view = view_ray(position, path.film);
    let onset = onset_take(pixel, number, view);
    path.t = onset.t;
    var vertex = view_at(view, onset.t);
    var before = view.world;
    var seen = onset.seen;
    var inverse = onset.inverse;
    var depth = 1u;
    for (; depth < min(params.max_bounces, RESERVOIR_VERTICES); depth++) {
        // A scattering, and a flight from afar, so that its density is known.
        let onward = toward_sample(vertex, before, &rng);
        let walk = ray_new(vertex, onward);
        let leg = onward_flight(walk, proxy_end(walk), &rng);
        // Per volume: density · r² is the density along the leg.
        inverse *= leg.t * leg.t * leg.inverse / toward_pdf(vertex, before, onward);
        let to = onward * leg.t;
        vertex += ray_local(to);
        if (!leg.met || !(inverse > 0.0 && inverse < MATH_FAR)) {
            break;
        }
        before = onward;
        seen *= leg.seen;
        path.second = select(path.second, to, depth == 1u);
        path.third = to;
        path.kind = RESERVOIR_DEEPER * depth;
        let look = look_choose(position, path, vertex, before, &rng);
        suffix_offer(position, &mine, look.path, look.parts, look.strength, seen, inverse * look.inverse, rng_next(&rng));
    }
    if (depth == RESERVOIR_VERTICES && params.max_bounces > RESERVOIR_VERTICES) {
        path.kind = RESERVOIR_FROZEN;
        path.omega = reservoir_unfold(reservoir_fold(toward_sample(vertex, before, &rng)));
        var found = vec3f(0.0);
        if (!frozen_light(pixel, frame, vertex, path.omega, &rng, work, &found)) {
            return false;
        }
        path.value = reservoir_round(found);
        let parts = target_parts(position, path);
        let drawn = inverse / toward_pdf(vertex, before, path.omega);
        suffix_offer(position, &mine, path, parts, target_strength(parts), seen, drawn, rng_next(&rng));
    }
    *choice = mine;
    return true;
}

@compute @workgroup_size(8, 8)
fn suffix_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    var choice = SuffixChoice(reservoir_load(pixel), 0.0);
    choice.sum = choice.kept.aim * choice.kept.weight;
    var work = FrozenWork();
    for (var i = 0u; i < frame_uniform.suffixes; i++) {
        // Those that an earlier dispatch has done are struck out.
        if (!onset_waits(pixel, i)) {
            continue;
        }
        if (work.rounds >= PATH_MOST_ROUNDS || !suffix_follow(position, i, &choice, &work)) {
            film_count(FILM_BEHIND, 1u);
            break;
        }
        onset_strike(pixel, i);
    }
    choice.kept.weight = select(0.0, choice.sum / choice.kept.aim, choice.kept.aim > 0.0);
    reservoir_store(pixel, choice.kept);
    film_count(FILM_LOOKUPS, work.count.lookups);
    film_count(FILM_NULLS, work.count.nulls);
    film_count(FILM_REALS, work.reals);
    film_count(FILM_STEPS, work.count.steps);
    film_count(FILM_SHADOWS, work.shadows);
    film_count(FILM_VIOLATIONS, work.count.violations);
    film_count(FILM_CAPPED, work.count.caps);
}
