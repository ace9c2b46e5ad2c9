//! One of many choices, or of choices with long names.

use egui::{
    Align2, EventFilter, Frame, Key, Margin, Modifiers, Popup, Role, Sense, Stroke, Ui, WidgetInfo, pos2, vec2,
};

use super::{BIASED, Head, RowResponse, field_fill, focus_ring, icon_at, text_at, text_width, text_within, tooltip};
use crate::app::theme::{Theme, Type, icon, size};

/// One choice of a combo or of segments.
#[derive(Clone, Copy, Debug, Default)]
pub struct Choice<'a> {
    /// Its name.
    pub name: &'a str,
    /// It makes the picture biased: the word stands beside it.
    pub biased: bool,
    /// Why it cannot be chosen now, in a few words; "": it can.
    pub blocked: &'a str,
}

impl<'a> Choice<'a> {
    /// A choice that is unbiased and open.
    pub const fn new(name: &'a str) -> Choice<'a> {
        Choice { name, biased: false, blocked: "" }
    }

    /// A biased choice.
    pub const fn biased(name: &'a str) -> Choice<'a> {
        Choice { name, biased: true, blocked: "" }
    }

    /// What a screen reader says.
    pub(super) fn spoken(&self) -> String {
        match (self.biased, self.blocked) {
            (true, _) => format!("{}, {BIASED}", self.name),
            (false, "") => self.name.into(),
            (false, why) => format!("{}, {why}", self.name),
        }
    }
}

/// A row with a combo.
#[derive(Clone, Copy, Debug)]
pub struct ComboRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// The choices, in order.
    pub choices: &'a [Choice<'a>],
    /// The place of the default among them.
    pub default: usize,
}

/// From the field's edge to its text.
const INSET: f32 = 8.0;
/// Centre of the chevron from the field's right.
const CHEVRON: f32 = 14.0;
/// From the word "biased" to the chevron's centre.
const WORD: f32 = 10.0;
/// Height of a choice in the list.
const ITEM: f32 = 24.0;
/// The list scrolls beyond this height.
const LIST: f32 = 320.0;

