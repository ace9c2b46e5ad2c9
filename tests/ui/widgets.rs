//! The rows of the panel by keyboard, pointer and screen reader.

use egui::{Key, Modifiers, PointerButton, Pos2, Rect, Role, vec2};
use egui_kittest::kittest::{NodeT, Queryable};
use egui_kittest::{Harness, Node};
use nephele::app::theme::icon;
use nephele::app::widgets::*;

use crate::harness::{drag, focus, panel, press, type_text};

/// What a row answered, summed up over frames.
#[derive(Default)]
struct Seen {
    value: f64,
    commits: usize,
    drags: usize,
    resets: usize,
    autos: usize,
    changes: usize,
}

impl Seen {
    fn note(&mut self, row: &RowResponse) {
        self.commits += usize::from(row.committed);
        self.drags += usize::from(row.dragging);
        self.resets += usize::from(row.reset);
        self.autos += usize::from(row.auto);
        self.changes += usize::from(row.changed);
    }
}

/// A row with everything: symbol, two-sided range, default, tooltip.
pub fn anisotropy() -> SliderRow<'static> {
    let tip = Tip { key: "medium.g", text: "Mean cosine of the scattering angle.", cost: "restarts the picture" };
    let head = Head { symbol: "g", tip, ..Head::new("Anisotropy") };
    SliderRow { digits: Digits::Decimals(3), default: Some(0.85), ..SliderRow::new(head, -0.999..=0.999) }
}

