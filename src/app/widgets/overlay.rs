//! What lies over the picture or the panel: axes, drop target, the fade that says "more below".

use egui::{
    Align2, Color32, CornerRadius, Mesh, Pos2, Rect, ScrollArea, Shape, Stroke, StrokeKind, Ui, Vec2, pos2, vec2,
};
use glam::{Mat3, Vec3};

use super::text_at;
use crate::app::theme::{AXES, AXIS_TEXT, Theme, Type, size};

/// Length of an axis, radius of the disc at its end, and of the whole.
const AXIS: f32 = 26.0;
const DISC: f32 = 7.0;
/// The gizmo's centre from the low left corner of the viewport.
const CORNER: Vec2 = vec2(44.0, -44.0);
/// An axis that points away from the viewer is this opaque.
const BEHIND: f32 = 0.55;
/// Opacity of the whole: it lies on the picture.
const MUTED: f32 = 0.85;

/// Shows where the world's axes point, low left in `viewport`. `view` turns world directions to the camera's: x right,
/// y up, z towards the viewer. Best shown only while the camera moves.
pub fn axis_gizmo(ui: &Ui, viewport: Rect, view: Mat3) {
    let centre = viewport.left_bottom() + CORNER;
    let mut axes: Vec<(usize, Vec3)> =
        [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| view * axis).into_iter().enumerate().collect();
    axes.sort_by(|a, b| a.1.z.total_cmp(&b.1.z));
    for (i, axis) in axes {
        let opacity = if axis.z < -0.1 { MUTED * BEHIND } else { MUTED };
        let ink = AXES[i].gamma_multiply(opacity);
        let end: Pos2 = centre + AXIS * vec2(axis.x, -axis.y);
        ui.painter().line_segment([centre, end], Stroke::new(1.5, ink));
        ui.painter().circle_filled(end, DISC, ink);
        text_at(ui, end, Align2::CENTER_CENTER, ["X", "Y", "Z"][i], Type::Key, AXIS_TEXT);
    }
}

/// Says that a file held over the window can be dropped.
pub fn drop_target(ui: &Ui, viewport: Rect) {
    let theme = Theme::of(ui);
    ui.painter().rect_filled(viewport, 0, theme.scrim);
    let outline = Stroke::new(size::FOCUS, theme.accent);
    ui.painter().rect_stroke(viewport.shrink(size::SPACE), size::RADIUS_CARD, outline, StrokeKind::Inside);
    let words = "Drop to open";
    let galley = ui.painter().layout_no_wrap(words.into(), Type::Title.font(), theme.text);
    let card = Rect::from_center_size(viewport.center(), galley.size() + vec2(48.0, 24.0));
    ui.painter().add(theme.card_shadow().as_shape(card, CornerRadius::same(size::RADIUS_CARD)));
    ui.painter().rect_filled(card, size::RADIUS_CARD, theme.panel);
    text_at(ui, card.center(), Align2::CENTER_CENTER, words, Type::Title, theme.text);
}

/// Height of the fade.
const FADE: f32 = 24.0;
/// Above the first section.
const HEAD_ROOM: f32 = 4.0;

/// The scrolling body of the side panel. Where there is more below, its lowest points fade into the panel.
pub fn panel_scroll<R>(ui: &mut Ui, body: impl FnOnce(&mut Ui) -> R) -> R {
    let theme = Theme::of(ui);
    let style = ui.style().clone();
    // The bar takes its colour from resting fields, which on the panel would be too faint.
    ui.visuals_mut().widgets.inactive.bg_fill = theme.hover;
    ui.visuals_mut().widgets.hovered.bg_fill = theme.active;
    let shown = ScrollArea::vertical().auto_shrink(false).show(ui, |ui| {
        ui.set_style(style);
        ui.spacing_mut().item_spacing.y = size::GAP;
        ui.add_space(HEAD_ROOM);
        body(ui)
    });
    let view = shown.inner_rect;
    let below = shown.content_size.y - view.height() - shown.state.clamped_offset().y;
    if below > 1.0 {
        let top = view.bottom() - FADE;
        // The scroll bar at the right stays as it is.
        let right = view.right() - size::SPACE;
        let clear = Color32::from_rgba_unmultiplied(theme.panel.r(), theme.panel.g(), theme.panel.b(), 0);
        let mut fade = Mesh::default();
        fade.colored_vertex(pos2(view.left(), top), clear);
        fade.colored_vertex(pos2(right, top), clear);
        fade.colored_vertex(pos2(view.left(), view.bottom()), theme.panel);
        fade.colored_vertex(pos2(right, view.bottom()), theme.panel);
        fade.add_triangle(0, 1, 2);
        fade.add_triangle(2, 1, 3);
        ui.painter().add(Shape::mesh(fade));
    }
    shown.inner
}
