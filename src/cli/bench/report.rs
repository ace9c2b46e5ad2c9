//! What was measured, and how it is written.

use std::fmt::Write;

use serde_json::{Value, json};

/// One run of one side.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Round {
    /// Seconds that ratios are made of: CPU time of the process on a software adapter, else wall time.
    pub seconds: f64,
    /// Wall seconds.
    pub wall: f64,
    /// Camera samples.
    pub paths: f64,
    /// Density lookups.
    pub lookups: f64,
    /// Majorant segments walked; of the bare kernels their lookups.
    pub steps: f64,
    /// Mean over pixels of the variance of a sample, channels averaged; 0 where nothing is drawn.
    pub variance: f64,
}

impl Round {
    /// Paths a second.
    pub fn paths_per_second(&self) -> f64 {
        self.paths / self.seconds
    }

    /// Segments (lookups of bare kernels) a second.
    pub fn steps_per_second(&self) -> f64 {
        self.steps / self.seconds
    }

    /// 1 / (variance of a sample · seconds of a sample).
    pub fn efficiency(&self) -> f64 {
        self.paths / (self.variance * self.seconds)
    }
}

/// One thing that was measured.
#[derive(Clone, Debug, PartialEq)]
pub struct Side {
    /// Its name in tables and files.
    pub name: String,
    /// Its runs, one a round.
    pub rounds: Vec<Round>,
}

/// Median and quartiles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Lower quartile.
    pub low: f64,
    /// Median.
    pub median: f64,
    /// Upper quartile.
    pub high: f64,
}

impl Spread {
    /// Of at least one number, by linear interpolation between the ranks.
    pub fn of(mut values: Vec<f64>) -> Spread {
        values.sort_by(f64::total_cmp);
        let at = |share: f64| {
            let rank = share * (values.len() - 1) as f64;
            let (below, above) = (values[rank.floor() as usize], values[rank.ceil() as usize]);
            below + (above - below) * rank.fract()
        };
        Spread { low: at(0.25), median: at(0.5), high: at(0.75) }
    }

    fn to_json(self) -> Value {
        json!({ "median": self.median, "quartiles": [self.low, self.high] })
    }
}

impl Side {
    /// A figure of each round.
    pub fn spread(&self, figure: impl Fn(&Round) -> f64) -> Spread {
        Spread::of(self.rounds.iter().map(figure).collect())
    }

    fn mean(&self, figure: impl Fn(&Round) -> f64) -> f64 {
        self.rounds.iter().map(figure).sum::<f64>() / self.rounds.len() as f64
    }
}

/// A figure of one side over a figure of another, round by round.
#[derive(Clone, Debug, PartialEq)]
pub struct Ratio {
    /// What it is.
    pub name: String,
    /// Over all rounds.
    pub value: Spread,
    /// The least that is aimed at, where there is an aim.
    pub target: Option<f64>,
}

impl Ratio {
    /// `figure` of `a` over `other` of `b`.
    pub fn new(
        name: &str,
        target: Option<f64>,
        (a, figure): (&Side, fn(&Round) -> f64),
        (b, other): (&Side, fn(&Round) -> f64),
    ) -> Ratio {
        let values = a.rounds.iter().zip(&b.rounds).map(|(a, b)| figure(a) / other(b)).collect();
        Ratio { name: name.into(), value: Spread::of(values), target }
    }

    /// Whether it reaches its aim.
    pub fn passes(&self) -> Option<bool> {
        self.target.map(|t| self.value.median >= t)
    }
}

/// All of one volume.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume {
    /// Its name.
    pub name: String,
    /// Everything measured on it.
    pub sides: Vec<Side>,
    /// Ratios between sides.
    pub ratios: Vec<Ratio>,
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
    /// Samples of each pixel in a round.
    pub samples: u32,
    /// One entry a volume.
    pub volumes: Vec<Volume>,
}

