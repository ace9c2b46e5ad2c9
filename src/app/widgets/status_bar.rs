//! The status line: cells of fixed width, so that nothing shifts while numbers count, and the word on trust.

use egui::{Align2, Color32, CursorIcon, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::{focus_ring, icon_at, text_at, text_width, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// How a cell is to be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tone {
    /// A plain figure.
    #[default]
    Plain,
    /// A caution, such as a reduced scale.
    Warn,
}

/// One figure.
#[derive(Clone, Copy, Debug, Default)]
pub struct Cell<'a> {
    /// The figure as text; "": not measured, shown as "–".
    pub value: &'a str,
    /// What follows it: a unit, a name, "/ 4 096 spp".
    pub unit: &'a str,
    /// The widest text that `value` takes; the figure ends at its right edge.
    pub widest: &'a str,
    /// Its tone.
    pub tone: Tone,
    /// What a click opens and a screen reader adds, such as "Samples".
    pub name: &'a str,
    /// What it means, under the pointer; "": nothing to say.
    pub tip: &'a str,
    /// Where there is no room for all, cells of the highest rank go first.
    pub rank: u8,
}

impl Cell<'_> {
    /// Width of the figure, and of the whole cell.
    fn width(&self, ui: &Ui) -> (f32, f32) {
        let figure = text_width(ui, self.widest, Type::SmallValue).max(text_width(ui, self.value, Type::SmallValue));
        let unit = if self.unit.is_empty() { 0.0 } else { UNIT_GAP + text_width(ui, self.unit, Type::Small) };
        (figure, figure + unit)
    }
}

/// Whether the picture can be trusted.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trust<'a> {
    /// The method is unbiased.
    Unbiased,
    /// It is not.
    Biased {
        /// Because of this: "ray marching of shadow rays", "2 settings".
        by: &'a str,
        /// Which settings, a line each.
        tip: &'a str,
    },
    /// Not to be judged yet, with the reason: "preview: 4 bounces".
    Preview(&'a str),
}

/// The whole line.
#[derive(Clone, Copy, Debug)]
pub struct StatusBar<'a> {
    /// The share of the work that is done, 0 … 1, as a line on the upper edge.
    pub progress: Option<f32>,
    /// The figures, from the left.
    pub cells: &'a [Cell<'a>],
    /// The word on trust.
    pub trust: Trust<'a>,
    /// The adapter and its backend.
    pub adapter: &'a str,
    /// The adapter is a software one: said in amber.
    pub software: bool,
}

/// What was clicked: each cell leads to its setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StatusClick {
    /// The cell of this place.
    Cell(usize),
    /// The word on trust.
    Trust,
    /// The adapter.
    Adapter,
}

/// Between cells.
const GAP: f32 = 24.0;
/// From a figure to its unit.
const UNIT_GAP: f32 = 4.0;
/// Thickness of the progress line.
const PROGRESS: f32 = 2.0;
/// From an icon's centre to its text.
const ICON: f32 = 14.0;
/// Trust and adapter take at most this share of the line, and of a narrow one.
const RIGHT_SHARE: f32 = 0.4;
const RIGHT_SHARE_NARROW: f32 = 0.6;

