// Reuse: shift maps, pairs, reservoirs in memory, tables and targets. `slice.first_group` says which.
//!use probe/probe
//!use reuse/pair
//!use core/ray

const PROBE_REUSE_STEPS: u32 = 4096u;  // of an integral

// A path drawn for tests, of any kind.
fn probe_reuse_path(rng: ptr<function, Rng>) -> Path {
    let kind = 1u + rng_bits(rng) % 7u;
    let omega = math_around_drop(vec3f(0.0, 1.0, 0.0), 2.0 * rng_next(rng), 2.0 * MATH_PI * rng_next(rng));
    let second = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let value = vec3f(rng_next(rng), rng_next(rng), rng_next(rng));
    return Path(kind, 0u, rng_bits(rng), 10.0 * rng_next(rng), omega, second, value);
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
        vec4f(b.origin + ray_local(b.world) * there, dot(view_world(a.origin + ray_local(a.world) * t - b.origin), b.world)),
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
    let second = vec4u(bitcast<vec3u>(path.second), 0u);
    let value = vec4u(bitcast<vec3u>(path.value), 0u);
    let back = reservoir_unpack(words[0], words[1], second, value);
    let again = reservoir_pack(back);
    let same = back.path.kind == r.path.kind && back.path.id == r.path.id && back.path.film == r.path.film
        && back.path.t == r.path.t && all(back.path.second == path.second) && all(back.path.value == path.value)
        && back.weight == r.weight && back.aim == r.aim && back.confidence == r.confidence && back.origin == r.origin
        && back.age == min(r.age, 255u);
    return array<vec4f, 2>(
        vec4f(select(1.0, 0.0, same), length(back.path.omega - path.omega), abs(length(back.path.omega) - 1.0), 0.0),
        vec4f(length(reservoir_unpack(again[0], again[1], second, value).path.omega - back.path.omega), 0.0, 0.0, 0.0),
    );
}

// A pixel's table: ∫ of the density of distances; the share lost before a drawn distance against the number that drew it; and
// whether distances reach a random point in the medium that one of the pixel's rays meets (1: they do not).
fn probe_reuse_table(i: u32, rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let position = vec2u(i % params.width, i / params.width);
    let centre = view_ray(position, VIEW_CENTRE);
    let table = table_unpack(table_build(ray_new(centre.origin, centre.world), 1.0));
    let step = (table.far - table.near) / f32(PROBE_REUSE_STEPS);
    var sum = 0.0;
    for (var k = 0u; k < PROBE_REUSE_STEPS; k++) {
        sum += table_density(table, table.near + (f32(k) + 0.5) * step) * step;
    }
    let u = rng_next(rng);
    let lost = (1.0 - table_transmittance(table, table_sample(table, u))) / max(table.opacity, 1e-9);
    let view = view_ray(position, rng_bits(rng));
    let ray = ray_new(view.origin, view.world);
    let t = mix(ray.t, ray.exit, rng_next(rng));
    let density = select(0.0, target_density(ray_at(ray, t)), ray.exit > ray.t);
    let missed = density > 0.0 && !(table_density(table, t) > 0.0);
    let any = select(0.0, 1.0, table_any(table));
    return array<vec4f, 2>(
        vec4f(sum, select(0.0, lost - u, table.opacity > 0.01), any, table.opacity),
        vec4f(density, select(0.0, density, missed), t, 0.0),
    );
}

// A leg from a random point: whether there is medium beyond what is said to be its end.
fn probe_reuse_leg(rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let origin = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let target_point = mix(params.box_min, params.box_max, vec3f(rng_next(rng), rng_next(rng), rng_next(rng)));
    let ray = ray_new(origin, normalize(view_world(target_point - origin)));
    let leg = proxy_leg(ray, ray.exit, PROXY_ENDLESS);
    let t = ray.exit * rng_next(rng);
    let density = target_density(ray_at(ray, t));
    return array<vec4f, 2>(vec4f(density, select(0.0, density, t > leg.end), t, leg.end), vec4f(0.0));
}

// A target, and whether its path carries light.
fn probe_reuse_target(i: u32, rng: ptr<function, Rng>) -> array<vec4f, 2> {
    let position = vec2u(i % params.width, i / params.width);
    let centre = view_ray(position, VIEW_CENTRE);
    let table = table_unpack(table_build(ray_new(centre.origin, centre.world), 1.0));
    var path = probe_reuse_path(rng);
    let view = view_ray(position, path.film);
    let ray = ray_new(view.origin, view.world);
    path.t = mix(ray.t, ray.exit, rng_next(rng));
    let parts = target_parts(position, path);
    let aim = target_value(position, table, path);
    return array<vec4f, 2>(vec4f(aim, math_max3(parts.value), 0.0, 0.0), vec4f(parts.value, path.t));
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
        default: { values = probe_reuse_target(id.x, &rng); }
    }
    probe_out[2u * id.x] = values[0];
    probe_out[2u * id.x + 1u] = values[1];
}
