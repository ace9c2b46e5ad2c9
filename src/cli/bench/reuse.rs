//! `bench reuse`: the error of a frame at equal time: reuse of paths, the path tracer, candidates alone, and what other
//! modes there are; still and moving, seed by seed, each side in turn.

use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::render::field::Field;
use crate::render::film::Sums;
use crate::render::medium::Medium;
use crate::render::{Renderer, Work};
use crate::scene::{Mode, Scene, Transmittance};

pub mod chart;
mod figures;
mod plan;
mod report;

use super::clock::Watch;
use super::trace::trace;
use super::{bar, progress};
use figures::{Error, Frame, Reference, Run, Scores};
use plan::{Framing, Motion, Side};
use report::{Case, Mean, Report, Row};

/// Pixels along the width of the picture, and those of `--quick`; the height is three quarters of it.
const SIZE: u32 = 192;
const QUICK_SIZE: u32 = 96;
/// Seeds, and those of `--quick`.
const SEEDS: u32 = 20;
const QUICK_SEEDS: u32 = 16;
/// Frames of a history; the last is judged, the second half is timed.
const FRAMES: u32 = 12;
/// The same of a side whose frames share nothing; the first is not timed.
const LONE_FRAMES: u32 = 3;
/// Frames of `--quick`.
const QUICK_FRAMES: u32 = 10;
/// Samples by which the path tracer's best estimator is found, in each of so many rounds.
const PILOT_SAMPLES: u32 = 16;
const PILOT_ROUNDS: u32 = 6;
/// Runs of which the fastest tells how long a frame takes.
const PILOT_RUNS: u32 = 3;
/// Samples of a piece of the reference; of all of it at most, and those of `--quick`.
const PIECE: u32 = 64;
const MOST_SAMPLES: u32 = 16384;
const QUICK_MOST_SAMPLES: u32 = 8192;
/// The reference's noise is at most this share of the least error that is measured against it.
const SHARE: f64 = 0.1;
/// The most candidates that a pixel takes, and the most samples of a frame that are tried.
const MOST_CANDIDATES: u32 = 32;
const MOST_FRAME_SAMPLES: u32 = 256;
/// Seeds of the pilot and of the reference, far from those of frames.
const PILOT_SEED: u32 = 1 << 30;
const REFERENCE_SEED: u32 = 1 << 31;
/// Frames of the path tracer have seeds of their own, this far apart from run to run.
const SEED_STRIDE: u32 = 64;

/// How much is measured.
#[derive(Clone, Copy, Debug)]
struct Effort {
    size: (u32, u32),
    seeds: u32,
    frames: u32,
    most_samples: u32,
}

/// What is the same for all volumes.
struct Session {
    gpu: Arc<Gpu>,
    cpu_time: bool,
    effort: Effort,
    /// Parts done, of all, for the progress bar.
    done: u32,
    all: u32,
}

/// A volume, and a renderer for each mode, so that no side waits for what another has made anew.
struct Stage {
    volume: String,
    framing: Framing,
    scene: Scene,
    field: Arc<Field>,
    renderers: HashMap<Mode, Renderer>,
}

/// A side at work on a volume.
struct Way {
    side: Side,
    scene: Scene,
    /// Samples of a frame.
    samples: u32,
}

impl Way {
    /// With `amount` samples (of the path tracer) or candidates of a frame where the side does not say how many.
    fn new(stage: &Stage, side: &Side, bounces: u32, shadow: Transmittance, amount: u32) -> Way {
        let scene = plan::drawn(&stage.scene, side, bounces, shadow, amount);
        Way { side: side.clone(), scene, samples: if side.mode == Mode::Path { amount } else { 1 } }
    }
}

/// Runs of one side under one motion of the camera, and the means of a still picture's frames.
#[derive(Default)]
struct Measured {
    runs: Vec<Run>,
    means: Vec<Vec<(Frame, f64)>>,
}

