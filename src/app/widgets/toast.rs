//! Messages that come by themselves: at most three cards at the viewport's corner, and a log of all.
//!
//! Nothing here reads a clock: the caller passes the time in seconds.

use egui::{Align2, Area, Frame, Id, Margin, Order, Rect, Role, Sense, Ui, Vec2, pos2, vec2};

use super::{action_text, card, icon_at, icon_button, text_within};
use crate::app::theme::{Icon, Theme, Type, icon, size};

/// The kind of a message. Each has its own icon: state is never told by colour alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Something to know.
    Info,
    /// Something worked.
    Ok,
    /// Something to be careful about.
    Warn,
    /// Something failed; it stays until it is closed.
    Error,
}

impl Kind {
    /// Seconds on screen; `None`: until closed.
    fn lifetime(self) -> Option<f64> {
        match self {
            Kind::Info => Some(4.0),
            Kind::Ok => Some(5.0),
            Kind::Warn => Some(8.0),
            Kind::Error => None,
        }
    }

    fn icon(self) -> Icon {
        match self {
            Kind::Info => icon::INFO,
            Kind::Ok => icon::OK,
            Kind::Warn => icon::WARN,
            Kind::Error => icon::FAIL,
        }
    }

    fn ink(self, theme: &Theme) -> egui::Color32 {
        match self {
            Kind::Info => theme.text2,
            Kind::Ok => theme.ok,
            Kind::Warn => theme.warn,
            Kind::Error => theme.err,
        }
    }
}

/// Something that a toast offers to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ToastAction {
    /// The caller's name for it, given back by [`Toasts::show`].
    pub id: u32,
    /// Its words, such as "Show in folder".
    pub label: String,
}

/// A message that was shown.
#[derive(Clone, Debug, PartialEq)]
pub struct LogEntry {
    /// When, in the caller's seconds.
    pub time: f64,
    /// The kind.
    pub kind: Kind,
    /// What happened.
    pub what: String,
    /// Why, and what to do; may be empty.
    pub more: String,
}

/// What a user did with a toast.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ToastAnswer {
    /// The toast, as [`Toasts::push`] named it.
    pub toast: u64,
    /// The action that was clicked.
    pub action: u32,
}

struct Toast {
    id: u64,
    kind: Kind,
    what: String,
    more: String,
    actions: Vec<ToastAction>,
    /// Seconds left; its clock stands still under the pointer.
    left: Option<f64>,
}

/// The messages on screen and those before.
#[derive(Default)]
pub struct Toasts {
    shown: Vec<Toast>,
    log: Vec<LogEntry>,
    next: u64,
    /// When the clocks were last moved on.
    ticked: Option<f64>,
    /// The toast under the pointer.
    hovered: Option<u64>,
}

/// At most this many are on screen; older ones are in the log.
const MOST: usize = 3;
/// The log forgets beyond this many.
const LOG: usize = 500;
/// Between toasts.
const GAP: f32 = 8.0;
/// From the card's edge to the icon's centre, and to the texts.
const ICON: f32 = 20.0;
const TEXT: f32 = 42.0;
/// Height of the title's line.
const TITLE: f32 = 20.0;
/// A toast shows this many lines under its title; the log has them all.
const LINES: usize = 2;

impl Toasts {
    /// Adds a message; `more` says why and what to do. A repeated message only starts its clock anew.
    pub fn push(
        &mut self,
        now: f64,
        kind: Kind,
        what: impl Into<String>,
        more: impl Into<String>,
        actions: Vec<ToastAction>,
    ) -> u64 {
        let (what, more) = (what.into(), more.into());
        self.log.push(LogEntry { time: now, kind, what: what.clone(), more: more.clone() });
        if self.log.len() > LOG {
            self.log.remove(0);
        }
        if let Some(same) = self.shown.iter_mut().find(|t| t.kind == kind && t.what == what && t.more == more) {
            same.left = kind.lifetime();
            same.actions = actions;
            return same.id;
        }
        let id = self.next;
        self.next += 1;
        self.shown.push(Toast { id, kind, what, more, actions, left: kind.lifetime() });
        // Errors wait for their reader as long as something else can go.
        while self.shown.len() > MOST {
            let oldest = self.shown.iter().position(|t| t.kind != Kind::Error).unwrap_or(0);
            self.shown.remove(oldest);
        }
        id
    }

