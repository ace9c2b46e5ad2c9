//! Lights: samples follow their density, the density integrates to one, values are the scene's, the map is its CPU twin.

use std::f64::consts::{PI, TAU};
use std::path::Path;

use glam::{DMat3, DVec3};
use nephele::light::environment::{AliasTable, Map};
use nephele::scene::value::{Colour, FilePath};
use nephele::scene::{Analytic, Environment, Light, Point, Scene, Sun};

use super::probe::{self, Probe};
use super::support::statistics::{chi_square, z_of};
use super::support::{Adapter, Dice, adapter, plant, write_map};
use super::*;

const SAMPLES: usize = 1 << 17;
const WIDTH: u32 = 16;
const HEIGHT: u32 = 8;
const ROTATION: f64 = 37.0;
const SCALE: f64 = 2.5;

/// An asymmetric map: a bright spot, a gradient, colours.
fn map() -> Map {
    let texel = |i: u32| {
        let (x, y) = ((i % WIDTH) as f32, (i / WIDTH) as f32);
        let spot = if (i % WIDTH, i / WIDTH) == (11, 2) { 20.0 } else { 0.0 };
        [0.2 + 0.1 * x + spot, 0.3 + 0.2 * y + spot, 1.5 - 0.05 * x - 0.1 * y + 0.5 * spot]
    };
    Map { width: WIDTH, height: HEIGHT, texels: (0..WIDTH * HEIGHT).map(texel).collect() }
}

fn sun(direction: DVec3, angular_diameter: f64, irradiance: [f64; 3]) -> Light {
    Light::Sun(Sun { direction, irradiance: Colour(irradiance), angular_diameter })
}

fn environment(folder: &Path) -> Light {
    let path = folder.join("map.exr");
    write_map(&path, WIDTH, HEIGHT, &map().texels);
    let file = FilePath(path.to_string_lossy().into_owned());
    Light::Environment(Environment { file, scale: SCALE, rotation: ROTATION })
}

/// Into the map's frame: a map turned counter-clockwise seen from +Y shows at −X what it had at −Z after 90°.
fn map_frame(w: DVec3) -> DVec3 {
    DMat3::from_rotation_y(-ROTATION.to_radians()) * w
}

struct Sample {
    direction: DVec3,
    pdf: f64,
    value: DVec3,
    distance: f64,
}

struct Seen {
    radiance: DVec3,
    pdf: f64,
}

/// A scene's lights with the point that samples are taken from (scene space).
struct Setup {
    scene: Scene,
    place: DVec3,
    _folder: tempfile::TempDir,
}

impl Setup {
    fn new(lights: impl FnOnce(&Path) -> Vec<Light>) -> Setup {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let mut scene = Scene::default();
        scene.volume.analytic = Analytic::Homogeneous;
        // Stretched and turned, so that local space is not the world.
        let to_world = glam::DMat4::from_rotation_z(0.4) * glam::DMat4::from_scale(DVec3::new(1.0, 2.0, 0.5));
        scene.volume.to_world.0 = to_world.transpose().to_cols_array();
        scene.lights = lights(folder.path());
        Setup { scene, place: DVec3::new(0.2, -0.3, 0.1), _folder: folder }
    }

    fn run(&self, a: &Adapter, source: &Source, directions: &[DVec3]) -> (Probe, Vec<Sample>, Vec<Seen>) {
        let probe = Probe::new(&a.gpu, &self.scene);
        let local = probe.medium.field.local_from_world().transform_point3(self.place).as_vec3();
        let four = |v: glam::Vec3| [v.x, v.y, v.z, 0.0];
        let inputs: Vec<[f32; 4]> = directions.iter().flat_map(|d| [four(d.as_vec3()), four(local)]).collect();
        let out = probe.run(source, "light", &inputs, 3 * directions.len(), 3, probe::sample(2));
        let three = |v: [f32; 4]| DVec3::new(v[0].into(), v[1].into(), v[2].into());
        let samples = out
            .chunks(3)
            .map(|v| Sample {
                direction: three(v[0]),
                pdf: v[0][3].into(),
                value: three(v[1]),
                distance: f64::from(v[1][3]) * probe.medium.unit,
            })
            .collect();
        let seen = out.chunks(3).map(|v| Seen { radiance: three(v[2]), pdf: v[2][3].into() }).collect();
        (probe, samples, seen)
    }
}

