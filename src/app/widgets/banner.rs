//! One sentence across the top of the picture, with one action. It pushes the overlays down, not the picture.

use egui::{Rect, Ui, UiBuilder, Vec2, pos2};

use super::{action_text, icon_at, icon_button, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// A lasting condition, such as a software adapter.
#[derive(Clone, Copy, Debug)]
pub struct Banner<'a> {
    /// One sentence.
    pub text: &'a str,
    /// A shorter one for narrow windows.
    pub brief: &'a str,
    /// The words of the action; "": none.
    pub action: &'a str,
}

/// What the user did with it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BannerAnswer {
    /// Clicked the action.
    Act,
    /// Closed it.
    Close,
}

impl Banner<'_> {
    /// Shows it along the top of `viewport`.
    pub fn show(&self, ui: &mut Ui, viewport: Rect) -> Option<BannerAnswer> {
        let theme = Theme::of(ui);
        let rect = Rect::from_min_size(viewport.min, egui::vec2(viewport.width(), size::BANNER));
        ui.painter().rect_filled(rect, 0, theme.warn_bg);
        let y = rect.center().y;
        let sign = pos2(rect.left() + size::PADDING + size::ICON / 2.0, y);
        icon_at(ui, sign, icon::WARN, Type::Icon, theme.warn);
        let cross = Rect::from_center_size(pos2(rect.right() - size::PADDING - 4.0, y), Vec2::splat(size::ROW));
        let mut answer = None;
        if icon_button(ui, cross, ui.make_persistent_id("close banner"), icon::CLOSE).clicked() {
            answer = Some(BannerAnswer::Close);
        }
        let mut right = cross.left() - size::PADDING;
        if !self.action.is_empty() {
            let width = super::text_width(ui, self.action, Type::SmallValue);
            let place = Rect::from_center_size(pos2(right - width / 2.0, y), egui::vec2(width, 20.0));
            let mut child = ui.new_child(UiBuilder::new().id_salt("banner action").max_rect(place));
            if action_text(&mut child, self.action).clicked() {
                answer = Some(BannerAnswer::Act);
            }
            right = place.left() - size::PADDING;
        }
        let text = if viewport.width() < size::COMPACT_BELOW { self.brief } else { self.text };
        let left = sign.x + size::ICON;
        text_within(ui, pos2(left, y), right - left, text, Type::Small, theme.text);
        let spoken = ui.interact(rect, ui.make_persistent_id("banner"), egui::Sense::hover());
        spoken.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Alert, true, self.text));
        answer
    }
}
