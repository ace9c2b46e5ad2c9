// Regular tracking of whole legs: the transmittance, exact from cell to cell of the interpolated density. Where stretches are
// empty nothing is looked at, and a leg ends where nothing gets through.
//!use core/params
//!use core/rng
//!use core/ray
//!use track/count
//!use medium/dual
//!slot majorant
//!slot proxy
//!slot spectrum

const EXACT_MOST: u32 = 16384u;  // cells and stretches of a leg, a guard
const EXACT_TAPS: u32 = 2u;      // lookups of a cell
const EXACT_DEEP: f32 = 24.0;    // optical depth of the weakest channel beyond which nothing gets through

const EXACT_SURE: f32 = 4.0;     // the same beyond which what gets through is worth a chance, no more

// A ray that begins where it meets the medium: distances stay small however far the camera is.
fn exact_near(ray: Ray, far: f32) -> Ray {
    var near = ray;
    near.origin = ray_at(ray, ray.t);
    near.t = 0.0;
    near.exit = min(ray.exit, far) - ray.t;
    return near;
}

// Optical depth of the strongest channel from `start.t` to `far`, which lies within the medium's box; any that is at least `deep`
// where it is.
fn exact_depth(start: Ray, far: f32, deep: f32, count: ptr<function, Count>) -> f32 {
    if (PROXY_EXACT) {
        return select(0.0, proxy_depth(start, start.t, far, 0.0), far > start.t);
    }
    var ray = exact_near(start, far);
    let last = ray.exit;
    var depth = 0.0;
    var segment: Segment;
    var end = ray.t;
    for (var i = 0u; i < EXACT_MOST; i++) {
        if (ray.t >= end) {
            if (end >= last || depth > deep) {
                break;
            }
            segment = majorant_segment(ray);
            end = max(min(segment.far, last), ray.t);
            (*count).steps += 1u;
        }
        var next = end;
        if (segment.bound > 0.0 && end > ray.t) {
            next = min(dual_exit(ray, ray.t), end);
            depth += dual_depth(ray, ray.t, next) * params.sigma;
            (*count).lookups += EXACT_TAPS;
        }
        ray.t = next;
    }
    (*count).caps += select(0u, 1u, ray.t < last && depth <= deep);
    return depth;
}

// Transmittance from `start.t` to `far`.
fn exact_transmittance(start: Ray, far: f32, count: ptr<function, Count>) -> Spectrum {
    return exp(-spectrum_extinction() * exact_depth(start, far, EXACT_DEEP / params.proxy_weakest, count));
}

// The same at less cost: beyond an optical depth of EXACT_SURE a flight decides whether anything gets through.
fn exact_or_none(start: Ray, far: f32, rng: ptr<function, Rng>, count: ptr<function, Count>) -> Spectrum {
    let sure = EXACT_SURE / params.proxy_weakest;
    let end = sure + rng_depth(rng) / params.proxy_weakest;
    let depth = exact_depth(start, far, end, count);
    let chance = exp(-params.proxy_weakest * max(depth - sure, 0.0));
    return exp(-spectrum_extinction() * depth) * select(0.0, 1.0 / chance, depth < end);
}
