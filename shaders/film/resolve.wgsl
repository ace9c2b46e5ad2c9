// From sums to the picture that is shown: mean radiance in rgb, and what the overlay asks for in a; negative where that is
// not known. A few pixels of it are also kept by themselves, so that the range of the overlay costs a small readback.
//!use core/params
//!use reuse/reservoir

@group(1) @binding(0) var<storage, read> resolve_sum: array<vec4f>;
@group(1) @binding(1) var<storage, read> resolve_square: array<vec4f>;
@group(1) @binding(2) var<storage, read> resolve_sum_total: array<vec4f>;
@group(1) @binding(3) var<storage, read> resolve_square_total: array<vec4f>;
@group(1) @binding(4) var resolve_picture: texture_storage_2d<rgba16float, write>;
@group(1) @binding(5) var<storage, read> resolve_cost: array<vec4u>;
@group(1) @binding(6) var<storage, read_write> resolve_sparse: array<f32>;

// Places in `Overlay` in src/scene/mod.rs.
const RESOLVE_NOISE: u32 = 1u;
const RESOLVE_SAMPLES: u32 = 2u;
const RESOLVE_LOOKUPS: u32 = 3u;
const RESOLVE_STEPS: u32 = 4u;
const RESOLVE_NULL_SHARE: u32 = 5u;
const RESOLVE_PATH_LENGTH: u32 = 6u;
const RESOLVE_CONFIDENCE: u32 = 7u;
const RESOLVE_AGE: u32 = 8u;
const RESOLVE_SOURCE: u32 = 9u;
const RESOLVE_WEIGHT: u32 = 10u;
const RESOLVE_UNKNOWN: f32 = -1.0;
const RESOLVE_MAX: f32 = 65000.0;  // the largest value that the 16-bit picture holds, about
const RESOLVE_SPARSE: u32 = 64u;   // pixels along a side that are kept by themselves, at most

// Per sample that was counted.
fn resolve_counted(pixel: u32) -> f32 {
    let near = resolve_cost[2u * pixel];
    let far = resolve_cost[2u * pixel + 1u];
    if (far.w == 0u) {
        return RESOLVE_UNKNOWN;
    }
    let n = f32(far.w);
    switch params.overlay {
        case RESOLVE_LOOKUPS: {
            return f32(near.x) / n;
        }
        case RESOLVE_STEPS: {
            return f32(near.y) / n;
        }
        case RESOLVE_NULL_SHARE: {
            let collisions = f32(near.z) + f32(near.w);
            return select(RESOLVE_UNKNOWN, f32(near.z) / collisions, collisions > 0.0);
        }
        default: {
            return f32(near.w) / n;
        }
    }
}

// Of the reservoir that was shaded last; not known where there is none. `Reservoir` in src/render/reservoir.rs.
fn resolve_kept(pixel: u32) -> f32 {
    if (2u * pixel + 2u > arrayLength(&reservoir_near)) {
        return RESOLVE_UNKNOWN;
    }
    let kept = reservoir_unpack(reservoir_near[2u * pixel], reservoir_near[2u * pixel + 1u], vec4u(0u), vec4u(0u));
    let holds = kept.aim > 0.0;
    var value = 0.0;
    switch params.overlay {
        case RESOLVE_CONFIDENCE: {
            value = kept.confidence;
        }
        case RESOLVE_AGE: {
            value = select(RESOLVE_UNKNOWN, f32(kept.age), holds);
        }
        case RESOLVE_SOURCE: {
            value = select(0.0, 1.0 + f32(kept.origin), holds);
        }
        default: {
            value = select(0.0, kept.weight * kept.aim, holds);
        }
    }
    return select(RESOLVE_UNKNOWN, value, kept.confidence > 0.0);
}

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
        extra = select(extra, RESOLVE_UNKNOWN, n < 2.0);
    } else if (params.overlay == RESOLVE_SAMPLES) {
        extra = square.w;
    } else if (params.overlay >= RESOLVE_LOOKUPS && params.overlay <= RESOLVE_PATH_LENGTH) {
        extra = resolve_counted(pixel);
    } else if (params.overlay >= RESOLVE_CONFIDENCE && params.overlay <= RESOLVE_WEIGHT) {
        extra = resolve_kept(pixel);
    }
    textureStore(resolve_picture, id.xy, vec4f(min(mean, vec3f(RESOLVE_MAX)), min(extra, RESOLVE_MAX)));
    // The first pixel of each of the blocks that the picture is cut into.
    let size = vec2u(params.width, params.height);
    let blocks = min(size, vec2u(RESOLVE_SPARSE));
    let block = id.xy * blocks / size;
    let before = (max(id.xy, vec2u(1u)) - 1u) * blocks / size;
    if (all((id.xy == vec2u(0u)) | (before != block))) {
        resolve_sparse[block.y * blocks.x + block.x] = extra;
    }
}
