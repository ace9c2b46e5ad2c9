//! The input of a number: drag, keys, typing, menu, screen reader. Painting is the rows' business.

use std::ops::RangeInclusive;

use egui::{
    Align2, CursorIcon, Event, EventFilter, Frame, Id, Key, Margin, Modifiers, PointerButton, Rect, Sense, Stroke,
    TextEdit, Ui, WidgetInfo, accesskit,
};

use super::number::{self, Digits, Scale};
use super::slider_row::Auto;
use super::{RowResponse, focus_ring};
use crate::app::theme::{Theme, Type, size};

/// What a drag by Shift is slowed down to.
const FINE: f64 = 0.1;
/// One press of an arrow key goes this part of a non-linear scale.
const KEY_STEP: f64 = 0.01;
/// Page Up and Page Down are this many arrow presses.
const PAGE: f64 = 10.0;
/// A second click within this many seconds of the one that began the typing resets the value.
const DOUBLE_CLICK: f64 = 0.5;
/// A stored value this near to the shown one is edited as shown; settings may have passed through 32 bits.
const SAME: f64 = 1e-6;

/// How a number moves.
#[derive(Clone, Copy)]
pub(super) enum Travel<'a> {
    /// Along a scale: the field's width is its length.
    Along(Scale, &'a RangeInclusive<f64>),
    /// Without ends: this much per point of drag.
    Free(f64),
}

impl Travel<'_> {
    /// Where a drag of `value` starts: a place along the scale, or the value.
    fn grip(self, value: f64) -> f64 {
        match self {
            Travel::Along(scale, range) => scale.position(value, range),
            Travel::Free(_) => value,
        }
    }

    /// The grip after `points` of drag on a field of `width`.
    fn drag(self, grip: f64, points: f64, width: f64) -> f64 {
        match self {
            Travel::Along(..) => (grip + points / width).clamp(0.0, 1.0),
            Travel::Free(per_point) => grip + points * per_point,
        }
    }

    fn release(self, grip: f64) -> f64 {
        match self {
            Travel::Along(scale, range) => scale.value(grip, range),
            Travel::Free(_) => grip,
        }
    }
}

/// One number that can be edited.
pub(super) struct Scrub<'a> {
    /// The accessible name.
    pub name: &'a str,
    /// What a screen reader adds to it.
    pub description: &'a str,
    /// The unit, "" for none.
    pub unit: &'a str,
    /// How it moves.
    pub travel: Travel<'a>,
    /// What may be typed; the travel may be shorter.
    pub limits: &'a RangeInclusive<f64>,
    /// How it is shown, and what drags and keys round to.
    pub digits: Digits,
    /// The default; `None` where the program chooses it.
    pub default: Option<f64>,
    /// Whether the program can choose the value.
    pub auto: Auto,
    /// The key in scene files, for the menu; "" for none.
    pub key: &'a str,
    /// The painted field.
    pub field: Rect,
    /// Where typed text stands in it.
    pub text: Rect,
}

/// The value while a drag is under way.
#[derive(Clone, Copy)]
struct Drag {
    /// The value before.
    start: f64,
    /// The exact place, without the rounding of what is shown.
    grip: f64,
}

/// The text while a number is typed.
#[derive(Clone)]
struct Typed {
    text: String,
    /// When the typing began, in seconds.
    since: f64,
    /// The field is new: it takes the focus.
    fresh: bool,
}

/// What came of it.
pub(super) struct Scrubbed {
    /// For the caller of the row.
    pub row: RowResponse,
    /// The number is being typed: the field is already painted.
    pub typing: bool,
}

