// Second pass of a frame, where paths may scatter more than once: from the second vertex on, the path tracer's own paths.
// Two candidates come of it, a light sample and the direction that scattering chose, each with the radiance that one path
// found there; that estimate is part of the sample, with its random numbers, and never made again.
//
// The loop is that of integrate/path. A path that a dispatch could not end goes on in the next, and the reservoir with it.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use light/toward
//!use track/step
//!use track/exact
//!use reuse/target
//!use reuse/frame
//!slot aim
//!use film/film
//!use film/pause

const SUFFIX_STREAM: u32 = 0x2c1b3c6du;
const SUFFIX_TRACK: u32 = 0u;
const SUFFIX_SHADOW: u32 = 1u;
const SUFFIX_DONE: u32 = 2u;

const SUFFIX_SHADOW_SHARE: f32 = 5.0;     // ten times that of integrate/path, and the next too: what is found is kept for
const SUFFIX_SHADOW_FLOOR: f32 = 0.5;     // many frames
const SUFFIX_SHADOW_ROULETTE: f32 = 0.1;  // these four as in integrate/path
const SUFFIX_ROULETTE: f32 = 0.1;
const SUFFIX_SLACK: u32 = 12288u;
const SUFFIX_LIGHT_ROUNDS: u32 = 5u;

// Offers a path to the reservoir; `inverse` is one over the density that drew it.
fn suffix_offer(
    pixel: vec2u, kept: ptr<function, Reservoir>, sum: ptr<function, f32>, path: Path, inverse: f32, u: f32,
) {
    let aim = aim_value(pixel, path);
    let w = aim * inverse;
    let good = w > 0.0 && w < MATH_FAR;
    *sum += select(0.0, w, good);
    if (good && u * *sum < w) {
        (*kept).path = path;
        (*kept).aim = aim;
    }
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
    let frame = frame_uniform;
    let start = reservoir_far[2u * pixel];
    let more = reservoir_far[2u * pixel + 1u];
    let inverse = bitcast<f32>(more.x);
    var sum = bitcast<f32>(more.y);
    if (more.w != 0u) {
        // Done in an earlier dispatch of this frame.
        return;
    }
    let near = reservoir_near[2u * pixel];
    var path = Path(RESERVOIR_INSIDE_2, 0u, near.y, bitcast<f32>(start.w), vec3f(0.0), bitcast<vec3f>(start.xyz), vec3f(0.0));
    let view = view_ray(position, path.film);
    let before = normalize(view_world(path.second - (view.origin + ray_local(view.world) * path.t)));

    var rng = rng_start(pixel, frame.frame, params.seed ^ SUFFIX_STREAM);
    var ray: Ray;
    ray.origin = path.second;
    var world = before;
    var turns = false;
    var scatter = inverse > 0.0;
    var toward = vec3f(0.0);
    var limit = MATH_FAR;
    var mode = select(SUFFIX_DONE, SUFFIX_TRACK, inverse > 0.0);
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
    var count = Count();
    var reals = 0u;
    var shadows = 0u;
    var passes = 0u;
    var rounds = 0u;
    var behind = false;

    if (inverse > 0.0 && LIGHT_SAMPLED) {
        // Exact, and always: what is kept over many frames is worth it.
        let sample = light_sample(path.second, &rng);
        let leg = ray_new(path.second, sample.direction);
        lit = sample.value * vec3f(exact_transmittance(leg, min(leg.exit, sample.distance), &count));
        lit_towards = sample.direction;
        lit_pdf = sample.pdf;
        shadows = 1u;
    }
    var paused: PausePath;
    let goes_on = pause_take(pixel, frame.frame, &paused);
    if (goes_on) {
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
        chosen = reservoir_unfold(vec2f(paused.reached, bitcast<f32>(more.z)));
        limit = MATH_FAR;
        mode = SUFFIX_TRACK;
    }

    loop {
        if (mode == SUFFIX_DONE) {
            break;
        }
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

    film_count(FILM_LOOKUPS, count.lookups);
    film_count(FILM_NULLS, count.nulls);
    film_count(FILM_REALS, reals);
    film_count(FILM_STEPS, count.steps);
    film_count(FILM_SHADOWS, shadows);
    film_count(FILM_VIOLATIONS, count.violations);
    film_count(FILM_CAPPED, count.caps);
    if (behind) {
        let on = reservoir_fold(chosen);
        let left = PausePath(
            ray.origin, depth, toward, phase_pdf, throughput, on.x, radiance, bounces, vec3f(0.0), rng.state, flight_pack(flight),
        );
        pause_leave(pixel, frame.frame, left);
        reservoir_far[2u * pixel + 1u].z = bitcast<u32>(on.y);
        film_count(FILM_BEHIND, 1u);
        return;
    }

    var kept = reservoir_unpack(near, reservoir_near[2u * pixel + 1u], vec4u(0u), vec4u(0u));
    path.kind = select(RESERVOIR_DELTA_2, RESERVOIR_BRIGHT_2, lit_pdf > 0.0);
    path.omega = reservoir_unfold(reservoir_fold(lit_towards));
    path.value = lit;
    suffix_offer(position, &kept, &sum, path, inverse / select(1.0, lit_pdf, lit_pdf > 0.0), rng_next(&rng));
    path.kind = select(RESERVOIR_INSIDE_2, RESERVOIR_ESCAPE_2, escaped);
    path.omega = chosen;
    path.value = radiance;
    let around = toward_pdf(path.second, before, chosen);
    suffix_offer(position, &kept, &sum, path, inverse / max(around, 1e-30), rng_next(&rng));
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    reservoir_store(pixel, kept);
    reservoir_far[2u * pixel + 1u].w = 1u;
}
