//! Lights in pictures: quadrature, limits, and that lights add up.

use std::f64::consts::{PI, TAU};

use super::support::statistics::simpson;
use super::support::write_map;
use super::*;
use nephele::scene::value::FilePath;
use nephele::scene::{Environment, Point};

const SAMPLES: u32 = 256;
const G: f64 = 0.5;
const ALBEDO: f64 = 0.8;
const DENSITY: f64 = 1.5;

/// Distance from `p` in the unit cube to its surface along `w`.
fn to_face(p: DVec3, w: DVec3) -> f64 {
    (0..3)
        .map(|i| match w[i] {
            x if x > 0.0 => (1.0 - p[i]) / x,
            x if x < 0.0 => -p[i] / x,
            _ => f64::INFINITY,
        })
        .fold(f64::INFINITY, f64::min)
}

/// ∫ of single scattering along x through the middle of the unit cube, where `light` gives the radiance times solid
/// angle, direction and distance of each of its parts from a point.
fn along_x(light: impl Fn(DVec3) -> Vec<(f64, DVec3, f64)>) -> f64 {
    let at = |x: f64| {
        let p = DVec3::new(x, 0.5, 0.5);
        let arrives = |(flux, w, distance): (f64, DVec3, f64)| {
            flux * hg_value(G, w.x) * (-DENSITY * to_face(p, w).min(distance)).exp()
        };
        ALBEDO * DENSITY * (-DENSITY * x).exp() * light(p).into_iter().map(arrives).sum::<f64>()
    };
    simpson(at, 0.0, 1.0, 200)
}

fn cube(lights: Vec<Light>) -> Scene {
    let mut scene = unit_cube(DENSITY);
    hg(&mut scene, G);
    albedo(&mut scene, ALBEDO);
    scene.lights = lights;
    scene.integrator.max_bounces = Limit::AtMost(1);
    one_ray(&mut scene, DVec3::splat(0.5), DVec3::X);
    scene
}

fn disc(axis: DVec3, diameter: f64, irradiance: f64) -> Light {
    Light::Sun(Sun { direction: axis, irradiance: Colour([irradiance; 3]), angular_diameter: diameter })
}

fn point(position: DVec3, intensity: f64) -> Light {
    Light::Point(Point { position, intensity: Colour([intensity; 3]) })
}

/// Parts of a disc of constant radiance.
fn disc_parts(axis: DVec3, diameter: f64, irradiance: f64) -> Vec<(f64, DVec3, f64)> {
    const N: usize = 24;
    let half = 0.5 * diameter.to_radians();
    let radiance = irradiance / (PI * half.sin().powi(2));
    let axis = axis.normalize();
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    let cap = 1.0 - half.cos();
    let each = radiance * TAU * cap / (N * N) as f64;
    (0..N * N)
        .map(|i| {
            let h = cap * ((i / N) as f64 + 0.5) / N as f64;
            let (sin, cos) = (TAU * ((i % N) as f64 + 0.5) / N as f64).sin_cos();
            (each, axis * (1.0 - h) + (x * cos + y * sin) * (h * (2.0 - h)).sqrt(), f64::INFINITY)
        })
        .collect()
}

const AXIS: DVec3 = DVec3::new(-0.4, 0.7, 0.5);

fn checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let mut checks = Vec::new();
    let mut add = |name: &str, scene: &Scene, truth: f64| {
        checks.push(draw(a, source, scene, SAMPLES).against(name, truth));
    };
    // Point lights outside, near, and in the medium.
    for place in [DVec3::new(0.2, 3.0, 0.4), DVec3::new(-1.0, 0.5, 1.3), DVec3::new(0.6, 0.8, 0.3)] {
        let part = |p: DVec3| {
            let to = place - p;
            vec![(2.0 / to.length_squared(), to.normalize(), to.length())]
        };
        add(&format!("point at {place}"), &cube(vec![point(place, 2.0)]), along_x(part));
    }
    // Discs that phase sampling and light sampling both find.
    for diameter in [20.0, 60.0, 120.0] {
        let truth = along_x(|_| disc_parts(AXIS, diameter, 3.0));
        add(&format!("disc of {diameter}°"), &cube(vec![disc(AXIS, diameter, 3.0)]), truth);
    }
    // A small disc is a delta.
    let small = along_x(|_| vec![(3.0, AXIS.normalize(), f64::INFINITY)]);
    for diameter in [0.0, 0.05, 0.5] {
        add(&format!("disc of {diameter}°"), &cube(vec![disc(AXIS, diameter, 3.0)]), small);
    }
    // A constant sky, once scattered and seen through the medium.
    let sky = |_| [DVec3::Y, DVec3::NEG_Y].into_iter().flat_map(|up| disc_parts(up, 180.0, PI)).collect();
    add("constant light, one bounce", &cube(vec![constant(1.0)]), (-DENSITY).exp() + along_x(sky));
    // Lights add up.
    let place = DVec3::new(0.3, 2.0, 0.1);
    let many = |p: DVec3| {
        let to = place - p;
        let mut parts = disc_parts(AXIS, 60.0, 3.0);
        parts.push((1.0, DVec3::Y, f64::INFINITY));
        parts.push((4.0 / to.length_squared(), to.normalize(), to.length()));
        parts
    };
    let list = vec![disc(AXIS, 60.0, 3.0), sun(DVec3::Y, 1.0), point(place, 4.0)];
    add("three lights", &cube(list), along_x(many));
    checks
}

