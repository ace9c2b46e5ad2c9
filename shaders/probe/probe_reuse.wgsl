// Reuse: shift maps, pairs, reservoirs in memory, tables and targets. `slice.first_group` says which.
//!use probe/probe
//!use reuse/table
//!use reuse/pair
//!use core/ray
//!use track/exact

const PROBE_REUSE_STEPS: u32 = 1024u;  // of an integral

// A path drawn for tests, of any kind.
fn probe_reuse_path(rng: ptr<function, Rng>) -> Path {
    // All of them, and none of what is not.
    let kind = array<u32, 10>(1u, 2u, 3u, 5u, 6u, 7u, 8u, 9u, 10u, 11u)[rng_bits(rng) % 10u];
    let omega = math_around_drop(vec3f(0.0, 1.0, 0.0), 2.0 * rng_next(rng), 2.0 * MATH_PI * rng_next(rng));
    let middle = 0.5 * (params.box_min + params.box_max);
    let second = ray_world(mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng))) - middle);
    let third = ray_world(mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng))) - middle);
    let value = reservoir_round(vec3f(rng_next(rng), -rng_next(rng), 1e6 * rng_next(rng)));
    return Path(kind, 0u, rng_bits(rng), 10.0 * rng_next(rng), omega, second, third, value);
}

// Two rays, and a distance on the first: the distance on the second and back; and how the first changes with it.
fn probe_reuse_shift(i: u32) -> array<vec4f, 2> {
    let a = View(probe_in[4u * i].xyz, normalize(probe_in[4u * i + 1u].xyz));
    let b = View(probe_in[4u * i + 2u].xyz, normalize(probe_in[4u * i + 3u].xyz));
    let t = probe_in[4u * i].w;
    let forth = shift_affine(a, b);
    let back = shift_affine(b, a);
    let there = forth.offset + forth.kappa * t;
    return array<vec4f, 2>(
        vec4f(there, (there - forth.offset) / forth.kappa, forth.kappa, back.kappa),
        vec4f(view_at(b, there), dot(ray_world(view_at(a, t) - b.origin), b.world)),
    );
}

// A pixel's partner, and that one's.
fn probe_reuse_pair(i: u32) -> array<vec4f, 2> {
    var frame = Frame();
    frame.frame = slice.first_sample;
    frame.reach = 1u + slice.first_sample % 5u;
    let position = vec2u(i % params.width, i / params.width);
    let partner = pair_partner(position, slice.first_sample % 3u, frame);
    let back = pair_partner(vec2u(max(partner, vec2i(0))), slice.first_sample % 3u, frame);
    return array<vec4f, 2>(
        vec4f(vec2f(partner), vec2f(back)),
        vec4f(vec2f(position), f32(1u << frame.reach), 0.0),
    );
}

// A reservoir packed and unpacked, twice: differences of the parts, and of the words.
fn probe_reuse_pack(rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let path = probe_reuse_path(rng);
    var r = Reservoir(path, rng_next(rng) * 1e6, rng_next(rng) * 1e-6, rng_next(rng) * 40.0, 0u, 0u);
    r.path.id = rng_bits(rng) & 0xffffu;
    r.origin = rng_bits(rng) % 3u;
    r.age = rng_bits(rng) % 300u;
    let words = reservoir_pack(r);
    let far = reservoir_pack_far(path);
    let back = reservoir_unpack(words[0], words[1], far[0], far[1]);
    let again = reservoir_pack(back);
    let same = back.path.kind == r.path.kind && back.path.id == r.path.id && back.path.film == r.path.film
        && back.path.t == r.path.t && all(back.path.second == path.second)
        && all(back.path.third == path.third) && all(back.path.value == path.value)
        && back.weight == r.weight && back.aim == r.aim && back.confidence == r.confidence && back.origin == r.origin
        && back.age == min(r.age, 255u);
    return array<vec4f, 2>(
        vec4f(select(1.0, 0.0, same), length(back.path.omega - path.omega), abs(length(back.path.omega) - 1.0), 0.0),
        vec4f(length(reservoir_unpack(again[0], again[1], far[0], far[1]).path.omega - back.path.omega), 0.0, 0.0, 0.0),
    );
}

// The stretch of the table that holds a distance.
fn probe_reuse_stretch(t: f32) -> u32 {
    var k = 1u;
    while (k < table_count && table_t[k] < t) {
        k += 1u;
    }
    return k;
}

