// Rays in local space. The parameter t is the distance in world units, whatever the volume's transform.
//!use core/params

struct Ray {
    origin: vec3f,     // local space
    direction: vec3f,  // local units per world unit
    inverse: vec3f,
    t: f32,            // where the ray is, from the origin
    exit: f32,         // where it leaves the support
    epsilon: f32,      // a step that surely crosses a cell's face
}

// A component below this is nudged away from 0, where 0 · ∞ would be NaN on a face.
const RAY_TINY: f32 = 1e-12;

fn ray_local(world: vec3f) -> vec3f {
    return params.local_from_world_x * world.x + params.local_from_world_y * world.y + params.local_from_world_z * world.z;
}

fn ray_world(local: vec3f) -> vec3f {
    return params.world_from_local_x * local.x + params.world_from_local_y * local.y + params.world_from_local_z * local.z;
}

// From `origin` (local space) along the unit vector `world`; t starts where the ray meets the support. Beyond it,
// exit ≤ t: there is nothing to meet.
fn ray_new(origin: vec3f, world: vec3f) -> Ray {
    var ray: Ray;
    let d = ray_local(world);
    ray.direction = select(d, select(vec3f(-RAY_TINY), vec3f(RAY_TINY), d >= vec3f(0.0)), abs(d) < vec3f(RAY_TINY));
    ray.inverse = 1.0 / ray.direction;
    let a = (params.box_min - origin) * ray.inverse;
    let b = (params.box_max - origin) * ray.inverse;
    let near = min(a, b);
    let far = max(a, b);
    ray.origin = origin;
    ray.t = max(0.0, max(near.x, max(near.y, near.z)));
    ray.exit = min(far.x, min(far.y, far.z));
    let size = abs(ray.direction);
    ray.epsilon = params.epsilon / max(size.x, max(size.y, size.z));
    return ray;
}

fn ray_at(ray: Ray, t: f32) -> vec3f {
    return ray.origin + ray.direction * t;
}
