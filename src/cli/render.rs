//! `nephele render`: pictures and sequences without a window.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use clap::Args;
use serde_json::json;

use crate::error::{Code, Error, Result, Warning};
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::input;
use crate::io::picture;
use crate::render::field::Field;
use crate::render::film::{Aov, Counters, Sums};
use crate::render::medium::Medium;
use crate::render::pace::Pace;
use crate::render::{Renderer, Work, heat};
use crate::save;
use crate::scene::Scene;

mod bar;

use bar::Bar;

/// Flags of `render`.
#[derive(Debug, Args)]
pub struct RenderArgs {
    /// A scene (.toml), a volume (.vdb, .nvdb), or a picture that nephele saved
    pub input: PathBuf,
    /// The picture: .exr, .png or .pfm; of a sequence with %04d or ####
    #[arg(short, long, value_name = "OUT")]
    pub output: PathBuf,
    /// Samples per pixel [default: 256, or none if another limit is given]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    pub spp: Option<u32>,
    /// Stop after this time
    #[arg(long, value_name = "S", value_parser = positive)]
    pub seconds: Option<f64>,
    /// Stop at this relative error (see `relative_error` of the statistics)
    #[arg(long, value_name = "E", value_parser = positive)]
    pub target_error: Option<f64>,
    /// Size of the picture, as 1920x1080
    #[arg(long, value_name = "WxH", value_parser = size)]
    pub size: Option<(u32, u32)>,
    /// Seed of the random numbers
    #[arg(long, value_name = "S")]
    pub seed: Option<u32>,
    /// Change one setting: medium.g=0.5
    #[arg(long = "set", value_name = "K=V")]
    pub set: Vec<String>,
    /// Write statistics as JSON
    #[arg(long, value_name = "FILE")]
    pub stats: Option<PathBuf>,
    /// Add a layer (EXR only): transmittance, depth, albedo, single, multiple, variance, samples, lookups, steps
    #[arg(long, value_name = "NAME", value_parser = aov)]
    pub aov: Vec<Aov>,
    /// Frames of a sequence, A to B inclusive
    #[arg(long, value_name = "A..B", value_parser = frames)]
    pub frames: Option<(u32, u32)>,
    /// Independent runs with seeds S, S+1, …; the picture is their mean
    #[arg(long, value_name = "K", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    pub repeat: u32,
    /// Show progress even if stderr is no terminal
    #[arg(long)]
    pub progress: bool,
}

fn positive(text: &str) -> std::result::Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("a number above 0 is expected".into()),
    }
}

fn size(text: &str) -> std::result::Result<(u32, u32), String> {
    let parts = text.split_once('x').and_then(|(w, h)| Some((w.parse().ok()?, h.parse().ok()?)));
    let limit = 1..=16384u32;
    parts
        .filter(|(w, h)| limit.contains(w) && limit.contains(h))
        .ok_or_else(|| "a size as 1920x1080 is expected, sides from 1 to 16384".into())
}

fn frames(text: &str) -> std::result::Result<(u32, u32), String> {
    let parts = text.split_once("..").and_then(|(a, b)| Some((a.parse().ok()?, b.parse().ok()?)));
    parts.filter(|(a, b)| a <= b).ok_or_else(|| "frames as 0..23 are expected, the first not above the last".into())
}

fn aov(text: &str) -> std::result::Result<Aov, String> {
    let names = || Aov::ALL.map(Aov::name).join(", ");
    Aov::ALL.into_iter().find(|a| a.name() == text).ok_or_else(|| format!("one of {} is expected", names()))
}

/// Samples of each pixel where no limit is given.
const DEFAULT_SPP: u32 = 256;
/// Seconds of one piece of work: short enough for Ctrl-C and for watchdogs, long enough to cost nothing.
const SLICE_SOFTWARE: f64 = 0.2;
const SLICE_GPU: f64 = 0.03;

