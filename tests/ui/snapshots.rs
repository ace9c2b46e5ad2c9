//! The window as pictures, without a volume: layout, type and colours in both themes. `UPDATE_SNAPSHOTS=1` draws them anew;
//! look at the new ones.

use egui::vec2;
use egui_kittest::{Harness, SnapshotOptions};
use nephele::app::App;
use nephele::app::prefs::Prefs;
use nephele::app::theme;
use nephele::scene::Scene;

/// Differences that software drivers of other versions make at the edges of signs: perceptual distance of a pixel, and how
/// many pixels may be further apart. A row that moves by a point changes thousands.
const DISTANCE: f32 = 4.0;
const PIXELS: usize = 300;

fn picture(name: &str, size: egui::Vec2, light: bool) {
    let mut prefs = Prefs::default();
    prefs.light = light;
    let mut harness = Harness::builder()
        .with_size(size)
        .with_context_setup(theme::install)
        .with_step_dt(1.0 / 60.0)
        .wgpu()
        .build_ui_state(
            |ui, app: &mut App| {
                let whole = egui::UiBuilder::new().max_rect(ui.ctx().content_rect());
                ui.scope_builder(whole, |ui| app.frame(ui, 0.0));
            },
            App::new(Scene::default(), prefs),
        );
    // Time for the sections to fold out.
    harness.run_steps(30);
    let tolerance =
        SnapshotOptions::new().output_path("tests/ui/snapshots").threshold(DISTANCE).max_failed_pixels(PIXELS);
    harness.snapshot_options(name, &tolerance);
}

#[test]
fn the_panel_in_the_dark_theme() {
    picture("panel-dark", vec2(900.0, 760.0), false);
}

#[test]
fn the_panel_in_the_light_theme() {
    picture("panel-light", vec2(900.0, 760.0), true);
}

#[test]
fn a_narrow_window() {
    picture("narrow", vec2(480.0, 320.0), false);
}
