//! Coloured extinction: each channel is the grey picture of its own extinction.

use super::support::{field_of, random_dense};
use super::*;

const SAMPLES: u32 = 256;

/// The scene, for a cube (`dense`: voxels) of these factors on the extinction.
fn scene(factors: [f64; 3], dense: bool, seed: u32) -> (Scene, Option<Field>) {
    let mut scene = unit_cube(1.0);
    scene.medium.extinction = Colour(factors);
    scene.medium.albedo = Colour([0.95, 0.8, 0.6]);
    hg(&mut scene, 0.4);
    scene.lights = vec![sun(DVec3::new(0.3, 1.0, 0.4), 3.0), constant(0.5)];
    scene.integrator.seed = seed;
    let field = dense.then(|| {
        scene.volume.analytic = Analytic::None;
        let mut dense = random_dense([12, 12, 12], 21);
        dense.world_from_index = DMat4::from_scale(DVec3::splat(1.0 / 12.0));
        field_of(dense, DMat4::IDENTITY, false)
    });
    look(&mut scene, DVec3::new(1.5, 1.0, 3.0), DVec3::splat(0.5), 28.0);
    (scene, field)
}

fn checks(a: &Adapter, source: &Source, factors: [f64; 3], dense: bool) -> Vec<Check> {
    let (coloured, field) = scene(factors, dense, 1);
    let all = draw_with(a, source, &coloured, field, 4 * SAMPLES, false);
    let mut checks = Vec::new();
    for c in 0..3 {
        let (grey, field) = scene([factors[c]; 3], dense, 2 + c as u32);
        let one = draw_with(a, source, &grey, field, SAMPLES, false);
        let name = format!("{factors:?}, dense {dense}");
        let of_channel = format!("channel {c}:");
        checks.extend(same(&name, &all, &one).into_iter().filter(|(n, _)| n.contains(&of_channel)));
    }
    checks
}

#[test]
fn channels_are_their_grey_pictures() {
    let Some(a) = adapter() else { return };
    for dense in [false, true] {
        for factors in [[1.0, 1.2, 1.5], [1.0, 5.0, 15.0], [4.0, 0.0, 1.0]] {
            all_hold(&checks(&a, &standard(), factors, dense));
        }
    }
    let plants = [
        ("no weights", "spectrum/colour", "return p / math_mean3(p);", "return vec3f(1.0);"),
        ("weights of the hero alone", "spectrum/colour", "return p / math_mean3(p);", "return p / math_max3(p);"),
        (
            "majorant depth left out",
            "spectrum/colour",
            "* hero.events - params.extinction * hero.depth",
            "* hero.events",
        ),
        (
            "collisions left out",
            "spectrum/colour",
            "spectrum_log(params.extinction) * hero.events",
            "spectrum_log(params.extinction) * 0.0",
        ),
        (
            "shadow rays of the mean channel",
            "transmittance/ratio",
            "spectrum_extinction() * (density",
            "Spectrum(spectrum_mean(spectrum_extinction())) * (density",
        ),
        (
            "heroes not even",
            "spectrum/colour",
            "min(u32(rng_next(rng) * 3.0), 2u)",
            "min(u32(rng_next(rng) * 3.2), 2u)",
        ),
        (
            "null collisions not counted",
            "flight/delta",
            "spectrum_step(flight, stretch * segment.bound, collides);",
            "spectrum_step(flight, stretch * segment.bound, false);",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &checks(&a, &plant(file, from, to).source, [1.0, 2.0, 4.0], true));
    }
}
