//! Plots: how many times better ours is, errors of still pictures over time, and what passes take.

use crate::cli::bench::chart::{Panel, bars};
use crate::cli::bench::report::Spread;

use super::figures::Estimate;
use super::plan::OURS;
use super::report::{Case, Report, rel_mse, v99};

/// Width of names beside bars, in SVG units.
const LABELS: f64 = 190.0;

/// Every plot: name of the file and text.
pub fn all(report: &Report) -> Vec<(String, String)> {
    let plot = |name: &str, panels: Vec<Panel>| {
        let panels: Vec<Panel> = panels.into_iter().filter(|p| !p.bars.is_empty()).collect();
        (!panels.is_empty()).then(|| (name.to_owned(), bars(&panels, LABELS)))
    };
    let of_cases = |panel: fn(&Case) -> Panel| report.cases.iter().map(panel).collect();
    [
        plot("equal-time.svg", of_cases(gains)),
        plot("still.svg", of_cases(means)),
        plot("lag.svg", of_cases(lags)),
        plot("passes.svg", of_cases(passes)),
    ]
    .into_iter()
    .flatten()
    .collect()
}

/// A bar with a standard error to each side; none of what is no number.
fn bar(label: String, e: Estimate) -> Option<(String, Spread)> {
    let error = if e.error.is_finite() { e.error } else { 0.0 };
    e.value.is_finite().then(|| {
        (label, Spread { low: (e.value - error).max(0.0), median: e.value.max(0.0), high: (e.value + error).max(0.0) })
    })
}

fn gains(case: &Case) -> Panel {
    let others = case.rows.iter().filter(|r| r.side != OURS);
    let both = others.flat_map(|r| {
        let robust = format!("{}, without worst 1 %", r.side);
        [bar(r.side.clone(), case.gain(&r.scores, rel_mse)), bar(robust, case.gain(&r.scores, v99))]
    });
    let axis = "relMSE × time over that of ours".into();
    Panel { title: case.title(), axis, bars: both.flatten().collect() }
}

fn means(case: &Case) -> Panel {
    let of = |m: &super::report::Mean| {
        let frames = if m.frames == 1 { "frame" } else { "frames" };
        bar(format!("{}, {} {frames}", m.side, m.frames), case.mean_gain(m, rel_mse))
    };
    let axis = "relMSE × time of the path tracer over that of the mean".into();
    Panel { title: case.title(), axis, bars: case.means.iter().filter_map(of).collect() }
}

fn lags(case: &Case) -> Panel {
    let both = case
        .rows
        .iter()
        .flat_map(|r| [bar(r.side.clone(), r.lag[0]), bar(format!("{}, without worst 1 %", r.side), r.lag[1])]);
    let axis = "Correlation of the errors of two frames".into();
    Panel { title: case.title(), axis, bars: both.flatten().collect() }
}

fn passes(case: &Case) -> Panel {
    let of = |row: &super::report::Row| {
        let side = row.side.clone();
        let exact = |ms: f64| Estimate { value: ms, error: 0.0 };
        row.passes
            .iter()
            .filter_map(move |(name, seconds)| bar(format!("{side}: {name}"), exact(1e3 * seconds)))
            .collect()
    };
    let bars = case.rows.iter().flat_map(|r| -> Vec<(String, Spread)> { of(r) }).collect();
    Panel { title: case.title(), axis: "Milliseconds of a pass (wall time)".into(), bars }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::reuse::report::tests::example;

    fn widths(text: &str) -> Vec<f64> {
        let of_line = |l: &str| l.split("width=\"").nth(1)?.split('"').next()?.parse().ok();
        text.lines().filter(|l| l.contains("#4a7fb5")).filter_map(of_line).collect()
    }

    #[test]
    fn plots_show_the_ratios() {
        let files = all(&example());
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["equal-time.svg", "still.svg", "lag.svg", "passes.svg"]);
        for (name, text) in &files {
            assert_eq!(text.matches("<text").count(), text.matches("</text>").count(), "{name}");
            assert!(text.ends_with("</svg>\n") && !text.contains("NaN") && !text.contains("<b>"), "{name}");
        }
        let gains = widths(&files[0].1);
        assert_eq!(gains.len(), 8, "two sides, two errors, two motions");
        assert!((gains[0] / gains[2] - 4.0 / 3.0).abs() < 0.01, "{gains:?}");
        let passes = widths(&files[3].1);
        assert!((passes[1] / passes[0] - 5.0).abs() < 0.01, "{passes:?}");
    }

    #[test]
    fn what_is_no_number_has_no_bar() {
        let mut report = example();
        for case in &mut report.cases {
            case.rows.retain(|r| r.side != OURS);
        }
        assert!(all(&report).iter().all(|(name, _)| name != "equal-time.svg"));
    }
}
