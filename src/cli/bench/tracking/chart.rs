//! Plots: efficiency of the rows of each volume, decomposition's lookups, ray marching's error.

use std::fmt::Write;

use crate::cli::bench::chart::{Panel, bars, escape, head};
use crate::cli::bench::report::Spread;

use super::figures::{Case, March, Measured};
use super::plan::name;
use super::report::Report;

/// Width of names beside bars, in SVG units.
const LABELS: f64 = 330.0;
/// Lengths of a plot with axes.
const WIDTH: f64 = 380.0;
const HEIGHT: f64 = 300.0;
const MARGIN: f64 = 58.0;
/// Colours of lines.
const COLOURS: [&str; 3] = ["#4a7fb5", "#c0562f", "#4d9a57"];
/// Orders of the error of a march by one random look in each step: where steps resolve the density, and where they do not.
const ORDERS: [f64; 2] = [3.0, 1.0];

/// Every plot: name of the file and text.
pub fn all(report: &Report) -> Vec<(String, String)> {
    let mut files = Vec::new();
    let mut volumes: Vec<&str> = report.cases.iter().map(|c| c.volume.as_str()).collect();
    volumes.dedup();
    for volume in volumes {
        let panels: Vec<Panel> = report.cases.iter().filter(|c| c.volume == volume).map(efficiency).collect();
        // The volume may be a file.
        let stem = std::path::Path::new(volume).file_stem().map_or(volume.into(), |s| s.to_string_lossy());
        files.push((format!("efficiency-{stem}.svg"), bars(&panels, LABELS)));
    }
    if !report.savings.is_empty() {
        files.push(("decomposition.svg".into(), savings(report)));
    }
    if !report.marches.is_empty() {
        files.push(("marching.svg".into(), marches(&report.marches)));
    }
    files
}

fn efficiency(case: &Case) -> Panel {
    let base = case.rows[0].efficiency();
    let bar = |m: &Measured| {
        let of_round = |seconds_per_path: f64| 1.0 / (m.variance() * seconds_per_path * base);
        let rounds = m.rounds.iter().map(|r| of_round(r.seconds / r.paths)).collect();
        let label = format!("{}{}", name(&m.row.tracking), if m.bias().is_some() { " (biased)" } else { "" });
        (label, Spread { median: of_round(m.seconds()), ..Spread::of(rounds) })
    };
    Panel {
        title: format!("{}, {}", case.volume, case.setting),
        axis: "1 / (variance · time) over that of the first".into(),
        bars: case.rows.iter().map(bar).filter(|(_, s)| s.high.is_finite()).collect(),
    }
}

/// Measured beside predicted.
fn savings(report: &Report) -> String {
    let exact = |x: f64| Spread { low: x, median: x, high: x };
    let both = report.savings.iter().flat_map(|s| {
        let label = format!("{}, {}", s.medium, s.bound);
        [(label, exact(s.ratio())), ("predicted 1 − ⟨µc/µ̄⟩".to_owned(), exact(s.predicted))]
    });
    let title = "Decomposition against delta tracking".to_owned();
    let axis = "Lookups of free flights, decomposition over delta".to_owned();
    bars(&[Panel { title, axis, bars: both.collect() }], LABELS)
}

/// Error against step on logarithmic axes, a plot for each medium, with the slopes of theory through the largest step of
/// the first line.
fn marches(all: &[March]) -> String {
    let mut media: Vec<&str> = all.iter().map(|m| m.medium.as_str()).collect();
    media.dedup();
    let mut out = head(WIDTH * media.len() as f64, HEIGHT);
    for (i, medium) in media.iter().enumerate() {
        let lines: Vec<&March> = all.iter().filter(|m| m.medium == *medium).collect();
        plot(&mut out, WIDTH * i as f64, medium, &lines);
    }
    out + "</svg>\n"
}

