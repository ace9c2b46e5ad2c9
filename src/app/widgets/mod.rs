//! The widgets of the window, drawn as the design says: rows of the side panel, bars, cards and overlays.
//!
//! They know numbers, texts and choices, never the program's own types: the panels wire them to settings. A row spans
//! the whole width of the panel, which has no margin of its own: the gutter for the "changed" and "biased" dots is at
//! its left edge, then come the label and the field.

mod banner;
mod checkbox;
mod colour_row;
mod combo;
mod convergence;
mod help;
mod histogram;
mod legend;
mod loupe;
pub mod number;
mod overlay;
mod phase_plot;
mod readout;
mod report;
mod scrub;
mod section;
mod segments;
mod slider_row;
mod status_bar;
mod text_row;
mod timeline;
mod toast;
mod tooltip;
mod top_bar;
mod versus;
mod wipe;

use egui::{Align2, Color32, CornerRadius, Frame, Margin, Pos2, Rect, Response, Sense, Stroke, StrokeKind, Ui, pos2};

pub use banner::{Banner, BannerAnswer};
pub use checkbox::CheckRow;
pub use colour_row::{ColourRow, VectorRow};
pub use combo::{Choice, ComboRow};
pub use convergence::Convergence;
pub use help::{Help, HelpEntry};
pub use histogram::Histogram;
pub use legend::Legend;
pub use loupe::{Loupe, LoupeLine, LoupePixel, SIDE};
pub use number::{Digits, Scale};
pub use overlay::{axis_gizmo, drop_target, panel_scroll};
pub use phase_plot::PhasePlot;
pub use readout::{InfoRow, Readout, readouts};
pub use report::{Report, ReportAnswer, ReportLine};
pub use section::Section;
pub use segments::{SegmentsRow, segments};
pub use slider_row::{Auto, SliderRow};
pub use status_bar::{Cell, StatusBar, StatusClick, Tone, Trust};
pub use text_row::{ButtonsRow, TextAnswer, TextRow};
pub use timeline::{Timeline, TimelineAnswer};
pub use toast::{Kind, LogEntry, ToastAction, ToastAnswer, Toasts};
pub use tooltip::Tip;
pub use top_bar::{file_name, tool_button};
pub use versus::{Contest, versus};
pub use wipe::{Chip, Wipe, chips};

use crate::app::theme::{Icon, Theme, Type, size};

/// What every row of the panel begins with.
#[derive(Clone, Copy, Debug, Default)]
pub struct Head<'a> {
    /// The setting's plain name, without its unit.
    pub label: &'a str,
    /// Its symbol, or "".
    pub symbol: &'a str,
    /// It differs from its default or preset: a dot in the gutter, which resets it, and blue under the value.
    pub changed: bool,
    /// The choice makes the picture biased: said by the word, and by an amber field.
    pub biased: bool,
    /// What the tooltip says.
    pub tip: Tip<'a>,
}

/// What happened in a row.
#[derive(Clone, Debug)]
pub struct RowResponse {
    /// The value is another one than before this frame.
    pub changed: bool,
    /// A drag is under way: more changes may follow, and one step of undo covers them all.
    pub dragging: bool,
    /// An edit has ended: the end of a drag, a typed value, a key, a reset. The place for a step of undo.
    pub committed: bool,
    /// The user asked for the default. Rows that know it have already set it.
    pub reset: bool,
    /// The user asked for the value that the program chooses.
    pub auto: bool,
    /// The input's own response: focus, hover, place.
    pub response: Response,
}

impl RowResponse {
    /// Nothing has happened yet. A row that the keyboard comes to is scrolled into view.
    fn new(response: Response) -> RowResponse {
        if response.gained_focus() {
            response.scroll_to_me(None);
        }
        RowResponse { changed: false, dragging: false, committed: false, reset: false, auto: false, response }
    }

    /// A choice: changed and done in one.
    fn choose(&mut self) {
        self.changed = true;
        self.committed = true;
    }
}

/// The places of one row.
#[derive(Clone, Copy)]
struct RowArea {
    /// The whole row, as wide as the panel.
    row: Rect,
    /// The field at its right.
    field: Rect,
    /// Label and field: where the pointer is on the row.
    handle: Rect,
}

impl<'a> Head<'a> {
    /// A head with only a label.
    pub fn new(label: &'a str) -> Head<'a> {
        Head { label, ..Head::default() }
    }

    /// The accessible name: what the label shows.
    fn name(&self) -> String {
        if self.symbol.is_empty() { self.label.into() } else { format!("{} {}", self.label, self.symbol) }
    }

    /// The colour that tells the state of the value.
    fn mark(&self, theme: &Theme) -> Color32 {
        match (self.biased, self.changed) {
            (true, _) => theme.warn,
            (false, true) => theme.accent,
            (false, false) => theme.edge,
        }
    }

    /// Takes the space of a row.
    fn allocate(ui: &mut Ui) -> RowArea {
        let (row, _) = ui.allocate_exact_size(egui::vec2(ui.available_width(), size::ROW), Sense::hover());
        let inset = (size::ROW - size::FIELD) / 2.0;
        let field = Rect::from_min_max(
            pos2(row.left() + size::FIELD_LEFT, row.top() + inset),
            pos2(row.right() - size::PADDING, row.bottom() - inset),
        );
        let handle = Rect::from_min_max(pos2(row.left() + size::PADDING, row.top()), pos2(field.right(), row.bottom()));
        RowArea { row, field, handle }
    }

    /// Paints the label and the mark. True if the mark was clicked: reset.
    fn show(&self, ui: &mut Ui, area: &RowArea, lit: bool) -> bool {
        let theme = Theme::of(ui);
        let name = self.name();
        let room = size::LABEL_RIGHT - size::PADDING;
        let left = pos2(area.row.left() + size::PADDING, area.row.center().y);
        let ink = if lit { theme.text } else { theme.text2 };
        text_within(ui, left, room, &name, Type::Body, ink);
        if !self.changed && !self.biased {
            return false;
        }
        let centre = pos2(area.row.left() + size::GUTTER, area.row.center().y);
        let spot = Rect::from_center_size(centre, egui::vec2(2.0 * size::GUTTER, size::ROW));
        // Not a stop for Tab: the keyboard resets a row with Delete.
        let dot = ui.interact(spot, ui.make_persistent_id(("mark", &name)), Sense::CLICK);
        let dot = dot.on_hover_cursor(egui::CursorIcon::PointingHand);
        dot.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ui.is_enabled(), format!("Reset {name}")));
        let radius = if dot.hovered() { size::DOT + 1.0 } else { size::DOT };
        ui.painter().circle_filled(centre, radius, self.mark(theme));
        dot.clicked()
    }
}

