// What every pass knows of the picture: camera, medium, film, seed. Written by `Params::of` in src/render/params.rs only.
//
// Spaces. World: as in the scene, but lengths divided by `Params::unit` (CPU side), so that the volume's box is about 1
// across. Local: texels of the density texture, (0,0,0) at the outer corner of the first texel; for analytic media the
// object's own space.

struct Params {
    camera_local: vec3f,        // camera, local space
    aperture: f32,              // lens radius, world units
    camera_right: vec3f,        // half a picture to the right at distance 1, world space
    focus: f32,                 // distance of the sharp plane along the axis, world units
    camera_up: vec3f,           // half a picture up at distance 1, world space
    seed: u32,
    camera_forward: vec3f,      // unit axis, world space
    max_bounces: u32,           // 0xffffffff: unlimited
    local_from_world_x: vec3f,  // columns of the linear map from world directions to local ones
    width: u32,
    local_from_world_y: vec3f,
    height: u32,
    local_from_world_z: vec3f,
    epsilon: f32,               // a step that surely crosses a cell's face, local units
    world_from_local_x: vec3f,  // columns of the inverse map
    sigma: f32,                 // extinction of a stored value of 1 in the strongest channel, per world unit
    world_from_local_y: vec3f,
    inv_cell: f32,              // majorant cells per local unit
    world_from_local_z: vec3f,
    cell: f32,                  // side of a majorant cell, local units
    box_min: vec3f,             // the field's support, local space
    g: f32,                     // mean cosine of the phase function
    box_max: vec3f,
    g2: f32,                    // mean cosine of the second lobe
    extinction: vec3f,          // colour factors of the extinction, greatest 1
    lobe_weight: f32,           // share of the first lobe
    albedo: vec3f,              // single-scattering albedo
    light_count: u32,
    constant_radiance: vec3f,   // sum of the constant lights
    light_reference: f32,       // a typical radiance of the picture; steers roulette, never a mean
    environment_scale: f32,     // factor on the environment map
    environment_sin: f32,       // its rotation about +Y
    environment_cos: f32,
    environment_share: f32,     // chance that a light sample comes from the map
    length_unit: f32,           // scene units of one world unit
    majorant_factor: f32,       // factor on all bounds of the density
    tiles_x: u32,               // tiles of 8×8 pixels in a row
    tiles: u32,                 // tiles of the picture
    tile_stride: u32,           // coprime to `tiles`; spreads neighbouring workgroups over the picture
    overlay: u32,               // what the view shows: the place in `Overlay` in src/scene/mod.rs
    exposure: f32,              // factor before the tone map
    tone_map: u32,
    inv_texels: vec3f,          // one over the texels of the density texture
    inv_width: f32,             // one over the pixels in a row
    last_cell: vec3i,           // of the majorant grid
    inv_height: f32,
    profile: vec3f,             // analytic media: gradient of the affine function behind the density, local space
    profile_offset: f32,        // its value at the origin
    step: f32,                  // step of ray marching, world units
    overlay_low: f32,           // ends of the overlay's colours, as logarithms (base 2) where its scale is one
    overlay_high: f32,
    overlay_scale: u32,         // how its values become colours: `Scale` in src/render/heat.rs
    inv_proxy: vec3f,           // one over the sides of the density from afar (slot @proxy), local units
    proxy_inv_cell: f32,        // one over the side of its finest cells
    proxy_last: f32,            // its coarsest level
    proxy_weakest: f32,         // the least extinction factor above 0
    unused0: f32,
    unused1: f32,
}

// The part of the work that one dispatch does.
struct Slice {
    first_group: u32,
    first_sample: u32,
    samples: u32,
    unused: u32,
}

@group(0) @binding(0) var<uniform> params_uniform: Params;

// The copy that all code reads; every kernel begins with `params = params_uniform`. Mesa's software driver loads a
// uniform once for all lanes only where all lanes run: inside a loop each read costs a gather, a third of the path
// tracer's time in all.
var<private> params: Params;
@group(0) @binding(1) var<uniform> slice: Slice;

// Parameters of which Mesa's software driver does not know that they are the same for all: it compiles a long kernel anew for every
// dispatch, and keeps them all, where that branches by uniforms alone; milliseconds and a megabyte each. `none` is 0.
fn params_vary(all: Params, none: u32) -> Params {
    var varied = all;
    varied.max_bounces += none;
    varied.light_count += none;
    varied.constant_radiance += vec3f(f32(none));
    return varied;
}
