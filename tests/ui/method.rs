//! The section Method: only the rows that the chosen estimators use, other settings that follow a choice which does not
//! fit them, and "biased" wherever a person may look.

use egui::accesskit::Role;
use egui::{Key, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use nephele::app::actions::Action;
use nephele::app::facts::Facts;
use nephele::app::panels::{self, Open, State, Wish};
use nephele::app::rows::{Rows, fitted};
use nephele::app::theme;
use nephele::scene::value::{Auto, Kind, Value};
use nephele::scene::{Analytic, Control, FreeFlight, MajorantKind, Mode, Restir, Scene, Tracking, Transmittance};

/// Room for all rows.
const TALL: f32 = 1400.0;
/// Longer than folding takes.
const MOST_STEPS: u64 = 200;

fn method<'a>(scene: Scene, facts: Facts) -> Harness<'a, Scene> {
    let open = Open([false, false, false, false, true, false, false]);
    let mut harness = Harness::builder()
        .with_size(vec2(360.0, TALL))
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(MOST_STEPS)
        .build_ui_state(
            move |ui, scene: &mut Scene| {
                let defaults = Scene::default();
                let mut rows =
                    Rows { scene, defaults: &defaults, automatic: &|_| None, size: 1.0, dragging: false, browse: None };
                panels::show(ui, &mut rows, &facts, &mut open.clone(), &State::default());
            },
            scene,
        );
    harness.run();
    harness
}

fn tracked(change: impl FnOnce(&mut Tracking)) -> Scene {
    let mut scene = Scene::default();
    change(&mut scene.tracking);
    scene
}

fn reused() -> Scene {
    let mut scene = Scene::default();
    scene.integrator.mode = Mode::Restir;
    scene.restir.candidates = Auto::Is(6);
    scene
}

fn choose(harness: &mut Harness<Scene>, row: &str, choice: &str) {
    harness.get_by_label(row).click();
    harness.run();
    harness.get_by_label(choice).click();
    harness.run();
}

#[test]
fn only_rows_that_apply_are_shown() {
    let rows = ["Cell", "Control µc", "Majorant factor", "Step"];
    let shown = |scene: Scene| {
        let harness = method(scene, Facts::default());
        rows.map(|row| harness.query_by_label(row).is_some())
    };
    assert_eq!(shown(Scene::default()), [true, false, true, false]);
    assert_eq!(shown(tracked(|t| t.majorant = MajorantKind::KdTree)), [false, false, true, false]);
    assert_eq!(shown(tracked(|t| t.free_flight = FreeFlight::Decomposition)), [true, true, true, false]);
    assert_eq!(shown(tracked(|t| t.transmittance = Transmittance::ResidualRatio)), [true, true, true, false]);
    assert_eq!(shown(tracked(|t| t.free_flight = FreeFlight::RayMarching)), [true, false, true, true]);
    assert_eq!(shown(tracked(|t| t.transmittance = Transmittance::Jackknife)), [true, false, true, true]);
    let exact = tracked(|t| (t.free_flight, t.transmittance) = (FreeFlight::Regular, Transmittance::Regular));
    assert_eq!(shown(exact), [true, false, false, false]);
}

#[test]
fn a_choice_that_does_not_fit_changes_the_nearest_other_setting_and_says_so() {
    // Unbiased weights take the mean; the decomposition with probabilities takes the minimum.
    let mut harness = method(
        tracked(|t| (t.free_flight, t.control) = (FreeFlight::WeightedDecomposition, Control::Mean)),
        Facts::default(),
    );
    choose(&mut harness, "Free flight", "Decomposition");
    let t = &harness.state().tracking;
    assert_eq!((t.free_flight, t.control), (FreeFlight::Decomposition, Control::Min));
    let said = "Control was Mean, is now Minimum: needed by free flight Decomposition.";
    assert!(harness.query_by_label(said).is_some(), "it says so");
    // The next choice that fits takes the words away.
    choose(&mut harness, "Free flight", "Delta");
    assert!(harness.query_by_label(said).is_none());
    assert_eq!(harness.state().check(), Ok(()));
    // Formulas need an analytic volume: such a choice is shown, and cannot be made.
    harness.get_by_label("Free flight").click();
    harness.run();
    harness.get_by_label("Closed form, analytic volumes only").click();
    harness.run();
    assert_eq!(harness.state().tracking.free_flight, FreeFlight::Delta);
}

#[test]
fn whatever_is_chosen_fits() {
    let fits = |mut scene: Scene, key: &str, value: Value| {
        scene.assign(key, &value).expect("a value of its type");
        assert!(scene.check().is_err(), "{key} = {value} fits by itself");
        let (fitted, note) = fitted(&scene, key).unwrap_or_else(|| panic!("nothing fits {key} = {value}"));
        assert_eq!((fitted.check(), fitted.get(key)), (Ok(()), Some(value)), "what was chosen stays");
        (fitted.tracking, note)
    };
    let text = |name: &str| Value::Text(name.into());
    let factor = |x: f64| Value::Float(x);
    let low = |flight| tracked(move |t| (t.free_flight, t.majorant_factor) = (flight, 0.5));
    let (t, _) = fits(Scene::default(), "tracking.majorant_factor", factor(0.5));
    assert_eq!((t.free_flight, t.transmittance), (FreeFlight::WeightedDelta, Transmittance::Ratio));
    let (t, _) = fits(low(FreeFlight::WeightedDelta), "tracking.free_flight", text("delta"));
    assert_eq!((t.free_flight, t.majorant_factor), (FreeFlight::Delta, 1.0));
    let (t, _) = fits(tracked(|t| t.free_flight = FreeFlight::Decomposition), "tracking.control", text("mean"));
    assert_eq!((t.free_flight, t.control), (FreeFlight::WeightedDecomposition, Control::Mean));
    let both = tracked(|t| {
        (t.free_flight, t.control, t.majorant_factor) = (FreeFlight::WeightedDecomposition, Control::Mean, 0.5);
    });
    let (t, note) = fits(both, "tracking.free_flight", text("decomposition"));
    assert_eq!((t.control, t.majorant_factor), (Control::Min, 1.0));
    assert!(note.contains("Control was Mean") && note.contains("Majorant factor was 0.5, is now 1"), "{note}");
    // Everything but the formulas can be chosen from everywhere, for voxels.
    for &flight in FreeFlight::ALL {
        for &transmittance in Transmittance::ALL {
            for &control in Control::ALL {
                let formula = flight == FreeFlight::ClosedForm || transmittance == Transmittance::ClosedForm;
                let mut scene = tracked(|t| {
                    (t.free_flight, t.transmittance, t.control) = (flight, transmittance, control);
                    t.majorant_factor = 0.5;
                });
                let key = "tracking.free_flight";
                let found = scene.check().is_ok() || fitted(&scene, key).is_some();
                assert_eq!(found, flight != FreeFlight::ClosedForm, "{flight:?} {transmittance:?} {control:?}");
                scene.volume.analytic = Analytic::Homogeneous;
                assert!(scene.check().is_ok() || fitted(&scene, key).is_some());
                assert!(!formula || scene.tracking.check(false).is_err());
            }
        }
    }
}

#[test]
fn biased_is_said_in_the_header_the_row_and_the_list() {
    let header = |harness: &Harness<Scene>| harness.get_by_label("Method").accesskit_node().description();
    let mut harness = method(Scene::default(), Facts::default());
    assert_eq!(header(&harness).as_deref(), Some("unbiased"));
    choose(&mut harness, "Transmittance", "Ray marching, biased");
    assert_eq!(harness.state().tracking.transmittance, Transmittance::RayMarching);
    assert_eq!(header(&harness).as_deref(), Some("biased: ray marching of shadow rays, changed"));
    assert_eq!(harness.get_by_label("Transmittance").value().as_deref(), Some("Ray marching, biased"));
    assert!(harness.query_by_label_contains("Biased by ray marching of shadow rays").is_some());
    choose(&mut harness, "Free flight", "Ray marching, biased");
    assert_eq!(header(&harness).as_deref(), Some("biased: 2 settings, changed"));
    choose(&mut harness, "Free flight", "Delta");
    choose(&mut harness, "Transmittance", "Telescoping");
    assert_eq!(header(&harness).as_deref(), Some("unbiased, changed"));
}

/// What the Method section of `scene` wishes after `press` was done.
fn wishes(scene: Scene, press: &str) -> Option<Vec<Wish>> {
    let open = Open([false, false, false, false, true, false, false]);
    let mut harness = Harness::builder()
        .with_size(vec2(360.0, TALL))
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .with_max_steps(MOST_STEPS)
        .build_ui_state(
            move |ui, (scene, wishes): &mut (Scene, Vec<Wish>)| {
                let defaults = Scene::default();
                let mut rows =
                    Rows { scene, defaults: &defaults, automatic: &|_| None, size: 1.0, dragging: false, browse: None };
                let state = State::default();
                wishes.extend(panels::show(ui, &mut rows, &Facts::default(), &mut open.clone(), &state));
            },
            (scene, Vec::new()),
        );
    harness.run();
    harness.query_by_label(press)?.click();
    harness.run();
    Some(harness.state().1.clone())
}

#[test]
fn every_setting_of_reuse_has_a_row_that_changes_it() {
    let path = method(Scene::default(), Facts::default());
    for row in Restir::ROWS {
        let name = if row.symbol.is_empty() { row.label.into() } else { format!("{} {}", row.label, row.symbol) };
        assert!(path.query_by_label(&name).is_none(), "mode path shows {name}");
        let mut harness = method(reused(), Facts::default());
        let key = format!("restir.{}", row.key);
        let before = harness.state().get(&key);
        match row.kind {
            Kind::Bool => {
                harness.get_by_role_and_label(Role::CheckBox, &name).click();
                harness.run();
            }
            Kind::Choice(choices) => {
                let other = choices.last().expect("a choice has some");
                harness.get_by_role_and_label(Role::RadioButton, other.label).click();
                harness.run();
            }
            _ => {
                harness.get_by_label(&name).focus();
                harness.run();
                for arrow in [Key::ArrowRight, Key::ArrowLeft] {
                    if harness.state().get(&key) == before {
                        harness.key_press(arrow);
                        harness.run();
                    }
                }
            }
        }
        let after = harness.state();
        assert_ne!(after.get(&key), before, "{name} changes nothing");
        assert_eq!(after.check(), Ok(()));
        let layers = after.changes(&reused());
        assert!(layers.accumulation, "{name} draws nothing anew");
    }
    // Stages that are off have no rows.
    let mut off = reused();
    (off.restir.temporal, off.restir.spatial) = (false, false);
    let harness = method(off, Facts::default());
    for name in ["Cap", "Permute", "Neighbours k", "Reach h"] {
        assert!(harness.query_by_label(name).is_none(), "{name}");
    }
}

#[test]
fn the_history_is_dropped_where_there_is_one() {
    assert_eq!(wishes(Scene::default(), "Kept paths: Drop"), None, "mode path keeps none");
    assert_eq!(wishes(reused(), "Kept paths: Drop"), Some(vec![Wish::Act(Action::DropHistory)]));
}

#[test]
fn figures_are_there_and_mishaps_only_where_there_are_some() {
    let facts = Facts {
        known: true,
        lookups_per_path: Some(12.345),
        null_ratio: Some(0.25),
        steps_per_path: Some(41.0),
        shadows_per_path: Some(1.5),
        bounds: (1 << 20, 0.0123),
        ..Facts::default()
    };
    let harness = method(Scene::default(), facts.clone());
    for figure in ["Lookups / path 12.3", "Null share 0.25", "Steps / path 41.0", "Shadows / path 1.50"] {
        assert!(harness.query_by_label_contains(figure).is_some(), "{figure}");
    }
    assert!(harness.query_by_label_contains("built in 12.3 ms").is_some());
    let words = ["lie above their bound", "fewer looks than wanted", "are not finite"];
    let said = |mishaps: [u64; 3]| {
        let harness = method(Scene::default(), Facts { mishaps, ..facts.clone() });
        words.map(|w| harness.query_by_label_contains(w).is_some())
    };
    assert_eq!(said([0, 0, 0]), [false; 3]);
    assert_eq!(said([7, 0, 0]), [true, false, false]);
    assert_eq!(said([0, 7, 0]), [false, true, false]);
    assert_eq!(said([0, 0, 7]), [false, false, true]);
}