/// Directions spread evenly over the sphere.
fn sphere() -> Vec<DVec3> {
    const GOLDEN: f64 = 2.399_963_229_728_653;
    (0..SAMPLES)
        .map(|i| {
            let y = 1.0 - 2.0 * (i as f64 + 0.5) / SAMPLES as f64;
            let (sin, cos) = (GOLDEN * i as f64).sin_cos();
            DVec3::new((1.0 - y * y).sqrt() * cos, y, (1.0 - y * y).sqrt() * sin)
        })
        .collect()
}

/// Coordinates about an axis: 1 − cosine, and an azimuth in [0, 1).
fn about(axis: DVec3, w: DVec3) -> (f64, f64) {
    let x = axis.any_orthonormal_vector();
    let y = axis.cross(x);
    let azimuth = w.dot(y).atan2(w.dot(x)) / TAU;
    (0.5 * (w - axis).length_squared(), azimuth.rem_euclid(1.0))
}

const AXIS: DVec3 = DVec3::new(0.3, 0.7, -0.4);
const IRRADIANCE: [f64; 3] = [3.0, 2.0, 1.0];

/// 1 − cosine of a disc's edge.
fn edge(diameter: f64) -> f64 {
    1.0 - (0.5 * diameter.to_radians()).cos()
}

/// Radiance of a disc: E / (π sin²(α/2)).
fn disc_radiance(diameter: f64) -> DVec3 {
    DVec3::from(IRRADIANCE) / (PI * (0.5 * diameter.to_radians()).sin().powi(2))
}

fn disc_checks(a: &Adapter, source: &Source, diameter: f64) -> Vec<Check> {
    let setup = Setup::new(|_| vec![sun(AXIS, diameter, IRRADIANCE)]);
    let axis = AXIS.normalize();
    // A cap of twice the disc's solid angle, evenly covered.
    let (edge, cap) = (edge(diameter), 2.0 * edge(diameter));
    let mut dice = Dice::new(5);
    let x = axis.any_orthonormal_vector();
    let directions: Vec<DVec3> = (0..SAMPLES)
        .map(|i| {
            let h = cap * (i as f64 + 0.5) / SAMPLES as f64;
            let (sin, cos) = (TAU * dice.next()).sin_cos();
            axis * (1.0 - h) + (x * cos + axis.cross(x) * sin) * (h * (2.0 - h)).sqrt()
        })
        .collect();
    let (_, samples, seen) = setup.run(a, source, &directions);
    let mut counts = vec![0.0; 16 * 16 + 1];
    for s in &samples {
        let (h, azimuth) = about(axis, s.direction);
        // Directions in 32 bits miss the edge by a little.
        let ring = (h / edge / (1.0 + 1e-4) * 16.0) as usize;
        counts[if ring < 16 { ring + 16 * ((azimuth * 16.0) as usize).min(15) } else { 256 }] += 1.0;
    }
    let mut expected = vec![SAMPLES as f64 / 256.0; 257];
    expected[256] = 0.0;
    let solid = TAU * edge;
    // Directions at the very edge may round to the outside, where the density is 0.
    let lost = samples.iter().filter(|s| s.pdf == 0.0).count();
    let flux = |c: usize| samples.iter().filter(|s| s.pdf > 0.0).map(move |s| s.value[c] / s.pdf);
    let wrong = |seen: &[Seen]| {
        let radiance = disc_radiance(diameter);
        let off = |i: usize| {
            let inside = about(axis, directions[i]).0 < edge;
            let expected = if inside { radiance } else { DVec3::ZERO };
            (seen[i].radiance - expected).abs().max_element() > 1e-4 * radiance.x
        };
        (0..SAMPLES).filter(|&i| off(i)).count()
    };
    let integral = seen.iter().map(|s| s.pdf).sum::<f64>() * TAU * cap / SAMPLES as f64;
    // Values are exact here, so any spread or offset counts: as if the standard error were 10⁻⁴ of the value.
    let exact = |found: f64, truth: f64| (found / truth - 1.0) / 1e-4;
    let mean_flux = |c: usize| flux(c).sum::<f64>() / (SAMPLES - lost) as f64;
    vec![
        (format!("samples outside disc {diameter}"), lost as f64 / SAMPLES as f64 / 2e-5),
        (format!("χ² of disc {diameter}"), chi_square(&counts, &expected, 1)),
        (format!("radiance · solid angle of disc {diameter}"), exact(mean_flux(0), disc_radiance(diameter).x * solid)),
        (format!("∫ pdf of disc {diameter}"), (integral - 1.0) / 1e-3),
        (format!("radiance of disc {diameter}"), if wrong(&seen) > SAMPLES / 5000 { 100.0 } else { 0.0 }),
    ]
}

