//! The A/B wipe: two pictures side by side under one line that can be dragged, each named by a chip.

use egui::{
    Align2, Color32, CornerRadius, CursorIcon, EventFilter, Key, Modifiers, Rect, Sense, Stroke, Ui, Vec2, WidgetInfo,
    pos2, vec2,
};

use super::{focus_ring, icon_at, text_at, text_width, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// What a chip says of its picture.
#[derive(Clone, Copy, Debug)]
pub struct Chip<'a> {
    /// The method, such as "ReSTIR, unbiased".
    pub method: &'a str,
    /// Time, samples and error on one line.
    pub figures: &'a str,
}

/// Picture A left of the line, B right of it.
#[derive(Clone, Copy, Debug)]
pub struct Wipe<'a> {
    /// Where the line is, 0 … 1 across the viewport.
    pub at: f32,
    /// The left picture.
    pub a: Chip<'a>,
    /// The right picture.
    pub b: Chip<'a>,
}

/// Half the width of the strip that takes hold of the line.
const GRIP: f32 = 8.0;
/// Radius of the round handle.
const HANDLE: f32 = 14.0;
/// A light line on a dark one is seen on any picture.
const DARK_LINE: f32 = 3.0;
const LIGHT_LINE: f32 = 1.0;
/// One press of an arrow key.
const KEY_STEP: f32 = 0.01;
/// Height of a chip, side of its letter's square, from its edges to the square and from there to the texts.
const CHIP: f32 = 48.0;
const LETTER: f32 = 22.0;
const CHIP_INSET: f32 = 9.0;

impl Wipe<'_> {
    /// Shows line and chips over `viewport`. The new place of the line if it was moved.
    pub fn show(&self, ui: &mut Ui, viewport: Rect) -> Option<f32> {
        let theme = Theme::of(ui);
        let id = ui.make_persistent_id("wipe");
        let x = ui.painter().round_to_pixel_center(viewport.left() + self.at.clamp(0.0, 1.0) * viewport.width());
        let handle = pos2(x, viewport.center().y - 2.0 * HANDLE);
        let strip = Rect::from_x_y_ranges(x - GRIP..=x + GRIP, viewport.y_range());
        let response = ui.interact(strip, id, Sense::click_and_drag());
        let response = response.on_hover_and_drag_cursor(CursorIcon::ResizeHorizontal);
        response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), f64::from(self.at), "Wipe between A and B"));
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_min_numeric_value(0.0);
            node.set_max_numeric_value(1.0);
            node.set_numeric_value_step(f64::from(KEY_STEP));
        });
        ui.painter().vline(x, viewport.y_range(), Stroke::new(DARK_LINE, Color32::from_black_alpha(150)));
        ui.painter().vline(x, viewport.y_range(), Stroke::new(LIGHT_LINE, Color32::from_gray(0xE8)));
        ui.painter().circle_filled(handle, HANDLE, theme.panel);
        icon_at(ui, handle, icon::COMPARE, Type::Icon, theme.text);
        if response.has_focus() {
            focus_ring(ui, Rect::from_center_size(handle, Vec2::splat(2.0 * HANDLE)));
        }
        chips(ui, viewport, [Some(self.a), Some(self.b)]);

        let mut at = self.at;
        if response.dragged() {
            at += response.drag_delta().x / viewport.width();
        }
        if response.has_focus() {
            let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            let press = |key| ui.input_mut(|i| i.count_and_consume_key(Modifiers::NONE, key)) as f32;
            at += KEY_STEP * (press(Key::ArrowRight) - press(Key::ArrowLeft));
        }
        at = at.clamp(0.0, 1.0);
        (at != self.at).then_some(at)
    }
}

/// The chips of A and B in the upper corners of the viewport, each where it is given.
pub fn chips(ui: &Ui, viewport: Rect, [a, b]: [Option<Chip>; 2]) {
    let theme = Theme::of(ui);
    for (letter, side, ink, corner) in
        [("A", a, theme.accent, Align2::LEFT_TOP), ("B", b, theme.series_b, Align2::RIGHT_TOP)]
    {
        if let Some(side) = side {
            chip(ui, viewport, letter, side, ink, corner);
        }
    }
}

/// A chip in an upper corner of the viewport: nearly opaque, since it is text over the picture. It takes less than half of
/// the width, so that two never touch.
fn chip(ui: &Ui, viewport: Rect, letter: &str, chip: Chip, ink: Color32, corner: Align2) {
    let theme = Theme::of(ui);
    let texts = text_width(ui, chip.method, Type::Header).max(text_width(ui, chip.figures, Type::Small));
    let margins = 3.0 * CHIP_INSET + LETTER + 4.0;
    let width = (margins + texts).min(viewport.width() / 2.0 - 1.5 * size::PADDING);
    let room = width - margins + 0.5;
    let rect = corner.align_size_within_rect(vec2(width, CHIP), viewport.shrink(size::PADDING));
    ui.painter().add(theme.card_shadow().as_shape(rect, CornerRadius::same(size::RADIUS_MENU)));
    ui.painter().rect_filled(rect, size::RADIUS_MENU, theme.panel);
    let square =
        Rect::from_center_size(pos2(rect.left() + CHIP_INSET + LETTER / 2.0, rect.center().y), Vec2::splat(LETTER));
    ui.painter().rect_filled(square, size::RADIUS, ink);
    text_at(ui, square.center(), Align2::CENTER_CENTER, letter, Type::Header, theme.panel);
    let left = square.right() + CHIP_INSET;
    text_within(ui, pos2(left, rect.center().y - 8.0), room, chip.method, Type::Header, theme.text);
    text_within(ui, pos2(left, rect.center().y + 9.0), room, chip.figures, Type::Small, theme.text2);
    let spoken = ui.interact(rect, ui.make_persistent_id(("chip", letter)), Sense::hover());
    let words = format!("Picture {letter}: {}, {}", chip.method, chip.figures);
    spoken.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, &words));
}
