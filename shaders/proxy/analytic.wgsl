// Slot @proxy: analytic media are known exactly, from afar too.
//!use core/params
//!use core/ray
//!use proxy/leg
//!slot medium

const PROXY_EXACT: bool = true;
const PROXY_DEEP: f32 = 24.0;    // optical depth beyond which nothing is seen
const PROXY_REST: f32 = 1e-6;    // share of the depth of an endless ray that is left away

fn proxy_level(size: f32) -> f32 {
    return 0.0;
}

// Where there is nothing more to look for along a ray: infinite boxes have no other end.
fn proxy_end(ray: Ray) -> f32 {
    let all = min(medium_depth(ray, ray.t, ray.exit), PROXY_ENDLESS / params.sigma);
    let deep = PROXY_DEEP / (params.sigma * params.proxy_weakest);
    let end = medium_invert(ray, ray.t, min(all * (1.0 - PROXY_REST), deep));
    return min(max(end, ray.t), ray.exit);
}

// Where rays begin and end to meet the medium: candidates do not count on it (CANDIDATES_MIXED).
fn proxy_ends(ray: Ray, aside: f32) -> vec2f {
    return vec2f(ray.t, proxy_end(ray));
}

// Even steps from `a` to `b`: the least.
fn proxy_steps(ray: Ray, a: f32, b: f32, least: f32) -> f32 {
    return least;
}

// Optical depth of the strongest channel from `a` to `b`.
fn proxy_depth(ray: Ray, a: f32, b: f32, level: f32) -> f32 {
    return min(medium_depth(ray, a, b) * params.sigma, PROXY_ENDLESS);
}

// From the ray's `t` to `far`, and where the optical depth reaches `wanted`.
fn proxy_leg(ray: Ray, far: f32, wanted: f32) -> ProxyLeg {
    let depth = select(0.0, proxy_depth(ray, ray.t, far, 0.0), far > ray.t);
    let met = depth > wanted;
    let t = clamp(medium_invert(ray, ray.t, wanted / params.sigma), ray.t, max(far, ray.t));
    return ProxyLeg(depth, met, t, medium_density(ray_at(ray, t)) * params.sigma, far, 0u);
}
