//! What the lab shows: the two pictures, their chips and plot, its part of the panel.

use egui::{Align2, Rect, Ui};

use super::compare::REFERENCE;
use super::trace::{Estimate, Point};
use super::{Axis, Controls, Share, Side, View};
use crate::app::App;
use crate::app::engine::Engine;
use crate::app::picture::{Presenter, Style};
use crate::app::theme::{Theme, Type, size};
use crate::app::widgets::{
    ButtonsRow, CheckRow, Chip, Choice, Contest, Convergence, Digits, Head, Scale, Section, SegmentsRow, SliderRow,
    Tip, Wipe, chips, segments, versus,
};
use crate::render::Renderer;
use crate::scene::Scene;
use crate::scene::value::{Setting, Value};

/// The plot is shown where the viewport has this size at least, points.
const PLOT_ROOM: egui::Vec2 = egui::vec2(420.0, 400.0);
/// Held down, it shows the other side.
pub const FLIP: egui::Key = egui::Key::X;

/// A control as a row: its label and words are those of its declaration.
fn head(key: &str) -> Head<'static> {
    let row = Controls::ROWS.iter().find(|row| row.key == key).expect("a row of the lab's controls");
    Head { tip: Tip { key: "", text: row.help.trim(), cost: "" }, ..Head::new(row.label) }
}

/// A row of segments for one of the controls.
fn choose<T: Setting + Copy>(ui: &mut Ui, key: &str, all: &[T], names: &[crate::scene::value::Choice], value: &mut T) {
    let choices: Vec<Choice> = names.iter().map(|choice| Choice::new(choice.label)).collect();
    let place = |v: &T| names.iter().position(|c| v.to_value() == Value::Text(c.name.into())).unwrap_or(0);
    let mut chosen = place(value);
    SegmentsRow { head: head(key), choices: &choices, default: 0 }.show(ui, &mut chosen);
    *value = all[chosen];
}

/// A method in a few words.
fn method(scene: &Scene) -> String {
    let (mode, tracking) = (scene.integrator.mode, &scene.tracking);
    let mut words = vec![tracking.free_flight.label(), tracking.transmittance.label(), tracking.majorant.label()];
    if mode.reuses() {
        words.insert(0, mode.label());
    }
    let rest = words[1..].iter().map(|word| format!(" · {}", word.to_lowercase())).collect::<String>();
    let biased = if scene.biases().is_empty() { "" } else { " · biased" };
    format!("{}{rest}{biased}", words[0])
}

/// Time, samples and error on one line.
fn progress(engine: Option<&Engine>, trouble: Option<String>) -> String {
    let picture = engine.filter(|e| e.has_picture());
    let (Some(engine), None) = (picture, &trouble) else {
        return trouble.unwrap_or_else(|| "not yet drawn".into());
    };
    let figures = &engine.figures;
    let samples = Digits::Decimals(0).format(f64::from(figures.samples));
    let mut text = format!("{} s · {samples} spp", Digits::Decimals(1).format(figures.seconds));
    if let Some(error) = figures.error {
        text += &format!(" · error {} %", Digits::Significant(3).format(error * 100.0));
    }
    text
}

/// The pictures that the viewport shows, for a renderer of each side that has one.
struct Pictures<'a> {
    presenter: &'a Presenter,
    a: Option<&'a Renderer>,
    b: Option<&'a Renderer>,
}

impl Pictures<'_> {
    /// Paints the picture of a side over `rect`, where it is inside `clip`.
    fn side(&self, ui: &Ui, side: Option<&Renderer>, rect: Rect, clip: Rect) {
        match side {
            Some(renderer) => {
                let painting = self.presenter.painting(renderer);
                ui.painter_at(clip).add(egui_wgpu::Callback::new_paint_callback(rect, painting));
            }
            None => {
                let ink = Theme::of(ui).text2;
                let words = "Building side B";
                ui.painter_at(clip).text(clip.center(), Align2::CENTER_CENTER, words, Type::Body.font(), ink);
            }
        }
    }
}

impl App {
    /// What is shown while the flipping key is up or down.
    fn lab_view(&self, ui: &Ui) -> View {
        let held = ui.input(|i| i.key_down(FLIP) && !i.modifiers.any()) && ui.memory(|m| m.focused().is_none());
        match (self.lab.controls.view, held) {
            (view, false) => view,
            (View::B, true) => View::A,
            (_, true) => View::B,
        }
    }

