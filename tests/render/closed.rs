//! Homogeneous media in closed form: transmittance, and single scattering of one sun.

use super::*;

const SAMPLES: u32 = 512;
const E: f64 = 3.0;
const ALBEDO: f64 = 0.8;

fn transmittance_checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let mut checks = Vec::new();
    let centre = DVec3::splat(0.5);
    let diagonal = DVec3::ONE;
    let mut add = |name: &str, scene: &Scene, depth: f64| {
        let mut scene = scene.clone();
        scene.lights.push(constant(2.0));
        scene.integrator.max_bounces = Limit::AtMost(0);
        let picture = draw(a, source, &scene, 2 * SAMPLES);
        checks.push(picture.against_depth(name, depth));
        checks.push(picture.against(&format!("background through {name}"), 2.0 * (-depth).exp()));
    };
    for density in [0.1, 1.0, 5.0] {
        let mut scene = unit_cube(density);
        one_ray(&mut scene, centre, DVec3::X);
        add(&format!("a cube of {density}"), &scene, density);
    }
    let mut scene = unit_cube(1.0);
    // Beside the diagonal the way is shorter at once: from near, the view is narrower.
    look(&mut scene, centre - 0.9 * diagonal.normalize(), centre, 0.1);
    add("the diagonal", &scene, 3f64.sqrt());
    one_ray(&mut scene, centre, DVec3::NEG_Z);
    add("a cube along -z", &scene, 1.0);
    // From inside: half the way.
    look(&mut scene, centre, centre + DVec3::Y, 0.1);
    add("half the cube from inside", &scene, 0.5);
    // The density of a stretched, turned or sheared box is what it was; lengths are the world's.
    let mut scene = unit_cube(1.0);
    place(&mut scene, DMat4::from_scale(DVec3::new(3.0, 1.0, 0.2)));
    one_ray(&mut scene, DVec3::new(1.5, 0.5, 0.1), DVec3::X);
    add("a box three times as long", &scene, 3.0);
    let turn = DMat4::from_rotation_y(0.6) * DMat4::from_rotation_x(-1.0);
    place(&mut scene, turn * DMat4::from_scale(DVec3::new(2.0, 1.0, -1.0)));
    let middle = turn.transform_point3(DVec3::new(1.0, 0.5, -0.5));
    one_ray(&mut scene, middle, turn.transform_vector3(DVec3::X));
    add("a turned and mirrored box", &scene, 2.0);
    let shear = DMat4::from_cols_array_2d(&[
        [1.0, 0.0, 0.0, 0.0],
        [0.7, 1.0, 0.0, 0.0],
        [0.0, 0.0, 1.0, 0.0],
        [0.0, 0.0, 0.0, 1.0],
    ]);
    place(&mut scene, shear);
    one_ray(&mut scene, shear.transform_point3(centre), DVec3::new(0.7, 1.0, 0.0));
    add("along the edge of a sheared box", &scene, (1.0f64 + 0.49).sqrt());
    // Large and small worlds look the same.
    for scale in [1e-4, 1e4] {
        let mut scene = unit_cube(1.0 / scale);
        place(&mut scene, DMat4::from_scale(DVec3::splat(scale)));
        let from = centre * scale - DVec3::X * 5.0 * scale;
        look(&mut scene, from, centre * scale, 0.1);
        add(&format!("a world {scale} times as large"), &scene, 1.0);
    }
    let mut scene = slab(2.0);
    one_ray(&mut scene, centre, DVec3::new(0.6, -0.8, 0.0));
    add("a slanted way through a slab", &scene, 2.0 / 0.8);
    checks
}

#[test]
fn transmittance_is_the_closed_form() {
    let Some(a) = adapter() else { return };
    all_hold(&transmittance_checks(&a, &standard()));
    let plants = [
        ("flight/delta", "return segment.bound * flight.rate;", "return segment.bound * flight.rate * 1.01;"),
        ("integrate/path", "if (bounces >= params.max_bounces) {", "if (bounces > params.max_bounces) {"),
        ("core/rng", "return -log(1.0 - rng_next(rng));", "return -log2(1.0 - rng_next(rng));"),
        ("core/ray", "ray.exit = min(far.x, min(far.y, far.z));", "ray.exit = max(far.x, min(far.y, far.z));"),
    ];
    for (file, from, to) in plants {
        one_sees(&format!("{from} -> {to}"), &transmittance_checks(&a, &plant(file, from, to).source));
    }
}

