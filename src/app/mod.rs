//! The window: state, what a frame shows, what an action does. `shell` owns the window itself.

use std::path::Path;
use std::sync::Arc;

use egui::{PointerButton, Rect, Ui};
use glam::{DVec2, DVec3};

use crate::error::{Code, Error};
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::input;
use crate::render::field::{Field, Shape};
use crate::render::params::{View, fit_distance};
use crate::scene::value::Value;
use crate::scene::{Light, Overlay, Scene, ToneMap};

pub mod actions;
pub mod capture;
pub mod engine;
pub mod orbit;
pub mod panels;
pub mod picture;
pub mod prefs;
pub mod rows;
pub mod shell;
pub mod theme;
pub mod widgets;

use actions::Action;
use engine::Engine;
use panels::{Facts, Wish};
use picture::Presenter;
use prefs::Prefs;
use theme::{Theme, icon, size};
use widgets::{
    Banner, BannerAnswer, Cell, Digits, Help, HelpEntry, Kind, StatusBar, Toasts, Tone, Trust, axis_gizmo, drop_target,
    file_name, panel_scroll, tool_button,
};

/// Steps of undo that are kept.
const UNDO: usize = 200;
/// Bins of the density histogram.
const BINS: usize = 76;
/// Points of the wheel that are one notch.
const NOTCH: f64 = 50.0;
/// Flying crosses the volume in this many seconds.
const FLIGHT: f64 = 4.0;
/// Factors of Shift and Ctrl while flying.
const FAST: f64 = 4.0;
const SLOW: f64 = 0.25;
/// Exposure of one press, EV.
const EXPOSURE_STEP: f64 = 0.5;
/// Seconds that the axes stay after the camera moved.
const GIZMO: f64 = 1.0;
/// Degrees that a drag across the viewport's height turns the sun.
const SUN_TURN: f64 = 180.0;

/// The window's state.
pub struct App {
    /// The scene as the user wants it.
    pub scene: Scene,
    /// What a reset gives: the scene as it was opened.
    pub defaults: Scene,
    /// Remembered state.
    pub prefs: Prefs,
    /// Messages.
    pub toasts: Toasts,
    /// The help overlay.
    pub help: Help,
    /// The renderer's driver, once there is a device.
    pub engine: Option<Engine>,
    /// The program shall end.
    pub quit: bool,
    /// The window shall fill the screen.
    pub full_screen: bool,
    /// Something moves by itself: the next frame must come at once.
    pub animating: bool,
    presenter: Option<Arc<Presenter>>,
    facts: Facts,
    undo: Vec<Scene>,
    redo: Vec<Scene>,
    committed: Scene,
    cameras: Vec<crate::scene::Camera>,
    camera_committed: crate::scene::Camera,
    held: bool,
    step: bool,
    dragging: bool,
    viewport: Rect,
    banner: Option<String>,
    banner_closed: String,
    moved: f64,
    dropping: bool,
    /// A file that the user asked for: the setting that it goes to, empty for anything.
    pub browse: Option<String>,
}

impl App {
    /// The window of `scene`.
    pub fn new(scene: Scene, prefs: Prefs) -> App {
        App {
            defaults: Scene { volume: scene.volume.clone(), ..Scene::default() },
            committed: scene.clone(),
            cameras: Vec::new(),
            camera_committed: scene.camera.clone(),
            scene,
            prefs,
            toasts: Toasts::default(),
            help: Help::default(),
            engine: None,
            quit: false,
            full_screen: false,
            animating: false,
            presenter: None,
            facts: Facts::default(),
            undo: Vec::new(),
            redo: Vec::new(),
            held: false,
            step: false,
            dragging: false,
            viewport: Rect::ZERO,
            banner: None,
            banner_closed: String::new(),
            moved: f64::NEG_INFINITY,
            dropping: false,
            browse: None,
        }
    }

