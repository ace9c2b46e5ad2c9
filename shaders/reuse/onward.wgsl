// Flights from afar that end where something is: the stretch of a leg is drawn by what it looks like, the place in it by the
// density itself.
//!use core/rng
//!use core/ray
//!use reuse/leg
//!use reuse/target

const ONWARD_PLACES: u32 = 4u;  // of a stretch, one of which is chosen

// A collision.
struct Onward {
    met: bool,
    t: f32,
    seen: f32,     // the transmittance to there, from afar
    inverse: f32,  // of the density with which t was drawn, per length; unbiased
}

// From `ray.t` to `far`, beginning in the medium. The density of a place may be many times that of its stretch; the mean of some
// places is not, so that weights have a shorter tail (resampled importance sampling, Talbot 2005).
fn onward_flight(ray: Ray, far: f32, rng: ptr<function, Rng>) -> Onward {
    let leg = leg_flight(ray, far, true, rng_next(rng));
    let stretch = leg.march;
    let rate = leg_rate(stretch);
    let opacity = leg_opacity(stretch.grey - stretch.before_grey);
    var share = 0.0;  // of the light lost in the stretch, up to the place
    var here = 0.0;
    var sum = 0.0;
    for (var k = 0u; k < ONWARD_PLACES; k++) {
        let place = opacity * (f32(k) + rng_next(rng)) / f32(ONWARD_PLACES);
        let t = stretch.before_t + leg_inverse(place) / rate;
        let density = target_density(ray_at(ray, t));
        sum += density;
        if (rng_next(rng) * sum < density) {
            share = place;
            here = density;
        }
    }
    let seen = exp(-stretch.before_grey) * (1.0 - share);
    let inverse = sum / (f32(ONWARD_PLACES) * here * rate * seen);
    return Onward(leg.met && here > 0.0, stretch.before_t + leg_inverse(share) / rate, seen, inverse);
}
