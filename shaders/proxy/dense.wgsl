// Slot @proxy: the density from afar: means over cells that double from level to level, interpolated. It is above 0 wherever
// the density is (`volume::proxy`), and depends on nothing but the place: targets of resampling must not be random.
//!use core/params
//!use core/math
//!use core/ray
//!slot medium

@group(1) @binding(3) var proxy_texture: texture_3d<f32>;
@group(1) @binding(4) var proxy_sampler: sampler;

const PROXY_EXACT: bool = false;
const PROXY_LEAST: f32 = -1.0;    // the finest level: looks at the density itself
const PROXY_DOUBT: f32 = 0.1;     // share of a cell's density that is there even so

// Where there is nothing more to look for along a ray.
fn proxy_end(ray: Ray) -> f32 {
    return ray.exit;
}

// How much of a ray, up to `far`, a look at the finest level may stand for: a look misses what is further than half a cell
// from it, so the stretch is no longer than a cell.
fn proxy_finest(ray: Ray, far: f32) -> f32 {
    return 1.0 / (params.proxy_inv_cell * math_max3(abs(ray.direction)));
}

// The coarsest level; the cells of each have twice the side of those of the one before.
fn proxy_coarsest() -> f32 {
    return params.proxy_last;
}

// Optical depth of the strongest channel from `a` to `b`, by one look. Below level 0 it is at the density itself, which may be
// 0 where it is not all along.
fn proxy_depth(ray: Ray, a: f32, b: f32, level: f32) -> f32 {
    let place = ray_at(ray, 0.5 * (a + b));
    var density = textureSampleLevel(proxy_texture, proxy_sampler, place * params.inv_proxy, max(level, 0.0)).x;
    if (level < 0.0) {
        density = max(PROXY_DOUBT * density, medium_density(place));
    }
    return density * (b - a) * params.sigma;
}