    /// Takes a toast from the screen; the log keeps it.
    pub fn close(&mut self, id: u64) {
        self.shown.retain(|t| t.id != id);
    }

    /// All messages, oldest first.
    pub fn log(&self) -> &[LogEntry] {
        &self.log
    }

    /// How many are on screen.
    pub fn len(&self) -> usize {
        self.shown.len()
    }

    /// Nothing is on screen.
    pub fn is_empty(&self) -> bool {
        self.shown.is_empty()
    }

    /// Moves the clocks on to `now` and drops what has had its time. Seconds until the next one goes.
    fn tick(&mut self, now: f64) -> Option<f64> {
        let passed = self.ticked.map_or(0.0, |before| (now - before).max(0.0));
        self.ticked = Some(now);
        for toast in &mut self.shown {
            if self.hovered != Some(toast.id)
                && let Some(left) = &mut toast.left
            {
                *left -= passed;
            }
        }
        self.shown.retain(|t| t.left.is_none_or(|left| left > 0.0));
        self.shown.iter().filter_map(|t| t.left).reduce(f64::min)
    }

    /// Shows the cards in the low right corner of `viewport`, the newest lowest. Narrow viewports get only titles.
    pub fn show(&mut self, ui: &Ui, viewport: Rect, now: f64) -> Option<ToastAnswer> {
        let wait = self.tick(now);
        if let Some(wait) = wait {
            ui.ctx().request_repaint_after_secs(wait as f32);
        }
        self.hovered = None;
        let brief = viewport.width() < size::COMPACT_BELOW;
        let width = size::TOAST.min(viewport.width() - 2.0 * size::PADDING);
        let mut bottom = viewport.bottom() - size::PADDING;
        let mut answer = None;
        let mut closed = None;
        for toast in self.shown.iter().rev() {
            let area = Area::new(Id::unique(("toast", toast.id)))
                .order(Order::Foreground)
                .pivot(Align2::RIGHT_BOTTOM)
                .fixed_pos(pos2(viewport.right() - size::PADDING, bottom))
                .constrain(false)
                .default_width(width)
                .accessible_name(toast.what.clone())
                .role(Role::Alert);
            let shown = area.show(ui.ctx(), |ui| toast.show(ui, width, brief));
            let (action, close) = shown.inner;
            let rect = shown.response.rect;
            bottom = rect.top() - GAP;
            if ui.input(|i| i.pointer.hover_pos()).is_some_and(|p| rect.contains(p)) {
                self.hovered = Some(toast.id);
            }
            if let Some(action) = action {
                answer = Some(ToastAnswer { toast: toast.id, action });
            }
            if close || action.is_some() {
                closed = Some(toast.id);
            }
        }
        if let Some(id) = closed {
            self.close(id);
            ui.ctx().request_repaint();
        }
        answer
    }
}

