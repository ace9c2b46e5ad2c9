//! Three numbers that belong together: a colour, whose channels move as one unless they are taken apart, or a vector.

use std::ops::RangeInclusive;

use egui::{Align2, Color32, CursorIcon, Rect, Rgba, Role, Sense, Ui, Vec2, WidgetInfo, pos2, vec2};

use super::number::{Digits, Scale};
use super::scrub::{Scrub, Travel};
use super::slider_row::{Auto, SliderRow, underline};
use super::{Head, RowResponse, field_fill, focus_ring, icon_at, text_at, tooltip};
use crate::app::theme::{Theme, Type, icon, size};

/// A value per colour channel. The row is one slider that moves all channels and keeps their ratio; the link in its
/// label opens a slider for each.
#[derive(Clone, Debug)]
pub struct ColourRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// The unit, "" for none.
    pub unit: &'a str,
    /// What the sliders span.
    pub range: RangeInclusive<f64>,
    /// What may be typed.
    pub limits: RangeInclusive<f64>,
    /// How values lie along the field.
    pub scale: Scale,
    /// How the numbers are shown.
    pub digits: Digits,
    /// What a reset gives.
    pub default: [f64; 3],
}

/// The names of the channels.
const CHANNELS: [&str; 3] = ["R", "G", "B"];
/// Centre of the link from the panel's left.
const LINK: f32 = size::LABEL_RIGHT - 8.0;

impl<'a> ColourRow<'a> {
    /// Shows the row, and a row per channel where they are taken apart.
    pub fn show(&self, ui: &mut Ui, value: &mut [f64; 3]) -> RowResponse {
        let name = self.head.name();
        let id = ui.make_persistent_id(("colour", &name));
        let before = *value;
        // Channels that differ are taken apart from the start: the one number would not tell them.
        let differ = value.iter().any(|c| *c != value[0]);
        let mut apart = ui.data(|data| data.get_temp::<bool>(id)).unwrap_or(differ);
        let top = ui.cursor().top();
        let left = ui.max_rect().left();
        let mut lead = largest(value);
        let from = lead;
        let mut row = self.slider(self.head, largest(&self.default), Some(swatch(value))).show(ui, &mut lead);
        let start_id = id.with("start");
        if row.reset {
            *value = self.default;
        } else if lead != from {
            // Ratios are those at the start of the drag, so that a channel that met an end comes back to its own.
            let start = ui.data(|data| data.get_temp::<[f64; 3]>(start_id)).unwrap_or(before);
            if row.dragging {
                ui.data_mut(|data| data.insert_temp(start_id, start));
            }
            for (channel, start_channel) in value.iter_mut().zip(start) {
                let moved = self.scale.together(largest(&start), lead, start_channel);
                let moved = if start_channel == largest(&start) { lead } else { self.digits.round(moved) };
                *channel = moved.clamp(*self.limits.start(), *self.limits.end());
            }
        }
        if !row.dragging {
            ui.data_mut(|data| data.remove::<[f64; 3]>(start_id));
        }
        if self.link(ui, id, pos2(left + LINK, top + size::ROW / 2.0), apart, &name) {
            apart = !apart;
            ui.data_mut(|data| data.insert_temp(id, apart));
        }
        if apart {
            for (i, symbol) in CHANNELS.into_iter().enumerate() {
                let tip = tooltip::Tip { key: "", ..self.head.tip };
                let changed = self.head.changed && value[i] != self.default[i];
                let head = Head { symbol, changed, biased: false, tip, ..self.head };
                let channel = self.slider(head, self.default[i], None).show(ui, &mut value[i]);
                row.dragging |= channel.dragging;
                row.committed |= channel.committed;
            }
        }
        row.changed = *value != before;
        row
    }

