// The environment map: equirectangular, bilinear; +Y up, the centre column looks along −Z, u grows towards +X.
// Directions are drawn by an alias table over the texels, uniform in solid angle within a texel.
//!use core/params
//!use core/math
//!use core/rng

struct EnvironmentEntry {
    threshold: f32,  // below it the texel itself is drawn, else its alias
    alias_texel: u32,
    pdf: f32,        // of this texel, per steradian
    pdf_alias: f32,  // of the alias
}

@group(2) @binding(1) var environment_map: texture_2d<f32>;
@group(2) @binding(2) var<storage, read> environment_table: array<EnvironmentEntry>;

// Into the map's own frame: the map is turned counter-clockwise seen from +Y.
fn environment_frame(w: vec3f) -> vec3f {
    let c = params.environment_cos;
    let s = params.environment_sin;
    return vec3f(c * w.x - s * w.z, w.y, s * w.x + c * w.z);
}

// Out of the map's frame.
fn environment_world(w: vec3f) -> vec3f {
    let c = params.environment_cos;
    let s = params.environment_sin;
    return vec3f(c * w.x + s * w.z, w.y, c * w.z - s * w.x);
}

// Texture coordinates in [0, 1]² of a direction.
fn environment_uv(w: vec3f) -> vec2f {
    let e = environment_frame(w);
    let u = 0.5 + atan2(e.x, -e.z) / (2.0 * MATH_PI);
    // Drivers may compute acos badly; atan2 holds.
    return vec2f(u, atan2(length(e.xz), e.y) / MATH_PI);
}

fn environment_texel(x: i32, y: i32, size: vec2i) -> vec3f {
    return textureLoad(environment_map, vec2i((x + size.x) % size.x, clamp(y, 0, size.y - 1)), 0).rgb;
}

fn environment_radiance(w: vec3f) -> vec3f {
    let size = vec2i(textureDimensions(environment_map));
    let p = environment_uv(w) * vec2f(size) - 0.5;
    let base = floor(p);
    let f = p - base;
    let i = vec2i(base);
    let top = mix(environment_texel(i.x, i.y, size), environment_texel(i.x + 1, i.y, size), f.x);
    let bottom = mix(environment_texel(i.x, i.y + 1, size), environment_texel(i.x + 1, i.y + 1, size), f.x);
    return mix(top, bottom, f.y) * params.environment_scale;
}

// Density per steradian with which `environment_sample` draws `w`.
fn environment_pdf(w: vec3f) -> f32 {
    let size = vec2u(textureDimensions(environment_map));
    let texel = min(vec2u(environment_uv(w) * vec2f(size)), size - 1u);
    return environment_table[texel.y * size.x + texel.x].pdf;
}

fn environment_sample(rng: ptr<function, Rng>) -> vec3f {
    let size = vec2u(textureDimensions(environment_map));
    let count = size.x * size.y;
    var texel = min(u32(rng_next(rng) * f32(count)), count - 1u);
    if (rng_next(rng) >= environment_table[texel].threshold) {
        texel = environment_table[texel].alias_texel;
    }
    let row = f32(texel / size.x);
    let top = cos(MATH_PI * row / f32(size.y));
    let bottom = cos(MATH_PI * (row + 1.0) / f32(size.y));
    let y = mix(top, bottom, rng_next(rng));
    let phi = 2.0 * MATH_PI * ((f32(texel % size.x) + rng_next(rng)) / f32(size.x) - 0.5);
    let r = sqrt(max(0.0, 1.0 - y * y));
    return environment_world(vec3f(r * sin(phi), y, -r * cos(phi)));
}
