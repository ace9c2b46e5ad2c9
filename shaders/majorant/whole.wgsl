// Slot @majorant: one majorant for the whole support, known without a lookup.
//!use core/ray
//!use core/math

// The majorant of the stored value where the ray is, and the t up to which it holds.
fn majorant_segment(ray: Ray) -> vec2f {
    return vec2f(1.0, MATH_FAR);
}
