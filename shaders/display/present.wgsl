// Draws the resolved picture into the window's viewport: bilinear scaling, exposure, tone map, overlays.
//!use core/params
//!use display/tone_map

@group(1) @binding(0) var present_picture: texture_2d<f32>;
@group(1) @binding(1) var present_sampler: sampler;

struct PresentVertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

const PRESENT_NOISE: u32 = 1u;
const PRESENT_SAMPLES: u32 = 2u;
const PRESENT_NOISE_DECADES: f32 = 3.0;   // the noise overlay spans 0.1 % to 100 %
const PRESENT_SAMPLES_TOP: f32 = 16.0;    // the samples overlay spans 1 to 2^16
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
    if (params.overlay == PRESENT_NOISE) {
        return vec4f(present_heat(1.0 + log2(max(value.a, 1e-9)) / log2(10.0) / PRESENT_NOISE_DECADES), 1.0);
    }
    if (params.overlay == PRESENT_SAMPLES) {
        return vec4f(present_heat(log2(max(value.a, 1.0)) / PRESENT_SAMPLES_TOP), 1.0);
    }
    return vec4f(tone_map_apply(params.tone_map, value.rgb * params.exposure), 1.0);
}
