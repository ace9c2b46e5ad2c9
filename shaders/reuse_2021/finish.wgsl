// The method of 2021, last pass of a frame: the light of each pixel's path with true transmittances, exact from cell to cell of
// the interpolated density (regular tracking), and the film. No random number is drawn.
//!use core/params
//!use core/math
//!use core/ray
//!use track/exact
//!use reuse/frame
//!use aim/marched
//!use film/film

@compute @workgroup_size(8, 8)
fn finish_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    var count = Count();
    let kept = reservoir_load(pixel);
    let parts = target_parts(position, kept.path);
    let holds = kept.aim > 0.0 && kept.weight != 0.0;
    let through = kept.path.kind == MARCHED_THROUGH;

    let before = ray_new(parts.view.origin, parts.view.world);
    let end = select(0.0, min(before.exit, select(kept.path.t, MATH_FAR, through)), holds);
    let arrived = vec3f(exact_transmittance(before, end, &count));
    var reached = vec3f(1.0);
    for (var i = 0u; i < select(0u, parts.legs, holds && !through); i++) {
        let leg = target_take(parts, i);
        let onward = ray_new(leg.origin, leg.world);
        reached *= vec3f(exact_transmittance(onward, min(onward.exit, leg.reach), &count));
    }
    var value = parts.value;
    if (through) {
        value = light_background(parts.view.world, -1.0);
    }

    var radiance = select(vec3f(0.0), value * kept.weight * arrived * reached, holds);
    let bad = !(dot(radiance, radiance) < MATH_FAR);
    radiance = select(radiance, vec3f(0.0), bad);
    let seen = select(0.0, math_mean3(arrived) * kept.weight, holds && through);
    var sums = film_load(pixel);
    sums.radiance += radiance;
    sums.square += radiance * radiance;
    sums.opacity += 1.0 - select(0.0, seen, seen < MATH_FAR);
    sums.samples += 1.0;
    film_store(pixel, sums);
    film_count(FILM_LOOKUPS, count.lookups);
    film_count(FILM_STEPS, count.steps);
    film_count(FILM_CAPPED, count.caps);
    film_count(FILM_NONFINITE, select(0u, 1u, bad));
}