#[test]
fn discs_are_sampled_evenly() {
    let Some(a) = adapter() else { return };
    for diameter in [0.1, 0.5, 5.0, 60.0, 170.0] {
        all_hold(&disc_checks(&a, &standard(), diameter));
    }
    let plants = [
        (0.5, "light/light", "0.5 * light.chord2 *", "0.49 * light.chord2 *"),
        (60.0, "light/light", "0.5 * light.chord2 * rng_next(rng)", "0.5 * light.chord2 * pow(rng_next(rng), 1.1)"),
        (60.0, "light/light", "(MATH_PI * light.chord2)", "(1.01 * MATH_PI * light.chord2)"),
        (60.0, "light/light", "dot(chord, chord) <= light.chord2", "dot(chord, chord) <= 0.99 * light.chord2"),
        (0.5, "core/math", "sqrt(max(0.0, h * (2.0 - h)))", "sqrt(max(0.0, h * (1.9 - h)))"),
        (60.0, "core/math", "vec3f(b, s + w.y * w.y * a, -w.y)", "vec3f(b, s + w.y * w.y * a, w.y)"),
    ];
    for (diameter, file, from, to) in plants {
        one_sees(&format!("disc {diameter}: {to}"), &disc_checks(&a, &plant(file, from, to).source, diameter));
    }
}

/// ∫ of the map's radiance over the sphere by Simpson's rule in each cell between texel centres.
fn map_integral() -> DVec3 {
    let (map, n) = (map(), 64 * WIDTH as usize);
    let rows = 64 * HEIGHT as usize;
    let mut sum = DVec3::ZERO;
    for j in 0..rows {
        let theta = PI * (j as f64 + 0.5) / rows as f64;
        for i in 0..n {
            let phi = TAU * ((i as f64 + 0.5) / n as f64 - 0.5);
            let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
            let rgb = map.radiance(w).map(f64::from);
            sum += DVec3::from(rgb) * theta.sin();
        }
    }
    sum * (PI / rows as f64) * (TAU / n as f64) * SCALE
}

fn map_checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let setup = Setup::new(|folder| vec![environment(folder)]);
    let directions = sphere();
    let (_, samples, seen) = setup.run(a, source, &directions);
    let (map, table) = (map(), AliasTable::new(&map()).expect("a map with light"));
    let place = |w: DVec3| {
        let d = map_frame(w);
        let u = 0.5 + d.x.atan2(-d.z) / TAU;
        let v = d.y.clamp(-1.0, 1.0).acos() / PI;
        (u * f64::from(WIDTH), v * f64::from(HEIGHT), d.y)
    };
    let texels = (WIDTH * HEIGHT) as usize;
    let mut counts = vec![0.0; texels];
    let mut inside = vec![0.0; 64];
    let bright = (11u32, 2u32);
    let edge = |row: u32| (PI * f64::from(row) / f64::from(HEIGHT)).cos();
    for s in &samples {
        let (x, y, height) = place(s.direction);
        let (column, row) = ((x as u32).min(WIDTH - 1), (y as u32).min(HEIGHT - 1));
        counts[(column + WIDTH * row) as usize] += 1.0;
        if (column, row) == bright {
            let up = (height - edge(row + 1)) / (edge(row) - edge(row + 1));
            inside[((x.fract() * 8.0) as usize).min(7) + 8 * ((up * 8.0) as usize).min(7)] += 1.0;
        }
    }
    let probability = |i: usize| f64::from(table.entries[i].pdf) * map.solid_angle(i as u32 / WIDTH);
    let expected: Vec<f64> = (0..texels).map(|i| probability(i) * SAMPLES as f64).collect();
    let in_bright = inside.iter().sum::<f64>();
    // Densities that are not the table's, and radiances that are not the twin's; directions on a texel's edge may
    // round to its neighbour.
    let wrong_pdf = samples.iter().filter(|s| (s.pdf / table.pdf(map_frame(s.direction)) - 1.0).abs() > 1e-4).count();
    let twin = |w: DVec3| DVec3::from(map.radiance(map_frame(w)).map(f64::from)) * SCALE;
    let off = |w: DVec3, found: DVec3| (found - twin(w)).abs().max_element() / (1.0 + twin(w).max_element());
    let farthest = (0..SAMPLES).map(|i| off(directions[i], seen[i].radiance)).fold(0.0, f64::max);
    let sampled = samples.iter().map(|s| off(s.direction, s.value)).fold(0.0, f64::max);
    let integral = seen.iter().map(|s| s.pdf).sum::<f64>() * 4.0 * PI / SAMPLES as f64;
    let total = map_integral();
    let mut checks = vec![
        ("χ² of texels".to_owned(), chi_square(&counts, &expected, 1)),
        ("χ² inside a texel".to_owned(), chi_square(&inside, &[in_bright / 64.0; 64], 1)),
        ("densities of samples".to_owned(), if wrong_pdf > SAMPLES / 1000 { 100.0 } else { 0.0 }),
        ("radiance in given directions".to_owned(), farthest / 1e-4),
        ("radiance of samples".to_owned(), sampled / 1e-4),
        ("∫ pdf".to_owned(), (integral - 1.0) / 1e-3),
    ];
    for c in 0..3 {
        checks.push((format!("∫ radiance, channel {c}"), z_of(samples.iter().map(|s| s.value[c] / s.pdf), total[c])));
    }
    checks
}

