// A stretch of a ray on which the bounds hold. Densities are stored values: over the greatest.
//!use core/params

struct Segment {
    bound: f32,     // majorant of the density, times the majorant factor
    far: f32,       // t up to which all this holds
    control: f32,   // density that is integrated in closed form; where it is the minimum, nowhere above the density
    residual: f32,  // bound of |density − control|, times the majorant factor
}

fn segment_new(bound: f32, far: f32, control: f32, residual: f32) -> Segment {
    return Segment(bound * params.majorant_factor, far, control, residual * params.majorant_factor);
}
