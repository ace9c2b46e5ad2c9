// Second pass of a frame, where paths may scatter more than once: a flight from each distance that was left for it, and from the
// second vertex on the path tracer's own paths. Two candidates come of each, a light sample and the direction that scattering
// chose, with the radiance that one path found there; that estimate is part of the sample, with its random numbers, and never
// made again.
//
// The loop is that of integrate/path. A path that a dispatch could not end goes on in the next, and the reservoir with it.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use light/toward
//!use track/step
//!use track/exact
//!use reuse/leg
//!use reuse/onset
//!use reuse/target
//!use reuse/frame
//!slot aim
//!use film/film
//!use film/pause

const SUFFIX_STREAM: u32 = 0x2c1b3c6du;
const SUFFIX_NEXT: u32 = 0x9e3779b9u;   // tells one suffix of a pixel from the next
const SUFFIX_TRACK: u32 = 0u;
const SUFFIX_SHADOW: u32 = 1u;
const SUFFIX_DONE: u32 = 2u;

const SUFFIX_SHADOW_SHARE: f32 = 5.0;     // ten times that of integrate/path, and the next too: what is found is kept for
const SUFFIX_SHADOW_FLOOR: f32 = 0.5;     // many frames
const SUFFIX_SHADOW_ROULETTE: f32 = 0.1;  // these four as in integrate/path
const SUFFIX_ROULETTE: f32 = 0.1;
const SUFFIX_SLACK: u32 = 12288u;
const SUFFIX_LIGHT_ROUNDS: u32 = 5u;

// What a dispatch has done for a pixel.
struct SuffixWork {
    count: Count,
    reals: u32,
    shadows: u32,
    passes: u32,
    rounds: u32,
}

// Offers a path with legs of that transmittance to the reservoir; `inverse` is one over the density that drew it.
fn suffix_offer(
    pixel: vec2u, kept: ptr<function, Reservoir>, sum: ptr<function, f32>, path: Path, legs: f32, inverse: f32, u: f32,
) {
    let aim = aim_strength(target_parts(pixel, path)) * legs;
    let w = aim * inverse;
    let good = w > 0.0 && w < MATH_FAR;
    *sum += select(0.0, w, good);
    if (good && u * *sum < w) {
        (*kept).path = path;
        (*kept).aim = aim;
    }
}

