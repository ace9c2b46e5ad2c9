// What a pixel's ray meets, from afar: twelve stretches between knots, each with a known share of the light that is lost on
// the way. It draws distances in proportion, and tells the transmittance to any distance without another look. It belongs to
// the ray through the pixel's centre: all that resampling asks of a pixel must not depend on its film samples.
//!use core/params
//!use core/ray
//!use core/math
//!slot spectrum
//!slot proxy

const TABLE_KNOTS: u32 = 11u;         // between the ends
const TABLE_COARSE: f32 = 16.0;       // looks that find where there is anything, at least
const TABLE_MOST: u32 = 64u;          // at most
const TABLE_FINE: u32 = 24u;          // looks at the part that is seen
const TABLE_SEEN: f32 = 6.0;          // optical depth up to which a part is seen
const TABLE_FLOOR: f32 = 1e-5;        // least transmittance: no path may be impossible
const TABLE_ASIDE: f32 = 0.71;        // how far other rays of a pixel are from its centre's at most, pixels
const TABLE_UNITS: f32 = 65535.0;     // of a knot's place

struct Table {
    near: f32,      // all of the medium lies between these
    far: f32,
    opacity: f32,   // light that is lost from end to end
    a: vec4f,       // knots, as shares of the way
    b: vec4f,
    c: vec3f,
}

// The share of the light lost before knot k; 0 and 12 are the ends. The last stretches are thin: what is there is deep.
fn table_share(k: u32) -> f32 {
    let late = select(select(0.96, 0.99, k == 11u), 1.0, k > 11u);
    return select(0.1 * f32(k), late, k > 9u);
}

// The optical depth's transmittance, channels averaged.
fn table_mean(depth: f32) -> f32 {
    return spectrum_mean(exp(-spectrum_extinction() * depth));
}

fn table_pair(low: u32, high: u32) -> u32 {
    return low | (high << 16u);
}

// From looks along a ray, for itself (width 0) or for a pixel round it (1): cells are then no smaller than the pixel, so that they
// hold what its other rays meet.
fn table_build(ray: Ray, width: f32) -> array<vec4u, 2> {
    let size = math_max3(abs(ray.direction));
    let footprint = 2.0 * width * max(params.inv_width * length(params.camera_right), params.inv_height * length(params.camera_up));
    // Other rays of the pixel may meet the medium before this one, behind it, or alone.
    let ends = proxy_ends(ray, TABLE_ASIDE * footprint * size);
    let begin = ends.x;
    let end = max(ends.y, begin);
    let pixel = 2.0 * TABLE_ASIDE * footprint * end * size;
    let steps = min(proxy_steps(ray, begin, end, TABLE_COARSE), f32(TABLE_MOST));
    let step = (end - begin) / steps;
    // A look tells what is within a cell's half of it: half a step along the ray, half a pixel beside it.
    let level = proxy_level(step * size + pixel);
    var first = steps;
    var last = 0.0;
    var seen = 0.0;
    var depth = 0.0;
    var rest = 0.0;
    for (var i = 0u; i < TABLE_MOST; i++) {
        if (f32(i) >= steps || step <= 0.0) {
            break;
        }
        let at = begin + f32(i) * step;
        let piece = proxy_depth(ray, at, at + step, level);
        let any = piece > 0.0;
        first = select(first, min(first, f32(i)), any);
        last = select(last, f32(i + 1u), any);
        let deep = depth > TABLE_SEEN;
        seen = select(f32(i + 1u), seen, deep);
        rest += select(0.0, piece, deep);
        depth += piece;
    }
    let near = begin + first * step;
    let far = begin + last * step;
    if (last <= first) {
        return array<vec4u, 2>(vec4u(0u), vec4u(0u));
    }
    let clear = min(begin + seen * step, far);
    let fine = (clear - near) / f32(TABLE_FINE);
    let fine_level = proxy_level(max(fine * size, pixel));
    var lost: array<f32, TABLE_FINE + 2u>;
    depth = 0.0;
    for (var i = 0u; i < TABLE_FINE; i++) {
        lost[i] = 1.0 - table_mean(depth);
        let at = near + f32(i) * fine;
        depth += proxy_depth(ray, at, at + fine, fine_level);
    }
    lost[TABLE_FINE] = 1.0 - table_mean(depth);
    lost[TABLE_FINE + 1u] = 1.0 - table_mean(depth + rest);
    let opacity = lost[TABLE_FINE + 1u];
    var knots: array<u32, TABLE_KNOTS>;
    var i = 0u;
    var k = 0u;
    var least = 1u;
    for (var round = 0u; round < TABLE_FINE + TABLE_KNOTS + 1u; round++) {
        if (k >= TABLE_KNOTS) {
            break;
        }
        let wanted = opacity * table_share(k + 1u);
        if (wanted > lost[i + 1u] && i < TABLE_FINE) {
            i += 1u;
        } else {
            let share = clamp((wanted - lost[i]) / max(lost[i + 1u] - lost[i], 1e-9), 0.0, 1.0);
            let low = near + f32(i) * fine;
            let t = mix(low, select(low + fine, far, i == TABLE_FINE), share);
            // Each stretch is a unit long at least.
            let place = u32(clamp((t - near) / (far - near), 0.0, 1.0) * TABLE_UNITS);
            knots[k] = clamp(place, least, u32(TABLE_UNITS) - (TABLE_KNOTS - k));
            least = knots[k] + 1u;
            k += 1u;
        }
    }
    let packed = u32(clamp(opacity, 0.0, 1.0) * TABLE_UNITS + 0.5);
    return array<vec4u, 2>(
        vec4u(bitcast<u32>(near), bitcast<u32>(far), table_pair(knots[0], knots[1]), table_pair(knots[2], knots[3])),
        vec4u(
            table_pair(knots[4], knots[5]), table_pair(knots[6], knots[7]), table_pair(knots[8], knots[9]),
            table_pair(knots[10], packed),
        ),
    );
}

