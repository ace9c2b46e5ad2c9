//! What was measured, and how it is written.

use std::fmt::Write;

use serde_json::{Value, json};

use crate::cli::bench::report::{Spread, short};

use super::figures::{Case, March, Measured, Saving};
use super::plan::{Row, bound_name, name};

/// Standard errors beyond which the mean of a row is told apart from the baseline's: once in 15 000 rows by chance.
const DISTINCT: f64 = 4.0;

/// The whole report.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Name of the adapter.
    pub adapter: String,
    /// Its API.
    pub backend: String,
    /// Whether time is CPU time of the process, else wall time.
    pub cpu_time: bool,
    /// Pixels along a side of the picture.
    pub size: u32,
    /// Volumes and settings.
    pub cases: Vec<Case>,
    /// Decomposition.
    pub savings: Vec<Saving>,
    /// Ray marching.
    pub marches: Vec<March>,
}

impl Report {
    /// For people.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let time = if self.cpu_time { "CPU time (one core)" } else { "wall time" };
        let _ = writeln!(
            out,
            "{} ({}), {size} × {size} pixels. Efficiency is 1 / (variance · {time}) and 1 / (variance · (lookups + \
             steps)), over that of the first row.",
            self.adapter,
            self.backend,
            size = self.size
        );
        for case in &self.cases {
            let _ = writeln!(out, "\n{}, {} (optical thickness {})", case.volume, case.setting, case.thickness);
            let _ = writeln!(
                out,
                "  {:<52}{:>9}{:>9}{:>8}{:>7}{:>11}{:>11}{:>6}{:>9}{:>9}{:>10}{:>7}",
                "free flight · transmittance · bound · control",
                "lookups",
                "steps",
                "shadow",
                "null",
                "paths/s",
                "variance",
                "± %",
                "eff/time",
                "eff/work",
                "mean",
                "z"
            );
            let base = &case.rows[0];
            for m in &case.rows {
                let note = match m.bias() {
                    Some(_) => format!("  biased: {:+.2} %", 100.0 * (m.mean() / base.mean() - 1.0)),
                    None if m.z(base).abs() > DISTINCT => "  DIFFERS".into(),
                    None => String::new(),
                };
                let _ = writeln!(
                    out,
                    "  {:<52}{:>9.2}{:>9.2}{:>8.2}{:>7.2}{:>11}{:>11}{:>6.0}{:>9.3}{:>9.3}{:>10.5}{:>7.1}{note}",
                    name(&m.row.tracking),
                    m.per_path(|r| r.lookups),
                    m.per_path(|r| r.steps),
                    m.per_path(|r| r.shadows),
                    m.null_ratio(),
                    short(1.0 / m.seconds()),
                    significant(m.variance()),
                    100.0 * m.variance_error(),
                    m.efficiency() / base.efficiency(),
                    m.work_efficiency() / base.work_efficiency(),
                    m.mean(),
                    m.z(base)
                );
            }
            let all = |_: &Row| true;
            let (time, work) = (case.best(all, Measured::efficiency), case.best(all, Measured::work_efficiency));
            let _ =
                writeln!(out, "  Best by time: {}; by work: {}.", name(&time.row.tracking), name(&work.row.tracking));
        }
        if !self.savings.is_empty() {
            let _ = writeln!(
                out,
                "\n{:<30}{:<12}{:>10}{:>16}{:>8}{:>14}",
                "lookups of free flights", "bound", "delta", "decomposition", "ratio", "1 − ⟨µc/µ̄⟩"
            );
            for s in &self.savings {
                let _ = writeln!(
                    out,
                    "{:<30}{:<12}{:>10.3}{:>16.3}{:>8.3}{:>14.3}",
                    s.medium,
                    s.bound,
                    s.delta,
                    s.decomposition,
                    s.ratio(),
                    s.predicted
                );
            }
        }
        for m in &self.marches {
            let _ = writeln!(out, "\n{}, {}: error against the size of steps", m.medium, m.estimator);
            for [step, error, deviation] in &m.points {
                let _ = writeln!(out, "  {step:>6} voxels {:>+9.3} ± {:.3} %", 100.0 * error, 100.0 * deviation);
            }
        }
        out
    }

    /// For programs.
    pub fn to_json(&self) -> Value {
        let case = |c: &Case| {
            let base = &c.rows[0];
            let of_row = |m: &Measured| row_json(m, base);
            json!({
                "volume": c.volume,
                "setting": c.setting,
                "thickness": c.thickness,
                "rows": c.rows.iter().map(of_row).collect::<Vec<_>>(),
            })
        };
        let saving = |s: &Saving| {
            json!({
                "medium": s.medium,
                "bound": s.bound,
                "delta_lookups": s.delta,
                "decomposition_lookups": s.decomposition,
                "ratio": s.ratio(),
                "predicted": s.predicted,
            })
        };
        let march = |m: &March| {
            let point = |p: &[f64; 3]| json!({ "step": p[0], "error": p[1], "standard_error": p[2] });
            json!({
                "medium": m.medium,
                "estimator": m.estimator,
                "points": m.points.iter().map(point).collect::<Vec<_>>(),
            })
        };
        json!({
            "version": env!("CARGO_PKG_VERSION"),
            "adapter": self.adapter,
            "backend": self.backend,
            "time": if self.cpu_time { "cpu" } else { "wall" },
            "width": self.size,
            "height": self.size,
            "cases": self.cases.iter().map(case).collect::<Vec<_>>(),
            "decomposition": self.savings.iter().map(saving).collect::<Vec<_>>(),
            "ray_marching": self.marches.iter().map(march).collect::<Vec<_>>(),
        })
    }

    /// Every round of every row.
    pub fn to_csv(&self) -> String {
        let mut out = "volume,setting,group,row,round,seconds,wall_seconds,paths,lookups,steps,null_collisions,\
                       real_collisions,shadow_rays,faults,violations,variance,mean,mean_variance,bound_bytes,bound_seconds\n"
            .to_owned();
        for case in &self.cases {
            for m in &case.rows {
                for (i, r) in m.rounds.iter().enumerate() {
                    let head = [&case.volume, &case.setting, m.row.group.name(), &name(&m.row.tracking)]
                        .map(|text| format!("\"{}\"", text.replace('"', "\"\"")));
                    let figures = [
                        r.seconds,
                        r.wall,
                        r.paths,
                        r.lookups,
                        r.steps,
                        r.nulls,
                        r.reals,
                        r.shadows,
                        r.faults,
                        r.violations,
                        r.variance,
                        r.mean,
                        r.mean_variance,
                    ]
                    .map(|x| x.to_string());
                    let (head, figures) = (head.join(","), figures.join(","));
                    let _ = writeln!(out, "{head},{i},{figures},{},{}", m.bound_bytes, m.bound_seconds);
                }
            }
        }
        out
    }
}

