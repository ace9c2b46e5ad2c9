//! Multiple scattering: plane albedo R and total transmittance T of a layer, by reciprocity. With radiance 1 from the
//! upper hemisphere and none from below, a ray from above shows R(μ₀), one from below T(μ₀). The figures are from
//! adding–doubling (64 points), checked by an analog simulation.

use super::support::write_map;
use super::*;
use nephele::scene::Environment;
use nephele::scene::value::FilePath;

const SAMPLES: u32 = 256;

/// g, albedo, optical thickness, μ₀, R, T.
const TABLE: [[f64; 6]; 12] = [
    [0.0, 0.9, 1.0, 1.0, 0.267410, 0.591625],
    [0.0, 0.9, 8.0, 1.0, 0.414843, 0.016020],
    [0.0, 0.99, 1.0, 0.5, 0.486518, 0.491628],
    [0.0, 0.99, 8.0, 1.0, 0.728750, 0.122068],
    [0.0, 1.0, 2.0, 0.5, 0.657198, 0.342802],
    [0.0, 1.0, 8.0, 0.5, 0.876648, 0.123352],
    [0.0, 0.5, 2.0, 0.5, 0.159242, 0.061405],
    [0.85, 0.9, 1.0, 1.0, 0.029676, 0.862148],
    [0.85, 0.9, 8.0, 0.5, 0.206664, 0.093798],
    [0.85, 0.99, 8.0, 1.0, 0.302149, 0.558941],
    [0.85, 0.99, 1.0, 0.5, 0.158334, 0.817716],
    [0.85, 1.0, 8.0, 1.0, 0.358432, 0.641568],
];

fn checks(a: &Adapter, source: &Source, rows: &[[f64; 6]]) -> Vec<Check> {
    // Many rows, so that the blend at the horizon is narrow.
    const ROWS: u32 = 256;
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("half.exr");
    let texels: Vec<[f32; 3]> = (0..4 * ROWS).map(|i| [if i / 4 < ROWS / 2 { 1.0 } else { 0.0 }; 3]).collect();
    write_map(&path, 4, ROWS, &texels);
    let file = FilePath(path.to_string_lossy().into_owned());
    let mut checks = Vec::new();
    for &[g, a_, depth, mu, reflected, transmitted] in rows {
        let mut scene = slab(depth);
        hg(&mut scene, g);
        albedo(&mut scene, a_);
        scene.lights = vec![Light::Environment(Environment { file: file.clone(), ..Environment::default() })];
        let across = (1.0 - mu * mu).sqrt();
        for (name, ray, truth) in
            [("R", DVec3::new(across, -mu, 0.0), reflected), ("T", DVec3::new(across, mu, 0.0), transmitted)]
        {
            one_ray(&mut scene, DVec3::new(0.0, 0.5, 0.0), ray);
            let picture = draw(a, source, &scene, SAMPLES);
            checks.push(picture.against(&format!("{name} of g {g}, albedo {a_}, depth {depth}, μ₀ {mu}"), truth));
        }
    }
    checks
}

#[test]
fn layers_reflect_and_transmit_what_adding_doubling_says() {
    let Some(a) = adapter() else { return };
    all_hold(&checks(&a, &standard(), &TABLE));
    let thick = [TABLE[1], TABLE[4], TABLE[8]];
    let plants = [
        (
            "roulette without its weight",
            "integrate/path",
            "throughput *= PATH_ROULETTE / strongest;",
            "throughput *= 1.0;",
        ),
        ("MIS weight dropped", "light/light", "weight = phase_pdf / (phase_pdf + light_pdf(w));", "weight = 1.0;"),
        (
            "light sample without its density",
            "light/light",
            "phase / (sample.pdf + phase), sample.pdf > 0.0",
            "phase, sample.pdf > 0.0",
        ),
        (
            "density of the wrong cosine",
            "integrate/path",
            "phase_pdf = phase_value(1.0 - drop);",
            "phase_pdf = phase_value(drop - 1.0);",
        ),
        ("scattering the other way", "phase/hg", "return lobe_drop(params.g, ", "return 2.0 - lobe_drop(params.g, "),
        (
            "a path ends at a bounce in a hundred",
            "integrate/path",
            "if (strongest < PATH_ROULETTE) {",
            "if (rng_next(&rng) < 0.01) { ends = true; } else if (strongest < PATH_ROULETTE) {",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &checks(&a, &plant(file, from, to).source, &thick));
    }
}
