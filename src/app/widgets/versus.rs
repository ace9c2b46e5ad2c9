//! Figures of A beside those of B, and their quotient.

use egui::{Align2, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::number::{Digits, UNKNOWN};
use super::{text_at, text_within};
use crate::app::theme::{Theme, Type, size};

/// One line of the table.
#[derive(Clone, Copy, Debug)]
pub struct Contest<'a> {
    /// What it is, with its unit.
    pub caption: &'a str,
    /// What it means, for the tooltip.
    pub tip: &'a str,
    /// The figures of A and B; NaN where unknown.
    pub values: [f64; 2],
    /// A figure that should be 0: anything else is said in amber.
    pub fault: bool,
}

/// Height of a line.
const LINE: f32 = 18.0;
/// Right edges of B's and A's columns from that of the quotient.
const COLUMN: f32 = 62.0;

/// Quotients beyond these say no more than the two figures.
const COMPARABLE: std::ops::Range<f64> = 1e-3..1e4;

/// Three digits; nothing at all is "0".
fn figure(value: f64) -> String {
    if value == 0.0 { "0".into() } else { Digits::Significant(3).format(value) }
}

/// Shows `lines` under the letters of the two sides.
pub fn versus(ui: &mut Ui, lines: &[Contest]) {
    ui.scope(|ui| table(ui, lines));
}

fn table(ui: &mut Ui, lines: &[Contest]) {
    let theme = Theme::of(ui);
    ui.spacing_mut().item_spacing.y = 0.0;
    let columns = |right: f32| [right - 2.0 * COLUMN, right - COLUMN, right];
    let (head, _) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
    let titles = [("A", theme.accent), ("B", theme.series_b), ("A / B", theme.text3)];
    for (x, (title, ink)) in columns(head.right() - size::PADDING).into_iter().zip(titles) {
        text_at(ui, pos2(x, head.center().y), Align2::RIGHT_CENTER, title, Type::SmallValue, ink);
    }
    for line in lines {
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
        let [a, b] = line.values.map(figure);
        let quotient = line.values[0] / line.values[1];
        let quotient = if COMPARABLE.contains(&quotient) { figure(quotient) } else { String::new() };
        let words = format!("{}: A {a}, B {b}", line.caption);
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
        let columns = columns(rect.right() - size::PADDING);
        let left = pos2(rect.left() + size::PADDING, rect.center().y);
        text_within(ui, left, columns[0] - left.x - COLUMN, line.caption, Type::Small, theme.text3);
        let ink = |text: &str, value: f64| match (text == UNKNOWN, line.fault && value > 0.0) {
            (true, _) => theme.text3,
            (false, true) => theme.warn,
            (false, false) => theme.text,
        };
        let inks = [ink(&a, line.values[0]), ink(&b, line.values[1]), theme.text2];
        for ((x, text), ink) in columns.into_iter().zip([a, b, quotient]).zip(inks) {
            text_at(ui, pos2(x, rect.center().y), Align2::RIGHT_CENTER, text, Type::SmallValue, ink);
        }
        if !line.tip.is_empty() {
            response.on_hover_text(line.tip);
        }
    }
}
