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
const EXACT_CELLS: u32 = 2u;     // walked in one step: finding bounds costs as much as several of them
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

// A leg, walked from cell to cell.
struct ExactWalk {
    ray: Ray,         // where it is
    segment: Segment,
    end: f32,         // of the segment
    last: f32,        // of the leg
    rounds: u32,
}

// From `start.t` to `far`, which lies within the medium's box.
fn exact_begin(start: Ray, far: f32) -> ExactWalk {
    let ray = exact_near(start, far);
    return ExactWalk(ray, Segment(), ray.t, ray.exit, 0u);
}

fn exact_goes_on(walk: ExactWalk) -> bool {
    return walk.ray.t < walk.last && walk.rounds < EXACT_MOST;
}

// The optical depth of the strongest channel in the next cells of a stretch, or in one that is empty.
fn exact_step(walk: ptr<function, ExactWalk>, count: ptr<function, Count>) -> f32 {
    if ((*walk).ray.t >= (*walk).end) {
        (*walk).segment = majorant_segment((*walk).ray);
        (*walk).end = max(min((*walk).segment.far, (*walk).last), (*walk).ray.t);
        (*count).steps += 1u;
    }
    let ray = (*walk).ray;
    let end = (*walk).end;
    var t = end;
    var depth = 0.0;
    if ((*walk).segment.bound > 0.0) {
        t = ray.t;
        var planes = dual_planes(ray, t);
        let pace = abs(ray.inverse);
        for (var k = 0u; k < EXACT_CELLS; k++) {
            let next = min(max(math_min3(planes), t + ray.epsilon), end);
            planes += select(vec3f(0.0), pace, planes <= vec3f(next));
            depth += dual_depth(ray, t, next);
            (*count).lookups += select(0u, EXACT_TAPS, next > t);
            t = next;
        }
    }
    (*walk).ray.t = t;
    (*walk).rounds += 1u;
    (*count).caps += select(0u, 1u, (*walk).rounds == EXACT_MOST && t < (*walk).last);
    return depth * params.sigma;
}

// Optical depth of the strongest channel from `start.t` to `far`, which lies within the medium's box; any that is at least `deep`
// where it is.
fn exact_depth(start: Ray, far: f32, deep: f32, count: ptr<function, Count>) -> f32 {
    if (PROXY_EXACT) {
        return select(0.0, proxy_depth(start, start.t, far, 0.0), far > start.t);
    }
    var walk = exact_begin(start, far);
    var depth = 0.0;
    while (exact_goes_on(walk) && depth <= deep) {
        depth += exact_step(&walk, count);
    }
    return depth;
}

// Transmittance from `start.t` to `far`: exact, but beyond an optical depth of EXACT_SURE a flight decides whether anything gets
// through.
fn exact_or_none(start: Ray, far: f32, rng: ptr<function, Rng>, count: ptr<function, Count>) -> Spectrum {
    let sure = EXACT_SURE / params.proxy_weakest;
    let end = sure + rng_depth(rng) / params.proxy_weakest;
    let depth = exact_depth(start, far, end, count);
    let chance = exp(-params.proxy_weakest * max(depth - sure, 0.0));
    return exp(-spectrum_extinction() * depth) * select(0.0, 1.0 / chance, depth < end);
}
