// Constants and small geometry.

const MATH_PI: f32 = 3.14159265358979;
const MATH_FAR: f32 = 1e30;

// The direction whose cosine with the unit vector `w` is 1 − h, at azimuth `phi`; exact for small h too.
// Branchless basis of Duff et al. 2017.
fn math_around_drop(w: vec3f, h: f32, phi: f32) -> vec3f {
    let s = select(-1.0, 1.0, w.z >= 0.0);
    let a = -1.0 / (s + w.z);
    let b = w.x * w.y * a;
    let x = vec3f(1.0 + s * w.x * w.x * a, s * b, -s * w.x);
    let y = vec3f(b, s + w.y * w.y * a, -w.y);
    let r = sqrt(max(0.0, h * (2.0 - h)));
    return normalize(x * (r * cos(phi)) + y * (r * sin(phi)) + w * (1.0 - h));
}

fn math_max3(v: vec3f) -> f32 {
    return max(v.x, max(v.y, v.z));
}

fn math_min3(v: vec3f) -> f32 {
    return min(v.x, min(v.y, v.z));
}

fn math_mean3(v: vec3f) -> f32 {
    return (v.x + v.y + v.z) * (1.0 / 3.0);
}