#[test]
fn lights_scatter_what_quadrature_says() {
    let Some(a) = adapter() else { return };
    all_hold(&checks(&a, &standard()));
    let plants = [
        ("light beyond a point light's distance", "integrate/path", "limit = sample.distance;", ""),
        (
            "intensity over distance",
            "light/light",
            "light.value / (square * light.share);",
            "light.value / (sample.distance * light.share);",
        ),
        ("share left out", "light/light", "sample.value = light.value / light.share;", "sample.value = light.value;"),
        ("MIS weight dropped", "light/light", "weight = phase_pdf / (phase_pdf + light_pdf(w));", "weight = 1.0;"),
        (
            "light sample without its density",
            "light/light",
            "phase / (sample.pdf + phase), sample.pdf > 0.0",
            "phase, sample.pdf > 0.0",
        ),
        (
            "phase of the wrong cosine",
            "integrate/path",
            "phase_value(dot(world, sample.direction))",
            "phase_value(-dot(world, sample.direction))",
        ),
        (
            "roulette of shadow rays without its weight",
            "integrate/path",
            "                        pending *= 1.0 / chance;\n",
            "",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &checks(&a, &plant(file, from, to).source));
    }
}

#[test]
fn a_map_of_one_radiance_is_a_constant_light() {
    let Some(a) = adapter() else { return };
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("even.exr");
    write_map(&path, 16, 8, &[[0.7, 0.5, 0.3]; 128]);
    let file = FilePath(path.to_string_lossy().into_owned());
    let shot = |light: Light, source: &Source, seed| {
        let mut scene = unit_cube(4.0);
        hg(&mut scene, 0.7);
        albedo(&mut scene, 0.95);
        scene.lights = vec![light];
        scene.integrator.seed = seed;
        look(&mut scene, DVec3::new(0.7, 0.9, 2.5), DVec3::splat(0.5), 40.0);
        draw(&a, source, &scene, 256)
    };
    let radiance = Colour([1.4, 1.0, 0.6]);
    let even = shot(Light::Constant(Constant { radiance }), &standard(), 1);
    let map = Light::Environment(Environment { file, scale: 2.0, rotation: 50.0 });
    all_hold(&same("map and constant", &even, &shot(map.clone(), &standard(), 2)));
    let dropped = plant("light/light", "weight = phase_pdf / (phase_pdf + light_pdf(w));", "weight = 1.0;");
    one_sees("MIS weight dropped", &same("map and constant", &even, &shot(map, &dropped.source, 2)));
}

#[test]
fn the_camera_sees_discs_and_maps_but_no_deltas() {
    let Some(a) = adapter() else { return };
    let mut scene = unit_cube(1.0);
    // Away from the cube, towards the sun.
    look(&mut scene, DVec3::new(0.5, 0.5, 9.0), DVec3::new(0.5, 0.5, 99.0), 10.0);
    scene.lights = vec![disc(DVec3::Z, 5.0, 2.0)];
    let half = 2.5f64.to_radians();
    let radiance = 2.0 / (PI * half.sin().powi(2));
    let covered = PI * half.tan().powi(2) / (4.0 * 5f64.to_radians().tan().powi(2));
    all_hold(&[draw(&a, &standard(), &scene, SAMPLES).against("a disc in the sky", radiance * covered)]);
    let wide = plant("light/light", "<= light.chord2;", "<= 1.1 * light.chord2;");
    one_sees(
        "a wider disc",
        &[draw(&a, &wide.source, &scene, SAMPLES).against("a disc in the sky", radiance * covered)],
    );
    scene.lights = vec![sun(DVec3::Z, 2.0), point(DVec3::new(0.5, 0.5, 50.0), 1e6)];
    let picture = draw(&a, &standard(), &scene, 16);
    assert_eq!(picture.mean(0), (0.0, 0.0));
}