fn table_unpack(words: array<vec4u, 2>) -> Table {
    let w = words[1];
    let tail = unpack2x16unorm(w.w);
    return Table(
        bitcast<f32>(words[0].x),
        bitcast<f32>(words[0].y),
        tail.y,
        vec4f(unpack2x16unorm(words[0].z), unpack2x16unorm(words[0].w)),
        vec4f(unpack2x16unorm(w.x), unpack2x16unorm(w.y)),
        vec3f(unpack2x16unorm(w.z), tail.x),
    );
}

// Whether the ray meets anything.
fn table_any(table: Table) -> bool {
    return table.far > table.near;
}

struct TableSpan {
    low: f32,      // the stretch's ends, as shares of the way
    high: f32,
    before: f32,   // share of the light lost before it
    mass: f32,     // and in it
}

// The stretch of a place, a share of the way.
fn table_span(table: Table, x: f32) -> TableSpan {
    let a = table.a <= vec4f(x);
    let b = table.b <= vec4f(x);
    let c = table.c <= vec3f(x);
    let k = u32(dot(select(vec4f(0.0), vec4f(1.0), a) + select(vec4f(0.0), vec4f(1.0), b), vec4f(1.0)))
        + u32(dot(select(vec3f(0.0), vec3f(1.0), c), vec3f(1.0)));
    let low = max(select(vec4f(0.0), table.a, a), select(vec4f(0.0), table.b, b));
    let high = min(select(table.a, vec4f(1.0), a), select(table.b, vec4f(1.0), b));
    let least = max(max(max(low.x, low.y), max(low.z, low.w)), math_max3(select(vec3f(0.0), table.c, c)));
    let most = min(min(min(high.x, high.y), min(high.z, high.w)), math_min3(select(table.c, vec3f(1.0), c)));
    return TableSpan(least, most, table_share(k), table_share(k + 1u) - table_share(k));
}

// Transmittance from the camera to distance t, channels averaged.
fn table_transmittance(table: Table, t: f32) -> f32 {
    let x = clamp((t - table.near) / max(table.far - table.near, 1e-30), 0.0, 1.0);
    let span = table_span(table, x);
    let lost = span.before + span.mass * (x - span.low) / (span.high - span.low);
    return max(1.0 - table.opacity * lost, TABLE_FLOOR);
}

// Density with which `table_sample` draws the distance t.
fn table_density(table: Table, t: f32) -> f32 {
    let x = (t - table.near) / (table.far - table.near);
    let span = table_span(table, clamp(x, 0.0, 1.0));
    let density = span.mass / ((span.high - span.low) * (table.far - table.near));
    return select(0.0, density, table_any(table) && x >= 0.0 && x <= 1.0);
}

// A distance for u in [0, 1), in proportion to the light lost there.
fn table_sample(table: Table, u: f32) -> f32 {
    let knots = array<f32, 13>(
        0.0, table.a.x, table.a.y, table.a.z, table.a.w, table.b.x, table.b.y, table.b.z, table.b.w,
        table.c.x, table.c.y, table.c.z, 1.0,
    );
    let late = select(select(9u, 10u, u >= table_share(10u)), 11u, u >= table_share(11u));
    let k = select(min(u32(u * 10.0), 9u), late, u >= table_share(9u));
    let share = clamp((u - table_share(k)) / (table_share(k + 1u) - table_share(k)), 0.0, 1.0);
    return mix(table.near, table.far, mix(knots[k], knots[k + 1u], share));
}
