//! Sections, plots, bars, cards and overlays.

use egui::{Key, Pos2, Rect, Role, vec2};
use egui_kittest::Harness;
use egui_kittest::kittest::{NodeT, Queryable};
use nephele::app::theme::{self, icon};
use nephele::app::widgets::*;

use crate::harness::{drag, focus, panel, press, sized, type_text};
use crate::widgets::anisotropy;

#[test]
fn a_section_folds_and_tells_its_state() {
    let mut harness = panel((true, 0.5), |ui, state: &mut (bool, f64)| {
        let section = Section { title: "Medium", summary: "Cumulus", changed: true, biased: true, first: true };
        section.show(ui, &mut state.0, |ui| {
            SliderRow::new(Head::new("Density"), 0.0..=1.0).show(ui, &mut state.1);
        });
    });
    harness.run();
    assert!(harness.query_by_label("Density").is_some());
    let header = harness.get_by_label("Medium");
    assert_eq!(header.accesskit_node().role(), Role::DisclosureTriangle);
    assert_eq!(header.accesskit_node().data().is_expanded(), Some(true));
    assert_eq!(header.accesskit_node().description().as_deref(), Some("biased, changed"));
    header.click();
    harness.run();
    assert!(!harness.state().0);
    assert!(harness.query_by_label("Density").is_none(), "a closed section holds no stops for Tab");
    focus(&mut harness, "Medium");
    press(&mut harness, Key::Enter);
    assert!(harness.state().0);
}

#[test]
fn readouts_are_held_and_never_zero_for_unknown() {
    let mut harness = panel(String::from("1.00"), |ui, value: &mut String| {
        readouts(ui, &[Readout { caption: "Null share", value, unit: "%" }]);
    });
    harness.step();
    assert!(harness.query_by_label("Null share 1.00 %").is_some());
    *harness.state_mut() = "2.00".into();
    harness.step();
    assert!(harness.query_by_label("Null share 1.00 %").is_some(), "no flicker");
    harness.run_steps(20);
    assert!(harness.query_by_label("Null share 2.00 %").is_some());
    harness.state_mut().clear();
    harness.run_steps(20);
    assert!(harness.query_by_label("Null share – %").is_some());
}

#[test]
fn plots_say_their_numbers() {
    let mut harness = panel((), |ui, (): &mut ()| {
        Histogram { counts: &[5, 0, 3], range: [0.0, 2.0], mean: Some(0.31), quantity: "density" }.show(ui);
        let g = 0.85f32;
        let phase = |c: f32| (1.0 - g * g) / (4.0 * std::f32::consts::PI * (1.0 + g * g - 2.0 * g * c).powf(1.5));
        PhasePlot { phase: &phase }.show(ui);
        InfoRow { caption: "Voxels", text: "126 × 86 × 154" }.show(ui);
    });
    harness.run();
    harness.get_by_label("Histogram of density from 0.0 to 2.0, mean 0.31");
    harness.get_by_label_contains("forward half 96.4 %, backward half 3.6 %, mean angle 31.8°");
    harness.get_by_label("Voxels 126 × 86 × 154");
}

