// Random numbers: PCG-RXS-M-XS 32 (O'Neill 2014) with a stream of its own for each (pixel, sample, seed).

struct Rng {
    state: u32,
    increment: u32,
}

// A well-mixed word (the output function of the generator).
fn rng_mix(word: u32) -> u32 {
    let x = ((word >> ((word >> 28u) + 4u)) ^ word) * 277803737u;
    return (x >> 22u) ^ x;
}

// The stream of one sample: state and increment both depend on all three, so that no two streams run in step.
fn rng_start(pixel: u32, sample: u32, seed: u32) -> Rng {
    let a = rng_mix(pixel * 747796405u + 2891336453u);
    let b = rng_mix((sample ^ a) * 747796405u + 2891336453u);
    let c = rng_mix((seed ^ b) * 747796405u + 2891336453u);
    return Rng(c, (rng_mix(c ^ 0x9e3779b9u) << 1u) | 1u);
}

// 32 random bits.
fn rng_bits(rng: ptr<function, Rng>) -> u32 {
    let old = (*rng).state;
    (*rng).state = old * 747796405u + (*rng).increment;
    return rng_mix(old);
}

// Uniform in [0, 1), of 24 bits: 32 would round up to 1.
fn rng_next(rng: ptr<function, Rng>) -> f32 {
    return f32(rng_bits(rng) >> 8u) * 0x1p-24;
}

// Exponentially distributed, mean 1: an optical depth to the next collision.
fn rng_depth(rng: ptr<function, Rng>) -> f32 {
    return -log(1.0 - rng_next(rng));
}

// Three numbers.
fn rng_three(rng: ptr<function, Rng>) -> vec3f {
    let a = rng_next(rng);
    let b = rng_next(rng);
    return vec3f(a, b, rng_next(rng));
}