fn slider(row: SliderRow<'static>, value: f64) -> Harness<'static, Seen> {
    let mut harness = panel(Seen { value, ..Seen::default() }, move |ui, seen: &mut Seen| {
        let answer = row.show(ui, &mut seen.value);
        seen.note(&answer);
    });
    harness.run();
    harness
}

/// The field of a row, as the design places it.
fn field(row: &Node<'_>) -> Rect {
    let rect = row.rect();
    Rect::from_min_max(Pos2::new(rect.left() - 16.0 + 120.0, rect.top()), rect.max)
}

#[test]
fn slider_steps_by_arrow_keys() {
    let mut harness = slider(anisotropy(), 0.85);
    focus(&mut harness, "Anisotropy g");
    press(&mut harness, Key::ArrowRight);
    assert_eq!(harness.state().value, 0.86);
    press(&mut harness, Key::ArrowLeft);
    press(&mut harness, Key::ArrowLeft);
    assert_eq!(harness.state().value, 0.84);
    harness.key_press_modifiers(Modifiers::SHIFT, Key::ArrowRight);
    harness.run();
    assert_eq!(harness.state().value, 0.841);
    press(&mut harness, Key::PageUp);
    assert_eq!(harness.state().value, 0.941);
    press(&mut harness, Key::End);
    assert_eq!(harness.state().value, 0.999);
    press(&mut harness, Key::ArrowRight);
    assert_eq!(harness.state().value, 0.999, "it stops at its limit");
    assert!(harness.get_by_label("Anisotropy g").is_focused(), "arrows do not move the focus");
    assert_eq!(harness.state().commits, 6);
}

#[test]
fn logarithmic_and_whole_sliders_always_move() {
    let row = SliderRow {
        scale: Scale::Log,
        digits: Digits::Decimals(0),
        default: None,
        auto: Auto::Is,
        ..SliderRow::new(Head::new("Cell"), 1.0..=64.0)
    };
    let mut harness = slider(row, 1.0);
    focus(&mut harness, "Cell");
    for wanted in [2.0, 3.0, 4.0] {
        press(&mut harness, Key::ArrowRight);
        assert_eq!(harness.state().value, wanted);
    }
}

#[test]
fn slider_is_scrubbed_not_jumped_to() {
    let mut harness = slider(anisotropy(), 0.0);
    let field = field(&harness.get_by_label("Anisotropy g"));
    // Taken hold of far from the value: it moves by the way of the pointer alone.
    let from = Pos2::new(field.left() + 20.0, field.center().y);
    drag(&mut harness, from, 50.0, Modifiers::NONE);
    let wanted = 1.998 * 50.0 / f64::from(field.width());
    assert!((harness.state().value - wanted).abs() < 0.002, "{} {wanted}", harness.state().value);
    assert!(harness.state().drags > 2);
    assert_eq!(harness.state().commits, 1, "one step of undo a drag");

    let before = harness.state().value;
    drag(&mut harness, from, 50.0, Modifiers::SHIFT);
    let moved = harness.state().value - before;
    assert!((moved - wanted / 10.0).abs() < 0.003, "Shift is a tenth: {moved}");
}

#[test]
fn albedo_drags_by_nines() {
    let row = SliderRow {
        scale: Scale::OneMinusLog,
        digits: Digits::Decimals(5),
        limits: 0.0..=1.0,
        ..SliderRow::new(Head::new("Albedo"), 0.0..=0.99999)
    };
    let mut harness = slider(row, 0.9);
    let field = field(&harness.get_by_label("Albedo"));
    drag(&mut harness, field.center(), field.width() / 5.0, Modifiers::NONE);
    assert!((harness.state().value - 0.99).abs() < 2e-4, "{}", harness.state().value);
}

#[test]
fn escape_takes_a_drag_back() {
    let mut harness = slider(anisotropy(), 0.5);
    let from = field(&harness.get_by_label("Anisotropy g")).center();
    let button = |pressed| egui::Event::PointerButton {
        pos: from,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    harness.event(egui::Event::PointerMoved(from));
    harness.event(button(true));
    harness.run();
    harness.event(egui::Event::PointerMoved(from - vec2(60.0, 0.0)));
    harness.run_steps(2);
    assert!(harness.state().value < 0.3);
    press(&mut harness, Key::Escape);
    assert_eq!(harness.state().value, 0.5);
    harness.event(button(false));
    harness.run();
    assert_eq!(harness.state().commits, 0);
}

#[test]
fn slider_speaks_accesskit() {
    let mut harness = slider(SliderRow { unit: "1/unit", ..anisotropy() }, 0.5);
    let node = harness.get_by_label("Anisotropy g");
    let access = node.accesskit_node();
    assert_eq!(access.role(), Role::Slider);
    assert_eq!(access.numeric_value(), Some(0.5));
    assert_eq!(access.min_numeric_value(), Some(-0.999));
    assert_eq!(access.max_numeric_value(), Some(0.999));
    assert_eq!(access.value().as_deref(), Some("0.500 1/unit"));
    assert!(access.numeric_value_step().is_some_and(|step| (step - 0.01).abs() < 1e-9));
    node.set_value_accesskit(-0.25);
    harness.run();
    assert_eq!(harness.state().value, -0.25);
    harness.get_by_label("Anisotropy g").set_value_accesskit(7.0);
    harness.run();
    assert_eq!(harness.state().value, 0.999, "limits hold for screen readers too");
    harness.get_by_label("Anisotropy g").decrement_accesskit();
    harness.run();
    assert_eq!(harness.state().value, 0.989);
    harness.get_by_label("Anisotropy g").increment_accesskit();
    harness.run();
    assert_eq!(harness.state().value, 0.999);
}

#[test]
fn slider_takes_typed_numbers() {
    let mut harness = slider(anisotropy(), 0.85);
    focus(&mut harness, "Anisotropy g");
    press(&mut harness, Key::Enter);
    type_text(&mut harness, "−0,123456");
    assert_eq!(harness.state().value, 0.85, "nothing changes while typing");
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().value, -0.123456, "digits that are not shown are kept");
    assert_eq!(harness.state().commits, 1);
    assert!(harness.get_by_label("Anisotropy g").is_focused(), "the focus is back");

    press(&mut harness, Key::Enter);
    type_text(&mut harness, "5");
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().value, 0.999, "typed numbers meet the limits");

    type_text(&mut harness, "0");
    type_text(&mut harness, ".3");
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().value, 0.3, "a digit begins the typing");

    press(&mut harness, Key::Enter);
    type_text(&mut harness, "0.9");
    press(&mut harness, Key::Escape);
    assert_eq!(harness.state().value, 0.3, "Escape keeps the old value");

    press(&mut harness, Key::Enter);
    type_text(&mut harness, "much");
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().value, 0.3, "what is no number changes nothing");
}