#[test]
fn toasts_go_by_their_clock_and_answer() {
    struct State {
        toasts: Toasts,
        now: f64,
        answers: Vec<ToastAnswer>,
    }
    let mut toasts = Toasts::default();
    let action = ToastAction { id: 7, label: "Show in folder".into() };
    let saved = toasts.push(0.0, Kind::Ok, "Saved a.png", "1280 × 720", vec![action]);
    toasts.push(0.0, Kind::Error, "b.vdb is cut short", "Download it again.", vec![]);
    let state = State { toasts, now: 0.0, answers: Vec::new() };
    let mut harness = sized(700.0, state, |ui, state: &mut State| {
        let viewport = Rect::from_min_size(Pos2::ZERO, vec2(700.0, 400.0));
        state.answers.extend(state.toasts.show(ui, viewport, state.now));
    });
    harness.run_ok();
    harness.get_by_label("Show in folder").click();
    harness.run_ok();
    assert_eq!(harness.state().answers, [ToastAnswer { toast: saved, action: 7 }]);
    assert_eq!(harness.state().toasts.len(), 1, "an action closes its toast");

    let now = harness.state().now;
    harness.state_mut().toasts.push(now, Kind::Ok, "Saved c.png", "", vec![]);
    harness.remove_cursor();
    harness.run_ok();
    harness.state_mut().now += 4.9;
    harness.run_ok();
    assert_eq!(harness.state().toasts.len(), 2);
    harness.state_mut().now += 0.2;
    harness.run_ok();
    assert_eq!(harness.state().toasts.len(), 1);
    harness.state_mut().now += 1000.0;
    harness.run_ok();
    assert_eq!(harness.state().toasts.len(), 1, "errors stay");
    harness.get_by_label("Close").click();
    harness.run_ok();
    assert!(harness.state().toasts.is_empty());
    assert_eq!(harness.state().toasts.log().len(), 3);
}

#[test]
fn the_tooltip_stands_left_of_the_panel() {
    const PANEL_LEFT: f32 = 400.0;
    const TEXT: &str = "Mean cosine of the scattering angle.";
    let mut harness = sized(736.0, 0.85, |ui, value: &mut f64| {
        let place = Rect::from_min_max(Pos2::new(PANEL_LEFT, 100.0), Pos2::new(736.0, 400.0));
        ui.scope_builder(egui::UiBuilder::new().max_rect(place), |ui| anisotropy().show(ui, value));
    });
    let frames = |seconds: f32| (60.0 * seconds) as usize;
    harness.run();
    harness.get_by_label("Anisotropy g").hover();
    harness.run_steps(frames(0.4));
    assert!(harness.query_by_label(TEXT).is_none(), "not at once");
    harness.run_steps(frames(0.3));
    let tip = harness.get_by_label(TEXT).rect();
    assert!(tip.right() < PANEL_LEFT && tip.center().y > 60.0 && tip.center().y < 180.0, "{tip:?}");
    harness.remove_cursor();
    harness.run_steps(frames(0.2));
    assert!(harness.query_by_label(TEXT).is_none());

    harness.get_by_label("Anisotropy g").focus();
    harness.run_steps(frames(0.5));
    assert!(harness.query_by_label(TEXT).is_none());
    harness.key_press(Key::F1);
    harness.run_steps(frames(0.1));
    assert!(harness.query_by_label(TEXT).is_some(), "F1 for the keyboard");
    let node = harness.get_by_label("Anisotropy g");
    assert_eq!(node.accesskit_node().description().as_deref(), Some(TEXT), "screen readers have it too");
}

#[test]
fn the_card_comes_by_itself_to_a_resting_keyboard() {
    let mut harness = panel(0.85, |ui, value: &mut f64| {
        anisotropy().show(ui, value);
    });
    harness.run();
    harness.get_by_label("Anisotropy g").focus();
    harness.run_steps(66);
    assert!(harness.query_by_label("Mean cosine of the scattering angle.").is_some());
}

#[test]
fn the_panel_scrolls_to_the_focus() {
    let mut harness = panel([0.5; 30], |ui, values: &mut [f64; 30]| {
        panel_scroll(ui, |ui| {
            for (i, value) in values.iter_mut().enumerate() {
                SliderRow::new(Head::new(&format!("Row {i}")), 0.0..=1.0).show(ui, value);
            }
        });
    });
    harness.run();
    let view = Rect::from_min_size(Pos2::ZERO, vec2(360.0, 400.0));
    assert!(!view.contains_rect(harness.get_by_label("Row 29").rect()));
    harness.get_by_label("Row 29").focus();
    harness.run();
    assert!(view.contains_rect(harness.get_by_label("Row 29").rect()));
}

