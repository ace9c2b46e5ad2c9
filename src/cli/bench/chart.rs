//! Plots of bars, quartiles as whiskers.

use std::fmt::Write;

use super::report::{Report, Round, Spread, Volume, short};

/// Lengths in SVG units.
const WIDTH: f64 = 760.0;
const LABELS: f64 = 190.0;
const VALUES: f64 = 90.0;
const BAR: f64 = 16.0;
const PITCH: f64 = 24.0;
const TITLE: f64 = 40.0;
const AXIS: f64 = 46.0;
const MARGIN: f64 = 16.0;

/// Steps of an axis, about `count` of them from 0 up to `top`: 1, 2 or 5 times a power of ten.
fn step(top: f64, count: f64) -> f64 {
    let rough = top / count;
    let power = 10f64.powf(rough.log10().floor());
    let factor = [1.0, 2.0, 5.0].into_iter().find(|f| f * power >= rough).unwrap_or(10.0);
    factor * power
}

pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// Bars with an axis of their own.
pub struct Panel {
    /// Above them.
    pub title: String,
    /// What they show.
    pub axis: String,
    /// Name and figure of each.
    pub bars: Vec<(String, Spread)>,
}

/// The plot of the kernel's report. Of kernels that draw nothing, lookups a second are another matter and left out.
pub fn svg(report: &Report) -> String {
    let panel = |volume: &Volume| Panel {
        title: format!("{} · {}", volume.name, report.adapter),
        axis: format!("Paths per {}", report.second()),
        bars: (volume.sides.iter())
            .filter(|s| s.rounds.iter().any(|r| r.variance > 0.0))
            .map(|s| (s.name.clone(), s.spread(Round::paths_per_second)))
            .collect(),
    };
    bars(&report.volumes.iter().map(panel).collect::<Vec<_>>(), LABELS)
}

/// The head of an SVG file.
pub fn head(width: f64, height: f64) -> String {
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"sans-serif\" font-size=\"13\" fill=\"#222\">\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n"
    )
}

/// Panels one below the other; names get `labels` of the width.
pub fn bars(panels: &[Panel], labels: f64) -> String {
    let height: f64 = 2.0 * MARGIN + panels.iter().map(|p| TITLE + AXIS + PITCH * p.bars.len() as f64).sum::<f64>();
    let (left, right) = (MARGIN + labels, WIDTH - MARGIN - VALUES);
    let mut out = head(WIDTH, height);
    let mut y = MARGIN;
    for Panel { title, axis, bars } in panels {
        let top = bars.iter().map(|(_, s)| s.high).fold(f64::MIN_POSITIVE, f64::max);
        let x = |value: f64| left + (right - left) * value / top;
        let bottom = y + TITLE + PITCH * bars.len() as f64;
        let _ =
            writeln!(out, "<text x=\"{MARGIN}\" y=\"{:.1}\" font-weight=\"bold\">{}</text>", y + 18.0, escape(title));
        let step = step(top, 5.0);
        for tick in (0..).map(|i| f64::from(i) * step).take_while(|t| *t <= top) {
            let _ = writeln!(
                out,
                "<line x1=\"{0:.1}\" x2=\"{0:.1}\" y1=\"{1:.1}\" y2=\"{bottom:.1}\" stroke=\"#ddd\"/>\n\
                 <text x=\"{0:.1}\" y=\"{2:.1}\" text-anchor=\"middle\" fill=\"#555\">{3}</text>",
                x(tick),
                y + TITLE - 6.0,
                bottom + 16.0,
                if tick == 0.0 { "0".into() } else { short(tick) }
            );
        }
        let _ = writeln!(
            out,
            "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            0.5 * (left + right),
            bottom + 34.0,
            escape(axis)
        );
        for (i, (name, spread)) in bars.iter().enumerate() {
            let middle = y + TITLE + PITCH * (i as f64 + 0.5);
            let _ = writeln!(
                out,
                "<text x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>\n\
                 <rect x=\"{left}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{BAR}\" fill=\"#4a7fb5\"/>\n\
                 <line x1=\"{:.1}\" x2=\"{:.1}\" y1=\"{middle:.1}\" y2=\"{middle:.1}\" stroke=\"#222\" stroke-width=\"2\"/>\n\
                 <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
                left - 8.0,
                middle + 4.5,
                escape(name),
                middle - 0.5 * BAR,
                x(spread.median) - left,
                x(spread.low),
                x(spread.high),
                x(spread.high) + 8.0,
                middle + 4.5,
                short(spread.median)
            );
        }
        y = bottom + AXIS;
    }
    out + "</svg>\n"
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::bench::report::tests::example;

    #[test]
    fn axis_steps_are_round() {
        assert_eq!([0.9, 4.7, 12.0, 5e6].map(|top| step(top, 5.0)), [0.2, 1.0, 5.0, 1e6]);
    }

    #[test]
    fn bars_are_as_long_as_their_figures() {
        let mut report = example();
        report.volumes[0].sides[1].rounds.iter_mut().for_each(|r| r.variance = 1.0);
        let text = svg(&report);
        let widths: Vec<f64> = text
            .lines()
            .filter(|l| l.contains("#4a7fb5"))
            .filter_map(|l| l.split("width=\"").nth(1)?.split('"').next()?.parse().ok())
            .collect();
        assert_eq!(widths.len(), 2);
        assert!((widths[1] / widths[0] - 2.0).abs() < 1e-3, "{widths:?}");
        assert!((widths[1] - (WIDTH - 2.0 * MARGIN - LABELS - VALUES)).abs() < 0.1, "the longest fills the axis");
        // Well-formed as far as a count can tell, and no raw markup from names.
        assert_eq!(text.matches("<text").count(), text.matches("</text>").count());
        assert!(text.contains("a &lt;b&gt;") && text.contains("default &amp; best") && text.ends_with("</svg>\n"));
    }

    #[test]
    fn kernels_without_a_picture_have_no_bar() {
        assert_eq!(svg(&example()).matches("#4a7fb5").count(), 1);
    }
}