/// Runs `render`; `start` is when the program began.
pub fn run(args: &RenderArgs, start: Instant) -> Result<()> {
    let format = picture::Format::of_path(&args.output)?;
    if format != picture::Format::Exr && !args.aov.is_empty() {
        return Err(Error::new(Code::BadKey, "--aov needs an EXR picture.")
            .why(format!("{} holds only the picture itself.", args.output.display()))
            .hint("Write to a file that ends in .exr."));
    }
    let working_folder = std::env::current_dir().unwrap_or_default();
    let mut scene = input::open(&args.input)?;
    for assignment in &args.set {
        scene.set(assignment, &working_folder)?;
    }
    if let Some((width, height)) = args.size {
        (scene.film.width, scene.film.height) = (width, height);
    }
    if let Some(seed) = args.seed {
        scene.integrator.seed = seed;
    }
    let frames = frame_files(&args.output, args.frames)?;
    let interrupted = interrupt_flag();

    let mut run = Run {
        args,
        interrupted,
        start,
        setup_seconds: 0.0,
        render_seconds: 0.0,
        counters: Counters::default(),
        paths: 0.0,
        lost: 0.0,
        pace: None,
        passes: BTreeMap::new(),
    };
    let field = Arc::new(Field::load(&scene.volume)?);
    let gpu = Arc::new(Gpu::headless()?);
    let opened = |scene: &Scene| -> Result<Renderer> {
        let aov = args.aov.iter().any(|a| a.needs_sums());
        let medium = Medium::new(&gpu, field.clone(), scene)?;
        let size = (scene.film.width, scene.film.height);
        let mut renderer = Renderer::new(gpu.clone(), Source::standard(), scene, medium, size, aov)?;
        renderer.count_cost(args.aov.iter().any(|a| a.needs_cost()))?;
        for warning in renderer.warnings() {
            eprintln!("{warning}");
        }
        Ok(renderer)
    };
    let at = |frame: Option<u32>| match frame {
        Some(f) => scene.at_frame(f64::from(f)),
        None => Ok(scene.clone()),
    };
    if let (true, Some((_, last))) = (scene.integrator.mode.reuses(), args.frames) {
        let mut renderer = opened(&at(Some(0))?)?;
        let pictures = run.sequence(&mut renderer, &frames, last, at)?;
        for ((frame, path), picture) in frames.iter().zip(&pictures) {
            run.save(&renderer, &at(*frame)?, picture, path)?;
        }
        return run.finish(pictures.last().map_or(0, |p| p.samples), &args.output);
    }
    let mut renderer: Option<Renderer> = None;
    for (frame, path) in frames {
        let frame_scene = at(frame)?;
        let renderer = match &mut renderer {
            Some(r) => r,
            none => none.insert(opened(&frame_scene)?),
        };
        let picture = run.picture(renderer, &frame_scene)?;
        run.save(renderer, &frame_scene, &picture, &path)?;
        run.finish(picture.samples, &path)?;
    }
    Ok(())
}

/// The frames to draw and their files; one without a number where no sequence is asked for.
fn frame_files(output: &Path, frames: Option<(u32, u32)>) -> Result<Vec<(Option<u32>, PathBuf)>> {
    let Some((first, last)) = frames else { return Ok(vec![(None, output.to_path_buf())]) };
    let name = output.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if !has_number(&name) && first != last {
        return Err(Error::new(Code::BadKey, format!("{} has no place for the frame number.", output.display()))
            .hint("Write %04d or #### in its name."));
    }
    Ok((first..=last).map(|f| (Some(f), output.with_file_name(numbered(&name, f)))).collect())
}

fn has_number(name: &str) -> bool {
    numbered(name, 0) != name
}

/// `name` with the frame number in place of `%04d` (any width) or of a run of `#`.
fn numbered(name: &str, frame: u32) -> String {
    if let Some(at) = name.find('%') {
        let rest = &name[at + 1..];
        let digits = rest.bytes().take_while(u8::is_ascii_digit).count();
        if rest[digits..].starts_with('d') {
            let width = rest[..digits].parse::<usize>().unwrap_or(0).min(32);
            return format!("{}{frame:0width$}{}", &name[..at], &rest[digits + 1..]);
        }
    }
    if let Some(at) = name.find('#') {
        let width = name[at..].bytes().take_while(|&b| b == b'#').count();
        return format!("{}{frame:0width$}{}", &name[..at], &name[at + width..]);
    }
    name.to_owned()
}

/// Set by Ctrl-C; a second Ctrl-C ends the program at once.
fn interrupt_flag() -> Arc<AtomicBool> {
    let flag = Arc::new(AtomicBool::new(false));
    let set = flag.clone();
    let handler = ctrlc::set_handler(move || {
        if set.swap(true, Ordering::Relaxed) {
            std::process::exit(i32::from(Code::Interrupted.exit()));
        }
    });
    if let Err(e) = handler {
        log::warn!("Ctrl-C will not be caught: {e}");
    }
    flag
}

/// A finished picture.
struct Picture {
    sums: Sums,
    /// Variance between runs, where there were several.
    variance: Option<Vec<[f64; 3]>>,
    /// Independent runs behind it.
    runs: u32,
    /// Samples of each pixel, the fewest of all.
    samples: u64,
    /// Whether samples of a pixel are not independent, so that their spread tells nothing.
    correlated: bool,
}

