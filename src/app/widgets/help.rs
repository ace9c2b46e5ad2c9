//! The overlay with all keys, made from the program's table of actions.

use egui::{
    Align2, Color32, FontSelection, Frame, Id, Margin, Modal, Pos2, Rect, RichText, ScrollArea, Sense, Stroke,
    StrokeKind, TextEdit, Ui, pos2, vec2,
};

use super::{card, icon_at, text_at, text_width, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// One action and its keys.
#[derive(Clone, Copy, Debug)]
pub struct HelpEntry<'a> {
    /// The heading that it stands under.
    pub group: &'a str,
    /// One key cap each, such as `["Ctrl", "Z"]`.
    pub keys: &'a [&'a str],
    /// What it does.
    pub text: &'a str,
}

impl HelpEntry<'_> {
    /// Every word of `query` is found in the action, its group or its keys, in any case.
    fn matches(&self, query: &str) -> bool {
        let all = format!("{} {} {}", self.group, self.keys.join(" "), self.text).to_lowercase();
        query.to_lowercase().split_whitespace().all(|word| all.contains(word))
    }
}

/// The overlay's state.
#[derive(Clone, Debug, Default)]
pub struct Help {
    /// It is shown.
    pub open: bool,
    /// What is searched for.
    pub query: String,
}

/// The largest size of the card.
const LARGEST: egui::Vec2 = vec2(920.0, 552.0);
/// From the window's edges to the card.
const MARGIN: f32 = 24.0;
/// From the card's edges to its contents.
const INSET: i8 = 27;
/// Size of the search field.
const SEARCH: egui::Vec2 = vec2(260.0, 28.0);
/// Height of the title's line, of a row of keys, of a group's heading, and the space between groups.
const TITLE: f32 = 42.0;
const LINE: f32 = 28.0;
const GROUP_GAP: f32 = 20.0;
/// Height of a key cap, from its edge to its text, between caps.
const CAP: f32 = 20.0;
const CAP_INSET: f32 = 5.0;
const CAP_GAP: f32 = 4.0;
/// Where the words begin, from the column's left.
const WORDS: f32 = 118.0;
/// Height of the last line.
const FOOT: f32 = 28.0;

impl Help {
    /// Opens it with an empty search, or closes it.
    pub fn toggle(&mut self) {
        self.open = !self.open;
        self.query.clear();
    }

    /// Shows it while it is open. `note` stands low right. Escape and a click beside it close it.
    pub fn show(&mut self, ctx: &egui::Context, entries: &[HelpEntry], note: &str) {
        let id = Id::unique("help overlay");
        if !self.open {
            ctx.data_mut(|data| data.remove::<bool>(id));
            return;
        }
        let theme = Theme::current(ctx);
        let window = ctx.content_rect();
        let outer = LARGEST.min(window.size() - vec2(2.0 * MARGIN, 2.0 * MARGIN));
        let modal = Modal::new(id)
            .backdrop_color(theme.scrim)
            .frame(card(theme).inner_margin(Margin::same(INSET)))
            .show(ctx, |ui| {
                let inner = outer - egui::Vec2::splat(2.0 * f32::from(INSET) + 2.0);
                ui.set_min_size(inner);
                ui.set_max_size(inner);
                self.contents(ui, id, window.width(), entries, note);
            });
        if modal.should_close() {
            self.open = false;
        }
    }

    fn contents(&mut self, ui: &mut Ui, id: Id, window: f32, entries: &[HelpEntry], note: &str) {
        let theme = Theme::of(ui);
        ui.spacing_mut().item_spacing.y = 0.0;
        let (title, heading) = ui.allocate_exact_size(vec2(ui.available_width(), TITLE), Sense::hover());
        heading.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Heading, true, "Mouse and keys"));
        let at = title.left_top() + vec2(0.0, SEARCH.y / 2.0 - 6.0);
        text_at(ui, at, Align2::LEFT_CENTER, "Mouse and keys", Type::Title, theme.text);
        let width = SEARCH.x.min(title.width() * 0.5);
        self.search(ui, id, Rect::from_min_size(pos2(title.right() - width, title.top() - 6.0), vec2(width, SEARCH.y)));
        let columns = if window >= size::DOCKED_FROM {
            3
        } else if window >= size::COMPACT_BELOW {
            2
        } else {
            1
        };
        let found: Vec<&HelpEntry> = entries.iter().filter(|entry| entry.matches(&self.query)).collect();
        let room = ui.available_height() - FOOT;
        ScrollArea::vertical().max_height(room).auto_shrink(false).show(ui, |ui| {
            if found.is_empty() {
                let (line, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
                let words = format!("No action has \u{201C}{}\u{201D}. Fewer letters find more.", self.query.trim());
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &words));
                text_at(ui, line.left_center(), Align2::LEFT_CENTER, words, Type::Body, theme.text2);
            }
            grid(ui, columns, &found);
        });
        let foot = Rect::from_min_max(pos2(title.left(), ui.max_rect().bottom() - FOOT), ui.max_rect().max);
        let y = foot.bottom();
        let end = cap(ui, pos2(foot.left(), y), "Esc");
        text_at(ui, pos2(end + 4.0, y), Align2::LEFT_CENTER, "closes this", Type::Small, theme.text3);
        text_at(ui, pos2(foot.right(), y), Align2::RIGHT_CENTER, note, Type::Small, theme.text3);
    }

    fn search(&mut self, ui: &mut Ui, id: Id, place: Rect) {
        let theme = Theme::of(ui);
        ui.painter().rect_filled(place, size::RADIUS, theme.field);
        icon_at(ui, pos2(place.left() + 15.0, place.center().y), icon::SEARCH, Type::SmallIcon, theme.text2);
        let inner = Rect::from_min_max(place.min + vec2(30.0, 1.0), place.max - vec2(8.0, 1.0));
        let hint = RichText::new("Search actions").color(theme.text2);
        let edit = TextEdit::singleline(&mut self.query)
            .id(id.with("search"))
            .font(FontSelection::FontId(Type::Body.font()))
            .frame(Frame::NONE)
            .margin(Margin::ZERO)
            .hint_text(hint)
            .align(Align2::LEFT_CENTER)
            .desired_width(inner.width());
        let response = ui.place(inner, edit).accessible_name("Search actions");
        let opened = ui.data(|data| data.get_temp::<bool>(id)).is_none();
        if opened {
            ui.data_mut(|data| data.insert_temp(id, true));
            response.request_focus();
        }
    }
}

