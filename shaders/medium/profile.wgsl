// What analytic media share: an affine function of the point, on which their density depends.
//!use core/params
//!use core/ray

fn profile_at(p: vec3f) -> f32 {
    return params.profile_offset + dot(params.profile, p);
}

// Its growth along the ray, per t.
fn profile_slope(ray: Ray) -> f32 {
    return dot(params.profile, ray.direction);
}
