//! A harness in the program's look, and what a user does to it.

use egui::{Key, Modifiers, PointerButton, Pos2, Ui, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::Queryable;
use nephele::app::theme;

/// Longer than a tooltip takes to come.
const MOST_STEPS: u64 = 120;

/// A harness as wide as the panel, in the program's own fonts and style.
pub fn panel<'a, S: 'a>(state: S, show: impl FnMut(&mut Ui, &mut S) + 'a) -> Harness<'a, S> {
    sized(360.0, state, show)
}

/// A harness of another width.
pub fn sized<'a, S: 'a>(width: f32, state: S, show: impl FnMut(&mut Ui, &mut S) + 'a) -> Harness<'a, S> {
    Harness::builder()
        .with_size(vec2(width, 400.0))
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(MOST_STEPS)
        .build_ui_state(show, state)
}

/// Gives the keyboard focus to the widget of this name.
pub fn focus<S>(harness: &mut Harness<S>, name: &str) {
    harness.get_by_label(name).focus();
    harness.run();
    assert!(harness.get_by_label(name).is_focused(), "{name} takes the focus");
}

/// Presses a key.
pub fn press<S>(harness: &mut Harness<S>, key: Key) {
    harness.key_press(key);
    harness.run();
}

/// Types into whatever has the focus.
pub fn type_text<S>(harness: &mut Harness<S>, text: &str) {
    harness.event(egui::Event::Text(text.into()));
    harness.run();
}

/// Drags from `from` by `by` points to the right.
pub fn drag<S>(harness: &mut Harness<S>, from: Pos2, by: f32, modifiers: Modifiers) {
    let button = |pos, pressed| egui::Event::PointerButton { pos, button: PointerButton::Primary, pressed, modifiers };
    harness.event(egui::Event::ModifiersChanged(modifiers));
    harness.event(egui::Event::PointerMoved(from));
    harness.event(button(from, true));
    harness.run();
    // Each step is longer than the way up to which a press may still become a click.
    let steps = 4;
    for i in 1..=steps {
        harness.event(egui::Event::PointerMoved(from + vec2(by * i as f32 / steps as f32, 0.0)));
        harness.step();
    }
    harness.event(button(from + vec2(by, 0.0), false));
    harness.run();
    harness.event(egui::Event::ModifiersChanged(Modifiers::NONE));
    harness.run();
}
