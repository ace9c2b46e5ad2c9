// Transmittance of legs from afar. Looks are close together, and at fine cells, where light is lost, and far apart where there
// is nothing or what is there is deep: about thirty look along a whole ray. The places of looks depend on nothing but the ray, so
// that a leg's transmittance to any distance is the same number whoever asks.
//!use core/params
//!use core/ray
//!slot spectrum
//!slot proxy

const LEG_LOSS: f32 = 0.1;      // the share of the light still there that one look may take, else cells are asked that are finer
const LEG_DIM: f32 = 0.02;      // so much of the light, at least
const LEG_THIN: f32 = 0.25;     // the part of it below which the next look may be coarser
const LEG_COARSE: f32 = 16.0;   // looks of the coarsest level along a ray, at least
const LEG_BUDGET: u32 = 64u;    // looks after which none is made finer
const LEG_MOST: u32 = 128u;     // looks at most; the last one stands for the rest
const LEG_DEEP: f32 = 8.0;      // optical depth of the weakest channel beyond which it grows by its logarithm: no path
                                // may be impossible
const LEG_GLIMPSE: f32 = 2.0;   // the finest level of a glimpse
const LEG_SMALL: f32 = 1e-3;    // of an optical depth, below which a series is more precise

// How far a ray has been looked along.
struct LegMarch {
    t: f32,
    grey: f32,         // −log of the transmittance to there
    seen: f32,         // and that itself
    before_t: f32,     // the same where the last stretch begins
    before_grey: f32,
    depth: f32,        // optical depth of the strongest channel
    far: f32,          // where it ends
    finest: f32,       // length of a look at the finest level
    top: f32,          // the coarsest that is asked
    level: f32,
    looks: u32,
}

// −log of the transmittance, channels averaged, of an optical depth of the strongest; never infinite.
fn leg_grey(depth: f32) -> f32 {
    let deep = LEG_DEEP / params.proxy_weakest;
    return spectrum_depth(select(deep + log(1.0 + max(depth - deep, 0.0)), depth, depth < deep));
}

// 1 − exp(−x), precise for small x too.
fn leg_opacity(x: f32) -> f32 {
    return select(1.0 - exp(-x), x * (1.0 - 0.5 * x), x < LEG_SMALL);
}

// −log(1 − y), the inverse.
fn leg_inverse(y: f32) -> f32 {
    return select(-log(1.0 - y), y * (1.0 + 0.5 * y), y < LEG_SMALL);
}

// From `ray.t` to `far`; `fine`: whether what is near counts most, as where a ray begins in the medium.
fn leg_begin(ray: Ray, far: f32, fine: bool) -> LegMarch {
    let finest = max(proxy_finest(ray, far), 1e-30);
    let wanted = floor(log2(max((far - ray.t) / (LEG_COARSE * finest), 1.0)));
    let top = min(wanted, proxy_coarsest());
    return LegMarch(ray.t, 0.0, 1.0, ray.t, 0.0, 0.0, far, finest, top, select(top, 0.0, fine), 0u);
}

// Whether there is more to look at.
fn leg_goes_on(m: LegMarch) -> bool {
    return m.t < m.far && m.looks < LEG_MOST;
}

// A look. False: too much was lost, and the next looks closer.
fn leg_advance(ray: Ray, march: ptr<function, LegMarch>) -> bool {
    let m = *march;
    let t = select(min(m.t + m.finest * exp2(m.level), m.far), m.far, m.looks + 1u == LEG_MOST);
    let piece = proxy_depth(ray, m.t, t, m.level);
    let depth = m.depth + piece;
    let grey = leg_grey(depth);
    let seen = exp(-grey);
    let loss = (m.seen - seen) / max(m.seen, LEG_DIM);
    (*march).looks = m.looks + 1u;
    if (loss > LEG_LOSS && m.level > 0.0 && m.looks < LEG_BUDGET) {
        (*march).level = max(m.level - ceil(log2(loss / LEG_LOSS)), 0.0);
        return false;
    }
    (*march).before_t = m.t;
    (*march).before_grey = m.grey;
    (*march).t = t;
    (*march).grey = grey;
    (*march).seen = seen;
    (*march).depth = depth;
    (*march).level = min(m.level + select(0.0, 1.0, loss < LEG_THIN * LEG_LOSS), m.top);
    return true;
}

// Towards `far`, up to the stretch that holds t.
fn leg_until(ray: Ray, far: f32, fine: bool, t: f32) -> LegMarch {
    var m = leg_begin(ray, far, fine);
    for (var i = 0u; i < LEG_MOST; i++) {
        if (!leg_goes_on(m) || m.t >= t) {
            break;
        }
        leg_advance(ray, &m);
    }
    return m;
}

// All of a leg that begins in the medium.
fn leg_march(ray: Ray, far: f32) -> LegMarch {
    return leg_until(ray, far, true, far);
}

// A rough idea of −log of the transmittance from `ray.t` to `far`, at a handful of looks, each at cells of twice the side.
fn leg_glimpse(ray: Ray, far: f32) -> f32 {
    let finest = proxy_finest(ray, far);
    let last = min(ceil(log2(max((far - ray.t) / finest, 1.0))), proxy_coarsest());
    var t = ray.t;
    var depth = 0.0;
    for (var level = LEG_GLIMPSE; level <= last; level += 1.0) {
        let next = min(t + finest * exp2(level), far);
        depth += proxy_depth(ray, t, next, level);
        t = next;
    }
    return leg_grey(depth + proxy_depth(ray, t, max(far, t), last));
}

// −log of the transmittance to t, in the last stretch of a march.
fn leg_within(m: LegMarch, t: f32) -> f32 {
    let share = clamp((t - m.before_t) / max(m.t - m.before_t, 1e-30), 0.0, 1.0);
    return mix(m.before_grey, m.grey, share);
}

// The slope of −log of the transmittance in the last stretch of a march, per length.
fn leg_rate(m: LegMarch) -> f32 {
    return (m.grey - m.before_grey) / max(m.t - m.before_t, 1e-30);
}

// A collision on a leg.
struct LegFlight {
    met: bool,
    t: f32,
    march: LegMarch,  // whose last stretch holds it
}

// The collision that u in [0, 1) draws from there to `far`, if any: the transmittance to it is 1 − u.
fn leg_flight(ray: Ray, far: f32, fine: bool, u: f32) -> LegFlight {
    let wanted = leg_inverse(u);
    var m = leg_begin(ray, far, fine);
    for (var i = 0u; i < LEG_MOST; i++) {
        if (!leg_goes_on(m) || m.grey > wanted) {
            break;
        }
        leg_advance(ray, &m);
    }
    let t = m.before_t + (wanted - m.before_grey) / max(leg_rate(m), 1e-30);
    return LegFlight(m.grey > wanted, clamp(t, m.before_t, m.t), m);
}
