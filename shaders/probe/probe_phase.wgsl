// The phase function: a sampled cosine and its value, and the value at a given cosine.
//!use probe/probe
//!use core/rng
//!slot phase

@compute @workgroup_size(64)
fn probe_phase_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (id.x >= arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(id.x, slice.first_sample, params.seed);
    let cosine = 1.0 - phase_drop(&rng);
    probe_out[id.x] = vec4f(cosine, phase_value(cosine), phase_value(probe_in[id.x].x), 0.0);
}