    /// Gives the window its device.
    pub fn attach(&mut self, gpu: Arc<Gpu>, presenter: Presenter) {
        let mut engine = Engine::new(gpu);
        engine.dynamic = self.prefs.dynamic;
        engine.sample_limit = self.prefs.sample_limit;
        if engine.gpu.is_software() {
            self.banner = Some(format!(
                "Drawing on {}: pictures are right, but slow. A graphics driver makes them fast.",
                engine.gpu.info.name
            ));
        }
        self.engine = Some(engine);
        self.presenter = Some(Arc::new(presenter));
    }

    /// Shows an error.
    pub fn report(&mut self, now: f64, error: &Error) {
        let kind = if error.code == Code::Interrupted { Kind::Info } else { Kind::Error };
        let more = [&*error.why, &*error.hint].join(" ");
        self.toasts.push(now, kind, error.what.clone(), more.trim().to_owned(), Vec::new());
    }

    /// Opens a scene, a volume or a picture.
    pub fn open(&mut self, path: &Path, now: f64) {
        match input::open(path) {
            Ok(scene) => {
                self.defaults = Scene { volume: scene.volume.clone(), ..Scene::default() };
                self.scene = scene;
                self.commit();
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                self.toasts.push(now, Kind::Info, format!("Opening {name}"), "", Vec::new());
            }
            Err(e) => self.report(now, &e),
        }
    }

