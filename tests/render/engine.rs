//! The driver of the window: from motion to rest, held and limited pictures, and a device that is lost on the way.

use std::sync::Arc;

use nephele::app::engine::Engine;
use nephele::app::lab::{Own, Reference, Share, turns};
use nephele::gpu::device::Gpu;
use nephele::scene::value::Auto;
use nephele::scene::{MajorantKind, Scene, Transmittance};

use super::{
    Picture, SIDE, WHOLE, accumulate, adapter, all_hold, constant, look, one_sees, renderer, same, standard, unit_cube,
};

/// Seconds between frames.
const FRAME: f64 = 0.05;
/// Frames after which a picture of a few samples is done, whatever the adapter; a thread may have to load or compile.
const MOST_FRAMES: u32 = 20_000;
/// Pixels of the viewport.
const VIEWPORT: (u32, u32) = (SIDE, SIDE);

fn scene() -> Scene {
    let mut scene = unit_cube(3.0);
    scene.lights = vec![constant(1.0)];
    look(&mut scene, [0.5, 0.5, 4.0].into(), [0.5; 3].into(), 30.0);
    scene
}

/// An engine with its clock.
struct Driver {
    engine: Engine,
    now: f64,
    held: bool,
    /// Scales of the pictures that came on screen, and their samples.
    shown: Vec<(f64, u32)>,
}

impl Driver {
    fn new(gpu: Arc<Gpu>, limit: u32) -> Driver {
        let mut engine = Engine::new(gpu);
        engine.sample_limit = limit;
        Driver { engine, now: 0.0, held: false, shown: Vec::new() }
    }

    /// One frame; whether more is to come.
    fn frame(&mut self, scene: &Scene) -> bool {
        self.now += FRAME;
        let outcome = self.engine.frame(scene, VIEWPORT, self.now, self.held, false);
        assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
        if let Some(renderer) = self.engine.renderer.as_ref().filter(|_| self.engine.has_picture()) {
            let scale = f64::from(renderer.picture().width()) / f64::from(VIEWPORT.0);
            if self.shown.last().is_none_or(|(s, _)| *s != scale) {
                self.shown.push((scale, self.engine.figures.samples));
            }
        }
        outcome.busy
    }

    /// Frames until nothing is left to do.
    fn rest(&mut self, scene: &Scene) {
        for _ in 0..MOST_FRAMES {
            if !self.frame(scene) {
                return;
            }
            std::thread::sleep(std::time::Duration::from_micros(200));
        }
        panic!("the picture never ends: {:?}", self.engine.figures);
    }

    fn sums(&mut self) -> nephele::render::film::Sums {
        self.engine.sums().unwrap_or_else(|e| panic!("{e}")).expect("a picture")
    }
}

#[test]
fn the_picture_at_rest_gets_finer_and_ends_as_if_drawn_at_once() {
    let Some(a) = adapter() else { return };
    let scene = scene();
    let mut driver = Driver::new(a.gpu.clone(), 40);
    driver.rest(&scene);
    let scales: Vec<f64> = driver.shown.iter().map(|s| s.0).collect();
    assert_eq!(scales, [0.125, 0.25, 0.5, 1.0]);
    let samples: Vec<u32> = driver.shown.iter().map(|s| s.1).collect();
    assert_eq!(samples, [1, 4, 4, 4], "a finer picture comes when it has as many samples as the coarser one");
    let mut once = renderer(&a, &standard(), &scene, None, false);
    accumulate(&mut once, 40, WHOLE);
    assert_eq!(driver.sums(), once.film.read(&a.gpu).expect("sums"), "no sample is lost, none is drawn twice");
    assert!(!driver.frame(&scene), "nothing is drawn any more");
}

#[test]
fn a_short_or_held_picture_still_gets_to_full_scale() {
    let Some(a) = adapter() else { return };
    let mut scene = scene();
    let mut driver = Driver::new(a.gpu.clone(), 1);
    driver.rest(&scene);
    assert_eq!((driver.engine.figures.scale, driver.engine.figures.samples), (1.0, 1));

    driver.engine.sample_limit = 0;
    driver.held = true;
    let before = driver.sums();
    driver.rest(&scene);
    assert_eq!(driver.sums(), before, "held: no sample more");
    scene.camera.fov_y = 20.0;
    driver.rest(&scene);
    assert_eq!(driver.engine.figures.scale, 1.0);
    assert_ne!(driver.sums(), before, "a change is seen though the picture is held");
}

