// Slot @proxy: analytic media are known exactly, from afar too.
//!use core/params
//!use core/ray
//!slot medium

const PROXY_EXACT: bool = true;
const PROXY_ENDLESS: f32 = 1e6;  // stands for an endless optical depth; small enough to be multiplied by 0
const PROXY_DEEP: f32 = 24.0;    // optical depth beyond which nothing is seen
const PROXY_REST: f32 = 1e-6;    // share of the depth of an endless ray that is left away
const PROXY_PARTS: f32 = 64.0;   // of a ray, at the finest

// Where there is nothing more to look for along a ray: infinite boxes have no other end.
fn proxy_end(ray: Ray) -> f32 {
    let all = min(medium_depth(ray, ray.t, ray.exit), PROXY_ENDLESS / params.sigma);
    let deep = PROXY_DEEP / (params.sigma * params.proxy_weakest);
    let end = medium_invert(ray, ray.t, min(all * (1.0 - PROXY_REST), deep));
    return min(max(end, ray.t), ray.exit);
}

// How much of a ray, up to `far`, the finest look stands for.
fn proxy_finest(ray: Ray, far: f32) -> f32 {
    return max(far - ray.t, 0.0) / PROXY_PARTS;
}

// The coarsest level: each has looks twice as long as the one before.
fn proxy_coarsest() -> f32 {
    return 6.0;
}

// Optical depth of the strongest channel from `a` to `b`, whatever the level.
fn proxy_depth(ray: Ray, a: f32, b: f32, level: f32) -> f32 {
    return min(medium_depth(ray, a, b) * params.sigma, PROXY_ENDLESS);
}
