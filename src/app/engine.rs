//! Drives the renderer for the window: loads volumes on a thread, chooses resolution and work, keeps the figures, goes on
//! when the device is lost.

use std::sync::{Arc, mpsc};
use std::time::Instant;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::render::field::Field;
use crate::render::film::{Counters, Sums};
use crate::render::medium::Medium;
use crate::render::pace::{LEAST_SCALE, Pace, Stage, moving_scale, rest_scale, takes_over, wanted};
use crate::render::{Renderer, Work};
use crate::scene::row::Effect;
use crate::scene::{Scene, Volume};

use super::lab::trace::{Point, Trace};
use super::lab::{Reference, Standing, Turn};

/// After this time without a change the picture goes on to full resolution, seconds.
const SETTLE: f64 = 0.2;
/// Frame time to reach on a software adapter and on a device, seconds.
const TARGET_SOFTWARE: f64 = 0.1;
const TARGET_GPU: f64 = 1.0 / 60.0;
/// The tracer gets at least this share of a frame.
const LEAST_SHARE: f64 = 0.3;
/// Weight of the newest measurement in running means.
const NEWEST: f64 = 0.2;
/// Seconds between looks at the counters, and at the film for the error.
const COUNT_EVERY: f64 = 0.25;
const ERROR_EVERY: f64 = 1.5;

/// What the status bar and the panels show of the picture under way.
#[derive(Clone, Debug, Default)]
pub struct Figures {
    /// Samples that every pixel has.
    pub samples: u32,
    /// Seconds of drawing since the picture began.
    pub seconds: f64,
    /// Paths a second.
    pub paths_per_second: f64,
    /// Linear scale of the picture on screen; a coarser one stays until the one under way is as good.
    pub scale: f64,
    /// Relative error, where it is known.
    pub error: Option<f64>,
    /// Events since the picture began, up to the last look at them.
    pub counters: Counters,
    /// Paths that they belong to.
    pub paths: f64,
}

impl Figures {
    /// Those of a picture that begins.
    fn begun(&self) -> Figures {
        Figures { scale: self.scale, paths_per_second: self.paths_per_second, ..Figures::default() }
    }
}

/// A volume that a thread loads.
struct Loading {
    volume: Volume,
    since: Instant,
    result: mpsc::Receiver<Result<Medium>>,
}

/// A picture in memory, for the time after the device is lost: as a film of one sample.
struct Kept {
    size: (u32, u32),
    sum: Vec<[f32; 4]>,
}

/// The renderer and what drives it.
pub struct Engine {
    /// The device.
    pub gpu: Arc<Gpu>,
    /// The renderer, once a volume is there.
    pub renderer: Option<Renderer>,
    /// Figures for people.
    pub figures: Figures,
    /// Whether resolution falls while things move.
    pub dynamic: bool,
    /// Samples after which the picture is done; 0: never.
    pub sample_limit: u32,
    /// What it may do in a frame; all of it but beside another engine.
    pub turn: Turn,
    /// How the picture under way converges.
    pub trace: Trace,
    /// Points of the trace are made as often as is worth while, rather than with the other figures.
    pub traced: bool,
    /// What errors are measured against.
    pub reference: Option<Arc<Reference>>,
    /// A volume that another engine has in memory.
    shared: Option<(Volume, Arc<Field>)>,
    loading: Option<Loading>,
    failed: Option<Volume>,
    /// The volume's file shall be read again.
    stale: bool,
    loaded: Option<Volume>,
    pace: Pace,
    /// Scale of the picture under way.
    scale: f64,
    /// What is on screen of the scene as it is; `None`: only what was there before the last change.
    shown: Option<Stage>,
    /// Samples of the picture under way after the last frame; fewer mean that someone restarted it.
    drawn: u32,
    /// Paths drawn since the picture began.
    paths: f64,
    kept: Option<Kept>,
    size: (u32, u32),
    last_change: f64,
    overhead: f64,
    counted: f64,
    error_at: f64,
    first_picture: bool,
}

