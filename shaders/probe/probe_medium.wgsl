// The medium: density at given points.
//!use probe/probe
//!slot medium

@compute @workgroup_size(64)
fn probe_medium_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (id.x < arrayLength(&probe_out)) {
        probe_out[id.x] = vec4f(medium_density(probe_in[id.x].xyz), 0.0, 0.0, 0.0);
    }
}
