//! The timeline of a sequence: step, play, frame, track, loop, speed.

use std::ops::Range;

use egui::{
    Align2, CursorIcon, EventFilter, Key, Modifiers, Rect, Role, Sense, Ui, UiBuilder, WidgetInfo, accesskit, pos2,
    vec2,
};

use super::{focus_ring, text_at, text_width, tool_button};
use crate::app::theme::{Theme, Type, icon, size};

/// A sequence and where it stands.
#[derive(Clone, Copy, Debug)]
pub struct Timeline<'a> {
    /// The frame shown.
    pub frame: u32,
    /// The first frame and the one after the last.
    pub first: u32,
    /// The one after the last.
    pub end: u32,
    /// The frames in memory: the brighter parts of the track.
    pub loaded: &'a [Range<u32>],
    /// It plays.
    pub playing: bool,
    /// It starts again at its end.
    pub looping: bool,
    /// The speed as text, such as "24 fps".
    pub speed: &'a str,
}

/// What the user asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimelineAnswer {
    /// Play or pause.
    Play,
    /// Show this frame.
    Seek(u32),
    /// Loop or not.
    Loop,
}

/// Left edge of the first tool, and the distance of the tools.
const TOOLS: f32 = 6.0;
/// From the tools to the number, from it to the track, and from the track to the loop.
const NUMBER_GAP: f32 = 12.0;
const TRACK_GAP: f32 = 18.0;
/// Thickness of the track; size of the mark on it.
const TRACK: f32 = 4.0;
const MARK: egui::Vec2 = vec2(4.0, 16.0);

impl Timeline<'_> {
    /// Shows the bar across `ui`.
    pub fn show(&self, ui: &mut Ui) -> Option<TimelineAnswer> {
        let theme = Theme::of(ui);
        let (bar, _) = ui.allocate_exact_size(vec2(ui.available_width(), size::TIMELINE), Sense::hover());
        ui.painter().rect_filled(bar, 0, theme.bar);
        let last = self.end.saturating_sub(1).max(self.first);
        let mut answer = None;
        let place = Rect::from_min_size(
            pos2(bar.left() + TOOLS, bar.center().y - size::TOOL / 2.0),
            vec2(3.0 * size::TOOL, size::TOOL),
        );
        ui.scope_builder(
            UiBuilder::new().max_rect(place).layout(egui::Layout::left_to_right(egui::Align::Center)),
            |ui| {
                ui.spacing_mut().item_spacing.x = 0.0;
                if tool_button(ui, icon::STEP_BACK, ",", false, self.frame > self.first).clicked() {
                    answer = Some(TimelineAnswer::Seek(self.frame - 1));
                }
                let play = if self.playing { icon::PAUSE } else { icon::PLAY };
                if tool_button(ui, play, "Space", false, true).clicked() {
                    answer = Some(TimelineAnswer::Play);
                }
                if tool_button(ui, icon::STEP_ON, ".", false, self.frame < last).clicked() {
                    answer = Some(TimelineAnswer::Seek(self.frame + 1));
                }
            },
        );
        let y = bar.center().y;
        let total = format!(" / {last}");
        let widest = text_width(ui, &last.to_string(), Type::Value);
        let number = place.right() + NUMBER_GAP + widest;
        text_at(ui, pos2(number, y), Align2::RIGHT_CENTER, self.frame, Type::Value, theme.text);
        let total = text_at(ui, pos2(number, y), Align2::LEFT_CENTER, total, Type::Small, theme.text3);
        let speed = text_at(
            ui,
            pos2(bar.right() - size::PADDING, y),
            Align2::RIGHT_CENTER,
            self.speed,
            Type::Small,
            theme.text3,
        );
        let tool =
            Rect::from_center_size(pos2(speed.left() - size::TOOL / 2.0 - 6.0, y), egui::Vec2::splat(size::TOOL));
        ui.scope_builder(UiBuilder::new().max_rect(tool), |ui| {
            if tool_button(ui, icon::LOOP, "", self.looping, true).clicked() {
                answer = Some(TimelineAnswer::Loop);
            }
        });
        let track =
            Rect::from_min_max(pos2(total.right() + TRACK_GAP, bar.top()), pos2(tool.left() - 8.0, bar.bottom()));
        if track.width() > MARK.y {
            answer = answer.or(self.track(ui, track, last));
        }
        answer
    }

    fn track(&self, ui: &Ui, place: Rect, last: u32) -> Option<TimelineAnswer> {
        let theme = Theme::of(ui);
        let id = ui.make_persistent_id("timeline track");
        let response = ui.interact(place, id, Sense::click_and_drag()).on_hover_cursor(CursorIcon::PointingHand);
        let span = (last - self.first).max(1) as f32;
        let x = |frame: f32| place.left() + place.width() * ((frame - self.first as f32) / span).clamp(0.0, 1.0);
        let rail = |from: f32, to: f32| {
            Rect::from_min_max(pos2(from, place.center().y - TRACK / 2.0), pos2(to, place.center().y + TRACK / 2.0))
        };
        ui.painter().rect_filled(rail(place.left(), place.right()), 2, theme.well);
        for part in self.loaded {
            ui.painter().rect_filled(rail(x(part.start as f32), x(part.end as f32 - 1.0)), 2, theme.edge);
        }
        let mark = Rect::from_center_size(pos2(x(self.frame as f32), place.center().y), MARK);
        ui.painter().rect_filled(mark, 2, theme.accent);
        if response.has_focus() {
            focus_ring(ui, rail(place.left(), place.right()).expand2(vec2(0.0, 4.0)));
        }
        response.widget_info(|| WidgetInfo::slider(ui.is_enabled(), f64::from(self.frame), "Frame"));
        ui.ctx().accesskit_node_builder(id, |node| {
            node.set_role(Role::Slider);
            node.set_min_numeric_value(f64::from(self.first));
            node.set_max_numeric_value(f64::from(last));
            node.set_numeric_value_step(1.0);
            node.add_action(accesskit::Action::SetValue);
        });
        let mut wanted = self.frame;
        if (response.clicked() || response.dragged())
            && let Some(at) = response.interact_pointer_pos()
        {
            let t = ((at.x - place.left()) / place.width()).clamp(0.0, 1.0);
            wanted = self.first + (t * span).round() as u32;
        }
        if response.has_focus() {
            let filter = EventFilter { horizontal_arrows: true, ..EventFilter::default() };
            ui.memory_mut(|memory| memory.set_focus_lock_filter(id, filter));
            let press = |key| ui.input_mut(|i| i.count_and_consume_key(Modifiers::NONE, key)) as i64;
            let steps = press(Key::ArrowRight) - press(Key::ArrowLeft);
            wanted = (i64::from(wanted) + steps).clamp(i64::from(self.first), i64::from(last)) as u32;
        }
        let set = ui.input(|i| {
            i.accesskit_action_requests(id, accesskit::Action::SetValue).find_map(|request| match request.data {
                Some(accesskit::ActionData::NumericValue(frame)) => Some(frame),
                _ => None,
            })
        });
        if let Some(frame) = set {
            wanted = frame.round().clamp(f64::from(self.first), f64::from(last)) as u32;
        }
        (wanted != self.frame).then_some(TimelineAnswer::Seek(wanted))
    }
}
