// Reservoirs: each pixel's light path, what it stands for, and how it is stored. The first half is all that paths of one
// scattering need; more vertices and the light that reaches them are the other half.
//!use core/math

// How a path gets its light at its last vertex.
const RESERVOIR_NONE: u32 = 0u;
const RESERVOIR_DELTA: u32 = 1u;    // a delta sun or a point light, number `id`
const RESERVOIR_BRIGHT: u32 = 2u;   // a sample of the bright sky along `omega`
const RESERVOIR_ESCAPE: u32 = 3u;   // scattering chose `omega`, which leaves the medium
const RESERVOIR_HOW: u32 = 3u;      // mask of the above
const RESERVOIR_DEEPER: u32 = 4u;   // is added for each vertex after the first
// At the third vertex: light that was scattered on and reaches it along `omega`, `value`, estimated once.
const RESERVOIR_FROZEN: u32 = 8u;
const RESERVOIR_VERTICES: u32 = 3u; // at most

const RESERVOIR_GRID: f32 = 2097152.0;  // steps of a folded direction in 1

// Where a pixel's path comes from.
const RESERVOIR_OWN: u32 = 0u;
const RESERVOIR_HISTORY: u32 = 1u;
const RESERVOIR_NEIGHBOUR: u32 = 2u;

struct Path {
    kind: u32,
    id: u32,
    film: u32,      // film sample, two shares of 16 bits
    t: f32,         // from the camera to the first vertex, world units
    omega: vec3f,   // where the light comes from: unit, world space
    second: vec3f,  // from the first vertex to the second, world space: however short, its direction is exact
    third: vec3f,   // from the second to the third
    value: vec3f,   // frozen radiance that reaches the third vertex along `omega`, RGB of `reservoir_round`
}

struct Reservoir {
    path: Path,
    weight: f32,      // unbiased contribution weight W
    aim: f32,         // the target of the path in its own pixel
    confidence: f32,  // samples that it stands for, c
    origin: u32,
    age: u32,         // frames since the path was drawn
}

// Two words each for a pixel.
@group(3) @binding(8) var<storage, read_write> reservoir_near: array<vec4u>;
@group(3) @binding(9) var<storage, read_write> reservoir_far: array<vec4u>;

// Vertices of a path.
fn reservoir_depth(kind: u32) -> u32 {
    return 1u + kind / RESERVOIR_DEEPER;
}

fn reservoir_sign(v: vec2f) -> vec2f {
    return select(vec2f(-1.0), vec2f(1.0), v >= vec2f(0.0));
}

// A unit vector as two numbers and back (Meyer et al. 2010): what is stored is what is meant, rounding is no error. On a grid, far
// coarser than what normalising rounds, so that a vector folds to the same numbers however often: at the edge of a sun's disc
// the next float may be a hundred thousand times brighter.
fn reservoir_fold(v: vec3f) -> vec2f {
    let p = v.xy / (abs(v.x) + abs(v.y) + abs(v.z));
    return round(select((1.0 - abs(p.yx)) * reservoir_sign(p), p, v.z >= 0.0) * RESERVOIR_GRID) / RESERVOIR_GRID;
}

fn reservoir_unfold(p: vec2f) -> vec3f {
    let z = 1.0 - abs(p.x) - abs(p.y);
    let folded = (1.0 - abs(p.yx)) * reservoir_sign(p);
    return normalize(vec3f(select(folded, p, z >= 0.0), z));
}

// Three numbers of 21 bits each, sign and exponent as they are, and back; what is stored is what is meant.
fn reservoir_shorten(v: vec3f) -> vec3u {
    return (bitcast<vec3u>(v) + vec3u(1024u)) >> vec3u(11u);
}

fn reservoir_round(v: vec3f) -> vec3f {
    return bitcast<vec3f>(reservoir_shorten(v) << vec3u(11u));
}

fn reservoir_pack_far(p: Path) -> array<vec4u, 2> {
    let v = reservoir_shorten(p.value);
    return array<vec4u, 2>(
        vec4u(bitcast<vec3u>(p.second), v.x | (v.z << 21u)),
        vec4u(bitcast<vec3u>(p.third), v.y | ((v.z >> 11u) << 21u)),
    );
}

fn reservoir_pack(r: Reservoir) -> array<vec4u, 2> {
    let p = r.path;
    let omega = reservoir_fold(p.omega);
    let meta_word = p.kind | (r.origin << 4u) | (min(r.age, 255u) << 8u) | (p.id << 16u);
    return array<vec4u, 2>(
        vec4u(bitcast<u32>(p.t), p.film, bitcast<u32>(r.weight), bitcast<u32>(r.aim)),
        vec4u(bitcast<u32>(omega.x), bitcast<u32>(omega.y), meta_word, bitcast<u32>(r.confidence)),
    );
}

fn reservoir_unpack(a: vec4u, b: vec4u, c: vec4u, d: vec4u) -> Reservoir {
    let path = Path(
        b.z & 15u,
        b.z >> 16u,
        a.y,
        bitcast<f32>(a.x),
        reservoir_unfold(vec2f(bitcast<f32>(b.x), bitcast<f32>(b.y))),
        bitcast<vec3f>(c.xyz),
        bitcast<vec3f>(d.xyz),
        bitcast<vec3f>(vec3u(c.w & 0x1fffffu, d.w & 0x1fffffu, (c.w >> 21u) | ((d.w >> 21u) << 11u)) << vec3u(11u)),
    );
    let age = (b.z >> 8u) & 255u;
    return Reservoir(path, bitcast<f32>(a.z), bitcast<f32>(a.w), bitcast<f32>(b.w), (b.z >> 4u) & 15u, age);
}

fn reservoir_load(pixel: u32) -> Reservoir {
    var c = vec4u(0u);
    var d = vec4u(0u);
    if (REUSE_SECOND) {
        c = reservoir_far[2u * pixel];
        d = reservoir_far[2u * pixel + 1u];
    }
    return reservoir_unpack(reservoir_near[2u * pixel], reservoir_near[2u * pixel + 1u], c, d);
}

fn reservoir_store(pixel: u32, r: Reservoir) {
    let words = reservoir_pack(r);
    reservoir_near[2u * pixel] = words[0];
    reservoir_near[2u * pixel + 1u] = words[1];
    if (REUSE_SECOND) {
        let far = reservoir_pack_far(r.path);
        reservoir_far[2u * pixel] = far[0];
        reservoir_far[2u * pixel + 1u] = far[1];
    }
}
