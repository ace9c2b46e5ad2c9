//! Measured numbers: larger than the settings that they explain, and held still long enough to be read.

use egui::{Align2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::number::UNKNOWN;
use super::{text_at, text_width, text_within};
use crate::app::theme::{Theme, Type, size};

/// One measured number.
#[derive(Clone, Copy, Debug)]
pub struct Readout<'a> {
    /// What it is.
    pub caption: &'a str,
    /// The number as text, three significant digits; "": not measured, shown as "–" and never as 0.
    pub value: &'a str,
    /// Its unit, "" for none.
    pub unit: &'a str,
}

/// Read-outs stand three to a row.
const COLUMNS: usize = 3;
/// Centre of the caption and of the number from the row's top.
const CAPTION_Y: f32 = 11.0;
const NUMBER_Y: f32 = 29.0;
/// From the number to its unit.
const UNIT_GAP: f32 = 4.0;
/// The text of a read-out changes at most this often, in seconds.
const HOLD: f64 = 0.25;

/// Shows `items`, three to a row.
pub fn readouts(ui: &mut Ui, items: &[Readout]) {
    let theme = Theme::of(ui);
    for line in items.chunks(COLUMNS) {
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), size::READOUT), Sense::hover());
        let inner = rect.shrink2(vec2(size::PADDING, 0.0));
        let pitch = inner.width() / COLUMNS as f32;
        for (i, item) in line.iter().enumerate() {
            let left = inner.left() + pitch * i as f32;
            let cell = Rect::from_min_max(pos2(left, rect.top()), pos2(left + pitch, rect.bottom()));
            let id = ui.make_persistent_id(("readout", item.caption));
            let value = held(ui, id, if item.value.is_empty() { UNKNOWN } else { item.value });
            let spoken = format!("{} {value} {}", item.caption, item.unit);
            let response = ui.interact(cell, id, Sense::hover());
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, spoken.trim_end()));
            let caption = pos2(left, rect.top() + CAPTION_Y);
            text_within(ui, caption, pitch - UNIT_GAP, item.caption, Type::Caption, theme.text3);
            let number = pos2(left, rect.top() + NUMBER_Y);
            let unit_width = if item.unit.is_empty() { 0.0 } else { UNIT_GAP + text_width(ui, item.unit, Type::Small) };
            // A long number takes the smaller type rather than the next column's room.
            let fits = text_width(ui, &value, Type::Readout) + unit_width <= pitch - UNIT_GAP;
            let kind = if fits { Type::Readout } else { Type::Value };
            let number = text_at(ui, number, Align2::LEFT_CENTER, &value, kind, theme.text);
            // Aligned to the number's baseline: half the difference of their heights lower.
            let unit = pos2(number.right() + UNIT_GAP, number.center().y + 1.0);
            if value != UNKNOWN {
                text_at(ui, unit, Align2::LEFT_CENTER, item.unit, Type::Small, theme.text3);
            }
        }
    }
}

/// The text to show for `new`: the last one while it is younger than [`HOLD`].
fn held(ui: &Ui, id: egui::Id, new: &str) -> String {
    let now = ui.input(|i| i.time);
    let last = ui.data(|data| data.get_temp::<(f64, String)>(id));
    if let Some((since, text)) = last {
        if text == new {
            return text;
        }
        let age = now - since;
        if age < HOLD {
            ui.ctx().request_repaint_after_secs((HOLD - age) as f32);
            return text;
        }
    }
    ui.data_mut(|data| data.insert_temp(id, (now, new.to_owned())));
    new.into()
}

/// A fact as a line: caption left, text right.
#[derive(Clone, Copy, Debug)]
pub struct InfoRow<'a> {
    /// What it is.
    pub caption: &'a str,
    /// The fact.
    pub text: &'a str,
}

/// Height of such a line.
const INFO: f32 = 17.0;

impl InfoRow<'_> {
    /// Shows the line.
    pub fn show(&self, ui: &mut Ui) {
        let theme = Theme::of(ui);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), INFO), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {}", self.caption, self.text)));
        let inner = rect.shrink2(vec2(size::PADDING, 0.0));
        let caption = text_at(ui, inner.left_center(), Align2::LEFT_CENTER, self.caption, Type::Small, theme.text3);
        let room = inner.right() - caption.right() - size::PADDING;
        let width = text_width(ui, self.text, Type::Small).min(room);
        text_within(ui, pos2(inner.right() - width, inner.center().y), width + 0.5, self.text, Type::Small, theme.text);
        if text_width(ui, self.text, Type::Small) > room {
            response.on_hover_text(self.text);
        }
    }
}
