// Slot @transmittance: telescoping (Misso et al. 2022): a march of few looks, and with a chance that falls by doublings the
// difference that more looks would make. Segment by segment. Its mean is that of the finest march that can be drawn.
//!use transmittance/product
//!use transmittance/walk
//!use track/march

const TRANSMITTANCE_STOP: f32 = 0.65;    // chance to stop at each doubling: between 1/2, for a finite cost, and 3/4, for a
                                         // finite variance where the density jumps (tracking.md §2.9)
const TRANSMITTANCE_DOUBLINGS: u32 = 6u;
const TRANSMITTANCE_LOOKS: f32 = 128.0;  // of the coarsest march at most

// The segment from `ray.t` to `far`.
fn transmittance_walk(
    t: ptr<function, Transmittance>,
    ray: Ray,
    far: f32,
    segment: Segment,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) {
    let length = far - ray.t;
    let bound = segment.residual * params.sigma * length;
    *t *= exp(-spectrum_extinction() * (segment.control * params.sigma * length));
    if (bound <= 0.0) {
        return;
    }
    let looks = u32(clamp(round(bound), 1.0, TRANSMITTANCE_LOOKS));
    (*count).caps += select(0u, 1u, bound > TRANSMITTANCE_LOOKS);
    var doublings = 0u;
    var chance = TRANSMITTANCE_STOP;
    var rest = rng_next(rng);
    while (doublings < TRANSMITTANCE_DOUBLINGS && rest >= chance) {
        rest -= chance;
        doublings += 1u;
        chance *= 1.0 - TRANSMITTANCE_STOP;
        chance = select(chance, chance / TRANSMITTANCE_STOP, doublings == TRANSMITTANCE_DOUBLINGS);
    }
    let combs = 1u << doublings;
    let shift = rng_next(rng);
    let step = length / f32(looks * combs);
    var coarse = Spectrum(0.0);  // mean over the combs of the transmittance by one of them
    var halves = vec2f(0.0);     // optical depths by every second comb
    for (var i = 0u; i < combs; i++) {
        var depth = 0.0;
        for (var k = 0u; k < looks; k++) {
            let place = (f32(i + combs * k) + shift) * step;
            depth += medium_density(ray_at(ray, ray.t + place)) - segment.control;
        }
        depth *= params.sigma * length / f32(looks);
        coarse += exp(-spectrum_extinction() * depth) / f32(combs);
        halves += select(vec2f(0.0, depth), vec2f(depth, 0.0), (i & 1u) == 0u);
    }
    (*count).lookups += looks * combs;
    (*count).rounds += (looks + 1u) * combs + doublings;
    if (doublings > 0u) {
        let share = 2.0 / f32(combs);
        let each = exp(-spectrum_extinction() * (share * halves.x)) + exp(-spectrum_extinction() * (share * halves.y));
        let all = exp(-spectrum_extinction() * (0.5 * share * (halves.x + halves.y)));
        coarse += (all - 0.5 * each) / chance;
    }
    *t *= coarse;
}