#[test]
fn a_restart_from_outside_is_seen_at_once() {
    let Some(a) = adapter() else { return };
    let scene = scene();
    let mut driver = Driver::new(a.gpu.clone(), 100);
    driver.engine.traced = true;
    driver.rest(&scene);
    assert!(driver.engine.figures.error.is_some() && !driver.engine.trace.points.is_empty());
    driver.engine.renderer.as_mut().expect("drawn").restart();
    assert!(driver.frame(&scene), "it begins again");
    assert!(driver.engine.figures.error.is_none() && driver.engine.trace.points.is_empty(), "and so do its figures");
    driver.rest(&scene);
    assert_eq!(driver.engine.figures.samples, 100);
}

#[test]
fn a_lost_device_is_replaced() {
    let Some(_turn) = adapter() else { return };
    let own = || Arc::new(Gpu::headless().unwrap_or_else(|e| panic!("{e}")));
    let scene = Scene::default();
    let mut cloud = scene.clone();
    cloud.volume.resolution = 16;
    cloud.medium.density_scale = Auto::Is(20.0);

    let gpu = own();
    let mut driver = Driver::new(gpu.clone(), 6);
    // While the volume is still being loaded.
    driver.frame(&cloud);
    gpu.lose();
    assert!(gpu.is_lost());
    assert!(!driver.frame(&cloud), "nothing is drawn on a lost device");
    let gpu = own();
    driver.engine.recover(gpu.clone()).unwrap_or_else(|e| panic!("{e}"));
    driver.rest(&cloud);
    let whole = driver.sums();

    // In the middle of a picture, with one in memory: the engine reads it back from time to time.
    driver.engine.sample_limit = 0;
    for _ in 0..60 {
        driver.frame(&cloud);
    }
    gpu.lose();
    driver.frame(&cloud);
    assert!(driver.engine.sums().is_err());
    driver.engine.recover(own()).unwrap_or_else(|e| panic!("{e}"));
    assert!(driver.engine.has_picture(), "the last picture stays");
    let picture = driver.engine.renderer.as_ref().expect("made anew").picture();
    assert_eq!((picture.width(), picture.height()), VIEWPORT);
    driver.engine.gpu.wait().unwrap_or_else(|e| panic!("{e}"));
    driver.engine.sample_limit = 6;
    driver.rest(&cloud);
    assert_eq!(driver.sums(), whole, "the same picture as before the loss");
}

/// Seconds between frames of the lab: each may be a point of the trace.
const LAB_FRAME: f64 = 1.0;

/// Two engines under the lab's rules, B beside A.
struct Pair {
    a: Engine,
    b: Engine,
    share: Share,
    now: f64,
    /// The greatest lead of A over B, samples and seconds, once both are whole.
    lead: (u32, f64),
}

impl Pair {
    fn new(gpu: &Arc<Gpu>, share: Share, limit: u32) -> Pair {
        let engine = || {
            let mut engine = Engine::new(gpu.clone());
            (engine.sample_limit, engine.traced) = (limit, true);
            engine
        };
        Pair { a: engine(), b: engine(), share, now: 0.0, lead: (0, 0.0) }
    }

    /// Frames until both are done.
    fn rest(&mut self, a: &Scene, b: &Scene) {
        for _ in 0..MOST_FRAMES {
            self.now += LAB_FRAME;
            let standings = [self.a.standing(), self.b.standing()];
            if standings.iter().all(|s| s.whole) {
                let [a, b] = standings;
                self.lead.0 = self.lead.0.max(a.samples.saturating_sub(b.samples));
                self.lead.1 = self.lead.1.max(a.seconds - b.seconds);
            }
            [self.a.turn, self.b.turn] = turns(self.share, standings[0], standings[1]);
            let mut busy = false;
            self.b.follow(&self.a);
            for (engine, scene) in [(&mut self.a, a), (&mut self.b, b)] {
                let outcome = engine.frame(scene, VIEWPORT, self.now, false, false);
                assert!(outcome.errors.is_empty(), "{:?}", outcome.errors);
                busy |= outcome.busy;
            }
            if !busy {
                return;
            }
            std::thread::sleep(std::time::Duration::from_micros(200));
        }
        panic!("the pictures never end: {:?} {:?}", self.a.figures, self.b.figures);
    }

