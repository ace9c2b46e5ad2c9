//! Views of reservoirs: what each pixel keeps, against a model of the confidences, and on screen as in memory.

use super::*;
use nephele::render::heat;
use nephele::render::peek::Patch;
use nephele::scene::{History, Overlay};

/// Overlays of reservoirs.
const VIEWS: [Overlay; 4] = [Overlay::Confidence, Overlay::Age, Overlay::Source, Overlay::Weight];

/// A cloud with some sky round it.
fn scene(change: impl Fn(&mut nephele::scene::Restir)) -> Scene {
    let mut scene = sunny(2);
    scene.camera.fov_y = 24.0;
    (scene.restir.cap, scene.restir.reach) = (3, 2);
    change(&mut scene.restir);
    scene
}

/// Goes on by `frames` frames as while things move; the camera stays.
fn draw(r: &mut Renderer, frames: u32) {
    r.set_moving(true);
    for _ in 0..frames {
        r.restart();
        r.submit(Work { samples: 1, groups: u32::MAX }).unwrap_or_else(|e| panic!("{e}"));
    }
}

/// The output function of the generator; as in shaders/core/rng.wgsl.
fn mix(word: u32) -> u32 {
    let x = (word >> ((word >> 28) + 4) ^ word).wrapping_mul(277_803_737);
    x >> 22 ^ x
}

/// The partner of a pixel, its place in the picture; as shaders/reuse/pair.wgsl finds it.
fn partner(pixel: u32, round: u32, frame: u32, scene: &Scene) -> Option<usize> {
    let side = 1u32 << scene.restir.reach;
    let key = mix(mix(frame.wrapping_mul(747_796_405).wrapping_add(2_891_336_453)) ^ scene.integrator.seed);
    let bits = mix(key ^ round.wrapping_mul(277_803_737));
    let place = 1 + ((key >> 16) + round) % (side * side - 1);
    let along = |at: u32, origin: u32, mask: u32| ((at + origin) ^ mask).checked_sub(origin).filter(|x| *x < PICTURE);
    let x = along(pixel % PICTURE, bits & 255, place % side)?;
    let y = along(pixel / PICTURE, bits >> 8 & 255, place / side)?;
    Some((y * PICTURE + x) as usize)
}

/// Confidences that a still camera's frame `last` shades: c + min(c_h, cap), then the sum over the partners.
fn model(scene: &Scene, last: u32) -> Vec<f64> {
    let s = &scene.restir;
    let mut history = vec![0.0f64; (PICTURE * PICTURE) as usize];
    let mut merged = history.clone();
    for frame in 0..=last {
        let cap = if s.temporal { f64::from(s.cap) } else { 0.0 };
        let own: Vec<f64> = history.iter().map(|c| 1.0 + c.min(cap)).collect();
        let rounds = if s.spatial { s.neighbours } else { 0 };
        let others = |p: u32| (0..rounds).filter_map(move |round| partner(p, round, frame, scene));
        merged = (0..PICTURE * PICTURE).map(|p| own[p as usize] + others(p).map(|q| own[q]).sum::<f64>()).collect();
        history = if s.history == History::Spatial { merged.clone() } else { own };
    }
    merged
}

/// Pixels whose confidence after 6 frames is not the model's.
fn wrong(a: &Adapter, source: &Source, scene: &Scene) -> usize {
    let mut r = renderer(a, source, scene, Some(cloud_field()), false);
    draw(&mut r, 6);
    let found = kept(&r);
    model(scene, 5).iter().zip(&found).filter(|(c, kept)| **c != kept.confidence()).count()
}

