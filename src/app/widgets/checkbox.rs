//! A row with a box to tick. Ticked is grey, not blue: blue means changed.

use egui::{Align2, CursorIcon, Key, Modifiers, Rect, Role, Sense, Stroke, StrokeKind, Ui, Vec2, WidgetInfo, pos2};

use super::{BIASED, Head, RowResponse, focus_ring, icon_at, text_at, text_within, tooltip};
use crate::app::theme::{Theme, Type, icon, size};

/// Something that is on or off.
#[derive(Clone, Copy, Debug)]
pub struct CheckRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// A few words right of the box, or "".
    pub note: &'a str,
    /// Whether it is on by default.
    pub default: bool,
}

/// Side of the box.
const BOX: f32 = 16.0;

impl CheckRow<'_> {
    /// Shows the row and changes `on`.
    pub fn show(&self, ui: &mut Ui, on: &mut bool) -> RowResponse {
        let theme = Theme::of(ui);
        let name = self.head.name();
        let id = ui.make_persistent_id(("check", &name));
        let area = Head::allocate(ui);
        let response = ui.interact(area.handle, id, Sense::click()).on_hover_cursor(CursorIcon::PointingHand);
        let mut row = RowResponse::new(response.clone());
        let before = *on;
        if response.clicked() {
            *on = !*on;
        }
        let delete = response.has_focus() && ui.input_mut(|i| i.consume_key(Modifiers::NONE, Key::Delete));
        let lit = ui.is_enabled() && response.hovered();
        if self.head.show(ui, &area, lit || response.has_focus()) || delete {
            *on = self.default;
            row.reset = true;
            row.committed = true;
        }
        if *on != before {
            row.choose();
        }
        let ticked = *on;
        response.widget_info(|| WidgetInfo::selected(Role::CheckBox, ui.is_enabled(), ticked, &name));
        if !self.head.tip.text.is_empty() {
            ui.ctx().accesskit_node_builder(id, |node| node.set_description(self.head.tip.text));
        }
        let middle = area.field.center().y;
        let square = Rect::from_center_size(pos2(area.field.left() + BOX / 2.0, middle), Vec2::splat(BOX));
        let ink = if lit { theme.text } else { theme.text2 };
        if ticked {
            ui.painter().rect_filled(square, size::RADIUS_INNER, ink);
            icon_at(ui, square.center(), icon::OK, Type::SmallIcon, theme.panel);
        } else {
            let outline = Stroke::new(1.0, if lit { theme.text2 } else { theme.edge });
            ui.painter().rect(square, size::RADIUS_INNER, theme.panel, outline, StrokeKind::Inside);
        }
        if response.has_focus() {
            focus_ring(ui, square);
        }
        let mut left = square.right() + size::SPACE;
        if self.head.biased {
            let at = pos2(left, middle);
            left = text_at(ui, at, Align2::LEFT_CENTER, BIASED, Type::SmallValue, theme.warn).right() + size::SPACE;
        }
        text_within(ui, pos2(left, middle), area.field.right() - left, self.note, Type::Small, theme.text3);
        tooltip::for_row(ui, &response, area.row, &name, &self.head.tip, || {
            vec![("Default", if self.default { "on" } else { "off" }.into())]
        });
        row
    }
}
