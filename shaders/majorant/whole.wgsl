// Slot @majorant: one majorant for the whole support, known without a lookup. Where the density is 1 everywhere
// (MAJORANT_TIGHT), so is the control.
//!use core/ray
//!use core/math
//!use majorant/segment

fn majorant_segment(ray: Ray) -> Segment {
    let control = select(0.0, 1.0, MAJORANT_TIGHT);
    return segment_new(1.0, MATH_FAR, control, 1.0 - control);
}