#[test]
fn maps_are_sampled_by_their_light_and_seen_as_on_the_cpu() {
    let Some(a) = adapter() else { return };
    all_hold(&map_checks(&a, &standard()));
    let plants = [
        ("rng_next(rng) >= environment_table[texel].threshold", "rng_next(rng) < environment_table[texel].threshold"),
        ("u32(rng_next(rng) * f32(count))", "u32(0.99 * rng_next(rng) * f32(count))"),
        ("texel.y * size.x + texel.x].pdf", "texel.y * size.x + texel.x].pdf_alias"),
        ("let row = f32(texel / size.x);", "let row = f32(texel / size.x) + 0.1;"),
        ("let y = mix(top, bottom, rng_next(rng));", "let y = cos(MATH_PI * (row + rng_next(rng)) / f32(size.y));"),
        ("c * w.x + s * w.z", "c * w.x - s * w.z"),
        ("vec2f(size) - 0.5;", "vec2f(size);"),
        ("let u = 0.5 + atan2(e.x, -e.z)", "let u = 0.5 + atan2(-e.x, -e.z)"),
        ("environment_texel(i.x + 1, i.y + 1, size), f.x);", "environment_texel(i.x + 1, i.y, size), f.x);"),
        ("return mix(top, bottom, f.y) * params.environment_scale;", "return mix(top, bottom, f.y);"),
    ];
    for (from, to) in plants {
        one_sees(to, &map_checks(&a, &plant("light/environment", from, to).source));
    }
}

const POINT: DVec3 = DVec3::new(3.0, 1.0, -2.0);

