// Draws B - A of two resolved pictures, in luminance after exposure, times a gain: nothing in the colour of the ground, more
// of A in A's colour, more of B in B's.
//!use core/params
//!use display/tone_map

@group(1) @binding(0) var difference_a: texture_2d<f32>;
@group(1) @binding(1) var difference_b: texture_2d<f32>;
@group(1) @binding(2) var difference_sampler: sampler;
// Display values of ground, A and B; the gain in the fourth channel of the first.
@group(1) @binding(3) var<uniform> difference_style: array<vec4f, 3>;

struct DifferenceVertex {
    @builtin(position) position: vec4f,
    @location(0) uv: vec2f,
}

// One triangle that covers the viewport.
@vertex
fn difference_vertex(@builtin(vertex_index) index: u32) -> DifferenceVertex {
    let corner = vec2f(f32((index << 1u) & 2u), f32(index & 2u));
    return DifferenceVertex(vec4f(corner * vec2f(2.0, -2.0) + vec2f(-1.0, 1.0), 0.0, 1.0), corner);
}

@fragment
fn difference_fragment(in: DifferenceVertex) -> @location(0) vec4f {
    params = params_uniform;
    let a = textureSampleLevel(difference_a, difference_sampler, in.uv, 0.0).rgb;
    let b = textureSampleLevel(difference_b, difference_sampler, in.uv, 0.0).rgb;
    let gain = difference_style[0].a * params.exposure;
    let signed = clamp(gain * dot(tone_map_LUMINANCE, b - a), -1.0, 1.0);
    let ink = select(difference_style[1], difference_style[2], signed > 0.0).rgb;
    return vec4f(mix(difference_style[0].rgb, ink, abs(signed)), 1.0);
}
