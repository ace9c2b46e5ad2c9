//! The side panel: its sections, and the read-outs between the rows.

use egui::Ui;

use super::rows::Rows;
use super::widgets::{
    ButtonsRow, CheckRow, Choice, ComboRow, Digits, Head, Histogram, InfoRow, PhasePlot, Readout, Section, Tip,
    readouts,
};
use crate::scene::value::{Auto, Colour, Limit};
use crate::scene::{Analytic, Light, MajorantKind, Phase, Procedural, Scene};

/// Facts about the picture and the volume that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// Texels along each side, without the border; `None` for an analytic volume.
    pub voxels: Option<[u32; 3]>,
    /// Size of the world box.
    pub extent: [f64; 3],
    /// Counts of densities above 0 in equal bins up to `density_max`.
    pub histogram: Vec<u64>,
    /// The greatest density.
    pub density_max: f64,
    /// Mean of the densities above 0.
    pub density_mean: f64,
    /// Share of voxels above 0.
    pub filled: f64,
    /// Grids that the file offers, and the one in use.
    pub grids: Vec<String>,
    /// The grid in use.
    pub grid: String,
    /// ∫ density dt along a mean column.
    pub mean_column: Option<f64>,
    /// Density scale in use.
    pub density_scale: f64,
    /// Density lookups of a path.
    pub lookups_per_path: Option<f64>,
    /// Share of null collisions among those of free flights.
    pub null_ratio: Option<f64>,
    /// Real collisions of a path that meets the medium.
    pub bounces: Option<f64>,
    /// Side of a majorant cell, voxels.
    pub cell: u32,
    /// Bytes of density and majorants on the adapter.
    pub bytes: u64,
    /// Warnings of the volume.
    pub warnings: Vec<String>,
    /// The folder that captures go to.
    pub captures: String,
}

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
    /// Save the picture.
    Capture,
    /// Save the scene.
    SaveScene,
    /// Draw with reduced resolution while things move.
    Dynamic(bool),
    /// Stop after so many samples; 0: never.
    SampleLimit(u32),
}

