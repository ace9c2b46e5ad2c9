// Transmittance estimators: sums of `slice.samples` estimates along each ray, by the steps of the path tracer.
//!use probe/probe
//!use track/step

@compute @workgroup_size(64)
fn probe_transmittance_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (4u * id.x + 3u >= arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(id.x, slice.first_sample, params.seed);
    let rays = arrayLength(&probe_in) / 2u;
    let origin = probe_in[2u * (id.x % rays)].xyz;     // local space
    let world = probe_in[2u * (id.x % rays) + 1u].xyz;  // unit direction, world space
    var count = Count();
    var sum = vec3f(0.0);
    var square = vec3f(0.0);
    var least = vec3f(MATH_FAR);
    var greatest = vec3f(-MATH_FAR);
    for (var i = 0u; i < slice.samples; i++) {
        var ray = ray_new(origin, world);
        ray.origin = ray_at(ray, ray.t);
        ray.exit -= ray.t;
        ray.t = 0.0;
        var depth = rng_depth(&rng);
        var played = 1.0;
        var flight = flight_start(&rng);
        var transmittance = transmittance_begin();
        for (var k = 0u; k < PROBE_STEPS; k++) {
            let event = step_on(&ray, &depth, true, &flight, &transmittance, &played, 0.0, &rng, &count);
            if (event != STEP_ON) {
                break;
            }
        }
        let found = vec3f(transmittance_value(transmittance)) * played;
        sum += found;
        square += found * found;
        least = min(least, found);
        greatest = max(greatest, found);
    }
    probe_out[4u * id.x] = vec4f(sum, f32(count.lookups));
    probe_out[4u * id.x + 1u] = vec4f(square, f32(count.steps));
    probe_out[4u * id.x + 2u] = vec4f(least, f32(count.violations));
    probe_out[4u * id.x + 3u] = vec4f(greatest, 0.0);
}
