//! Errors planted in the estimators: each is seen by the checks of the estimator that it spoils.

use nephele::scene::{Control, FreeFlight, Scene, Transmittance};

use super::super::support::statistics::one_sees;
use super::super::support::{Adapter, adapter, plant};
use super::{BOUNDS, Bound, GREY, RGB, SAMPLES, flight_checks, scene, transmittance_checks};

/// A planted error: what it is, the estimator and bounds that it is for, the majorant factor; file, line, and what comes
/// instead.
type Planted<T> = (&'static str, T, Bound, f64, (&'static str, &'static str, &'static str));

/// What one estimator's checks say with a line of its shader changed.
fn planted(a: &Adapter, what: &str, scene: &Scene, samples: u32, (file, from, to): (&str, &str, &str)) {
    let edited = plant(file, from, to);
    let mut checks = transmittance_checks(a, &edited.source, scene, samples);
    checks.extend(flight_checks(a, &edited.source, scene, samples));
    one_sees(what, &checks);
}

#[test]
fn wrong_transmittances_are_seen() {
    let Some(a) = adapter() else { return };
    let grid = BOUNDS[1];
    let case = |t: Transmittance, bound: Bound, colour: [f64; 3], factor: f64| {
        let mut scene = scene(FreeFlight::Regular, t, bound, colour);
        scene.tracking.majorant_factor = factor;
        scene
    };
    use Transmittance as T;
    let at = "density = medium_density(ray_at(*ray, t));";
    let middle = "density = medium_density(ray_at(*ray, 0.5 * ((*ray).t + far)));";
    let mean = (grid.0, grid.1, Control::Mean);
    let plants: [Planted<T>; 26] = [
        ("depth not used up at a cell's edge", T::Ratio, grid, 1.0, ("track/step", "*depth -= available;", "")),
        ("density at the middle of the cell", T::Ratio, grid, 1.0, ("track/step", at, middle)),
        (
            "negative factors clamped",
            T::Ratio,
            grid,
            0.7,
            (
                "transmittance/ratio",
                "*t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);",
                "*t *= max(Spectrum(1.0) - spectrum_extinction() * (density / segment.bound), Spectrum(0.0));",
            ),
        ),
        (
            "majorant 2 % off",
            T::Ratio,
            grid,
            1.0,
            ("transmittance/ratio", "return segment.bound;", "return 1.02 * segment.bound;"),
        ),
        (
            "majorant does not bound",
            T::Delta,
            grid,
            1.0,
            ("majorant/segment", "Segment(bound *", "Segment(0.8 * bound *"),
        ),
        ("acceptance 2 % off", T::Delta, grid, 1.0, ("transmittance/delta", "Spectrum(u * ", "Spectrum(1.02 * u * ")),
        (
            "control's transmittance left out",
            T::ResidualRatio,
            grid,
            1.0,
            ("transmittance/residual_ratio", "t.product * exp(-spectrum_extinction() * t.control)", "t.product"),
        ),
        (
            "control not subtracted",
            T::ResidualRatio,
            grid,
            1.0,
            (
                "transmittance/residual_ratio",
                "(density - segment.control) / segment.residual",
                "density / segment.residual",
            ),
        ),
        (
            "a mean control taken for a minimum's",
            T::ResidualRatio,
            mean,
            1.0,
            ("transmittance/residual_ratio", "stretch * segment.control;", "0.98 * stretch * segment.control;"),
        ),
        (
            "colour left out of the residual",
            T::ResidualRatio,
            grid,
            1.0,
            ("transmittance/residual_ratio", "Spectrum(1.0) - spectrum_extinction() * ((", "Spectrum(1.0) - (("),
        ),
        (
            "majorant's transmittance of the whole ray",
            T::NextFlight,
            grid,
            1.0,
            ("transmittance/next_flight", "(*t).sum += (*t).product;", ""),
        ),
        (
            "no decay",
            T::NextFlight,
            grid,
            1.0,
            ("transmittance/next_flight", "(*t).sum *= exp(-stretch * segment.bound);", ""),
        ),
        (
            "1/k! left out",
            T::UnbiasedRayMarching,
            BOUNDS[0],
            1.0,
            ("transmittance/unbiased_ray_marching", "weight *= select(1.0 / f32(k), 0.5, k >= 3u);", "weight *= 1.0;"),
        ),
        (
            "chance of the order left out",
            T::UnbiasedRayMarching,
            BOUNDS[0],
            1.0,
            ("transmittance/unbiased_ray_marching", "var weight = 1.0 / TRANSMITTANCE_MORE;", "var weight = 1.0;"),
        ),
        (
            "control left out of the marches",
            T::UnbiasedRayMarching,
            grid,
            1.0,
            ("transmittance/unbiased_ray_marching", "march[i] = control - march_comb", "march[i] = -march_comb"),
        ),
        (
            "chance of the doubling left out",
            T::Telescoping,
            BOUNDS[0],
            1.0,
            ("transmittance/telescoping", "(all - 0.5 * each) / chance", "(all - 0.5 * each)"),
        ),
        (
            "half of the looks counted twice",
            T::Telescoping,
            BOUNDS[0],
            1.0,
            (
                "transmittance/telescoping",
                "select(vec2f(0.0, depth), vec2f(depth, 0.0), (i & 1u) == 0u)",
                "select(vec2f(0.0), vec2f(depth, depth), (i & 1u) == 0u)",
            ),
        ),
        (
            "roulette of the series without its weight",
            T::PowerSeries,
            grid,
            1.0,
            ("transmittance/power_series", "            term /= chance;\n", ""),
        ),
        (
            "terms divided by the next number",
            T::PowerSeries,
            grid,
            1.0,
            ("transmittance/power_series", "* (params.sigma * step / f32(i))", "* (params.sigma * step / f32(i + 1u))"),
        ),
        (
            "Gauss' points off",
            T::Regular,
            grid,
            1.0,
            ("medium/dual", "DUAL_GAUSS: f32 = 0.21132487", "DUAL_GAUSS: f32 = 0.12"),
        ),
        ("cells between voxels", T::Regular, grid, 1.0, ("medium/dual", "select(0.5, 0.0, MEDIUM_NEAREST)", "0.0")),
        (
            "leaves a cell aside",
            T::Delta,
            BOUNDS[3],
            1.0,
            ("majorant/tree", "vec3f(c - before)", "vec3f(c - before + 1)"),
        ),
        (
            "rate of the majorant for the residual",
            T::ResidualRatio,
            grid,
            1.0,
            ("transmittance/residual_ratio", "return segment.residual;", "return segment.bound;"),
        ),
        (
            "marches that share their shift",
            T::UnbiasedRayMarching,
            BOUNDS[0],
            1.0,
            (
                "transmittance/unbiased_ray_marching",
                "march_comb(ray, far, taps, rng_next(rng))",
                "march_comb(ray, far, taps, 0.3)",
            ),
        ),
        (
            "the coarse march left out of the difference",
            T::Telescoping,
            BOUNDS[0],
            1.0,
            ("transmittance/telescoping", "coarse += (all", "coarse = (all"),
        ),
        (
            "density at a cell's near end",
            T::Regular,
            grid,
            1.0,
            ("medium/dual", "return 0.5 * (b - a) * (near + far);", "return (b - a) * medium_density(ray_at(ray, a));"),
        ),
    ];
    for (what, estimator, bound, factor, edit) in plants {
        planted(&a, what, &case(estimator, bound, RGB, factor), 2 * SAMPLES, edit);
    }
}

