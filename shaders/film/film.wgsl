// The film: running sums of each pixel. Sums of at most FILM_BLOCK samples are kept apart and then added to totals
// (film/flush), so that a hundred thousand samples lose no digits. Samples are added in order, whatever the dispatches.
//!use core/params

struct FilmPixel {
    radiance: vec3f,  // sum
    opacity: f32,     // samples that met the medium
    square: vec3f,    // sum of squares
    samples: f32,
}

@group(3) @binding(0) var<storage, read_write> film_sum: array<vec4f>;
@group(3) @binding(1) var<storage, read_write> film_square: array<vec4f>;
@group(3) @binding(2) var<storage, read_write> film_aov: array<vec4f>;
@group(3) @binding(3) var<storage, read_write> film_counters: array<atomic<u32>>;
// What each pixel's paths did since counting began, two for each: lookups, segments, null collisions, real collisions;
// shadow rays, violations, samples that were not finite, samples. The same events as the counters'.
@group(3) @binding(4) var<storage, read_write> film_cost: array<vec4u>;

// Samples of a block; the same as BLOCK in src/render/film.rs.
const FILM_BLOCK: u32 = 256u;

// 64-bit counters of the whole picture, as pairs of words; the order is that of `Counters` in src/render/counters.rs.
const FILM_LOOKUPS: u32 = 0u;
const FILM_NULLS: u32 = 1u;
const FILM_REALS: u32 = 2u;
const FILM_STEPS: u32 = 3u;
const FILM_SHADOWS: u32 = 4u;
const FILM_NONFINITE: u32 = 5u;
const FILM_BEHIND: u32 = 6u;
const FILM_VIOLATIONS: u32 = 7u;
const FILM_CAPPED: u32 = 8u;

fn film_load(pixel: u32) -> FilmPixel {
    let a = film_sum[pixel];
    let b = film_square[pixel];
    return FilmPixel(a.xyz, a.w, b.xyz, b.w);
}

fn film_store(pixel: u32, p: FilmPixel) {
    film_sum[pixel] = vec4f(p.radiance, p.opacity);
    film_square[pixel] = vec4f(p.square, p.samples);
}

fn film_count(counter: u32, value: u32) {
    if (value != 0u) {
        let old = atomicAdd(&film_counters[2u * counter], value);
        if (old + value < old) {
            atomicAdd(&film_counters[2u * counter + 1u], 1u);
        }
    }
}
