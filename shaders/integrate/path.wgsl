// The unbiased path tracer, one lane a pixel: a flat state machine in which camera rays, scattered rays and shadow rays
// share one set of ray variables and one tracking loop. A lane that ends a path begins the next at once.
//
// Free flights and shadow rays by the estimators of slots @flight and @transmittance (track/step). Light at each vertex by
// one sample, whose shadow ray is played by roulette on its expected contribution.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use core/camera
//!use track/step
//!slot phase
//!use light/light
//!use film/film
//!use film/pause

const PATH_DEAD: u32 = 0u;    // no path: begin one
const PATH_TRACK: u32 = 1u;   // a camera or scattered ray in free flight
const PATH_SHADOW: u32 = 2u;  // a shadow ray

const PATH_SHADOW_SHARE: f32 = 0.5;      // chance to trace a shadow ray for each typical radiance that it could bring
const PATH_SHADOW_FLOOR: f32 = 0.02;     // least such chance
const PATH_SHADOW_ROULETTE: f32 = 0.1;   // transmittance below which a shadow ray plays roulette
const PATH_ROULETTE: f32 = 0.1;          // throughput below which a path plays roulette
const PATH_ROUND: u32 = 1u + TRACK_STEPS;  // rounds of loops in one pass of the state machine
const PATH_SLACK: u32 = 12288u;          // rounds that the way to the next vertex may take beyond PATH_MOST_ROUNDS
const PATH_LIGHT_ROUNDS: u32 = 5u;       // the same for each light at a collision or at a path's end

