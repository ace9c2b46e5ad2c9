// Slot @medium: the nearest voxel of the dense texture.
//!use core/params

@group(1) @binding(0) var medium_texture: texture_3d<f32>;
@group(1) @binding(1) var medium_sampler: sampler;

// Stored value (density over the greatest) at a point in local space.
fn medium_density(p: vec3f) -> f32 {
    let last = vec3i(textureDimensions(medium_texture)) - 1;
    return textureLoad(medium_texture, clamp(vec3i(floor(p)), vec3i(0), last), 0).x;
}
