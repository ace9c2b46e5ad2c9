//! The side panel: its sections, and the read-outs between the rows.

use egui::Ui;

use super::actions::Action;
use super::facts::Facts;
use super::prefs::BOOKMARKS;
use super::presets::{PRESETS, preset_of};
use super::rows::{Rows, fitting_note};
use super::theme::{Theme, Type, size};
use super::widgets::{
    ButtonsRow, CheckRow, Choice, ComboRow, Digits, Head, Histogram, InfoRow, PhasePlot, Readout, Section, Tip,
    readouts,
};
use crate::io::volume_file;
use crate::render::{reuse, tracking};
use crate::scene::value::Limit;
use crate::scene::{
    Analytic, Bias, FreeFlight, Light, MajorantKind, Phase, Procedural, Scene, Tracking, Transmittance,
};

/// Which sections are open, in their order.
#[derive(Clone, Debug, PartialEq)]
pub struct Open(pub [bool; 7]);

impl Default for Open {
    fn default() -> Open {
        Open([true, true, false, false, true, false, false])
    }
}

/// What the user asked for beyond settings.
#[derive(Clone, Debug, PartialEq)]
pub enum Wish {
    /// Choose a file for this setting.
    Browse(String),
    /// What a key does as well.
    Act(Action),
    /// Draw with reduced resolution while things move.
    Dynamic(bool),
    /// Stop after so many samples; 0: never.
    SampleLimit(u32),
}

/// Shows the whole panel.
pub fn show(ui: &mut Ui, rows: &mut Rows, facts: &Facts, open: &mut Open, state: &State) -> Vec<Wish> {
    let mut wishes = Vec::new();
    let mut titles = open.0;
    let [volume, medium, light, camera, method, display, output] = &mut titles;
    section(ui, rows, "Volume", "volume.", &volume_summary(facts), true, volume, |ui, rows| {
        volume_section(ui, rows, facts);
    });
    let preset = preset_of(rows.scene, facts.mean_column).map_or("custom", |preset| preset.name);
    section(ui, rows, "Medium", "medium.", preset, false, medium, |ui, rows| medium_section(ui, rows, facts));
    let lights = light_summary(rows.scene);
    section(ui, rows, "Light", "lights.", &lights, false, light, light_section);
    let lens = if rows.scene.camera.aperture_radius > 0.0 { "thin lens" } else { "pinhole" };
    let camera_text = format!("{:.0}°, {lens}", rows.scene.camera.fov_y);
    section(ui, rows, "Camera", "camera.", &camera_text, false, camera, |ui, rows| {
        for key in ["fov_y", "aperture_radius", "focus_distance", "position", "target", "up"] {
            rows.show(ui, &format!("camera.{key}"));
        }
        bookmarks(ui, state, &mut wishes);
    });
    let bias = Bias::brief(&rows.scene.biases());
    let changed = rows.any_changed("integrator.")
        || rows.any_changed("tracking.")
        || rows.scene.integrator.mode.reuses() && rows.any_changed("restir.");
    let biased = bias.is_some();
    let summary = bias.map_or("unbiased".to_owned(), |what| format!("biased: {what}"));
    let head = Section { title: "Method", summary: &summary, changed, biased, first: false };
    head.show(ui, method, |ui| method_section(ui, rows, facts, state, &mut wishes));
    let tone = crate::scene::ToneMap::CHOICES[rows.scene.display.tone_map as usize].label;
    let display_text = format!("{tone}, {} EV", Digits::Decimals(1).format(rows.scene.display.exposure));
    section(ui, rows, "Display", "display.", &display_text, false, display, |ui, rows| {
        for key in ["exposure", "tone_map", "overlay"] {
            rows.show(ui, &format!("display.{key}"));
        }
    });
    section(ui, rows, "Output", "film.", "PNG and EXR", false, output, |ui, _| {
        InfoRow { caption: "Folder", text: &facts.captures }.show(ui);
        let buttons = [Choice::new("Picture"), Choice::new("Scene")];
        match (ButtonsRow { head: Head::new("Save"), buttons: &buttons }).show(ui) {
            Some(0) => wishes.push(Wish::Act(Action::Capture)),
            Some(_) => wishes.push(Wish::Act(Action::SaveScene)),
            None => {}
        }
        if (ButtonsRow { head: Head::new("This adapter"), buttons: &[Choice::new("Self-test")] }).show(ui).is_some() {
            wishes.push(Wish::Act(Action::SelfTest));
        }
    });
    open.0 = titles;
    wishes.extend(rows.browse.take().map(Wish::Browse));
    wishes
}

