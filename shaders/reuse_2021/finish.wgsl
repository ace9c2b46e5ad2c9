// The method of 2021, last pass of a frame: the light of each pixel's path with true transmittances, exact from cell to cell of
// the interpolated density (regular tracking), and the film. No random number is drawn.
//!use core/params
//!use core/math
//!use core/ray
//!use track/count
//!use medium/dual
//!slot majorant
//!use reuse/frame
//!use aim/marched
//!use film/film

const FINISH_MOST: u32 = 16384u;  // cells and stretches of a leg, a guard
const FINISH_TAPS: u32 = 2u;      // lookups of a cell

// Transmittance from `start.t` to `far`.
fn finish_through(start: Ray, far: f32, count: ptr<function, Count>) -> vec3f {
    var ray = start;
    var depth = 0.0;
    if (PROXY_EXACT) {
        depth = select(0.0, proxy_depth(ray, ray.t, far, 0.0), far > ray.t);
        return vec3f(exp(-spectrum_extinction() * depth));
    }
    var segment: Segment;
    var end = ray.t;
    for (var i = 0u; i < FINISH_MOST; i++) {
        if (ray.t >= end) {
            if (end >= far) {
                break;
            }
            segment = majorant_segment(ray);
            end = max(min(segment.far, far), ray.t);
            (*count).steps += 1u;
        }
        var next = end;
        if (segment.bound > 0.0 && end > ray.t) {
            next = min(dual_exit(ray, ray.t), end);
            depth += dual_depth(ray, ray.t, next) * params.sigma;
            (*count).lookups += FINISH_TAPS;
        }
        ray.t = next;
    }
    (*count).caps += select(0u, 1u, ray.t < far);
    return vec3f(exp(-spectrum_extinction() * depth));
}

// A ray up to `far`, from where it meets the medium: t stays small however far the camera is.
fn finish_near(ray: Ray, far: f32) -> Ray {
    var near = ray;
    near.origin = ray_at(ray, ray.t);
    near.exit = min(ray.exit, far) - ray.t;
    near.t = 0.0;
    return near;
}

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

    let before = finish_near(ray_new(parts.view.origin, parts.view.world), select(kept.path.t, MATH_FAR, through));
    let arrived = finish_through(before, select(0.0, before.exit, holds), &count);
    let onward = ray_new(parts.vertex, parts.onward);
    let reached = finish_through(onward, select(0.0, min(onward.exit, parts.reach), holds && !through), &count);
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