// A ray's table: ∫ of the density of distances over what is drawn, told by drawing them evenly; the share lost before a drawn
// distance against the number that drew it; the transmittance to it against that of the leg; and whether distances reach a random
// point in the medium (1: they do not).
fn probe_reuse_table(i: u32, rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let position = vec2u(i % params.width, i / params.width);
    let film = rng_bits(rng);
    let view = view_ray(position, film);
    let ray = ray_new(view.origin, view.world);
    table_build(ray);
    let u = rng_next(rng);
    let drawn = table_sample(u);
    let lost = (1.0 - drawn.transmittance) / max(table_opacity(), 1e-9);
    // The density is the slope of what draws: dt/du · density = 1.
    let step = 1e-3;
    let on = table_sample(min(u + step, 0.9999));
    var sum = 0.0;
    var share = 0.0;
    for (var k = 0u; k < PROBE_REUSE_STEPS; k++) {
        let a = table_sample((f32(k) + 0.25) / f32(PROBE_REUSE_STEPS));
        let b = table_sample((f32(k) + 0.75) / f32(PROBE_REUSE_STEPS));
        // Between stretches the density jumps.
        let same = probe_reuse_stretch(a.t) == probe_reuse_stretch(b.t);
        sum += select(0.0, (b.t - a.t) * 0.5 * (a.density + b.density), same);
        share += select(0.0, 0.5 / f32(PROBE_REUSE_STEPS), same);
    }
    var parts = Target();
    parts.view = view;
    let leg = target_seen(parts, drawn.t, 0u);
    let t = mix(ray.t, ray.exit, rng_next(rng));
    let density = select(0.0, target_density(ray_at(ray, t)), ray.exit > ray.t);
    let k = probe_reuse_stretch(t);
    let outside = t < table_t[0] || t > table_t[table_count];
    let missed = density > 0.0 && (outside || !(table_grey[k] > table_grey[k - 1u]));
    let any = select(0.0, 1.0, table_any());
    let drawn_share = select(1.0, sum / share, share > 0.0);
    return array<vec4f, 2>(
        vec4f(drawn_share, select(0.0, lost - u, table_opacity() > 0.01), any, leg / drawn.transmittance - 1.0),
        vec4f(density, select(0.0, density, missed), t, on.t - drawn.t),
    );
}

// A leg from a random point: whether there is medium where it loses no light; and at a random distance −log of the transmittance
// from afar and of the true one.
fn probe_reuse_leg(rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let origin = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let target_point = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let ray = ray_new(origin, normalize(ray_world(target_point - origin)));
    let leg = leg_march(ray, ray.exit);
    let t = ray.exit * rng_next(rng);
    let density = target_density(ray_at(ray, t));
    let stretch = leg_until(ray, ray.exit, true, t);
    let missed = stretch.before_t > t || stretch.t < t || !(stretch.grey > stretch.before_grey);
    var count = Count();
    let depth = exact_depth(ray, t, MATH_FAR, &count);
    return array<vec4f, 2>(
        vec4f(density, select(0.0, density, missed), t, 0.0),
        vec4f(f32(leg.looks), leg.depth, leg_within(stretch, t), leg_grey(depth)),
    );
}

// The density, per length, with which a flight from afar ends where it does.
fn probe_reuse_density(flight: LegFlight) -> f32 {
    return leg_rate(flight.march) * exp(-leg_within(flight.march, flight.t));
}

// The flight that a number draws along a leg: the transmittance to it from afar, against the number; and its density against the
// slope of flights.
fn probe_reuse_flight(rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let origin = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let target_point = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let ray = ray_new(origin, normalize(ray_world(target_point - origin)));
    let u = 0.999 * rng_next(rng);
    let all = leg_march(ray, ray.exit);
    let flight = leg_flight(ray, ray.exit, true, u);
    let step = 1e-3 * (1.0 - u);
    let on = leg_flight(ray, ray.exit, true, u + step);
    let misses = flight.met != (1.0 - exp(-all.grey) > u);
    let slope = (on.t - flight.t) * 0.5 * (probe_reuse_density(flight) + probe_reuse_density(on)) / step;
    return array<vec4f, 2>(
        vec4f(select(0.0, 1.0, misses), select(0.0, slope - 1.0, flight.met && on.met), 0.0, 0.0),
        vec4f(flight.t, all.grey, 0.0, 0.0),
    );
}

// A target, asked twice, and whether its path carries light.
fn probe_reuse_target(i: u32, rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let position = vec2u(i % params.width, i / params.width);
    var path = probe_reuse_path(rng);
    let view = view_ray(position, path.film);
    let ray = ray_new(view.origin, view.world);
    path.t = mix(ray.t, ray.exit, rng_next(rng));
    let parts = target_parts(position, path);
    let aim = target_value(position, path);
    let again = target_value(position, path);
    return array<vec4f, 2>(vec4f(aim, math_max3(parts.value), again, 0.0), vec4f(parts.value, path.t));
}

@compute @workgroup_size(64)
fn probe_reuse_main(@builtin(global_invocation_id) id: vec3u) {
    params = params_uniform;
    light_begin(0u);
    if (2u * id.x + 1u >= arrayLength(&probe_out)) {
        return;
    }
    var rng = rng_start(id.x, slice.first_sample, params.seed);
    var values: array<vec4f, 2>;
    switch (slice.first_group) {
        case 0u: { values = probe_reuse_shift(id.x); }
        case 1u: { values = probe_reuse_pair(id.x); }
        case 2u: { values = probe_reuse_pack(&rng); }
        case 3u: { values = probe_reuse_table(id.x, &rng); }
        case 4u: { values = probe_reuse_leg(&rng); }
        case 5u: { values = probe_reuse_flight(&rng); }
        default: { values = probe_reuse_target(id.x, &rng); }
    }
    probe_out[2u * id.x] = values[0];
    probe_out[2u * id.x + 1u] = values[1];
}
