//! The film: the same bits however the work was cut, sums of many samples, layers, errors, counters.

use super::*;
use nephele::render::film::{Aov, BLOCK};

fn scene(seed: u32) -> Scene {
    let mut scene = unit_cube(3.0);
    albedo(&mut scene, 0.8);
    hg(&mut scene, 0.3);
    scene.lights = vec![sun(DVec3::new(0.2, 1.0, 0.3), 3.0), constant(0.5)];
    scene.integrator.seed = seed;
    // Not a whole number of tiles.
    (scene.film.width, scene.film.height) = (37, 21);
    look(&mut scene, DVec3::new(0.7, 0.9, 3.0), DVec3::splat(0.5), 30.0);
    scene
}

fn read(r: &mut Renderer) -> Sums {
    r.sums().expect("a film")
}

#[test]
fn bits_do_not_depend_on_how_the_work_was_cut() {
    let Some(a) = adapter() else { return };
    let samples = BLOCK + 44;
    let mut r = renderer(&a, &standard(), &scene(1), None, true);
    accumulate(&mut r, samples, WHOLE);
    let whole = read(&mut r);
    let counted = r.film.count(&r.gpu).expect("counters");
    for (piece, groups) in [(1, 1000), (7, 2), (64, 5), (300, 1)] {
        r.restart();
        assert_eq!(r.progress().samples, 0);
        accumulate(&mut r, samples, Work { samples: piece, groups });
        assert!(read(&mut r) == whole, "pieces of {piece} samples and {groups} tiles");
        assert_eq!(r.film.count(&r.gpu).expect("counters"), counted);
    }
    // Nor on looking at it on the way, another scene before, or another size.
    r.restart();
    while r.progress().samples < samples {
        let left = samples - r.progress().samples;
        r.submit(Work { samples: 50.min(left), groups: 4 }).expect("draws");
        let _ = read(&mut r);
        r.resolve();
    }
    assert!(read(&mut r) == whole);
    let mut other = scene(1);
    other.medium.g = -0.5;
    other.lights.pop();
    let size = (37, 21);
    r.update(&other, (16, 16), None).expect("another scene");
    accumulate(&mut r, 3, WHOLE);
    r.update(&scene(1), size, None).expect("the first scene");
    accumulate(&mut r, samples, WHOLE);
    assert!(read(&mut r) == whole, "after another scene");
    // What is only shown does not begin the picture anew; what is drawn does.
    let mut shown = scene(1);
    shown.display.exposure = 3.0;
    assert!(!r.update(&shown, size, None).expect("the same picture").accumulation);
    assert_eq!(r.progress().samples, samples);
    assert!(r.update(&other, size, None).expect("another picture").accumulation);
    assert_eq!(r.progress().samples, 0);
}

#[test]
fn seeds_give_other_samples_of_the_same_picture() {
    let Some(a) = adapter() else { return };
    let [one, again, other] = [1, 1, 2].map(|seed| draw(&a, &standard(), &scene(seed), 64));
    assert!(one.sums == again.sums);
    // Only pixels of pure sky, or nearly so, are equal.
    let equal = (0..one.pixels()).filter(|&p| one.sums.sum[p] == other.sums.sum[p] && one.sums.sum[p][3] > 5.0);
    assert_eq!(equal.count(), 0);
    all_hold(&same("two seeds", &one, &other));
    // Without the seed in the streams, the second picture is the first.
    let deaf = plant("core/rng", "(seed ^ b)", "(7u ^ b)");
    assert!(draw(&a, &deaf.source, &scene(1), 64).sums == draw(&a, &deaf.source, &scene(2), 64).sums);
    assert!(draw(&a, &standard(), &scene(1), 1).sums.variance(0).is_none());
}

#[test]
fn long_sums_lose_nothing() {
    let Some(a) = adapter() else { return };
    let mut furnace = scene(1);
    albedo(&mut furnace, 1.0);
    furnace.lights = vec![constant(1.0)];
    (furnace.film.width, furnace.film.height) = (8, 8);
    let samples = 40 * BLOCK + 3;
    let picture = draw(&a, &standard(), &furnace, samples);
    let n = f64::from(samples);
    assert!(picture.sums.sum.iter().zip(&picture.sums.square).all(|(s, q)| s[..3] == [n; 3] && q[..] == [n; 4]));
    assert_eq!(picture.mean(0), (1.0, 0.0));
}