    /// Paints the pictures of the lab into `rect`.
    pub(in crate::app) fn paint_lab(&self, ui: &Ui, rect: Rect) {
        let Some(presenter) = &self.presenter else { return };
        let [a, b] = [&self.engine, &self.b]
            .map(|side| side.as_ref().filter(|e| e.has_picture()).and_then(|e| e.renderer.as_ref()));
        let pictures = Pictures { presenter, a, b };
        match self.lab_view(ui) {
            View::A => pictures.side(ui, pictures.a, rect, rect),
            View::B => pictures.side(ui, pictures.b, rect, rect),
            View::Wipe => {
                let x = rect.left() + self.lab.controls.wipe as f32 * rect.width();
                let x = ui.painter().round_to_pixel_center(x);
                pictures.side(ui, pictures.a, rect, rect.with_max_x(x));
                pictures.side(ui, pictures.b, rect, rect.with_min_x(x));
            }
            View::Difference => {
                let theme = Theme::of(ui);
                match (pictures.a, pictures.b) {
                    (Some(a), Some(b)) => {
                        let colours = [theme.canvas, theme.accent, theme.series_b];
                        let painting = presenter.difference(a, b, Style { colours, gain: self.lab.controls.gain });
                        ui.painter().add(egui_wgpu::Callback::new_paint_callback(rect, painting));
                    }
                    _ => pictures.side(ui, pictures.b, rect, rect),
                }
            }
        }
    }

    /// Line, chips and plot over the pictures: `rect` is where they are seen, `area` where there is room.
    pub(in crate::app) fn lab_overlays(&mut self, ui: &mut Ui, rect: Rect, area: Rect) {
        let Some(b) = self.lab.scene_b(&self.scene) else { return };
        let trouble = b.check().err();
        let methods = [method(&self.scene), method(&b)];
        let figures = [progress(self.engine.as_ref(), None), progress(self.b.as_ref(), trouble)];
        let chip = |i: usize| Chip { method: &methods[i], figures: &figures[i] };
        match self.lab_view(ui) {
            View::Wipe => {
                let wipe = Wipe { at: self.lab.controls.wipe as f32, a: chip(0), b: chip(1) };
                if let Some(at) = wipe.show(ui, rect) {
                    self.lab.controls.wipe = f64::from(at);
                }
            }
            View::A => chips(ui, rect, [Some(chip(0)), None]),
            View::B => chips(ui, rect, [None, Some(chip(1))]),
            View::Difference => chips(ui, rect, [Some(chip(0)), Some(chip(1))]),
        }
        if self.shows_plot(area) && self.plot(ui, area, &b) {
            self.lab.controls.plot = false;
        }
    }

    /// Whether the plot lies over the low left of `area`.
    pub(in crate::app) fn shows_plot(&self, area: Rect) -> bool {
        let room = area.width() >= PLOT_ROOM.x && area.height() >= PLOT_ROOM.y;
        self.lab.controls.open && self.lab.controls.plot && room
    }

    fn plot(&self, ui: &mut Ui, area: Rect, b: &Scene) -> bool {
        let sides = [self.engine.as_ref(), self.b.as_ref()];
        let against = self.reference.is_some();
        let axis = self.lab.controls.axis;
        let place = |p: &Point| -> Option<(f64, f64)> {
            let x = if axis == Axis::Seconds { p.seconds } else { f64::from(p.samples) };
            Some((x, if against { p.rel_mse? } else { p.error }))
        };
        let points = sides.map(|side| -> Vec<(f64, f64)> {
            side.iter().flat_map(|e| e.trace.points.iter().filter_map(place)).collect()
        });
        let note = match &self.reference {
            Some(reference) => format!("relMSE against {}", reference.name),
            None => "from its own variance".into(),
        };
        let verdict = self.verdict(&sides, b, axis);
        let card = Convergence {
            title: if against { "Error" } else { "Relative error" },
            note: &note,
            series: points.each_ref().map(Vec::as_slice),
            unit: if axis == Axis::Seconds { "s" } else { "spp" },
            percent: !against,
            slope: if against { (-1.0, "slope −1") } else { (-0.5, "slope −½") },
            verdict: verdict.each_ref().map(String::as_str),
        };
        card.show(ui, area)
    }

    /// What the plot is for, in one sentence: number, words, interval.
    fn verdict(&self, sides: &[Option<&Engine>; 2], b: &Scene, axis: Axis) -> [String; 3] {
        let words = |text: &str| [String::new(), text.to_owned(), String::new()];
        let biased = [!self.scene.biases().is_empty(), !b.biases().is_empty()];
        if let Some(i) = biased.iter().position(|biased| *biased) {
            return words(&format!("{} is biased: its variance is not its error", ["A", "B"][i]));
        }
        let (what, cost): (_, fn(&Point) -> f64) = match axis {
            Axis::Seconds => ("less time", |p| p.seconds),
            Axis::Samples => ("fewer samples", |p| f64::from(p.samples)),
        };
        let estimates = sides.map(|side| side.and_then(|e| e.trace.efficiency(cost)));
        match estimates {
            [Some(a), Some(b)] if a.error.is_finite() && b.error.is_finite() => verdict(a, b, what),
            _ => words("Measuring what an error costs"),
        }
    }

