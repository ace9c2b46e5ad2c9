// The camera: a thin lens (a pinhole at aperture 0), box filter over the pixel's square.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray

struct CameraRay {
    origin: vec3f,  // local space
    world: vec3f,   // unit direction, world space
}

fn camera_ray(pixel: vec2u, rng: ptr<function, Rng>) -> CameraRay {
    let jitter = vec2f(rng_next(rng), rng_next(rng));
    let film = (vec2f(pixel) + jitter) * vec2f(params.inv_width, params.inv_height);
    let axis = params.camera_forward + params.camera_right * (2.0 * film.x - 1.0) + params.camera_up * (1.0 - 2.0 * film.y);
    if (CAMERA_LENS) {
        let radius = params.aperture * sqrt(rng_next(rng));
        let angle = 2.0 * MATH_PI * rng_next(rng);
        let lens = normalize(params.camera_right) * (radius * cos(angle)) + normalize(params.camera_up) * (radius * sin(angle));
        return CameraRay(params.camera_local + ray_local(lens), normalize(axis * params.focus - lens));
    }
    return CameraRay(params.camera_local, normalize(axis));
}
