// Equidistant tracking: looks at the density where the majorant's optical depth passes the teeth of a comb, rather than at
// random. An estimate of the optical depth with far less noise than as many collisions give, and bounds hold its teeth.
//!use core/params
//!use core/rng
//!use core/ray
//!use track/count
//!slot medium
//!slot majorant
//!slot spectrum

const COMB_MOST: u32 = 4096u;   // stretches of a leg, a guard
const COMB_ORDERS: u32 = 8u;    // of the power series; the terms beyond are below a float's last digit
const COMB_MORE: f32 = 0.1;     // chance of any order above 0

// An unbiased estimate of the optical depth from `ray.t` to `far`: teeth `spacing` apart, the first `first` away. A stretch is
// walked to its end before the next is asked for: bounds may depend on where one asks, and must not on where the teeth are.
fn comb_depth(start: Ray, far: f32, spacing: f32, first: f32, count: ptr<function, Count>) -> f32 {
    var ray = start;
    var left = first;
    var sum = 0.0;
    var segment: Segment;
    var end = ray.t;
    for (var i = 0u; i < COMB_MOST; i++) {
        if (ray.t >= end) {
            if (end >= far) {
                break;
            }
            segment = majorant_segment(ray);
            end = max(min(segment.far, far), ray.t);
            (*count).steps += 1u;
        }
        let rate = params.sigma * segment.bound;
        let available = (end - ray.t) * rate;
        let looks = available > left;
        ray.t = select(end, min(ray.t + left / rate, end), looks);
        left = select(left - available, spacing, looks);
        if (looks) {
            let density = medium_density(ray_at(ray, ray.t));
            (*count).lookups += 1u;
            (*count).violations += select(0u, 1u, density > segment.bound);
            sum += density / segment.bound;
        }
    }
    (*count).caps += select(0u, 1u, end < far);
    return sum * spacing;
}

// One of three estimates as the pivot of the series up to order 2; the chance of that order is in it.
fn comb_pivot(at: f32, b: f32, c: f32) -> Spectrum {
    let e = spectrum_extinction();
    let first = e * (at - 0.5 * (b + c));
    let second = e * e * ((at - b) * (at - c) * 0.5);
    return exp(-e * at) * (Spectrum(1.0) + (first + second) / COMB_MORE);
}

// An unbiased estimate of the transmittance from `ray.t` to `far`: exp of one estimate, and by chance the terms of its power
// series that take its bias away (Kettunen et al. 2021). Those of order 1 and 2 take turns with three pivots, which cancels
// most of their noise.
fn comb_transmittance(ray: Ray, far: f32, spacing: f32, rng: ptr<function, Rng>, count: ptr<function, Count>) -> Spectrum {
    let u = rng_next(rng);
    let e = spectrum_extinction();
    var depth = 0.0;
    var other = 0.0;
    var sum = Spectrum(0.0);
    var term = Spectrum(0.0);
    var chance = COMB_MORE;
    for (var k = 0u; k <= COMB_ORDERS; k++) {
        // Orders 1 and 2 come together, those above with 2/k of the chance before.
        chance *= select(1.0, 2.0 / f32(k), k > 2u);
        if (k > 0u && u >= chance) {
            break;
        }
        let next = comb_depth(ray, far, spacing, spacing * (1.0 - rng_next(rng)), count);
        if (k == 0u) {
            depth = next;
            sum = exp(-e * depth);
            term = sum;
        } else {
            term *= e * ((depth - next) / f32(k));
            if (k == 1u) {
                other = next;
            } else if (k == 2u) {
                let pivots = comb_pivot(depth, other, next) + comb_pivot(other, next, depth) + comb_pivot(next, depth, other);
                sum = pivots / 3.0;
            } else {
                sum += term / chance;
            }
        }
    }
    return sum;
}
