//! What looks closer: the legend of an overlay, the inspector's card, the report of the self-test.

use egui::vec2;
use egui_kittest::kittest::{NodeT, Queryable};
use nephele::app::App;
use nephele::app::prefs::Prefs;
use nephele::app::widgets::{Legend, Loupe, LoupeLine, LoupePixel, Report, ReportAnswer, ReportLine, SIDE};
use nephele::render::heat;
use nephele::scene::Scene;

use crate::harness::sized;

#[test]
fn a_legend_tells_its_numbers() {
    let legend = |range| Legend {
        name: "Lookups per sample",
        unit: "",
        range,
        median_at: 0.4,
        waits: "counting begins",
        log: false,
        names: &[],
        colour: &heat::colour,
    };
    for (range, said) in [
        (Some([0.0, 12.3, 64.0]), "Lookups per sample: 0 to 64.0, median 12.3"),
        (None, "Lookups per sample: counting begins"),
    ] {
        let mut harness = sized(640.0, (), move |ui, ()| legend(range).show(ui, ui.max_rect()));
        harness.run_steps(3);
        assert!(harness.query_by_label(said).is_some(), "{said}");
    }
}

#[test]
fn a_legend_of_names_lists_them() {
    let look = heat::look(nephele::scene::Overlay::Source).expect("an overlay");
    for (range, said) in [
        (Some([0.0, 1.0, 3.0]), "Path source: none, its own, frame before, neighbour"),
        (None, "Path source: no frame has reused paths"),
    ] {
        let legend = Legend {
            name: look.name,
            unit: look.unit,
            range,
            median_at: 0.0,
            waits: look.waits(),
            log: look.is_log(),
            names: look.names(),
            colour: &heat::colour,
        };
        let mut harness = sized(640.0, (), move |ui, ()| legend.show(ui, ui.max_rect()));
        harness.run_steps(3);
        assert!(harness.query_by_label(said).is_some(), "{said}");
    }
}

#[test]
fn the_inspector_lists_its_pixel_and_copies() {
    let lines = [
        LoupeLine { caption: "Linear", value: "1.00 0.500 0".into(), caution: false },
        LoupeLine { caption: "Broken", value: "not finite".into(), caution: true },
    ];
    let mut pixels = vec![LoupePixel::Outside; SIDE * SIDE];
    pixels[0] = LoupePixel::Broken;
    pixels[1] = LoupePixel::Colour([1.0, 0.5, 0.0]);
    let mut harness = sized(640.0, false, move |ui, copied| {
        *copied |= Loupe { pixels: &pixels, lines: &lines, frozen: false }.show(ui, ui.max_rect());
    });
    harness.run_steps(3);
    for said in ["Linear 1.00 0.500 0", "Broken not finite", "click to hold"] {
        assert!(harness.query_by_label(said).is_some(), "{said}");
    }
    harness.get_by_label("Copy").click();
    harness.run_steps(3);
    assert!(harness.state());
}

#[test]
fn a_report_tells_what_holds_and_can_be_stopped() {
    let lines = [(Some(true), "phase"), (Some(false), "sky"), (None, "cloud")].map(|(holds, name)| ReportLine {
        holds,
        name: name.into(),
        figures: "1 for 1 ± 0.1".into(),
    });
    for (running, button, expected) in [
        (true, "Stop", ReportAnswer::Stop),
        (false, "Run again", ReportAnswer::Start),
        (true, "Copy as text", ReportAnswer::Copy),
        (false, "Close", ReportAnswer::Close),
    ] {
        let lines = lines.clone();
        let mut harness = sized(700.0, None, move |ui, answer| {
            let report = Report { title: "Self-test", state: "2 of 3 made", lines: &lines, running };
            *answer = report.show(ui.ctx()).or(*answer);
        });
        harness.run_steps(4);
        for said in ["phase: holds 1 for 1 ± 0.1", "sky: fails 1 for 1 ± 0.1", "2 of 3 made"] {
            assert!(harness.query_by_label(said).is_some(), "{said}");
        }
        assert!(harness.query_by_label_contains("cloud: not yet").is_some());
        harness.get_by_label(button).click();
        harness.run_steps(4);
        assert_eq!(*harness.state(), Some(expected), "{button}");
    }
}

#[test]
fn a_key_turns_the_inspector_on_and_off() {
    let mut harness = egui_kittest::Harness::builder()
        .with_size(vec2(1280.0, 800.0))
        .with_context_setup(nephele::app::theme::install)
        .build_ui_state(
            |ui, app: &mut App| {
                let now = ui.input(|i| i.time);
                app.frame(ui, now);
            },
            App::new(Scene::default(), Prefs::default()),
        );
    harness.run_steps(3);
    for on in [true, false] {
        harness.key_press(egui::Key::I);
        harness.run_steps(3);
        assert_eq!(harness.state().inspector.on, on);
    }
    let titles: Vec<String> = harness.root().children_recursive().filter_map(|n| n.accesskit_node().label()).collect();
    assert!(titles.iter().any(|t| t == "Method"), "the window is there");
}