    /// Which side the panel shows, above everything that scrolls.
    pub(in crate::app) fn lab_switch(&mut self, ui: &mut Ui) {
        let mut chosen = self.lab.controls.side as usize;
        ui.add_space(size::SPACE);
        ui.horizontal(|ui| {
            ui.add_space(size::PADDING - size::SPACE);
            segments(ui, "Settings of", &[Choice::new("Side A"), Choice::new("Side B")], &mut chosen);
            ui.spacing_mut().item_spacing.x = size::GAP;
            ui.add_space(size::SPACE);
            let mut press = |text: &str, tip: &str| -> bool {
                let button = egui::Button::new(egui::RichText::new(text).font(Type::SmallValue.font()));
                ui.add(button).on_hover_text(tip).clicked()
            };
            if press("Copy A to B", "B gets A's settings, but for the seed") {
                self.copy_to_b();
            }
            if press("Swap", "A gets B's settings, B gets A's") {
                self.lab.swap(&mut self.scene);
            }
        });
        ui.add_space(size::GAP);
        self.lab.controls.side = Side::ALL[chosen];
    }

    /// The lab's section of the panel.
    pub(in crate::app) fn lab_section(&mut self, ui: &mut Ui) {
        let mut open = self.lab.controls.unfolded;
        let summary = self.lab.controls.view.label().to_lowercase();
        let section = Section { title: "Lab", summary: &summary, changed: false, biased: false, first: true };
        section.show(ui, &mut open, |ui| self.lab_rows(ui));
        self.lab.controls.unfolded = open;
    }

    fn lab_rows(&mut self, ui: &mut Ui) {
        let controls = &mut self.lab.controls;
        choose(ui, "view", View::ALL, View::CHOICES, &mut controls.view);
        if controls.view == View::Difference {
            let row = Controls::ROWS.iter().find(|row| row.key == "gain").expect("a row of the lab's controls");
            let slider = SliderRow {
                unit: row.unit,
                scale: Scale::Log,
                digits: Digits::Significant(3),
                default: Some(Controls::default().gain),
                ..SliderRow::new(head("gain"), row.min..=row.max)
            };
            slider.show(ui, &mut controls.gain);
        }
        choose(ui, "share", Share::ALL, Share::CHOICES, &mut controls.share);
        choose(ui, "axis", Axis::ALL, Axis::CHOICES, &mut controls.axis);
        CheckRow { head: head("plot"), note: "", default: true }.show(ui, &mut controls.plot);
        let tip = Tip { key: "", text: "A picture (EXR, PFM) that errors are measured against.", cost: "" };
        let mut buttons = vec![Choice::new("Choose")];
        if self.reference.is_some() {
            buttons.push(Choice::new("Remove"));
        }
        match (ButtonsRow { head: Head { tip, ..Head::new("Reference") }, buttons: &buttons }).show(ui) {
            Some(0) => self.browse = Some(REFERENCE.into()),
            Some(_) => self.reference = None,
            None => {}
        }
        ui.add_space(size::GAP);
        versus(ui, &contests([self.engine.as_ref(), self.b.as_ref()].map(|side| side.map(Costs::of))));
    }
}

/// "7.9 ×", "less time for A at equal error", "± 0.6".
fn verdict(a: Estimate, b: Estimate, what: &str) -> [String; 3] {
    let gain = a.over(b);
    let (name, gain) = if gain.value >= 1.0 { ("A", gain) } else { ("B", gain.inverse()) };
    let digits = Digits::Significant(3);
    let digits = if gain.error.is_finite() && gain.error > 0.05 * gain.value { Digits::Significant(2) } else { digits };
    // The interval has the places of the number.
    let places = -digits.unit(gain.value).log10().round();
    let interval = Digits::Decimals(places.max(0.0) as usize).format(gain.error);
    [format!("{} ×", digits.format(gain.value)), format!("{what} for {name} at equal error"), format!("± {interval}")]
}

/// What a side's picture cost so far, and bought.
#[derive(Clone, Copy)]
struct Costs {
    error: f64,
    by_time: f64,
    by_lookups: f64,
    lookups: f64,
    null_share: f64,
    steps: f64,
    shadow_rays: f64,
    violations: f64,
    capped: f64,
    nonfinite: f64,
    bytes: f64,
    build: f64,
}

