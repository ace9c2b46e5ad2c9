//! Parts of the top bar: tools and the file's name.

use egui::{Align2, Response, Role, Sense, Ui, Vec2, WidgetInfo, pos2};

use super::number::elide_middle;
use super::{focus_ring, icon_at, text_at, text_width};
use crate::app::theme::{Icon, Theme, Type, size};

/// A tool: an icon with a name. `keys` is its shortcut for the tooltip, `on` that it is switched on.
pub fn tool_button(ui: &mut Ui, icon: Icon, keys: &str, on: bool, enabled: bool) -> Response {
    let theme = Theme::of(ui);
    let sense = if enabled { Sense::click() } else { Sense::hover() };
    let id = ui.make_persistent_id(("tool", icon.name));
    let (_, rect) = ui.allocate_space(Vec2::splat(size::TOOL));
    let response = ui.interact(rect, id, sense);
    response.widget_info(|| WidgetInfo::selected(Role::Button, enabled && ui.is_enabled(), on, icon.name));
    if on || response.hovered() && enabled {
        let fill = if on { theme.active } else { theme.hover };
        ui.painter().rect_filled(rect, size::RADIUS, fill);
    }
    let ink = match (enabled, on || response.hovered()) {
        (false, _) => theme.text2.gamma_multiply(ui.visuals().disabled_alpha),
        (true, true) => theme.text,
        (true, false) => theme.text2,
    };
    icon_at(ui, rect.center(), icon, Type::Icon, ink);
    if response.has_focus() {
        focus_ring(ui, rect.shrink(1.0));
    }
    let words = if keys.is_empty() { icon.name.to_owned() } else { format!("{}  {keys}", icon.name) };
    response.on_hover_text(words)
}

/// From the file's name to the grid's.
const GRID_GAP: f32 = 7.0;

/// The open file and grid in at most `room`: the grid's name goes first, then the file's is cut in its middle.
pub fn file_name(ui: &mut Ui, file: &str, grid: &str, room: f32) -> Response {
    let theme = Theme::of(ui);
    let grid_width = if grid.is_empty() { 0.0 } else { GRID_GAP + text_width(ui, grid, Type::Body) };
    let file_width = text_width(ui, file, Type::Header);
    let with_grid = grid_width > 0.0 && file_width + grid_width <= room;
    let shown = elide_middle(file, |short| text_width(ui, short, Type::Header) <= room);
    let width = text_width(ui, &shown, Type::Header) + if with_grid { grid_width } else { 0.0 };
    let (rect, response) = ui.allocate_exact_size(egui::vec2(width, size::TOOL), Sense::hover());
    let full = format!("{file} {grid}");
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, full.trim_end()));
    let name = text_at(ui, rect.left_center(), Align2::LEFT_CENTER, &shown, Type::Header, theme.text);
    if with_grid {
        let at = pos2(name.right() + GRID_GAP, rect.center().y);
        text_at(ui, at, Align2::LEFT_CENTER, grid, Type::Body, theme.text3);
    }
    if shown == file && with_grid { response } else { response.on_hover_text(full) }
}
