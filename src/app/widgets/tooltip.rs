//! The card that explains a setting. It stands left of the panel, so that it never hides its own row.

use egui::{Align, Key, Layout, Rect, RectAlign, Response, Tooltip, Ui, vec2};

use super::{card, text_at, text_width};
use crate::app::theme::{Theme, Type, size};

/// What the tooltip of a setting says. Range and default come from the row itself.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tip<'a> {
    /// The key in scene files.
    pub key: &'a str,
    /// Plain words, two lines at most; "": no tooltip.
    pub text: &'a str,
    /// What a change costs, such as "restarts the picture".
    pub cost: &'a str,
}

/// Seconds that the keyboard focus rests on a row before its card comes.
const FOCUS_DELAY: f64 = 1.0;
/// From the panel to the card.
const GAP: f32 = 8.0;
/// Width of the column of captions.
const CAPTIONS: f32 = 74.0;
/// Height of a line of captions.
const LINE: f32 = 18.0;

/// The row that the keyboard came to, and when; F1 makes it long ago, Escape never.
#[derive(Clone, Copy, PartialEq)]
struct Focused {
    id: egui::Id,
    since: f64,
}

/// Shows the card of a row: while the pointer rests on it, 1 s after the keyboard came to it, or at once by F1.
pub(super) fn for_row(
    ui: &Ui,
    response: &Response,
    row: Rect,
    name: &str,
    tip: &Tip,
    lines: impl FnOnce() -> Vec<(&'static str, String)>,
) {
    if tip.text.is_empty() {
        return;
    }
    let by_pointer = Tooltip::should_show_tooltip(response, false) && response.enabled();
    let by_keyboard = response.has_focus() && keyboard_rests(ui, response);
    if !by_pointer && !by_keyboard {
        return;
    }
    let mut tooltip = Tooltip::for_widget(response);
    tooltip.popup = tooltip
        .popup
        .anchor(row)
        .align(RectAlign::LEFT)
        .align_alternatives(&[RectAlign::RIGHT, RectAlign::BOTTOM_END, RectAlign::TOP_END])
        .gap(GAP)
        .frame(card(Theme::of(ui)))
        .open(true);
    tooltip.show(|ui| contents(ui, name, tip, lines()));
}

fn keyboard_rests(ui: &Ui, response: &Response) -> bool {
    let slot = egui::Id::unique("tooltip of the focus");
    let (now, by_pointer, f1, escape) = ui.input(|i| {
        let pointer = i.pointer.any_down() || i.pointer.any_released();
        (i.time, pointer, i.key_pressed(Key::F1), i.key_pressed(Key::Escape))
    });
    let mut focused = ui.data(|data| data.get_temp::<Focused>(slot)).filter(|f| f.id == response.id);
    let fresh = focused.is_none();
    let state = focused.get_or_insert(Focused { id: response.id, since: now });
    if by_pointer && fresh || escape {
        state.since = f64::INFINITY;
    }
    if f1 {
        state.since = f64::NEG_INFINITY;
    }
    let state = *state;
    ui.data_mut(|data| data.insert_temp(slot, state));
    let rested = now - state.since;
    if (0.0..FOCUS_DELAY).contains(&rested) {
        ui.ctx().request_repaint_after_secs((FOCUS_DELAY - rested) as f32);
    }
    rested >= FOCUS_DELAY
}

fn contents(ui: &mut Ui, name: &str, tip: &Tip, lines: Vec<(&'static str, String)>) {
    let theme = Theme::of(ui);
    ui.set_width(size::TIP - 30.0);
    ui.spacing_mut().item_spacing.y = 6.0;
    let (title, _) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), egui::Sense::hover());
    text_at(ui, title.left_center(), egui::Align2::LEFT_CENTER, name, Type::Header, theme.text);
    // A long key would run into a long name: the name is what must stay.
    if text_width(ui, name, Type::Header) + text_width(ui, tip.key, Type::Small) + GAP <= title.width() {
        text_at(ui, title.right_center(), egui::Align2::RIGHT_CENTER, tip.key, Type::Small, theme.text3);
    }
    ui.with_layout(Layout::top_down(Align::LEFT), |ui| {
        ui.add(egui::Label::new(egui::RichText::new(tip.text).font(Type::Small.font()).color(theme.text2)).wrap());
    });
    let cost = (!tip.cost.is_empty()).then(|| ("A change", tip.cost.to_owned()));
    let lines: Vec<_> = lines.into_iter().chain(cost).collect();
    let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), LINE * lines.len() as f32), egui::Sense::hover());
    for (i, (caption, text)) in lines.iter().enumerate() {
        let at = rect.left_top() + vec2(0.0, LINE * (i as f32 + 0.5));
        text_at(ui, at, egui::Align2::LEFT_CENTER, caption, Type::Small, theme.text3);
        text_at(ui, at + vec2(CAPTIONS, 0.0), egui::Align2::LEFT_CENTER, text, Type::Small, theme.text);
    }
}