impl Costs {
    fn of(engine: &Engine) -> Costs {
        let (figures, c) = (&engine.figures, &engine.figures.counters);
        let per_path = |n: u64| if figures.paths > 0.0 { n as f64 / figures.paths } else { f64::NAN };
        let efficiency = |cost: fn(&Point) -> f64| engine.trace.efficiency(cost).map_or(f64::NAN, |e| e.value);
        let medium = engine.renderer.as_ref().map(|r| &r.medium);
        let collisions = c.null_collisions + c.real_collisions;
        Costs {
            error: figures.error.map_or(f64::NAN, |e| e * 100.0),
            by_time: efficiency(|p| p.seconds),
            by_lookups: efficiency(|p| p.lookups),
            lookups: per_path(c.lookups),
            null_share: if collisions > 0 { c.null_collisions as f64 / collisions as f64 } else { f64::NAN },
            steps: per_path(c.cell_steps),
            shadow_rays: per_path(c.shadow_rays),
            violations: c.violations as f64,
            capped: c.capped as f64,
            nonfinite: c.nonfinite as f64,
            bytes: medium.map_or(f64::NAN, |m| m.majorant_bytes as f64 / f64::from(1 << 10)),
            build: medium.map_or(f64::NAN, |m| m.majorant_seconds * 1e3),
        }
    }
}

/// The lines of the table; the last two only where something is wrong.
fn contests(sides: [Option<Costs>; 2]) -> Vec<Contest<'static>> {
    type Column = (&'static str, &'static str, fn(&Costs) -> f64);
    const FIGURES: [Column; 9] = [
        ("Error, %", "Relative error by the picture's own variance.", |c| c.error),
        ("Efficiency, 1/s", "1 / (relative variance × seconds): higher is better.", |c| c.by_time),
        ("… by lookups", "1 / (relative variance × density lookups of a pixel): the same on every machine.", |c| {
            c.by_lookups
        }),
        ("Lookups / path", "Density lookups of every ray.", |c| c.lookups),
        ("Null share", "Share of null collisions among those of free flights.", |c| c.null_share),
        ("Cell steps / path", "Segments of the bounds that rays walked.", |c| c.steps),
        ("Shadow rays / path", "Transmittance estimates.", |c| c.shadow_rays),
        ("Bounds, KiB", "Memory of the bounds on the adapter.", |c| c.bytes),
        ("Bounds, ms", "Time that building them took.", |c| c.build),
    ];
    const FAULTS: [Column; 3] = [
        ("Violations", "Lookups of a density above its bound: the picture may be biased.", |c| c.violations),
        ("Cut off", "Segments that took fewer looks than wanted.", |c| c.capped),
        ("Not finite", "Samples that were no number and count as black.", |c| c.nonfinite),
    ];
    let line = |fault: bool| {
        move |&(caption, tip, column): &Column| {
            let values = sides.map(|side| side.as_ref().map_or(f64::NAN, column));
            Contest { caption, tip, values, fault }
        }
    };
    let mut lines: Vec<Contest> = FIGURES.iter().map(line(false)).collect();
    let faults = FAULTS.iter().map(line(true)).enumerate();
    lines.extend(faults.filter(|(i, l)| *i == 0 || l.values.iter().any(|x| *x > 0.0)).map(|(_, l)| l));
    lines
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_verdict_names_the_better_side_with_its_interval() {
        let a = Estimate { value: 80.0, error: 4.0 };
        let b = Estimate { value: 10.0, error: 0.5 };
        assert_eq!(verdict(a, b, "less time"), ["8.0 ×", "less time for A at equal error", "± 0.6"]);
        assert_eq!(verdict(b, a, "less time")[1], "less time for B at equal error");
        let sharp = Estimate { value: 80.0, error: 0.1 };
        let verdict = verdict(sharp, Estimate { value: 10.0, error: 0.01 }, "less time");
        assert_eq!((&*verdict[0], &*verdict[2]), ("8.00 ×", "± 0.01"));
    }

    #[test]
    fn a_biased_method_says_so() {
        let mut scene = Scene::default();
        assert_eq!(method(&scene), "Delta · ratio · grid");
        scene.tracking.transmittance = crate::scene::Transmittance::Jackknife;
        assert!(method(&scene).ends_with("biased"));
        scene.integrator.mode = crate::scene::Mode::Restir;
        assert!(method(&scene).starts_with("Reuse · delta · jackknife"));
    }

    #[test]
    fn faults_are_shown_where_there_are_some() {
        let clean = Costs {
            error: 1.0,
            by_time: 1.0,
            by_lookups: 1.0,
            lookups: 1.0,
            null_share: 0.5,
            steps: 1.0,
            shadow_rays: 1.0,
            violations: 0.0,
            capped: 0.0,
            nonfinite: 0.0,
            bytes: 1.0,
            build: 1.0,
        };
        let captions = |sides| contests(sides).iter().map(|l| l.caption).collect::<Vec<_>>();
        assert_eq!(captions([Some(clean), None]).last(), Some(&"Violations"));
        let bad = Costs { nonfinite: 2.0, ..clean };
        let lines = contests([Some(clean), Some(bad)]);
        let last = lines.last().expect("lines");
        assert!(last.caption == "Not finite" && last.fault && last.values == [0.0, 2.0]);
    }
}
