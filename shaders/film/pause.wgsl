// Paths that a dispatch could not end, for the next to go on with. A dispatch has only so many rounds of loops: on Mesa's
// software driver all loops just end after 65535 of them; on others a long dispatch trips the driver's watchdog.
//!use core/params

const PAUSE_WORDS: u32 = 28u;  // of a slot: owner (pixel + 1, 0: free), sample, then the path

// Slots are shared: that of a pixel is its number modulo their count. Who finds it taken draws the path anew.
@group(3) @binding(5) var<storage, read_write> pause_slots: array<atomic<u32>>;

// A path about to set out from a vertex.
struct PausePath {
    origin: vec3f,      // local space
    depth: f32,
    toward: vec3f,      // unit, world space
    phase_pdf: f32,
    throughput: vec3f,
    reached: f32,
    radiance: vec3f,
    bounces: u32,
    single: vec3f,
    state: u32,         // of the random numbers
    flight: vec3f,
}

fn pause_at(pixel: u32) -> u32 {
    return PAUSE_WORDS * (pixel % (arrayLength(&pause_slots) / PAUSE_WORDS));
}

fn pause_put(at: u32, v: vec3f) {
    atomicStore(&pause_slots[at], bitcast<u32>(v.x));
    atomicStore(&pause_slots[at + 1u], bitcast<u32>(v.y));
    atomicStore(&pause_slots[at + 2u], bitcast<u32>(v.z));
}

fn pause_get(at: u32) -> vec3f {
    let x = atomicLoad(&pause_slots[at]);
    return bitcast<vec3f>(vec3u(x, atomicLoad(&pause_slots[at + 1u]), atomicLoad(&pause_slots[at + 2u])));
}

// Leaves a path for later, if there is room.
fn pause_leave(pixel: u32, sample: u32, path: PausePath) {
    let at = pause_at(pixel);
    if (!atomicCompareExchangeWeak(&pause_slots[at], 0u, pixel + 1u).exchanged) {
        return;
    }
    atomicStore(&pause_slots[at + 1u], sample);
    pause_put(at + 2u, path.origin);
    pause_put(at + 5u, path.toward);
    pause_put(at + 8u, path.throughput);
    pause_put(at + 11u, path.radiance);
    pause_put(at + 14u, path.single);
    pause_put(at + 17u, path.flight);
    pause_put(at + 20u, vec3f(path.depth, path.phase_pdf, path.reached));
    atomicStore(&pause_slots[at + 23u], path.bounces);
    atomicStore(&pause_slots[at + 24u], path.state);
}

// Whether the pixel left a path of that sample; frees its slot.
fn pause_take(pixel: u32, sample: u32, path: ptr<function, PausePath>) -> bool {
    let at = pause_at(pixel);
    if (atomicLoad(&pause_slots[at]) != pixel + 1u || atomicLoad(&pause_slots[at + 1u]) != sample) {
        return false;
    }
    let numbers = pause_get(at + 20u);
    *path = PausePath(
        pause_get(at + 2u),
        numbers.x,
        pause_get(at + 5u),
        numbers.y,
        pause_get(at + 8u),
        numbers.z,
        pause_get(at + 11u),
        atomicLoad(&pause_slots[at + 23u]),
        pause_get(at + 14u),
        atomicLoad(&pause_slots[at + 24u]),
        pause_get(at + 17u),
    );
    atomicStore(&pause_slots[at], 0u);
    return true;
}
