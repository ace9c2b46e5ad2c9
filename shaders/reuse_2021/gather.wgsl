// The method of 2021, fourth pass of a frame: paths of three neighbours, the same offsets for all pixels of a frame. Talbot's
// weights, which ask for every path in every pixel.
//!use core/params
//!use core/rng
//!use core/math
//!use reuse/frame
//!use aim/marched

@group(3) @binding(10) var<storage, read_write> gather_near: array<vec4u>;
@group(3) @binding(11) var<storage, read_write> gather_far: array<vec4u>;

const GATHER_STREAM: u32 = 0x1b56c4e9u;
const GATHER_MOST: u32 = 4u;         // pixels, the own one among them
const GATHER_RADIUS: f32 = 10.0;     // pixels
const GATHER_R2: vec2u = vec2u(3242174889u, 2447445414u);  // steps of the R2 sequence (Roberts 2018), in 32 bits

// The offset of neighbour k in a frame: even over a disc.
fn gather_offset(k: u32, frame: Frame) -> vec2i {
    let n = frame.frame * frame.neighbours + k + rng_mix(params.seed * 747796405u + 2891336453u);
    let u = vec2f((n * GATHER_R2) >> vec2u(8u)) * 0x1p-24;
    let angle = 2.0 * MATH_PI * u.y;
    return vec2i(round(GATHER_RADIUS * sqrt(u.x) * vec2f(cos(angle), sin(angle))));
}

// Whether a pixel's ray meets nothing at all.
fn gather_bare(path: Path) -> bool {
    return path.kind == MARCHED_THROUGH && path.t <= 0.0;
}

// The path of one pixel in another: at its distance.
fn gather_shift(path: Path, own: vec2u, other: vec2u) -> Path {
    let here = view_ray(own, VIEW_CENTRE);
    let there = view_ray(other, VIEW_CENTRE);
    return marched_stay(path, view_at(here, path.t), view_at(there, path.t));
}

@compute @workgroup_size(8, 8)
fn gather_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ GATHER_STREAM);
    let own = reservoir_load(pixel);

    // Pixels that take part, and how much each counts.
    var places: array<vec2u, GATHER_MOST>;
    var counts: array<f32, GATHER_MOST>;
    places[0] = position;
    counts[0] = own.confidence;
    for (var k = 1u; k < GATHER_MOST; k++) {
        let offset = gather_offset(k - 1u, frame);
        let place = vec2i(position) + offset;
        let inside = all(place >= vec2i(0)) && all(place < vec2i(vec2u(params.width, params.height)));
        let other_place = k <= frame.neighbours && inside && any(offset != vec2i(0));
        let q = select(position, vec2u(max(place, vec2i(0))), inside);
        let other = reservoir_load(q.y * params.width + q.x);
        let takes = other_place && !gather_bare(other.path) && !gather_bare(own.path);
        places[k] = q;
        counts[k] = select(0.0, other.confidence, takes);
    }

    var kept = own;
    kept.aim = 0.0;
    var sum = 0.0;
    var total = 0.0;
    for (var i = 0u; i < GATHER_MOST; i++) {
        if (counts[i] <= 0.0) {
            continue;
        }
        let theirs = reservoir_load(places[i].y * params.width + places[i].x);
        var path = theirs.path;
        path.t = select(path.t, own.path.t, path.kind == MARCHED_THROUGH);
        var all_parts = 0.0;
        var here = 0.0;
        for (var j = 0u; j < GATHER_MOST; j++) {
            var aim = theirs.aim;
            if (j != i && counts[j] > 0.0 && theirs.aim > 0.0) {
                aim = marched_value(places[j], gather_shift(path, places[i], places[j]));
            }
            all_parts += counts[j] * aim;
            here = select(here, aim, j == 0u);
        }
        let m = counts[i] * theirs.aim / max(all_parts, 1e-37);
        let w = select(0.0, m * here * theirs.weight, theirs.aim > 0.0 && here > 0.0);
        total += counts[i];
        sum += w;
        if (rng_next(&rng) * sum < w) {
            kept.path = gather_shift(path, places[i], position);
            kept.aim = here;
            kept.origin = select(RESERVOIR_NEIGHBOUR, own.origin, i == 0u);
            kept.age = theirs.age;
        }
    }
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);
    kept.confidence = total;

    let words = reservoir_pack(kept);
    gather_near[2u * pixel] = words[0];
    gather_near[2u * pixel + 1u] = words[1];
    if (REUSE_SECOND) {
        let far = reservoir_pack_far(kept.path);
        gather_far[2u * pixel] = far[0];
        gather_far[2u * pixel + 1u] = far[1];
    }
}