/// State of the window that the panel shows and changes by wishes.
#[derive(Clone, Debug, Default)]
pub struct State {
    /// Reduced resolution while things move.
    pub dynamic: bool,
    /// Samples after which the picture is done; 0: never.
    pub sample_limit: u32,
    /// Which bookmarks of the camera there are.
    pub bookmarks: [bool; BOOKMARKS],
}

fn bookmarks(ui: &mut Ui, state: &State, wishes: &mut Vec<Wish>) {
    const NAMES: [&str; BOOKMARKS] = ["1", "2", "3", "4"];
    let go = std::array::from_fn::<_, BOOKMARKS, _>(|i| Choice {
        blocked: if state.bookmarks[i] { "" } else { "empty" },
        ..Choice::new(NAMES[i])
    });
    if let Some(i) = (ButtonsRow { head: Head::new("Go to view"), buttons: &go }).show(ui) {
        wishes.push(Wish::Act(Action::GoTo(i as u8)));
    }
    if let Some(i) = (ButtonsRow { head: Head::new("Keep as view"), buttons: &NAMES.map(Choice::new) }).show(ui) {
        wishes.push(Wish::Act(Action::Store(i as u8)));
    }
}

#[allow(clippy::too_many_arguments)] // one line for each section; a struct would only rename them
fn section(
    ui: &mut Ui,
    rows: &mut Rows,
    title: &str,
    prefix: &str,
    summary: &str,
    first: bool,
    open: &mut bool,
    body: impl FnOnce(&mut Ui, &mut Rows),
) {
    let changed = rows.any_changed(prefix);
    Section { title, summary, changed, biased: false, first }.show(ui, open, |ui| body(ui, rows));
}

fn volume_summary(facts: &Facts) -> String {
    if !facts.known {
        return "loading".into();
    }
    match (facts.grids.len(), facts.voxels) {
        (n, _) if n > 1 => format!("1 of {n} grids"),
        (_, Some([x, y, z])) => format!("{x} × {y} × {z}"),
        (_, None) => "formula".into(),
    }
}

fn volume_section(ui: &mut Ui, rows: &mut Rows, facts: &Facts) {
    if !facts.histogram.is_empty() {
        let histogram = Histogram {
            counts: &facts.histogram,
            range: [0.0, facts.density_max],
            mean: Some(facts.density_mean),
            quantity: "density",
        };
        histogram.show(ui);
    }
    if let Some([x, y, z]) = facts.voxels {
        let text = format!("{x} × {y} × {z} · {:.0} % filled", facts.filled * 100.0);
        InfoRow { caption: "Voxels", text: &text }.show(ui);
    }
    if facts.known {
        let [x, y, z] = facts.extent.map(|e| Digits::Significant(3).format(e));
        InfoRow { caption: "Box", text: &format!("{x} × {y} × {z} units") }.show(ui);
        InfoRow { caption: "On the adapter", text: &mebibytes(facts.bytes) }.show(ui);
    }
    for warning in &facts.warnings {
        InfoRow { caption: "Note", text: warning }.show(ui);
    }
    rows.show(ui, "volume.file");
    if let Ok(Some(asset)) = volume_file::asset(&rows.scene.volume.file.0) {
        note(ui, asset.text);
        note(ui, asset.licence);
    }
    if facts.grids.len() > 1 {
        let names: Vec<Choice> = facts.grids.iter().map(|g| Choice::new(g)).collect();
        let current = facts.grids.iter().position(|g| *g == facts.grid).unwrap_or(0);
        let mut chosen = current;
        let head = Head {
            tip: Tip { key: "volume.grid", text: "The grid that is the density.", cost: "Loads the grid." },
            ..Head::new("Grid")
        };
        ComboRow { head, choices: &names, default: current }.show(ui, &mut chosen);
        if chosen != current {
            rows.scene.volume.grid = facts.grids[chosen].clone();
        }
    }
    if rows.scene.volume.file.0.is_empty() && rows.scene.volume.analytic == Analytic::None {
        if rows.scene.volume.procedural != Procedural::None || facts.grids.is_empty() {
            rows.show(ui, "volume.seed");
            rows.show(ui, "volume.resolution");
        }
    } else {
        rows.show(ui, "volume.max_resolution");
    }
    rows.show(ui, "volume.filter");
    rows.show(ui, "volume.precision");
}

