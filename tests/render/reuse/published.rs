//! The method of 2021: it keeps the path tracer's mean where it should, its background, and no path over an edit.

use super::*;
use ensemble::{accumulated, frame};

/// Samples of a reference's pixels.
const SAMPLES: u32 = 8192;

/// The cloud in the sun before a sky, as the method of 2021 draws it.
fn published(bounces: u32) -> Scene {
    let mut scene = sunny(bounces);
    scene.integrator.mode = Mode::Restir2021;
    scene.lights.push(constant(0.3));
    scene
}

/// Rays through the centres of pixels, as the method knows no others.
fn centres() -> support::Planted {
    let jitter = "vec2f(rng_next(rng), rng_next(rng))";
    support::plant("core/camera", &format!("{jitter};"), &format!("{jitter} * 0.0 + 0.5;"))
}

#[test]
fn its_frames_are_the_path_tracers_through_centres() {
    let Some(a) = adapter() else { return };
    for (bounces, histories) in [(1, 80), (3, 60)] {
        let scene = published(bounces);
        let centres = centres();
        let mut path = renderer(&a, &centres.source, &scene, Some(cloud_field()), false);
        let stage = Stage::new(&format!("2021, bounces {bounces}"), &mut path, &scene, SAMPLES);
        let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
        let mut stage = stage.with(&mut r);
        let still = |_| scene.clone();
        stage.holds(&Course { name: "frame 0", last: 0, histories: 2 * histories, at: &still });
        stage.holds(&Course { name: "frame 6", last: 6, histories, at: &still });
        // Its bias is below what an ensemble sees.
        let moving = |left| orbit(&scene, left);
        stage.holds(&Course { name: "orbit and dolly, frame 4", last: 4, histories, at: &moving });
    }
}

#[test]
fn errors_of_it_are_seen() {
    let Some(a) = adapter() else { return };
    let scene = published(1);
    let centres = centres();
    let mut path = renderer(&a, &centres.source, &scene, Some(cloud_field()), false);
    let stage = Stage::new("2021", &mut path, &scene, SAMPLES);
    let still = |_| scene.clone();
    let plants = [
        (
            "neighbours without weights",
            "reuse_2021/gather",
            "let m = counts[i] * theirs.aim / max(all_parts, 1e-37);",
            "let m = 1.0 / f32(GATHER_MOST);",
        ),
        (
            "a path's own pixel left out of its weight",
            "reuse_2021/gather",
            "all_parts += counts[j] * aim;",
            "all_parts += select(counts[j] * aim, 0.0, j == 0u && i != 0u);",
        ),
        (
            "what gets through by no chance",
            "reuse_2021/initial",
            "density = state.after * f32(walks);",
            "density = f32(walks);",
        ),
        (
            "the own path as if there were no history",
            "reuse_2021/reproject",
            "let own_m = own_part / max(own_part + c * own_there, 1e-37);",
            "let own_m = 1.0;",
        ),
    ];
    for (name, file, from, to) in plants {
        let planted = support::plant(file, from, to);
        let mut other = renderer(&a, &planted.source, &scene, Some(cloud_field()), false);
        assert!(
            stage.with(&mut other).sees(&Course { name, last: 2, histories: 80, at: &still }),
            "{name} is not seen"
        );
    }
}

#[test]
fn its_background_and_opacity_are_kept() {
    let Some(a) = adapter() else { return };
    // Without light behind the medium too, where the opacity is noisy and needs independent frames. Those that reuse paths have so
    // much in common that a run of 400 is off by 1 %.
    for (sky, reuses, seeds, samples, tolerance) in [(0.3, true, 16, 400, 0.01), (0.0, false, 1, 2000, 0.04)] {
        let mut scene = published(1);
        (scene.restir.temporal, scene.restir.spatial) = (reuses, reuses);
        scene.lights[1] = constant(sky);
        let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
        let opacity = |s: &Sums| s.sum.iter().map(|x| x[3]).sum::<f64>() / s.square.iter().map(|x| x[3]).sum::<f64>();
        let mut own_opacity = 0.0;
        let mut corner = [0.0; 3];
        for seed in 0..seeds {
            scene.integrator.seed = seed;
            let own = accumulated(&mut r, &scene, samples);
            own_opacity += opacity(&own) / f64::from(seeds);
            corner = own.mean(0);
        }
        scene.integrator.mode = Mode::Path;
        let centres = centres();
        let mut path = renderer(&a, &centres.source, &scene, Some(cloud_field()), false);
        let truth = accumulated(&mut path, &scene, 2000);
        let wanted = opacity(&truth);
        assert!((own_opacity / wanted - 1.0).abs() < tolerance, "opacity {own_opacity}, {wanted} expected, sky {sky}");
        // A ray that meets nothing sees the sky without noise.
        assert!(corner.iter().all(|x| (x - sky).abs() < 1e-6), "{corner:?}");
    }
}

/// Something that changes a scene.
type Edit<'a> = &'a dyn Fn(&mut Scene);

#[test]
fn it_forgets_all_paths_at_an_edit() {
    let Some(a) = adapter() else { return };
    let last = |change: Edit, forgets: bool| {
        let mut scene = published(1);
        let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
        (0..3).for_each(|i| frame(&mut r, &scene, i == 0));
        change(&mut scene);
        if forgets {
            r.reuse_mut().expect("the mode keeps reservoirs").forget();
        }
        frame(&mut r, &scene, false);
        r.sums().expect("a film").sum
    };
    let edits: [(&str, Edit); 4] = [
        ("g", &|s| s.medium.g = 0.6),
        ("density", &|s| s.medium.density_scale = nephele::scene::value::Auto::Is(3.0)),
        ("sun", &|s| s.lights[0] = sun(DVec3::Y, 1.0)),
        ("candidates", &|s| s.restir.candidates = nephele::scene::value::Auto::Is(3)),
    ];
    for (what, edit) in edits {
        assert!(last(edit, false) == last(edit, true), "{what}: paths of before are left");
    }
    let camera = |s: &mut Scene| s.camera.fov_y = 37.0;
    assert!(last(&camera, false) != last(&camera, true), "what a camera saw is kept");
    let exposure = |s: &mut Scene| s.display.exposure = 1.0;
    assert!(last(&exposure, false) != last(&exposure, true), "and the way it is shown changes nothing");
}
