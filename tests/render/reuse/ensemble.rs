//! Independent histories and the gates of /shared/docs/restir.md, 6.1.

use super::*;

/// Pixels along the side of a tile.
const TILE: usize = 8;
/// Limits beyond which an ensemble is drawn again, longer: standard errors of the whole picture's mean, the mean of the
/// tiles' z², the greatest of the tiles' z. Correct pictures have tails that go beyond what normal numbers would.
const WHOLE: f64 = 4.0;
const SQUARE: f64 = 4.0;
const WORST: f64 = 5.0;
/// Relative error of sums in 32 bits, about: tiles of sky have no other.
const ROUNDING: f64 = 1e-5;
/// How much longer.
const LONGER: u32 = 4;
/// Histories between looks at how well their mean is known.
const BATCH: u32 = 50;

/// A renderer and the picture that histories end at.
pub struct Stage<'a> {
    name: String,
    renderer: &'a mut Renderer,
    truth: Sums,
}

/// How histories go: their scenes, given how many frames are left, and the number of frames before the last one.
pub struct Course<'a> {
    pub name: &'a str,
    pub last: u32,
    pub histories: u32,
    pub at: &'a dyn Fn(u32) -> Scene,
}

/// What an ensemble says: biases and standard errors are relative to the picture's mean.
#[derive(Clone, Debug)]
pub struct Verdict {
    pub bias: f64,
    pub error: f64,
    pub channel: f64,
    pub square: f64,
    pub worst: f64,
    /// The greatest bias of a tile, relative to its own mean, and its standard error.
    pub tile: [f64; 2],
}

impl Verdict {
    pub fn trips(&self) -> bool {
        let whole = (self.bias / self.error).abs().max(self.channel);
        !(whole <= WHOLE && self.square <= SQUARE && self.worst <= WORST)
    }

    fn say(&self, name: &str, histories: u32) {
        eprintln!(
            "{name}: {:+.2} ± {:.2} %, χ² {:.2}, worst tile {:.1} ({:.2} ± {:.2} %), worst channel {:.1} ({histories} histories)",
            100.0 * self.bias,
            100.0 * self.error,
            self.square,
            self.worst,
            100.0 * self.tile[0],
            100.0 * self.tile[1],
            self.channel
        );
    }
}

/// Factor on the number of histories: tests are short, a look at small biases is not.
fn factor() -> u32 {
    std::env::var("NEPHELE_HISTORIES").ok().and_then(|f| f.parse().ok()).unwrap_or(1)
}

impl<'a> Stage<'a> {
    /// The path tracer's picture of `scene`, by `samples` of each pixel.
    pub fn new(name: &str, renderer: &'a mut Renderer, scene: &Scene, samples: u32) -> Stage<'a> {
        let begin = std::time::Instant::now();
        let mut scene = scene.clone();
        scene.integrator.mode = Mode::Path;
        scene.integrator.seed = 4_000_000_000;
        update(renderer, &scene);
        accumulate(renderer, samples * factor(), super::super::WHOLE);
        let truth = renderer.sums().expect("a film");
        eprintln!("{name}: reference in {:.1} s", begin.elapsed().as_secs_f64());
        Stage { name: name.to_owned(), renderer, truth }
    }

    /// The same picture, drawn by another renderer.
    pub fn with<'b>(&self, renderer: &'b mut Renderer) -> Stage<'b> {
        Stage { name: self.name.clone(), renderer, truth: self.truth.clone() }
    }

    /// Draws histories with seeds from `seed` on; compares them with the reference.
    fn verdict(&mut self, histories: u32, seed: u32, draw: &dyn Fn(&mut Renderer, u32) -> Sums) -> Verdict {
        let mut spread = Spread::default();
        self.draw(&mut spread, histories, seed, draw);
        self.compare(&spread)
    }

    fn tiles(&self) -> (usize, usize) {
        ((self.truth.width as usize).div_ceil(TILE), (self.truth.height as usize).div_ceil(TILE))
    }

    fn draw(&mut self, spread: &mut Spread, histories: u32, seed: u32, draw: &dyn Fn(&mut Renderer, u32) -> Sums) {
        let (across, down) = self.tiles();
        for k in 0..histories {
            let sums = draw(self.renderer, seed + k);
            spread.add(&parts(&sums, across, down));
        }
    }

    /// What has been drawn against the reference.
    fn compare(&self, spread: &Spread) -> Verdict {
        let (width, height) = (self.truth.width as usize, self.truth.height as usize);
        let (across, down) = self.tiles();
        let truth = parts(&self.truth, across, down);
        let mut errors = vec![0.0; truth.len()];
        for p in 0..width * height {
            let variance = self.truth.variance(p).expect("more than one sample");
            let tile = p % width / TILE + across * (p / width / TILE);
            errors[tile] += variance.iter().sum::<f64>() / 9.0;
            (0..3).for_each(|c| errors[across * down + c] += variance[c]);
            errors[across * down + 3] += variance.iter().sum::<f64>() / 9.0;
        }
        let n = spread.n;
        let error = |i: usize| {
            let rounding = (ROUNDING * truth[i]).powi(2);
            (spread.square[i] / (n - 1.0) / n + errors[i] + rounding).sqrt()
        };
        let z = |i: usize| (spread.mean[i] - truth[i]) / error(i);
        let whole = across * down + 3;
        let mean = truth[whole];
        // Tiles of hardly anything but sky say nothing.
        let tiles: Vec<usize> = (0..across * down).filter(|&t| truth[t] > 1e-3 * mean).collect();
        let squares = tiles.iter().map(|&t| z(t) * z(t));
        let relative = tiles.iter().map(|&t| [(spread.mean[t] - truth[t]).abs() / truth[t], error(t) / truth[t]]);
        Verdict {
            bias: (spread.mean[whole] - mean) / mean,
            error: error(whole) / mean,
            channel: (across * down..whole).map(|c| z(c).abs()).fold(0.0, f64::max),
            square: squares.sum::<f64>() / tiles.len() as f64,
            worst: tiles.iter().fold(0.0, |worst, &t| z(t).abs().max(worst)),
            tile: relative.fold([0.0; 2], |worst, tile| if tile[0] > worst[0] { tile } else { worst }),
        }
    }

    /// Draws histories until the error of their mean is below `least`, or `course.histories` of them: what they say.
    pub fn until(&mut self, course: &Course, least: f64) -> Verdict {
        let mut spread = Spread::default();
        loop {
            let drawn = spread.n as u32;
            self.draw(&mut spread, BATCH, 1 + drawn, &|renderer, seed| history(renderer, course, seed));
            let verdict = self.compare(&spread);
            if verdict.error < least || spread.n as u32 >= course.histories {
                verdict.say(&format!("{}, {}", self.name, course.name), spread.n as u32);
                return verdict;
            }
        }
    }

    /// Fails where histories differ from the reference, twice.
    pub fn holds(&mut self, course: &Course) {
        let name = format!("{}, {}", self.name, course.name);
        self.twice(&name, course.histories * factor(), &|renderer, seed| history(renderer, course, seed));
    }

    /// Fails where means of `samples` frames of a still picture differ from the reference, twice.
    pub fn holds_still(&mut self, samples: u32, histories: u32, scene: &Scene) {
        let name = format!("{}, cap {}", self.name, scene.restir.still_cap);
        let still = |renderer: &mut Renderer, seed: u32| {
            let mut scene = scene.clone();
            scene.integrator.seed = seed;
            update(renderer, &scene);
            renderer.restart();
            renderer.reuse_mut().expect("the mode keeps reservoirs").rewind();
            accumulate(renderer, samples, Work { samples: 1, groups: u32::MAX });
            renderer.sums().expect("a film")
        };
        self.twice(&name, histories * factor(), &still);
    }

    fn twice(&mut self, name: &str, histories: u32, draw: &dyn Fn(&mut Renderer, u32) -> Sums) {
        let begin = std::time::Instant::now();
        let mut verdict = self.verdict(histories, 1, draw);
        verdict.say(name, histories);
        if verdict.trips() {
            verdict = self.verdict(LONGER * histories, 1_000_000, draw);
            verdict.say(&format!("{name}, again"), LONGER * histories);
        }
        eprintln!("    {:.1} s", begin.elapsed().as_secs_f64());
        assert!(!verdict.trips(), "{name}: {verdict:?}");
    }

    /// Whether histories differ from the reference.
    pub fn sees(&mut self, course: &Course) -> bool {
        let verdict = self.verdict(course.histories, 1, &|renderer, seed| history(renderer, course, seed));
        verdict.say(&format!("{}, {}", self.name, course.name), course.histories);
        verdict.trips()
    }
}