/// Words in small type, in as many lines as they need.
fn note(ui: &mut Ui, text: &str) {
    small(ui, text, Theme::of(ui).text3);
}

/// The same in the colour of caution.
fn caution(ui: &mut Ui, text: &str) {
    small(ui, text, Theme::of(ui).warn);
}

fn small(ui: &mut Ui, text: &str, ink: egui::Color32) {
    egui::Frame::new().inner_margin(egui::Margin::symmetric(size::PADDING as i8, 0)).show(ui, |ui| {
        ui.add(egui::Label::new(egui::RichText::new(text).font(Type::Small.font()).color(ink)).wrap());
    });
}

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", Digits::Significant(3).format(bytes as f64 / f64::from(1 << 20)))
}

fn medium_section(ui: &mut Ui, rows: &mut Rows, facts: &Facts) {
    preset_row(ui, rows, facts);
    rows.show(ui, "medium.density_scale");
    let colour = rows.scene.medium.extinction.0.iter().sum::<f64>() / 3.0;
    let peak = facts.density_scale * colour * facts.density_max;
    let free_path = match facts.known {
        true if peak > 0.0 => 1.0 / peak,
        true => f64::INFINITY,
        false => f64::NAN,
    };
    let thickness = facts.mean_column.map_or(f64::NAN, |c| c * facts.density_scale * colour);
    let three = Digits::Significant(3);
    readouts(
        ui,
        &[
            Readout { caption: "Least free path", value: &three.format(free_path), unit: "units" },
            Readout { caption: "Mean thickness", value: &three.format(thickness), unit: "" },
            Readout { caption: "Bounces, mean", value: &three.format(facts.bounces.unwrap_or(f64::NAN)), unit: "" },
        ],
    );
    rows.show(ui, "medium.albedo");
    rows.show(ui, "medium.extinction");
    rows.show(ui, "medium.phase");
    let phase = rows.scene.medium.phase;
    if matches!(phase, Phase::Hg | Phase::TwoLobeHg) {
        rows.show(ui, "medium.g");
    }
    if phase == Phase::TwoLobeHg {
        rows.show(ui, "medium.g2");
        rows.show(ui, "medium.lobe_weight");
    }
    let medium = rows.scene.medium.clone();
    PhasePlot { phase: &move |cosine| phase_value(&medium, cosine) }.show(ui);
}

fn preset_row(ui: &mut Ui, rows: &mut Rows, facts: &Facts) {
    let current = preset_of(rows.scene, facts.mean_column).map(|preset| preset.name);
    let mut all: Vec<Choice> = PRESETS.iter().map(|preset| Choice::new(preset.name)).collect();
    if current.is_none() {
        all.push(Choice::new("Custom"));
    }
    let place = PRESETS.iter().position(|preset| Some(preset.name) == current).unwrap_or(PRESETS.len());
    let mut chosen = place;
    let text =
        "A whole look: medium, lights, path length. A file of your own stays; a built-in volume comes with its look.";
    let head = Head { tip: Tip { key: "", text, cost: "Starts the picture anew." }, ..Head::new("Preset") };
    ComboRow { head, choices: &all, default: 0 }.show(ui, &mut chosen);
    if chosen != place && chosen < PRESETS.len() {
        PRESETS[chosen].apply(rows.scene, facts.mean_column);
    }
}

/// The phase function of a medium, per steradian; the formulas of shaders/phase.
fn phase_value(medium: &crate::scene::Medium, cosine: f32) -> f32 {
    let pi = std::f64::consts::PI;
    let c = f64::from(cosine);
    let lobe = |g: f64| (1.0 - g * g) / (4.0 * pi * (1.0 + g * g - 2.0 * g * c).powf(1.5));
    (match medium.phase {
        Phase::Isotropic => 0.25 / pi,
        Phase::Rayleigh => 3.0 / (16.0 * pi) * (1.0 + c * c),
        Phase::Hg => lobe(medium.g),
        Phase::TwoLobeHg => medium.lobe_weight * lobe(medium.g) + (1.0 - medium.lobe_weight) * lobe(medium.g2),
    }) as f32
}

