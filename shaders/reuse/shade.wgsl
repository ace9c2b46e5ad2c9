// Last pass of a frame: the light of each pixel's path with true transmittances, and what the camera sees through the medium.
// Only here are random numbers drawn for a value that the resampling did not know: E[f̂·W] = E[E[f̂ | path]·W].
//
// Noise of these estimates is noise of the picture, so they are exact by default (track/exact). In volumes of very many voxels a
// power series around equidistant tracking (track/comb) looks less often.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use track/comb
//!use track/exact
//!use reuse/target
//!use reuse/frame
//!use film/film

const SHADE_STREAM: u32 = 0x3c6ef372u;
const SHADE_SPACING: f32 = 2.0;    // optical depth of the majorant between looks, times the setting's walks
const SHADE_DEEP: f32 = 0.1;       // the same as a share of a leg's own, for legs that hardly let light through

// Transmittance from `ray.t` to `far`: exact, or by so many looks for each SHADE_SPACING of the majorant's optical depth.
fn shade_leg(ray: Ray, far: f32, walks: u32, rng: ptr<function, Rng>, count: ptr<function, Count>) -> vec3f {
    if (PROXY_EXACT || walks == 0u) {
        return vec3f(exact_transmittance(ray, far, count));
    }
    let leg = exact_near(ray, far);
    let spacing = max(SHADE_SPACING / f32(walks), SHADE_DEEP * leg_march(leg, leg.exit).depth);
    return vec3f(comb_transmittance(leg, leg.exit, spacing, rng, count));
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
    let kept = reservoir_load(pixel);
    let parts = target_parts(position, kept.path);
    let holds = kept.aim > 0.0 && kept.weight != 0.0;

    // A path's film sample was chosen for what the medium scatters; what is behind it needs its own.
    let view = view_ray(position, rng_bits(&rng));
    let past = ray_new(view.origin, view.world);
    let through = vec3f(exact_or_none(past, proxy_end(past), &rng, &count));
    let before = ray_new(parts.view.origin, parts.view.world);
    let arrived = shade_leg(before, select(0.0, kept.path.t, holds), frame.walks, &rng, &count);
    var reached = vec3f(1.0);
    for (var i = 0u; i < select(0u, parts.legs, holds); i++) {
        let leg = target_take(parts, i);
        let onward = ray_new(leg.origin, leg.world);
        reached *= shade_leg(onward, min(onward.exit, leg.reach), frame.walks, &rng, &count);
    }

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