@compute @workgroup_size(8, 8)
fn path_main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    params = params_vary(params_uniform, group.z);
    light_begin(0u);
    let tile = ((slice.first_group + group.x) * params.tile_stride) % params.tiles;
    let position = vec2u(tile % params.tiles_x, tile / params.tiles_x) * 8u + local.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    var film = film_load(pixel);
    var aov_near = vec4f(0.0);
    var aov_far = vec4f(0.0);
    if (FILM_AOV) {
        aov_near = film_aov[2u * pixel];
        aov_far = film_aov[2u * pixel + 1u];
    }

    var rng: Rng;
    var mode = PATH_DEAD;
    // A lane may have fallen behind (see below); the film knows how far it is.
    var next = slice.first_sample - slice.first_sample % FILM_BLOCK + u32(film.samples);
    let last = slice.first_sample + slice.samples;
    let known = film.samples;
    var ray: Ray;
    var world = vec3f(0.0);       // direction of travel before the vertex, world space
    var turns = false;            // a new ray begins at `ray.origin` along `toward`, world space, for `limit` at most
    var toward = vec3f(0.0);
    var limit = MATH_FAR;
    var depth = 0.0;              // optical depth left to the next tentative collision
    var flight: Flight;
    var throughput = vec3f(0.0);
    var bounces = 0u;
    var phase_pdf = -1.0;         // of the last scattering; negative: none yet
    var radiance = vec3f(0.0);
    var single = vec3f(0.0);
    var travelled = 0.0;          // distance to the support, for the depth layer
    var reached = 0.0;            // distance to the first collision, scene units
    var pending = vec3f(0.0);     // what a shadow ray carries
    var transmittance = transmittance_begin();
    var played = 1.0;             // one over the chances that a shadow ray survived so far
    var count = Count();
    var reals = 0u;
    var shadows = 0u;
    var nonfinite = 0u;
    var passes = 0u;              // of the loop below
    var drawn = 0u;               // paths begun
    var rounds = 0u;              // of all loops of this lane

    var paused: PausePath;
    if (pause_take(pixel, next, &paused)) {
        rng = rng_start(pixel, next, params.seed);
        rng.state = paused.state;
        next += 1u;
        ray.origin = paused.origin;
        toward = paused.toward;
        world = toward;
        turns = true;
        depth = paused.depth;
        flight = flight_unpack(paused.flight);
        throughput = paused.throughput;
        bounces = paused.bounces;
        phase_pdf = paused.phase_pdf;
        radiance = paused.radiance;
        single = paused.single;
        reached = paused.reached;
        mode = PATH_TRACK;
    }

    loop {
        if (mode == PATH_DEAD) {
            if (next >= last || rounds >= PATH_MOST_ROUNDS) {
                break;
            }
            rng = rng_start(pixel, next, params.seed);
            next += 1u;
            drawn += 1u;
            let start = camera_ray(position, &rng);
            world = start.world;
            ray.origin = start.origin;
            toward = world;
            limit = MATH_FAR;
            turns = true;
            flight = flight_start(&rng);
            depth = rng_depth(&rng);
            throughput = vec3f(1.0);
            radiance = vec3f(0.0);
            single = vec3f(0.0);
            bounces = 0u;
            phase_pdf = -1.0;
            mode = PATH_TRACK;
        }

        // Out of rounds: a path that has a vertex to set out from goes on in the next dispatch.
        if (rounds >= PATH_MOST_ROUNDS && turns && mode == PATH_TRACK && bounces > 0u) {
            break;
        }

        // Every kind of ray begins here: code that stands once runs once.
        if (turns) {
            ray = ray_new(ray.origin, toward);
            // A camera ray begins at the support, so that t stays small and exact however far the camera is.
            let skip = select(0.0, ray.t, bounces == 0u);
            travelled = select(travelled, skip, bounces == 0u);
            ray.origin = ray_at(ray, skip);
            ray.exit = min(ray.exit, limit) - skip;
            ray.t = 0.0;
            turns = false;
        }

        // Tracking: the only code that runs often. (Two flags rather than the event itself: Mesa's software driver runs
        // this a fifth faster.)
        var hit = false;
        var done = false;
        for (var k = 0u; k < TRACK_STEPS; k++) {
            let shadow = mode == PATH_SHADOW;
            let event =
                step_on(&ray, &depth, shadow, &flight, &transmittance, &played, PATH_SHADOW_ROULETTE, &rng, &count);
            hit = event == STEP_HIT;
            done = event == STEP_DONE;
            if (hit || done) {
                break;
            }
        }
        passes += 1u;
        rounds = passes * PATH_ROUND + count.rounds + (reals + drawn) * PATH_LIGHT_ROUNDS * light_count();

        var scatter = false;
        // No path goes so far from one vertex to the next; one that does is stuck.
        let stuck = rounds >= PATH_MOST_ROUNDS + PATH_SLACK;
        count.caps += select(0u, 1u, stuck);
        var ends = stuck;
        if (hit) {
            reals += 1u;
            if (FILM_AOV && bounces == 0u) {
                reached = (travelled + ray.t) * params.length_unit;
            }
            if (bounces >= params.max_bounces) {
                bounces += 1u;
                ends = true;
            } else {
                bounces += 1u;
                throughput *= params.albedo;
                let strongest = math_max3(abs(throughput * vec3f(flight_weight(flight))));
                if (strongest < PATH_ROULETTE) {
                    if (rng_next(&rng) * PATH_ROULETTE < strongest) {
                        throughput *= PATH_ROULETTE / strongest;
                    } else {
                        ends = true;
                    }
                }
                ray.origin = ray_at(ray, ray.t);
                scatter = true;
                if (LIGHT_SAMPLED) {
                    let sample = light_sample(ray.origin, &rng);
                    let factor = light_factor(sample, phase_value(dot(world, sample.direction)));
                    pending = throughput * vec3f(flight_weight(flight)) * sample.value * factor;
                    let expected = math_max3(abs(pending)) / params.light_reference;
                    let chance = clamp(PATH_SHADOW_SHARE * expected, PATH_SHADOW_FLOOR, 1.0);
                    if (expected > 0.0 && !ends && rng_next(&rng) < chance) {
                        pending *= 1.0 / chance;
                        transmittance = transmittance_begin();
                        played = 1.0;
                        toward = sample.direction;
                        limit = sample.distance;
                        turns = true;
                        mode = PATH_SHADOW;
                        shadows += 1u;
                        scatter = false;
                    }
                }
            }
        } else if (done) {
            if (mode == PATH_SHADOW) {
                let arrived = pending * played * vec3f(transmittance_value(transmittance));
                radiance += arrived;
                if (FILM_AOV && bounces == 1u) {
                    single += arrived;
                }
                scatter = true;
            } else {
                let seen = throughput * vec3f(flight_weight(flight)) * light_background(world, phase_pdf);
                radiance += seen;
                if (FILM_AOV && bounces == 1u) {
                    single += seen;
                }
                ends = true;
            }
        }
        if (scatter && !ends) {
            let drop = phase_drop(&rng);
            phase_pdf = phase_value(1.0 - drop);
            world = math_around_drop(world, drop, 2.0 * MATH_PI * rng_next(&rng));
            toward = world;
            limit = MATH_FAR;
            turns = true;
            mode = PATH_TRACK;
        }
        if (ends) {
            let bad = !(dot(radiance, radiance) < MATH_FAR);
            nonfinite += select(0u, 1u, bad);
            radiance = select(radiance, vec3f(0.0), bad);
            film.radiance += radiance;
            film.square += radiance * radiance;
            film.opacity += select(0.0, 1.0, bounces > 0u);
            film.samples += 1.0;
            if (FILM_AOV) {
                single = select(single, vec3f(0.0), bad);
                let met = select(0.0, 1.0, bounces > 0u);
                aov_near += vec4f(single, reached * met);
                aov_far += vec4f((radiance - single) * met, reached * reached * met);
            }
            mode = PATH_DEAD;
        }
    }

    if (mode != PATH_DEAD) {
        let path = PausePath(
            ray.origin, depth, toward, phase_pdf, throughput, reached, radiance, bounces, single, rng.state,
            flight_pack(flight),
        );
        pause_leave(pixel, next - 1u, path);
    }
    film_store(pixel, film);
    if (FILM_AOV) {
        film_aov[2u * pixel] = aov_near;
        film_aov[2u * pixel + 1u] = aov_far;
    }
    if (FILM_COST) {
        film_cost[2u * pixel] += vec4u(count.lookups, count.steps, count.nulls, reals);
        film_cost[2u * pixel + 1u] += vec4u(shadows, count.violations, nonfinite, u32(film.samples - known));
    }
    film_count(FILM_LOOKUPS, count.lookups);
    film_count(FILM_NULLS, count.nulls);
    film_count(FILM_REALS, reals);
    film_count(FILM_STEPS, count.steps);
    film_count(FILM_SHADOWS, shadows);
    film_count(FILM_NONFINITE, nonfinite);
    film_count(FILM_VIOLATIONS, count.violations);
    film_count(FILM_CAPPED, count.caps);
    film_count(FILM_BEHIND, select(0u, 1u, mode != PATH_DEAD || next < last));
}