#[test]
fn help_is_searched_and_closed() {
    const ENTRIES: [HelpEntry; 3] = [
        HelpEntry { group: "Look", keys: &["Drag"], text: "Orbit" },
        HelpEntry { group: "Look", keys: &["Shift", "Drag"], text: "Pan" },
        HelpEntry { group: "Window", keys: &["Tab"], text: "Hide the panel" },
    ];
    let mut help = Help::default();
    help.toggle();
    let mut harness = panel(help, |ui, help: &mut Help| {
        let context = ui.ctx().clone();
        help.show(&context, &ENTRIES, "");
    });
    harness.run_ok();
    assert!(harness.get_by_label("Search actions").is_focused());
    assert!(harness.query_by_label("Tab: Hide the panel").is_some());
    type_text(&mut harness, "PAN");
    assert!(harness.query_by_label("Shift Drag: Pan").is_some());
    assert!(harness.query_by_label("Drag: Orbit").is_none());
    type_text(&mut harness, "zzz");
    assert!(harness.query_by_label_contains("No action has").is_some());
    press(&mut harness, Key::Escape);
    assert!(!harness.state().open);
}

#[test]
fn status_banner_tools_and_timeline_answer() {
    #[derive(Default)]
    struct State {
        status: Vec<StatusClick>,
        banner: Vec<BannerAnswer>,
        timeline: Vec<TimelineAnswer>,
        tools: usize,
    }
    let mut harness =
        Harness::builder().with_size(vec2(1280.0, 300.0)).with_context_setup(theme::install).build_ui_state(
            |ui, state: &mut State| {
                state.tools += usize::from(tool_button(ui, icon::UNDO, "Ctrl+Z", false, true).clicked());
                state.tools += usize::from(tool_button(ui, icon::REDO, "", false, false).clicked());
                file_name(ui, "a_very_long_name_of_a_cloud.vdb", "density", 120.0);
                let cells =
                    [Cell { value: "512", unit: "/ 4096 spp", widest: "4096", name: "Samples", ..Cell::default() }];
                let bar = StatusBar {
                    progress: Some(0.5),
                    cells: &cells,
                    trust: Trust::Biased { by: "ray marching", tip: "Transmittance: ray marching" },
                    adapter: "llvmpipe · Vulkan",
                    software: true,
                };
                state.status.extend(bar.show(ui));
                let line = Timeline {
                    frame: 3,
                    first: 0,
                    end: 11,
                    loaded: std::slice::from_ref(&(0..5)),
                    playing: false,
                    looping: true,
                    speed: "24 fps",
                };
                state.timeline.extend(line.show(ui));
                let banner = Banner { text: "Drawn by the processor.", brief: "No GPU.", action: "Why?" };
                let viewport = Rect::from_min_size(Pos2::new(0.0, 200.0), vec2(1280.0, 100.0));
                state.banner.extend(banner.show(ui, viewport));
            },
            State::default(),
        );
    harness.run();
    for name in ["Undo", "Redo", "Samples 512 / 4096 spp", "biased: ray marching", "Why?", "Step on", "Play"] {
        harness.get_by_label(name).click();
        harness.run();
    }
    harness.get_by_label("Frame").set_value_accesskit(9.0);
    harness.run();
    let state = harness.state();
    assert_eq!(state.tools, 1, "a disabled tool does nothing");
    assert_eq!(state.status, [StatusClick::Cell(0), StatusClick::Trust]);
    assert_eq!(state.banner, [BannerAnswer::Act]);
    assert_eq!(state.timeline, [TimelineAnswer::Seek(4), TimelineAnswer::Play, TimelineAnswer::Seek(9)]);
    harness.get_by_label("a_very_long_name_of_a_cloud.vdb density");
}

#[test]
fn the_word_on_trust_names_the_settings() {
    let tip = "Free flight: ray marching of free flights\nTransmittance: jackknife transmittance";
    let mut harness = sized(1280.0, (), |ui, ()| {
        let trust = Trust::Biased { by: "2 settings", tip };
        StatusBar { progress: None, cells: &[], trust, adapter: "x", software: false }.show(ui);
    });
    harness.run();
    let word = harness.get_by_label("biased: 2 settings");
    assert_eq!(word.accesskit_node().description().as_deref(), Some(tip), "for screen readers");
    word.hover();
    // Longer than a tooltip takes to come.
    harness.run_steps(60);
    assert!(harness.query_by_label_contains("Free flight: ray marching").is_some(), "under the pointer");
}