/// What a frame brought.
#[derive(Default)]
pub struct Outcome {
    /// More work is left.
    pub busy: bool,
    /// A volume was loaded, with what was noticed.
    pub loaded: bool,
    /// What went wrong.
    pub errors: Vec<Error>,
    /// The scene must go back to this volume.
    pub restore_volume: Option<Volume>,
}

impl Engine {
    /// An engine without a volume yet.
    pub fn new(gpu: Arc<Gpu>) -> Engine {
        Engine {
            renderer: None,
            figures: Figures { scale: 1.0, ..Figures::default() },
            dynamic: true,
            sample_limit: 0,
            turn: Turn::ALL,
            trace: Trace::default(),
            traced: false,
            reference: None,
            shared: None,
            loading: None,
            failed: None,
            stale: false,
            loaded: None,
            // Its budget is set before every piece of work.
            pace: Pace::new(0.0),
            scale: LEAST_SCALE,
            shown: None,
            drawn: 0,
            paths: 0.0,
            kept: None,
            size: (0, 0),
            last_change: f64::NEG_INFINITY,
            overhead: 0.0,
            counted: f64::NEG_INFINITY,
            error_at: f64::NEG_INFINITY,
            first_picture: false,
            gpu,
        }
    }

    /// Whether a volume is being read, and since when.
    pub fn loading(&self) -> Option<f64> {
        self.loading.as_ref().map(|l| l.since.elapsed().as_secs_f64())
    }

    /// Whether the picture has appeared at least once.
    pub fn has_picture(&self) -> bool {
        self.first_picture
    }

    /// Whether the scene as it is is on screen at full scale.
    pub fn is_whole(&self) -> bool {
        self.shown.is_some_and(Stage::is_whole)
    }

    /// Where its picture stands.
    pub fn standing(&self) -> Standing {
        let samples = self.renderer.as_ref().map_or(0, |r| r.progress().samples);
        Standing { samples, seconds: self.figures.seconds, whole: self.scale == 1.0 && self.is_whole() }
    }

    /// The volume that is in the picture; the scene may already name another.
    pub fn volume(&self) -> Option<&Volume> {
        self.renderer.as_ref().map(|r| &r.scene.volume)
    }

    /// Takes the volume that `other` has in memory rather than reading its file, now and when `other` has a new one.
    pub fn follow(&mut self, other: &Engine) {
        let (Some(volume), Some(renderer)) = (&other.loaded, &other.renderer) else { return };
        let field = &renderer.medium.field;
        let same = self.shared.as_ref().is_some_and(|(_, mine)| Arc::ptr_eq(mine, field));
        if !same {
            self.shared = Some((volume.clone(), field.clone()));
            self.stale |= self.renderer.is_some() || self.loading.is_some();
        }
    }

    /// Reads the volume of the scene again; the old one stays until then.
    pub fn reload(&mut self) {
        self.stale = true;
    }

    /// Notes what a frame took outside the tracer, seconds.
    pub fn note_overhead(&mut self, seconds: f64) {
        self.overhead += NEWEST * (seconds - self.overhead);
    }

    /// Seconds that the tracer may take of a frame while things move; at rest it gets at least half of the time, however
    /// slow the rest of a frame is.
    fn budget(&self) -> f64 {
        let target = if self.gpu.is_software() { TARGET_SOFTWARE } else { TARGET_GPU };
        (target - self.overhead).max(target * LEAST_SHARE) * self.turn.share
    }