/// What is summed over all frames and repeats of one command.
struct Run<'a> {
    args: &'a RenderArgs,
    interrupted: Arc<AtomicBool>,
    start: Instant,
    setup_seconds: f64,
    render_seconds: f64,
    counters: Counters,
    /// Samples that were to be drawn and are not in the pictures.
    lost: f64,
    paths: f64,
    pace: Option<Pace>,
    /// Seconds of each pass of resampling.
    passes: BTreeMap<&'static str, f64>,
}

impl Run<'_> {
    /// Frames of a mode that reuses paths: what a person sees while things move. Each run draws all frames from 0 to `last`;
    /// the pictures are of `frames`.
    fn sequence(
        &mut self,
        renderer: &mut Renderer,
        frames: &[(Option<u32>, PathBuf)],
        last: u32,
        at: impl Fn(Option<u32>) -> Result<Scene>,
    ) -> Result<Vec<Picture>> {
        let merged = self.args.spp.unwrap_or(1);
        let mut means: Vec<(Spread, Option<Sums>)> = frames.iter().map(|_| Default::default()).collect();
        let mut bar = Bar::new(self.args.progress);
        let mut runs = 0;
        renderer.set_moving(true);
        for k in 0..self.args.repeat {
            for frame in 0..=last {
                let mut scene = at(Some(frame))?;
                scene.integrator.seed = scene.integrator.seed.wrapping_add(k);
                renderer.update(&scene, (scene.film.width, scene.film.height), None)?;
                if let (0, Some(reuse)) = (frame, renderer.reuse_mut()) {
                    reuse.rewind();
                    reuse.timed = true;
                }
                renderer.restart();
                renderer.prepare()?;
                if self.paths == 0.0 {
                    self.setup_seconds = self.start.elapsed().as_secs_f64();
                }
                let begin = Instant::now();
                renderer.submit(Work { samples: merged, groups: u32::MAX })?;
                renderer.gpu.wait()?;
                self.render_seconds += begin.elapsed().as_secs_f64();
                self.count(&renderer.film.count(&renderer.gpu)?);
                self.paths += f64::from(merged) * f64::from(scene.film.width) * f64::from(scene.film.height);
                if let Some(written) = frames.iter().position(|(f, _)| *f == Some(frame)) {
                    let sums = renderer.sums()?;
                    means[written].0.add(&sums);
                    match &mut means[written].1 {
                        Some(total) => total.add(&sums),
                        none => *none = Some(sums),
                    }
                }
                if self.interrupted.load(Ordering::Relaxed) {
                    break;
                }
                let share = (f64::from(k) + f64::from(frame + 1) / f64::from(last + 1)) / f64::from(self.args.repeat);
                bar.show(frame, share, k, self.args.repeat);
            }
            if self.interrupted.load(Ordering::Relaxed) && k > 0 {
                break;
            }
            runs += 1;
        }
        bar.clear();
        if let Some(reuse) = renderer.reuse() {
            self.passes = reuse.seconds.clone();
        }
        let picture = |(between, sums): (Spread, Option<Sums>)| {
            let sums = sums?;
            Some(Picture {
                sums,
                variance: (runs > 1).then(|| between.variance()),
                runs,
                samples: u64::from(merged),
                correlated: true,
            })
        };
        // What an interrupt left undrawn is not written.
        Ok(means.into_iter().map_while(picture).collect())
    }

    /// Writes a picture, its statistics and what its overlay shows.
    fn save(&self, renderer: &Renderer, scene: &Scene, picture: &Picture, path: &Path) -> Result<()> {
        let mut stats = self.stats(renderer, scene, picture, &renderer.warnings());
        let image = picture.sums.image(&self.args.aov, scene.medium.albedo.0, picture.variance.as_deref());
        if !save::overlay(path, &picture.sums, scene, &mut stats)? {
            if let (Some(look), picture::Format::Png) =
                (heat::look(scene.display.overlay), picture::Format::of_path(path)?)
            {
                let text = format!("{} has nothing to show: {}. The picture is written.", look.name, look.waits());
                let warning = Warning { code: "overlay", text };
                eprintln!("{warning}");
                stats["warnings"].as_array_mut().into_iter().for_each(|all| all.push(warning.to_string().into()));
            }
            save::picture(path, &image, scene, &stats)?;
        }
        if let Some(stats_path) = &self.args.stats {
            picture::write_whole(stats_path, |f| writeln!(f, "{stats:#}"))?;
        }
        Ok(())
    }

    /// An error if the run was interrupted.
    fn finish(&self, samples: u64, path: &Path) -> Result<()> {
        if self.interrupted.load(Ordering::Relaxed) {
            let text = format!("Stopped; {} has {samples} samples per pixel.", path.display());
            return Err(Error::new(Code::Interrupted, text));
        }
        Ok(())
    }

    fn picture(&mut self, renderer: &mut Renderer, scene: &Scene) -> Result<Picture> {
        let size = (scene.film.width, scene.film.height);
        let mut total: Option<Sums> = None;
        let mut between = Spread::default();
        let mut runs = 0;
        for k in 0..self.args.repeat {
            let mut scene = scene.clone();
            scene.integrator.seed = scene.integrator.seed.wrapping_add(k);
            renderer.update(&scene, size, None)?;
            if let Some(reuse) = renderer.reuse_mut() {
                reuse.timed = true;
            }
            renderer.prepare()?;
            if self.paths == 0.0 {
                self.setup_seconds = self.start.elapsed().as_secs_f64();
            }
            let begin = Instant::now();
            self.accumulate(renderer, k)?;
            renderer.gpu.wait()?;
            self.render_seconds += begin.elapsed().as_secs_f64();
            let sums = renderer.sums()?;
            let counted = renderer.film.count(&renderer.gpu)?;
            self.count(&counted);
            let drawn = sums.square.iter().map(|s| s[3]).sum::<f64>();
            self.lost += f64::from(renderer.progress().samples) * sums.square.len() as f64 - drawn;
            self.paths += drawn;
            between.add(&sums);
            runs += 1;
            match &mut total {
                Some(total) => total.add(&sums),
                none => *none = Some(sums),
            }
            if self.interrupted.load(Ordering::Relaxed) {
                break;
            }
        }
        let sums = total.expect("at least one run");
        let samples = sums.square.iter().map(|s| s[3]).fold(f64::INFINITY, f64::min) as u64;
        if let Some(reuse) = renderer.reuse() {
            self.passes = reuse.seconds.clone();
        }
        let correlated = renderer.is_correlated();
        Ok(Picture { sums, variance: (runs > 1).then(|| between.variance()), runs, samples, correlated })
    }

    /// Draws until a limit is reached.
    fn accumulate(&mut self, renderer: &mut Renderer, run: u32) -> Result<()> {
        let args = self.args;
        let unlimited = args.seconds.is_some() || args.target_error.is_some();
        let spp = args.spp.unwrap_or(if unlimited { u32::MAX } else { DEFAULT_SPP });
        let budget = if renderer.gpu.is_software() { SLICE_SOFTWARE } else { SLICE_GPU };
        let mut pace = self.pace.take().unwrap_or_else(|| Pace::new(budget));
        let begin = Instant::now();
        let mut bar = Bar::new(args.progress);
        let mut next_check = 2;
        loop {
            let progress = renderer.progress();
            let seconds = begin.elapsed().as_secs_f64();
            if progress.samples >= spp || self.interrupted.load(Ordering::Relaxed) {
                break;
            }
            if let Some(limit) = args.seconds {
                if seconds >= limit {
                    break;
                }
                pace.budget = budget.min(limit - seconds).max(1e-3);
            }
            if let (Some(target), false) = (args.target_error, progress.pass > 0)
                && progress.samples >= next_check
            {
                // Reading the film costs a little, so look at a growing distance.
                next_check = progress.samples + (progress.samples / 8).max(1);
                let sums = renderer.sums()?;
                let error = sums.relative_error().filter(|_| !renderer.is_correlated());
                if error.is_some_and(|e| e <= target) {
                    break;
                }
            }
            let mut left = spp - progress.samples;
            if args.target_error.is_some() {
                left = left.min(next_check.saturating_sub(progress.samples).max(1));
            }
            let before = Instant::now();
            let done = renderer.submit(pace.next(progress, left, renderer.tiles()))?;
            renderer.gpu.wait()?;
            pace.note(done, before.elapsed().as_secs_f64());
            let share = match args.seconds {
                Some(limit) => (begin.elapsed().as_secs_f64() / limit).min(1.0),
                None => f64::from(renderer.progress().samples) / f64::from(spp),
            };
            bar.show(renderer.progress().samples, share, run, args.repeat);
        }
        bar.clear();
        pace.budget = budget;
        self.pace = Some(pace);
        Ok(())
    }

    fn count(&mut self, c: &Counters) {
        self.counters.lookups += c.lookups;
        self.counters.null_collisions += c.null_collisions;
        self.counters.real_collisions += c.real_collisions;
        self.counters.cell_steps += c.cell_steps;
        self.counters.shadow_rays += c.shadow_rays;
        self.counters.nonfinite += c.nonfinite;
        self.counters.violations += c.violations;
        self.counters.behind += c.behind;
        self.counters.capped += c.capped;
    }

    fn stats(&self, r: &Renderer, scene: &Scene, picture: &Picture, warnings: &[Warning]) -> serde_json::Value {
        let error = match &picture.variance {
            None if picture.correlated => None,
            None => picture.sums.relative_error(),
            Some(variance) => {
                let n = variance.len() as f64;
                let mean =
                    (0..variance.len()).map(|p| picture.sums.mean(p).iter().sum::<f64>()).sum::<f64>() / (3.0 * n);
                let runs = f64::from(picture.runs);
                let spread = variance.iter().map(|v| v.iter().sum::<f64>()).sum::<f64>() / (3.0 * n * runs);
                (mean > 0.0).then(|| spread.sqrt() / mean)
            }
        };
        let mut warnings: Vec<String> = warnings.iter().map(ToString::to_string).collect();
        if self.counters.nonfinite > 0 {
            warnings
                .push(format!("{} samples were not finite and count as black. [nonfinite]", self.counters.nonfinite));
        }
        if self.lost > 0.0 {
            warnings.push(format!("{} samples of long paths are missing. [lost]", self.lost));
        }
        // A factor below 1 makes bounds that do not bound, on purpose.
        if self.counters.violations > 0 && scene.tracking.majorant_factor >= 1.0 {
            warnings.push(format!("{} lookups lay above their bound. [bounds]", self.counters.violations));
        }
        let c = &self.counters;
        let mut stats = save::stats(r, &picture.sums, picture.samples);
        let own = json!({
            "seed": scene.integrator.seed,
            "repeat": picture.runs,
            "setup_seconds": self.setup_seconds,
            "render_seconds": self.render_seconds,
            "paths": self.paths as u64,
            "paths_per_second": self.paths / self.render_seconds.max(f64::MIN_POSITIVE),
            "lookups": c.lookups,
            "null_collisions": c.null_collisions,
            "real_collisions": c.real_collisions,
            "cell_steps": c.cell_steps,
            "shadow_rays": c.shadow_rays,
            "lookups_per_path": c.lookups as f64 / self.paths.max(1.0),
            "relative_error": error,
            "nonfinite": c.nonfinite,
            "capped": c.capped,
            "violations": c.violations,
            "warnings": warnings,
        });
        if scene.integrator.mode.reuses() {
            stats["passes"] = json!(self.passes);
        }
        if let (Some(all), serde_json::Value::Object(own)) = (stats.as_object_mut(), own) {
            all.extend(own);
        }
        stats
    }
}