/// A preset: its name, and what it makes of a scene.
pub type Preset = (&'static str, fn(&mut Scene));

/// The presets, in the order of the menu.
pub const PRESETS: [Preset; 6] = [
    ("Cumulus", |s| {
        cloud(s);
        s.medium.albedo = Colour([0.9999; 3]);
    }),
    ("Dense cumulus", |s| {
        cloud(s);
        s.medium.albedo = Colour([1.0; 3]);
        s.medium.g = 0.877;
        s.medium.density_scale = Auto::Is(200.0);
    }),
    ("Fog", |s| {
        cloud(s);
        s.medium.density_scale = Auto::Is(6.0);
        s.medium.albedo = Colour([0.995; 3]);
        s.medium.g = 0.7;
    }),
    ("Smoke", |s| {
        cloud(s);
        s.medium.albedo = Colour([0.6, 0.58, 0.55]);
        s.medium.g = 0.4;
        s.medium.density_scale = Auto::Is(25.0);
    }),
    ("Milk", |s| {
        cloud(s);
        // Scattering and absorption of whole milk: Jensen et al. 2001, table 1, relative to green.
        s.medium.extinction = Colour([0.79, 1.0, 1.17]);
        s.medium.albedo = Colour([0.99957, 0.99926, 0.99627]);
        s.medium.g = 0.75;
        s.medium.density_scale = Auto::Is(120.0);
    }),
    ("White furnace", |s| {
        cloud(s);
        s.medium.albedo = Colour([1.0; 3]);
        s.integrator.max_bounces = Limit::Unlimited;
        s.lights = vec![Light::Constant(crate::scene::Constant { radiance: Colour([1.0; 3]) })];
    }),
];

/// What all presets begin with: the medium's defaults in the same volume.
fn cloud(scene: &mut Scene) {
    let medium = crate::scene::Medium::default();
    scene.medium = crate::scene::Medium { phase: Phase::Hg, ..medium };
}

/// Shows the whole panel.
pub fn show(ui: &mut Ui, rows: &mut Rows, facts: &Facts, open: &mut Open, state: &State) -> Vec<Wish> {
    let mut wishes = Vec::new();
    let mut titles = open.0;
    let [volume, medium, light, camera, method, display, output] = &mut titles;
    section(ui, rows, "Volume", "volume.", &volume_summary(facts), true, volume, |ui, rows| {
        volume_section(ui, rows, facts);
    });
    let preset = state.preset.clone();
    section(ui, rows, "Medium", "medium.", &preset, false, medium, |ui, rows| medium_section(ui, rows, facts));
    let lights = light_summary(rows.scene);
    section(ui, rows, "Light", "lights.", &lights, false, light, light_section);
    let lens = if rows.scene.camera.aperture_radius > 0.0 { "thin lens" } else { "pinhole" };
    let camera_text = format!("{:.0}°, {lens}", rows.scene.camera.fov_y);
    section(ui, rows, "Camera", "camera.", &camera_text, false, camera, |ui, rows| {
        for key in ["fov_y", "aperture_radius", "focus_distance", "position", "target", "up"] {
            rows.show(ui, &format!("camera.{key}"));
        }
    });
    section(ui, rows, "Method", "tracking.", "unbiased", false, method, |ui, rows| {
        method_section(ui, rows, facts, state, &mut wishes);
    });
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
            Some(0) => wishes.push(Wish::Capture),
            Some(_) => wishes.push(Wish::SaveScene),
            None => {}
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
    /// The preset that the medium equals; empty if none.
    pub preset: String,
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
    let three = Digits::Significant(3);
    let [x, y, z] = facts.extent.map(|e| three.format(e));
    InfoRow { caption: "Box", text: &format!("{x} × {y} × {z} units") }.show(ui);
    InfoRow { caption: "On the adapter", text: &mebibytes(facts.bytes) }.show(ui);
    for warning in &facts.warnings {
        InfoRow { caption: "Note", text: warning }.show(ui);
    }
    rows.show(ui, "volume.file");
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

fn mebibytes(bytes: u64) -> String {
    format!("{} MiB", Digits::Significant(3).format(bytes as f64 / f64::from(1 << 20)))
}

fn medium_section(ui: &mut Ui, rows: &mut Rows, facts: &Facts) {
    let names: Vec<Choice> = PRESETS.iter().map(|(name, _)| Choice::new(name)).collect();
    preset_row(ui, rows, &names);
    rows.show(ui, "medium.density_scale");
    let colour = rows.scene.medium.extinction.0.iter().sum::<f64>() / 3.0;
    let peak = facts.density_scale * colour * facts.density_max;
    let free_path = if peak > 0.0 { 1.0 / peak } else { f64::INFINITY };
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

fn preset_row(ui: &mut Ui, rows: &mut Rows, names: &[Choice]) {
    let current = preset_of(rows.scene);
    let mut all: Vec<Choice> = names.to_vec();
    if current.is_none() {
        all.push(Choice::new("Custom"));
    }
    let place = current.unwrap_or(names.len());
    let mut chosen = place;
    let head = Head {
        tip: Tip { key: "", text: "A medium to start from; the volume stays.", cost: "Starts the picture anew." },
        ..Head::new("Preset")
    };
    ComboRow { head, choices: &all, default: place }.show(ui, &mut chosen);
    if chosen != place && chosen < PRESETS.len() {
        PRESETS[chosen].1(rows.scene);
    }
}

/// The preset whose medium the scene has.
pub fn preset_of(scene: &Scene) -> Option<usize> {
    PRESETS.iter().position(|(_, apply)| {
        let mut probe = scene.clone();
        apply(&mut probe);
        probe.medium == scene.medium && probe.integrator == scene.integrator && probe.lights == scene.lights
    })
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

fn method_section(ui: &mut Ui, rows: &mut Rows, facts: &Facts, state: &State, wishes: &mut Vec<Wish>) {
    for key in ["tracking.free_flight", "tracking.transmittance", "tracking.majorant"] {
        rows.show(ui, key);
    }
    if rows.scene.tracking.majorant == MajorantKind::Grid {
        rows.show(ui, "tracking.cell");
    }
    let three = Digits::Significant(3);
    readouts(
        ui,
        &[
            Readout {
                caption: "Lookups / path",
                value: &three.format(facts.lookups_per_path.unwrap_or(f64::NAN)),
                unit: "",
            },
            Readout { caption: "Null share", value: &three.format(facts.null_ratio.unwrap_or(f64::NAN)), unit: "" },
            Readout { caption: "Finest cell", value: &facts.cell.to_string(), unit: "voxels" },
        ],
    );
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
