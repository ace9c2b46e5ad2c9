//! White furnaces: without absorption, in light of radiance 1 from everywhere, every picture is 1.

use super::support::{field_of, random_dense, write_map};
use super::*;
use nephele::scene::value::FilePath;
use nephele::scene::{Environment, Filter, MajorantKind};

const SAMPLES: u32 = 16;

fn furnace(scene: &mut Scene) {
    albedo(scene, 1.0);
    scene.lights = vec![constant(1.0)];
    scene.integrator.max_bounces = Limit::Unlimited;
}

/// Whether every sample is exactly 1.
fn is_one(picture: &Picture) -> bool {
    (0..picture.pixels()).all(|p| {
        let n = picture.sums.square[p][3];
        (0..3).all(|c| picture.sums.sum[p][c] == n && picture.sums.square[p][c] == n)
    })
}

/// Every phase function, majorant, filter and place of the camera.
fn furnaces() -> Vec<(String, Scene, Option<Field>)> {
    let mut all = Vec::new();
    let mut base = unit_cube(8.0);
    furnace(&mut base);
    look(&mut base, DVec3::new(0.7, 0.9, 2.5), DVec3::splat(0.5), 40.0);
    for phase in [Phase::Isotropic, Phase::Rayleigh, Phase::Hg, Phase::TwoLobeHg] {
        let mut scene = base.clone();
        scene.medium.phase = phase;
        all.push((format!("{phase:?}"), scene, None));
    }
    let mut inside = base.clone();
    look(&mut inside, DVec3::splat(0.5), DVec3::ONE, 90.0);
    all.push(("camera inside".into(), inside, None));
    let mut lens = base.clone();
    lens.camera.aperture_radius = 0.3;
    all.push(("lens".into(), lens, None));
    for (majorant, cell) in [
        (MajorantKind::Global, Auto::Auto),
        (MajorantKind::Grid, Auto::Auto),
        (MajorantKind::Grid, Auto::Is(1)),
        (MajorantKind::Grid, Auto::Is(5)),
    ] {
        for filter in [Filter::Trilinear, Filter::Nearest] {
            let mut scene = base.clone();
            scene.volume.analytic = Analytic::None;
            scene.volume.filter = filter;
            (scene.tracking.majorant, scene.tracking.cell) = (majorant, cell);
            scene.medium.density_scale = Auto::Is(2.0);
            let dense = random_dense([14, 11, 9], 6);
            look(&mut scene, DVec3::new(2.0, 1.0, 8.0), DVec3::new(1.7, 1.3, 1.0), 35.0);
            let field = field_of(dense, DMat4::IDENTITY, filter == Filter::Nearest);
            all.push((format!("{majorant:?} {cell:?} {filter:?}"), scene, Some(field)));
        }
    }
    all
}

#[test]
fn nothing_is_lost_in_a_white_furnace() {
    let Some(a) = adapter() else { return };
    for (name, scene, field) in furnaces() {
        let picture = draw_with(&a, &standard(), &scene, field, SAMPLES, false);
        assert!(is_one(&picture), "{name}: {:?}", picture.mean(0));
        assert!(picture.counters.real_collisions > 10_000, "{name}: the medium is met");
    }
    let (_, scene, _) = furnaces().remove(0);
    let lossy = plant("integrate/path", "throughput *= params.albedo;", "throughput *= params.albedo * 0.9999;");
    assert!(!is_one(&draw(&a, &lossy.source, &scene, SAMPLES)));
    // A bounce limit loses what is beyond it.
    let mut short = scene;
    short.integrator.max_bounces = Limit::AtMost(3);
    assert!(!is_one(&draw(&a, &standard(), &short, SAMPLES)));
}

/// The same where light is sampled too: a constant map, and two suns that are a hemisphere each.
fn sampled_checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("white.exr");
    write_map(&path, 8, 4, &[[1.0; 3]; 32]);
    let map = Light::Environment(Environment {
        file: FilePath(path.to_string_lossy().into_owned()),
        ..Environment::default()
    });
    let half = |direction: DVec3| {
        let irradiance = Colour([std::f64::consts::PI; 3]);
        Light::Sun(Sun { direction, irradiance, angular_diameter: 180.0 })
    };
    let axis = DVec3::new(0.4, 0.8, -0.3);
    let skies = [
        ("constant map", vec![map.clone()]),
        ("two hemispheres", vec![half(axis), half(-axis)]),
        ("half of each", {
            let mut dim = [half(axis), half(-axis), map];
            for light in &mut dim {
                match light {
                    Light::Sun(s) => s.irradiance.0 = s.irradiance.0.map(|e| 0.5 * e),
                    Light::Environment(e) => e.scale = 0.5,
                    _ => unreachable!("only those"),
                }
            }
            dim.to_vec()
        }),
    ];
    let mut checks = Vec::new();
    for (name, lights) in skies {
        for g in [0.0, 0.85] {
            let mut scene = unit_cube(4.0);
            furnace(&mut scene);
            scene.lights.clone_from(&lights);
            hg(&mut scene, g);
            look(&mut scene, DVec3::new(0.7, 0.9, 2.5), DVec3::splat(0.5), 40.0);
            let picture = draw(a, source, &scene, 768);
            checks.push(picture.against(&format!("{name}, g {g}"), 1.0));
            // Rays that meet nothing see it as it is.
            let (opacity, _) = picture.opacity();
            assert!((0.2..0.95).contains(&opacity), "{opacity}");
        }
    }
    checks
}

#[test]
fn sampled_skies_make_a_white_furnace_too() {
    let Some(a) = adapter() else { return };
    all_hold(&sampled_checks(&a, &standard()));
    let plants = [
        ("MIS weight dropped", "light/light", "weight = phase_pdf / (phase_pdf + light_pdf(w));", "weight = 1.0;"),
        (
            "weights of phase sampling doubled",
            "light/light",
            "weight = phase_pdf / (phase_pdf + light_pdf(w));",
            "weight = phase_pdf / (phase_pdf + 1.05 * light_pdf(w));",
        ),
        (
            "light sample without its density",
            "light/light",
            "phase / (sample.pdf + phase), sample.pdf > 0.0",
            "phase / (1.0 + phase), sample.pdf > 0.0",
        ),
        (
            "camera rays weighed too",
            "integrate/path",
            "phase_pdf = -1.0;\n            mode",
            "phase_pdf = 1.0;\n            mode",
        ),
        (
            "solid angle of a disc 5 % off",
            "light/light",
            "(MATH_PI * light.chord2);",
            "(1.05 * MATH_PI * light.chord2);",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &sampled_checks(&a, &plant(file, from, to).source));
    }
}