#[test]
fn confidences_are_what_they_must_be() {
    let Some(a) = adapter() else { return };
    let pixels = (PICTURE * PICTURE) as usize;
    let spatial = scene(|s| s.neighbours = 1);
    let most = model(&spatial, 5).into_iter().fold(0.0, f64::max);
    assert_eq!(most, 8.0, "of two pixels, each of its own sample and a history of 3");
    assert_eq!(model(&scene(|s| s.spatial = false), 5), vec![4.0; pixels]);
    let scenes = [
        ("spatial history", spatial.clone()),
        ("temporal history, 3 neighbours", scene(|s| (s.history, s.neighbours) = (History::Temporal, 3))),
        ("no neighbours", scene(|s| s.spatial = false)),
        ("no history", scene(|s| s.temporal = false)),
        ("2 neighbours, farther", scene(|s| (s.neighbours, s.reach) = (2, 2))),
    ];
    for (name, scene) in &scenes {
        assert_eq!(wrong(&a, &standard(), scene), 0, "{name}");
    }
    // Pictures do not tell these: a wrong confidence makes noise, no bias.
    for (what, file, from, to) in [
        ("doubled by merging", "reuse/merge", "kept.confidence = all.total;", "kept.confidence = 2.0 * all.total;"),
        ("lost by merging", "reuse/merge", "kept.confidence = all.total;", "kept.confidence = all.own.confidence;"),
        ("without a cap", "reuse/temporal", "own.confidence += c_old;", "own.confidence += old.confidence;"),
        ("of the history alone", "reuse/temporal", "own.confidence += c_old;", "own.confidence = max(c_old, 1.0);"),
    ] {
        let planted = support::plant(file, from, to);
        assert!(wrong(&a, &planted.source, &spatial) > pixels / 2, "{what} is not seen");
    }
}

#[test]
fn ages_sources_and_weights_are_plausible() {
    let Some(a) = adapter() else { return };
    let scene = scene(|_| {});
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let pixels = f64::from(PICTURE * PICTURE);
    for frames in [1, 7] {
        draw(&mut r, frames);
        let (all, drawn) = (kept(&r), if frames == 1 { 1 } else { 8 });
        let holding: Vec<&Reservoir> = all.iter().filter(|kept| kept.holds()).collect();
        let empty = 1.0 - holding.len() as f64 / pixels;
        assert!((0.2..0.8).contains(&empty), "{empty} of the pixels see no medium");
        assert!(holding.iter().all(|kept| kept.age() < drawn && kept.origin() <= 2), "frame {drawn}");
        assert!(holding.iter().all(|kept| kept.weight().is_finite() && kept.weight() > 0.0));
        let share = |origin| holding.iter().filter(|k| k.origin() == origin).count() as f64 / holding.len() as f64;
        let shares = [0, 1, 2].map(share);
        let old = holding.iter().filter(|kept| kept.age() > 0).count() as f64 / holding.len() as f64;
        if drawn == 1 {
            assert!(shares[1] == 0.0 && old == 0.0 && shares[0] > 0.3 && shares[2] > 0.1, "{shares:?}");
        } else {
            assert!(shares.iter().all(|s| *s > 0.05) && shares[1] > shares[0] && old > 0.5, "{shares:?} {old}");
        }
    }
}

/// How far what the window shows of an overlay is from what is read back.
fn off(r: &mut Renderer, scene: &Scene, overlay: Overlay) -> f64 {
    let mut scene = scene.clone();
    scene.display.overlay = overlay;
    let made = r.update(&scene, (PICTURE, PICTURE), None).expect("an overlay");
    assert!(!made.accumulation && !made.history, "the picture goes on");
    r.resolve();
    let sums = r.sums().expect("a film");
    let look = heat::look(overlay).expect("an overlay");
    let values = (0..sums.sum.len()).filter_map(|p| heat::value(&sums, overlay, p));
    let expected = heat::Range::of(&look, values).expect("something to show");
    let found = r.overlay_range().expect("it was resolved");
    let pairs = [(found.low, expected.low), (found.median, expected.median), (found.high, expected.high)];
    pairs.into_iter().map(|(a, b)| (a - b).abs() / b.abs().max(1e-6)).fold(0.0, f64::max)
}

