// Exact integrals of the interpolated density: between the planes through texel centres (the dual cells) it is a cubic
// of t, for which Gauss' rule of two points is exact (tracking.md §1.3). Between the planes of nearest voxels
// (MEDIUM_NEAREST) it is constant.
//!use core/params
//!use core/math
//!use core/ray
//!slot medium

const DUAL_ORIGIN: f32 = select(0.5, 0.0, MEDIUM_NEAREST);  // where cells begin, in texels
const DUAL_GAUSS: f32 = 0.21132487;  // (1 − 1/√3) / 2
const DUAL_ROUNDS: u32 = 24u;        // halvings that find a root to a float's last digit

// The t of the next plane across each axis.
fn dual_planes(ray: Ray, t: f32) -> vec3f {
    let up = ray.direction > vec3f(0.0);
    let p = ray_at(ray, t) + select(vec3f(-params.epsilon), vec3f(params.epsilon), up) - DUAL_ORIGIN;
    let face = floor(p) + select(vec3f(0.0), vec3f(1.0), up) + DUAL_ORIGIN;
    return (face - ray.origin) * ray.inverse;
}

// The t up to which the density is one cubic: more than `t`.
fn dual_exit(ray: Ray, t: f32) -> f32 {
    return max(math_min3(dual_planes(ray, t)), t + ray.epsilon);
}

// ∫ density dt from `a` to `b` in one cell.
fn dual_depth(ray: Ray, a: f32, b: f32) -> f32 {
    let near = medium_density(ray_at(ray, mix(a, b, DUAL_GAUSS)));
    let far = medium_density(ray_at(ray, mix(b, a, DUAL_GAUSS)));
    return 0.5 * (b - a) * (near + far);
}

// The t between `a` and `b` of one cell at which the integral from `a` on reaches `depth`.
fn dual_invert(ray: Ray, a: f32, b: f32, depth: f32) -> f32 {
    let v = vec4f(
        medium_density(ray_at(ray, a)),
        medium_density(ray_at(ray, mix(a, b, 1.0 / 3.0))),
        medium_density(ray_at(ray, mix(a, b, 2.0 / 3.0))),
        medium_density(ray_at(ray, b)),
    );
    // The cubic through four even points, integrated: x·(c0 + x·(c1 + x·(c2 + x·c3))).
    let c0 = v.x;
    let c1 = (-11.0 * v.x + 18.0 * v.y - 9.0 * v.z + 2.0 * v.w) / 4.0;
    let c2 = (18.0 * v.x - 45.0 * v.y + 36.0 * v.z - 9.0 * v.w) / 6.0;
    let c3 = (-9.0 * v.x + 27.0 * v.y - 27.0 * v.z + 9.0 * v.w) / 8.0;
    let wanted = depth / (b - a);
    var low = 0.0;
    var high = 1.0;
    for (var i = 0u; i < DUAL_ROUNDS; i++) {
        let x = 0.5 * (low + high);
        let below = x * (c0 + x * (c1 + x * (c2 + x * c3))) < wanted;
        low = select(low, x, below);
        high = select(x, high, below);
    }
    return mix(a, b, 0.5 * (low + high));
}
