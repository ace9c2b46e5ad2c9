// Slot @proxy: the density from afar: means over cells that double from level to level, interpolated. It is above 0 wherever
// the density is (`volume::proxy`), and depends on nothing but the place: targets of resampling must not be random.
//!use core/params
//!use core/math
//!use core/ray
//!use proxy/leg

@group(1) @binding(3) var proxy_texture: texture_3d<f32>;
@group(1) @binding(4) var proxy_sampler: sampler;

const PROXY_EXACT: bool = false;
const PROXY_STEPS: u32 = 96u;  // of a leg at most

// The finest level whose cells have a side of at least `size`, local units.
fn proxy_level(size: f32) -> f32 {
    return clamp(ceil(log2(size * params.proxy_inv_cell)), 0.0, params.proxy_last);
}

// Where there is nothing more to look for along a ray.
fn proxy_end(ray: Ray) -> f32 {
    return ray.exit;
}

// Where rays begin and end to meet the medium that are `aside` (local units) away from this one at distance 1.
fn proxy_ends(ray: Ray, aside: f32) -> vec2f {
    let middle = 0.5 * (params.box_min + params.box_max);
    let half = 0.5 * (params.box_max - params.box_min);
    let far = (length(middle - ray.origin) + length(half)) / math_max3(abs(ray.direction));
    let wide = half + aside * far;
    let a = (middle - wide - ray.origin) * ray.inverse;
    let b = (middle + wide - ray.origin) * ray.inverse;
    let near = min(a, b);
    return vec2f(max(0.0, math_max3(near)), math_min3(max(a, b)));
}

// Even steps from `a` to `b` that the coarsest cells bridge, `least` or more.
fn proxy_steps(ray: Ray, a: f32, b: f32, least: f32) -> f32 {
    let cells = (b - a) * math_max3(abs(ray.direction)) * params.proxy_inv_cell;
    return max(least, ceil(cells * exp2(-params.proxy_last)));
}

// Optical depth of the strongest channel from `a` to `b`, by one look.
fn proxy_depth(ray: Ray, a: f32, b: f32, level: f32) -> f32 {
    let p = ray_at(ray, 0.5 * (a + b)) * params.inv_proxy;
    return textureSampleLevel(proxy_texture, proxy_sampler, p, level).x * (b - a) * params.sigma;
}

// From the ray's `t` to `far`, and where the optical depth reaches `wanted`. Steps double every second time, and the cells
// that are looked at with them: near things count most.
fn proxy_leg(ray: Ray, far: f32, wanted: f32) -> ProxyLeg {
    var leg = ProxyLeg(0.0, false, far, 0.0, ray.t, 0u);
    let first = 1.0 / (params.proxy_inv_cell * math_max3(abs(ray.direction)));
    var t = ray.t;
    for (var i = 0u; i < PROXY_STEPS; i++) {
        if (t >= far) {
            break;
        }
        // A look misses what is further than half a cell from it: steps are no longer than cells.
        let level = min(f32(i / 2u), params.proxy_last);
        let next = select(min(t + first * exp2(level), far), far, i + 1u == PROXY_STEPS);
        let depth = proxy_depth(ray, t, next, level);
        let meets = !leg.met && leg.depth + depth > wanted;
        let rate = depth / (next - t);
        leg.t = select(leg.t, min(t + (wanted - leg.depth) / rate, next), meets);
        leg.rate = select(leg.rate, rate, meets);
        leg.met |= meets;
        leg.end = select(leg.end, next, depth > 0.0);
        leg.depth += depth;
        leg.looks += 1u;
        t = next;
    }
    return leg;
}
