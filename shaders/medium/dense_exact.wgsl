// Slot @medium: the same texture, interpolated in 32-bit floats: samplers may round the weights to 8 bits.
//!use core/params

@group(1) @binding(0) var medium_texture: texture_3d<f32>;
@group(1) @binding(1) var medium_sampler: sampler;

fn medium_texel(p: vec3i) -> f32 {
    return textureLoad(medium_texture, p, 0).x;
}

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    let q = p - 0.5;
    let base = floor(q);
    let f = q - base;
    let last = vec3i(textureDimensions(medium_texture)) - 1;
    let a = clamp(vec3i(base), vec3i(0), last);
    let b = min(a + 1, last);
    let x00 = mix(medium_texel(vec3i(a.x, a.y, a.z)), medium_texel(vec3i(b.x, a.y, a.z)), f.x);
    let x10 = mix(medium_texel(vec3i(a.x, b.y, a.z)), medium_texel(vec3i(b.x, b.y, a.z)), f.x);
    let x01 = mix(medium_texel(vec3i(a.x, a.y, b.z)), medium_texel(vec3i(b.x, a.y, b.z)), f.x);
    let x11 = mix(medium_texel(vec3i(a.x, b.y, b.z)), medium_texel(vec3i(b.x, b.y, b.z)), f.x);
    return mix(mix(x00, x10, f.y), mix(x01, x11, f.y), f.z);
}