/// Everything at once: a map, two discs that overlap, a delta sun and a point light.
fn mixed_checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let delta = DVec3::new(-0.5, 0.6, 0.2);
    let setup = Setup::new(|folder| {
        vec![
            sun(AXIS, 20.0, IRRADIANCE),
            environment(folder),
            sun(AXIS + DVec3::X * 0.2, 60.0, IRRADIANCE),
            sun(delta, 0.0, [4.0, 5.0, 6.0]),
            Light::Point(Point { position: POINT, intensity: Colour([20.0, 10.0, 5.0]) }),
        ]
    });
    let directions = sphere();
    let (probe, samples, seen) = setup.run(a, source, &directions);
    let list = &probe.lights.list;
    let share = |i: usize| f64::from(list[i].share);
    let bright_share = f64::from(probe.lights.map_share) + share(0) + share(1);
    let is_point = |s: &Sample| s.distance < 1e6;
    let is_delta = |s: &Sample| s.pdf == 0.0 && !is_point(s);
    let count = |f: &dyn Fn(&Sample) -> bool| samples.iter().filter(|s| f(s)).count() as f64;
    let n = SAMPLES as f64;
    let counts = [count(&|s| s.pdf > 0.0), count(&is_delta), count(&is_point)];
    let mut checks = vec![
        ("shares of lights".to_owned(), chi_square(&counts, &[bright_share * n, share(2) * n, share(3) * n], 1)),
        ("shares add up to one".to_owned(), (bright_share + share(2) + share(3) - 1.0) / 1e-5),
    ];
    // Radiance of samples and in given directions; those at the edge of a disc may fall to either side.
    let radiance = |w: DVec3| {
        let mut sum = DVec3::from(map().radiance(map_frame(w)).map(f64::from)) * SCALE;
        for (axis, diameter) in [(AXIS, 20.0), (AXIS + DVec3::X * 0.2, 60.0)] {
            if about(axis.normalize(), w).0 < edge(diameter) {
                sum += disc_radiance(diameter);
            }
        }
        sum
    };
    let off =
        |w: DVec3, found: DVec3| (found - radiance(w)).abs().max_element() > 5e-4 * (1.0 + radiance(w).max_element());
    let strays = samples.iter().filter(|s| s.pdf > 0.0 && off(s.direction, s.value)).count()
        + directions.iter().zip(&seen).filter(|(w, s)| off(**w, s.radiance)).count();
    checks.push(("radiance of samples and directions".to_owned(), strays as f64 / n / 1e-4));
    // Light of every kind, by what a sample is worth.
    let map_total = map_integral();
    let d = POINT - setup.place;
    for c in 0..3 {
        let discs: f64 = [20.0, 60.0].map(|diameter| disc_radiance(diameter)[c] * TAU * edge(diameter)).iter().sum();
        let bright = |s: &Sample| if s.pdf > 0.0 { s.value[c] / s.pdf } else { 0.0 };
        checks.push((format!("∫ bright sky, channel {c}"), z_of(samples.iter().map(bright), map_total[c] + discs)));
        let worth = |on: bool, s: &Sample| if on { s.value[c] } else { 0.0 };
        let sun_truth = [4.0, 5.0, 6.0][c];
        checks
            .push((format!("delta sun, channel {c}"), z_of(samples.iter().map(|s| worth(is_delta(s), s)), sun_truth)));
        let point_truth = [20.0, 10.0, 5.0][c] / d.length_squared();
        checks.push((format!("point, channel {c}"), z_of(samples.iter().map(|s| worth(is_point(s), s)), point_truth)));
    }
    // Each region of the sphere gets its solid angle from samples over their density.
    for region in 0..24 {
        let inside = |w: DVec3| {
            let third = ((w.y + 1.0) * 1.5).min(2.0) as usize;
            let eighth = ((w.z.atan2(w.x) / TAU + 0.5) * 8.0).min(7.0) as usize;
            third + 3 * eighth == region
        };
        let worth = |s: &Sample| if s.pdf > 0.0 && inside(s.direction) { 1.0 / s.pdf } else { 0.0 };
        checks.push((format!("solid angle of region {region}"), z_of(samples.iter().map(worth), 4.0 * PI / 24.0)));
    }
    let integral = seen.iter().map(|s| s.pdf).sum::<f64>() * 4.0 * PI / n;
    checks.push(("∫ pdf".to_owned(), (integral / bright_share - 1.0) / 2e-3));
    // Directions of the two that have only one.
    let off = |s: &Sample| {
        let exact = if is_point(s) { d } else { delta };
        (s.direction - exact.normalize()).length() > 1e-5
            || (is_point(s) && (s.distance / d.length() - 1.0).abs() > 1e-5)
    };
    let strays = samples.iter().filter(|s| s.pdf == 0.0 && off(s)).count();
    checks.push(("directions of delta and point".to_owned(), 100.0 * strays as f64));
    checks
}

#[test]
fn many_lights_share_the_samples() {
    let Some(a) = adapter() else { return };
    all_hold(&mixed_checks(&a, &standard()));
    let plants = [
        ("        u -= params.environment_share;\n", ""),
        ("                u -= lights[light_base + i].share;\n", ""),
        (
            "sample.value = light.value / (square * light.share);",
            "sample.value = light.value / (sample.distance * light.share);",
        ),
        ("sample.value = light.value / light.share;", "sample.value = light.value;"),
        ("sum += params.environment_share * environment_pdf(w);", "sum += environment_pdf(w);"),
        ("sum += light.share / (MATH_PI * light.chord2);", "sum = max(sum, light.share / (MATH_PI * light.chord2));"),
        ("sample.value = light_bright(sample.direction);", "sample.value = 0.99 * light_bright(sample.direction);"),
        ("ray_world(light.axis - p)", "ray_local(light.axis - p)"),
    ];
    for (from, to) in plants {
        one_sees(&format!("{from} -> {to}"), &mixed_checks(&a, &plant("light/light", from, to).source));
    }
}