#[test]
fn figures_of_the_status_line_do_not_shift() {
    let mut harness =
        Harness::builder().with_size(vec2(1280.0, 60.0)).with_context_setup(theme::install).build_ui_state(
            |ui, value: &mut String| {
                let time = Cell { value, unit: "s", widest: "999.9", name: "Time", ..Cell::default() };
                let error = Cell { value: "0.82", unit: "% error", widest: "99.9", name: "Error", ..Cell::default() };
                let cells = [time, error];
                StatusBar { progress: None, cells: &cells, trust: Trust::Unbiased, adapter: "x", software: false }
                    .show(ui);
            },
            String::from("9.4"),
        );
    harness.run();
    let before = harness.get_by_label("Error 0.82 % error").rect();
    *harness.state_mut() = "112.4".into();
    harness.run();
    assert_eq!(before, harness.get_by_label("Error 0.82 % error").rect());
}

#[test]
fn the_wipe_is_dragged_and_stepped() {
    let viewport = Rect::from_min_size(Pos2::ZERO, vec2(700.0, 400.0));
    let mut harness = sized(700.0, 0.5, |ui, at: &mut f32| {
        let a = Chip { method: "ReSTIR", figures: "12.0 s · error 0.82 %" };
        let b = Chip { method: "Path", figures: "12.0 s · error 2.31 %" };
        if let Some(moved) = (Wipe { at: *at, a, b }).show(ui, viewport) {
            *at = moved;
        }
    });
    harness.run();
    drag(&mut harness, Pos2::new(350.0, 100.0), 70.0, egui::Modifiers::NONE);
    assert!((harness.state() - 0.6).abs() < 0.002, "{}", harness.state());
    focus(&mut harness, "Wipe between A and B");
    press(&mut harness, Key::ArrowLeft);
    assert!((harness.state() - 0.59).abs() < 0.002, "{}", harness.state());
    harness.get_by_label("Picture B: Path, 12.0 s · error 2.31 %");
}

#[test]
fn a_narrow_status_line_drops_whole_cells_by_rank() {
    let ranks = [("Samples", 0), ("Time", 3), ("Speed", 4), ("Scale", 1), ("Error", 2)];
    let mut shown_before = ranks.len();
    for width in [1280.0, 900.0, 700.0, 560.0, 480.0] {
        let mut harness = sized(width, (), move |ui, ()| {
            let cells = ranks.map(|(name, rank)| Cell {
                value: "12.5",
                unit: "units / s",
                widest: "000.0",
                name,
                rank,
                ..Cell::default()
            });
            let adapter = "llvmpipe (LLVM 15.0.6, 256 bits) · vulkan";
            let bar = StatusBar { progress: None, cells: &cells, trust: Trust::Unbiased, adapter, software: true };
            bar.show(ui);
        });
        harness.run();
        let place = |name: &str| harness.query_by_label(&format!("{name} 12.5 units / s")).map(|node| node.rect());
        let shown: Vec<_> = ranks.iter().filter_map(|(name, rank)| place(name).map(|rect| (*rank, rect))).collect();
        let highest = shown.iter().map(|(rank, _)| *rank).max().expect("the samples are always there");
        assert_eq!(shown.len(), highest as usize + 1, "{width}: the lowest ranks stay");
        assert!(shown.len() <= shown_before, "{width}: fewer where there is less room");
        shown_before = shown.len();
        let trust = harness.get_by_label("unbiased").rect();
        let adapter = harness.get_by_label_contains("Adapter").rect();
        let all: Vec<Rect> = shown.iter().map(|(_, rect)| *rect).chain([trust, adapter]).collect();
        for pair in all.windows(2) {
            assert!(pair[0].right() < pair[1].left(), "{width}: {pair:?}");
        }
        assert!(adapter.right() <= width, "{width}");
    }
    assert!(shown_before < ranks.len(), "the narrowest has no room for all");
}
