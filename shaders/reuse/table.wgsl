// A camera ray seen from afar, all of it: draws distances in proportion to the light lost there.
//!use core/ray
//!use reuse/leg

// Ends of stretches, and −log of the transmittance to there.
var<private> table_t: array<f32, LEG_MOST + 1u>;
var<private> table_grey: array<f32, LEG_MOST + 1u>;
var<private> table_count: u32;

// Looks along a ray.
fn table_build(ray: Ray) {
    var m = leg_begin(ray, proxy_end(ray), false);
    table_t[0] = m.t;
    table_grey[0] = 0.0;
    var k = 0u;
    for (var i = 0u; i < LEG_MOST; i++) {
        if (!leg_goes_on(m)) {
            break;
        }
        if (leg_advance(ray, &m)) {
            k += 1u;
            table_t[k] = m.t;
            table_grey[k] = m.grey;
        }
    }
    table_count = k;
}

// Whether the ray meets anything.
fn table_any() -> bool {
    return table_grey[table_count] > 0.0;
}

// Light that is lost from end to end.
fn table_opacity() -> f32 {
    return leg_opacity(table_grey[table_count]);
}

struct TableSample {
    t: f32,
    density: f32,         // per length
    transmittance: f32,   // to there
}

// The distance that u in [0, 1) draws.
fn table_sample(u: f32) -> TableSample {
    let opacity = table_opacity();
    let wanted = leg_inverse(u * opacity);
    var low = 0u;
    var high = max(table_count, 1u);
    // The stretch that holds it.
    while (high - low > 1u) {
        let middle = (low + high) / 2u;
        if (table_grey[middle] > wanted) {
            high = middle;
        } else {
            low = middle;
        }
    }
    let length = table_t[high] - table_t[low];
    let rate = (table_grey[high] - table_grey[low]) / max(length, 1e-30);
    let t = table_t[low] + clamp((wanted - table_grey[low]) / max(rate, 1e-30), 0.0, length);
    return TableSample(t, rate * exp(-wanted) / max(opacity, 1e-30), exp(-wanted));
}
