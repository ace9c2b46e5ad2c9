//! A list of checks as they are made: what holds, what does not, with figures.

use egui::{Align2, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};

use super::{action_text, card, icon_at, icon_button, text_at, text_within};
use crate::app::theme::{Theme, Type, icon, size};

/// One check.
#[derive(Clone, Debug, PartialEq)]
pub struct ReportLine {
    /// Whether it holds; `None`: it was not made yet.
    pub holds: Option<bool>,
    /// What is checked.
    pub name: String,
    /// What was found.
    pub figures: String,
}

/// The card.
#[derive(Clone, Copy, Debug)]
pub struct Report<'a> {
    /// Its title.
    pub title: &'a str,
    /// How it stands, in a sentence.
    pub state: &'a str,
    /// The checks, in their order.
    pub lines: &'a [ReportLine],
    /// More are to come.
    pub running: bool,
}

/// What the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ReportAnswer {
    /// Make the checks, from the first.
    Start,
    /// Make no more.
    Stop,
    /// Copy all as text.
    Copy,
    /// Close the card.
    Close,
}

/// Size of the card's contents at most, and what it leaves free of the window.
const LARGEST: egui::Vec2 = vec2(560.0, 420.0);
const MARGIN: f32 = 48.0;
/// Height of a line, of the title's line and of what stands below the list.
const LINE: f32 = 20.0;
const TITLE: f32 = 28.0;
const FOOT: f32 = 32.0;
/// Where the name begins, and the share of the line that it has.
const NAME: f32 = 22.0;
const NAME_SHARE: f32 = 0.52;

impl Report<'_> {
    /// Shows it in the middle of the window, which goes on behind it.
    pub fn show(&self, ctx: &egui::Context) -> Option<ReportAnswer> {
        let theme = Theme::current(ctx);
        let inner = LARGEST.min(ctx.content_rect().size() - vec2(2.0 * MARGIN, 2.0 * MARGIN));
        let area = egui::Area::new(egui::Id::unique(("report", self.title))).order(egui::Order::Foreground);
        let shown = area.anchor(Align2::CENTER_CENTER, egui::Vec2::ZERO).show(ctx, |ui| {
            card(theme).show(ui, |ui| {
                ui.set_min_size(inner);
                ui.set_max_size(inner);
                ui.spacing_mut().item_spacing.y = 0.0;
                self.contents(ui)
            })
        });
        shown.inner.inner
    }

    fn contents(&self, ui: &mut Ui) -> Option<ReportAnswer> {
        let theme = Theme::of(ui);
        let mut answer = None;
        let (title, heading) = ui.allocate_exact_size(vec2(ui.available_width(), TITLE), Sense::hover());
        heading.widget_info(|| WidgetInfo::labeled(Role::Heading, true, self.title));
        text_at(ui, title.left_center(), Align2::LEFT_CENTER, self.title, Type::Title, theme.text);
        let close = Rect::from_center_size(pos2(title.right() - size::SPACE, title.center().y), vec2(22.0, 22.0));
        if icon_button(ui, close, ui.scope_id().with("close"), icon::CLOSE).clicked() {
            answer = Some(ReportAnswer::Close);
        }
        let (rect, state) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
        state.widget_info(|| WidgetInfo::labeled(Role::Status, true, self.state));
        text_within(ui, rect.left_center(), rect.width(), self.state, Type::Small, theme.text2);
        ui.add_space(size::SPACE);
        let room = ui.available_height() - FOOT;
        let list = ScrollArea::vertical().max_height(room).auto_shrink(false).stick_to_bottom(self.running);
        list.show(ui, |ui| self.lines.iter().for_each(|each| line(ui, each)));
        ui.add_space(size::SPACE);
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = size::PADDING;
            let (word, does) =
                if self.running { ("Stop", ReportAnswer::Stop) } else { ("Run again", ReportAnswer::Start) };
            if action_text(ui, word).clicked() {
                answer = Some(does);
            }
            if action_text(ui, "Copy as text").clicked() {
                answer = Some(ReportAnswer::Copy);
            }
        });
        answer
    }
}

fn line(ui: &mut Ui, line: &ReportLine) {
    let theme = Theme::of(ui);
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), Sense::hover());
    let word = match line.holds {
        None => "not yet",
        Some(true) => "holds",
        Some(false) => "fails",
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, format!("{}: {word} {}", line.name, line.figures)));
    let y = rect.center().y;
    let sign = match line.holds {
        None => None,
        Some(true) => Some((icon::OK, theme.ok)),
        Some(false) => Some((icon::FAIL, theme.err)),
    };
    if let Some((sign, ink)) = sign {
        icon_at(ui, pos2(rect.left() + size::SPACE, y), sign, Type::SmallIcon, ink);
    }
    let ink = if line.holds.is_none() { theme.text3 } else { theme.text };
    let split = rect.left() + rect.width() * NAME_SHARE;
    text_within(ui, pos2(rect.left() + NAME, y), split - rect.left() - NAME, &line.name, Type::Small, ink);
    let ink = if line.holds == Some(false) { theme.err } else { theme.text2 };
    text_within(
        ui,
        pos2(split + size::SPACE, y),
        rect.right() - split - size::PADDING,
        &line.figures,
        Type::Small,
        ink,
    );
}
