// Last pass of a frame: the light of a pixel's path and of those that it met, with true transmittances, and what the camera sees
// through the medium. All of them in proportion to their weights are the mean of what choosing one would show, without the noise
// of the choice.
// Only here are random numbers drawn for a value that the resampling did not know: E[f̂·W] = E[E[f̂ | path]·W].
//
// Noise of these estimates is noise of the picture, so they are exact by default (track/exact). In volumes of very many voxels a
// power series around equidistant tracking (track/comb) looks less often.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use track/exact
//!use reuse/pairwise
//!use reuse/seen
//!use film/film

const SHADE_STREAM: u32 = 0x3c6ef372u;

// Light that a path brings to its pixel, but for its contribution weight.
fn shade_path(position: vec2u, path: Path, walks: u32, rng: ptr<function, Rng>, count: ptr<function, Count>) -> vec3f {
    let parts = target_parts(position, path);
    if (PROXY_EXACT || walks == 0u) {
        return parts.value * vec3f(seen_exactly(parts, path.t, count));
    }
    return parts.value * vec3f(seen_by_looks(parts, path.t, walks, rng, count));
}

@compute @workgroup_size(8, 8)
fn shade_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ SHADE_STREAM);
    var count = Count();

    // A path's film sample was chosen for what the medium scatters; what is behind it needs its own.
    let view = view_ray(position, rng_bits(&rng));
    let past = ray_new(view.origin, view.world);
    let through = vec3f(exact_or_none(past, proxy_end(past), &rng, &count));
    var radiance = through * light_background(view.world, -1.0);

    var all = pairwise_begin(position, reservoir_load(pixel), frame);
    for (var i = 0u; i <= frame.neighbours; i++) {
        var offer: PairwiseOffer;
        if (i < frame.neighbours) {
            offer = pairwise_meet(&all, position, i, frame);
        } else {
            offer = pairwise_own(all);
        }
        if (offer.w != 0.0) {
            radiance += shade_path(position, offer.path, frame.walks, &rng, &count) * (offer.w / offer.aim);
        }
    }
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