/// Seconds of each pass of a frame, and bytes of a pixel.
type Cost = (BTreeMap<&'static str, f64>, f64);

/// Measures everything; ten minutes with `quick` on two cores and a software adapter, longer without. `volumes` are names or
/// files in place of the usual ones, `size` pixels along the width in place of the usual number.
///
/// # Errors
/// Those of volumes that cannot be read, of shaders and of the adapter.
pub fn measure(quick: bool, volumes: &[String], size: Option<u32>) -> Result<Report> {
    let volumes: Vec<&str> =
        if volumes.is_empty() { plan::VOLUMES.to_vec() } else { volumes.iter().map(String::as_str).collect() };
    let width = size.unwrap_or(if quick { QUICK_SIZE } else { SIZE });
    let effort = Effort {
        size: (width, (width * 3 / 4).max(1)),
        seeds: if quick { QUICK_SEEDS } else { SEEDS },
        frames: if quick { QUICK_FRAMES } else { FRAMES },
        most_samples: if quick { QUICK_MOST_SAMPLES } else { MOST_SAMPLES },
    };
    let gpu = Arc::new(Gpu::headless()?);
    let settings = (volumes.len() * Framing::ALL.len() * plan::BOUNCES.len()) as u32;
    // Preparations and the reference count as much as a round each.
    let all = settings * (effort.seeds + 2);
    let mut session = Session { cpu_time: gpu.is_software(), gpu, effort, done: 0, all };
    let mut cases = Vec::new();
    for volume in volumes {
        session.show(0.0, &format!("{volume}: setting up"));
        let mut stage = session.stage(volume)?;
        let scene = stage.scene.clone();
        for framing in Framing::ALL {
            stage.framing = framing;
            stage.scene = framing.of(&scene, &stage.field, effort.size);
            for bounces in plan::BOUNCES {
                cases.extend(session.setting(&mut stage, bounces)?);
            }
        }
    }
    progress("");
    Ok(Report {
        adapter: session.gpu.info.name.clone(),
        backend: session.gpu.backend(),
        cpu_time: session.cpu_time,
        size: effort.size,
        frames: effort.frames,
        cases,
    })
}

impl Session {
    fn show(&self, share: f64, what: &str) {
        progress(&bar((f64::from(self.done) + share) / f64::from(self.all), what));
    }

    fn aspect(&self) -> f64 {
        f64::from(self.effort.size.0) / f64::from(self.effort.size.1)
    }

    /// Loads a volume; renderers come with its first frames.
    fn stage(&mut self, volume: &str) -> Result<Stage> {
        let scene = plan::scene(volume);
        let field = Arc::new(Field::load(&scene.volume)?);
        let renderers = HashMap::new();
        let mut stage = Stage { volume: volume.into(), framing: Framing::Whole, scene, field, renderers };
        for side in plan::sides() {
            if !stage.renderers.contains_key(&side.mode) {
                let scene = Way::new(&stage, &side, plan::BOUNCES[0], Transmittance::Ratio, 1).scene;
                let medium = Medium::new(&self.gpu, stage.field.clone(), &scene)?;
                let renderer =
                    Renderer::new(self.gpu.clone(), Source::standard(), &scene, medium, self.effort.size, false)?;
                stage.renderers.insert(side.mode, renderer);
            }
        }
        Ok(stage)
    }

    /// Seconds since the watch began: CPU time on software adapters, else wall time.
    fn seconds(&mut self, watch: &Watch) -> f64 {
        let (wall, cpu) = watch.seconds();
        self.cpu_time &= cpu.is_some();
        cpu.filter(|_| self.cpu_time).unwrap_or(wall)
    }

    /// Everything about a volume with so many scatterings.
    fn setting(&mut self, stage: &mut Stage, bounces: u32) -> Result<Vec<Case>> {
        let (volume, framing) = (&stage.volume, stage.framing.name());
        let label = format!("{volume}, {framing}, {bounces} {}", if bounces == 1 { "bounce" } else { "bounces" });
        self.show(0.0, &format!("{label}: the path tracer's best estimator"));
        let shadow = self.shadow(stage, bounces)?;
        let sides = plan::sides();
        let mut ways: Vec<Way> = sides.iter().map(|side| Way::new(stage, side, bounces, shadow, 1)).collect();
        let ours = ways.iter().position(|way| way.side.name == plan::OURS).expect("it is a side");
        let goal = self.least_seconds(stage, &ways[ours])?;
        let mut costs: Vec<Cost> = Vec::new();
        for (way, side) in ways.iter_mut().zip(&sides) {
            self.show(0.3, &format!("{label}: cost of {}", side.name));
            if side.matched {
                let most = if side.mode == Mode::Path { MOST_FRAME_SAMPLES } else { MOST_CANDIDATES };
                let amount = self.amount(stage, most, goal, |stage, n| Way::new(stage, side, bounces, shadow, n))?;
                *way = Way::new(stage, side, bounces, shadow, amount);
            }
            costs.push(self.cost(stage, way)?);
        }
        self.done += 1;
        let mut all: Vec<(Motion, Vec<Measured>)> =
            Motion::ALL.map(|motion| (motion, sides.iter().map(|_| Measured::default()).collect())).into();
        for i in 0..self.effort.seeds {
            for (motion, measured) in &mut all {
                let seed = motion.seeds(self.effort.seeds).start + i;
                for (way, measured) in ways.iter().zip(measured) {
                    self.show(0.0, &format!("{label}, {}, seed {seed}: {}", motion.name(), way.side.name));
                    measured.runs.push(self.run(stage, way, *motion, seed)?);
                    if way.side.shares && *motion == Motion::Still {
                        measured.means.push(self.means(stage, way, ways[0].samples, seed)?);
                    }
                }
            }
            self.done += 1;
        }
        let reference = self.reference(stage, &ways[0], &all, &label)?;
        self.done += 1;
        let case = |(motion, measured): (Motion, Vec<Measured>)| Case {
            volume: stage.volume.clone(),
            framing: stage.framing,
            bounces,
            motion,
            seeds: motion.seeds(self.effort.seeds).collect(),
            shadow: shadow.name(),
            reference: reference.quality,
            means: sides.iter().zip(&measured).flat_map(|(side, m)| means_of(side, m, &reference)).collect(),
            rows: (ways.iter().zip(&measured).zip(&costs))
                .map(|((way, m), cost)| row_of(way, m, cost, &reference))
                .collect(),
        };
        Ok(all.into_iter().map(case).collect())
    }

    /// The shadow estimator with the least noise at equal time.
    fn shadow(&mut self, stage: &mut Stage, bounces: u32) -> Result<Transmittance> {
        let path = &plan::sides()[0];
        let mut found: Vec<(Transmittance, Sums, f64)> = Vec::new();
        for round in 0..PILOT_ROUNDS {
            for (i, shadow) in plan::SHADOWS.into_iter().enumerate() {
                let scene = plan::drawn(&stage.scene, path, bounces, shadow, 1);
                let renderer = stage.renderers.get_mut(&path.mode).expect("every mode has one");
                let seed = PILOT_SEED + round * plan::SHADOWS.len() as u32 + i as u32;
                let run = trace(renderer, &scene, PILOT_SAMPLES, seed)?;
                self.cpu_time &= run.cpu.is_some();
                let seconds = run.cpu.filter(|_| self.cpu_time).unwrap_or(run.wall);
                match found.get_mut(i) {
                    Some((_, sums, least)) => {
                        sums.add(&run.sums);
                        *least = least.min(seconds);
                    }
                    None => found.push((shadow, run.sums, seconds)),
                }
            }
        }
        let mut pooled = found[0].1.clone();
        found[1..].iter().for_each(|(_, sums, _)| pooled.add(sums));
        let truth: Vec<[f64; 3]> = (0..pooled.sum.len()).map(|p| pooled.mean(p)).collect();
        let cost = |(_, sums, seconds): &(Transmittance, Sums, f64)| figures::noise_of_sample(sums, &truth) * seconds;
        let best = found.iter().min_by(|a, b| cost(a).total_cmp(&cost(b))).expect("there are some");
        Ok(best.0)
    }

    /// The least seconds of a frame in a few runs; the first builds shaders.
    fn least_seconds(&mut self, stage: &mut Stage, way: &Way) -> Result<f64> {
        let mut least = f64::INFINITY;
        for _ in 0..PILOT_RUNS {
            least = least.min(self.run(stage, way, Motion::Still, PILOT_SEED)?.seconds);
        }
        Ok(least)
    }

    /// How many samples or candidates, `most` of them at most, make a frame take `goal` seconds.
    fn amount(&mut self, stage: &mut Stage, most: u32, goal: f64, way: impl Fn(&Stage, u32) -> Way) -> Result<u32> {
        let mut known: Vec<(f64, f64)> = Vec::new();
        let mut amount = 1;
        while amount <= most && known.last().is_none_or(|(_, seconds)| *seconds < goal) {
            let way = way(stage, amount);
            known.push((f64::from(amount), self.least_seconds(stage, &way)?));
            amount *= 2;
        }
        Ok(matching(&known, goal))
    }

    /// Seconds of each pass in a steady frame, which are wall time, and bytes of a pixel.
    fn cost(&mut self, stage: &mut Stage, way: &Way) -> Result<Cost> {
        let timed = |stage: &mut Stage, on: bool| {
            let reuse = stage.renderers.get_mut(&way.side.mode).and_then(Renderer::reuse_mut);
            reuse.map(|reuse| {
                reuse.timed = on;
                (std::mem::take(&mut reuse.seconds), reuse.bytes() as f64)
            })
        };
        // The first run builds shaders, also those of means.
        self.run(stage, way, Motion::Moving, PILOT_SEED)?;
        if way.side.shares {
            self.means(stage, way, 1, PILOT_SEED)?;
        }
        timed(stage, true);
        self.run(stage, way, Motion::Moving, PILOT_SEED)?;
        let pixels = f64::from(self.effort.size.0) * f64::from(self.effort.size.1);
        let (frames, timed_from) = self.frames(&way.side);
        let frames = f64::from(frames - timed_from);
        let (mut passes, bytes) = timed(stage, false).unwrap_or_default();
        passes.values_mut().for_each(|seconds| *seconds /= frames);
        Ok((passes, bytes / pixels))
    }

    /// Frames of a history, and the first that is timed.
    fn frames(&self, side: &Side) -> (u32, u32) {
        if side.shares { (self.effort.frames, self.effort.frames / 2) } else { (LONE_FRAMES, 1) }
    }

    /// Draws a history of frames, as a window does while things move; the last camera is the scene's own.
    fn run(&mut self, stage: &mut Stage, way: &Way, motion: Motion, seed: u32) -> Result<Run> {
        let side = &way.side;
        let (frames, timed_from) = self.frames(side);
        let renderer = stage.renderers.get_mut(&side.mode).expect("every mode has one");
        renderer.set_moving(true);
        let (mut seconds, mut run) = (Vec::new(), Run::default());
        for frame in 0..frames {
            let back = if motion == Motion::Moving { frames - 1 - frame } else { 0 };
            let mut scene = plan::before(&way.scene, &stage.field, self.aspect(), back);
            // The path tracer begins each frame with its first sample, so that only the seed tells frames apart.
            let own = side.mode == Mode::Path;
            scene.integrator.seed = if own { seed.wrapping_mul(SEED_STRIDE).wrapping_add(frame) } else { seed };
            renderer.update(&scene, self.effort.size, None)?;
            if let Some(reuse) = renderer.reuse_mut() {
                if frame == 0 {
                    reuse.rewind();
                } else if frame == timed_from {
                    reuse.seconds.clear();
                }
            }
            renderer.restart();
            renderer.prepare()?;
            renderer.gpu.wait()?;
            let watch = Watch::start();
            while renderer.progress().samples < way.samples {
                let samples = way.samples - renderer.progress().samples;
                renderer.submit(Work { samples, groups: u32::MAX })?;
            }
            renderer.gpu.wait()?;
            if frame >= timed_from {
                seconds.push(self.seconds(&watch));
            }
            if frame + 2 >= frames {
                run.frames[(frame + 2 - frames) as usize] = figures::frame(&renderer.sums()?);
                let counters = renderer.film.count(&renderer.gpu)?;
                run.events = figures::events(&counters, run.frames[0].len());
            }
        }
        run.seconds = seconds.iter().sum::<f64>() / seconds.len() as f64;
        Ok(run)
    }

    /// Means of the first frames of a still picture that begins without a history, and the seconds that they took. Where
    /// the picture goes on with independent paths, a frame takes as many as the path tracer's own.
    fn means(&mut self, stage: &mut Stage, way: &Way, samples: u32, seed: u32) -> Result<Vec<(Frame, f64)>> {
        let mut scene = way.scene.clone();
        scene.integrator.seed = seed;
        let renderer = stage.renderers.get_mut(&way.side.mode).expect("every mode has one");
        renderer.set_moving(false);
        renderer.update(&scene, self.effort.size, None)?;
        if let Some(reuse) = renderer.reuse_mut() {
            reuse.rewind();
        }
        renderer.restart();
        renderer.prepare()?;
        renderer.gpu.wait()?;
        let (mut means, mut seconds) = (Vec::new(), 0.0);
        for frame in 1..=*plan::MEANS.last().expect("there are some") {
            let watch = Watch::start();
            renderer.submit(Work { samples, groups: u32::MAX })?;
            renderer.gpu.wait()?;
            seconds += self.seconds(&watch);
            if plan::MEANS.contains(&frame) {
                means.push((figures::frame(&renderer.sums()?), seconds));
            }
        }
        Ok(means)
    }

    /// The picture of the last camera, by the path tracer, until its noise is low beside all that was measured.
    fn reference(
        &mut self,
        stage: &mut Stage,
        path: &Way,
        all: &[(Motion, Vec<Measured>)],
        label: &str,
    ) -> Result<Reference> {
        let renderer = stage.renderers.get_mut(&path.side.mode).expect("every mode has one");
        let mut total: Option<Sums> = None;
        let mut wanted = PIECE;
        let mut drawn = 0;
        loop {
            while drawn < wanted {
                let share = f64::from(drawn) / f64::from(self.effort.most_samples);
                self.show(share, &format!("{label}: reference, {drawn} samples"));
                let sums = trace(renderer, &path.scene, PIECE, REFERENCE_SEED + drawn)?.sums;
                drawn += PIECE;
                match &mut total {
                    Some(total) => total.add(&sums),
                    none => *none = Some(sums),
                }
            }
            let reference = Reference::of(total.as_ref().expect("a piece at least"));
            let least = least_error(all, &reference);
            let noise = [reference.quality.noise, reference.quality.v99];
            let share = (0..2).map(|i| noise[i] / (SHARE * least[i])).fold(0.0, f64::max);
            if share <= 1.0 || drawn >= self.effort.most_samples {
                return Ok(reference);
            }
            // The noise falls as 1 / samples; a little more than that makes up for what it is not known by.
            wanted = ((f64::from(drawn) * (1.1 * share).min(4.0)) as u32).min(self.effort.most_samples);
        }
    }
}

/// The least mean errors of all that was measured, with and without the worst pixels.
fn least_error(all: &[(Motion, Vec<Measured>)], reference: &Reference) -> [f64; 2] {
    let mut least = [f64::INFINITY; 2];
    let mut look = |frames: &mut dyn Iterator<Item = &Frame>| {
        let errors: Vec<Error> = frames.map(|frame| Error::of(frame, reference)).collect();
        let mean = |of: fn(&Error) -> f64| errors.iter().map(of).sum::<f64>() / errors.len() as f64;
        least[0] = least[0].min(mean(|e| e.rel_mse));
        least[1] = least[1].min(mean(|e| e.v99));
    };
    for measured in all.iter().flat_map(|(_, measured)| measured) {
        look(&mut measured.runs.iter().map(|run| &run.frames[1]));
        for i in 0..measured.means.first().map_or(0, Vec::len) {
            look(&mut measured.means.iter().map(|of_seed| &of_seed[i].0));
        }
    }
    least
}

/// Samples or candidates of which a frame takes `goal` seconds, by what is `known` of some numbers of them.
fn matching(known: &[(f64, f64)], goal: f64) -> u32 {
    let [.., (few, short), (many, long)] = known else { return known.first().map_or(1, |(n, _)| *n as u32) };
    let share = ((goal - short) / (long - short).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (few + (many - few) * share).round() as u32
}

fn row_of(way: &Way, measured: &Measured, (passes, bytes): &Cost, reference: &Reference) -> Row {
    let mut scores = Scores::default();
    for run in &measured.runs {
        scores.push(Error::of(&run.frames[1], reference), run.seconds);
    }
    let event = |i: usize| measured.runs.iter().map(|run| run.events[i]).sum::<f64>() / measured.runs.len() as f64;
    Row {
        side: way.side.name.clone(),
        samples: way.samples,
        candidates: (way.side.mode != Mode::Path).then_some(way.scene.candidates()),
        bias: scores.bias(reference.quality),
        scores,
        lag: figures::lag(&measured.runs, reference),
        events: [0, 1, 2, 3].map(event),
        passes: passes.clone(),
        bytes: *bytes,
    }
}

fn means_of(side: &Side, measured: &Measured, reference: &Reference) -> Vec<Mean> {
    if measured.means.is_empty() {
        return Vec::new();
    }
    let of = |(i, frames): (usize, u32)| {
        let mut scores = Scores::default();
        for of_seed in &measured.means {
            let (frame, seconds) = &of_seed[i];
            scores.push(Error::of(frame, reference), *seconds);
        }
        Mean { side: side.name.clone(), frames, scores }
    };
    plan::MEANS.into_iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn amounts_fit_the_time() {
        assert_eq!(matching(&[(1.0, 2.0)], 1.0), 1, "one takes longer already");
        assert_eq!(matching(&[(1.0, 1.0), (2.0, 1.5), (4.0, 2.5)], 2.0), 3);
        assert_eq!(matching(&[(16.0, 1.0), (32.0, 2.0)], 9.0), 32, "no more than there may be");
        assert_eq!(matching(&[(1.0, 1.0), (2.0, 1.0)], 1.0), 1, "time that does not grow");
    }

    #[test]
    fn the_least_error_is_that_of_any_side_or_mean() {
        let reference = figures::tests::grey(2, 1.0);
        let frame = |x: f32| vec![[x; 3]; 2];
        let run = |x: f32| Run { frames: [frame(0.0), frame(x)], ..Run::default() };
        let side = Measured { runs: vec![run(1.5), run(1.5)], means: Vec::new() };
        let other = Measured { runs: vec![run(3.0)], means: vec![vec![(frame(2.0), 1.0), (frame(1.1), 2.0)]] };
        let least = least_error(&[(Motion::Still, vec![side, other])], &reference);
        assert!(least.iter().all(|x| (x - 0.01 / 1.01).abs() < 1e-6), "{least:?}");
    }
}