impl StatusBar<'_> {
    /// Shows the line across the top of `ui`'s space.
    pub fn show(&self, ui: &mut Ui) -> Option<StatusClick> {
        let theme = Theme::of(ui);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), size::STATUS), Sense::hover());
        ui.painter().rect_filled(rect, 0, theme.bar);
        if let Some(progress) = self.progress {
            let track = Rect::from_min_size(rect.min, vec2(rect.width(), PROGRESS));
            ui.painter().rect_filled(track, 0, theme.line);
            let done = Rect::from_min_size(rect.min, vec2(rect.width() * progress.clamp(0.0, 1.0), PROGRESS));
            ui.painter().rect_filled(done, 0, theme.accent);
            let id = ui.make_persistent_id("status progress");
            let response = ui.interact(track, id, Sense::hover());
            response.widget_info(|| WidgetInfo::labeled(Role::ProgressIndicator, true, "Progress"));
            ui.ctx().accesskit_node_builder(id, |node| {
                node.set_numeric_value(f64::from(progress));
                node.set_min_numeric_value(0.0);
                node.set_max_numeric_value(1.0);
            });
        }
        let y = rect.center().y + PROGRESS / 2.0;
        let mut clicked = None;
        let (trust_word, trust_tip, trust_ink, trust_icon) = match self.trust {
            Trust::Unbiased => ("unbiased".to_owned(), "", theme.ok, icon::OK),
            Trust::Biased { by, tip } => (format!("biased: {by}"), tip, theme.warn, icon::WARN),
            Trust::Preview(why) => (why.to_owned(), "", theme.text2, icon::INFO),
        };
        let trust_width = text_width(ui, &trust_word, Type::SmallValue) + ICON + size::SPACE;
        let share = if rect.width() < size::COMPACT_BELOW { RIGHT_SHARE_NARROW } else { RIGHT_SHARE };
        let adapter_room = (rect.width() * share - trust_width).max(0.0);
        let adapter_width = text_width(ui, self.adapter, Type::Small).min(adapter_room);
        let right = rect.right() - size::PADDING;
        let adapter = Rect::from_x_y_ranges(right - adapter_width..=right, rect.y_range());
        let ink = if self.software { theme.warn } else { theme.text3 };
        text_within(ui, pos2(adapter.left(), y), adapter_width + 0.5, self.adapter, Type::Small, ink);
        if button(ui, adapter, "adapter", &format!("Adapter {}", self.adapter), "") {
            clicked = Some(StatusClick::Adapter);
        }
        let trust_right = adapter.left() - if adapter_width > 0.0 { size::PADDING + 4.0 } else { 0.0 };
        let trust = Rect::from_x_y_ranges(trust_right - trust_width..=trust_right, rect.y_range());
        icon_at(ui, pos2(trust.left() + ICON / 2.0, y), trust_icon, Type::SmallIcon, trust_ink);
        let word = pos2(trust.right(), y);
        text_at(ui, word, Align2::RIGHT_CENTER, &trust_word, Type::SmallValue, trust_ink);
        if button(ui, trust, "trust", &trust_word, trust_tip) {
            clicked = Some(StatusClick::Trust);
        }
        let widths: Vec<(f32, f32)> = self.cells.iter().map(|cell| cell.width(ui)).collect();
        let mut left = rect.left() + size::PADDING;
        let kept = self.fitting(&widths, trust.left() - size::SPACE - left);
        for (i, cell) in self.cells.iter().enumerate().filter(|&(i, _)| kept[i]) {
            let (figure, whole) = widths[i];
            let place = Rect::from_x_y_ranges(left..=left + whole, rect.y_range());
            self.cell(ui, cell, place, left + figure, y);
            let value = if cell.value.is_empty() { super::number::UNKNOWN } else { cell.value };
            if button(ui, place, i, format!("{} {value} {}", cell.name, cell.unit).trim(), cell.tip) {
                clicked = Some(StatusClick::Cell(i));
            }
            left = place.right() + GAP;
        }
        clicked
    }

    /// Which cells fit into `room`: what does not is left out whole, never cut.
    fn fitting(&self, widths: &[(f32, f32)], room: f32) -> Vec<bool> {
        let mut kept = vec![true; self.cells.len()];
        let total = |kept: &[bool]| -> f32 {
            widths.iter().zip(kept).filter(|(_, kept)| **kept).map(|((_, whole), _)| whole + GAP).sum::<f32>() - GAP
        };
        while total(&kept) > room {
            let last = (0..kept.len()).filter(|&i| kept[i]).max_by_key(|&i| self.cells[i].rank);
            let Some(last) = last else { break };
            kept[last] = false;
        }
        kept
    }

    fn cell(&self, ui: &Ui, cell: &Cell, place: Rect, end: f32, y: f32) {
        let theme = Theme::of(ui);
        let inks: (Color32, Color32) = match cell.tone {
            Tone::Plain => (theme.text, theme.text3),
            Tone::Warn => (theme.warn, theme.warn),
        };
        let value = if cell.value.is_empty() { super::number::UNKNOWN } else { cell.value };
        text_at(ui, pos2(end, y), Align2::RIGHT_CENTER, value, Type::SmallValue, inks.0);
        text_at(ui, pos2(place.right(), y), Align2::RIGHT_CENTER, cell.unit, Type::Small, inks.1);
    }
}

/// Makes `rect` a button; its text is already there. `tip` tells more under the pointer, and to screen readers.
fn button(ui: &Ui, rect: Rect, salt: impl std::hash::Hash + std::fmt::Debug, name: &str, tip: &str) -> bool {
    let id = ui.make_persistent_id(("status", format!("{salt:?}")));
    let mut response = ui.interact(rect, id, Sense::click()).on_hover_cursor(CursorIcon::PointingHand);
    if !tip.is_empty() {
        response = response.on_hover_text(tip);
        ui.ctx().accesskit_node_builder(id, |node| node.set_description(tip));
    }
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    if response.hovered() {
        let y = ui.painter().round_to_pixel_center(rect.bottom() - 4.0);
        ui.painter().hline(rect.x_range(), y, egui::Stroke::new(1.0, Theme::of(ui).edge));
    }
    if response.has_focus() {
        focus_ring(ui, rect.shrink2(vec2(0.0, 4.0)).expand2(vec2(2.0, 0.0)));
    }
    response.clicked()
}