#[test]
fn layers_add_up_to_the_picture() {
    let Some(a) = adapter() else { return };
    let samples = 128;
    let all = draw_with(&a, &standard(), &scene(1), None, samples, true);
    // Layers change nothing in the picture.
    assert!(all.sums.sum == draw(&a, &standard(), &scene(1), samples).sums.sum);
    let mut unscattered = scene(1);
    unscattered.integrator.max_bounces = Limit::AtMost(0);
    let direct = draw(&a, &standard(), &unscattered, samples);
    let mut once = scene(7);
    once.integrator.max_bounces = Limit::AtMost(1);
    let once = draw(&a, &standard(), &once, samples);
    let n = f64::from(samples);
    let (mut whole, mut error) = (0.0, 0.0);
    for p in 0..all.pixels() {
        let (near, far) = (all.sums.extra[2 * p], all.sums.extra[2 * p + 1]);
        for c in 0..3 {
            let sum = near[c] + far[c] + direct.sums.sum[p][c];
            let total = all.sums.sum[p][c];
            assert!((sum - total).abs() < 1e-4 * total.max(1.0), "pixel {p}: {sum} of {total}");
        }
        // Single scattering is what a limit of one bounce adds, in the mean.
        whole += (near[0] + direct.sums.sum[p][0]) / n - once.sums.mean(p)[0];
        error += once.variance(p)[0] + all.variance(p)[0];
    }
    all_hold(&[("single scattering and one bounce".into(), whole / error.sqrt())]);
    let image = all.sums.image(&Aov::ALL, [0.8; 3], None);
    let layer = |name: &str| &image.layer(name).unwrap_or_else(|| panic!("no layer {name}")).data;
    for p in 0..all.pixels() {
        assert!((layer("single")[3 * p] + layer("multiple")[3 * p]) <= image.layers[0].data[4 * p] * 1.0001);
        assert!((layer("transmittance")[p] + image.layers[0].data[4 * p + 3] - 1.0).abs() < 1e-6);
        assert!((layer("albedo")[3 * p] - 0.8 * image.layers[0].data[4 * p + 3]).abs() < 1e-6);
    }
}

#[test]
fn bounce_limits_cut_the_same_paths() {
    let Some(a) = adapter() else { return };
    let with = |limit| {
        let mut furnace = scene(4);
        albedo(&mut furnace, 1.0);
        furnace.lights = vec![constant(1.0)];
        furnace.integrator.max_bounces = limit;
        draw(&a, &standard(), &furnace, 32)
    };
    // A sample is 1 where its path ends within the limit.
    let limits = [0, 1, 2, 3, 1000].map(|n| with(Limit::AtMost(n)));
    for pair in limits.windows(2) {
        let rises = (0..pair[0].pixels()).map(|p| pair[1].sums.sum[p][0] - pair[0].sums.sum[p][0]);
        assert!(rises.clone().all(|x| x >= 0.0) && rises.sum::<f64>() > 100.0);
        assert_eq!(pair[0].opacity(), pair[1].opacity(), "the limit changes no first collision");
    }
    assert!(limits[4].sums.sum == with(Limit::Unlimited).sums.sum);
    let opaque = limits[0].opacity().0;
    assert!((limits[0].mean(0).0 - (1.0 - opaque)).abs() < 1e-6, "without a bounce: what met nothing");
}

#[test]
fn variants_are_those_that_are_validated() {
    let Some(a) = adapter() else { return };
    let mut odd = scene(1);
    odd.medium.extinction = Colour([1.0, 2.0, 3.0]);
    odd.camera.aperture_radius = 0.1;
    odd.lights.clear();
    for (scene, aov) in [(scene(1), false), (odd, true)] {
        let variant = renderer(&a, &standard(), &scene, None, aov).variant();
        let mut slots: Vec<&str> = variant.slots.iter().map(|s| s.0).collect();
        slots.sort_unstable();
        // The lists of tests/shaders.rs.
        assert_eq!(slots, ["flight", "majorant", "medium", "phase", "proxy", "spectrum", "transmittance"]);
        let mut constants: Vec<&str> = variant.constants.iter().map(|c| c.0).collect();
        constants.sort_unstable();
        let known = "CAMERA_LENS FILM_AOV FILM_COST FLIGHT_WALKS LIGHT_HAS_DISC LIGHT_HAS_LIST LIGHT_HAS_MANY \
                     LIGHT_HAS_MAP LIGHT_HAS_POINT LIGHT_SAMPLED MAJORANT_CONTROL MAJORANT_TIGHT MEDIUM_NEAREST \
                     PATH_MOST_ROUNDS REUSE REUSE_SECOND TRACK_STEPS \
                     TRANSMITTANCE_WALKS";
        assert_eq!(constants, known.split_whitespace().collect::<Vec<_>>());
    }
}