    fn pictures(&mut self) -> [Picture; 2] {
        [&mut self.a, &mut self.b].map(|engine| Picture {
            sums: engine.sums().unwrap_or_else(|e| panic!("{e}")).expect("a picture"),
            counters: engine.figures.counters,
        })
    }
}

/// A cloud, and the same with other estimators and another seed.
fn sides() -> [Scene; 2] {
    let mut a = scene();
    a.volume = nephele::scene::Volume { resolution: 16, ..Default::default() };
    look(&mut a, [0.0, 0.3, 4.0].into(), [0.0, 0.3, 0.0].into(), 35.0);
    a.medium.density_scale = Auto::Is(8.0);
    a.tracking.majorant = MajorantKind::Global;
    let mut own = Own::beside(&a);
    own.tracking.transmittance = Transmittance::ResidualRatio;
    let b = own.beside_shared(&a);
    [a, b]
}

#[test]
fn the_sides_of_the_lab_meet_and_a_planted_difference_is_seen() {
    let Some(adapter) = adapter() else { return };
    let [a, b] = sides();
    let mut pair = Pair::new(&adapter.gpu, Share::Samples, 256);
    pair.rest(&a, &b);
    assert_eq!((pair.a.figures.samples, pair.b.figures.samples), (256, 256));
    let renderers = [&pair.a, &pair.b].map(|e| e.renderer.as_ref().expect("drawn"));
    assert!(Arc::ptr_eq(&renderers[0].medium.field, &renderers[1].medium.field), "one volume in memory");
    let [left, right] = pair.pictures();
    all_hold(&same("two methods", &left, &right));
    let lookups = [&pair.a, &pair.b].map(|e| e.figures.counters.lookups as f64 / e.figures.paths);
    assert!(lookups[0] > 1.3 * lookups[1] && lookups[1] > 0.0, "one majorant for all costs lookups: {lookups:?}");

    // B again, with what no unbiased method may do.
    let mut wrong = b.clone();
    wrong.medium.albedo.0 = [0.95; 3];
    pair.rest(&a, &wrong);
    let [left, right] = pair.pictures();
    one_sees("an albedo that is a little lower", &same("A and a wrong B", &left, &right));
}

#[test]
fn points_of_the_trace_follow_the_picture() {
    let Some(adapter) = adapter() else { return };
    let [a, b] = sides();
    let mut pair = Pair::new(&adapter.gpu, Share::Samples, 1024);
    pair.rest(&a, &b);
    let trace = pair.a.trace.clone();
    assert!(trace.points.len() >= 4, "{trace:?}");
    assert!(trace.points.windows(2).all(|p| p[1].samples > p[0].samples && p[1].seconds > p[0].seconds));
    for point in &trace.points {
        let law = point.error * f64::from(point.samples).sqrt();
        let last = trace.points[trace.points.len() - 1];
        let ratio = law / (last.error * f64::from(last.samples).sqrt());
        assert!((0.8..1.25).contains(&ratio), "error falls as the root of samples: {trace:?}");
        let lookups = point.lookups / f64::from(point.samples);
        let mean = pair.a.figures.counters.lookups as f64 / pair.a.figures.paths;
        assert!((lookups / mean - 1.0).abs() < 0.1, "lookups of a sample: {lookups} for {mean}");
    }

    let sums = pair.a.sums().unwrap_or_else(|e| panic!("{e}")).expect("a picture");
    let pixels = (0..sums.sum.len()).map(|p| sums.mean(p).map(|x| x as f32)).collect();
    let reference = Arc::new(Reference { name: String::new(), size: VIEWPORT, pixels });
    (pair.a.reference, pair.b.reference) = (Some(reference.clone()), Some(reference));
    let mut other = a.clone();
    other.integrator.seed = 7;
    let mut wrong = b.clone();
    wrong.medium.albedo.0 = [0.8; 3];
    pair.rest(&other, &wrong);
    let last = |engine: &Engine| engine.trace.points.last().and_then(|p| p.rel_mse).expect("against the reference");
    assert!(last(&pair.a) < 0.3 * last(&pair.b), "{} and {}", last(&pair.a), last(&pair.b));
    assert!(pair.a.reference.as_ref().is_some_and(|r| r.rel_mse(VIEWPORT, |p| sums.mean(p)).is_some_and(|e| e < 1e-9)));
}