#[test]
fn an_untouched_edit_keeps_hidden_digits() {
    // The second is a setting that has passed through 32 bits: it is shown, and edited, as 0.850.
    for value in [0.123456, f64::from(0.85f32)] {
        let mut harness = slider(anisotropy(), value);
        focus(&mut harness, "Anisotropy g");
        press(&mut harness, Key::Enter);
        press(&mut harness, Key::Enter);
        assert_eq!(harness.state().value, value);
    }
}

#[test]
fn a_click_types_and_leaving_commits() {
    let mut harness = panel((0.85, 0.5), |ui, values: &mut (f64, f64)| {
        anisotropy().show(ui, &mut values.0);
        SliderRow::new(Head::new("Other"), 0.0..=1.0).show(ui, &mut values.1);
    });
    harness.run();
    harness.get_by_label("Anisotropy g").click();
    harness.run();
    type_text(&mut harness, "0.2");
    press(&mut harness, Key::Tab);
    assert_eq!(harness.state().0, 0.2);
    assert!(harness.get_by_label("Other").is_focused(), "Tab goes on to the next row");
}

#[test]
fn slider_resets_by_double_click_key_dot_and_menu() {
    let mut row = anisotropy();
    row.head.changed = true;
    let mut harness = slider(row, 0.1);
    let centre = field(&harness.get_by_label("Anisotropy g")).center();
    harness.event(egui::Event::PointerMoved(centre));
    for pressed in [true, false, true, false] {
        harness.event(egui::Event::PointerButton {
            pos: centre,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        });
        harness.step();
    }
    harness.run();
    assert_eq!(harness.state().value, 0.85, "double click");

    harness.state_mut().value = 0.1;
    focus(&mut harness, "Anisotropy g");
    press(&mut harness, Key::Delete);
    assert_eq!(harness.state().value, 0.85, "Delete");

    harness.state_mut().value = 0.1;
    harness.get_by_label("Reset Anisotropy g").click();
    harness.run();
    assert_eq!(harness.state().value, 0.85, "dot");

    harness.state_mut().value = 0.1;
    harness.get_by_label("Anisotropy g").click_secondary();
    harness.run();
    harness.get_by_label("Reset to 0.850").click();
    harness.run();
    assert_eq!(harness.state().value, 0.85, "menu");
    assert_eq!(harness.state().resets, 4);
}

#[test]
fn the_menu_copies() {
    let mut harness = slider(anisotropy(), -0.5);
    for (item, wanted) in [("Copy value", "-0.500"), ("Copy as --set", "--set medium.g=-0.500")] {
        harness.get_by_label("Anisotropy g").click_secondary();
        harness.run();
        harness.get_by_label(item).click();
        // The command leaves with the frame of the click.
        let mut copied = Vec::new();
        for _ in 0..4 {
            harness.step();
            copied.extend(harness.output().platform_output.commands.iter().filter_map(|command| match command {
                egui::OutputCommand::CopyText(text) => Some(text.clone()),
                _ => None,
            }));
        }
        assert_eq!(copied, [wanted]);
        harness.run();
    }
}

#[test]
fn auto_is_asked_for_by_its_word() {
    let row = SliderRow { default: None, auto: Auto::Can, ..SliderRow::new(Head::new("Cell"), 1.0..=64.0) };
    let mut harness = slider(row, 8.0);
    focus(&mut harness, "Cell");
    press(&mut harness, Key::Enter);
    type_text(&mut harness, "Auto");
    press(&mut harness, Key::Enter);
    assert_eq!((harness.state().autos, harness.state().value), (1, 8.0));
    press(&mut harness, Key::Delete);
    assert_eq!(harness.state().autos, 2, "without a default, reset means auto");
}

#[test]
fn a_disabled_slider_does_nothing() {
    let mut harness = panel(0.5, |ui, value: &mut f64| {
        ui.add_enabled_ui(false, |ui| anisotropy().show(ui, value));
    });
    harness.run();
    let from = field(&harness.get_by_label("Anisotropy g")).center();
    drag(&mut harness, from, 50.0, Modifiers::NONE);
    harness.get_by_label("Anisotropy g").click();
    harness.run();
    assert_eq!(*harness.state(), 0.5);
    assert!(harness.get_by_label("Anisotropy g").accesskit_node().is_disabled());
}

