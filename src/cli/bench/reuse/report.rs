//! What was measured, and how it is written.

use std::collections::BTreeMap;
use std::fmt::Write;

use serde_json::{Value, json};

use super::figures::{EVENTS, Estimate, Quality, Scores};
use super::plan::{Framing, Motion, OURS, PATH, TURN, WINDOW_LINES};

/// Share of the least error above which the noise of a reference is told: it was not drawn for longer.
const LOUD: f64 = 0.1;

/// A side under one motion of the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Its name.
    pub side: String,
    /// Samples of a frame.
    pub samples: u32,
    /// Candidates of a sample, where it has some.
    pub candidates: Option<u32>,
    /// Errors of the judged frame and seconds of a frame, seed by seed.
    pub scores: Scores,
    /// Energy over that of the reference, less 1.
    pub bias: Estimate,
    /// Correlation of the errors of the last two frames, and that without the worst pixels.
    pub lag: [Estimate; 2],
    /// Events per pixel and frame, in the order of [`EVENTS`].
    pub events: [f64; 4],
    /// Wall seconds of each pass in a frame.
    pub passes: BTreeMap<&'static str, f64>,
    /// Bytes of a pixel that are kept for reuse.
    pub bytes: f64,
}

/// The mean of the first frames of a still picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Mean {
    /// The side.
    pub side: String,
    /// Frames.
    pub frames: u32,
    /// Errors of the mean and seconds of all its frames, seed by seed.
    pub scores: Scores,
}

/// A volume with so many scatterings under one motion of the camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// Volume.
    pub volume: String,
    /// What of a window's picture is drawn.
    pub framing: Framing,
    /// Scatterings at most.
    pub bounces: u32,
    /// Motion.
    pub motion: Motion,
    /// Seeds.
    pub seeds: Vec<u32>,
    /// The path tracer's shadow estimator.
    pub shadow: &'static str,
    /// What errors are measured against.
    pub reference: Quality,
    /// Sides.
    pub rows: Vec<Row>,
    /// Means of frames, of a still camera.
    pub means: Vec<Mean>,
}

impl Case {
    /// What it is, in words.
    pub fn title(&self) -> String {
        let bounces = if self.bounces == 1 { "bounce" } else { "bounces" };
        format!("{}, {}, {} {bounces}, {}", self.volume, self.framing.name(), self.bounces, self.motion.name())
    }

    /// The row of a side.
    pub fn row(&self, side: &str) -> Option<&Row> {
        self.rows.iter().find(|r| r.side == side)
    }

    /// How many times better ours is than a side at equal time.
    pub fn gain(&self, side: &Scores, of: fn(&Scores) -> &Vec<f64>) -> Estimate {
        let none = Estimate { value: f64::NAN, error: f64::NAN };
        self.row(OURS).map_or(none, |ours| side.over(&ours.scores, of))
    }

    /// How many times better a mean of frames is than the path tracer at equal time.
    pub fn mean_gain(&self, mean: &Mean, of: fn(&Scores) -> &Vec<f64>) -> Estimate {
        let none = Estimate { value: f64::NAN, error: f64::NAN };
        self.row(PATH).map_or(none, |path| path.scores.over(&mean.scores, of))
    }

    /// Noise of the reference over the least error that is measured against it, with or without the worst pixels.
    fn loudness(&self) -> f64 {
        let share = |noise: f64, of: fn(&Scores) -> &Vec<f64>| {
            let rows = self.rows.iter().map(|r| &r.scores);
            let all = rows.chain(self.means.iter().map(|m| &m.scores)).map(|s| s.mean(of).value);
            noise / all.fold(f64::INFINITY, f64::min)
        };
        share(self.reference.noise, rel_mse).max(share(self.reference.v99, v99))
    }
}

/// The whole report.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Name of the adapter.
    pub adapter: String,
    /// Its API.
    pub backend: String,
    /// Whether time is CPU time of the process, else wall time.
    pub cpu_time: bool,
    /// Pixels along the sides of the picture.
    pub size: (u32, u32),
    /// Frames of a history.
    pub frames: u32,
    /// All cases.
    pub cases: Vec<Case>,
}

