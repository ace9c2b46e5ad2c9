//! The camera: where things are in the picture, and the lens, by an opaque box seen by both.

use super::support::Dice;
use super::*;

const LOW: DVec3 = DVec3::new(-0.6, -0.3, -0.2);
const HIGH: DVec3 = DVec3::new(0.5, 0.4, 0.3);
const WIDTH: u32 = 40;
const HEIGHT: u32 = 24;
const SAMPLES: u32 = 256;
const ORACLE: u32 = 1024;

fn meets(origin: DVec3, direction: DVec3) -> bool {
    let (a, b) = ((LOW - origin) / direction, (HIGH - origin) / direction);
    a.min(b).max_element().max(0.0) < a.max(b).min_element()
}

fn shot(aperture: f64, focus: Auto<f64>, roll: DVec3) -> Scene {
    let mut scene = boxed(LOW.to_array(), HIGH.to_array(), 1e6);
    (scene.film.width, scene.film.height) = (WIDTH, HEIGHT);
    scene.integrator.max_bounces = Limit::AtMost(0);
    look(&mut scene, DVec3::new(1.5, 0.9, 2.0), DVec3::new(0.1, -0.05, 0.0), 38.0);
    scene.camera.up = roll;
    scene.camera.aperture_radius = aperture;
    scene.camera.focus_distance = focus;
    scene
}

/// Share of each pixel's samples that meet the box, by the contract's words.
fn oracle(scene: &Scene) -> Vec<f64> {
    let (Auto::Is(position), Auto::Is(target)) = (scene.camera.position, scene.camera.target) else {
        panic!("the camera is placed");
    };
    let forward = (target - position).normalize();
    let right = forward.cross(scene.camera.up).normalize();
    let up = right.cross(forward);
    let half = (0.5 * scene.camera.fov_y).to_radians().tan();
    let focus = scene.camera.focus_distance.unwrap_or_else(|| (target - position).length());
    let mut dice = Dice::new(77);
    (0..WIDTH * HEIGHT)
        .map(|p| {
            let hits = (0..ORACLE).filter(|_| {
                // Pixels are square, rows begin at the top.
                let x = (2.0 * (f64::from(p % WIDTH) + dice.next()) - f64::from(WIDTH)) / f64::from(HEIGHT);
                let y = 1.0 - 2.0 * (f64::from(p / WIDTH) + dice.next()) / f64::from(HEIGHT);
                let (r, angle) = (dice.next().sqrt(), dice.between(0.0, std::f64::consts::TAU));
                let lens = (right * angle.cos() + up * angle.sin()) * r * scene.camera.aperture_radius;
                let sharp = (forward + right * half * x + up * half * y) * focus;
                meets(position + lens, sharp - lens)
            });
            hits.count() as f64 / f64::from(ORACLE)
        })
        .collect()
}

fn checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let mut checks = Vec::new();
    let cases = [
        ("pinhole", shot(0.0, Auto::Auto, DVec3::Y)),
        ("rolled pinhole", shot(0.0, Auto::Auto, DVec3::new(0.6, 1.0, 0.0))),
        ("lens, sharp at the target", shot(0.2, Auto::Auto, DVec3::Y)),
        ("lens, sharp before the box", shot(0.3, Auto::Is(1.0), DVec3::Y)),
        ("lens, sharp far away", shot(0.1, Auto::Is(50.0), DVec3::new(0.0, 1.0, 0.3))),
    ];
    for (name, scene) in cases {
        let picture = draw(a, source, &scene, SAMPLES);
        let (n, m) = (f64::from(SAMPLES), f64::from(ORACLE));
        let (mut square, mut count) = (0.0, 0.0);
        let mut quarters = [(0.0, 0.0); 4];
        for (p, truth) in oracle(&scene).into_iter().enumerate() {
            let share = picture.sums.sum[p][3] / n;
            let pooled = (share * n + truth * m) / (n + m);
            let variance = pooled * (1.0 - pooled) * (1.0 / n + 1.0 / m);
            let (x, y) = (p as u32 % WIDTH, p as u32 / WIDTH);
            let quarter = &mut quarters[(x * 2 / WIDTH + 2 * (y * 2 / HEIGHT)) as usize];
            *quarter = (quarter.0 + share - truth, quarter.1 + variance);
            if variance > 0.0 {
                square += (share - truth).powi(2) / variance;
                count += 1.0;
            }
        }
        checks.push((format!("{name}: z² of pixels"), normal(square, count)));
        for (i, (difference, variance)) in quarters.into_iter().enumerate() {
            checks.push((format!("{name}: quarter {i}"), difference / variance.sqrt()));
        }
    }
    checks
}

#[test]
fn pixels_and_lens_are_where_the_contract_says() {
    let Some(a) = adapter() else { return };
    all_hold(&checks(&a, &standard()));
    let plants = [
        ("(2.0 * film.x - 1.0)", "(1.0 - 2.0 * film.x)"),
        ("(1.0 - 2.0 * film.y)", "(2.0 * film.y - 1.0)"),
        ("vec2f(rng_next(rng), rng_next(rng))", "vec2f(0.0, rng_next(rng))"),
        ("params.aperture * sqrt(rng_next(rng))", "params.aperture * rng_next(rng)"),
        ("normalize(axis * params.focus - lens)", "normalize(axis * params.focus)"),
        ("normalize(axis * params.focus - lens)", "normalize(normalize(axis) * params.focus - lens)"),
        ("params.camera_local + ray_local(lens)", "params.camera_local"),
    ];
    for (from, to) in plants {
        one_sees(&format!("{from} -> {to}"), &checks(&a, &plant("core/camera", from, to).source));
    }
}
