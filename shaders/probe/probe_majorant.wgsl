// The walk through the majorant cells as the path tracer does it. For each ray: the stretch that it walks, then every
// segment with its bound and the greatest density over the bound at points in it.
//!use probe/probe
//!use core/ray
//!slot majorant
//!slot medium

const PROBE_MAJORANT_POINTS: u32 = 5u;

@compute @workgroup_size(64)
fn probe_majorant_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    let first = id.x * slice.samples;
    if (first + slice.samples > arrayLength(&probe_out)) {
        return;
    }
    var ray = ray_new(probe_in[2u * id.x].xyz, probe_in[2u * id.x + 1u].xyz);
    let travelled = ray.t;
    ray.origin = ray_at(ray, ray.t);
    ray.exit -= ray.t;
    ray.t = 0.0;
    probe_out[first] = vec4f(ray.t, ray.exit, ray.epsilon, travelled);
    for (var i = 1u; i < slice.samples && ray.t < ray.exit; i++) {
        let segment = majorant_segment(ray);
        let far = min(segment.far, ray.exit);
        var excess = -1.0;
        for (var k = 0u; k < PROBE_MAJORANT_POINTS; k++) {
            let t = mix(ray.t, far, f32(k) / f32(PROBE_MAJORANT_POINTS - 1u));
            excess = max(excess, medium_density(ray_at(ray, t)) - segment.bound);
        }
        probe_out[first + i] = vec4f(segment.bound, ray.t, far, excess);
        ray.t = max(far, ray.t);
    }
}
