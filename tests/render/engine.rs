//! The driver of the window: from motion to rest, held and limited pictures, and a device that is lost on the way.

use std::sync::Arc;

use nephele::app::engine::Engine;
use nephele::gpu::device::Gpu;
use nephele::scene::Scene;
use nephele::scene::value::Auto;

use super::{SIDE, WHOLE, accumulate, adapter, constant, look, renderer, standard, unit_cube};

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

    fn sums(&self) -> nephele::render::film::Sums {
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
    driver.rest(&scene);
    driver.engine.renderer.as_mut().expect("drawn").restart();
    let seconds = driver.engine.figures.seconds;
    assert!(driver.frame(&scene), "it begins again");
    assert!(driver.engine.figures.seconds < seconds, "and so do its figures");
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
