//! The row of a number: the whole field is the handle, and is scrubbed.

use std::f32::consts::FRAC_PI_2;
use std::ops::RangeInclusive;

use egui::{Align2, Color32, CornerRadius, Pos2, Rect, Shape, Stroke, Ui, pos2};

use super::number::{Digits, Scale};
use super::scrub::{Scrub, Travel};
use super::{BIASED, Head, RowResponse, field_fill, focus_ring, text_at, tooltip};
use crate::app::theme::{Theme, Type, size};

/// Whether the program can choose a value by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Auto {
    /// It cannot.
    #[default]
    Never,
    /// It can, but a person has chosen: "auto" can be typed.
    Can,
    /// The value is the program's choice, and says so: the word "auto" stands before it.
    Is,
}

/// A number with a range.
#[derive(Clone, Debug)]
pub struct SliderRow<'a> {
    /// Label, marks and tooltip.
    pub head: Head<'a>,
    /// The unit, "" for none; it stands after the number, never in the label.
    pub unit: &'a str,
    /// What the slider spans.
    pub range: RangeInclusive<f64>,
    /// What may be typed: the range of the setting itself.
    pub limits: RangeInclusive<f64>,
    /// How values lie along the field.
    pub scale: Scale,
    /// How the number is shown.
    pub digits: Digits,
    /// What a reset gives; `None`: the program's choice.
    pub default: Option<f64>,
    /// Whether the program can choose the value.
    pub auto: Auto,
    /// A small square of this colour at the field's left.
    pub swatch: Option<Color32>,
}

/// Height of the line under the fill.
const UNDERLINE: f32 = 2.0;
/// Height of the notches at the lower edge.
const NOTCH: f32 = 4.0;
/// Width of the bar that shows the value under the pointer.
const BAR: f32 = 3.0;
/// From the field's left to a word or swatch in it.
const INSET: f32 = 8.0;
/// How much amber the fill of a biased slider has over its ground.
const BIASED_FILL: f32 = 0.12;
/// Side of the colour swatch.
const SWATCH: f32 = 12.0;

