//! The lab as a person uses it, without an adapter: two sides, their panel, undo, what a session keeps.

use egui::{Key, Modifiers, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use nephele::app::App;
use nephele::app::lab::{Lab, Side, View};
use nephele::app::prefs::{Prefs, Session};
use nephele::app::theme;
use nephele::app::widgets::{Contest, Convergence, versus};
use nephele::scene::{MajorantKind, Scene, Tracking};

use crate::harness::{drag, panel};

fn window<'a>(app: App) -> Harness<'a, App> {
    let mut harness = Harness::builder()
        .with_size(vec2(1280.0, 1600.0))
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(400)
        .build_ui_state(
            |ui, app: &mut App| {
                let now = ui.input(|i| i.time);
                let whole = egui::UiBuilder::new().max_rect(ui.ctx().content_rect());
                ui.scope_builder(whole, |ui| app.frame(ui, now));
            },
            app,
        );
    harness.run_steps(4);
    harness
}

/// A window whose scene has one majorant for all, with the lab open.
fn lab<'a>() -> Harness<'a, App> {
    let mut scene = Scene::default();
    scene.tracking.majorant = MajorantKind::Global;
    let mut harness = window(App::new(scene, Prefs::default()));
    keys(&mut harness, Modifiers::NONE, Key::C);
    harness
}

fn keys(harness: &mut Harness<App>, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    harness.run_steps(20);
}

fn click(harness: &mut Harness<App>, name: &str) {
    harness.get_by_label(name).click();
    harness.run_steps(20);
}

/// Chooses a bound in the panel's list.
fn choose_majorant(harness: &mut Harness<App>, name: &str) {
    click(harness, "Majorant µ̄");
    click(harness, name);
}

fn majorants(harness: &Harness<App>) -> [MajorantKind; 2] {
    let app = harness.state();
    [app.scene.tracking.majorant, app.lab.own.as_ref().expect("the lab was opened").tracking.majorant]
}

#[test]
fn a_key_opens_two_sides_and_closes_them() {
    let mut harness = lab();
    assert_eq!(majorants(&harness), [MajorantKind::Global, MajorantKind::Grid], "B begins with the default method");
    assert!(harness.query_by_label_contains("Picture A: Delta · ratio · global").is_some());
    assert!(harness.query_by_label_contains("Picture B: Delta · ratio · grid").is_some());
    assert!(harness.query_by_label_contains("Relative error: A not yet, B not yet").is_some());
    keys(&mut harness, Modifiers::NONE, Key::C);
    assert!(harness.query_by_label_contains("Picture A").is_none() && harness.query_by_label("Side B").is_none());
    assert_eq!(majorants(&harness), [MajorantKind::Global, MajorantKind::Grid], "B is kept");
}

#[test]
fn the_panel_works_for_both_sides() {
    let mut harness = lab();
    click(&mut harness, "Side B");
    assert_eq!(harness.state().lab.controls.side, Side::B);
    choose_majorant(&mut harness, "Global");
    assert_eq!(majorants(&harness), [MajorantKind::Global; 2], "the row is B's");
    // What is shared goes to A whatever side is shown; what is a side's own does not.
    let row = harness.get_by_label("Anisotropy g").rect();
    drag(&mut harness, row.center() + vec2(40.0, 0.0), -60.0, Modifiers::NONE);
    let own_g = harness.state().lab.own.as_ref().expect("opened").medium.g;
    assert!(own_g < 0.8 && harness.state().scene.medium.g == 0.85, "{own_g}");
    click(&mut harness, "Camera");
    let row = harness.get_by_label("Field of view").rect();
    drag(&mut harness, row.center() + vec2(40.0, 0.0), -30.0, Modifiers::NONE);
    assert!(harness.state().scene.camera.fov_y < 40.0);
    click(&mut harness, "Side A");
    choose_majorant(&mut harness, "Grid");
    assert_eq!(majorants(&harness), [MajorantKind::Grid, MajorantKind::Global]);
}

#[test]
fn undo_takes_back_what_was_done_to_either_side_in_order() {
    let mut harness = lab();
    click(&mut harness, "Side B");
    choose_majorant(&mut harness, "Global");
    click(&mut harness, "Swap");
    click(&mut harness, "Side A");
    choose_majorant(&mut harness, "Grid");
    assert_eq!(majorants(&harness), [MajorantKind::Grid, MajorantKind::Global]);
    click(&mut harness, "Copy A to B");
    assert_eq!(majorants(&harness), [MajorantKind::Grid; 2]);
    let seeds = |h: &Harness<App>| (h.state().scene.integrator.seed, h.state().lab.own.clone().expect("opened"));
    let (seed, own) = seeds(&harness);
    assert_ne!(seed, own.integrator.seed, "a copy has its own noise");
    for expected in [
        [MajorantKind::Grid, MajorantKind::Global],
        [MajorantKind::Global, MajorantKind::Global],
        [MajorantKind::Global, MajorantKind::Global],
        [MajorantKind::Global, MajorantKind::Grid],
    ] {
        keys(&mut harness, Modifiers::COMMAND, Key::Z);
        assert_eq!(majorants(&harness), expected);
    }
    assert!(harness.state().lab.controls.open, "undo closes nothing");
    keys(&mut harness, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(majorants(&harness), [MajorantKind::Global; 2]);
}

#[test]
fn what_is_shown_follows_controls_keys_and_the_line() {
    let mut harness = lab();
    let chips = |h: &Harness<App>| ["Picture A:", "Picture B:"].map(|name| h.query_by_label_contains(name).is_some());
    let line = |h: &Harness<App>| h.query_by_label("Wipe between A and B").map(|node| node.rect());
    let rect = line(&harness).expect("the line");
    drag(&mut harness, rect.center(), 100.0, Modifiers::NONE);
    assert!(harness.state().lab.controls.wipe > 0.55, "{}", harness.state().lab.controls.wipe);
    assert_eq!(harness.state().scene.camera, Scene::default().camera, "the line is dragged, not the camera");
    for (view, shown) in [(View::A, [true, false]), (View::B, [false, true]), (View::Difference, [true, true])] {
        keys(&mut harness, Modifiers::SHIFT, Key::C);
        assert_eq!((harness.state().lab.controls.view, chips(&harness)), (view, shown));
        assert!(line(&harness).is_none());
    }
    assert!(harness.query_by_label("Amplify").is_some(), "the factor of the difference");
    keys(&mut harness, Modifiers::SHIFT, Key::C);
    harness.key_down(Key::X);
    harness.run_steps(2);
    assert_eq!(chips(&harness), [false, true], "held: the other side alone");
    harness.key_up(Key::X);
    harness.run_steps(2);
    assert_eq!(chips(&harness), [true, true]);
    click(&mut harness, "Close");
    assert!(!harness.state().lab.controls.plot && harness.query_by_label_contains("Relative error: A").is_none());
}

#[test]
fn a_session_brings_the_lab_back() {
    let mut last = Lab::default();
    last.controls.open = true;
    last.controls.view = View::B;
    let mut own = nephele::app::lab::Own::beside(&Scene::default());
    own.tracking = Tracking { majorant: MajorantKind::KdTree, ..Tracking::default() };
    last.own = Some(own);
    let mut prefs = Prefs::default();
    prefs.session = Some(Session { scene: Scene::default(), lab: last.clone(), broken: false });
    let mut harness = window(App::new(Scene::default(), prefs));
    assert_eq!(harness.state().lab, Lab::default(), "never forced");
    click(&mut harness, "Restore it");
    assert_eq!(harness.state().lab, last);
    assert!(harness.query_by_label_contains("Picture B: Delta · ratio · kd-tree").is_some());
}

#[test]
fn plot_and_table_say_their_numbers() {
    let mut harness = panel((), |ui, (): &mut ()| {
        versus(ui, &[Contest { caption: "Null share", tip: "", values: [0.5, f64::NAN], fault: false }]);
        let area = egui::Rect::from_min_size(egui::Pos2::ZERO, vec2(400.0, 400.0));
        let a: Vec<(f64, f64)> = (0..9).map(|i| (f64::from(4 << i), 0.5 / f64::from(4 << i).sqrt())).collect();
        let b: Vec<(f64, f64)> = a.iter().map(|&(x, y)| (x, 2.0 * y)).collect();
        let card = Convergence {
            title: "Relative error",
            note: "from its own variance",
            series: [&a, &b],
            unit: "spp",
            percent: true,
            slope: (-0.5, "slope −½"),
            verdict: ["4.00 ×", "fewer samples for A at equal error", "± 0.1"],
        };
        card.show(ui, area);
    });
    harness.run();
    harness.get_by_label("Null share: A 0.500, B –");
    let plot = harness.get_by_label_contains("Relative error: A 1.56 % after 1");
    let name = plot.accesskit_node().label().unwrap_or_default();
    assert!(
        name.contains("B 3.12 % after") && name.ends_with("4.00 × fewer samples for A at equal error ± 0.1"),
        "{name}"
    );
}