    /// Draws for one frame of the window: `viewport` in pixels, `now` in seconds. `held`: nothing is drawn but what a
    /// change asks for. `moving`: treat the scene as changing (the benchmark).
    pub fn frame(&mut self, scene: &Scene, viewport: (u32, u32), now: f64, held: bool, moving: bool) -> Outcome {
        let mut outcome = Outcome::default();
        if self.gpu.is_lost() {
            // The window sees to it.
            return outcome;
        }
        let medium = self.poll_loading(scene, &mut outcome);
        // Until new data is there, the old volume stays in the picture.
        let mut shown = scene.clone();
        match (&medium, &self.loaded) {
            (None, Some(loaded)) => shown.volume = Volume { to_world: scene.volume.to_world, ..loaded.clone() },
            (None, None) => return Outcome { busy: self.loading.is_some(), ..outcome },
            (Some(_), _) => {}
        }
        shown.film.width = viewport.0.max(1);
        shown.film.height = viewport.1.max(1);
        if let Err(e) = self.advance(&shown, medium, now, held, moving, &mut outcome) {
            outcome.errors.push(e);
        }
        outcome.errors.retain(|e| e.code != Code::DeviceLost);
        outcome
    }

    /// The medium of a load that has finished; begins a load where the scene names another volume.
    fn poll_loading(&mut self, scene: &Scene, outcome: &mut Outcome) -> Option<Medium> {
        let mut medium = None;
        if let Some(loading) = &self.loading {
            match loading.result.try_recv() {
                Err(mpsc::TryRecvError::Empty) => outcome.busy = true,
                Err(mpsc::TryRecvError::Disconnected) => {
                    outcome.errors.push(Error::new(Code::Failed, "The volume's reader stopped."));
                    self.failed = self.loading.take().map(|l| l.volume);
                }
                Ok(result) => {
                    let volume = self.loading.take().map(|l| l.volume);
                    match result {
                        Ok(m) => {
                            self.loaded = volume;
                            outcome.loaded = true;
                            medium = Some(m);
                        }
                        Err(e) => {
                            outcome.errors.push(e);
                            outcome.restore_volume = self.loaded.clone();
                            self.failed = volume;
                        }
                    }
                }
            }
        }
        let same = |other: &Option<Volume>| other.as_ref().is_some_and(|v| same_data(v, &scene.volume));
        if self.loading.is_none() && (self.stale || !same(&self.loaded) && !same(&self.failed)) {
            self.stale = false;
            let (send, result) = mpsc::channel();
            let (gpu, wanted) = (self.gpu.clone(), scene.clone());
            let shared = self.shared.as_ref().filter(|(volume, _)| same_data(volume, &wanted.volume));
            let shared = shared.map(|(_, field)| field.clone());
            std::thread::spawn(move || {
                let field = shared.map_or_else(|| Field::load(&wanted.volume).map(Arc::new), Ok);
                let medium = field.and_then(|f| Medium::new(&gpu, f, &wanted));
                // Nobody may want it any more.
                let _ = send.send(medium);
            });
            self.loading = Some(Loading { volume: scene.volume.clone(), since: Instant::now(), result });
            outcome.busy = true;
        }
        medium
    }