// One suffix of a pixel from a distance and its weight. False: it goes on in the next dispatch.
fn suffix_follow(
    position: vec2u, onset: vec2f, key: u32, kept: ptr<function, Reservoir>, sum: ptr<function, f32>,
    work: ptr<function, SuffixWork>,
) -> bool {
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ key);
    // A scattering, and a flight from afar, so that its density is known.
    let film = (*kept).path.film;
    let view = view_ray(position, film);
    let vertex = view.origin + ray_local(view.world) * onset.x;
    let before = toward_sample(vertex, view.world, &rng);
    let walk = ray_new(vertex, before);
    let leg = leg_flight(walk, proxy_end(walk), true, rng_next(&rng));
    var path = Path(RESERVOIR_INSIDE_2, 0u, film, onset.x, vec3f(0.0), ray_at(walk, leg.t), vec3f(0.0));
    // Per volume: density · r² is the density along the leg.
    let inverse = onset.y * leg.t * leg.t / (toward_pdf(vertex, view.world, before) * leg.density);
    if (!leg.met || target_density(path.second) <= 0.0 || !(inverse > 0.0 && inverse < MATH_FAR)) {
        return true;
    }

    var ray: Ray;
    ray.origin = path.second;
    var world = before;
    var turns = false;
    var scatter = true;
    var toward = vec3f(0.0);
    var limit = MATH_FAR;
    var mode = SUFFIX_TRACK;
    var flight = flight_start(&rng);
    var depth = rng_depth(&rng);
    var throughput = vec3f(1.0);
    var bounces = 2u;             // collisions so far
    var phase_pdf = 0.0;
    var radiance = vec3f(0.0);    // what arrives along the direction that scattering chose
    var chosen = vec3f(0.0, 1.0, 0.0);
    var escaped = false;
    var lit = vec3f(0.0);         // what arrives from the first light sample
    var lit_towards = vec3f(0.0, 1.0, 0.0);
    var lit_pdf = 0.0;
    var pending = vec3f(0.0);
    var transmittance = transmittance_begin();
    var played = 1.0;
    var count = (*work).count;
    var reals = (*work).reals;
    var shadows = (*work).shadows;
    var passes = (*work).passes;
    var rounds = (*work).rounds;
    var behind = false;

    if (LIGHT_SAMPLED) {
        // Exact, and always: what is kept over many frames is worth it.
        let sample = light_sample(path.second, &rng);
        let leg = ray_new(path.second, sample.direction);
        lit = sample.value * vec3f(exact_transmittance(leg, min(leg.exit, sample.distance), &count));
        lit_towards = sample.direction;
        lit_pdf = sample.pdf;
        shadows += 1u;
    }
    var paused: PausePath;
    if (pause_take(pixel, frame.frame, &paused)) {
        rng.state = paused.state;
        ray.origin = paused.origin;
        toward = paused.toward;
        world = toward;
        turns = true;
        scatter = false;
        depth = paused.depth;
        flight = flight_unpack(paused.flight);
        throughput = paused.throughput;
        bounces = paused.bounces;
        phase_pdf = paused.phase_pdf;
        radiance = paused.radiance;
        chosen = reservoir_unfold(vec2f(paused.reached, paused.single.x));
    }

    while (mode != SUFFIX_DONE) {
        if (scatter) {
            let drawn = toward_sample(ray.origin, world, &rng);
            let onward = select(drawn, reservoir_unfold(reservoir_fold(drawn)), bounces == 2u);
            phase_pdf = phase_value(dot(world, onward));
            // The second vertex's is part of the path's density.
            throughput *= select(phase_pdf / toward_pdf(ray.origin, world, onward), 1.0, bounces == 2u);
            world = onward;
            chosen = select(chosen, world, bounces == 2u);
            toward = world;
            limit = MATH_FAR;
            turns = true;
            scatter = false;
            mode = SUFFIX_TRACK;
        }
        if (turns && mode == SUFFIX_TRACK && rounds >= PATH_MOST_ROUNDS && bounces > 2u) {
            behind = true;
            break;
        }
        if (turns) {
            ray = ray_new(ray.origin, toward);
            ray.exit = min(ray.exit, limit);
            turns = false;
        }
        var hit = false;
        var done = false;
        for (var k = 0u; k < TRACK_STEPS; k++) {
            let event = step_on(
                &ray, &depth, mode == SUFFIX_SHADOW, &flight, &transmittance, &played, SUFFIX_SHADOW_ROULETTE, &rng, &count,
            );
            hit = event == STEP_HIT;
            done = event == STEP_DONE;
            if (hit || done) {
                break;
            }
        }
        passes += 1u;
        rounds = passes * (1u + TRACK_STEPS) + count.rounds + reals * SUFFIX_LIGHT_ROUNDS * light_count();
        var ends = rounds >= PATH_MOST_ROUNDS + SUFFIX_SLACK;
        count.caps += select(0u, 1u, ends);
        if (hit) {
            reals += 1u;
            ends |= bounces >= params.max_bounces;
            bounces += 1u;
            throughput *= params.albedo;
            let strongest = math_max3(abs(throughput * vec3f(flight_weight(flight))));
            let plays = strongest < SUFFIX_ROULETTE;
            let survives = !plays || rng_next(&rng) * SUFFIX_ROULETTE < strongest;
            throughput *= select(1.0, SUFFIX_ROULETTE / strongest, plays && survives);
            ends |= !survives;
            ray.origin = ray_at(ray, ray.t);
            scatter = !ends;
            if (LIGHT_SAMPLED && !ends) {
                let sample = light_sample(ray.origin, &rng);
                let factor = light_factor(sample, phase_value(dot(world, sample.direction)));
                pending = throughput * vec3f(flight_weight(flight)) * sample.value * factor;
                let expected = math_max3(abs(pending)) / params.light_reference;
                let chance = clamp(SUFFIX_SHADOW_SHARE * expected, SUFFIX_SHADOW_FLOOR, 1.0);
                if (expected > 0.0 && rng_next(&rng) < chance) {
                    pending *= 1.0 / chance;
                    transmittance = transmittance_begin();
                    played = 1.0;
                    toward = sample.direction;
                    limit = sample.distance;
                    turns = true;
                    scatter = false;
                    mode = SUFFIX_SHADOW;
                    shadows += 1u;
                }
            }
        } else if (done && mode == SUFFIX_SHADOW) {
            radiance += pending * played * vec3f(transmittance_value(transmittance));
            scatter = true;
        } else if (done) {
            if (bounces == 2u) {
                // What it sees is looked up later: its share of the bright sky depends on the direction before.
                escaped = true;
                radiance = vec3f(flight_weight(flight));
            } else {
                radiance += throughput * vec3f(flight_weight(flight)) * light_background(world, phase_pdf);
            }
            ends = true;
        }
        mode = select(mode, SUFFIX_DONE, ends);
    }

    *work = SuffixWork(count, reals, shadows, passes, rounds);
    if (behind) {
        let on = reservoir_fold(chosen);
        let left = PausePath(
            ray.origin, depth, toward, phase_pdf, throughput, on.x, radiance, bounces, vec3f(on.y, 0.0, 0.0), rng.state,
            flight_pack(flight),
        );
        pause_leave(pixel, frame.frame, left);
        return false;
    }
    // Both paths have the same legs.
    let legs = aim_legs(position, path, target_parts(position, path));
    path.kind = select(RESERVOIR_DELTA_2, RESERVOIR_BRIGHT_2, lit_pdf > 0.0);
    path.omega = reservoir_unfold(reservoir_fold(lit_towards));
    path.value = lit;
    suffix_offer(position, kept, sum, path, legs, inverse / select(1.0, lit_pdf, lit_pdf > 0.0), rng_next(&rng));
    path.kind = select(RESERVOIR_INSIDE_2, RESERVOIR_ESCAPE_2, escaped);
    path.omega = chosen;
    path.value = radiance;
    let around = toward_pdf(path.second, before, chosen);
    suffix_offer(position, kept, sum, path, legs, inverse / max(around, 1e-30), rng_next(&rng));
    return true;
}

@compute @workgroup_size(8, 8)
fn suffix_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    var kept = reservoir_load(pixel);
    var sum = kept.aim * kept.weight;
    var work = SuffixWork();
    for (var i = 0u; i < frame_uniform.suffixes; i++) {
        let onset = onset_take(pixel, i);
        // Those that an earlier dispatch has done are struck out.
        if (onset.x <= 0.0) {
            continue;
        }
        let waits = work.rounds >= PATH_MOST_ROUNDS;
        if (waits || !suffix_follow(position, onset, SUFFIX_STREAM + i * SUFFIX_NEXT, &kept, &sum, &work)) {
            film_count(FILM_BEHIND, 1u);
            break;
        }
        onset_strike(pixel, i);
    }
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    reservoir_store(pixel, kept);
    film_count(FILM_LOOKUPS, work.count.lookups);
    film_count(FILM_NULLS, work.count.nulls);
    film_count(FILM_REALS, work.reals);
    film_count(FILM_STEPS, work.count.steps);
    film_count(FILM_SHADOWS, work.shadows);
    film_count(FILM_VIOLATIONS, work.count.violations);
    film_count(FILM_CAPPED, work.count.caps);
}