/// Sums of tiles over all channels, of the three channels, and of the whole.
fn parts(sums: &Sums, across: usize, down: usize) -> Vec<f64> {
    let mut all = vec![0.0; across * down + 4];
    let width = sums.width as usize;
    for p in 0..sums.sum.len() {
        let mean = sums.mean(p);
        let grey = (mean[0] + mean[1] + mean[2]) / 3.0;
        all[p % width / TILE + across * (p / width / TILE)] += grey;
        (0..3).for_each(|c| all[across * down + c] += mean[c]);
        all[across * down + 3] += grey;
    }
    all
}

/// Running means and sums of squares of several numbers.
#[derive(Default)]
struct Spread {
    n: f64,
    mean: Vec<f64>,
    square: Vec<f64>,
}

impl Spread {
    fn add(&mut self, values: &[f64]) {
        self.mean.resize(values.len(), 0.0);
        self.square.resize(values.len(), 0.0);
        self.n += 1.0;
        for ((mean, square), x) in self.mean.iter_mut().zip(&mut self.square).zip(values) {
            let delta = x - *mean;
            *mean += delta / self.n;
            *square += delta * (x - *mean);
        }
    }
}

pub fn update(renderer: &mut Renderer, scene: &Scene) {
    let size = (scene.film.width, scene.film.height);
    renderer.update(scene, size, None).unwrap_or_else(|e| panic!("{e}"));
}

/// A picture of `samples` of each pixel, as it stands still.
pub fn accumulated(renderer: &mut Renderer, scene: &Scene, samples: u32) -> Sums {
    update(renderer, scene);
    accumulate(renderer, samples, Work { samples: 1, groups: u32::MAX });
    renderer.sums().expect("a film")
}

/// One frame as while things move.
pub fn frame(renderer: &mut Renderer, scene: &Scene, rewinds: bool) {
    update(renderer, scene);
    let reuse = renderer.reuse_mut().expect("the mode keeps reservoirs");
    if rewinds {
        reuse.rewind();
    }
    renderer.set_moving(true);
    renderer.restart();
    renderer.submit(Work { samples: 1, groups: u32::MAX }).unwrap_or_else(|e| panic!("{e}"));
}

/// The last frame of a history.
pub fn history(renderer: &mut Renderer, course: &Course, seed: u32) -> Sums {
    for left in (0..=course.last).rev() {
        let mut scene = (course.at)(left);
        scene.integrator.seed = seed;
        frame(renderer, &scene, left == course.last);
    }
    let sums = renderer.sums().expect("a film");
    let counters = renderer.film.count(&renderer.gpu).expect("counters");
    assert_eq!(counters.nonfinite, 0, "values that are not finite");
    renderer.set_moving(false);
    sums
}