#[test]
fn views_show_what_pixels_keep() {
    let Some(a) = adapter() else { return };
    for history in [History::Spatial, History::Temporal] {
        let scene = scene(|s| s.history = history);
        let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
        draw(&mut r, 6);
        for overlay in VIEWS {
            let off = off(&mut r, &scene, overlay);
            assert!(off < 1e-5, "{overlay:?}, {history:?}: off by {off}");
        }
        // Nothing but a frame changes them.
        let before = kept(&r);
        let after = kept(&r);
        assert!(before == after && before.iter().all(|kept| kept.confidence() > 0.0));
    }
    for (overlay, from, to) in [
        (Overlay::Confidence, "value = kept.confidence;", "value = kept.confidence + 1.0;"),
        (Overlay::Age, "f32(kept.age), holds", "f32(kept.age) + 1.0, holds"),
        (Overlay::Source, "1.0 + f32(kept.origin)", "f32(kept.origin)"),
        (Overlay::Weight, "kept.weight * kept.aim, holds", "kept.weight, holds"),
    ] {
        let planted = support::plant("film/resolve", from, to);
        let scene = scene(|_| {});
        let mut r = renderer(&a, &planted.source, &scene, Some(cloud_field()), false);
        draw(&mut r, 6);
        assert!(off(&mut r, &scene, overlay) > 0.01, "{to} is not seen");
    }
}

#[test]
fn what_is_not_kept_is_unknown() {
    let Some(a) = adapter() else { return };
    let mut scene = scene(|_| {});
    scene.display.overlay = Overlay::Source;
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    let unknown = |r: &mut Renderer| {
        r.resolve();
        let sums = r.sums().expect("a film");
        assert_eq!(r.overlay_range().is_none(), heat::image(&sums, Overlay::Source).is_none());
        r.overlay_range().is_none()
    };
    assert!(unknown(&mut r) && r.reservoirs().is_none(), "before the first frame");
    draw(&mut r, 2);
    assert!(!unknown(&mut r));
    // Independent samples of the same picture leave what its last frame kept; another picture has none of it.
    r.set_moving(false);
    assert_eq!(r.reuses_now(), Some(false));
    accumulate(&mut r, 4, super::super::WHOLE);
    assert!(!unknown(&mut r));
    r.restart();
    accumulate(&mut r, 4, super::super::WHOLE);
    assert!(unknown(&mut r));
    scene.integrator.mode = Mode::Path;
    r.update(&scene, (PICTURE, PICTURE), None).expect("a mode");
    accumulate(&mut r, 2, super::super::WHOLE);
    assert!(unknown(&mut r) && r.reuses_now().is_none());
}

#[test]
fn a_patch_has_the_reservoirs_of_its_pixels() {
    let Some(a) = adapter() else { return };
    let mut scene = scene(|_| {});
    scene.display.overlay = Overlay::Lookups;
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    draw(&mut r, 2);
    let all = kept(&r);
    for counts in [true, false] {
        r.count_cost(counts).expect("counts");
        let patch = Patch::read(&r.gpu, &r.film, r.reservoirs(), (3, 20), 4).expect("reads");
        for (x, y) in [(0, 16), (3, 20), (7, 23)] {
            let at = patch.place((x, y)).expect("it is in the patch");
            assert_eq!(patch.sums.reservoirs[at], all[(y * PICTURE + x) as usize], "{x}, {y}");
        }
    }
}

#[test]
fn a_dropped_history_begins_anew() {
    let Some(a) = adapter() else { return };
    let scene = scene(|s| s.spatial = false);
    let mut r = renderer(&a, &standard(), &scene, Some(cloud_field()), false);
    draw(&mut r, 3);
    assert!(kept(&r).iter().all(|kept| kept.confidence() == 3.0));
    assert!(r.drop_history());
    assert!(r.progress().samples == 0 && r.reservoirs().is_none());
    draw(&mut r, 1);
    assert!(kept(&r).iter().all(|kept| kept.confidence() == 1.0 && kept.age() == 0));
    let mut path = scene.clone();
    path.integrator.mode = Mode::Path;
    r.update(&path, (PICTURE, PICTURE), None).expect("a mode");
    accumulate(&mut r, 2, super::super::WHOLE);
    assert!(!r.drop_history() && r.progress().samples == 2, "the picture goes on where there is none");
}
