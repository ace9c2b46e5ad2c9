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
const PRESENT_LOG: u32 = 1u;                 // scales of overlays: logarithmic, and whole numbers with colours of their own
const PRESENT_NAMES: u32 = 2u;
const PRESENT_FALSE_COLOUR: u32 = 4u;     // index of the false-colour tone map
const PRESENT_STOPS: f32 = 8.0;           // its range to either side of middle grey
const PRESENT_GREY: f32 = 0.18;

// One triangle that covers the viewport.
@vertex
fn present_vertex(@builtin(vertex_index) index: u32) -> PresentVertex {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return PresentVertex(vec4f(corner * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), corner);
}

// The colour of a whole number, of a pixel by itself: between two of them there is nothing.
fn present_named(uv: vec2f) -> vec3f {
    let size = vec2f(textureDimensions(present_picture));
    let number = textureLoad(present_picture, vec2u(clamp(uv * size, vec2f(0.0), size - 1.0)), 0).a;
    var colours = array<vec3f, 4>(
        vec3f(0.0, 0.0, 0.0), vec3f(0.0, 114.0, 178.0), vec3f(230.0, 159.0, 0.0), vec3f(240.0, 228.0, 66.0),
    );
    return select(colours[u32(clamp(number, 0.0, 3.0))] / 255.0, PRESENT_UNKNOWN, number < 0.0);
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
        if (params.overlay_scale == PRESENT_NAMES) {
            return vec4f(present_named(in.uv), 1.0);
        }
        let x = select(value.a, log2(max(value.a, PRESENT_LEAST)), params.overlay_scale == PRESENT_LOG);
        let heat = present_heat((x - params.overlay_low) / (params.overlay_high - params.overlay_low));
        return vec4f(select(heat, PRESENT_UNKNOWN, value.a < 0.0), 1.0);
    }
    return vec4f(tone_map_apply(params.tone_map, value.rgb * params.exposure), 1.0);
}
