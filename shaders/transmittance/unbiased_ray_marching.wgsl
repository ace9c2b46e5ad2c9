// Slot @transmittance: unbiased ray marching (Kettunen et al. 2021): a power series of exp around one march, its terms
// elementary symmetric means of the other marches, its order drawn at random. Segment by segment; the number of looks
// follows the residual's optical depth, which must be a bound (tracking.md §2.8).
//!use transmittance/product
//!use transmittance/walk
//!use track/march

const TRANSMITTANCE_ORDERS: u32 = 8u;     // of the series; the terms beyond are below a float's last digit
const TRANSMITTANCE_MORE: f32 = 0.1;      // chance of any order above 0
const TRANSMITTANCE_MARCHES: f32 = 1.31945;  // marches on average

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
    let control = segment.control * params.sigma * length;
    *t *= exp(-spectrum_extinction() * control);
    if (bound <= 0.0) {
        return;
    }
    // Looks in all (Kettunen et al. 2021, eq. 27), shared out among the marches.
    let looks = ceil(pow((bound + 0.015) * (bound + 0.65) * (bound + 60.3), 1.0 / 3.0));
    let taps = u32(max(1.0, round(looks / TRANSMITTANCE_MARCHES)));
    // The order: at least k with probability 0.1 · ∏ min(1, 2/i), i from 3 to k.
    let u = rng_next(rng);
    var reach = TRANSMITTANCE_MORE;
    var order = select(0u, 2u, u < reach);
    for (var k = 3u; k <= TRANSMITTANCE_ORDERS && order == k - 1u; k++) {
        reach *= 2.0 / f32(k);
        order = select(order, k, u < reach);
    }
    var march: array<f32, TRANSMITTANCE_ORDERS + 1u>;
    for (var i = 0u; i <= order; i++) {
        march[i] = control - march_comb(ray, far, taps, rng_next(rng));
        (*count).lookups += taps;
        // Of the march, and of the means and series of the pivot.
        (*count).rounds += taps + (TRANSMITTANCE_ORDERS + 1u) * (order + 2u);
    }
    var sum = Spectrum(0.0);
    for (var pivot = 0u; pivot <= order; pivot++) {
        // Elementary symmetric means of the differences to the pivot, one march after the other.
        var means: array<Spectrum, TRANSMITTANCE_ORDERS + 1u>;
        means[0] = Spectrum(1.0);
        for (var i = 1u; i <= TRANSMITTANCE_ORDERS; i++) {
            means[i] = Spectrum(0.0);
        }
        var n = 0u;
        for (var j = 0u; j <= order; j++) {
            if (j != pivot) {
                n += 1u;
                let z = spectrum_extinction() * (march[j] - march[pivot]);
                for (var k = n; k >= 1u; k--) {
                    means[k] += (f32(k) / f32(n)) * (means[k - 1u] * z - means[k]);
                }
            }
        }
        var series = Spectrum(1.0);
        var weight = 1.0 / TRANSMITTANCE_MORE;
        for (var k = 1u; k <= order; k++) {
            // 1/k! over the chance to reach k.
            weight *= select(1.0 / f32(k), 0.5, k >= 3u);
            series += means[k] * weight;
        }
        sum += exp(spectrum_extinction() * march[pivot]) * series;
    }
    *t *= sum / f32(order + 1u);
}
