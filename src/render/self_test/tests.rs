//! Every check holds, and sees an error planted in the shaders.

use super::*;

/// Pairs of a check and an edit of the shader text that it must see: what stands there once, and what comes instead.
const PLANTS: &[(&str, &str, &str)] = &[
    ("density, 32-bit floats", "medium_density(probe_in[id.x].xyz)", "medium_density(probe_in[id.x].zyx)"),
    ("density, as stored by default", "medium_sampler, p * params", "medium_sampler, (p + 0.1) * params"),
    ("phase function, mean sampled cosine", "lobe_drop(params.g, ", "lobe_drop(0.99 * params.g, "),
    ("phase function, integral", "return (1.0 - g * g)", "return 0.999 * (1.0 - g * g)"),
    ("phase function, mean cosine", "- 2.0 * g * cos_theta", "+ 2.0 * g * cos_theta"),
    ("daylight on a white floor", "(MATH_PI * light.chord2)", "(1.05 * MATH_PI * light.chord2)"),
    ("transmittance of depth 1", "return segment.bound * flight.rate;", "return segment.bound * flight.rate * 1.01;"),
    (
        "single scattering, sun at the side",
        "*t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);",
        "",
    ),
    ("single scattering, sun behind", "- 2.0 * g * cos_theta", "+ 2.0 * g * cos_theta"),
    ("single scattering, sun in front", "return (1.0 - g * g) /", "return 1.02 * (1.0 - g * g) /"),
    (
        "single scattering, point light",
        "light.value / (square * light.share)",
        "light.value / (sqrt(square) * light.share)",
    ),
    ("white furnace, worst tile", "throughput *= params.albedo;", "throughput *= 0.999 * params.albedo;"),
    ("white furnace by light samples", "weight = phase_pdf / (phase_pdf + light_pdf(w));", "weight = 1.0;"),
    ("layer of coloured albedo", "throughput *= params.albedo;", "throughput *= params.albedo.zyx;"),
    ("coloured extinction", "spectrum_step(flight, stretch * segment.bound, collides);", ""),
    (
        "grid against global majorant",
        "let bound = bitcast<f32>(words.x & ~GRID_LEVEL_BITS);",
        "let bound = bitcast<f32>(words.x & ~GRID_LEVEL_BITS) * select(1.0, 0.5, level > 0u);",
    ),
    (
        "cloud, default settings",
        "density = medium_density(ray_at(*ray, t));",
        "density = 1.05 * medium_density(ray_at(*ray, t));",
    ),
    (
        "cloud, default settings",
        "*t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);",
        "*t *= Spectrum(1.0) - spectrum_extinction() * (0.9 * density / segment.bound);",
    ),
    ("cloud, global majorant", "return segment.bound * flight.rate;", "return segment.bound * flight.rate * 1.02;"),
    ("cloud, coloured extinction", "return p / math_mean3(p);", "return vec3f(1.0);"),
    (
        "pixels changed by slicing the work",
        "rng = rng_start(pixel, next, params.seed);\n            next",
        "rng = rng_start(pixel, next - slice.first_sample, params.seed);\n            next",
    ),
];

/// A planted error must be seen so clearly, in units of what a check allows.
const SEEN: f64 = 1.5;
/// Share of the expected value that no check may allow.
const LOOSE: f64 = 0.025;

#[test]
fn every_check_holds_and_sees_an_error() {
    let Ok(gpu) = Gpu::headless().map(Arc::new) else {
        assert!(std::env::var_os("CI").is_none(), "CI draws on a software adapter");
        eprintln!("skipped: no adapter");
        return;
    };
    let run =
        |check: &Check, source: &Source| check.run(&gpu, source).unwrap_or_else(|e| panic!("{}: {e}", check.name));
    let mut wrong = Vec::new();
    for check in CHECKS {
        let found = run(check, &Source::standard());
        eprintln!("{}: {found:?}", check.name);
        if !found.passes() {
            wrong.push(format!("{}: {found:?}", check.name));
        }
        if found.expected > 0.0 && found.within > LOOSE * found.expected {
            wrong.push(format!("{}: {found:?} is too loose", check.name));
        }
        let plants: Vec<_> = PLANTS.iter().filter(|p| p.0 == check.name).collect();
        // Estimators share their measurement: what it sees is shown with the first.
        if plants.is_empty() && matches!(check.measure, Measure::By(_)) {
            wrong.push(format!("{}: no planted error", check.name));
        }
        for (_, from, to) in plants {
            let mut source = Source::standard();
            source.plants.push(((*from).to_owned(), (*to).to_owned()));
            let found = run(check, &source);
            eprintln!("  planted {to}: {:.1} times what is allowed", found.excess());
            if found.excess() < SEEN {
                wrong.push(format!("{}: {to} is not seen: {found:?}", check.name));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn an_outcome_fails_beyond_its_tolerance_and_where_it_is_no_number() {
    let outcome = |measured, within| Outcome { measured, expected: 1.0, within };
    assert!(outcome(1.01, 0.02).passes() && !outcome(1.03, 0.02).passes());
    assert!(!outcome(f64::NAN, 0.02).passes() && !outcome(1.0, f64::NAN).passes());
    let worst = Outcome::worst([outcome(1.01, 0.02), outcome(f64::NAN, 0.02), outcome(1.05, 0.02)]);
    assert!(worst.measured.is_nan());
    assert_eq!(Outcome::worst([outcome(1.0, 0.0), outcome(1.01, 0.02)]).measured, 1.01);
    // However noisy, a few per cent off is off.
    assert!(!Outcome::by_chance((1.05, 1.0), 1.0).passes());
    let names: std::collections::HashSet<&str> = CHECKS.iter().map(|c| c.name).collect();
    assert_eq!(names.len(), CHECKS.len(), "no two checks share a name");
}