/// A number for people: three digits and a unit prefix.
pub fn short(x: f64) -> String {
    let (scaled, unit) = match x.abs() {
        a if a >= 1e9 => (x / 1e9, " G"),
        a if a >= 1e6 => (x / 1e6, " M"),
        a if a >= 1e3 => (x / 1e3, " k"),
        _ => (x, ""),
    };
    let digits = if scaled.abs() >= 100.0 {
        0
    } else if scaled.abs() >= 10.0 {
        1
    } else {
        2
    };
    format!("{scaled:.digits$}{unit}")
}

impl Report {
    /// What "a second" is.
    pub fn second(&self) -> &'static str {
        if self.cpu_time { "second of CPU time (one core)" } else { "second" }
    }

    /// For people.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let (width, height) = self.size;
        let _ = writeln!(
            out,
            "{} ({}), {width} × {height} pixels, {} samples a round. Rates are per {}.",
            self.adapter,
            self.backend,
            self.samples,
            self.second()
        );
        for volume in &self.volumes {
            let _ = writeln!(
                out,
                "\n{:<26}{:>11}{:>11}{:>11}{:>11}{:>10}",
                volume.name, "paths/s", "quartiles", "steps/s", "steps/path", "variance"
            );
            for side in &volume.sides {
                let paths = side.spread(Round::paths_per_second);
                let spread = format!("±{:.1} %", 50.0 * (paths.high - paths.low) / paths.median);
                let _ = writeln!(
                    out,
                    "  {:<24}{:>11}{:>11}{:>11}{:>11.1}{:>10}",
                    side.name,
                    short(paths.median),
                    spread,
                    short(side.spread(Round::steps_per_second).median),
                    side.mean(|r| r.steps / r.paths),
                    match side.mean(|r| r.variance) {
                        0.0 => String::new(),
                        v => format!("{v:.4}"),
                    },
                );
            }
            let _ = writeln!(out, "\n  {:<50}{:>8}{:>16}   target", "ratio", "median", "quartiles");
            for r in &volume.ratios {
                let quartiles = format!("{:.2} … {:.2}", r.value.low, r.value.high);
                let verdict = match (r.target, r.passes()) {
                    (Some(t), Some(true)) => format!("≥ {t}  reached"),
                    (Some(t), _) => format!("≥ {t}  MISSED"),
                    (None, _) => String::new(),
                };
                let line = format!("  {:<50}{:>8.2}{quartiles:>16}   {verdict}", r.name, r.value.median);
                let _ = writeln!(out, "{}", line.trim_end());
            }
        }
        out
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        let side = |s: &Side| {
            json!({
                "name": s.name,
                "paths_per_second": s.spread(Round::paths_per_second).to_json(),
                "paths_per_wall_second": s.spread(|r| r.paths / r.wall).to_json(),
                "steps_per_second": s.spread(Round::steps_per_second).to_json(),
                "steps_per_path": s.mean(|r| r.steps / r.paths),
                "lookups_per_path": s.mean(|r| r.lookups / r.paths),
                "variance": s.mean(|r| r.variance),
            })
        };
        let ratio = |r: &Ratio| {
            let mut value = r.value.to_json();
            value["name"] = r.name.clone().into();
            value["target"] = r.target.into();
            value["passes"] = r.passes().into();
            value
        };
        let volume = |v: &Volume| {
            json!({
                "name": v.name,
                "sides": v.sides.iter().map(side).collect::<Vec<_>>(),
                "ratios": v.ratios.iter().map(ratio).collect::<Vec<_>>(),
            })
        };
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "adapter": self.adapter,
            "backend": self.backend,
            "time": if self.cpu_time { "cpu" } else { "wall" },
            "width": self.size.0,
            "height": self.size.1,
            "samples": self.samples,
            "volumes": self.volumes.iter().map(volume).collect::<Vec<_>>(),
        })
    }

    /// Every round.
    pub fn to_csv(&self) -> String {
        let mut out = "volume,side,round,seconds,wall_seconds,paths,lookups,steps,variance\n".to_owned();
        for volume in &self.volumes {
            for side in &volume.sides {
                for (i, r) in side.rounds.iter().enumerate() {
                    let _ = writeln!(
                        out,
                        "{},{},{i},{},{},{},{},{},{}",
                        volume.name, side.name, r.seconds, r.wall, r.paths, r.lookups, r.steps, r.variance
                    );
                }
            }
        }
        out
    }
}

