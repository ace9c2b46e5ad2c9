// The method of 2021, first pass of a frame: M walks along the ray through the pixel's centre, each of which scatters or gets
// through; one of the paths that they make is kept (resampled importance sampling) and judged anew as later passes judge.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use reuse/end
//!use reuse/frame
//!use reuse/onset
//!use aim/marched

const INITIAL_STREAM: u32 = 0x68bc21ebu;  // tells its random numbers from other passes'
const INITIAL_STEPS: u32 = 2048u;         // of the traversal, a guard
const INITIAL_CELLS: vec2f = vec2f(1.0, 2.0);  // their level, and their side in the finest cells
const INITIAL_GONE: f32 = 1e-7;           // share of the light that is left when the traversal ends

// How far the traversal of a ray has come: its last step, and the transmittance where that began and where it ended.
struct Initial {
    near: f32,
    t: f32,
    seen: f32,
    after: f32,
    depth: f32,
    steps: u32,
    elsewhere: f32,  // a distance of those passed, drawn like those of walks that scatter; 0 where none can
}

// Goes on to where no more than `wanted` of the light is left. Whether that is before the end.
fn initial_reaches(state: ptr<function, Initial>, ray: Ray, end: f32, wanted: f32, rng: ptr<function, Rng>) -> bool {
    for (var i = 0u; i < INITIAL_STEPS; i++) {
        if (wanted > (*state).after) {
            return true;
        }
        if ((*state).t >= end || (*state).after < INITIAL_GONE || (*state).steps >= INITIAL_STEPS) {
            break;
        }
        // Cell by cell of the density from afar, which is above 0 wherever the density is.
        let next = min((*state).t + INITIAL_CELLS.y * proxy_finest(ray, end), end);
        (*state).near = (*state).t;
        (*state).seen = (*state).after;
        (*state).t = next;
        (*state).depth += proxy_depth(ray, (*state).near, next, min(INITIAL_CELLS.x, params.proxy_last));
        (*state).after = min(marched_mean((*state).depth), (*state).seen);
        (*state).steps += 1u;
        if (rng_next(rng) * (1.0 - (*state).after) < (*state).seen - (*state).after) {
            (*state).elsewhere = mix((*state).near, next, rng_next(rng));
        }
    }
    return wanted > (*state).after;
}

@compute @workgroup_size(8, 8)
fn initial_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ INITIAL_STREAM);
    let view = view_ray(position, VIEW_CENTRE);

    // Some walks look for light with light samples, some by scattering; which ones does not depend on how far they got.
    let sky = end_finds();
    let by_light = select(0u, select(frame.candidates, (frame.candidates + 1u) / 2u, sky), LIGHT_SAMPLED);
    let by_phase = select(0u, max(frame.candidates - by_light, 1u), sky);
    let scatters = by_light + by_phase > 0u && params.max_bounces > 0u;
    let ray = ray_new(view.origin, view.world);
    // Where there is nothing to meet, one gets through as well as many.
    let walks = select(1u, max(by_light + by_phase, 1u), ray.exit > ray.t);
    let end = proxy_end(ray);
    var state = Initial(ray.t, ray.t, 1.0, 1.0, 0.0, 0u, 0.0);
    var wanted = 1.0;
    var light_left = by_light;
    var kept = Reservoir();
    kept.path.film = VIEW_CENTRE;
    kept.path.omega = vec3f(0.0, 1.0, 0.0);
    kept.confidence = 1.0;
    var sum = 0.0;
    var onset = Onset();
    for (var i = 0u; i < walks; i++) {
        // One traversal for all walks. Their distances come in order: the greatest of n uniform numbers is the n-th root of one.
        wanted *= pow(rng_next(&rng), 1.0 / f32(walks - i));
        let scattered = initial_reaches(&state, ray, end, wanted, &rng);
        let mass = select(1.0, state.seen - state.after, scattered);
        let share = clamp((state.seen - wanted) / mass, 0.0, 1.0);
        let drawn = mass / (state.t - state.near);
        let lit = rng_next(&rng) * f32(walks - i) < f32(light_left);
        light_left -= select(0u, 1u, lit);
        let count = f32(select(by_phase, by_light, lit));
        var path = kept.path;
        path.kind = RESERVOIR_ESCAPE;
        path.t = mix(state.near, state.t, share);
        let vertex = view_at(view, path.t);
        if (REUSE_SECOND) {
            onset_offer(&onset, view, path.t, select(0.0, wanted, scattered), drawn * f32(walks), rng_three(&rng));
        }
        var density = drawn * count;
        if (LIGHT_SAMPLED && lit) {
            density *= end_lit(&path, vertex, 0u, &rng);
        } else {
            density *= end_scattered(&path, view.world, 0u, &rng);
        }
        let parts = target_parts(position, path);
        let strength = select(0.0, marched_strength(parts), scattered && scatters);
        var aim = strength * max(wanted, MARCHED_FLOOR) * marched_onward(parts, strength, MARCHED_FIRST);
        if (!scattered) {
            path.kind = MARCHED_THROUGH;
            aim = marched_behind(view) * max(state.after, MARCHED_FLOOR);
            density = state.after * f32(walks);
        }
        let w = select(0.0, aim / density, aim > 0.0 && density > 0.0 && aim < MATH_FAR);
        sum += w;
        if (rng_next(&rng) * sum < w) {
            kept.path = path;
            kept.aim = aim;
        }
    }
    kept.path.t = select(kept.path.t, state.elsewhere, kept.path.kind == MARCHED_THROUGH);
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    // From here on by the targets of reuse.
    kept.aim = marched_value(position, kept.path);
    reservoir_store(pixel, kept);
    if (REUSE_SECOND) {
        onset_leave(pixel, onset, frame.suffixes);
    }
}