/// The groups in `columns`, each into the shortest so far, in the order of the table.
fn grid(ui: &mut Ui, columns: usize, entries: &[&HelpEntry]) {
    let theme = Theme::of(ui);
    let mut groups: Vec<(&str, Vec<&HelpEntry>)> = Vec::new();
    for &entry in entries {
        match groups.iter_mut().find(|group| group.0 == entry.group) {
            Some(group) => group.1.push(entry),
            None => groups.push((entry.group, vec![entry])),
        }
    }
    let origin = ui.cursor().min;
    let pitch = ui.available_width() / columns as f32;
    let mut heights = vec![0.0f32; columns];
    for (name, entries) in groups {
        let shortest = (0..columns).min_by(|&a, &b| heights[a].total_cmp(&heights[b])).unwrap_or(0);
        let left = origin.x + pitch * shortest as f32;
        let mut y = origin.y + heights[shortest] + LINE / 2.0;
        text_at(ui, pos2(left, y), Align2::LEFT_CENTER, name, Type::Header, theme.text);
        for entry in &entries {
            y += LINE;
            line(ui, pos2(left, y), pitch, entry);
        }
        heights[shortest] = y + LINE / 2.0 + GROUP_GAP - origin.y;
    }
    let height = heights.into_iter().fold(0.0, f32::max);
    ui.allocate_exact_size(vec2(pitch * columns as f32, height), Sense::hover());
}

fn line(ui: &Ui, left: Pos2, pitch: f32, entry: &HelpEntry) {
    let theme = Theme::of(ui);
    let rect = Rect::from_min_size(pos2(left.x, left.y - LINE / 2.0), vec2(pitch, LINE));
    let id = ui.make_persistent_id(("help", entry.group, entry.text, entry.keys.join(" ")));
    let response = ui.interact(rect, id, Sense::hover());
    let spoken = format!("{}: {}", entry.keys.join(" "), entry.text);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Label, true, &spoken));
    let mut x = left.x;
    for key in entry.keys {
        x = cap(ui, pos2(x, left.y), key);
    }
    let words = (left.x + WORDS).max(x + 4.0);
    text_within(ui, pos2(words, left.y), left.x + pitch - words - 8.0, entry.text, Type::Body, theme.text2);
}

/// A key cap with its left edge at `left`; where the next one begins.
fn cap(ui: &Ui, left: Pos2, key: &str) -> f32 {
    let theme = Theme::of(ui);
    let width = (text_width(ui, key, Type::Key) + 2.0 * CAP_INSET).max(CAP - 2.0);
    let rect = Rect::from_min_size(pos2(left.x, left.y - CAP / 2.0), vec2(width, CAP));
    ui.painter().rect(rect, size::RADIUS, Color32::TRANSPARENT, Stroke::new(1.0, theme.hover), StrokeKind::Inside);
    text_at(ui, rect.center(), Align2::CENTER_CENTER, key, Type::Key, theme.text);
    rect.right() + CAP_GAP
}

#[cfg(test)]
mod tests {
    use super::HelpEntry;

    #[test]
    fn search_finds_words_in_any_part() {
        let entry = HelpEntry { group: "Look", keys: &["Shift", "Drag"], text: "Pan the camera" };
        assert!(entry.matches(""));
        assert!(entry.matches("pan"));
        assert!(entry.matches("DRAG look"));
        assert!(!entry.matches("pan zoom"));
    }
}