fn plot(out: &mut String, left: f64, medium: &str, lines: &[&March]) {
    let seen = |f: fn(&[f64; 3]) -> f64| lines.iter().flat_map(|m| &m.points).map(f).filter(|&v| v > 0.0);
    let range = |values: &mut dyn Iterator<Item = f64>| {
        values.fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)))
    };
    let (x0, x1) = range(&mut seen(|p| p[0]));
    let (y0, y1) = range(&mut seen(|p| p[1].abs().max(p[2])));
    if !(x1 > x0 && y1 > 0.0) {
        return;
    }
    // Whole decades upwards.
    let (y0, y1) = (y0.log10().floor(), y1.log10().ceil().max(y0.log10().floor() + 1.0));
    let (right, bottom) = (left + WIDTH - 14.0, HEIGHT - 44.0);
    let (left, top) = (left + MARGIN, 34.0);
    let x = |v: f64| left + (right - left) * (v / x0).ln() / (x1 / x0).ln();
    let y = |v: f64| bottom - (bottom - top) * ((v.max(1e-30).log10() - y0) / (y1 - y0)).clamp(0.0, 1.0);
    let middle = 0.5 * (left + right);
    let _ = writeln!(out, "<text x=\"{left}\" y=\"20\" font-weight=\"bold\">{}</text>", escape(medium));
    let _ = writeln!(out, "<text x=\"{middle}\" y=\"{}\" text-anchor=\"middle\">Step in voxels</text>", bottom + 36.0);
    let mut decade = y0;
    while decade <= y1 {
        let at = y(10f64.powf(decade));
        let percent = 100.0 * 10f64.powf(decade);
        let _ = writeln!(
            out,
            "<line x1=\"{left}\" x2=\"{right}\" y1=\"{at:.1}\" y2=\"{at:.1}\" stroke=\"#ddd\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\" fill=\"#555\">{percent} %</text>",
            left - 5.0,
            at + 4.5
        );
        decade += 1.0;
    }
    for [step, ..] in &lines[0].points {
        let (at, below) = (x(*step), bottom + 16.0);
        let _ = writeln!(out, "<text x=\"{at:.1}\" y=\"{below}\" text-anchor=\"middle\" fill=\"#555\">{step}</text>");
    }
    for (line, colour) in lines.iter().zip(COLOURS) {
        let points: Vec<[f64; 3]> = line.points.iter().copied().filter(|p| p[1].abs() > p[2]).collect();
        let place = |p: &[f64; 3]| format!("{:.1},{:.1}", x(p[0]), y(p[1].abs()));
        let path: Vec<String> = points.iter().map(place).collect();
        let _ = writeln!(out, "<polyline points=\"{}\" fill=\"none\" stroke=\"{colour}\"/>", path.join(" "));
        for [step, error, deviation] in &line.points {
            let (at, error) = (x(*step), error.abs());
            let _ = writeln!(
                out,
                "<line x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{:.1}\" y2=\"{:.1}\" stroke=\"{colour}\" stroke-width=\"3\"/>",
                y(error - 2.0 * deviation),
                y(error + 2.0 * deviation)
            );
        }
    }
    for (i, (line, colour)) in lines.iter().zip(COLOURS).enumerate() {
        let below = top + 14.0 + 16.0 * i as f64;
        let _ = writeln!(
            out,
            "<text x=\"{}\" y=\"{below}\" fill=\"{colour}\">{}</text>",
            left + 8.0,
            escape(&line.estimator)
        );
    }
    // Guides through the largest step of the first line.
    let [step, error, _] = lines[0].points[lines[0].points.len() - 1];
    for order in ORDERS {
        let lowest = x0.max(step * (10f64.powf(y0) / error.abs()).powf(1.0 / order));
        let (a, b) = (y(error.abs() * (lowest / step).powf(order)), y(error.abs()));
        let _ = writeln!(
            out,
            "<line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{a:.1}\" y2=\"{b:.1}\" stroke=\"#888\" stroke-dasharray=\"4 4\"/>\n\
             <text x=\"{:.1}\" y=\"{:.1}\" fill=\"#888\" text-anchor=\"end\">h{}</text>",
            x(lowest),
            x(step),
            x(lowest) + 14.0,
            a - 6.0,
            if order == 1.0 { "" } else { "³" }
        );
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::tracking::report::tests::example;

    #[test]
    fn every_volume_has_its_plot_and_bars_are_relative_to_the_first() {
        let files = all(&example());
        let names: Vec<&str> = files.iter().map(|(name, _)| name.as_str()).collect();
        assert_eq!(names, ["efficiency-a <b>.svg", "decomposition.svg", "marching.svg"]);
        for (name, text) in &files {
            assert_eq!(text.matches("<text").count(), text.matches("</text>").count(), "{name}");
            assert!(text.ends_with("</svg>\n") && !text.contains("NaN") && !text.contains("<b>"), "{name}");
        }
        let widths: Vec<f64> = (files[0].1.lines())
            .filter(|l| l.contains("#4a7fb5"))
            .filter_map(|l| l.split("width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        // Four times as good, and a hundred times, but biased.
        assert!(
            (widths[1] / widths[0] - 4.0).abs() < 0.05 && (widths[2] / widths[0] - 100.0).abs() < 2.0,
            "{widths:?}"
        );
        assert!(files[0].1.contains("(biased)"));
    }

    #[test]
    fn an_error_of_order_three_lies_along_its_guide() {
        let text = &all(&example())[2].1;
        let line = text.lines().find(|l| l.starts_with("<polyline")).expect("a line");
        let points: Vec<f64> =
            line.split('"').nth(1).expect("points").split([' ', ',']).map(|v| v.parse().expect("a number")).collect();
        let slope = |a: usize, b: usize| (points[b + 1] - points[a + 1]) / (points[b] - points[a]);
        assert!((slope(0, 2) - slope(2, 4)).abs() < 0.02, "straight: {points:?}");
        let guide = text.lines().find(|l| l.contains("stroke-dasharray")).expect("a guide");
        let at = |key: &str| -> f64 {
            guide.split(&format!("{key}=\"")).nth(1).and_then(|t| t.split('"').next()?.parse().ok()).expect("a number")
        };
        let guided = (at("y2") - at("y1")) / (at("x2") - at("x1"));
        assert!((guided - slope(0, 4)).abs() < 0.02, "{guided} {points:?}");
    }
}
