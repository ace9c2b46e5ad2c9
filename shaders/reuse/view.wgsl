// Camera rays whose film sample is known, and back: from a place to the film. A lens sample is a hash of the film sample's
// 32 bits, so that paths need not carry it.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray

struct View {
    origin: vec3f,  // local space
    world: vec3f,   // unit direction, world space
}

// The film sample of a pixel's centre.
const VIEW_CENTRE: u32 = 0x80008000u;

// The ray of a pinhole through a place of the film, in pixels.
fn view_pinhole(place: vec2f) -> View {
    let film = place * vec2f(params.inv_width, params.inv_height);
    let axis = params.camera_forward + params.camera_right * (2.0 * film.x - 1.0) + params.camera_up * (1.0 - 2.0 * film.y);
    return View(params.camera_local, axis);
}

// The ray of a pixel for a film sample: two shares of 16 bits.
fn view_ray(pixel: vec2u, film: u32) -> View {
    let share = (vec2f(vec2u(film & 0xffffu, film >> 16u)) + 0.5) * 0x1p-16;
    let pinhole = view_pinhole(vec2f(pixel) + share);
    if (CAMERA_LENS) {
        let mixed = rng_mix(film * 747796405u + 2891336453u);
        let radius = params.aperture * sqrt(f32(mixed >> 16u) * 0x1p-16);
        let angle = 2.0 * MATH_PI * f32(mixed & 0xffffu) * 0x1p-16;
        let lens = normalize(params.camera_right) * (radius * cos(angle)) + normalize(params.camera_up) * (radius * sin(angle));
        return View(pinhole.origin + ray_local(lens), normalize(pinhole.world * params.focus - lens));
    }
    return View(pinhole.origin, normalize(pinhole.world));
}

// The point (local space) at a distance along a ray.
fn view_at(view: View, t: f32) -> vec3f {
    return view.origin + ray_local(view.world) * t;
}

// A film sample moved by a part of a pixel, round and round.
fn view_turn(film: u32, by: vec2i) -> u32 {
    let x = u32(i32(film & 0xffffu) + by.x) & 0xffffu;
    return x | ((u32(i32(film >> 16u) + by.y) & 0xffffu) << 16u);
}

// The place of the film that sees a local point through the lens's centre, in pixels; negative where none does.
fn view_place(point: vec3f) -> vec2f {
    let v = ray_world(point - params.camera_local);
    let depth = dot(v, params.camera_forward);
    let x = dot(v, params.camera_right) / dot(params.camera_right, params.camera_right) / depth;
    let y = dot(v, params.camera_up) / dot(params.camera_up, params.camera_up) / depth;
    let place = vec2f(0.5 + 0.5 * x, 0.5 - 0.5 * y) * vec2f(f32(params.width), f32(params.height));
    let inside = depth > 0.0 && all(place >= vec2f(0.0)) && place.x < f32(params.width) && place.y < f32(params.height);
    return select(vec2f(-1.0), place, inside);
}
