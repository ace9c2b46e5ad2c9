//! Rows with text: a path or a name, with a button beside it; and rows of buttons.

use egui::{
    Align2, CursorIcon, Frame, Key, Margin, Rect, Role, Sense, TextEdit, Ui, UiBuilder, WidgetInfo, pos2, vec2,
};

use super::combo::Choice;
use super::number::elide_middle;
use super::{Head, RowResponse, field_fill, focus_ring, icon_at, text_at, text_width, text_within, tooltip};
use crate::app::theme::{Icon, Theme, Type, size};

/// A text that can be edited.
#[derive(Clone, Copy, Debug)]
pub struct TextRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// Shown while it is empty.
    pub hint: &'a str,
    /// A button at the field's right, such as "Open".
    pub button: Option<Icon>,
}

/// What happened in a text row.
#[derive(Clone, Debug)]
pub struct TextAnswer {
    /// As in every row: the text changes only when the field is left or Enter is pressed; Escape keeps the old one.
    pub row: RowResponse,
    /// The button was pressed.
    pub pressed: bool,
}

/// From the field's edge to its text.
const INSET: f32 = 8.0;

impl TextRow<'_> {
    /// Shows the row and edits `text`. A long path at rest is cut in its middle.
    pub fn show(&self, ui: &mut Ui, text: &mut String) -> TextAnswer {
        let theme = Theme::of(ui);
        let name = self.head.name();
        let id = ui.make_persistent_id(("text", &name));
        let area = Head::allocate(ui);
        let mut field = area.field;
        let button = self.button.map(|icon| {
            let place = Rect::from_min_max(pos2(field.right() - size::FIELD, field.top()), field.max);
            field.max.x = place.left() - size::GAP;
            (icon, place)
        });
        // What is typed is kept apart until it is committed.
        let typed = ui.data(|data| data.get_temp::<String>(id));
        let mut row = match typed {
            Some(typed) => self.type_in(ui, id, field, typed, text, &name),
            None => self.rest(ui, id, field, text, &name),
        };
        let lit = row.response.hovered() || row.response.has_focus();
        if row.response.has_focus() {
            focus_ring(ui, field);
        }
        if self.head.changed || self.head.biased {
            ui.painter().add(super::slider_row::underline(field, field.right(), self.head.mark(theme)));
        }
        if self.head.show(ui, &area, lit) {
            row.reset = true;
            row.committed = true;
        }
        let pressed = button.is_some_and(|(icon, place)| {
            let press = plain_button(ui, id.with("button"), place, "", &format!("{name}: {}", icon.name));
            icon_at(ui, place.center(), icon, Type::SmallIcon, theme.text);
            press
        });
        tooltip::for_row(ui, &row.response, area.row, &name, &self.head.tip, Vec::new);
        TextAnswer { row, pressed }
    }

    fn rest(&self, ui: &Ui, id: egui::Id, field: Rect, text: &str, name: &str) -> RowResponse {
        let theme = Theme::of(ui);
        let response = ui.interact(field, id, Sense::click()).on_hover_cursor(CursorIcon::Text);
        response.widget_info(|| {
            let mut info = WidgetInfo::text_edit(ui.is_enabled(), text, text, self.hint);
            info.label = Some(name.into());
            info
        });
        if response.clicked() || response.gained_focus() {
            ui.data_mut(|data| data.insert_temp(id, text.to_owned()));
            response.request_focus();
            ui.ctx().request_repaint();
        }
        ui.painter().rect_filled(field, size::RADIUS, field_fill(ui, id, response.hovered(), self.head.biased));
        let inner = field.shrink2(vec2(INSET, 0.0));
        let fits = |short: &str| text_width(ui, short, Type::Body) <= inner.width();
        let (shown, ink) =
            if text.is_empty() { (self.hint.to_owned(), theme.text2) } else { (elide_middle(text, fits), theme.text) };
        text_within(ui, inner.left_center(), inner.width() + 0.5, &shown, Type::Body, ink);
        RowResponse::new(response)
    }

    fn type_in(
        &self,
        ui: &mut Ui,
        id: egui::Id,
        field: Rect,
        mut typed: String,
        text: &mut String,
        name: &str,
    ) -> RowResponse {
        ui.painter().rect_filled(field, size::RADIUS, Theme::of(ui).field);
        let inner = field.shrink2(vec2(INSET, 1.0));
        let edit = TextEdit::singleline(&mut typed)
            .id(id)
            .font(Type::Body.font())
            .frame(Frame::NONE)
            .margin(Margin::ZERO)
            .hint_text(self.hint.to_owned())
            .align(Align2::LEFT_CENTER)
            .desired_width(inner.width());
        let response = ui.place(inner, edit).accessible_name(name);
        let mut row = RowResponse::new(response);
        if row.response.has_focus() {
            ui.data_mut(|data| data.insert_temp(id, typed));
            return row;
        }
        ui.data_mut(|data| data.remove::<String>(id));
        if !ui.input(|i| i.key_pressed(Key::Escape)) && typed != *text {
            *text = typed;
            row.choose();
        }
        row
    }
}

/// One to three buttons side by side in the field column, or across the panel if the label is empty.
#[derive(Clone, Copy, Debug)]
pub struct ButtonsRow<'a> {
    /// Label and tooltip.
    pub head: Head<'a>,
    /// The buttons; a blocked one says why.
    pub buttons: &'a [Choice<'a>],
}

impl ButtonsRow<'_> {
    /// Shows the row. The button that was pressed.
    pub fn show(&self, ui: &mut Ui) -> Option<usize> {
        let area = Head::allocate(ui);
        self.head.show(ui, &area, false);
        let left = if self.head.label.is_empty() { area.row.left() + size::PADDING } else { area.field.left() };
        let count = self.buttons.len().max(1) as f32;
        let width = (area.field.right() - left - size::GAP * (count - 1.0)) / count;
        let mut pressed = None;
        for (i, button) in self.buttons.iter().enumerate() {
            let x = left + (width + size::GAP) * i as f32;
            let place = Rect::from_min_size(pos2(x, area.field.top()), vec2(width, area.field.height()));
            let id = ui.make_persistent_id(("button", self.head.label, button.name));
            if button.blocked.is_empty() {
                if plain_button(ui, id, place, button.name, &self.spoken(button)) {
                    pressed = Some(i);
                }
            } else {
                // A child that takes no room of its own in the column.
                let mut child = ui.new_child(UiBuilder::new().max_rect(place));
                child.disable();
                plain_button(&child, id, place, button.name, &self.spoken(button));
                ui.interact(place, id.with("why"), Sense::hover()).on_hover_text(button.blocked);
            }
        }
        pressed
    }

    fn spoken(&self, button: &Choice) -> String {
        match self.head.label {
            "" => button.spoken(),
            label => format!("{label}: {}", button.spoken()),
        }
    }
}

/// A button in `place`.
fn plain_button(ui: &Ui, id: egui::Id, place: Rect, text: &str, name: &str) -> bool {
    let theme = Theme::of(ui);
    let response = ui.interact(place, id, Sense::click());
    response.widget_info(|| WidgetInfo::labeled(Role::Button, ui.is_enabled(), name));
    let down = response.is_pointer_button_down_on();
    let fill = if down { theme.active } else { field_fill(ui, id, response.hovered(), false) };
    ui.painter().rect_filled(place, size::RADIUS, fill);
    text_at(ui, place.center(), Align2::CENTER_CENTER, text, Type::SmallValue, theme.text);
    if response.has_focus() {
        focus_ring(ui, place);
    }
    response.clicked()
}