/// A view of the medium, a direction towards the sun, and K of the radiance a · p · E · K.
struct Case {
    name: &'static str,
    slab: bool,
    ray: DVec3,
    sun: DVec3,
    /// By extinction; the formulas of the guide, evaluated and checked there by an analog simulation.
    k: [(f64, f64); 3],
}

const SLAB_SUN: DVec3 = DVec3::new(0.866_025_403_784_438_6, 0.5, 0.0);
const CASES: [Case; 6] = [
    Case {
        name: "side",
        slab: false,
        ray: DVec3::X,
        sun: DVec3::Y,
        k: [(0.5, 0.306_434_23), (2.0, 0.318_092_37), (5.0, 0.081_531_91)],
    },
    Case {
        name: "back",
        slab: false,
        ray: DVec3::X,
        sun: DVec3::NEG_X,
        k: [(0.5, 0.316_060_28), (2.0, 0.490_842_18), (5.0, 0.499_977_30)],
    },
    Case {
        name: "forward",
        slab: false,
        ray: DVec3::X,
        sun: DVec3::X,
        k: [(0.5, 0.303_265_33), (2.0, 0.270_670_57), (5.0, 0.033_689_73)],
    },
    Case {
        name: "slab, reflected",
        slab: true,
        ray: DVec3::NEG_Y,
        sun: SLAB_SUN,
        k: [(0.5, 0.258_956_61), (2.0, 0.332_507_08), (5.0, 0.333_333_23)],
    },
    Case {
        name: "slab, transmitted",
        slab: true,
        ray: DVec3::Y,
        sun: SLAB_SUN,
        k: [(0.5, 0.238_651_22), (2.0, 0.117_019_64), (5.0, 0.006_692_55)],
    },
    Case {
        name: "cube at 45°",
        slab: false,
        ray: DVec3::X,
        sun: DVec3::new(1.0, 1.0, 0.0),
        k: [(0.5, 0.299_369_30), (2.0, 0.264_485_78), (5.0, 0.037_242_49)],
    },
];

/// Every case at the last `densities` of its extinctions.
fn single_checks(a: &Adapter, source: &Source, densities: usize) -> Vec<Check> {
    let mut checks = Vec::new();
    for case in CASES {
        for &(density, k) in &case.k[3 - densities..] {
            for g in [0.5, -0.3] {
                let mut scene = if case.slab { slab(density) } else { unit_cube(density) };
                hg(&mut scene, g);
                albedo(&mut scene, ALBEDO);
                scene.lights = vec![sun(case.sun, E)];
                scene.integrator.max_bounces = Limit::AtMost(1);
                one_ray(&mut scene, DVec3::splat(0.5), case.ray);
                let cosine = case.ray.dot(case.sun.normalize());
                let truth = ALBEDO * hg_value(g, cosine) * E * k;
                checks
                    .push(draw(a, source, &scene, SAMPLES).against(&format!("{} {density}, g {g}", case.name), truth));
            }
        }
    }
    checks
}

#[test]
fn single_scattering_is_the_closed_form() {
    let Some(a) = adapter() else { return };
    all_hold(&single_checks(&a, &standard(), 3));
    let plants = [
        ("g with the wrong sign", "phase/hg", "lobe_value(params.g, ", "lobe_value(-params.g, "),
        ("phase 2 % off", "phase/lobe", "return (1.0 - g * g) /", "return 1.02 * (1.0 - g * g) /"),
        ("no albedo", "integrate/path", "throughput *= params.albedo;", "throughput *= vec3f(1.0);"),
        (
            "a bounce too many",
            "integrate/path",
            "if (bounces >= params.max_bounces) {",
            "if (bounces > params.max_bounces) {",
        ),
        (
            "shadow roulette without its weight",
            "integrate/path",
            "                        pending *= 1.0 / chance;\n",
            "",
        ),
        (
            "shadow rays go through everything",
            "transmittance/ratio",
            "*t *= Spectrum(1.0) - spectrum_extinction() * (density / segment.bound);",
            "*t *= Spectrum(1.0);",
        ),
    ];
    for (what, file, from, to) in plants {
        one_sees(what, &single_checks(&a, &plant(file, from, to).source, 1));
    }
}
