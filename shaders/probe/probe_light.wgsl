// Lights: a sample (direction and density, value and distance), and what a given direction sees with which density.
//!use probe/probe
//!use light/light

@compute @workgroup_size(64)
fn probe_light_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    light_begin(0u);
    if (3u * id.x + 2u >= arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(id.x, slice.first_sample, params.seed);
    let seen = probe_in[2u * id.x].xyz;   // a direction, world space
    let place = probe_in[2u * id.x + 1u].xyz;  // a point, local space
    let sample = light_sample(place, &rng);
    probe_out[3u * id.x] = vec4f(sample.direction, sample.pdf);
    probe_out[3u * id.x + 1u] = vec4f(sample.value, sample.distance);
    probe_out[3u * id.x + 2u] = vec4f(light_bright(seen), light_pdf(seen));
}