impl Toast {
    /// The card: the action that was clicked, and whether it is to close.
    fn show(&self, ui: &mut Ui, width: f32, brief: bool) -> (Option<u32>, bool) {
        let theme = Theme::of(ui);
        let frame: Frame = card(theme).inner_margin(Margin { left: 0, right: 0, top: 10, bottom: 8 });
        let mut clicked = None;
        let mut close = false;
        frame.show(ui, |ui| {
            ui.set_width(width - 2.0);
            ui.spacing_mut().item_spacing = Vec2::ZERO;
            ui.spacing_mut().interact_size.y = TITLE;
            let (title, _) = ui.allocate_exact_size(vec2(ui.available_width(), TITLE), Sense::hover());
            let y = title.center().y;
            icon_at(ui, pos2(title.left() + ICON, y), self.kind.icon(), Type::Icon, self.kind.ink(theme));
            let cross = Rect::from_center_size(pos2(title.right() - 22.0, y), Vec2::splat(size::ROW));
            let room = cross.left() - 4.0 - title.left() - TEXT;
            text_within(ui, pos2(title.left() + TEXT, y), room, &self.what, Type::Header, theme.text);
            close = icon_button(ui, cross, ui.make_persistent_id("close"), icon::CLOSE).clicked();
            if brief {
                return;
            }
            if !self.more.is_empty() {
                self.lines(ui, theme);
            }
            if !self.actions.is_empty() {
                ui.add_space(4.0);
                ui.horizontal(|ui| {
                    ui.add_space(TEXT);
                    ui.spacing_mut().item_spacing.x = 20.0;
                    for action in &self.actions {
                        if action_text(ui, &action.label).clicked() {
                            clicked = Some(action.id);
                        }
                    }
                });
            }
        });
        (clicked, close)
    }

    fn lines(&self, ui: &mut Ui, theme: &Theme) {
        let mut job = egui::text::LayoutJob::simple(
            self.more.clone(),
            Type::Small.font(),
            theme.text2,
            ui.available_width() - TEXT - size::PADDING,
        );
        job.wrap.max_rows = LINES;
        for section in &mut job.sections {
            section.format.line_height = Some(18.0);
        }
        let galley = ui.painter().layout_job(job);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), galley.size().y), Sense::hover());
        response.widget_info(|| egui::WidgetInfo::labeled(Role::Label, true, &self.more));
        let elided = galley.elided;
        ui.painter().galley(rect.left_top() + vec2(TEXT, 0.0), galley, theme.text2);
        if elided {
            response.on_hover_text(&self.more);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clocks_run_by_kind_and_errors_stay() {
        let mut toasts = Toasts::default();
        toasts.tick(10.0);
        toasts.push(10.0, Kind::Ok, "Saved", "", vec![]);
        toasts.push(10.0, Kind::Error, "Cut short", "", vec![]);
        assert_eq!(toasts.tick(14.9).map(|s| (s * 10.0).round()), Some(1.0));
        assert_eq!(toasts.len(), 2);
        toasts.tick(15.1);
        assert_eq!(toasts.len(), 1);
        toasts.tick(1e6);
        assert_eq!(toasts.shown[0].kind, Kind::Error);
        assert_eq!(toasts.log().len(), 2);
    }

    #[test]
    fn the_pointer_stops_the_clock() {
        let mut toasts = Toasts::default();
        toasts.tick(0.0);
        let id = toasts.push(0.0, Kind::Ok, "Saved", "", vec![]);
        toasts.hovered = Some(id);
        toasts.tick(100.0);
        assert_eq!(toasts.len(), 1);
        toasts.hovered = None;
        toasts.tick(106.0);
        assert!(toasts.is_empty());
    }

    #[test]
    fn only_three_are_shown_and_errors_outlast_others() {
        let mut toasts = Toasts::default();
        toasts.push(0.0, Kind::Error, "bad", "", vec![]);
        for i in 0..5 {
            toasts.push(0.0, Kind::Info, format!("info {i}"), "", vec![]);
        }
        assert_eq!(toasts.len(), 3);
        assert_eq!(toasts.shown[0].what, "bad");
        assert_eq!(toasts.shown[2].what, "info 4");
        assert_eq!(toasts.log().len(), 6);
    }

    #[test]
    fn a_repeated_message_is_one_toast() {
        let mut toasts = Toasts::default();
        toasts.tick(0.0);
        let a = toasts.push(0.0, Kind::Ok, "Saved", "x.png", vec![]);
        toasts.tick(4.0);
        let b = toasts.push(4.0, Kind::Ok, "Saved", "x.png", vec![]);
        assert_eq!(a, b);
        toasts.tick(8.0);
        assert_eq!(toasts.len(), 1);
    }
}