/// The relative mean squared errors of scores.
pub fn rel_mse(s: &Scores) -> &Vec<f64> {
    &s.rel_mse
}

/// Those without the worst pixels.
pub fn v99(s: &Scores) -> &Vec<f64> {
    &s.v99
}

impl Report {
    /// For people.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let _ = writeln!(
            out,
            "{} ({}), {} × {} pixels, {} seeds, {}. The last of {} frames is judged; a moving camera turns by {TURN}° a \
             frame. whole: all of a window's picture; middle: that of one with {WINDOW_LINES} lines, pixel by pixel.\nrelMSE is the mean of (a − b)² / (b² + 0.01) of a frame, V99 the same without the worst 1 % of \
             pixels. × ours: relMSE × time over that of ours,\nwhich is how many times better ours is at equal time; \
             ± one standard error over seeds.",
            self.adapter,
            self.backend,
            self.size.0,
            self.size.1,
            self.cases.first().map_or(0, |c| c.seeds.len()),
            if self.cpu_time { "CPU time of all threads" } else { "wall time" },
            self.frames,
        );
        for case in &self.cases {
            case.write(&mut out);
        }
        out
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "adapter": self.adapter,
            "backend": self.backend,
            "time": if self.cpu_time { "cpu" } else { "wall" },
            "width": self.size.0,
            "height": self.size.1,
            "frames": self.frames,
            "degrees_per_frame": TURN,
            "cases": self.cases.iter().map(Case::to_json).collect::<Vec<_>>(),
        })
    }

    /// Every seed of every side; of a mean of frames, `frames` is their number, and else 1.
    pub fn to_csv(&self) -> String {
        let mut out = "volume,framing,bounces,motion,side,frames,seed,rel_mse,v99,energy,seconds\n".to_owned();
        for case in &self.cases {
            let rows = case.rows.iter().map(|r| (&r.side, 1, &r.scores));
            let means = case.means.iter().map(|m| (&m.side, m.frames, &m.scores));
            // A mean is another measurement than the judged frame, also where it is of one frame.
            let kinds = rows.map(|r| ("", r)).chain(means.map(|m| (" mean", m)));
            for (kind, (side, frames, scores)) in kinds {
                let volume = case.volume.replace('"', "\"\"");
                for (i, seed) in case.seeds.iter().enumerate().take(scores.seconds.len()) {
                    let _ = writeln!(
                        out,
                        "\"{volume}\",{},{},{},{side}{kind},{frames},{seed},{},{},{},{}",
                        case.framing.name(),
                        case.bounces,
                        case.motion.name(),
                        scores.rel_mse[i],
                        scores.v99[i],
                        scores.energy[i],
                        scores.seconds[i]
                    );
                }
            }
        }
        out
    }
}

