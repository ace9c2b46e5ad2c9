// First pass of a frame: candidates for paths of one scattering, one of which is kept (resampled importance sampling, Talbot
// 2005); and distances from where reuse/suffix goes on.
//!use core/params
//!use core/rng
//!use core/math
//!use core/ray
//!use reuse/table
//!use reuse/end
//!use reuse/target
//!use reuse/frame
//!use reuse/onset

const CANDIDATES_STREAM: u32 = 0x68bc21ebu;  // tells its random numbers from other passes'

@compute @workgroup_size(8, 8)
fn candidates_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_vary(params_uniform, id.z);
    light_begin(0u);
    let position = id.xy;
    if (position.x >= params.width || position.y >= params.height) {
        return;
    }
    let pixel = position.y * params.width + position.x;
    let frame = frame_uniform;
    var rng = rng_start(pixel, frame.frame, params.seed ^ CANDIDATES_STREAM);

    let film = rng_bits(&rng);
    let view = view_ray(position, film);
    let ray = ray_new(view.origin, view.world);
    table_build(ray);
    var kept = Reservoir();
    kept.path.film = film;
    kept.path.omega = vec3f(0.0, 1.0, 0.0);
    kept.confidence = 1.0;
    var sum = 0.0;
    // For paths that go on, some of the distances by what is there.
    var onset = Onset();

    // Light samples and, where scattering may find light, phase samples: each kind has its own stretches of the table.
    let sky = end_finds();
    let by_light = select(0u, select(frame.candidates, (frame.candidates + 1u) / 2u, sky), LIGHT_SAMPLED);
    let by_phase = select(0u, max(frame.candidates - by_light, 1u), sky);
    let all = select(0u, by_light + by_phase, table_any() && params.max_bounces > 0u);
    for (var i = 0u; i < all; i++) {
        let lit = i < by_light;
        let place = select(i - by_light, i, lit);
        let count = f32(select(by_phase, by_light, lit));
        let drawn = table_sample((f32(place) + rng_next(&rng)) / count);
        var path = Path(RESERVOIR_ESCAPE, 0u, film, drawn.t, vec3f(0.0), vec3f(0.0), vec3f(0.0), vec3f(0.0));
        let vertex = view_at(view, path.t);
        if (REUSE_SECOND) {
            onset_offer(&onset, view, path.t, drawn.transmittance, drawn.density * f32(all), rng_three(&rng));
        }
        var density = drawn.density * count;
        if (LIGHT_SAMPLED && lit) {
            density *= end_lit(&path, vertex, 0u, &rng);
        } else {
            density *= end_scattered(&path, view.world, 0u, &rng);
        }
        let aim = target_beyond(position, path, drawn.transmittance, 1u);
        let w = select(0.0, aim / density, aim > 0.0 && density > 0.0);
        sum += w;
        if (rng_next(&rng) * sum < w) {
            kept.path = path;
            kept.aim = aim;
        }
    }
    kept.weight = select(0.0, sum / kept.aim, kept.aim > 0.0);

    reservoir_store(pixel, kept);
    if (REUSE_SECOND) {
        onset_leave(pixel, onset, frame.suffixes);
    }
}
