//! The convergence plot: the error of A and B on logarithmic axes, and the one sentence that it is for.

use std::ops::RangeInclusive;

use egui::{Align2, CornerRadius, Pos2, Rect, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::number::Digits;
use super::{hairline, icon_button, text_at, text_width, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// The card of the plot.
#[derive(Clone, Copy, Debug)]
pub struct Convergence<'a> {
    /// What is plotted.
    pub title: &'a str,
    /// How it was measured.
    pub note: &'a str,
    /// Points of A and B, both coordinates above 0, in order of x.
    pub series: [&'a [(f64, f64)]; 2],
    /// Unit of x.
    pub unit: &'a str,
    /// y is a share, shown as percent.
    pub percent: bool,
    /// Exponent of the law that independent samples follow, and its name.
    pub slope: (f64, &'a str),
    /// The number of the sentence, its words and its interval; the number may be empty.
    pub verdict: [&'a str; 3],
}

/// Size of the card.
const CARD: egui::Vec2 = vec2(360.0, 240.0);
/// Inside the card: its margin, the centre of its title, the plot's place, the height of the sentence's part.
const MARGIN: f32 = 16.0;
const TITLE_Y: f32 = 21.0;
const LEFT: f32 = 50.0;
const RIGHT: f32 = 26.0;
const TOP: f32 = 44.0;
const FOOT: f32 = 44.0;
/// Height of the axis text under the plot.
const AXIS: f32 = 26.0;
/// Side of the closing button.
const CLOSE: f32 = 20.0;
/// Ticks along an axis, at least and at most.
const TICKS: RangeInclusive<usize> = 2..=5;
/// Least span of an axis, decades, and the room above and below the points.
const LEAST_SPAN: f64 = 1.0;
const ROOM: f64 = 0.08;
/// Radius of the last point, length of dash and gap of the guide.
const DOT: f32 = 3.5;
const DASH: (f32, f32) = (5.0, 4.0);
/// Distance of a series' letter from its last point, and of two letters that would touch.
const LETTER_X: f32 = 14.0;
const LETTER_GAP: f32 = 13.0;
/// The guide lies this factor above the first point.
const ABOVE: f64 = 1.5;

/// A logarithmic axis.
#[derive(Clone, Copy, Debug, PartialEq)]
struct LogAxis {
    /// Decimal logarithms at its ends.
    low: f64,
    high: f64,
}

impl LogAxis {
    /// An axis that holds `values`, with some room.
    fn around(values: impl Iterator<Item = f64>) -> Option<LogAxis> {
        let mut ends: Option<(f64, f64)> = None;
        for x in values.filter(|x| *x > 0.0 && x.is_finite()).map(f64::log10) {
            ends = Some(ends.map_or((x, x), |(low, high)| (low.min(x), high.max(x))));
        }
        let (low, high) = ends?;
        let room = (ROOM * (high - low)).max(0.5 * (LEAST_SPAN - (high - low)));
        Some(LogAxis { low: low - room, high: high + room })
    }

    /// Where a value lies, 0 … 1 from the lower end.
    fn place(self, value: f64) -> f64 {
        (value.log10() - self.low) / (self.high - self.low)
    }

    /// Round values along the axis: decades, or 1, 2, 5 where there would be too few, or every so many decades.
    fn ticks(self) -> Vec<f64> {
        let decades = self.low.floor() as i32..=self.high.ceil() as i32;
        let inside = |x: &f64| (self.low..=self.high).contains(&x.log10());
        let of = |steps: &[f64]| -> Vec<f64> {
            decades.clone().flat_map(|d| steps.iter().map(move |s| s * 10f64.powi(d))).filter(inside).collect()
        };
        for steps in [&[1.0][..], &[1.0, 3.0], &[1.0, 2.0, 5.0]] {
            let ticks = of(steps);
            if ticks.len() >= *TICKS.start() {
                let each = ticks.len().div_ceil(*TICKS.end());
                return ticks.into_iter().step_by(each).collect();
            }
        }
        Vec::new()
    }
}

/// A round value as axis text.
fn tick_text(value: f64) -> String {
    let decimals = (-value.log10().floor()).max(0.0) as usize;
    let text = Digits::Decimals(decimals).format(value);
    if text.chars().count() > 7 { format!("{value:.0e}") } else { text }
}

impl Convergence<'_> {
    /// Shows the card low left in `area`; whether it was closed.
    pub fn show(&self, ui: &mut Ui, area: Rect) -> bool {
        let theme = Theme::of(ui);
        let card = Rect::from_min_size(area.left_bottom() + vec2(size::PADDING, -size::PADDING - CARD.y), CARD);
        let id = ui.make_persistent_id("convergence");
        // Takes the pointer from the picture below.
        let response = ui.interact(card, id, Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, self.spoken()));
        ui.painter().add(theme.card_shadow().as_shape(card, CornerRadius::same(size::RADIUS_CARD)));
        ui.painter().rect_filled(card, size::RADIUS_CARD, theme.panel);
        let close = Rect::from_center_size(
            pos2(card.right() - MARGIN - CLOSE / 2.0 + 4.0, card.top() + TITLE_Y),
            egui::Vec2::splat(CLOSE),
        );
        let title = pos2(card.left() + MARGIN, card.top() + TITLE_Y);
        let title = text_at(ui, title, Align2::LEFT_CENTER, self.title, Type::Header, theme.text);
        let room = close.left() - 6.0 - title.right() - MARGIN;
        let width = text_width(ui, self.note, Type::Small).min(room);
        let left = pos2(close.left() - 6.0 - width, card.top() + TITLE_Y);
        text_within(ui, left, width + 0.5, self.note, Type::Small, theme.text3);
        let plot = Rect::from_min_max(card.min + vec2(LEFT, TOP), card.max - vec2(RIGHT, FOOT + AXIS));
        self.plot(ui, plot);
        hairline(ui, card.x_range(), card.bottom() - FOOT);
        self.sentence(ui, card);
        icon_button(ui, close, id.with("close"), icon::CLOSE).clicked()
    }

    fn spoken(&self) -> String {
        let last = |i: usize| match self.series[i].last() {
            Some((x, y)) => {
                let three = Digits::Significant(3);
                let (y, sign) = if self.percent { (y * 100.0, " %") } else { (*y, "") };
                format!("{} {}{sign} after {} {}", ["A", "B"][i], three.format(y), three.format(*x), self.unit)
            }
            None => format!("{} not yet", ["A", "B"][i]),
        };
        format!("{}: {}, {}; {}", self.title, last(0), last(1), self.verdict.join(" ").trim())
    }

    fn sentence(&self, ui: &Ui, card: Rect) {
        let theme = Theme::of(ui);
        let [number, words, interval] = self.verdict;
        let y = card.bottom() - FOOT / 2.0;
        let mut left = card.left() + MARGIN;
        if !number.is_empty() {
            left = text_at(ui, pos2(left, y), Align2::LEFT_CENTER, number, Type::Readout, theme.text).right() + 8.0;
        }
        let right = card.right() - MARGIN;
        let margin = text_at(ui, pos2(right, y), Align2::RIGHT_CENTER, interval, Type::Small, theme.text3);
        text_within(ui, pos2(left, y + 0.5), margin.left() - 8.0 - left, words, Type::Small, theme.text2);
    }

    fn plot(&self, ui: &Ui, plot: Rect) {
        let theme = Theme::of(ui);
        let all = || self.series.iter().flat_map(|points| points.iter());
        let axes = LogAxis::around(all().map(|p| p.0)).zip(LogAxis::around(all().map(|p| p.1)));
        let Some((x, y)) = axes else {
            let words = "after a few samples at full resolution";
            text_at(ui, plot.center(), Align2::CENTER_CENTER, words, Type::Small, theme.text3);
            return;
        };
        let at = |(px, py): (f64, f64)| -> Pos2 {
            pos2(
                plot.left() + (x.place(px) as f32) * plot.width(),
                plot.bottom() - (y.place(py) as f32) * plot.height(),
            )
        };
        let painter = ui.painter();
        for tick in y.ticks() {
            let height = at((1.0, tick)).y;
            hairline(ui, plot.x_range(), height);
            let text = if self.percent { format!("{} %", tick_text(100.0 * tick)) } else { tick_text(tick) };
            text_at(ui, pos2(plot.left() - 8.0, height), Align2::RIGHT_CENTER, text, Type::Caption, theme.text3);
        }
        let base = painter.round_to_pixel_center(plot.bottom());
        painter.hline(plot.x_range(), base, Stroke::new(1.0, theme.edge));
        for tick in x.ticks() {
            let across = painter.round_to_pixel_center(at((tick, 1.0)).x);
            painter.vline(across, base..=base + 4.0, Stroke::new(1.0, theme.edge));
            let text = format!("{} {}", tick_text(tick), self.unit);
            text_at(ui, pos2(across, base + 13.0), Align2::CENTER_CENTER, text, Type::Caption, theme.text3);
        }
        self.guide(ui, plot, at);
        let ends = self.series.map(|points| points.last().map(|&p| at(p)));
        let close = matches!(ends, [Some(a), Some(b)] if (a - b).abs().max_elem() < LETTER_GAP);
        for (i, (points, ink)) in self.series.into_iter().zip([theme.accent, theme.series_b]).enumerate() {
            let line: Vec<Pos2> = points.iter().map(|&p| at(p)).collect();
            let Some(&end) = line.last() else { continue };
            painter.add(Shape::line(line, Stroke::new(1.75, ink)));
            painter.circle_filled(end, DOT, ink);
            // The higher of two letters that would touch goes up, the other one down.
            let other = ends[1 - i].map_or(end.y, |p| p.y);
            let upper = end.y < other || end.y == other && i == 0;
            let shift = match (close, upper) {
                (false, _) => 0.0,
                (true, true) => -LETTER_GAP / 2.0,
                (true, false) => LETTER_GAP / 2.0,
            };
            let letter = pos2(end.x + LETTER_X, end.y + shift);
            text_at(ui, letter, Align2::CENTER_CENTER, ["A", "B"][i], Type::Header, ink);
        }
    }

    /// The law of independent samples, a little above the highest curve.
    fn guide(&self, ui: &Ui, plot: Rect, at: impl Fn((f64, f64)) -> Pos2) {
        let theme = Theme::of(ui);
        let (exponent, name) = self.slope;
        let all = || self.series.iter().flat_map(|points| points.iter());
        // y = level · x^exponent through the highest point, seen along the slope.
        let level = all().map(|p| p.1 / p.0.powf(exponent)).fold(0.0, f64::max) * ABOVE;
        let (first, last) = all().fold((f64::INFINITY, 0.0f64), |(a, b), p| (a.min(p.0), b.max(p.0)));
        let reach = |x: f64| at((x, level * x.powf(exponent)));
        let ends = [reach(first / 10.0), reach(last * 10.0)];
        let clipped = ui.painter().with_clip_rect(plot.expand(1.0));
        let stroke = Stroke::new(1.0, theme.edge.gamma_multiply(0.8));
        clipped.extend(Shape::dashed_line(&ends, stroke, DASH.0, DASH.1));
        // Its name above the line, where there is room to its right.
        let width = text_width(ui, name, Type::Caption);
        let slope = (ends[1].y - ends[0].y) / (ends[1].x - ends[0].x);
        let line_y = |x: f32| ends[0].y + slope * (x - ends[0].x);
        let x = plot.right() - width / 2.0 - 4.0;
        let y = (line_y(x - width / 2.0) - 9.0).clamp(plot.top() - 6.0, plot.bottom() - 9.0);
        text_at(ui, pos2(x, y), Align2::CENTER_CENTER, name, Type::Caption, theme.text3);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_axis_holds_its_points_and_has_round_ticks() {
        let axis = LogAxis::around([0.02, 0.0, 3.0, f64::NAN].into_iter()).expect("points");
        assert!(axis.place(0.02) > 0.0 && axis.place(3.0) < 1.0 && axis.place(0.02) < 0.1);
        assert_eq!(axis.ticks(), [0.1, 1.0]);
        assert!(
            (axis.place(0.2) - axis.place(0.02) - (axis.place(2.0) - axis.place(0.2))).abs() < 1e-12,
            "logarithmic"
        );
        let narrow = LogAxis::around([0.02, 0.021].into_iter()).expect("points");
        assert!(narrow.high - narrow.low >= LEAST_SPAN - 1e-9 && narrow.ticks().len() >= 2, "{:?}", narrow.ticks());
        let wide = LogAxis::around([1e-9, 1e9].into_iter()).expect("points");
        assert!(TICKS.contains(&wide.ticks().len()));
        assert_eq!(LogAxis::around([0.0].into_iter()), None);
    }

    #[test]
    fn ticks_read_as_people_write_them() {
        assert_eq!([0.01, 0.3, 1.0, 30.0].map(tick_text), ["0.01", "0.3", "1", "30"]);
        assert_eq!(tick_text(1e-9), "1e-9");
    }
}
