//! What each pixel costs: the same events as the counters', from when an overlay asks for them, without touching the
//! picture.

use super::*;
use nephele::render::film::{Aov, Cost};
use nephele::render::heat;
use nephele::render::peek::Patch;
use nephele::scene::{FreeFlight, Overlay, Transmittance};

/// A cloud of which part is sky, in a picture that is no whole number of tiles, with shadow rays and null collisions.
fn scene() -> Scene {
    let mut scene = Scene::default();
    scene.volume.resolution = 32;
    scene.integrator.max_bounces = Limit::AtMost(8);
    (scene.film.width, scene.film.height) = (70, 21);
    scene
}

fn with(overlay: Overlay) -> Scene {
    let mut scene = scene();
    scene.display.overlay = overlay;
    scene
}

/// What was counted of all pixels, beside the counters, and what the picture is.
fn counted(a: &Adapter, source: &Source, scene: &Scene) -> (Vec<(&'static str, u64, u64)>, Sums) {
    let mut r = renderer(a, source, scene, None, false);
    r.prepare().unwrap_or_else(|e| panic!("{e}"));
    accumulate(&mut r, 9, Work { samples: 4, groups: 7 });
    let sums = r.film.read(&r.gpu).expect("a film");
    let c = r.film.count(&r.gpu).expect("counters");
    let sum = |of: fn(&Cost) -> u32| sums.cost.iter().map(|c| u64::from(of(c))).sum::<u64>();
    let pairs = vec![
        ("lookups", sum(|c| c.lookups), c.lookups),
        ("steps", sum(|c| c.steps), c.cell_steps),
        ("nulls", sum(|c| c.nulls), c.null_collisions),
        ("reals", sum(|c| c.reals), c.real_collisions),
        ("shadows", sum(|c| c.shadows), c.shadow_rays),
        ("violations", sum(|c| c.violations), c.violations),
        ("samples", sum(|c| c.samples), 9 * 70 * 21),
    ];
    (pairs, sums)
}

fn equal(pairs: &[(&'static str, u64, u64)]) -> bool {
    pairs.iter().all(|(_, cost, counter)| cost == counter)
}

#[test]
fn costs_add_up_to_the_counters_and_leave_the_picture_alone() {
    let Some(a) = adapter() else { return };
    let (_, plain) = counted(&a, &standard(), &scene());
    assert!(plain.cost.is_empty(), "nothing is counted where nobody asks");
    let (pairs, sums) = counted(&a, &standard(), &with(Overlay::Lookups));
    assert!(equal(&pairs), "{pairs:?}");
    assert!(pairs[..5].iter().all(|(_, cost, _)| *cost > 100), "{pairs:?}");
    assert!(sums.sum == plain.sum && sums.square == plain.square, "counting changes no bit of the picture");
    assert!(sums.cost.iter().all(|c| c.samples == 9));
    // Bounds that do not bound are seen, and where.
    let mut loose = with(Overlay::Lookups);
    loose.tracking.free_flight = FreeFlight::WeightedDelta;
    loose.tracking.transmittance = Transmittance::Ratio;
    loose.tracking.majorant_factor = 0.5;
    let (pairs, _) = counted(&a, &standard(), &loose);
    assert!(equal(&pairs) && pairs[5].1 > 100, "{pairs:?}");
    for (from, to) in [
        ("film_cost[2u * pixel] += vec4u(count.lookups,", "film_cost[2u * pixel] += vec4u(count.steps,"),
        ("film_cost[2u * pixel] += vec4u(", "film_cost[2u * pixel] = vec4u("),
        ("count.nulls, reals);", "count.nulls, bounces);"),
        ("u32(film.samples - known));", "next);"),
    ] {
        let (pairs, _) = counted(&a, &plant("integrate/path", from, to).source, &with(Overlay::Lookups));
        assert!(!equal(&pairs), "{to} is not seen");
    }
}

#[test]
fn overlays_do_not_restart_and_count_from_where_they_begin() {
    let Some(a) = adapter() else { return };
    let size = (70, 21);
    let mut whole = renderer(&a, &standard(), &scene(), None, false);
    accumulate(&mut whole, 12, WHOLE);
    let expected = whole.film.read(&whole.gpu).expect("a film");

    let mut r = renderer(&a, &standard(), &scene(), None, false);
    accumulate(&mut r, 4, WHOLE);
    let made = r.update(&with(Overlay::Steps), size, None).expect("an overlay");
    assert!(!made.accumulation && r.progress().samples == 4, "the picture goes on");
    assert!(r.poll().expect("the old pipeline is there"), "and does not wait for the shader that counts");
    assert!(!r.film.read(&r.gpu).expect("a film").cost.iter().any(|c| c.samples > 0));
    // The pipeline that counts comes when it is built.
    r.prepare().expect("builds");
    accumulate(&mut r, 10, Work { samples: 3, groups: 5 });
    let cost = r.film.read(&r.gpu).expect("a film").cost;
    assert!(cost.iter().all(|c| c.samples == 6), "counted from sample 4 on");
    // From one overlay to the next nothing is lost; with the last it ends.
    assert!(!r.update(&with(Overlay::NullShare), size, None).expect("another").accumulation);
    assert!(r.film.read(&r.gpu).expect("a film").cost == cost);
    assert!(!r.update(&with(Overlay::Samples), size, None).expect("another").accumulation);
    assert!(!r.film.counts_cost);
    accumulate(&mut r, 12, WHOLE);
    let sums = r.film.read(&r.gpu).expect("a film");
    assert!(sums.sum == expected.sum && sums.square == expected.square, "the same bits as without overlays");
    // The inspector asks for costs whatever is shown; a new picture counts from nothing.
    r.count_cost(true).expect("counts");
    r.prepare().expect("builds");
    r.restart();
    accumulate(&mut r, 2, WHOLE);
    assert!(r.film.read(&r.gpu).expect("a film").cost.iter().all(|c| c.samples == 2));
}

/// What the shader resolves of an overlay, at the pixels that it keeps, and what the sums say there.
fn resolved(a: &Adapter, source: &Source, overlay: Overlay) -> (f64, heat::Range) {
    let mut r = renderer(a, source, &with(overlay), None, false);
    r.prepare().expect("builds");
    accumulate(&mut r, 8, WHOLE);
    r.resolve();
    let sums = r.film.read(&r.gpu).expect("a film");
    let look = heat::look(overlay).expect("an overlay");
    // The first pixel of each of 64 × 21 blocks.
    let first = |x: u32| x == 0 || (x - 1) * 64 / 70 != x * 64 / 70;
    let kept = (0..70 * 21).filter(|p| first(p % 70)).map(|p| heat::value(&sums, overlay, p as usize));
    let expected = heat::Range::of(&look, kept.flatten()).expect("something to show");
    let found = r.overlay_range().expect("it was resolved");
    let off = |a: f64, b: f64| (a - b).abs() / b.abs().max(1e-9);
    let high = off(found.high, expected.high);
    // Even pixels have no noise but that of 32-bit sums.
    let rest = if overlay == Overlay::Noise {
        0.0
    } else {
        off(found.low, expected.low).max(off(found.median, expected.median))
    };
    (rest.max(high), found)
}

#[test]
fn the_window_shows_what_the_sums_say() {
    let Some(a) = adapter() else { return };
    let of_film = |o: &Overlay| heat::look(*o).is_some_and(|look| look.needs != heat::Needs::Reservoirs);
    for overlay in Overlay::ALL.iter().copied().filter(of_film).filter(|o| *o != Overlay::NullShare) {
        let (off, range) = resolved(&a, &standard(), overlay);
        let within = if overlay == Overlay::Noise { 1e-2 } else { 1e-4 };
        assert!(off < within, "{overlay:?}: off by {off}");
        assert!(range.low <= range.median && range.median <= range.high && range.low < range.high, "{range:?}");
    }
    let (_, nulls) = resolved(&a, &standard(), Overlay::NullShare);
    assert!(nulls.low == 0.0 && nulls.high == 1.0 && (0.1..0.9).contains(&nulls.median), "{nulls:?}");
    for (overlay, from, to) in [
        (Overlay::Lookups, "return f32(near.x) / n;", "return f32(near.x);"),
        (Overlay::Steps, "return f32(near.y) / n;", "return f32(near.x) / n;"),
        (Overlay::PathLength, "return f32(near.w) / n;", "return f32(near.z) / n;"),
        (Overlay::Noise, "/ max(n - 1.0, 1.0);", "/ n;"),
    ] {
        let planted = plant("film/resolve", from, to);
        assert!(resolved(&a, &planted.source, overlay).0 > 0.03, "{to} is not seen");
    }
}

#[test]
fn layers_and_overlays_of_files_show_costs() {
    let Some(a) = adapter() else { return };
    let (pairs, sums) = counted(&a, &standard(), &with(Overlay::Lookups));
    let image = sums.image(&[Aov::Lookups, Aov::Steps], [1.0; 3], None);
    for (name, (_, total, _)) in ["lookups", "steps"].into_iter().zip(&pairs) {
        let layer = image.layer(name).expect("a layer");
        let sum: f64 = layer.data.iter().map(|x| f64::from(*x)).sum();
        assert!((sum * 9.0 / *total as f64 - 1.0).abs() < 1e-5, "{name}: {sum} per sample");
    }
    let (picture, range) = heat::image(&sums, Overlay::Lookups).expect("an overlay");
    let green = |p: usize| picture.layers[0].data[4 * p + 1];
    let most = (0..sums.cost.len()).max_by_key(|p| sums.cost[*p].lookups).expect("pixels");
    let least = (0..sums.cost.len()).min_by_key(|p| sums.cost[*p].lookups).expect("pixels");
    assert!(green(most) > 0.98 && green(least) < 0.01 && range.high > range.low, "{} {}", green(most), green(least));
    assert!(heat::image(&sums, Overlay::None).is_none());
}

#[test]
fn a_patch_is_a_cut_of_the_film() {
    let Some(a) = adapter() else { return };
    let mut r = renderer(&a, &standard(), &with(Overlay::Lookups), None, true);
    r.prepare().expect("builds");
    // Beyond a block, so that totals count.
    accumulate(&mut r, nephele::render::film::BLOCK + 3, WHOLE);
    let sums = r.film.read(&r.gpu).expect("a film");
    for (centre, corner, size) in [((30, 10), (26, 6), (9, 9)), ((0, 20), (0, 16), (5, 5)), ((69, 0), (65, 0), (5, 5))]
    {
        let patch = Patch::read(&r.gpu, &r.film, None, centre, 4).expect("reads");
        assert_eq!((patch.corner, (patch.sums.width, patch.sums.height)), (corner, size));
        for y in 0..21 {
            for x in 0..70 {
                let Some(at) = patch.place((x, y)) else { continue };
                let p = (y * 70 + x) as usize;
                assert_eq!(patch.sums.sum[at], sums.sum[p], "{x}, {y}");
                assert_eq!(patch.sums.square[at], sums.square[p]);
                assert_eq!(patch.sums.extra[2 * at..2 * at + 2], sums.extra[2 * p..2 * p + 2]);
                assert_eq!(patch.sums.cost[at], sums.cost[p]);
            }
        }
        assert_eq!(patch.place((99, 0)), None);
        assert!(patch.place(centre).is_some());
    }
}
