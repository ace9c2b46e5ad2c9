// Slot @majorant: bounds of an exponential density, one unit of its exponent at a time, so that rays cross an infinite
// atmosphere in few segments.
//!use core/ray
//!use core/math
//!use majorant/segment
//!use medium/profile

const PROFILE_EMPTY: f32 = 85.0;          // exponent beyond which nothing is left for a float
const PROFILE_ULPS: f32 = 0x1p-20;        // what rounding may add to the density, relative

fn majorant_segment(ray: Ray) -> Segment {
    let slope = profile_slope(ray);
    let rises = slope < 0.0;
    let x = profile_at(ray_at(ray, ray.t));
    let size = max(abs(slope), 1.0 / MATH_FAR);
    // Steps of the exponent have fixed places, whatever the ray did before; the nudge leaves a face behind.
    let nudge = max(ray.epsilon * size, abs(x) * PROFILE_ULPS);
    let step = floor(x + select(nudge, -nudge, rises));
    let empty = step >= PROFILE_EMPTY;
    let left = select(step + 1.0 - x, x - select(step, PROFILE_EMPTY, empty), rises);
    // Far from the ray's origin t has few digits: always on by some of them.
    let least = max(ray.epsilon, ray.t * PROFILE_ULPS);
    let far = ray.t + select(max(left / size, least), MATH_FAR, empty && !rises);
    let thick = select(exp(-step) * (1.0 + PROFILE_ULPS), 0.0, empty);
    let thin = select(exp(-step - 1.0) * (1.0 - PROFILE_ULPS), 0.0, empty);
    return segment_new(thick, far, thin, thick - thin);
}
