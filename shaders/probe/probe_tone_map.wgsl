// Tone maps: the one numbered `slice.first_sample`, of given colours.
//!use probe/probe
//!use display/tone_map

@compute @workgroup_size(64)
fn probe_tone_map_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (id.x < arrayLength(&probe_out)) {
        probe_out[id.x] = vec4f(tone_map_apply(slice.first_sample, probe_in[id.x].xyz), 0.0);
    }
}