#[test]
fn wrong_flights_are_seen() {
    let Some(a) = adapter() else { return };
    use FreeFlight as F;
    let grid = BOUNDS[1];
    let mean = (grid.0, grid.1, Control::Mean);
    let signed = "*flight *= scale * select(second / (1.0 - chance), first / chance, is_first);";
    let plants: [Planted<F>; 18] = [
        (
            "majorant does not bound",
            F::Delta,
            grid,
            1.0,
            ("majorant/segment", "Segment(bound *", "Segment(0.8 * bound *"),
        ),
        (
            "acceptance the other way",
            F::Delta,
            grid,
            1.0,
            ("flight/delta", "segment.bound < density", "segment.bound > density"),
        ),
        (
            "density at the start",
            F::Delta,
            grid,
            1.0,
            (
                "track/step",
                "density = medium_density(ray_at(*ray, t));",
                "density = medium_density(ray_at(*ray, (*ray).t));",
            ),
        ),
        (
            "weight of real collisions left out",
            F::WeightedDelta,
            grid,
            0.7,
            ("flight/signed", signed, "*flight *= scale * select(second / (1.0 - chance), Spectrum(1.0), is_first);"),
        ),
        (
            "sign of null collisions dropped",
            F::WeightedDelta,
            grid,
            0.7,
            (
                "flight/signed",
                signed,
                "*flight *= scale * select(abs(second) / (1.0 - chance), first / chance, is_first);",
            ),
        ),
        (
            "chances left out",
            F::WeightedDelta,
            grid,
            0.7,
            ("flight/signed", signed, "*flight *= scale * select(second, first, is_first);"),
        ),
        (
            "weights clamped",
            F::WeightedDelta,
            grid,
            0.7,
            (
                "flight/signed",
                signed,
                "*flight *= scale * min(Spectrum(1.5), select(second / (1.0 - chance), first / chance, is_first));",
            ),
        ),
        (
            "control above the density",
            F::Decomposition,
            grid,
            1.0,
            ("flight/decomposition", "max(density, segment.control)", "max(density, 1.3 * segment.control)"),
        ),
        (
            "acceptance by the whole density",
            F::Decomposition,
            grid,
            1.0,
            ("flight/decomposition", "max(density, segment.control)", "segment.control + density"),
        ),
        (
            "control's weight left out",
            F::WeightedDecomposition,
            mean,
            1.0,
            (
                "flight/weighted_decomposition",
                "*flight *= spectrum_extinction() * (segment.control / (segment.bound * chance));",
                "",
            ),
        ),
        (
            "sign of the residual dropped",
            F::WeightedDecomposition,
            mean,
            1.0,
            (
                "flight/weighted_decomposition",
                "(density - segment.control) / segment.bound",
                "abs(density - segment.control) / segment.bound",
            ),
        ),
        (
            "chance of the residual left out",
            F::WeightedDecomposition,
            mean,
            1.0,
            ("flight/weighted_decomposition", "1.0 / (1.0 - chance));", "1.0);"),
        ),
        (
            "null share of the greatest channel for all",
            F::SpectralHistory,
            grid,
            1.0,
            ("flight/weighted", "real, Spectrum(1.0) - real,", "real, Spectrum(1.0 - spectrum_max(real)),"),
        ),
        (
            "no weights of the channels",
            F::Regular,
            grid,
            1.0,
            ("spectrum/colour", "return p / math_mean3(p);", "return vec3f(1.0);"),
        ),
        (
            "depth passed not counted",
            F::Regular,
            grid,
            1.0,
            (
                "flight/regular",
                "spectrum_step(flight, passed * params.sigma, hit);",
                "spectrum_step(flight, 0.0, hit);",
            ),
        ),
        (
            "the place linear in depth",
            F::Regular,
            grid,
            1.0,
            (
                "medium/dual",
                "return mix(a, b, 0.5 * (low + high));",
                "return mix(a, b, 0.1 + 0.9 * depth / dual_depth(ray, a, b));",
            ),
        ),
        (
            "collisions beyond the cell's edge",
            F::Delta,
            grid,
            1.0,
            (
                "track/step",
                "let collides = available > *depth;",
                "let collides = available > *depth || (segment.bound > 0.0 && far < (*ray).exit);",
            ),
        ),
        (
            "rate of the majorant less the control",
            F::Decomposition,
            grid,
            1.0,
            (
                "flight/decomposition",
                "return segment.bound * flight.rate;",
                "return (segment.bound - 0.5 * segment.control) * flight.rate;",
            ),
        ),
    ];
    for (what, flight, bound, factor, edit) in plants {
        let mut scene = scene(flight, Transmittance::Regular, bound, RGB);
        scene.tracking.majorant_factor = factor;
        planted(&a, what, &scene, 2 * SAMPLES, edit);
    }
    // With coloured extinction this would be another choice of the events, and right.
    let mut scene = scene(F::WeightedDelta, Transmittance::Regular, grid, GREY);
    scene.tracking.majorant_factor = 0.7;
    let edit = (
        "flight/spectral_history",
        "spectrum_mean(abs(weight * event))",
        "spectrum_mean(max(weight * event, Spectrum(0.0)))",
    );
    planted(&a, "null collisions below 0 never drawn", &scene, 2 * SAMPLES, edit);
}
