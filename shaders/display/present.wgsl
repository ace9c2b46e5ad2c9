// Draws the resolved picture into the window's viewport: bilinear scaling, exposure, tone map, overlays.
//!use core/params
//!use display/tone_map

@group(1) @binding(0) var present_picture: texture_2d<f32>;
@group(1) @binding(1) var present_sampler: sampler;

struct PresentVertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

const PRESENT_NO_OVERLAY: u32 = 0u;
const PRESENT_UNKNOWN: vec3f = vec3f(0.25);  // where the overlay knows nothing: a grey that its colours do not have
const PRESENT_LEAST: f32 = 1e-9;             // smaller values have no logarithm here
const PRESENT_FALSE_COLOUR: u32 = 4u;     // index of the false-colour tone map
const PRESENT_STOPS: f32 = 8.0;           // its range to either side of middle grey
const PRESENT_GREY: f32 = 0.18;

// One triangle that covers the viewport.
@vertex
fn present_vertex(@builtin(vertex_index) index: u32) -> PresentVertex {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return PresentVertex(vec4f(corner * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), corner);
}

// A share in 0 … 1 on the scale of the false-colour map.
fn present_heat(share: f32) -> vec3f {
    let stops = (2.0 * clamp(share, 0.0, 1.0) - 1.0) * PRESENT_STOPS;
    return tone_map_apply(PRESENT_FALSE_COLOUR, vec3f(PRESENT_GREY * exp2(stops)));
}

@fragment
fn present_fragment(in: PresentVertex) -> @location(0) vec4f {
    params = params_uniform;
    let value = textureSampleLevel(present_picture, present_sampler, in.uv, 0.0);
    if (params.overlay != PRESENT_NO_OVERLAY) {
        let x = select(value.a, log2(max(value.a, PRESENT_LEAST)), params.overlay_log != 0u);
        let heat = present_heat((x - params.overlay_low) / (params.overlay_high - params.overlay_low));
        return vec4f(select(heat, PRESENT_UNKNOWN, value.a < 0.0), 1.0);
    }
    return vec4f(tone_map_apply(params.tone_map, value.rgb * params.exposure), 1.0);
}