#[test]
fn colour_channels_move_together_until_taken_apart() {
    let mut harness = panel([0.4, 0.4, 0.4], |ui, value: &mut [f64; 3]| {
        ColourRow {
            head: Head::new("Radiance"),
            unit: "",
            range: 0.01..=100.0,
            limits: 0.0..=1e6,
            scale: Scale::Log,
            digits: Digits::Significant(3),
            default: [0.4, 0.5, 0.7],
        }
        .show(ui, value);
    });
    harness.run();
    assert!(harness.query_by_label("Radiance B").is_none());
    harness.get_by_label("Radiance: separate channels").click();
    harness.run();
    harness.get_by_label("Radiance B").set_value_accesskit(0.8);
    harness.run();
    assert_eq!(*harness.state(), [0.4, 0.4, 0.8]);
    harness.get_by_label("Radiance").set_value_accesskit(1.6);
    harness.run();
    assert_eq!(*harness.state(), [0.8, 0.8, 1.6], "the ratio is kept");
    focus(&mut harness, "Radiance");
    press(&mut harness, Key::Delete);
    assert_eq!(*harness.state(), [0.4, 0.5, 0.7]);
}

#[test]
fn a_colour_keeps_its_ratio_through_the_end_of_the_range() {
    let mut harness = panel([1.0, 0.5, 0.25], |ui, value: &mut [f64; 3]| {
        ColourRow {
            head: Head::new("Factor"),
            unit: "",
            range: 0.0..=1.0,
            limits: 0.0..=1.0,
            scale: Scale::Linear,
            digits: Digits::Decimals(3),
            default: [1.0; 3],
        }
        .show(ui, value);
    });
    harness.run();
    let from = field(&harness.get_by_label("Factor")).center();
    let to = |harness: &mut Harness<[f64; 3]>, x: f32| {
        harness.event(egui::Event::PointerMoved(from + vec2(x, 0.0)));
        harness.run_steps(2);
    };
    let button = |pressed| egui::Event::PointerButton {
        pos: from,
        button: PointerButton::Primary,
        pressed,
        modifiers: Modifiers::NONE,
    };
    to(&mut harness, 0.0);
    harness.event(button(true));
    harness.run_steps(2);
    to(&mut harness, -1000.0);
    assert_eq!(*harness.state(), [0.0; 3]);
    to(&mut harness, 1000.0);
    assert_eq!(*harness.state(), [1.0, 0.5, 0.25], "the way back through black keeps the colour");
    harness.event(button(false));
    harness.run();
}

#[test]
fn a_vector_has_three_numbers() {
    let mut harness = panel([1.0, 2.0, 3.0], |ui, value: &mut [f64; 3]| {
        VectorRow {
            head: Head::new("Position"),
            unit: "",
            names: ["X", "Y", "Z"],
            per_point: 0.01,
            limits: -1e6..=1e6,
            digits: Digits::Decimals(2),
            default: None,
            auto: Auto::Can,
        }
        .show(ui, value);
    });
    harness.run();
    let from = harness.get_by_label("Position Y").rect().center();
    drag(&mut harness, from, 100.0, Modifiers::NONE);
    let [x, y, z] = *harness.state();
    assert_eq!((x, z), (1.0, 3.0));
    assert!((y - 3.0).abs() < 0.011, "{y}");
    focus(&mut harness, "Position Z");
    press(&mut harness, Key::ArrowLeft);
    assert_eq!(harness.state()[2], 2.9);
    assert!(harness.get_by_label("Position Z").is_focused(), "the arrow does not go on to the next number");
}

