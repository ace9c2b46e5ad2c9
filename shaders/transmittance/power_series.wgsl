// Slot @transmittance: the power series of exp around the majorant, stopped by roulette on its terms (Georgiev et al. 2019,
// cumulative). Segment by segment, cut so that the majorant's depth stays small.
//!use transmittance/product
//!use transmittance/walk
//!slot medium

const TRANSMITTANCE_PART: f32 = 4.0;     // optical depth of the majorant over one series at most
const TRANSMITTANCE_TERMS: u32 = 4096u;  // of all series of a segment, a guard that is never met

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
    let bound = segment.bound * params.sigma * length;
    let parts = u32(ceil(min(bound / TRANSMITTANCE_PART, f32(TRANSMITTANCE_TERMS))));
    let step = length / f32(max(parts, 1u));
    for (var part = 0u; part < parts; part++) {
        let start = ray.t + f32(part) * step;
        var term = Spectrum(1.0);
        var sum = Spectrum(1.0);
        for (var i = 1u; i < TRANSMITTANCE_TERMS; i++) {
            let density = medium_density(ray_at(ray, start + rng_next(rng) * step));
            (*count).lookups += 1u;
            (*count).rounds += 1u;
            term *= (Spectrum(segment.bound) - spectrum_extinction() * density) * (params.sigma * step / f32(i));
            let chance = min(1.0, spectrum_max(term));
            if (rng_next(rng) >= chance) {
                break;
            }
            term /= chance;
            sum += term;
        }
        *t *= sum * exp(-segment.bound * params.sigma * step);
    }
}