    fn advance(
        &mut self,
        scene: &Scene,
        medium: Option<Medium>,
        now: f64,
        held: bool,
        moving: bool,
        outcome: &mut Outcome,
    ) -> Result<()> {
        let budget = self.budget();
        let renderer = match &mut self.renderer {
            Some(r) => r,
            none => {
                let Some(medium) = medium else { return Ok(()) };
                let renderer = Renderer::new(self.gpu.clone(), Source::standard(), scene, medium, (1, 1), false)?;
                self.last_change = now;
                *none = Some(renderer);
                outcome.busy = true;
                return Ok(());
            }
        };
        let changes = scene.changes(&renderer.scene);
        let resized = self.size != (scene.film.width, scene.film.height);
        let changed = changes.accumulation || medium.is_some() || resized || moving;
        if changed {
            self.last_change = now;
        }
        let restarted = renderer.progress().samples < self.drawn;
        if changed || restarted {
            self.shown = None;
        }
        self.size = (scene.film.width, scene.film.height);
        let old_size = renderer.size();
        let pixels = |size: (u32, u32)| f64::from(size.0) * f64::from(size.1);
        let preview = self.dynamic && now - self.last_change < SETTLE || moving;
        let scale = if preview && changed {
            moving_scale(self.scale, pixels(self.size), self.pace.rate().unwrap_or(0.0) * pixels(old_size) * budget)
        } else if preview {
            self.scale
        } else if self.dynamic {
            rest_scale(Stage { scale: self.scale, samples: renderer.progress().samples }, self.sample_limit)
        } else {
            1.0
        };
        let size = scaled(self.size, scale);
        let new_overlay = scene.display.overlay != renderer.scene.display.overlay;
        let made = renderer.update(scene, size, medium)?;
        self.scale = scale;
        self.pace.rescale(pixels(size) / pixels(old_size));
        if made.accumulation || restarted {
            self.figures = self.figures.begun();
            (self.paths, self.trace) = (0.0, Trace::default());
            self.error_at = now;
        }
        self.drawn = renderer.progress().samples;
        if !renderer.poll()? {
            outcome.busy = true;
            return Ok(());
        }
        let progress = renderer.progress();
        let goal = wanted(scale, self.sample_limit);
        let enough = progress.samples >= goal;
        let done = enough && scale == 1.0;
        // A held picture goes on until all of the last change is seen.
        let rests = (held || !self.turn.draws) && self.shown.is_some_and(Stage::is_whole);
        outcome.busy |= !done && !rests;
        // No further than its turn allows, but a pass that has begun is ended.
        let goal = goal.min(self.turn.most.max(progress.samples));
        if !enough && !rests && (progress.samples < goal || progress.pass > 0) {
            let before = Instant::now();
            let tiles = renderer.tiles();
            // Frames in motion keep their paths from one to the next.
            renderer.set_moving(preview);
            let submitted = if preview {
                // A whole pass: every pixel shows the newest camera.
                renderer.submit(Work { samples: 1, groups: u32::MAX })?
            } else {
                self.pace.budget = budget.max(self.overhead * self.turn.share);
                renderer.submit(self.pace.next(progress, goal - progress.samples, tiles))?
            };
            self.gpu.wait()?;
            let seconds = before.elapsed().as_secs_f64();
            self.pace.note(submitted, seconds);
            self.note_work(submitted * pixels(size), seconds, now)?;
        }
        self.show(done, new_overlay);
        Ok(())
    }

    /// Puts the picture under way on screen where that is an improvement, and where there is no way round it: it is
    /// `done`, or another overlay is wanted, which a coarser picture from before cannot show.
    fn show(&mut self, done: bool, new_overlay: bool) {
        let Some(renderer) = &mut self.renderer else { return };
        let progress = renderer.progress();
        let newer = Stage { scale: self.scale, samples: progress.samples * renderer.worth() };
        self.drawn = progress.samples;
        if new_overlay {
            self.shown = None;
        }
        let whole = progress.pass == 0 || new_overlay;
        let better = self.shown.is_none_or(|s| s != newer && (done || takes_over(s, newer)));
        if newer.samples > 0 && whole && better {
            renderer.resolve();
            self.shown = Some(newer);
            self.figures.scale = newer.scale;
            self.first_picture = true;
        }
    }

