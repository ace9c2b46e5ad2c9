//! Two to four short choices side by side. The selected one is a lighter cell; there is no outline.

use egui::{Align2, Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::combo::Choice;
use super::{BIASED, Head, RowResponse, focus_ring, text_at, text_width, tooltip};
use crate::app::theme::{Theme, Type, size};

/// A row with segments.
#[derive(Clone, Copy, Debug)]
pub struct SegmentsRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// The choices, in order.
    pub choices: &'a [Choice<'a>],
    /// The place of the default among them.
    pub default: usize,
}

/// From the control's edge to its cells.
const RIM: f32 = 2.0;
/// From a cell's edge to its text, where there is room.
const CELL_PADDING: f32 = 7.0;

impl SegmentsRow<'_> {
    /// Shows the row and changes `chosen`.
    pub fn show(&self, ui: &mut Ui, chosen: &mut usize) -> RowResponse {
        let name = self.head.name();
        let area = Head::allocate(ui);
        let hover = ui.interact(area.handle, ui.make_persistent_id(("segments", &name)), Sense::hover());
        let before = *chosen;
        let response = control(ui, area.field, &name, self.choices, chosen).union(hover);
        let mut row = RowResponse::new(response.clone());
        if self.head.show(ui, &area, response.hovered()) {
            *chosen = self.default;
            row.reset = true;
            row.committed = true;
        }
        if *chosen != before {
            row.choose();
        }
        tooltip::for_row(ui, &response, area.row, &name, &self.head.tip, || {
            vec![("Default", self.choices.get(self.default).map_or(String::new(), |c| c.name.into()))]
        });
        row
    }
}

/// Segments on their own, as wide as they need: the mode in the top bar. True if the choice changed.
pub fn segments(ui: &mut Ui, name: &str, choices: &[Choice], chosen: &mut usize) -> bool {
    let width = segments_width(ui, choices);
    let (rect, _) = ui.allocate_exact_size(vec2(width, size::ROW + 2.0), Sense::hover());
    let before = *chosen;
    control(ui, rect, name, choices, chosen);
    *chosen != before
}

/// The width that [`segments`] takes.
pub fn segments_width(ui: &Ui, choices: &[Choice]) -> f32 {
    widths(ui, choices).iter().sum::<f32>() + 2.0 * RIM
}

fn widths(ui: &Ui, choices: &[Choice]) -> Vec<f32> {
    choices.iter().map(|c| text_width(ui, c.name, Type::SmallValue) + 2.0 * CELL_PADDING).collect()
}

/// The control in `rect`: cells as wide as their texts, with the rest shared out evenly.
fn control(ui: &mut Ui, rect: Rect, name: &str, choices: &[Choice], chosen: &mut usize) -> egui::Response {
    let theme = Theme::of(ui);
    let id = ui.make_persistent_id(("segments of", name));
    let mut response = ui.interact(rect, id, Sense::hover());
    ui.ctx().accesskit_node_builder(id, |node| {
        node.set_role(Role::RadioGroup);
        node.set_label(name);
    });
    ui.painter().rect_filled(rect, size::RADIUS, theme.well);
    let widths = widths(ui, choices);
    let spare = (rect.width() - 2.0 * RIM - widths.iter().sum::<f32>()) / choices.len().max(1) as f32;
    let mut x = rect.left() + RIM;
    for (i, (choice, width)) in choices.iter().zip(widths).enumerate() {
        let cell = Rect::from_min_max(pos2(x, rect.top() + RIM), pos2(x + width + spare, rect.bottom() - RIM));
        x = cell.right();
        let enabled = ui.is_enabled() && choice.blocked.is_empty();
        let sense = if enabled { Sense::click() } else { Sense::hover() };
        let press = ui.interact(cell, id.with(i), sense);
        if press.clicked() {
            *chosen = i;
        }
        let on = *chosen == i;
        press.widget_info(|| WidgetInfo::selected(Role::RadioButton, enabled, on, choice.spoken()));
        let lit = enabled && press.hovered() && !on;
        if on || lit {
            let fill = if on { theme.active } else { theme.well.lerp_to_gamma(theme.active, 0.4) };
            ui.painter().rect_filled(cell, size::RADIUS_INNER, fill);
        }
        let ink = match (enabled, on, choice.biased) {
            (false, ..) => theme.text2.gamma_multiply(ui.visuals().disabled_alpha),
            (true, _, true) => theme.warn,
            (true, true, false) => theme.text,
            (true, false, false) => theme.text2,
        };
        text_at(ui, cell.center(), Align2::CENTER_CENTER, choice.name, Type::SmallValue, ink);
        if press.has_focus() {
            focus_ring(ui, cell);
        }
        let why = if choice.biased { BIASED } else { choice.blocked };
        let press = if why.is_empty() { press } else { press.on_hover_text(why) };
        response = response.union(press);
    }
    response
}
