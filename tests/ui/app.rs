//! The whole window as a person uses it, without an adapter: panel, keys, narrow windows, what is remembered.

use egui::{Key, Modifiers, Rect, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use nephele::app::App;
use nephele::app::lab::Lab;
use nephele::app::prefs::{Prefs, Session};
use nephele::app::theme;
use nephele::scene::value::Auto;
use nephele::scene::{Camera, Scene};

use crate::harness::{drag, focus, press};

/// Longer than folding, toasts and tooltips take.
const MOST_STEPS: u64 = 400;

fn window<'a>(width: f32, height: f32, app: App) -> Harness<'a, App> {
    Harness::builder()
        .with_size(vec2(width, height))
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(MOST_STEPS)
        .build_ui_state(
            |ui, app: &mut App| {
                let now = ui.input(|i| i.time);
                // The harness leaves a margin that a window has not.
                let whole = egui::UiBuilder::new().max_rect(ui.ctx().content_rect());
                ui.scope_builder(whole, |ui| app.frame(ui, now));
            },
            app,
        )
}

fn default_window<'a>(width: f32, height: f32) -> Harness<'a, App> {
    let mut harness = window(width, height, App::new(Scene::default(), Prefs::default()));
    harness.run_steps(4);
    harness
}

fn keys(harness: &mut Harness<App>, modifiers: Modifiers, key: Key) {
    harness.key_press_modifiers(modifiers, key);
    harness.run_steps(4);
}

#[test]
fn every_section_opens_and_shows_its_rows() {
    let mut harness = default_window(1280.0, 2600.0);
    for (title, row) in [
        ("Volume", "Resolution"),
        ("Medium", "Albedo ϖ"),
        ("Light", "Add a light"),
        ("Camera", "Field of view"),
        ("Method", "Majorant µ̄"),
        ("Display", "Exposure"),
        ("Output", "Save: Picture"),
    ] {
        if harness.query_by_label(row).is_none() {
            harness.get_by_label(title).click();
            harness.run_steps(20);
        }
        assert!(harness.query_by_label(row).is_some(), "{title} shows {row}");
        harness.get_by_label(title).click();
        harness.run_steps(20);
        assert!(harness.query_by_label(row).is_none(), "{title} hides {row}");
    }
    assert!(harness.state().prefs.open.0.iter().all(|open| !open), "what is open is remembered");
}

#[test]
fn a_drag_is_one_step_of_undo_and_a_dot_resets() {
    let mut harness = default_window(1280.0, 1000.0);
    let row = harness.get_by_label("Anisotropy g").rect();
    drag(&mut harness, row.center() + vec2(40.0, 0.0), -60.0, Modifiers::NONE);
    let dragged = harness.state().scene.medium.g;
    assert!((0.0..0.7).contains(&dragged), "{dragged}");
    assert!(harness.query_by_label("Preset").is_some_and(|p| p.value().as_deref() == Some("Custom")));
    harness.get_by_label("Undo").click();
    harness.run_steps(4);
    assert_eq!(harness.state().scene, Scene::default(), "one step, however many frames the drag took");
    keys(&mut harness, Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(harness.state().scene.medium.g, dragged);
    harness.get_by_label("Reset Anisotropy g").click();
    harness.run_steps(4);
    assert_eq!(harness.state().scene.medium.g, 0.85);
}

#[test]
fn a_preset_is_a_whole_look_and_tells_its_licence() {
    let mut harness = default_window(1280.0, 1400.0);
    assert_eq!(harness.get_by_label("Preset").value().as_deref(), Some("Default"));
    harness.get_by_label("Preset").click();
    harness.run_steps(10);
    harness.get_by_label("Disney cloud").click();
    harness.run_steps(10);
    let scene = &harness.state().scene;
    assert_eq!(scene.volume.file.0, "asset:disney-cloud");
    assert!(scene.lights.len() == 1 && scene.lights[0].kind() == "sky" && scene.medium.albedo.0 == [1.0; 3]);
    assert!(harness.query_by_label_contains("creativecommons.org/licenses/by-sa/3.0").is_some(), "its licence");
    assert_eq!(harness.get_by_label("Preset").value().as_deref(), Some("Disney cloud"));
    keys(&mut harness, Modifiers::COMMAND, Key::Z);
    let scene = &harness.state().scene;
    assert!(scene.volume.file.0.is_empty() && scene.lights == Scene::default().lights, "one step back");
}

#[test]
fn views_are_kept_and_come_back_and_a_way_there_is_undone() {
    let mut harness = default_window(1280.0, 800.0);
    let at = |x: f64| Camera { position: Auto::Is(glam::DVec3::new(x, 0.0, 3.0)), fov_y: 30.0, ..Camera::default() };
    let set = |harness: &mut Harness<App>, x: f64| {
        harness.state_mut().scene.camera = at(x);
        harness.run_steps(4);
    };
    set(&mut harness, 1.0);
    keys(&mut harness, Modifiers::ALT | Modifiers::SHIFT, Key::Num2);
    set(&mut harness, 2.0);
    keys(&mut harness, Modifiers::ALT, Key::Num1);
    assert_eq!(harness.state().scene.camera, at(2.0), "view 1 is empty");
    keys(&mut harness, Modifiers::ALT, Key::Num2);
    assert_eq!(harness.state().scene.camera, at(1.0));
    keys(&mut harness, Modifiers::ALT, Key::Z);
    assert_eq!(harness.state().scene.camera, at(2.0));
    keys(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(harness.state().scene.camera, at(2.0), "undoing settings moves no camera");
    assert_eq!(harness.state().prefs.cameras.iter().flatten().count(), 1);

    // The sign that Shift makes of a digit is another on each keyboard; its place is not.
    harness.state_mut().scene.camera = at(3.0);
    harness.event(egui::Event::Key {
        key: Key::Exclamationmark,
        physical_key: Some(Key::Num1),
        pressed: true,
        repeat: false,
        modifiers: Modifiers::ALT | Modifiers::SHIFT,
    });
    harness.run_steps(4);
    assert_eq!(harness.state().prefs.cameras[0], Some(at(3.0)));
}

#[test]
fn the_last_session_is_offered_and_never_forced() {
    let mut last = Scene::default();
    last.medium.g = 0.3;
    let session = |scene: &Scene| Some(Session { scene: scene.clone(), lab: Lab::default(), broken: true });
    let start = |scene: Scene, last: &Scene| {
        let mut prefs = Prefs::default();
        prefs.session = session(last);
        let app = App::new(scene, prefs);
        let mut harness = window(1280.0, 800.0, app);
        harness.run_steps(4);
        harness
    };
    let mut harness = start(Scene::default(), &last);
    assert_eq!(harness.state().scene, Scene::default());
    harness.get_by_label("Restore it").click();
    harness.run_steps(4);
    assert_eq!(harness.state().scene, last);
    assert!(harness.query_by_label("Restore it").is_none());
    keys(&mut harness, Modifiers::COMMAND, Key::Z);
    assert_eq!(harness.state().scene, Scene::default(), "a step like any other");

    let mut harness = start(Scene::default(), &last);
    harness.get_by_label("Close").click();
    harness.run_steps(4);
    assert!(harness.query_by_label("Restore it").is_none() && harness.state().scene == Scene::default());

    let asked_for = Scene::of_volume("a.vdb");
    assert!(start(asked_for, &last).query_by_label("Restore it").is_none(), "an INPUT is what was asked for");
    let nothing = Scene::default();
    assert!(start(Scene::default(), &nothing).query_by_label("Restore it").is_none(), "nothing to restore");
}

#[test]
fn a_banner_stays_clear_of_the_drawer() {
    let mut prefs = Prefs::default();
    prefs.session = Some(Session { scene: Scene::of_volume("a.vdb"), lab: Lab::default(), broken: false });
    let mut harness = window(480.0, 320.0, App::new(Scene::default(), prefs));
    harness.run_steps(4);
    open_drawer(&mut harness);
    let offer = harness.get_by_label("Restore it").rect();
    assert!(offer.bottom() <= harness.get_by_label("Undo").rect().top() && offer.right() < 480.0, "{offer:?}");
    harness.get_by_label("Restore it").click();
    harness.run_steps(4);
    assert_eq!(harness.state().scene.volume.file.0, "a.vdb");
    assert!(harness.get_by_label("Undo").rect().top() < offer.bottom(), "the drawer takes the banner's room");
}

#[test]
fn dropping_the_history_says_where_there_is_none() {
    let mut harness = default_window(1280.0, 800.0);
    keys(&mut harness, Modifiers::SHIFT, Key::H);
    assert!(harness.query_by_label_contains("There is no history to drop").is_some());
    assert_eq!(harness.state().scene, Scene::default(), "it is no setting");
}

#[test]
fn tab_shows_and_hides_the_panel_and_moves_no_focus() {
    let mut harness = default_window(1280.0, 800.0);
    for shown in [false, true, false] {
        keys(&mut harness, Modifiers::NONE, Key::Tab);
        assert_eq!(harness.query_by_label("Medium").is_some(), shown);
    }
    keys(&mut harness, Modifiers::NONE, Key::Tab);
    focus(&mut harness, "Anisotropy g");
    keys(&mut harness, Modifiers::NONE, Key::Tab);
    assert!(harness.query_by_label("Medium").is_some(), "in the panel Tab goes to the next row");
    assert!(!harness.get_by_label("Anisotropy g").is_focused());
}

/// The rectangles of all that can be used, by name.
fn controls(harness: &Harness<App>) -> Vec<(String, Rect)> {
    let roles = [egui::accesskit::Role::Button, egui::accesskit::Role::DisclosureTriangle];
    let all = harness.root().children_recursive();
    all.filter(|node| roles.contains(&node.accesskit_node().role()))
        .map(|node| (node.accesskit_node().label().unwrap_or_default(), node.rect()))
        .collect()
}

#[test]
fn a_narrow_window_has_a_drawer_and_nothing_is_cut() {
    for (width, height) in [(1280.0, 800.0), (899.0, 600.0), (640.0, 480.0), (559.0, 400.0), (480.0, 320.0)] {
        let mut harness = default_window(width, height);
        let whole = Rect::from_min_size(egui::Pos2::ZERO, vec2(width, height));
        let docked = width >= 900.0;
        assert_eq!(harness.query_by_label("Medium").is_some(), docked, "{width}");
        for opened in [false, true] {
            if opened {
                harness.get_by_label("Side panel").click();
                harness.run_steps(6);
            }
            assert_eq!(harness.query_by_label("Medium").is_some(), docked != opened, "{width}");
            assert_eq!(harness.query_by_label("Undo").is_some(), width >= 560.0 || opened, "{width}");
            let bar: Vec<_> =
                controls(&harness).into_iter().filter(|(_, r)| r.bottom() <= theme::size::TOP_BAR).collect();
            assert!(bar.len() >= 5, "{width}: {bar:?}");
            for (i, (name, rect)) in bar.iter().enumerate() {
                assert!(whole.contains_rect(*rect), "{width}: {name} is cut");
                for (other, place) in &bar[..i] {
                    assert!(!rect.shrink(0.5).intersects(*place), "{width}: {name} on {other}");
                }
            }
        }
        assert!(harness.state().prefs.panel != docked, "a drawer is no preference");
    }
}

#[test]
fn the_drawer_works_like_the_panel() {
    let mut harness = default_window(640.0, 900.0);
    open_drawer(&mut harness);
    focus(&mut harness, "Anisotropy g");
    press(&mut harness, Key::ArrowLeft);
    assert!(harness.state().scene.medium.g < 0.85);
    let panel = harness.get_by_label("Medium").rect();
    assert!(panel.left() >= 300.0 && panel.right() <= 640.0, "{panel:?}");
}

fn open_drawer(harness: &mut Harness<App>) {
    harness.get_by_label("Side panel").click();
    harness.run_steps(6);
}