    /// A file that was dropped or chosen; `key` is the setting that it goes to, empty for what it is by itself.
    pub fn take_file(&mut self, path: &Path, key: &str, now: f64) {
        let is_map = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("hdr"));
        if key.is_empty() && !is_map {
            self.open(path, now);
            return;
        }
        let text = path.to_string_lossy().into_owned();
        if key.is_empty() || key.starts_with("lights.") {
            let map = crate::scene::Environment { file: crate::scene::value::FilePath(text), ..Default::default() };
            let place = key.split('.').nth(1).and_then(|i| i.parse::<usize>().ok());
            match place.and_then(|i| self.scene.lights.get_mut(i)) {
                Some(light) => *light = Light::Environment(map),
                None => self.scene.lights = vec![Light::Environment(map)],
            }
        } else if let Err(why) = self.scene.assign(key, &Value::Text(text)) {
            self.report(now, &Error::new(Code::BadKey, why));
        }
        self.commit();
    }

    /// Makes the scene as it stands a step of undo, if it differs from the last one; cameras have a stack of their own.
    fn commit(&mut self) {
        if self.scene.camera != self.camera_committed {
            self.cameras.push(std::mem::replace(&mut self.camera_committed, self.scene.camera.clone()));
            if self.cameras.len() > UNDO {
                self.cameras.remove(0);
            }
        }
        let mut now = self.scene.clone();
        now.camera = self.committed.camera.clone();
        if now != self.committed {
            self.undo.push(std::mem::replace(&mut self.committed, self.scene.clone()));
            if self.undo.len() > UNDO {
                self.undo.remove(0);
            }
            self.redo.clear();
        }
    }

    fn travel(&mut self, back: bool) {
        let (from, to) = if back { (&mut self.undo, &mut self.redo) } else { (&mut self.redo, &mut self.undo) };
        let Some(scene) = from.pop() else { return };
        to.push(std::mem::replace(&mut self.committed, scene.clone()));
        self.scene = Scene { camera: self.scene.camera.clone(), ..scene };
        self.committed = self.scene.clone();
    }

    /// Does what an action says.
    pub fn act(&mut self, action: Action, now: f64) {
        let view = self.view();
        let camera = &mut self.scene.camera;
        let mut look = |direction: DVec3| {
            if let Some((view, _)) = &view {
                orbit::look_from(camera, view, direction);
            }
        };
        match action {
            Action::Front => look(DVec3::Z),
            Action::Back => look(DVec3::NEG_Z),
            Action::Right => look(DVec3::X),
            Action::Left => look(DVec3::NEG_X),
            Action::Top => look(DVec3::Y),
            Action::Bottom => look(DVec3::NEG_Y),
            Action::Frame => {
                if let Some((view, (low, high))) = &view {
                    let aspect = self.aspect();
                    let distance = fit_distance(&self.scene.camera, *low, *high, aspect);
                    orbit::frame(&mut self.scene.camera, view, *low, *high, distance);
                }
            }
            Action::ResetCamera => self.scene.camera = self.defaults.camera.clone(),
            Action::Open => self.browse = Some(String::new()),
            Action::SaveScene => match capture::scene(&self.scene) {
                Ok(path) => self.saved(now, &path, "The scene as TOML"),
                Err(e) => self.report(now, &e),
            },
            Action::Capture => self.capture(now),
            Action::Undo => self.travel(true),
            Action::Redo => self.travel(false),
            Action::CameraBack => {
                if let Some(camera) = self.cameras.pop() {
                    self.scene.camera = camera.clone();
                    self.camera_committed = camera;
                }
            }
            Action::Reload => {
                if let Some(engine) = &mut self.engine {
                    engine.reload();
                }
            }
            Action::Panel => self.prefs.panel = !self.prefs.panel,
            Action::Help => self.help.toggle(),
            Action::FullScreen => self.full_screen = !self.full_screen,
            Action::ExposureUp => self.scene.display.exposure += EXPOSURE_STEP,
            Action::ExposureDown => self.scene.display.exposure -= EXPOSURE_STEP,
            Action::NextToneMap => {
                let all = ToneMap::ALL;
                self.scene.display.tone_map = all[(self.scene.display.tone_map as usize + 1) % all.len()];
            }
            Action::NextOverlay => {
                let all = Overlay::ALL;
                self.scene.display.overlay = all[(self.scene.display.overlay as usize + 1) % all.len()];
            }
            Action::Pause => self.held = !self.held,
            Action::Step => self.step = self.held,
            Action::Restart => {
                if let Some(renderer) = self.engine.as_mut().and_then(|e| e.renderer.as_mut()) {
                    renderer.restart();
                }
            }
            Action::ReloadShaders => {
                let renderer = self.engine.as_mut().and_then(|e| e.renderer.as_mut());
                match renderer.map(|r| r.reload_shaders(Source::standard())) {
                    Some(Ok(())) => {
                        self.toasts.push(now, Kind::Ok, "Shaders are new", "", Vec::new());
                    }
                    Some(Err(e)) => self.report(now, &e),
                    None => {}
                }
            }
            Action::DynamicScale => self.set_dynamic(!self.prefs.dynamic),
            Action::Theme => self.prefs.light = !self.prefs.light,
            Action::Quit => self.quit = true,
        }
    }

    fn set_dynamic(&mut self, on: bool) {
        self.prefs.dynamic = on;
        if let Some(engine) = &mut self.engine {
            engine.dynamic = on;
        }
    }

    fn saved(&mut self, now: f64, path: &Path, more: &str) {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let folder = path.parent().unwrap_or(Path::new("")).display().to_string();
        self.toasts.push(now, Kind::Ok, format!("Saved {name}"), format!("{more}, in {folder}"), Vec::new());
    }

    fn capture(&mut self, now: f64) {
        let Some(engine) = &self.engine else { return };
        let saved = engine.sums().and_then(|sums| match (sums, &engine.renderer) {
            (Some(sums), Some(renderer)) => {
                capture::picture(renderer, &sums, engine.figures.seconds).map(|p| (p, sums.width, sums.height))
            }
            _ => Err(Error::new(Code::Failed, "There is no picture yet.").hint("Wait for the first sample.")),
        });
        match saved {
            Ok((path, w, h)) => self.saved(now, &path, &format!("PNG and EXR, {w} × {h}, settings inside")),
            Err(e) => self.report(now, &e),
        }
    }

    fn aspect(&self) -> f64 {
        f64::from(self.viewport.width().max(1.0)) / f64::from(self.viewport.height().max(1.0))
    }

    fn field(&self) -> Option<&Field> {
        self.engine.as_ref()?.renderer.as_ref().map(|r| &*r.medium.field)
    }

    /// The view with "auto" resolved, and the volume's world box.
    fn view(&self) -> Option<(View, (DVec3, DVec3))> {
        let field = self.field()?;
        Some((View::of(&self.scene.camera, field, self.aspect()), field.world_box()))
    }

    /// Shows one frame and draws for it. `pixels` is the scale from points to pixels, `now` in seconds.
    pub fn frame(&mut self, ui: &mut Ui, now: f64) {
        let ctx = ui.ctx().clone();
        let pixels = ctx.pixels_per_point();
        ctx.set_theme(if self.prefs.light { egui::Theme::Light } else { egui::Theme::Dark });
        for action in actions::pressed(&ctx) {
            self.act(action, now);
        }
        self.dragging = false;
        let theme = Theme::of(ui);
        let bar = |fill| egui::Frame::new().fill(fill).inner_margin(egui::Margin::symmetric(size::PADDING as i8, 0));
        egui::Panel::top("top")
            .exact_size(size::TOP_BAR)
            .frame(bar(theme.bar))
            .show_separator_line(false)
            .show(ui, |ui| self.top_bar(ui, now));
        egui::Panel::bottom("status")
            .exact_size(size::STATUS)
            .frame(egui::Frame::new().fill(theme.bar))
            .show_separator_line(false)
            .show(ui, |ui| self.status(ui));
        if self.prefs.panel {
            let shown = egui::Panel::right("panel")
                .default_size(self.prefs.panel_width)
                .size_range(size::PANEL_RANGE)
                .frame(egui::Frame::new().fill(theme.panel))
                .show(ui, |ui| panel_scroll(ui, |ui| self.panel(ui, now)));
            self.prefs.panel_width = shown.response.rect.width();
        }
        egui::CentralPanel::default().frame(egui::Frame::new().fill(theme.canvas)).show(ui, |ui| {
            self.viewport = ui.available_rect_before_wrap();
            self.viewport_ui(ui, pixels, now);
        });
        self.show_help(&ctx);
        if !self.dragging && !ctx.input(|i| i.pointer.any_down()) {
            self.commit();
        }
    }

    fn top_bar(&mut self, ui: &mut Ui, now: f64) {
        ui.horizontal_centered(|ui| {
            let tool = |ui: &mut Ui, sign, action: Action, on: bool, enabled: bool| {
                tool_button(ui, sign, &actions::shortcut(action), on, enabled).clicked().then_some(action)
            };
            let mut chosen = tool(ui, icon::OPEN, Action::Open, false, true);
            let name = Path::new(&self.scene.volume.file.0).file_name().map(|n| n.to_string_lossy().into_owned());
            let name = name.unwrap_or_else(|| "Cumulus".into());
            file_name(ui, &name, &self.facts.grid, (ui.available_width() * 0.4).max(80.0));
            let tools = [
                (icon::UNDO, Action::Undo, false, !self.undo.is_empty()),
                (icon::REDO, Action::Redo, false, !self.redo.is_empty()),
                (if self.held { icon::PLAY } else { icon::PAUSE }, Action::Pause, self.held, true),
                (icon::CAPTURE, Action::Capture, false, self.engine.as_ref().is_some_and(Engine::has_picture)),
                (icon::HELP, Action::Help, self.help.open, true),
                (icon::PANEL, Action::Panel, self.prefs.panel, true),
            ];
            let width = tools.len() as f32 * size::TOOL_PITCH;
            ui.add_space((ui.available_width() - width).max(0.0));
            ui.spacing_mut().item_spacing.x = size::TOOL_PITCH - size::TOOL;
            for (sign, action, on, enabled) in tools {
                chosen = tool(ui, sign, action, on, enabled).or(chosen);
            }
            if let Some(action) = chosen {
                self.act(action, now);
            }
        });
    }

    fn status(&mut self, ui: &mut Ui) {
        let Some(engine) = &self.engine else { return };
        let f = &engine.figures;
        let three = Digits::Significant(3);
        let samples = Digits::Decimals(0).format(f64::from(f.samples));
        let per_sample = if f.samples > 0 { f.seconds * 1e3 / f64::from(f.samples) } else { f64::NAN };
        let seconds = Digits::Decimals(1).format(f.seconds);
        let ms = three.format(per_sample);
        let paths = three.format(f.paths_per_second / 1e6);
        let scale = if f.scale < 1.0 { format!("{:.2}", f.scale) } else { "1".into() };
        let error = f.error.map_or(String::new(), |e| three.format(e * 100.0));
        let cells = [
            Cell {
                value: &samples,
                unit: "spp",
                widest: "000 000",
                name: "Samples",
                important: true,
                ..Cell::default()
            },
            Cell { value: &seconds, unit: "s", widest: "00 000.0", name: "Time", ..Cell::default() },
            Cell { value: &ms, unit: "ms / sample", widest: "0 000", name: "Time per sample", ..Cell::default() },
            Cell { value: &paths, unit: "M paths/s", widest: "0.000", name: "Speed", ..Cell::default() },
            Cell {
                value: &scale,
                unit: "scale",
                widest: "0.00",
                tone: if f.scale < 1.0 { Tone::Warn } else { Tone::Plain },
                name: "Resolution scale",
                ..Cell::default()
            },
            Cell { value: &error, unit: "% error", widest: "00.0", name: "Relative error", ..Cell::default() },
        ];
        let limit = engine.sample_limit;
        let adapter = format!("{} · {}", engine.gpu.info.name, engine.gpu.backend());
        let bar = StatusBar {
            progress: match (engine.loading(), limit) {
                (Some(_), _) => Some(0.0),
                (None, 0) => None,
                (None, n) => Some((f.samples as f32 / n as f32).min(1.0)),
            },
            cells: &cells,
            trust: if f.scale < 1.0 { Trust::Preview("preview") } else { Trust::Unbiased },
            adapter: &adapter,
            software: engine.gpu.is_software(),
        };
        bar.show(ui);
    }

    fn panel(&mut self, ui: &mut Ui, now: f64) {
        let facts = std::mem::take(&mut self.facts);
        let view = self.view();
        let automatic = |key: &str| -> Option<Value> {
            let vector = |v: DVec3| Value::List(v.to_array().map(Value::Float).to_vec());
            Some(match (key, &view) {
                ("medium.density_scale", _) => Value::Float(facts.density_scale),
                ("tracking.cell", _) => Value::Int(i64::from(facts.cell)),
                ("camera.position", Some((v, _))) => vector(v.position),
                ("camera.target", Some((v, _))) => vector(v.target),
                ("camera.focus_distance", Some((v, _))) => Value::Float(v.focus),
                _ => return None,
            })
        };
        let mut rows = rows::Rows {
            scene: &mut self.scene,
            defaults: &self.defaults,
            automatic: &automatic,
            size: facts.extent.iter().fold(0.0, |a, b| a.max(*b)),
            dragging: false,
            browse: None,
        };
        let preset = panels::preset_of(rows.scene).map_or(String::new(), |i| panels::PRESETS[i].0.to_owned());
        let state = panels::State { dynamic: self.prefs.dynamic, sample_limit: self.prefs.sample_limit, preset };
        let wishes = panels::show(ui, &mut rows, &facts, &mut self.prefs.open, &state);
        self.dragging |= rows.dragging;
        self.facts = facts;
        for wish in wishes {
            match wish {
                Wish::Browse(key) => self.browse = Some(key),
                Wish::Capture => self.act(Action::Capture, now),
                Wish::SaveScene => self.act(Action::SaveScene, now),
                Wish::Dynamic(on) => self.set_dynamic(on),
                Wish::SampleLimit(n) => {
                    self.prefs.sample_limit = n;
                    if let Some(engine) = &mut self.engine {
                        engine.sample_limit = n;
                    }
                }
            }
        }
    }

    fn viewport_ui(&mut self, ui: &mut Ui, pixels: f32, now: f64) {
        let rect = self.viewport;
        let response = ui.interact(rect, egui::Id::unique("viewport"), egui::Sense::click_and_drag());
        response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Canvas, true, "Picture"));
        if response.clicked() || response.drag_started() {
            ui.memory_mut(|m| {
                if let Some(id) = m.focused() {
                    m.surrender_focus(id);
                }
            });
        }
        let before = self.scene.camera.clone();
        self.navigate(ui, &response, now);
        if before != self.scene.camera {
            self.moved = now;
        }
        let size = ((rect.width() * pixels).round() as u32, (rect.height() * pixels).round() as u32);
        self.draw(size, now, false);
        if let (Some(engine), Some(presenter)) = (&self.engine, &self.presenter) {
            match &engine.renderer {
                Some(renderer) if engine.has_picture() => {
                    let painting = presenter.painting(renderer);
                    ui.painter().add(egui_wgpu::Callback::new_paint_callback(rect, painting));
                }
                _ => self.waiting(ui, engine.loading().is_some()),
            }
        }
        self.overlays(ui, now);
    }

    /// Words on the canvas before the first picture.
    fn waiting(&self, ui: &Ui, loading: bool) {
        let words = if loading { "Loading the volume" } else { "Building the shader" };
        let theme = Theme::of(ui);
        ui.painter().text(
            self.viewport.center(),
            egui::Align2::CENTER_CENTER,
            words,
            theme::Type::Body.font(),
            theme.text2,
        );
    }

    fn overlays(&mut self, ui: &mut Ui, now: f64) {
        let rect = self.viewport;
        if now - self.moved < GIZMO {
            if let Some((view, _)) = self.view() {
                let rows = glam::DMat3::from_cols(view.right, view.up, -view.forward).transpose();
                axis_gizmo(ui, rect, rows.as_mat3());
            }
            ui.ctx().request_repaint_after_secs(GIZMO as f32);
        }
        let dark = self.scene.lights.iter().all(is_dark);
        let banner = if dark {
            Some("There is no light: the picture is black. Add one in the Light section.".to_owned())
        } else {
            self.banner.clone()
        };
        if let Some(text) = banner.filter(|t| *t != self.banner_closed) {
            let mut child = ui.new_child(egui::UiBuilder::new().max_rect(rect));
            let shown = Banner { text: &text, brief: text.split('.').next().unwrap_or(""), action: "" };
            if shown.show(&mut child, rect) == Some(BannerAnswer::Close) {
                self.banner_closed = text;
            }
        }
        if self.dropping {
            drop_target(ui, rect);
        }
        self.toasts.show(ui, rect, now);
    }

    /// Notes that a file hovers over the window.
    pub fn set_dropping(&mut self, on: bool) {
        self.dropping = on;
    }

    /// Draws for this frame into a viewport of `size` pixels.
    pub fn draw(&mut self, size: (u32, u32), now: f64, moving: bool) {
        let Some(engine) = &mut self.engine else { return };
        let held = self.held && !self.step;
        self.step = false;
        let outcome = engine.frame(&self.scene, size, now, held, moving);
        self.animating = outcome.busy;
        if let Some(volume) = outcome.restore_volume {
            self.scene.volume = volume;
        }
        if outcome.loaded {
            self.facts = self.gather_static();
        }
        self.refresh_facts();
        for error in &outcome.errors {
            self.report(now, error);
        }
    }

    /// Facts that only a new volume changes.
    fn gather_static(&self) -> Facts {
        let Some(field) = self.field() else { return Facts::default() };
        let (low, high) = field.world_box();
        let mut facts = Facts {
            extent: (high - low).to_array(),
            grids: field.grids.clone(),
            grid: field.grid.clone(),
            density_max: field.max(),
            density_mean: 1.0,
            filled: 1.0,
            warnings: field.warnings.iter().map(|w| w.text.clone()).collect(),
            captures: capture::folder().display().to_string(),
            ..Facts::default()
        };
        if let Shape::Dense(dense) = &field.shape {
            facts.voxels = Some(dense.size.to_array());
            let mut bins = vec![0u64; BINS];
            let (mut sum, mut count) = (0.0, 0u64);
            let scale = BINS as f32 / dense.max().max(f32::MIN_POSITIVE);
            for &d in dense.data.iter().filter(|d| **d > 0.0) {
                bins[((d * scale) as usize).min(BINS - 1)] += 1;
                sum += f64::from(d);
                count += 1;
            }
            facts.histogram = bins;
            facts.density_mean = sum / count.max(1) as f64;
            facts.filled = count as f64 / dense.data.len() as f64;
        }
        facts
    }

    fn refresh_facts(&mut self) {
        let Some(engine) = &self.engine else { return };
        let Some(renderer) = &engine.renderer else { return };
        let (c, f) = (&engine.figures.counters, &mut self.facts);
        f.density_scale = renderer.medium.density_scale(&self.scene);
        f.mean_column = renderer.medium.mean_column;
        f.cell = renderer.medium.cell;
        f.bytes = renderer.medium.volume_bytes + renderer.medium.majorant_bytes;
        let paths = engine.figures.paths;
        if c.lookups > 0 && paths > 0.0 {
            f.lookups_per_path = Some(c.lookups as f64 / paths);
            f.null_ratio = Some(c.null_collisions as f64 / (c.null_collisions + c.real_collisions).max(1) as f64);
            f.bounces = Some(c.real_collisions as f64 / paths);
        }
    }

    fn show_help(&mut self, ctx: &egui::Context) {
        let keys: Vec<Vec<String>> = actions::ACTIONS
            .iter()
            .map(|row| row.keys.first().map(|&k| actions::caps(k)).unwrap_or_default())
            .collect();
        let caps: Vec<Vec<&str>> = keys.iter().map(|k| k.iter().map(String::as_str).collect()).collect();
        let mut entries: Vec<HelpEntry> = actions::ACTIONS
            .iter()
            .zip(&caps)
            .map(|(row, keys)| HelpEntry { group: row.group, keys, text: row.text })
            .collect();
        entries.extend(actions::MOUSE.iter().map(|(keys, text)| HelpEntry { group: "Mouse", keys, text }));
        self.help.show(ctx, &entries, "Bare keys work while no field has the keyboard.");
    }

    fn navigate(&mut self, ui: &Ui, response: &egui::Response, now: f64) {
        let Some((view, (low, high))) = self.view() else { return };
        let aspect = self.aspect();
        let height = f64::from(self.viewport.height().max(1.0));
        let span = (high - low).length();
        let (delta, modifiers, scroll, pointer) = ui.input(|i| {
            (
                i.pointer.delta(),
                i.modifiers,
                i.smooth_scroll_delta().y + (i.zoom_delta() - 1.0) * 500.0,
                i.pointer.hover_pos(),
            )
        });
        let drag = DVec2::new(f64::from(delta.x), f64::from(delta.y)) / height;
        let camera = &mut self.scene.camera;
        if response.double_clicked() || response.clicked_by(PointerButton::Middle) {
            if let Some(depth) = pointer.and_then(|p| self.depth_at(p, &view)) {
                orbit::pivot(&mut self.scene.camera, &view, depth);
            }
            return;
        }
        let flies = ui.input(flight);
        let secondary = response.dragged_by(PointerButton::Secondary);
        if response.dragged_by(PointerButton::Primary) && !modifiers.shift && !modifiers.alt {
            orbit::orbit(camera, &view, drag);
        } else if response.dragged_by(PointerButton::Primary) && modifiers.alt {
            orbit::roll(camera, &view, drag.x * std::f64::consts::PI);
        } else if secondary && modifiers.shift {
            turn_light(&mut self.scene.lights, drag);
        } else if secondary && flies != DVec3::ZERO {
            orbit::look(camera, &view, drag);
        } else if response.dragged() {
            orbit::pan(camera, &view, drag);
        }
        if flies != DVec3::ZERO && ui.memory(|m| m.focused().is_none()) && !modifiers.command {
            let dt = f64::from(ui.input(|i| i.stable_dt)).min(0.1);
            let factor = if modifiers.shift { FAST } else { 1.0 } * if modifiers.ctrl { SLOW } else { 1.0 };
            let view = View::of(&self.scene.camera, self.field().expect("a view needs a field"), aspect);
            orbit::fly(&mut self.scene.camera, &view, flies * (span / FLIGHT * dt * factor));
            ui.ctx().request_repaint();
            self.moved = now;
        }
        if response.hovered() && scroll != 0.0 {
            let at = pointer.unwrap_or(self.viewport.center());
            let place = (at - self.viewport.center()) / (self.viewport.size() * 0.5);
            let cursor = DVec2::new(f64::from(place.x), -f64::from(place.y));
            orbit::dolly(&mut self.scene.camera, &view, f64::from(scroll) / NOTCH, cursor, aspect, span);
        }
    }

    /// Distance along the axis of the point under `at` where half of the light is left: the median free flight.
    fn depth_at(&self, at: egui::Pos2, view: &View) -> Option<f64> {
        let engine = self.engine.as_ref()?;
        let medium = &engine.renderer.as_ref()?.medium;
        let place = (at - self.viewport.center()) / (self.viewport.size() * 0.5);
        let half = (self.scene.camera.fov_y * 0.5).to_radians().tan();
        let ray = view.forward
            + view.right * (f64::from(place.x) * half * self.aspect())
            + view.up * (-f64::from(place.y) * half);
        let depth = medium.field.median_depth(view.position, ray.normalize(), medium.density_scale(&self.scene))?;
        Some(depth * ray.normalize().dot(view.forward))
    }
}