impl Case {
    fn write(&self, out: &mut String) {
        let quality = self.reference;
        let _ = writeln!(
            out,
            "\n{} (shadow rays of the path tracer: {}; reference: {} samples, noise {:.0} % of the least error{})",
            self.title(),
            self.shadow,
            quality.samples,
            100.0 * self.loudness(),
            if self.loudness() > LOUD { ", TOO MUCH" } else { "" }
        );
        let _ = writeln!(
            out,
            "  {:<9}{:>8}{:>11}{:>11}{:>6}{:>11}{:>9}{:>17}{:>17}{:>16}{:>13}{:>13}{:>9}{:>8}{:>7}",
            "side",
            "samples",
            "candidates",
            "relMSE",
            "± %",
            "V99",
            "ms",
            "× ours",
            "× ours, V99",
            "energy %",
            "lag-1",
            "lag-1, V99",
            "lookups",
            "steps",
            "bytes"
        );
        for r in &self.rows {
            let (error, robust, seconds) =
                (r.scores.mean(rel_mse), r.scores.mean(v99), r.scores.mean(|s| &s.seconds).value);
            let _ = writeln!(
                out,
                "  {:<9}{:>8}{:>11}{:>11}{:>6.0}{:>11}{:>9.1}{:>17}{:>17}{:>16}{:>13}{:>13}{:>9.2}{:>8.2}{:>7.0}",
                r.side,
                r.samples,
                r.candidates.map_or(String::new(), |n| n.to_string()),
                number(error.value),
                100.0 * error.error / error.value,
                number(robust.value),
                1e3 * seconds,
                ratio(self.gain(&r.scores, rel_mse)),
                ratio(self.gain(&r.scores, v99)),
                both(Estimate { value: 100.0 * r.bias.value, error: 100.0 * r.bias.error }, 2),
                both(r.lag[0], 2),
                both(r.lag[1], 2),
                r.events[0],
                r.events[1],
                r.bytes
            );
        }
        for r in self.rows.iter().filter(|r| !r.passes.is_empty()) {
            let passes: Vec<String> =
                r.passes.iter().map(|(name, seconds)| format!("{name} {:.1}", 1e3 * seconds)).collect();
            let _ = writeln!(out, "  {}: wall ms of passes: {}", r.side, passes.join(", "));
        }
        for m in &self.means {
            let (error, gain) = (m.scores.mean(rel_mse), self.mean_gain(m, rel_mse));
            let _ = writeln!(
                out,
                "  {}: mean of {:>2} still frames: relMSE {} ± {:.0} %, {:.0} ms; better than path at equal time by {} (V99: {})",
                m.side,
                m.frames,
                number(error.value),
                100.0 * error.error / error.value,
                1e3 * m.scores.mean(|s| &s.seconds).value,
                ratio(gain),
                ratio(self.mean_gain(m, v99))
            );
        }
    }

    fn to_json(&self) -> Value {
        let row = |r: &Row| {
            let events: BTreeMap<&str, f64> = EVENTS.into_iter().zip(r.events).collect();
            json!({
                "name": r.side,
                "samples_per_frame": r.samples,
                "candidates": r.candidates,
                "rel_mse": estimate(r.scores.mean(rel_mse)),
                "v99": estimate(r.scores.mean(v99)),
                "seconds_per_frame": estimate(r.scores.mean(|s| &s.seconds)),
                "equal_time_ratio_to_ours": estimate(self.gain(&r.scores, rel_mse)),
                "equal_time_ratio_to_ours_v99": estimate(self.gain(&r.scores, v99)),
                "energy_bias": estimate(r.bias),
                "lag1_correlation": estimate(r.lag[0]),
                "lag1_correlation_v99": estimate(r.lag[1]),
                "per_pixel_and_frame": events,
                "pass_seconds": r.passes,
                "bytes_per_pixel": r.bytes,
            })
        };
        let mean = |m: &Mean| {
            json!({
                "name": m.side,
                "frames": m.frames,
                "rel_mse": estimate(m.scores.mean(rel_mse)),
                "v99": estimate(m.scores.mean(v99)),
                "seconds": estimate(m.scores.mean(|s| &s.seconds)),
                "equal_time_ratio_of_path": estimate(self.mean_gain(m, rel_mse)),
                "equal_time_ratio_of_path_v99": estimate(self.mean_gain(m, v99)),
            })
        };
        json!({
            "volume": self.volume,
            "framing": self.framing.name(),
            "bounces": self.bounces,
            "motion": self.motion.name(),
            "seeds": self.seeds,
            "path_shadow_estimator": self.shadow,
            "reference": {
                "samples": self.reference.samples,
                "noise": self.reference.noise,
                "noise_v99": self.reference.v99,
                "noise_share": self.loudness(),
                "energy_error": self.reference.energy_error,
            },
            "sides": self.rows.iter().map(row).collect::<Vec<_>>(),
            "still_means": self.means.iter().map(mean).collect::<Vec<_>>(),
        })
    }
}

fn estimate(e: Estimate) -> Value {
    json!({ "value": e.value, "standard_error": e.error })
}

/// Three digits of a positive number, whatever its size.
fn number(x: f64) -> String {
    if (1e-3..1e4).contains(&x) {
        let digits = (2.0 - x.log10().floor()).max(0.0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.2e}")
    }
}

/// A ratio and its error, with as many digits as small ones need.
fn ratio(e: Estimate) -> String {
    both(e, if e.value < 0.1 { 4 } else { 2 })
}