fn depth_checks(a: &Adapter, source: &Source) -> Vec<Check> {
    let mut checks = Vec::new();
    for (density, scale) in [(0.5, 1.0), (3.0, 1.0), (0.03, 100.0)] {
        let mut scene = unit_cube(density);
        place(&mut scene, DMat4::from_scale(DVec3::splat(scale)));
        look(&mut scene, DVec3::new(-4.5, 0.5, 0.5) * scale, DVec3::splat(0.5) * scale, 0.1);
        scene.lights = vec![constant(1.0)];
        let picture = draw_with(a, source, &scene, None, 256, true);
        let hits: f64 = picture.sums.sum.iter().map(|s| s[3]).sum();
        let sum = |i: usize| picture.sums.extra.iter().skip(i).step_by(2).map(|e| e[3]).sum::<f64>();
        let mean = sum(0) / hits;
        let variance = sum(1) / hits - mean * mean;
        let x = density * scale;
        let truth = 4.5 * scale + 1.0 / density - scale / (x.exp() - 1.0);
        let spread = density.powi(-2) - scale.powi(2) * x.exp() / (x.exp() - 1.0).powi(2);
        let name = format!("density {density}, scale {scale}");
        checks.push((format!("first free flight, {name}"), (mean - truth) / (spread / hits).sqrt()));
        // Fourth moments of a truncated exponential are below those of the whole: 9 σ⁴.
        checks.push((format!("its spread, {name}"), (variance / spread - 1.0) / (8.0 / hits).sqrt()));
    }
    checks
}

#[test]
fn depth_is_the_first_free_flight() {
    let Some(a) = adapter() else { return };
    all_hold(&depth_checks(&a, &standard()));
    let plants = [
        ("reached = (travelled + ray.t) * params.length_unit;", "reached = (travelled + ray.t);"),
        (
            "reached = (travelled + ray.t) * params.length_unit;",
            "reached = 1.001 * (travelled + ray.t) * params.length_unit;",
        ),
        ("reached * reached * met", "1.001 * reached * reached * met"),
    ];
    for (from, to) in plants {
        one_sees(to, &depth_checks(&a, &plant("integrate/path", from, to).source));
    }
}

#[test]
fn errors_are_those_between_pictures() {
    let Some(a) = adapter() else { return };
    const RUNS: u32 = 24;
    let pictures: Vec<Picture> = (0..RUNS).map(|seed| draw(&a, &standard(), &scene(100 + seed), 64)).collect();
    let first = &pictures[0];
    let k = f64::from(RUNS);
    let (mut stated, mut found, mut mean) = (0.0, 0.0, 0.0);
    for p in 0..first.pixels() {
        for c in 0..3 {
            stated += pictures.iter().map(|i| i.variance(p)[c]).sum::<f64>() / k;
            let average = pictures.iter().map(|i| i.sums.mean(p)[c]).sum::<f64>() / k;
            found += pictures.iter().map(|i| (i.sums.mean(p)[c] - average).powi(2)).sum::<f64>() / (k - 1.0);
            mean += average;
        }
    }
    // About 800 pixels with 23 degrees of freedom each, correlated over channels: one per cent or two.
    assert!((found / stated - 1.0).abs() < 0.06, "{found} between pictures, {stated} stated");
    let n = 3.0 * first.pixels() as f64;
    let relative = (found / n).sqrt() / (mean / n);
    let stated = first.sums.relative_error().expect("more than one sample");
    assert!((stated / relative - 1.0).abs() < 0.06, "{stated} stated, {relative} found");
    // Sums of runs are the sum of all samples.
    let mut both = pictures[0].sums.clone();
    both.add(&pictures[1].sums);
    assert_eq!(both.square[0][3], 128.0);
    let middle = 0.5 * (pictures[0].sums.mean(400)[1] + pictures[1].sums.mean(400)[1]);
    assert!((both.mean(400)[1] - middle).abs() < 1e-12);
}