/// Three digits of a positive number, whatever its size.
fn significant(x: f64) -> String {
    if (1e-3..1e4).contains(&x) {
        let digits = (2.0 - x.log10().floor()).max(0.0) as usize;
        format!("{x:.digits$}")
    } else {
        format!("{x:.2e}")
    }
}

fn row_json(m: &Measured, base: &Measured) -> Value {
    let t = &m.row.tracking;
    let rates = Spread::of(m.rounds.iter().map(|r| r.paths / r.seconds).collect());
    json!({
        "name": name(t),
        "group": m.row.group.name(),
        "free_flight": t.free_flight.name(),
        "transmittance": t.transmittance.name(),
        "bound": bound_name(t),
        "control": t.control.name(),
        "majorant_factor": t.majorant_factor,
        "biased": m.bias(),
        "lookups_per_path": m.per_path(|r| r.lookups),
        "steps_per_path": m.per_path(|r| r.steps),
        "shadow_rays_per_path": m.per_path(|r| r.shadows),
        "null_ratio": m.null_ratio(),
        "faults": m.sum(|r| r.faults),
        "violations": m.sum(|r| r.violations),
        "paths": m.sum(|r| r.paths),
        "paths_per_second": { "best": 1.0 / m.seconds(), "median": rates.median, "quartiles": [rates.low, rates.high] },
        "variance": m.variance(),
        "variance_relative_error": m.variance_error(),
        "efficiency_by_time": m.efficiency() / base.efficiency(),
        "efficiency_by_work": m.work_efficiency() / base.work_efficiency(),
        "mean": m.mean(),
        "standard_error": m.error(),
        "z": m.z(base),
        "relative_difference": m.mean() / base.mean() - 1.0,
        "bound_bytes": m.bound_bytes,
        "bound_seconds": m.bound_seconds,
    })
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::cli::bench::tracking::figures::tests::measured;
    use crate::cli::bench::tracking::plan::{baseline, rows};
    use crate::scene::{FreeFlight, Tracking, Transmittance};

    /// A report of a baseline, a row four times as good, and a biased one.
    pub fn example() -> Report {
        let marching = Tracking { free_flight: FreeFlight::RayMarching, ..Tracking::default() };
        let rows = vec![
            measured(baseline(), 2.0, 0.5, 1.0),
            measured(Tracking::default(), 1.0, 0.25, 1.0),
            measured(marching, 0.1, 0.1, 1.5),
        ];
        let case = Case { volume: "a <b>".into(), setting: "thin, grey".into(), thickness: 2.0, rows };
        let saving =
            Saving { medium: "haze".into(), bound: "grid 8".into(), delta: 4.0, decomposition: 2.0, predicted: 0.5 };
        let points = vec![[1.0, 0.001, 0.0001], [2.0, 0.008, 0.0001], [4.0, 0.064, 0.0001]];
        let march = March { medium: "linear".into(), estimator: "shadow rays".into(), points };
        Report {
            adapter: "an adapter".into(),
            backend: "vulkan".into(),
            cpu_time: true,
            size: 8,
            cases: vec![case],
            savings: vec![saving],
            marches: vec![march],
        }
    }

    #[test]
    fn table_json_and_csv_tell_the_same() {
        let report = example();
        let (table, json) = (report.table(), report.to_json());
        let row = &json["cases"][0]["rows"][1];
        assert_eq!((row["efficiency_by_time"].as_f64(), row["efficiency_by_work"].as_f64()), (Some(4.0), Some(2.0)));
        assert_eq!((&row["z"], &row["relative_difference"]), (&json!(0.0), &json!(0.0)));
        assert_eq!(json["cases"][0]["rows"][2]["relative_difference"], 0.5);
        assert_eq!(json["decomposition"][0]["ratio"], 0.5);
        assert!(table.contains("biased: +50.00 %") && table.contains("    4.000    2.000"), "{table}");
        assert!(table.contains("Best by time: delta · ratio · grid auto"), "{table}");
        let csv = report.to_csv();
        assert_eq!(csv.lines().count(), 1 + 2 * 3);
        assert!(csv.lines().all(|l| l.split(',').count() == 20 + l.matches("thin, grey").count()), "{csv}");
    }

    #[test]
    fn every_row_has_a_line() {
        let all = rows(false, false, false);
        let of = |r: Row| Measured { row: r.clone(), ..measured(r.tracking, 1.0, 1.0, 1.0) };
        let mut report = example();
        report.cases[0].rows = all.iter().cloned().map(of).collect();
        let table = report.table();
        for r in &all {
            assert!(table.contains(&name(&r.tracking)), "{}", name(&r.tracking));
        }
        let unbiased = |m: &&Measured| m.row.tracking.transmittance == Transmittance::Jackknife;
        assert!(report.cases[0].rows.iter().find(unbiased).is_some_and(|m| m.bias().is_some()));
    }
}