fn light_summary(scene: &Scene) -> String {
    let names: Vec<String> = scene
        .lights
        .iter()
        .map(|light| match light {
            Light::Sun(sun) => {
                let d = sun.direction.normalize();
                format!("sun {:.0}°", d.y.asin().to_degrees())
            }
            Light::Sky(sky) => format!("sky {:.0}°", sky.sun_elevation),
            other => other.kind().to_owned(),
        })
        .collect();
    match names.len() {
        0 => "none".into(),
        1 | 2 => names.join(", "),
        n => format!("{n} lights"),
    }
}

fn light_section(ui: &mut Ui, rows: &mut Rows) {
    let mut remove = None;
    for index in 0..rows.scene.lights.len() {
        ui.push_id(index, |ui| {
            let kind = rows.scene.lights[index].kind();
            let label = Light::KINDS.iter().find(|(k, _)| *k == kind).map_or("", |(_, label)| label);
            let buttons = [Choice::new("Remove")];
            if (ButtonsRow { head: Head::new(label), buttons: &buttons }).show(ui).is_some() {
                remove = Some(index);
            }
            for row in rows.scene.lights[index].section().rows() {
                rows.show(ui, &format!("lights.{index}.{}", row.key));
            }
        });
    }
    if let Some(index) = remove {
        rows.scene.lights.remove(index);
    }
    let mut names = vec![Choice::new("Choose a kind")];
    names.extend(Light::KINDS.iter().map(|(_, label)| Choice::new(label)));
    let mut chosen = 0;
    ComboRow { head: Head::new("Add a light"), choices: &names, default: 0 }.show(ui, &mut chosen);
    if chosen > 0 {
        rows.scene.lights.extend(Light::of_kind(Light::KINDS[chosen - 1].0));
    }
}

/// Settings of the chosen estimators: those that change anything.
fn tracking_keys(tracking: &Tracking) -> Vec<&'static str> {
    let exact_flight =
        matches!(tracking.free_flight, FreeFlight::Regular | FreeFlight::ClosedForm | FreeFlight::RayMarching);
    let exact_shadows = matches!(
        tracking.transmittance,
        Transmittance::Regular | Transmittance::ClosedForm | Transmittance::RayMarching | Transmittance::Jackknife
    );
    let marches = tracking.free_flight == FreeFlight::RayMarching
        || matches!(
            tracking.transmittance,
            Transmittance::RayMarching
                | Transmittance::Jackknife
                | Transmittance::UnbiasedRayMarching
                | Transmittance::Telescoping
        );
    let mut keys = vec!["tracking.free_flight", "tracking.transmittance", "tracking.majorant"];
    let mut add = |key, applies: bool| keys.extend(applies.then_some(key));
    add("tracking.cell", tracking.majorant == MajorantKind::Grid);
    add("tracking.control", tracking::needs_control(tracking));
    add("tracking.majorant_factor", !(exact_flight && exact_shadows));
    add("tracking.step", marches);
    keys
}

/// Settings of the stages of resampling that are on, where the mode takes them.
fn restir_keys(scene: &Scene) -> Vec<&'static str> {
    let (mode, restir) = (scene.integrator.mode, &scene.restir);
    let mut keys = vec!["restir.candidates"];
    keys.extend(reuse::has_second(scene).then_some("restir.suffixes"));
    keys.extend(["restir.final_samples", "restir.temporal"]);
    if restir.temporal {
        keys.extend(["restir.cap", "restir.edit_confidence", "restir.permute"]);
    }
    keys.push("restir.spatial");
    if restir.spatial {
        keys.extend(["restir.neighbours", "restir.reach"]);
    }
    if restir.spatial && restir.temporal {
        keys.push("restir.history");
    }
    keys.extend(["restir.reconnect_distance", "restir.still_after", "restir.still_cap", "restir.proxy_cell"]);
    keys.retain(|key| mode.takes(&key["restir.".len()..]));
    keys
}

