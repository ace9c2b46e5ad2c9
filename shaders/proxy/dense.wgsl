// Slot @proxy: the density from afar: means over cells that double from level to level, interpolated. It is above 0 wherever
// the density is (`volume::proxy`), and depends on nothing but the place: targets of resampling must not be random.
//!use core/params
//!use core/math
//!use core/ray

@group(1) @binding(3) var proxy_texture: texture_3d<f32>;
@group(1) @binding(4) var proxy_sampler: sampler;

const PROXY_EXACT: bool = false;

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

// Optical depth of the strongest channel from `a` to `b`, by one look at a level of cells.
fn proxy_depth(ray: Ray, a: f32, b: f32, level: f32) -> f32 {
    let place = ray_at(ray, 0.5 * (a + b));
    return textureSampleLevel(proxy_texture, proxy_sampler, place * params.inv_proxy, level).x * (b - a) * params.sigma;
}