#[test]
fn combo_chooses_by_pointer_and_keys() {
    const CHOICES: [Choice; 4] = [
        Choice::new("Delta"),
        Choice { name: "Closed form", biased: false, blocked: "analytic volumes only" },
        Choice::new("Regular"),
        Choice::biased("Ray marching"),
    ];
    let mut harness = panel((0, 0), |ui, state: &mut (usize, usize)| {
        let row = ComboRow { head: Head::new("Free flight"), choices: &CHOICES, default: 0 }.show(ui, &mut state.0);
        state.1 += usize::from(row.changed);
    });
    harness.run();
    assert_eq!(harness.get_by_label("Free flight").value().as_deref(), Some("Delta"));
    harness.get_by_label("Free flight").click();
    harness.run();
    harness.get_by_label("Ray marching, biased").click();
    harness.run();
    assert_eq!(*harness.state(), (3, 1));
    assert!(harness.query_by_label("Regular").is_none(), "the list is closed");

    focus(&mut harness, "Free flight");
    press(&mut harness, Key::ArrowLeft);
    press(&mut harness, Key::ArrowLeft);
    assert_eq!(harness.state().0, 0, "a blocked choice is passed over");
    press(&mut harness, Key::Enter);
    press(&mut harness, Key::ArrowDown);
    press(&mut harness, Key::Enter);
    assert_eq!(harness.state().0, 2, "the list by keys");
    assert!(harness.get_by_label("Free flight").is_focused(), "and back");
    press(&mut harness, Key::Enter);
    press(&mut harness, Key::Escape);
    assert_eq!(harness.state().0, 2);
    assert!(harness.query_by_label("Regular").is_none());
}

#[test]
fn segments_choose() {
    const CHOICES: [Choice; 3] = [Choice::new("Global"), Choice::new("Grid"), Choice::new("Octree")];
    let mut harness = panel((1, 0), |ui, state: &mut (usize, usize)| {
        SegmentsRow { head: Head::new("Majorant"), choices: &CHOICES, default: 1 }.show(ui, &mut state.0);
        segments(ui, "Mode", &[Choice::new("Path"), Choice::new("ReSTIR")], &mut state.1);
    });
    harness.run();
    harness.get_by_label("Octree").click();
    harness.get_by_label("ReSTIR").click();
    harness.run();
    assert_eq!(*harness.state(), (2, 1));
    let node = harness.get_by_label("Octree");
    assert_eq!(node.accesskit_node().role(), Role::RadioButton);
    assert_eq!(node.accesskit_node().toggled(), Some(egui::accesskit::Toggled::True));
    focus(&mut harness, "Global");
    press(&mut harness, Key::Space);
    assert_eq!(harness.state().0, 0);
}

#[test]
fn a_box_is_ticked() {
    let mut harness = panel(false, |ui, on: &mut bool| {
        CheckRow { head: Head::new("Temporal"), note: "", default: false }.show(ui, on);
    });
    harness.run();
    harness.get_by_label("Temporal").click();
    harness.run();
    assert!(*harness.state());
    focus(&mut harness, "Temporal");
    press(&mut harness, Key::Space);
    assert!(!*harness.state());
}

#[test]
fn text_commits_on_enter_and_escape_keeps_the_old() {
    let mut harness = panel((String::from("old"), 0, 0), |ui, state: &mut (String, usize, usize)| {
        let row = TextRow { head: Head::new("File"), hint: "none", button: Some(icon::OPEN) };
        let answer = row.show(ui, &mut state.0);
        state.1 += usize::from(answer.row.committed);
        state.2 += usize::from(answer.pressed);
    });
    harness.run();
    harness.get_by_label("File").click();
    harness.run();
    type_text(&mut harness, " path");
    assert_eq!(harness.state().0, "old");
    press(&mut harness, Key::Enter);
    assert_eq!((harness.state().0.as_str(), harness.state().1), ("old path", 1));
    harness.get_by_label("File").click();
    harness.run();
    type_text(&mut harness, "x");
    press(&mut harness, Key::Escape);
    assert_eq!((harness.state().0.as_str(), harness.state().1), ("old path", 1));
    harness.get_by_label("File: Open").click();
    harness.run();
    assert_eq!(harness.state().2, 1);
}

#[test]
fn buttons_answer_unless_blocked() {
    let buttons = [Choice::new("Reload"), Choice { name: "Watch", biased: false, blocked: "no file" }];
    let mut harness = panel(Vec::new(), move |ui, pressed: &mut Vec<usize>| {
        pressed.extend(ButtonsRow { head: Head::default(), buttons: &buttons }.show(ui));
    });
    harness.run();
    harness.get_by_label("Reload").click();
    harness.get_by_label("Watch, no file").click();
    harness.run();
    assert_eq!(*harness.state(), [0]);
}
