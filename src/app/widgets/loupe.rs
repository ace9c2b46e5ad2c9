//! The card of the pixel inspector: a magnified piece of the picture and the numbers of the pixel in its middle.

use egui::{Align2, Color32, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo, pos2, vec2};

use super::{action_text, card, hairline, text_at};
use crate::app::theme::{FLAG, Theme, Type, size};

/// A number of the pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct LoupeLine {
    /// What it is.
    pub caption: &'static str,
    /// The number or numbers, as text.
    pub value: String,
    /// It is a cause for caution.
    pub caution: bool,
}

/// A magnified pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum LoupePixel {
    /// Beyond the edge of the picture, or not drawn yet.
    Outside,
    /// sRGB-encoded.
    Colour([f32; 3]),
    /// Something in it was not a finite number.
    Broken,
}

/// The card.
#[derive(Clone, Copy, Debug)]
pub struct Loupe<'a> {
    /// The pixels by rows; `SIDE` of them to a row.
    pub pixels: &'a [LoupePixel],
    /// The numbers.
    pub lines: &'a [LoupeLine],
    /// It stays at its pixel.
    pub frozen: bool,
}

/// Pixels along a side.
pub const SIDE: usize = 9;
/// Size of a magnified pixel.
const CELL: f32 = 20.0;
/// Height of a line, and where its value ends.
const LINE: f32 = 18.0;
const WIDTH: f32 = CELL * SIDE as f32;

impl Loupe<'_> {
    /// Shows it in the upper right corner of `place`. True if the numbers shall be copied.
    pub fn show(&self, ui: &mut Ui, place: Rect) -> bool {
        let at = place.right_top() + vec2(-size::PADDING, size::PADDING);
        let area = egui::Area::new(egui::Id::unique("inspector")).order(egui::Order::Middle).pivot(Align2::RIGHT_TOP);
        area.fixed_pos(at).show(ui.ctx(), |ui| card(Theme::of(ui)).show(ui, |ui| self.contents(ui)).inner).inner
    }

    fn contents(&self, ui: &mut Ui) -> bool {
        let theme = Theme::of(ui);
        ui.spacing_mut().item_spacing.y = 0.0;
        let (grid, response) = ui.allocate_exact_size(vec2(WIDTH, WIDTH), Sense::hover());
        response.widget_info(|| WidgetInfo::labeled(Role::Image, true, "Magnified pixels"));
        let cell = |i: usize| {
            let corner = pos2((i % SIDE) as f32, (i / SIDE) as f32).to_vec2() * CELL;
            Rect::from_min_size(grid.min + corner, vec2(CELL, CELL))
        };
        for (i, pixel) in self.pixels.iter().enumerate().take(SIDE * SIDE) {
            let ink = match pixel {
                LoupePixel::Outside => theme.well,
                LoupePixel::Colour(rgb) => {
                    let [r, g, b] = rgb.map(|x| (x * 255.0).round() as u8);
                    Color32::from_rgb(r, g, b)
                }
                LoupePixel::Broken => FLAG,
            };
            ui.painter().rect_filled(cell(i), 0, ink);
        }
        // Seen on any picture: a light line on a dark one.
        let middle = cell(SIDE * SIDE / 2);
        ui.painter().rect_stroke(middle, 0, Stroke::new(3.0, Color32::from_black_alpha(160)), StrokeKind::Outside);
        ui.painter().rect_stroke(middle, 0, Stroke::new(1.0, Color32::WHITE), StrokeKind::Outside);
        ui.add_space(size::SPACE);
        for line in self.lines {
            let (rect, response) = ui.allocate_exact_size(vec2(WIDTH, LINE), Sense::hover());
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{} {}", line.caption, line.value)));
            let (caption, value) = if line.caution { (theme.warn, theme.warn) } else { (theme.text3, theme.text) };
            text_at(ui, rect.left_center(), Align2::LEFT_CENTER, line.caption, Type::Small, caption);
            text_at(ui, rect.right_center(), Align2::RIGHT_CENTER, &line.value, Type::SmallValue, value);
        }
        ui.add_space(size::GAP);
        hairline(ui, grid.x_range(), ui.cursor().top());
        ui.add_space(size::GAP);
        let (rect, response) = ui.allocate_exact_size(vec2(WIDTH, LINE), Sense::hover());
        let words = if self.frozen { "held: click to follow" } else { "click to hold" };
        response.widget_info(|| WidgetInfo::labeled(Role::Label, true, words));
        text_at(ui, rect.left_center(), Align2::LEFT_CENTER, words, Type::Small, theme.text3);
        action_text(ui, "Copy").clicked()
    }
}