#[test]
fn counters_count() {
    let Some(a) = adapter() else { return };
    // Without scattering: one free flight a sample.
    let mut opaque = unit_cube(2.0);
    one_ray(&mut opaque, DVec3::splat(0.5), DVec3::X);
    opaque.integrator.max_bounces = Limit::AtMost(0);
    let picture = draw(&a, &standard(), &opaque, 64);
    let hits: f64 = picture.sums.sum.iter().map(|s| s[3]).sum();
    let samples = f64::from(64 * SIDE * SIDE);
    let c = picture.counters;
    assert_eq!((c.real_collisions as f64, c.null_collisions, c.shadow_rays), (hits, 0, 0));
    assert_eq!((c.lookups as f64, c.cell_steps as f64), (hits, samples));
    // Every lookup of a free flight is a null or a real collision; shadow rays have the rest.
    let c = draw(&a, &standard(), &scene(1), 16).counters;
    assert!(
        c.shadow_rays > 0 && c.lookups > c.real_collisions + c.null_collisions && c.cell_steps >= c.lookups,
        "{c:?}"
    );
    let mut dark = scene(1);
    dark.lights = vec![constant(1.0)];
    let c = draw(&a, &standard(), &dark, 16).counters;
    assert_eq!((c.shadow_rays, c.lookups), (0, c.real_collisions + c.null_collisions));
}

#[test]
fn shaders_are_read_again_and_broken_ones_leave_the_picture() {
    let Some(a) = adapter() else { return };
    let mut scene = unit_cube(2.0);
    scene.lights = vec![constant(1.0)];
    let mut r = renderer(&a, &standard(), &scene, None, false);
    let pass = Work { samples: 4, groups: u32::MAX };
    r.submit(pass).expect("draws");
    let before = r.film.read(&a.gpu).expect("reads");
    let mut broken = standard();
    broken.plants.push(("u * segment.bound < density;".into(), "u * segment.bound < density_;".into()));
    let message = r.reload_shaders(broken).expect_err("density_ is unknown").to_string();
    assert!(message.contains("shaders/flight/delta.wgsl:"), "{message}");
    assert_eq!(r.progress().samples, 4, "the picture goes on");
    // Another estimator shows at once, and the old one gives the old bits again.
    let mut other = standard();
    other.plants.push(("u * segment.bound < density;".into(), "u * segment.bound < 0.5 * density;".into()));
    r.reload_shaders(other).expect("builds");
    assert_eq!(r.progress().samples, 0, "a new shader is a new picture");
    r.submit(pass).expect("draws");
    assert_ne!(r.film.read(&a.gpu).expect("reads"), before);
    r.reload_shaders(standard()).expect("builds");
    r.submit(pass).expect("draws");
    assert_eq!(r.film.read(&a.gpu).expect("reads"), before);
}

/// A white cube so thick that some paths take more rounds of loops than one dispatch has, on software adapters.
fn deep() -> Scene {
    let mut scene = unit_cube(400.0);
    scene.medium.albedo = Colour([1.0, 0.9999, 0.999]);
    scene.medium.extinction = Colour([1.0, 0.9, 0.8]);
    scene.medium.phase = Phase::Isotropic;
    scene.lights = vec![constant(1.0)];
    scene.integrator.max_bounces = Limit::Unlimited;
    (scene.film.width, scene.film.height) = (8, 8);
    scene
}

#[test]
fn paths_longer_than_a_dispatch_go_on_in_the_next() {
    let Some(a) = adapter() else { return };
    let draw = |source: &Source, piece: u32| {
        let mut r = renderer(&a, source, &deep(), None, true);
        accumulate(&mut r, 40, Work { samples: piece, groups: u32::MAX });
        let sums = r.sums().expect("a film");
        (sums, r.film.count(&a.gpu).expect("counters").behind)
    };
    let (whole, behind) = draw(&standard(), u32::MAX);
    assert!(whole.square.iter().all(|s| s[3] == 40.0), "no sample is lost");
    assert!(behind > 0 || !a.gpu.is_software(), "the scene is deep enough");
    // Other pieces pause paths at other places; the picture has the same bits.
    assert!(draw(&standard(), 3).0 == whole);
    if a.gpu.is_software() {
        for (from, to) in [
            ("throughput = paused.throughput;", "throughput = vec3f(1.0);"),
            ("rng.state = paused.state;", ""),
            ("depth = paused.depth;", "depth = rng_depth(&rng);"),
            ("flight = flight_unpack(paused.flight);", "flight = flight_start(&rng);"),
            ("bounces = paused.bounces;", "bounces = 0u;"),
            ("toward = paused.toward;", "toward = -paused.toward;"),
            ("reached = paused.reached;", "reached = 0.0;"),
            ("next - 1u, path", "next, path"),
        ] {
            assert!(draw(&plant("integrate/path", from, to).source, u32::MAX).0 != whole, "{to} is not seen");
        }
    }
}
