// The bare delta-tracking kernel that the path tracer's speed is measured against: a global majorant, a random walk with
// the scene's phase function, no light. Flat like the path tracer: a lane that ends a walk begins the next at once.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use core/camera
//!slot medium
//!slot phase
//!use film/film

@compute @workgroup_size(8, 8)
fn bare_main(@builtin(workgroup_id) group: vec3u, @builtin(local_invocation_id) local: vec3u) {
    params = params_uniform;
    let tile = ((slice.first_group + group.x) * params.tile_stride) % params.tiles;
    let position = vec2u(tile % params.tiles_x, tile / params.tiles_x) * 8u + local.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let last = slice.first_sample + slice.samples;
    var next = slice.first_sample;
    var alive = false;
    var turns = false;
    var rng: Rng;
    var world = vec3f(0.0);
    var ray: Ray;
    var bounces = 0u;
    var lookups = 0u;
    var reals = 0u;
    loop {
        if (!alive) {
            if (next == last) {
                break;
            }
            rng = rng_start(pixel, next, params.seed);
            next += 1u;
            let start = camera_ray(position, &rng);
            world = start.world;
            ray.origin = start.origin;
            bounces = 0u;
            turns = true;
            alive = true;
        }
        if (turns) {
            ray = ray_new(ray.origin, world);
            let skip = select(0.0, ray.t, bounces == 0u);
            ray.origin = ray_at(ray, skip);
            ray.exit -= skip;
            ray.t = 0.0;
            turns = false;
        }
        for (var k = 0u; k < TRACK_STEPS && alive && !turns; k++) {
            ray.t += rng_depth(&rng) / params.sigma;
            alive = ray.t < ray.exit;
            if (alive) {
                lookups += 1u;
                turns = rng_next(&rng) < medium_density(ray_at(ray, ray.t));
            }
        }
        if (turns) {
            reals += 1u;
            bounces += 1u;
            alive = bounces <= params.max_bounces;
            ray.origin = ray_at(ray, ray.t);
            world = math_around_drop(world, phase_drop(&rng), 2.0 * MATH_PI * rng_next(&rng));
        }
    }
    film_count(FILM_LOOKUPS, lookups);
    film_count(FILM_REALS, reals);
}