/// Why the picture may not be what it should, for each of `Facts::mishaps`.
fn mishaps(facts: &Facts, factor: f64) -> Vec<String> {
    let [violations, capped, nonfinite] = facts.mishaps;
    let whose = if factor < 1.0 { "as a factor below 1 makes them" } else { "the picture is not what it should be" };
    let texts = [
        (violations, format!("{violations} lookups lie above their bound: {whose}.")),
        (capped, format!("{capped} segments took fewer looks than wanted: their number is limited.")),
        (nonfinite, format!("{nonfinite} samples are not finite and count as black.")),
    ];
    texts.into_iter().filter(|(count, _)| *count > 0).map(|(_, text)| text).collect()
}

fn method_section(ui: &mut Ui, rows: &mut Rows, facts: &Facts, state: &State, wishes: &mut Vec<Wish>) {
    rows.show(ui, "integrator.mode");
    if rows.scene.integrator.mode.reuses() {
        for key in restir_keys(rows.scene) {
            rows.show(ui, key);
        }
        let text = "Forgets the paths that pixels keep from frame to frame, as at the first frame.";
        let tip = Tip { key: "", text, cost: "Starts the picture anew." };
        let head = Head { tip, ..Head::new("Kept paths") };
        if (ButtonsRow { head, buttons: &[Choice::new("Drop")] }).show(ui).is_some() {
            wishes.push(Wish::Act(Action::DropHistory));
        }
    }
    for key in tracking_keys(&rows.scene.tracking) {
        rows.show(ui, key);
    }
    let fitting = fitting_note(ui);
    if !fitting.is_empty() {
        note(ui, &fitting);
    }
    let biases = rows.scene.biases();
    if !biases.is_empty() {
        let steps = biases.iter().all(|bias| bias.key.starts_with("tracking."));
        let remedy = if steps { ", shorter steps do" } else { "" };
        caution(ui, &format!("Biased by {}: more samples do not remove the error{remedy}.", Bias::whys(&biases)));
    }
    let three = |x: Option<f64>| Digits::Significant(3).format(x.unwrap_or(f64::NAN));
    let cell = if facts.known { facts.cell.to_string() } else { String::new() };
    readouts(
        ui,
        &[
            Readout { caption: "Lookups / path", value: &three(facts.lookups_per_path), unit: "" },
            Readout { caption: "Null share", value: &three(facts.null_ratio), unit: "" },
            Readout { caption: "Steps / path", value: &three(facts.steps_per_path), unit: "" },
            Readout { caption: "Shadows / path", value: &three(facts.shadows_per_path), unit: "" },
            Readout { caption: "Finest cell", value: &cell, unit: "voxels" },
        ],
    );
    if facts.known {
        let (bytes, seconds) = facts.bounds;
        let built = format!("{}, built in {} ms", mebibytes(bytes), three(Some(seconds * 1e3)));
        InfoRow { caption: "Bounds", text: &built }.show(ui);
    }
    for text in mishaps(facts, rows.scene.tracking.majorant_factor) {
        caution(ui, &text);
    }
    let unlimited = rows.scene.integrator.max_bounces == Limit::Unlimited;
    if !unlimited {
        rows.show(ui, "integrator.max_bounces");
    }
    let head = |label, key, text| Head { tip: Tip { key, text, cost: "" }, ..Head::new(label) };
    let mut on = unlimited;
    let text = "Paths end by leaving, by absorption or by roulette, never by a count.";
    let row = CheckRow { head: head("Unlimited", "integrator.max_bounces", text), note: "", default: false };
    row.show(ui, &mut on);
    if on != unlimited {
        rows.scene.integrator.max_bounces = if on { Limit::Unlimited } else { Limit::AtMost(64) };
    }
    rows.show(ui, "integrator.seed");
    let mut on = state.dynamic;
    let text = "Draw with fewer pixels while things move, so that the window stays fluid.";
    CheckRow { head: head("Adapt scale", "", text), note: "", default: true }.show(ui, &mut on);
    if on != state.dynamic {
        wishes.push(Wish::Dynamic(on));
    }
    let limits = [0, 64, 256, 1024, 4096, 16384];
    let names = ["never", "64", "256", "1024", "4096", "16384"].map(Choice::new);
    let place = limits.iter().position(|&l| l == state.sample_limit).unwrap_or(0);
    let mut chosen = place;
    let text = "Samples per pixel after which the picture is done.";
    ComboRow { head: head("Stop at", "", text), choices: &names, default: 0 }.show(ui, &mut chosen);
    if chosen != place {
        wishes.push(Wish::SampleLimit(limits[chosen]));
    }
}