fn both(e: Estimate, digits: usize) -> String {
    format!("{:.digits$} ± {:.digits$}", e.value, e.error)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::cli::bench::reuse::figures::Error;

    /// Scores of three seeds around an error.
    fn scores(error: f64, seconds: f64) -> Scores {
        let mut scores = Scores::default();
        for factor in [0.9, 1.0, 1.1] {
            scores.push(Error { rel_mse: error * factor, v99: 0.5 * error * factor, energy: 1.001 }, seconds);
        }
        scores
    }

    /// A report in which ours takes twice the time of the path tracer for an eighth of the error.
    pub fn example() -> Report {
        let row = |side: &str, error: f64, seconds: f64| Row {
            side: side.into(),
            samples: 1,
            candidates: (side != PATH).then_some(4),
            scores: scores(error, seconds),
            bias: Estimate { value: 0.001, error: 0.0005 },
            lag: [0.25, 0.2].map(|value| Estimate { value, error: 0.01 }),
            events: [4.0, 8.0, 1.0, 0.5],
            passes: if side == PATH { BTreeMap::new() } else { [("shade", 0.01), ("merge", 0.002)].into() },
            bytes: if side == PATH { 0.0 } else { 132.0 },
        };
        let mean =
            |frames: u32, error: f64| Mean { side: OURS.into(), frames, scores: scores(error, f64::from(frames)) };
        let case = |motion| Case {
            volume: "a <b>".into(),
            framing: Framing::Middle,
            bounces: 1,
            motion,
            seeds: motion.seeds(3).collect(),
            shadow: "ratio",
            reference: Quality { samples: 512, noise: 0.001, v99: 0.0001, energy_error: 0.0001 },
            rows: vec![row(PATH, 0.8, 1.0), row("control", 0.3, 2.0), row(OURS, 0.1, 2.0)],
            means: if motion == Motion::Still { vec![mean(1, 0.4), mean(4, 0.1)] } else { Vec::new() },
        };
        Report {
            adapter: "an adapter".into(),
            backend: "vulkan".into(),
            cpu_time: true,
            size: (8, 6),
            frames: 12,
            cases: Motion::ALL.map(case).into(),
        }
    }

    #[test]
    fn table_json_and_csv_tell_the_same() {
        let report = example();
        let (table, json) = (report.table(), report.to_json());
        let case = &json["cases"][0];
        let value = |v: &Value| v["value"].as_f64().expect("a number");
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-9, "{a} {b}");
        near(value(&case["sides"][0]["equal_time_ratio_to_ours"]), 4.0);
        near(value(&case["sides"][1]["equal_time_ratio_to_ours_v99"]), 3.0);
        near(value(&case["sides"][2]["equal_time_ratio_to_ours"]), 1.0);
        near(value(&case["still_means"][1]["equal_time_ratio_of_path"]), 2.0);
        near(case["reference"]["noise_share"].as_f64().expect("a number"), 0.01);
        assert_eq!(case["sides"][2]["per_pixel_and_frame"]["cell_steps"], 8.0);
        assert_eq!(json["cases"][1]["still_means"], json!([]));
        assert!(table.contains("4.00 ± ") && table.contains("0.25 ± 0.01") && table.contains("0.10 ± 0.05"), "{table}");
        assert!(table.contains("merge 2.0, shade 10.0") && !table.contains("TOO MUCH"), "{table}");
        let csv = report.to_csv();
        assert_eq!(csv.lines().count(), 1 + 3 * (2 * 3 + 2));
        assert!(csv.lines().all(|l| l.split(',').count() == 11), "{csv}");
    }

    #[test]
    fn a_loud_reference_is_told_and_what_is_missing_is_null() {
        let mut report = example();
        report.cases[0].reference.noise = 0.02;
        report.cases[0].rows.remove(2);
        assert!(report.table().contains("TOO MUCH"));
        let json: Value = serde_json::from_str(&report.to_json().to_string()).expect("valid JSON");
        assert_eq!(json["cases"][0]["sides"][0]["equal_time_ratio_to_ours"]["value"], Value::Null);
    }
}
