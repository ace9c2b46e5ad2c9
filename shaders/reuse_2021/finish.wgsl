// The method of 2021, last pass of a frame: the light of each pixel's path with true transmittances, exact from cell to cell of
// the interpolated density (regular tracking), and the film. No random number is drawn.
//!use core/params
//!use core/math
//!use core/ray
//!use track/exact
//!use reuse/frame
//!use aim/marched
//!use reuse/seen
//!use film/film

@compute @workgroup_size(8, 8)
fn finish_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    var count = Count();
    let kept = reservoir_load(pixel);
    var parts = target_parts(position, kept.path);
    let holds = kept.aim > 0.0 && kept.weight != 0.0;
    let through = kept.path.kind == MARCHED_THROUGH;
    if (through) {
        parts.value = light_background(parts.view.world, -1.0);
    }
    parts.legs = select(0u, parts.legs, holds && !through);
    let end = select(0.0, select(kept.path.t, MATH_FAR, through), holds);
    let arrived = vec3f(seen_exactly(parts, end, &count));
    var radiance = select(vec3f(0.0), parts.value * kept.weight * arrived, holds);
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