impl Scrub<'_> {
    /// Handles all input; `handle` is where the pointer takes hold of it.
    pub fn show(&self, ui: &mut Ui, id: Id, handle: Rect, value: &mut f64) -> Scrubbed {
        let before = *value;
        let typed = ui.data(|data| data.get_temp::<Typed>(id));
        let typing = typed.is_some();
        let mut row = match typed {
            Some(typed) => self.type_in(ui, id, typed, value),
            None => self.handle(ui, id, handle, value),
        };
        if row.reset {
            match self.default {
                Some(default) => *value = default,
                None => row.auto = true,
            }
        }
        row.committed |= row.reset || row.auto;
        row.changed = *value != before;
        Scrubbed { row, typing }
    }

    /// The value as it is shown.
    pub fn shown(&self, value: f64) -> String {
        let number = self.digits.format(value);
        if self.auto == Auto::Is { format!("auto {number}") } else { number }
    }

    fn handle(&self, ui: &mut Ui, id: Id, handle: Rect, value: &mut f64) -> RowResponse {
        let response = ui.interact(handle, id, Sense::click_and_drag());
        let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
        let mut row = RowResponse::new(response.clone());
        self.drag(ui, id, &mut row, value);
        let before = *value;
        let mut begin = response.clicked().then(|| self.editable(*value));
        if response.has_focus() {
            let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            begin = begin.or(self.keys(ui, &mut row, value));
        }
        self.assistive(ui, id, value);
        row.committed |= *value != before;
        if response.double_clicked() {
            row.reset = true;
            begin = None;
        }
        response.context_menu(|ui| self.menu(ui, &mut row, *value));
        if let Some(text) = begin {
            let typed = Typed { text, since: ui.input(|i| i.time), fresh: true };
            ui.data_mut(|data| data.insert_temp(id, typed));
            ui.ctx().request_repaint();
        }
        self.describe(ui, &row, *value);
        row
    }

    fn drag(&self, ui: &Ui, id: Id, row: &mut RowResponse, value: &mut f64) {
        let drag_id = id.with("drag");
        let response = &row.response;
        if response.drag_started_by(PointerButton::Primary) {
            let drag = Drag { start: *value, grip: self.travel.grip(*value) };
            ui.data_mut(|data| data.insert_temp(drag_id, drag));
        }
        let Some(mut drag) = ui.data(|data| data.get_temp::<Drag>(drag_id)) else { return };
        if response.dragged_by(PointerButton::Primary) {
            row.dragging = true;
            let fine = if ui.input(|i| i.modifiers.shift) { FINE } else { 1.0 };
            let points = f64::from(response.drag_delta().x) * fine;
            if points != 0.0 {
                drag.grip = self.travel.drag(drag.grip, points, f64::from(self.field.width()));
                *value = self.clamp(self.digits.round(self.travel.release(drag.grip)));
                ui.data_mut(|data| data.insert_temp(drag_id, drag));
            }
        }
        if response.drag_stopped() {
            // Escape ends a drag in egui; here it takes it back.
            if ui.input(|i| i.key_pressed(Key::Escape)) {
                *value = drag.start;
            }
            row.committed = *value != drag.start;
            ui.data_mut(|data| data.remove::<Drag>(drag_id));
        }
    }

    /// Keys while the number has the focus. The text that typing begins with, if it does.
    fn keys(&self, ui: &Ui, row: &mut RowResponse, value: &mut f64) -> Option<String> {
        let press = |modifiers, key| ui.input_mut(|i| i.count_and_consume_key(modifiers, key)) as f64;
        let fine = press(Modifiers::SHIFT, Key::ArrowRight) - press(Modifiers::SHIFT, Key::ArrowLeft);
        let steps = press(Modifiers::NONE, Key::ArrowRight) - press(Modifiers::NONE, Key::ArrowLeft);
        let pages = press(Modifiers::NONE, Key::PageUp) - press(Modifiers::NONE, Key::PageDown);
        let steps = steps + fine * FINE + pages * PAGE;
        if steps != 0.0 {
            *value = self.step(*value, steps);
        }
        if let Travel::Along(_, range) = self.travel {
            if press(Modifiers::NONE, Key::Home) > 0.0 {
                *value = *range.start();
            }
            if press(Modifiers::NONE, Key::End) > 0.0 {
                *value = *range.end();
            }
        }
        row.reset = press(Modifiers::NONE, Key::Delete) + press(Modifiers::NONE, Key::Backspace) > 0.0;
        let mut begin = None;
        let mut copy = false;
        ui.input_mut(|i| {
            i.events.retain(|event| match event {
                Event::Copy => {
                    copy = true;
                    false
                }
                Event::Text(text) if text.starts_with(|c: char| c.is_ascii_digit() || "-−.,".contains(c)) => {
                    begin = Some(text.clone());
                    false
                }
                _ => true,
            });
        });
        if copy {
            ui.ctx().copy_text(self.editable(*value));
        }
        begin
    }

    /// `value` after `steps` presses of an arrow key: always at least one unit of the last digit away.
    fn step(&self, value: f64, steps: f64) -> f64 {
        let unit = self.digits.unit(value);
        let moved = match self.travel {
            Travel::Along(Scale::Linear, range) => {
                let span = range.end() - range.start();
                value + steps * 10f64.powf((span * KEY_STEP).log10().floor()).max(unit)
            }
            Travel::Along(scale, range) => {
                scale.value((scale.position(value, range) + steps * KEY_STEP).clamp(0.0, 1.0), range)
            }
            Travel::Free(_) => value + steps * unit / FINE,
        };
        let moved = self.digits.round(moved);
        self.clamp(if moved == value { self.digits.round(value + unit * steps.signum()) } else { moved })
    }

    fn assistive(&self, ui: &Ui, id: Id, value: &mut f64) {
        use accesskit::{Action, ActionData};
        let (steps, set) = ui.input(|i| {
            let steps = i.num_accesskit_action_requests(id, Action::Increment) as f64
                - i.num_accesskit_action_requests(id, Action::Decrement) as f64;
            let set = i.accesskit_action_requests(id, Action::SetValue).find_map(|request| match request.data {
                Some(ActionData::NumericValue(value)) => Some(value),
                Some(ActionData::Value(ref text)) => number::parse(text, self.unit),
                _ => None,
            });
            (steps, set)
        });
        if steps != 0.0 {
            *value = self.step(*value, steps);
        }
        if let Some(set) = set.filter(|set| set.is_finite()) {
            *value = self.clamp(set);
        }
    }

    fn describe(&self, ui: &Ui, row: &RowResponse, value: f64) {
        row.response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), value, self.name));
        ui.ctx().accesskit_node_builder(row.response.id, |node| {
            for (bound, set) in [
                (*self.limits.start(), accesskit::Node::set_min_numeric_value as fn(&mut accesskit::Node, f64)),
                (*self.limits.end(), accesskit::Node::set_max_numeric_value),
            ] {
                // Without a bound the screen reader says nothing, which is right.
                if bound.is_finite() {
                    set(node, bound);
                }
            }
            // At an end of the limits only the other way has a step.
            let steps = [1.0, -1.0].map(|steps| (self.step(value, steps) - value).abs());
            node.set_numeric_value_step(steps[0].max(steps[1]));
            let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
            node.set_value(format!("{}{unit}", self.shown(value)));
            if !self.description.is_empty() {
                node.set_description(self.description);
            }
            node.add_action(accesskit::Action::SetValue);
            node.add_action(accesskit::Action::Increment);
            node.add_action(accesskit::Action::Decrement);
        });
    }

    fn menu(&self, ui: &mut Ui, row: &mut RowResponse, value: f64) {
        let reset = match self.default {
            Some(default) => format!("Reset to {}", self.digits.format(default)),
            None => "Reset to auto".into(),
        };
        row.reset |= ui.button(reset).clicked();
        if self.auto != Auto::Never && self.default.is_some() {
            row.auto |= ui.button("Set to auto").clicked();
        }
        if ui.button("Copy value").clicked() {
            ui.ctx().copy_text(self.editable(value));
        }
        if !self.key.is_empty() && ui.button("Copy as --set").clicked() {
            ui.ctx().copy_text(format!("--set {}={}", self.key, self.editable(value)));
        }
    }

    fn type_in(&self, ui: &mut Ui, id: Id, mut typed: Typed, value: &mut f64) -> RowResponse {
        let theme = Theme::of(ui);
        let edit_id = id.with("typed");
        let wrong = self.read(&typed.text).is_none();
        ui.painter().rect_filled(self.field, size::RADIUS, theme.field);
        focus_ring(ui, self.field);
        if wrong {
            let y = self.field.bottom() - 1.0;
            ui.painter().hline(self.field.x_range().shrink(4.0), y, Stroke::new(2.0, theme.err));
        }
        let edit = TextEdit::singleline(&mut typed.text)
            .id(edit_id)
            .font(Type::Value.font())
            .frame(Frame::NONE)
            .margin(Margin::ZERO)
            .align(Align2::RIGHT_CENTER)
            .desired_width(self.text.width());
        let response = ui.place(self.text, edit).accessible_name(self.name);
        if typed.fresh {
            typed.fresh = false;
            response.request_focus();
            let mut state = TextEdit::load_state(ui.ctx(), edit_id).unwrap_or_default();
            // A digit that began the typing is kept; a shown value is there to be replaced.
            let range = if typed.text.chars().count() > 1 {
                egui::text::CCursorRange::select_all_str(&typed.text)
            } else {
                egui::text::CCursorRange::one(egui::text::CCursor::new(typed.text.chars().count()))
            };
            state.cursor.set_char_range(Some(range));
            state.store(ui.ctx(), edit_id);
        }
        let now = ui.input(|i| i.time);
        // The first click of the two was the one that began the typing, and the second may come before the text is
        // there to be hit: the pointer is asked, not the text.
        let twice = now - typed.since < DOUBLE_CLICK
            && ui.input(|i| {
                i.pointer.button_double_clicked(PointerButton::Primary)
                    && i.pointer.interact_pos().is_some_and(|at| self.field.contains(at))
            });
        let (left, escape, enter) =
            (response.lost_focus(), ui.input(|i| i.key_pressed(Key::Escape)), ui.input(|i| i.key_pressed(Key::Enter)));
        let mut row = RowResponse::new(response);
        if twice {
            row.reset = true;
        } else if left && !escape {
            match self.read(&typed.text) {
                Some(Some(number)) => {
                    // The shown text stands for the stored value, digits that are not shown included.
                    if typed.text != self.editable(*value) {
                        *value = self.clamp(number);
                    }
                    row.committed = true;
                }
                Some(None) => row.auto = true,
                None => {}
            }
        }
        if twice || left {
            ui.data_mut(|data| data.remove::<Typed>(id));
            if twice || escape || enter {
                ui.memory_mut(|memory| memory.request_focus(id));
            }
        } else {
            ui.data_mut(|data| data.insert_temp(id, typed));
        }
        row
    }

    /// The meaning of typed text: `Some(None)` is "auto".
    fn read(&self, text: &str) -> Option<Option<f64>> {
        if self.auto != Auto::Never && text.trim().eq_ignore_ascii_case("auto") {
            return Some(None);
        }
        number::parse(text, self.unit).map(Some)
    }

    /// The text that editing begins with: what is shown, or all digits where those say more.
    fn editable(&self, value: f64) -> String {
        let shown = self.digits.round(value);
        if (shown - value).abs() <= SAME * value.abs() {
            let text = self.digits.format(value).replace('\u{2009}', "");
            text.replace('−', "-")
        } else {
            format!("{value}")
        }
    }

    fn clamp(&self, value: f64) -> f64 {
        value.clamp(*self.limits.start(), *self.limits.end())
    }
}
