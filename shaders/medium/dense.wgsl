// Slot @medium: a dense 3-D texture with a border of one empty texel, filtered by the sampler.
//!use core/params

@group(1) @binding(0) var medium_texture: texture_3d<f32>;
@group(1) @binding(1) var medium_sampler: sampler;

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    return textureSampleLevel(medium_texture, medium_sampler, p * params.inv_texels, 0.0).x;
}