/// Directions of the flying keys that are held: right, up, forward.
fn flight(input: &egui::InputState) -> DVec3 {
    let held = |plus: egui::Key, minus: egui::Key| {
        f64::from(u8::from(input.key_down(plus))) - f64::from(u8::from(input.key_down(minus)))
    };
    DVec3::new(held(egui::Key::D, egui::Key::A), held(egui::Key::E, egui::Key::Q), held(egui::Key::W, egui::Key::S))
}

/// Turns the first sun, sky or map by a drag: sideways its azimuth, up its elevation.
fn turn_light(lights: &mut [Light], drag: DVec2) {
    let (turn, lift) = (drag.x * SUN_TURN, -drag.y * SUN_TURN);
    for light in lights {
        match light {
            Light::Sun(sun) => {
                let d = sun.direction.normalize();
                let azimuth = d.x.atan2(-d.z) + turn.to_radians();
                let elevation = (d.y.asin() + lift.to_radians()).clamp(-1.5, 1.5);
                sun.direction =
                    DVec3::new(elevation.cos() * azimuth.sin(), elevation.sin(), -elevation.cos() * azimuth.cos());
                return;
            }
            Light::Sky(sky) => {
                sky.sun_azimuth = (sky.sun_azimuth + turn + 180.0).rem_euclid(360.0) - 180.0;
                sky.sun_elevation = (sky.sun_elevation + lift).clamp(-90.0, 90.0);
                return;
            }
            Light::Environment(map) => {
                map.rotation = (map.rotation - turn + 180.0).rem_euclid(360.0) - 180.0;
                return;
            }
            Light::Constant(_) | Light::Point(_) => {}
        }
    }
}

/// Whether a light gives nothing.
fn is_dark(light: &Light) -> bool {
    let black = |c: &crate::scene::value::Colour| c.0.iter().all(|&x| x <= 0.0);
    match light {
        Light::Sun(s) => black(&s.irradiance),
        Light::Constant(c) => black(&c.radiance),
        Light::Point(p) => black(&p.intensity),
        Light::Environment(e) => e.scale <= 0.0,
        Light::Sky(s) => s.scale <= 0.0,
    }
}
