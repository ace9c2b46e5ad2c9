//! A section of the panel: its header tells the state in a few words even when it is closed.

use egui::collapsing_header::CollapsingState;
use egui::{Align2, CursorIcon, Response, Role, Sense, Ui, WidgetInfo, pos2, vec2};

use super::{BIASED, focus_ring, hairline, icon_at, text_at, text_width};
use crate::app::theme::{Theme, Type, icon, size};

/// A foldable group of rows.
#[derive(Clone, Copy, Debug)]
pub struct Section<'a> {
    /// Its title.
    pub title: &'a str,
    /// The state in a few words, such as "Sun 42°, sky 0.5".
    pub summary: &'a str,
    /// Some setting in it differs from its default: a dot before the summary while it is closed.
    pub changed: bool,
    /// Some setting in it makes the picture biased: said in place of a summary that does not say so itself.
    pub biased: bool,
    /// The first section has no line above it.
    pub first: bool,
}

/// Centre of the chevron from the panel's left.
const CHEVRON: f32 = 18.0;
/// Where the title begins.
const TITLE: f32 = 34.0;

impl Section<'_> {
    /// Shows the header, and below it `body` while `open`. A click anywhere on the header folds it.
    pub fn show(&self, ui: &mut Ui, open: &mut bool, body: impl FnOnce(&mut Ui)) -> Response {
        let id = ui.make_persistent_id(("section", self.title));
        let response = self.header(ui, id, open);
        let mut fold = CollapsingState::load_with_default_open(ui.ctx(), id.with("fold"), *open);
        fold.set_open(*open);
        fold.show_body_unindented(ui, |ui| {
            ui.push_id(id, |ui| {
                ui.spacing_mut().item_spacing.y = size::GAP;
                body(ui);
                // The rows around it add their own gaps.
                ui.add_space(size::SECTION_END - size::GAP);
            });
        });
        response
    }

    fn state(&self) -> &str {
        if self.biased && !self.summary.starts_with(BIASED) { BIASED } else { self.summary }
    }

    fn header(&self, ui: &mut Ui, id: egui::Id, open: &mut bool) -> Response {
        let theme = Theme::of(ui);
        let (rect, _) = ui.allocate_exact_size(vec2(ui.available_width(), size::HEADER), Sense::hover());
        if !self.first {
            hairline(ui, rect.x_range(), rect.top());
        }
        let mut response = ui.interact(rect, id, Sense::click()).on_hover_cursor(CursorIcon::PointingHand);
        if response.clicked() {
            *open = !*open;
            response.mark_changed();
        }
        if response.gained_focus() {
            response.scroll_to_me(None);
        }
        let expanded = *open;
        response.widget_info(|| WidgetInfo::labeled(Role::DisclosureTriangle, ui.is_enabled(), self.title));
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_expanded(expanded);
            let state = self.state();
            node.set_description(if self.changed { format!("{state}, changed") } else { state.into() });
        });
        if !ui.is_rect_visible(rect) {
            return response;
        }
        let lit = response.hovered();
        let chevron = if expanded { icon::DOWN } else { icon::RIGHT };
        let y = rect.center().y;
        icon_at(
            ui,
            pos2(rect.left() + CHEVRON, y),
            chevron,
            Type::SmallIcon,
            if lit { theme.text } else { theme.text2 },
        );
        let left = pos2(rect.left() + TITLE, y);
        let title = text_at(ui, left, Align2::LEFT_CENTER, self.title, Type::Header, theme.text);
        let right = rect.right() - size::PADDING;
        let room = right - title.right() - 2.0 * size::PADDING;
        let word = self.state();
        let (kind, ink) = if self.biased { (Type::SmallValue, theme.warn) } else { (Type::Small, theme.text3) };
        let width = text_width(ui, word, kind).min(room);
        super::text_within(ui, pos2(right - width, y), width + 0.5, word, kind, ink);
        if self.changed && !expanded && !word.is_empty() {
            let dot = pos2(right - width - size::SPACE, y);
            ui.painter().circle_filled(dot, size::DOT, theme.accent);
        }
        if response.has_focus() {
            focus_ring(ui, rect.shrink2(vec2(size::SPACE, 3.0)));
        }
        response
    }
}
