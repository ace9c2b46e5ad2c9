// One stretch of a ray: to the next tentative collision or the end of the bounds' segment, whichever is first. Camera,
// scattered and shadow rays share it, so that lanes of either kind run the same instructions.
//!use core/params
//!use core/rng
//!use core/ray
//!use track/count
//!slot medium
//!slot majorant
//!slot spectrum
//!slot flight
//!slot transmittance

const STEP_ON: u32 = 0u;    // under way
const STEP_HIT: u32 = 1u;   // a free flight ended in a real collision at `ray.t`
const STEP_DONE: u32 = 2u;  // the ray left the support or reached its limit

fn step_survives(transmittance: ptr<function, Transmittance>, played: ptr<function, f32>, roulette: f32, u: f32) -> bool {
    let strongest = spectrum_max(transmittance_value(*transmittance)) * *played;
    let plays = strongest < roulette;
    let survives = !plays || u * roulette < strongest;
    *played = select(*played, select(0.0, *played * roulette / strongest, survives), plays);
    return survives;
}

// `depth` is the optical depth left to the next collision; it is drawn anew when used up, and outlives the ray:
// exponential flights have no memory. A shadow ray whose transmittance times `played` falls below `roulette` plays for
// its life: `played` is one over the chances that it survived so far, 0 if it did not.
fn step_on(
    ray: ptr<function, Ray>,
    depth: ptr<function, f32>,
    shadow: bool,
    flight: ptr<function, Flight>,
    transmittance: ptr<function, Transmittance>,
    played: ptr<function, f32>,
    roulette: f32,
    rng: ptr<function, Rng>,
    count: ptr<function, Count>,
) -> u32 {
    let segment = majorant_segment(*ray);
    let far = max(min(segment.far, (*ray).exit), (*ray).t);
    let rate = params.sigma * select(flight_rate(*flight, segment), transmittance_rate(segment), shadow);
    let available = (far - (*ray).t) * rate;
    let collides = available > *depth;
    let t = select(far, (*ray).t + *depth / rate, collides);
    let stretch = (t - (*ray).t) * params.sigma;
    flight_pass(flight, segment, select(stretch, 0.0, shadow), collides && !shadow);
    transmittance_pass(transmittance, segment, select(0.0, stretch, shadow));
    *depth -= available;
    (*count).steps += 1u;
    var hit = false;
    var done = false;
    if (collides) {
        *depth = rng_depth(rng);
        let u = rng_next(rng);
        var density = 0.0;
        if (shadow || flight_looks(*flight, segment, u)) {
            density = medium_density(ray_at(*ray, t));
            (*count).lookups += 1u;
            (*count).violations += select(0u, 1u, density > segment.bound);
        }
        if (shadow) {
            transmittance_event(transmittance, segment, u, density);
            // Where the event used u, it left 0 or 1 and nothing to play for.
            done = !step_survives(transmittance, played, roulette, u);
        } else {
            hit = flight_event(flight, segment, u, density);
            (*count).nulls += select(1u, 0u, hit);
        }
    }
    var stop = t;
    if (FLIGHT_WALKS && !shadow) {
        stop = flight_walk(flight, *ray, far, segment, depth, rng, count);
        hit = *depth < 0.0;
        *depth = select(*depth, rng_depth(rng), hit);
    }
    if (TRANSMITTANCE_WALKS && shadow) {
        transmittance_walk(transmittance, *ray, far, segment, rng, count);
        done = !step_survives(transmittance, played, roulette, rng_next(rng));
    }
    (*ray).t = stop;
    done |= !collides && stop >= (*ray).exit;
    return select(select(STEP_ON, STEP_DONE, done), STEP_HIT, hit);
}