impl<'a> SliderRow<'a> {
    /// A linear slider over `range` with two decimals; its default is the range's start.
    pub fn new(head: Head<'a>, range: RangeInclusive<f64>) -> SliderRow<'a> {
        SliderRow {
            head,
            unit: "",
            limits: range.clone(),
            default: Some(*range.start()),
            range,
            scale: Scale::Linear,
            digits: Digits::Decimals(2),
            auto: Auto::Never,
            swatch: None,
        }
    }

    /// Shows the row and edits `value`.
    pub fn show(&self, ui: &mut Ui, value: &mut f64) -> RowResponse {
        let theme = Theme::of(ui);
        let name = self.head.name();
        let id = ui.make_persistent_id(("slider", &name));
        let area = Head::allocate(ui);
        let field = area.field;
        let number_right = field.right() - size::NUMBER_INSET;
        let scrub = Scrub {
            name: &name,
            description: self.head.tip.text,
            unit: self.unit,
            travel: Travel::Along(self.scale, &self.range),
            limits: &self.limits,
            digits: self.digits,
            default: self.default,
            auto: self.auto,
            key: self.head.tip.key,
            field,
            text: Rect::from_min_max(
                pos2(field.left() + INSET, field.top() + 1.0),
                // The caret after the last digit needs its own point.
                pos2(number_right + 1.0, field.bottom() - 1.0),
            ),
        };
        let mut done = scrub.show(ui, id, area.handle, value);
        let row = &mut done.row;
        let response = row.response.clone();
        let lit = ui.is_enabled() && (response.hovered() || row.dragging || response.has_focus());
        if self.head.show(ui, &area, lit) {
            row.reset = true;
            row.committed = true;
            match self.default {
                Some(default) => {
                    row.changed = *value != default;
                    *value = default;
                }
                None => row.auto = true,
            }
        }
        if !done.typing && ui.is_rect_visible(area.row) {
            self.paint(ui, id, field, *value, response.hovered() || row.dragging);
            if response.has_focus() {
                focus_ring(ui, field);
            }
            let baseline = pos2(number_right, field.center().y);
            text_at(ui, baseline, Align2::RIGHT_CENTER, scrub.shown(*value), Type::Value, theme.text);
        }
        if !self.unit.is_empty() {
            let at = pos2(number_right + size::UNIT_GAP, field.center().y);
            text_at(ui, at, Align2::LEFT_CENTER, self.unit, Type::Small, theme.text2);
        }
        tooltip::for_row(ui, &response, area.row, &name, &self.head.tip, || {
            let short = |value: f64| {
                if value.fract() == 0.0 { Digits::Decimals(0).format(value) } else { self.digits.format(value) }
            };
            let range = format!("{} … {}", short(*self.limits.start()), short(*self.limits.end()));
            let default = self.default.map_or("auto".into(), short);
            vec![("Range", range), ("Default", default)]
        });
        done.row
    }

    fn paint(&self, ui: &Ui, id: egui::Id, field: Rect, value: f64, lit: bool) {
        let theme = Theme::of(ui);
        let painter = ui.painter();
        painter.rect_filled(field, size::RADIUS, field_fill(ui, id, lit, self.head.biased));
        let t = self.scale.position(value, &self.range) as f32;
        let x = field.left() + t * field.width();
        let r = f32::from(size::RADIUS);
        if x > field.left() + 0.5 {
            let filled = Rect::from_min_max(field.min, pos2(x, field.bottom()));
            let right = if x > field.right() - r { size::RADIUS } else { 0 };
            let corners = CornerRadius { nw: size::RADIUS, sw: size::RADIUS, ne: right, se: right };
            // Amber grounds keep their own tone: a grey fill on them would look like a third state.
            let fill = if self.head.biased { theme.warn_bg.lerp_to_gamma(theme.warn, BIASED_FILL) } else { theme.fill };
            painter.rect_filled(filled, corners, fill);
            painter.add(underline(field, x, self.head.mark(theme)));
        }
        for notch in self.scale.notches(&self.range) {
            let at = painter.round_to_pixel_center(field.left() + notch as f32 * field.width());
            let ink = if at < x { theme.field } else { theme.edge };
            painter.vline(at, egui::Rangef::new(field.bottom() - NOTCH, field.bottom()), Stroke::new(1.0, ink));
        }
        if lit {
            let left = (x - BAR / 2.0).clamp(field.left(), field.right() - BAR);
            let bar = Rect::from_min_max(pos2(left, field.top()), pos2(left + BAR, field.bottom()));
            painter.rect_filled(bar, 1, theme.text);
        }
        let mut left = field.left() + INSET;
        if let Some(colour) = self.swatch {
            let square = Rect::from_center_size(pos2(left + SWATCH / 2.0, field.center().y), egui::Vec2::splat(SWATCH));
            painter.rect_filled(square, 2, colour);
            painter.rect_stroke(square, 2, Stroke::new(1.0, theme.edge), egui::StrokeKind::Inside);
            left = square.right() + INSET;
        }
        if self.head.biased {
            text_at(ui, pos2(left, field.center().y), Align2::LEFT_CENTER, BIASED, Type::SmallValue, theme.warn);
        }
    }
}

/// The line under the fill up to `x`: it follows the rounded corners of the field.
pub(super) fn underline(field: Rect, x: f32, ink: Color32) -> Shape {
    let r = f32::from(size::RADIUS);
    let (top, bottom) = (field.bottom() - UNDERLINE, field.bottom());
    // The arc of the corner between the line's top and the field's bottom, as angles from straight down.
    let reach = ((r - UNDERLINE) / r).acos();
    let arc = |centre: Pos2, side: f32| {
        (0..=ARC).map(move |i| {
            let angle = FRAC_PI_2 + side * reach * i as f32 / ARC as f32;
            pos2(centre.x + r * angle.cos(), centre.y + r * angle.sin())
        })
    };
    let mut points: Vec<Pos2> = Vec::new();
    let right = x.min(field.right());
    if right > field.right() - r {
        let mut corner: Vec<Pos2> = arc(pos2(field.right() - r, bottom - r), -1.0).collect();
        corner.reverse();
        points.extend(corner.iter().map(|p| pos2(p.x.min(right), p.y)));
    } else {
        points.extend([pos2(right, top), pos2(right, bottom)]);
    }
    points.extend(arc(pos2(field.left() + r, bottom - r), 1.0).map(|p| pos2(p.x.min(right), p.y)));
    Shape::convex_polygon(points, ink, Stroke::NONE)
}

/// Steps of the arc of a corner.
const ARC: usize = 4;