    /// Books finished work.
    fn note_work(&mut self, paths: f64, seconds: f64, now: f64) -> Result<()> {
        let Some(renderer) = &mut self.renderer else { return Ok(()) };
        let figures = &mut self.figures;
        figures.seconds += seconds;
        self.paths += paths;
        let speed = paths / seconds.max(1e-6);
        let weight = if figures.paths_per_second == 0.0 { 1.0 } else { NEWEST };
        figures.paths_per_second += weight * (speed - figures.paths_per_second);
        let progress = renderer.progress();
        figures.samples = progress.samples;
        // Reading the film costs a little: seldom, and not while things move.
        let measurable = progress.pass == 0 && progress.samples > 1 && self.scale == 1.0;
        let is_due = self.trace.is_due(progress.samples, now);
        let reads = measurable && (now - self.error_at > ERROR_EVERY || self.traced && is_due);
        if reads || now - self.counted > COUNT_EVERY {
            self.counted = now;
            figures.counters = renderer.film.count(&self.gpu)?;
            figures.paths = self.paths;
        }
        if reads {
            self.error_at = now;
            let sums = renderer.sums()?;
            figures.error = sums.relative_error().filter(|_| !renderer.is_correlated());
            self.kept = Some(Kept::of(&sums));
            if let (true, Some(error)) = (is_due, figures.error) {
                let point = Point {
                    samples: progress.samples,
                    seconds: figures.seconds,
                    lookups: figures.counters.lookups as f64 / sums.sum.len() as f64,
                    error,
                    rel_mse: self
                        .reference
                        .as_ref()
                        .and_then(|r| r.rel_mse((sums.width, sums.height), |p| sums.mean(p))),
                };
                self.trace.push(point, now);
            }
        }
        Ok(())
    }

    /// Goes on with `gpu` after the device was lost: uploads the volume again from memory and starts the picture anew. The
    /// last picture that was read back stays on screen until the first new sample.
    pub fn recover(&mut self, gpu: Arc<Gpu>) -> Result<()> {
        // What was being loaded went to the lost device.
        self.stale |= self.loading.take().is_some();
        self.gpu = gpu;
        self.pace = Pace::new(0.0);
        (self.shown, self.drawn, self.size) = (None, 0, (0, 0));
        self.figures = self.figures.begun();
        (self.paths, self.trace) = (0.0, Trace::default());
        let Some(old) = self.renderer.take() else { return Ok(()) };
        let medium = Medium::new(&self.gpu, old.medium.field.clone(), &old.scene)?;
        let size = self.kept.as_ref().map_or((1, 1), |kept| kept.size);
        let mut renderer = Renderer::new(self.gpu.clone(), Source::standard(), &old.scene, medium, size, false)?;
        self.first_picture = self.kept.is_some();
        if let Some(kept) = &self.kept {
            self.gpu.queue.write_buffer(&renderer.film.sum, 0, bytemuck::cast_slice(&kept.sum));
            renderer.resolve();
            renderer.restart();
        }
        self.renderer = Some(renderer);
        Ok(())
    }

    /// The sums of the picture, for a capture.
    pub fn sums(&mut self) -> Result<Option<Sums>> {
        match &mut self.renderer {
            Some(r) if r.progress().samples > 0 => r.sums().map(Some),
            _ => Ok(None),
        }
    }
}

impl Kept {
    fn of(sums: &Sums) -> Kept {
        let texel = |pixel: usize| {
            let [r, g, b] = sums.mean(pixel).map(|x| x as f32);
            [r, g, b, 0.0]
        };
        Kept { size: (sums.width, sums.height), sum: (0..sums.sum.len()).map(texel).collect() }
    }
}

fn scaled(size: (u32, u32), scale: f64) -> (u32, u32) {
    let side = |n: u32| ((f64::from(n) * scale).round() as u32).max(1);
    (side(size.0), side(size.1))
}

/// Whether two volumes need the same data: all that a placement does not change.
fn same_data(a: &Volume, b: &Volume) -> bool {
    use crate::scene::row::Section;
    Volume::ROWS.iter().enumerate().all(|(i, row)| row.effect != Effect::Volume || a.get(i) == b.get(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_placement_needs_no_new_data() {
        let a = Volume::default();
        let mut b = a.clone();
        b.to_world.0[3] = 2.0;
        assert!(same_data(&a, &b));
        b.seed = 2;
        assert!(!same_data(&a, &b));
    }

    #[test]
    fn scales_shrink_both_sides() {
        assert_eq!(scaled((1280, 720), 0.25), (320, 180));
        assert_eq!(scaled((3, 1), 0.125), (1, 1));
    }
}