impl ComboRow<'_> {
    /// Shows the row and changes `chosen`.
    pub fn show(&self, ui: &mut Ui, chosen: &mut usize) -> RowResponse {
        let theme = Theme::of(ui);
        let name = self.head.name();
        let id = ui.make_persistent_id(("combo", &name));
        let area = Head::allocate(ui);
        let field = area.field;
        let response = ui.interact(area.handle, id, Sense::click());
        let mut row = RowResponse::new(response.clone());
        let before = *chosen;
        let list = id.with("list");
        let open = Popup::is_id_open(ui.ctx(), list);
        if response.has_focus() && !open {
            self.keys(ui, id, chosen, &mut row);
        }
        let current = self.choices.get(*chosen).copied().unwrap_or_default();
        response.widget_info(|| {
            let mut info = WidgetInfo::labeled(Role::ComboBox, ui.is_enabled(), &name);
            info.current_text_value = Some(current.spoken());
            info
        });
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_expanded(open);
            if !self.head.tip.text.is_empty() {
                node.set_description(self.head.tip.text);
            }
        });
        let lit = ui.is_enabled() && (response.hovered() || open);
        if self.head.show(ui, &area, lit || response.has_focus()) || row.reset {
            *chosen = self.default;
            row.reset = true;
            row.committed = true;
        }
        let fill = field_fill(ui, id, lit, self.head.biased);
        ui.painter().rect_filled(field, size::RADIUS, fill);
        let middle = field.center().y;
        let mut room = field.right() - CHEVRON - WORD;
        if current.biased {
            let at = pos2(room, middle);
            let word = text_at(ui, at, Align2::RIGHT_CENTER, BIASED, Type::SmallValue, theme.warn);
            room = word.left() - INSET;
        }
        let left = pos2(field.left() + INSET, middle);
        text_within(ui, left, room - left.x, current.name, Type::Body, theme.text);
        let chevron = pos2(field.right() - CHEVRON, middle);
        icon_at(ui, chevron, icon::DOWN, Type::SmallIcon, if lit { theme.text } else { theme.text2 });
        if response.has_focus() {
            focus_ring(ui, field);
        }
        self.list(ui, &response, field, list, chosen);
        if *chosen != before {
            row.choose();
        }
        tooltip::for_row(ui, &response, area.row, &name, &self.head.tip, || {
            vec![("Default", self.choices.get(self.default).map_or(String::new(), |c| c.name.into()))]
        });
        row
    }

    /// Left and right step through the open choices without the list, Delete resets.
    fn keys(&self, ui: &Ui, id: egui::Id, chosen: &mut usize, row: &mut RowResponse) {
        let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
        let pressed = |key| ui.input_mut(|i| i.consume_key(Modifiers::NONE, key));
        let free = |i: &usize| self.choices[*i].blocked.is_empty();
        if pressed(Key::ArrowRight)
            && let Some(next) = (*chosen + 1..self.choices.len()).find(free)
        {
            *chosen = next;
        }
        if pressed(Key::ArrowLeft)
            && let Some(next) = (0..*chosen).rev().find(free)
        {
            *chosen = next;
        }
        row.reset = pressed(Key::Delete) || pressed(Key::Backspace);
    }

    fn list(&self, ui: &Ui, response: &egui::Response, field: egui::Rect, id: egui::Id, chosen: &mut usize) {
        let theme = Theme::of(ui);
        let frame = Frame::new()
            .fill(theme.panel)
            .stroke(Stroke::new(1.0, theme.line))
            .corner_radius(size::RADIUS_MENU)
            .shadow(theme.card_shadow())
            .inner_margin(Margin::same(4));
        let was_open = response.ctx.read_response(id).is_some();
        let popup = Popup::menu(response).id(id).anchor(field).width(field.width()).gap(4.0).frame(frame);
        let shown = popup.show(|ui| {
            let width = self.choices.iter().map(|c| item_width(ui, c)).fold(field.width() - 8.0, f32::max);
            ui.set_width(width);
            ui.spacing_mut().item_spacing.y = 0.0;
            egui::ScrollArea::vertical().max_height(LIST).show(ui, |ui| {
                for (i, choice) in self.choices.iter().enumerate() {
                    let (rect, _) = ui.allocate_exact_size(vec2(width, ITEM), Sense::hover());
                    let enabled = choice.blocked.is_empty();
                    let sense = if enabled { Sense::click() } else { Sense::hover() };
                    let press = ui.interact(rect, id.with(i), sense);
                    press.widget_info(|| {
                        WidgetInfo::selected(Role::ListBoxOption, enabled, *chosen == i, choice.spoken())
                    });
                    if *chosen == i && !was_open {
                        press.request_focus();
                        press.scroll_to_me(None);
                    }
                    if press.clicked() {
                        *chosen = i;
                        ui.close();
                        response.request_focus();
                    }
                    item(ui, rect, choice, &press, *chosen == i);
                }
            });
        });
        if shown.is_some() {
            ui.ctx().accesskit_node_builder(id, |node| node.set_role(Role::ListBox));
        }
    }
}

/// The room for the check before a name.
const CHECK: f32 = 24.0;

fn item_width(ui: &Ui, choice: &Choice) -> f32 {
    let note = if choice.biased { BIASED } else { choice.blocked };
    let note = if note.is_empty() { 0.0 } else { text_width(ui, note, Type::Small) + size::PADDING };
    CHECK + text_width(ui, choice.name, Type::Body) + note + INSET
}

fn item(ui: &Ui, rect: egui::Rect, choice: &Choice, press: &egui::Response, on: bool) {
    let theme = Theme::of(ui);
    let enabled = choice.blocked.is_empty();
    if enabled && (press.hovered() || press.has_focus()) {
        ui.painter().rect_filled(rect, size::RADIUS, theme.hover);
    }
    if on {
        icon_at(ui, pos2(rect.left() + CHECK / 2.0, rect.center().y), icon::OK, Type::SmallIcon, theme.text);
    }
    let faded = |ink: egui::Color32| {
        if enabled { ink } else { ink.gamma_multiply(ui.visuals().disabled_alpha) }
    };
    let left = pos2(rect.left() + CHECK, rect.center().y);
    text_at(ui, left, Align2::LEFT_CENTER, choice.name, Type::Body, faded(theme.text));
    let right = pos2(rect.right() - INSET, rect.center().y);
    if choice.biased {
        text_at(ui, right, Align2::RIGHT_CENTER, BIASED, Type::SmallValue, theme.warn);
    } else if !enabled {
        text_at(ui, right, Align2::RIGHT_CENTER, choice.blocked, Type::Small, theme.text3);
    }
}
