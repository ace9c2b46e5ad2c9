// Last pass of a frame: the light of each pixel's path with true transmittances, and what the camera sees through the medium.
// Only here are random numbers drawn for a value that the resampling did not know: E[f̂·W] = E[E[f̂ | path]·W].
//
// These estimates are most of what noise is left, so they get the best estimator there is: a power series around equidistant
// tracking of whole legs (track/comb), whose error falls much faster than its looks grow.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use track/comb
//!use reuse/target
//!use reuse/frame
//!use film/film

@group(3) @binding(13) var shade_table: texture_2d_array<u32>;

const SHADE_STREAM: u32 = 0x3c6ef372u;
const SHADE_SPACING: f32 = 2.0;    // optical depth of the majorant between looks, times the setting's walks
const SHADE_DEEP: f32 = 0.1;       // the same as a share of a leg's own, for legs that hardly let light through

// Transmittance from `ray.t` to `far`, for a leg of optical depth `depth` from afar.
fn shade_through(
    ray: Ray, far: f32, depth: f32, walks: u32, rng: ptr<function, Rng>, count: ptr<function, Count>,
) -> vec3f {
    if (PROXY_EXACT) {
        return vec3f(exp(-spectrum_extinction() * select(0.0, proxy_depth(ray, ray.t, far, 0.0), far > ray.t)));
    }
    return vec3f(comb_transmittance(ray, far, max(SHADE_SPACING / f32(walks), SHADE_DEEP * depth), rng, count));
}

// A camera ray that begins where there is anything, so that t stays small however far the camera is; ends at `reach`.
fn shade_camera(view: View, table: Table, reach: f32) -> Ray {
    var ray = ray_new(view.origin, view.world);
    if (!CANDIDATES_MIXED) {
        ray.t = max(ray.t, table.near);
        ray.exit = min(ray.exit, table.far);
    }
    let skip = ray.t;
    ray.origin = ray_at(ray, skip);
    ray.exit = min(ray.exit, reach) - skip;
    ray.t = 0.0;
    return ray;
}

@compute @workgroup_size(8, 8)
fn shade_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ SHADE_STREAM);
    var count = Count();
    let table = frame_read(shade_table, position);
    let kept = reservoir_load(pixel);
    let parts = target_parts(position, kept.path);
    let holds = kept.aim > 0.0 && kept.weight != 0.0;

    // A path's film sample was chosen for what the medium scatters; what is behind it needs its own.
    let view = view_ray(position, rng_bits(&rng));
    let past = shade_camera(view, table, MATH_FAR);
    let opaque = -log(max(1.0 - table.opacity, TABLE_FLOOR));
    let through = shade_through(past, past.exit, opaque, frame.walks, &rng, &count);

    let before = shade_camera(parts.view, table, select(0.0, kept.path.t, holds));
    let depth = -log(table_transmittance(table, kept.path.t));
    let arrived = shade_through(before, before.exit, depth, frame.walks, &rng, &count);
    let onward = ray_new(parts.vertex, parts.onward);
    let far = select(0.0, min(onward.exit, parts.reach), holds);
    let leg = proxy_leg(onward, far, PROXY_ENDLESS);
    let reached = shade_through(onward, leg.end, leg.depth, frame.walks, &rng, &count);

    let scattered = select(vec3f(0.0), parts.value * kept.weight * arrived * reached, holds);
    var radiance = scattered + through * light_background(view.world, -1.0);
    let bad = !(dot(radiance, radiance) < MATH_FAR);
    radiance = select(radiance, vec3f(0.0), bad);
    var sums = film_load(pixel);
    sums.radiance += radiance;
    sums.square += radiance * radiance;
    sums.opacity += 1.0 - math_mean3(through);
    sums.samples += 1.0;
    film_store(pixel, sums);
    film_count(FILM_LOOKUPS, count.lookups);
    film_count(FILM_STEPS, count.steps);
    film_count(FILM_VIOLATIONS, count.violations);
    film_count(FILM_CAPPED, count.caps);
    film_count(FILM_NONFINITE, select(0u, 1u, bad));
}