#[cfg(test)]
pub mod tests {
    use super::*;

    /// A report with two sides of known figures.
    pub fn example() -> Report {
        let side = |name: &str, speed: f64, variance: f64| Side {
            name: name.into(),
            rounds: (1..=5)
                .map(|i| {
                    let seconds = 0.1 * f64::from(i);
                    let paths = 1e5 * speed * f64::from(i);
                    Round { seconds, wall: 0.5 * seconds, paths, lookups: 3.0 * paths, steps: 4.0 * paths, variance }
                })
                .collect(),
        };
        let (a, b) = (side("default & best", 2.0, 0.5), side("bare", 4.0, 0.0));
        let ratio =
            Ratio::new("steps over lookups", Some(0.6), (&a, Round::steps_per_second), (&b, Round::steps_per_second));
        Report {
            adapter: "a <b>".into(),
            backend: "vulkan".into(),
            cpu_time: true,
            size: (256, 256),
            samples: 8,
            volumes: vec![Volume { name: "cumulus 128³".into(), sides: vec![a, b], ratios: vec![ratio] }],
        }
    }

    #[test]
    fn spread_is_median_and_quartiles() {
        let s = Spread::of(vec![5.0, 1.0, 4.0, 2.0, 3.0]);
        assert_eq!((s.low, s.median, s.high), (2.0, 3.0, 4.0));
        let s = Spread::of(vec![1.0, 2.0]);
        assert_eq!((s.low, s.median, s.high), (1.25, 1.5, 1.75));
        assert_eq!(Spread::of(vec![7.0]).median, 7.0);
    }

    #[test]
    fn figures_of_a_round() {
        let r = Round { seconds: 2.0, wall: 1.0, paths: 100.0, lookups: 300.0, steps: 500.0, variance: 0.25 };
        assert_eq!((r.paths_per_second(), r.steps_per_second(), r.efficiency()), (50.0, 250.0, 200.0));
    }

    #[test]
    fn numbers_are_short() {
        let all = [0.5, 12.34, 999.0, 1234.0, 45_678.0, 5_012_345.0, 2.5e9];
        assert_eq!(all.map(short), ["0.50", "12.3", "999", "1.23 k", "45.7 k", "5.01 M", "2.50 G"]);
    }

    #[test]
    fn table_json_and_csv_tell_the_same() {
        let mut report = example();
        let ratio = &report.volumes[0].ratios[0];
        assert!((ratio.value.median - 0.5).abs() < 1e-12 && ratio.passes() == Some(false));
        let table = report.table();
        assert!(table.contains("MISSED") && table.contains("2.00 M") && table.contains("one core"), "{table}");
        report.volumes[0].ratios[0].target = Some(0.4);
        assert!(report.table().contains("≥ 0.4  reached"));
        let json: Value = serde_json::from_str(&report.to_json().to_string()).expect("valid JSON");
        assert_eq!(json["volumes"][0]["sides"][0]["paths_per_second"]["median"], 2e6);
        assert_eq!(json["volumes"][0]["sides"][0]["paths_per_wall_second"]["median"], 4e6);
        assert_eq!(json["volumes"][0]["ratios"][0]["passes"], true);
        let csv = report.to_csv();
        assert_eq!(csv.lines().count(), 11);
        assert!(csv.lines().all(|l| l.split(',').count() == 9), "{csv}");
    }
}
