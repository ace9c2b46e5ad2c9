// Free flights: sums over `slice.samples` of them along each ray, by the steps of the path tracer. Of the weights of those
// that escape, of those that collide, and of the latter times t.
//!use probe/probe
//!use track/step

@compute @workgroup_size(64)
fn probe_flight_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    if (6u * id.x + 5u >= arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(id.x, slice.first_sample, params.seed);
    let rays = arrayLength(&probe_in) / 2u;
    let origin = probe_in[2u * (id.x % rays)].xyz;     // local space
    let world = probe_in[2u * (id.x % rays) + 1u].xyz;  // unit direction, world space
    var count = Count();
    var sums = array<vec3f, 6>();
    for (var i = 0u; i < slice.samples; i++) {
        var ray = ray_new(origin, world);
        ray.origin = ray_at(ray, ray.t);
        ray.exit -= ray.t;
        ray.t = 0.0;
        var depth = rng_depth(&rng);
        var played = 1.0;
        var flight = flight_start(&rng);
        var transmittance = transmittance_begin();
        var done = false;
        for (var k = 0u; k < PROBE_STEPS; k++) {
            let event = step_on(&ray, &depth, false, &flight, &transmittance, &played, 0.0, &rng, &count);
            done = event == STEP_DONE;
            if (event != STEP_ON) {
                break;
            }
        }
        // What a path carries on: in a coloured medium a collision brings in the extinction of each channel.
        let weight = vec3f(flight_weight(flight));
        let escaped = select(vec3f(0.0), weight, done);
        let collided = weight - escaped;
        let moment = collided * ray.t;
        sums[0] += escaped;
        sums[1] += escaped * escaped;
        sums[2] += collided;
        sums[3] += collided * collided;
        sums[4] += moment;
        sums[5] += moment * moment;
    }
    let counts = array<f32, 6>(f32(count.lookups), f32(count.nulls), f32(count.steps), f32(count.violations), 0.0, 0.0);
    for (var k = 0u; k < 6u; k++) {
        probe_out[6u * id.x + k] = vec4f(sums[k], counts[k]);
    }
}