    fn slider(&self, head: Head<'a>, default: f64, swatch: Option<Color32>) -> SliderRow<'a> {
        SliderRow {
            head,
            unit: self.unit,
            range: self.range.clone(),
            limits: self.limits.clone(),
            scale: self.scale,
            digits: self.digits,
            default: Some(default),
            auto: Auto::Never,
            swatch,
        }
    }

    fn link(&self, ui: &Ui, id: egui::Id, centre: egui::Pos2, apart: bool, name: &str) -> bool {
        let theme = Theme::of(ui);
        let spot = Rect::from_center_size(centre, Vec2::splat(size::FIELD));
        let response = ui.interact(spot, id.with("link"), Sense::click()).on_hover_cursor(CursorIcon::PointingHand);
        let words = if apart { icon::LINK.name } else { icon::LOCK.name };
        response.widget_info(|| {
            WidgetInfo::selected(Role::Button, ui.is_enabled(), apart, format!("{name}: separate channels"))
        });
        let ink = if response.hovered() || apart { theme.text } else { theme.text3 };
        icon_at(ui, centre, if apart { icon::LINK } else { icon::LOCK }, Type::SmallIcon, ink);
        if response.has_focus() {
            focus_ring(ui, spot.shrink(2.0));
        }
        response.on_hover_text(words).clicked()
    }
}

fn largest(value: &[f64; 3]) -> f64 {
    value.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

/// The colour as it looks: linear light encoded for the screen, brighter than 1 scaled down.
fn swatch(value: &[f64; 3]) -> Color32 {
    let top = largest(value).max(1.0);
    let [r, g, b] = value.map(|c| (c.max(0.0) / top) as f32);
    Rgba::from_rgb(r, g, b).into()
}

/// Three numbers without ends, such as a position; each is scrubbed and typed like a slider's.
#[derive(Clone, Debug)]
pub struct VectorRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// The unit for screen readers, "" for none.
    pub unit: &'a str,
    /// The letters of the components.
    pub names: [&'a str; 3],
    /// How far a point of drag goes.
    pub per_point: f64,
    /// What may be typed.
    pub limits: RangeInclusive<f64>,
    /// How the numbers are shown.
    pub digits: Digits,
    /// What a reset gives; `None`: the program's choice.
    pub default: Option<[f64; 3]>,
    /// Whether the program can choose the value.
    pub auto: Auto,
}

/// Between the cells of a vector.
const CELL_GAP: f32 = 4.0;
/// From a cell's edges to its texts.
const CELL_INSET: f32 = 5.0;
/// Room for the letter.
const LETTER: f32 = 14.0;

impl VectorRow<'_> {
    /// Shows the row and edits `value`.
    pub fn show(&self, ui: &mut Ui, value: &mut [f64; 3]) -> RowResponse {
        let theme = Theme::of(ui);
        let name = self.head.name();
        let area = Head::allocate(ui);
        let id = ui.make_persistent_id(("vector", &name));
        let mut row = RowResponse::new(ui.interact(area.handle, id, Sense::hover()));
        let before = *value;
        let width = (area.field.width() - 2.0 * CELL_GAP) / 3.0;
        for (i, letter) in self.names.into_iter().enumerate() {
            let left = area.field.left() + i as f32 * (width + CELL_GAP);
            let cell = Rect::from_min_size(pos2(left, area.field.top()), vec2(width, area.field.height()));
            let part = self.cell(ui, id.with(i), cell, &format!("{name} {letter}"), letter, i, &mut value[i]);
            row.dragging |= part.dragging;
            row.committed |= part.committed;
            row.auto |= part.auto;
            row.reset |= part.reset;
            row.response = row.response.union(part.response);
        }
        if self.head.show(ui, &area, row.response.hovered() || row.dragging) {
            row.reset = true;
            row.committed = true;
            match self.default {
                Some(default) => *value = default,
                None => row.auto = true,
            }
        }
        if self.auto == Auto::Is {
            let at = pos2(area.row.left() + size::LABEL_RIGHT, area.row.center().y);
            text_at(ui, at, Align2::RIGHT_CENTER, "auto", Type::Small, theme.text3);
        }
        row.changed = *value != before;
        tooltip::for_row(ui, &row.response, area.row, &name, &self.head.tip, || {
            let default =
                self.default.map_or("auto".into(), |default| default.map(|c| self.digits.format(c)).join(", "));
            vec![("Default", default)]
        });
        row
    }

    #[expect(clippy::too_many_arguments, reason = "the parts of one cell")]
    fn cell(
        &self,
        ui: &mut Ui,
        id: egui::Id,
        cell: Rect,
        name: &str,
        letter: &str,
        i: usize,
        value: &mut f64,
    ) -> RowResponse {
        let theme = Theme::of(ui);
        let scrub = Scrub {
            name,
            description: self.head.tip.text,
            unit: self.unit,
            travel: Travel::Free(self.per_point),
            limits: &self.limits,
            digits: self.digits,
            default: self.default.map(|default| default[i]),
            // The word stands once, at the label.
            auto: if self.auto == Auto::Is { Auto::Can } else { self.auto },
            key: "",
            field: cell,
            text: Rect::from_min_max(
                pos2(cell.left() + LETTER, cell.top() + 1.0),
                pos2(cell.right() - CELL_INSET + 1.0, cell.bottom() - 1.0),
            ),
        };
        let done = scrub.show(ui, id, cell, value);
        let response = &done.row.response;
        let mut free = cell.right();
        if !done.typing {
            let lit = ui.is_enabled() && (response.hovered() || done.row.dragging);
            ui.painter().rect_filled(cell, size::RADIUS, field_fill(ui, id, lit, self.head.biased));
            if self.head.changed || self.head.biased {
                ui.painter().add(underline(cell, cell.right(), self.head.mark(theme)));
            }
            let ink = if self.auto == Auto::Is { theme.text2 } else { theme.text };
            let right = pos2(cell.right() - CELL_INSET, cell.center().y);
            free = text_at(ui, right, Align2::RIGHT_CENTER, scrub.shown(*value), Type::SmallValue, ink).left();
            if response.has_focus() {
                focus_ring(ui, cell);
            }
        }
        // A number that needs the whole cell is worth more than the letter.
        if free > cell.left() + LETTER {
            let left = pos2(cell.left() + CELL_INSET, cell.center().y);
            text_at(ui, left, Align2::LEFT_CENTER, letter, Type::Caption, theme.text2);
        }
        done.row
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn swatches_show_linear_light() {
        assert_eq!(swatch(&[1.0, 1.0, 1.0]), Color32::WHITE);
        assert_eq!(swatch(&[2.0, 1.0, 0.0]), Color32::from_rgb(255, 188, 0));
    }
}
