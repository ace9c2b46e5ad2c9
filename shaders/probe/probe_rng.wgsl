// Random numbers: `slice.samples` words of four from the stream of each pixel.
//!use probe/probe
//!use core/rng

@compute @workgroup_size(64)
fn probe_rng_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    let first = id.x * slice.samples;
    if (first + slice.samples > arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(slice.first_group + id.x, slice.first_sample, params.seed);
    for (var i = 0u; i < slice.samples; i++) {
        let a = rng_next(&rng);
        let b = rng_next(&rng);
        let c = rng_next(&rng);
        probe_out[first + i] = vec4f(a, b, c, rng_depth(&rng));
    }
}
