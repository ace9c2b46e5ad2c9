// Light that was scattered on: the path tracer's own path from a third vertex. What it finds is part of a sample, with its random
// numbers, and never made again.
//
// The loop is that of integrate/path. A path that a dispatch could not end goes on in the next.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!slot phase
//!use light/light
//!use light/toward
//!use track/step
//!use reuse/reservoir
//!use film/film
//!use film/pause

const FROZEN_TRACK: u32 = 0u;
const FROZEN_SHADOW: u32 = 1u;
const FROZEN_DONE: u32 = 2u;

const FROZEN_SHADOW_SHARE: f32 = 5.0;     // ten times that of integrate/path, and the next too: what is found is kept for
const FROZEN_SHADOW_FLOOR: f32 = 0.5;     // many frames
const FROZEN_SHADOW_ROULETTE: f32 = 0.1;  // these four as in integrate/path
const FROZEN_ROULETTE: f32 = 0.1;
const FROZEN_SLACK: u32 = 12288u;
const FROZEN_LIGHT_ROUNDS: u32 = 5u;

// What a dispatch has done for a pixel.
struct FrozenWork {
    count: Count,
    reals: u32,
    shadows: u32,
    passes: u32,
    rounds: u32,
}

// What reaches `start` (local space) along `chosen`, but for light that comes straight. False: the path goes on in the next
// dispatch.
fn frozen_light(
    pixel: u32, number: u32, start: vec3f, chosen: vec3f, rng: ptr<function, Rng>, work: ptr<function, FrozenWork>,
    found: ptr<function, vec3f>,
) -> bool {
    var ray: Ray;
    ray.origin = start;
    var world = chosen;
    var turns = true;
    var scatter = false;
    var toward = chosen;
    var limit = MATH_FAR;
    var mode = FROZEN_TRACK;
    var flight = flight_start(rng);
    var depth = rng_depth(rng);
    var throughput = vec3f(1.0);
    var bounces = RESERVOIR_VERTICES;  // collisions so far
    var phase_pdf = 0.0;
    var radiance = vec3f(0.0);
    var pending = vec3f(0.0);
    var transmittance = transmittance_begin();
    var played = 1.0;
    var count = (*work).count;
    var reals = (*work).reals;
    var shadows = (*work).shadows;
    var passes = (*work).passes;
    var rounds = (*work).rounds;
    var behind = false;

    var paused: PausePath;
    if (pause_take(pixel, number, &paused)) {
        (*rng).state = paused.state;
        ray.origin = paused.origin;
        toward = paused.toward;
        world = toward;
        depth = paused.depth;
        flight = flight_unpack(paused.flight);
        throughput = paused.throughput;
        bounces = paused.bounces;
        phase_pdf = paused.phase_pdf;
        radiance = paused.radiance;
    }

    while (mode != FROZEN_DONE) {
        if (scatter) {
            let onward = toward_turn(world, rng);
            phase_pdf = phase_value(dot(world, onward));
            world = onward;
            toward = world;
            limit = MATH_FAR;
            turns = true;
            scatter = false;
            mode = FROZEN_TRACK;
        }
        if (turns && mode == FROZEN_TRACK && rounds >= PATH_MOST_ROUNDS && bounces > RESERVOIR_VERTICES) {
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
                &ray, &depth, mode == FROZEN_SHADOW, &flight, &transmittance, &played, FROZEN_SHADOW_ROULETTE, rng, &count,
            );
            hit = event == STEP_HIT;
            done = event == STEP_DONE;
            if (hit || done) {
                break;
            }
        }
        passes += 1u;
        rounds = passes * (1u + TRACK_STEPS) + count.rounds + reals * FROZEN_LIGHT_ROUNDS * light_count();
        var ends = rounds >= PATH_MOST_ROUNDS + FROZEN_SLACK;
        count.caps += select(0u, 1u, ends);
        if (hit) {
            reals += 1u;
            ends |= bounces >= params.max_bounces;
            bounces += 1u;
            throughput *= params.albedo;
            let strongest = math_max3(abs(throughput * vec3f(flight_weight(flight))));
            let plays = strongest < FROZEN_ROULETTE;
            let survives = !plays || rng_next(rng) * FROZEN_ROULETTE < strongest;
            throughput *= select(1.0, FROZEN_ROULETTE / strongest, plays && survives);
            ends |= !survives;
            ray.origin = ray_at(ray, ray.t);
            scatter = !ends;
            if (LIGHT_SAMPLED && !ends) {
                let sample = light_sample(ray.origin, rng);
                let factor = light_factor(sample, phase_value(dot(world, sample.direction)));
                pending = throughput * vec3f(flight_weight(flight)) * sample.value * factor;
                let expected = math_max3(abs(pending)) / params.light_reference;
                let chance = clamp(FROZEN_SHADOW_SHARE * expected, FROZEN_SHADOW_FLOOR, 1.0);
                if (expected > 0.0 && rng_next(rng) < chance) {
                    pending *= 1.0 / chance;
                    transmittance = transmittance_begin();
                    played = 1.0;
                    toward = sample.direction;
                    limit = sample.distance;
                    turns = true;
                    scatter = false;
                    mode = FROZEN_SHADOW;
                    shadows += 1u;
                }
            }
        } else if (done && mode == FROZEN_SHADOW) {
            radiance += pending * played * vec3f(transmittance_value(transmittance));
            scatter = true;
        } else if (done) {
            // What the third vertex itself sees is a path of its own.
            let seen = throughput * vec3f(flight_weight(flight)) * light_background(world, phase_pdf);
            radiance += select(vec3f(0.0), seen, bounces > RESERVOIR_VERTICES);
            ends = true;
        }
        mode = select(mode, FROZEN_DONE, ends);
    }

    *work = FrozenWork(count, reals, shadows, passes, rounds);
    *found = radiance;
    if (behind) {
        let left = PausePath(
            ray.origin, depth, toward, phase_pdf, throughput, 0.0, radiance, bounces, vec3f(0.0), (*rng).state,
            flight_pack(flight),
        );
        pause_leave(pixel, number, left);
    }
    return !behind;
}