/// The word that goes with amber everywhere.
const BIASED: &str = "biased";

/// The ground of a field: its state blends in over the time of the style's animation.
fn field_fill(ui: &Ui, id: egui::Id, lit: bool, biased: bool) -> Color32 {
    let theme = Theme::of(ui);
    let rest = if biased { theme.warn_bg } else { theme.field };
    let over = if biased { theme.warn_bg } else { theme.hover };
    rest.lerp_to_gamma(over, ui.ctx().animate_bool(id.with("lit"), lit))
}

/// The ring round a field with keyboard focus.
fn focus_ring(ui: &Ui, field: Rect) {
    let stroke = Stroke::new(size::FOCUS, Theme::of(ui).accent);
    ui.painter().rect_stroke(field.expand(size::FOCUS), size::RADIUS_MENU, stroke, StrokeKind::Outside);
}

/// One line of text whose anchor is at `at`; vertically it is centred by its row height, as looks right for Inter.
fn text_at(ui: &Ui, at: Pos2, anchor: Align2, text: impl ToString, kind: Type, ink: Color32) -> Rect {
    ui.painter().text(at, anchor, text, kind.font(), ink)
}

/// One line from `left` that is cut with "…" at `room`.
fn text_within(ui: &Ui, left: Pos2, room: f32, text: &str, kind: Type, ink: Color32) -> Rect {
    let mut job = egui::text::LayoutJob::simple_singleline(text.into(), kind.font(), ink);
    job.wrap = egui::text::TextWrapping::truncate_at_width(room.max(0.0));
    let galley = ui.painter().layout_job(job);
    let at = pos2(left.x, left.y - galley.size().y / 2.0);
    let rect = Rect::from_min_size(at, galley.size());
    ui.painter().galley(at, galley, ink);
    rect
}

/// The width of one line.
fn text_width(ui: &Ui, text: &str, kind: Type) -> f32 {
    ui.painter().layout_no_wrap(text.into(), kind.font(), Color32::PLACEHOLDER).size().x
}

/// An icon centred at `at`.
fn icon_at(ui: &Ui, at: Pos2, icon: Icon, kind: Type, ink: Color32) {
    ui.painter().text(at, Align2::CENTER_CENTER, icon.glyph, kind.font(), ink);
}

/// The frame of cards: toasts, tooltips, overlays.
fn card(theme: &Theme) -> Frame {
    Frame::new()
        .fill(theme.panel)
        .stroke(Stroke::new(1.0, theme.line))
        .corner_radius(CornerRadius::same(size::RADIUS_CARD))
        .shadow(theme.card_shadow())
        .inner_margin(Margin::symmetric(14, 12))
}

/// A horizontal hairline on a pixel centre.
fn hairline(ui: &Ui, x: egui::Rangef, y: f32) {
    let y = ui.painter().round_to_pixel_center(y);
    ui.painter().hline(x, y, Stroke::new(1.0 / ui.pixels_per_point().max(1.0), Theme::of(ui).line));
}

/// Text that acts: accent colour, underlined under the pointer, with focus ring and name.
fn action_text(ui: &mut Ui, text: &str) -> Response {
    let theme = Theme::of(ui);
    let width = text_width(ui, text, Type::SmallValue);
    let (rect, response) = ui.allocate_exact_size(egui::vec2(width, 20.0), Sense::click());
    let response = response.on_hover_cursor(egui::CursorIcon::PointingHand);
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ui.is_enabled(), text));
    text_at(ui, rect.left_center(), Align2::LEFT_CENTER, text, Type::SmallValue, theme.accent);
    if response.hovered() {
        let y = ui.painter().round_to_pixel_center(rect.center().y + 7.0);
        ui.painter().hline(rect.x_range(), y, Stroke::new(1.0, theme.accent));
    }
    if response.has_focus() {
        focus_ring(ui, rect.shrink2(egui::vec2(0.0, 1.0)));
    }
    response
}

/// A small icon without a ground, for closing cards; lit under the pointer.
fn icon_button(ui: &Ui, rect: Rect, id: egui::Id, icon: Icon) -> Response {
    let theme = Theme::of(ui);
    let response = ui.interact(rect, id, Sense::click());
    response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Button, ui.is_enabled(), icon.name));
    if response.hovered() {
        ui.painter().rect_filled(rect, size::RADIUS, theme.hover);
    }
    let ink = if response.hovered() { theme.text } else { theme.text2 };
    icon_at(ui, rect.center(), icon, Type::Icon, ink);
    if response.has_focus() {
        focus_ring(ui, rect);
    }
    response
}
