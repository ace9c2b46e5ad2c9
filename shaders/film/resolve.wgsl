// From sums to the picture that is shown: mean radiance in rgb, and what the overlay asks for in a.
//!use core/params

@group(1) @binding(0) var<storage, read> resolve_sum: array<vec4f>;
@group(1) @binding(1) var<storage, read> resolve_square: array<vec4f>;
@group(1) @binding(2) var<storage, read> resolve_sum_total: array<vec4f>;
@group(1) @binding(3) var<storage, read> resolve_square_total: array<vec4f>;
@group(1) @binding(4) var resolve_picture: texture_storage_2d<rgba16float, write>;

const RESOLVE_NOISE: u32 = 1u;
const RESOLVE_SAMPLES: u32 = 2u;
const RESOLVE_MAX: f32 = 65000.0;  // the largest value that the 16-bit picture holds, about

@compute @workgroup_size(8, 8)
fn resolve_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (id.x >= params.width || id.y >= params.height) {
        return;
    }
    let pixel = id.y * params.width + id.x;
    let sum = resolve_sum[pixel] + resolve_sum_total[pixel];
    let square = resolve_square[pixel] + resolve_square_total[pixel];
    let n = max(square.w, 1.0);
    let mean = sum.xyz / n;
    var extra = 0.0;
    if (params.overlay == RESOLVE_NOISE) {
        let variance = max(square.xyz / n - mean * mean, vec3f(0.0)) / max(n - 1.0, 1.0);
        extra = sqrt((variance.x + variance.y + variance.z) / 3.0) / max((mean.x + mean.y + mean.z) / 3.0, 1e-6);
    } else if (params.overlay == RESOLVE_SAMPLES) {
        extra = square.w;
    }
    textureStore(resolve_picture, id.xy, vec4f(min(mean, vec3f(RESOLVE_MAX)), min(extra, RESOLVE_MAX)));
}