/// Mean and variance of pixels over independent runs.
#[derive(Default)]
struct Spread {
    runs: f64,
    mean: Vec<[f64; 3]>,
    square: Vec<[f64; 3]>,
}

impl Spread {
    fn add(&mut self, sums: &Sums) {
        let pixels = sums.sum.len();
        self.mean.resize(pixels, [0.0; 3]);
        self.square.resize(pixels, [0.0; 3]);
        self.runs += 1.0;
        for p in 0..pixels {
            for ((x, mean), square) in sums.mean(p).into_iter().zip(&mut self.mean[p]).zip(&mut self.square[p]) {
                // Welford's update.
                let delta = x - *mean;
                *mean += delta / self.runs;
                *square += delta * (x - *mean);
            }
        }
    }

    fn variance(&self) -> Vec<[f64; 3]> {
        self.square.iter().map(|s| s.map(|x| x / (self.runs - 1.0))).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_numbers_take_their_place() {
        assert_eq!(numbered("a_%04d.exr", 7), "a_0007.exr");
        assert_eq!(numbered("a_%d.exr", 7), "a_7.exr");
        assert_eq!(numbered("a_###.exr", 7), "a_007.exr");
        assert_eq!(numbered("100%.exr", 7), "100%.exr");
        assert!(frame_files(Path::new("x/a.exr"), Some((0, 3))).is_err());
        let files = frame_files(Path::new("x/a#.exr"), Some((9, 10))).expect("numbered");
        assert_eq!(files[1], (Some(10), PathBuf::from("x/a10.exr")));
    }

    #[test]
    fn spread_is_the_variance_between_runs() {
        let run = |x: f64| Sums {
            width: 1,
            height: 1,
            sum: vec![[x; 4]],
            square: vec![[0.0, 0.0, 0.0, 1.0]],
            extra: vec![],
            cost: vec![],
            reservoirs: vec![],
        };
        let mut spread = Spread::default();
        [1.0, 2.0, 6.0].into_iter().for_each(|x| spread.add(&run(x)));
        assert!((spread.variance()[0][0] - 7.0).abs() < 1e-12);
    }
}
