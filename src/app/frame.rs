//! What a frame of the window shows: bars, panel, picture, overlays.

use std::path::Path;

use egui::{Rect, Ui, pos2};
use glam::DVec3;

use super::actions::{self, Action};
use super::engine::Engine;
use super::panels::{self, Wish};
use super::theme::{self, Icon, Theme, icon, size};
use super::widgets::{
    Banner, BannerAnswer, Cell, Digits, HelpEntry, Legend, StatusBar, Tone, Trust, axis_gizmo, drop_target, file_name,
    panel_scroll, tool_button,
};
use super::{App, rows};
use crate::io::volume_file;
use crate::render::{Renderer, heat};
use crate::scene::value::Value;
use crate::scene::{Bias, Light, Source, Volume};

/// Seconds that the axes stay after the camera moved.
const GIZMO: f64 = 1.0;
/// Toasts keep clear of the drawer where this width is left, points.
const LEAST_FREE: f32 = 400.0;
/// What frames are made of where the mode reuses paths, and what that means.
const REUSED: [&str; 2] = ["reuse", "Frames reuse paths of the frame before and of neighbours."];
const INDEPENDENT: [&str; 2] = ["independent", "Nothing moves: samples are independent, whose mean converges faster."];
/// Words of the banner's button.
const RESTORE: &str = "Restore it";

/// A tool of the top bar: its sign, what it does, whether it is on, whether it can be used.
type Tool = (Icon, Action, bool, bool);

/// Shows a tool; its action when it is clicked.
fn tool(ui: &mut Ui, (sign, action, on, enabled): Tool) -> Option<Action> {
    tool_button(ui, sign, &actions::shortcut(action), on, enabled).clicked().then_some(action)
}

impl App {
    /// Shows one frame and draws for it. `pixels` is the scale from points to pixels, `now` in seconds.
    pub fn frame(&mut self, ui: &mut Ui, now: f64) {
        let ctx = ui.ctx().clone();
        let pixels = ctx.pixels_per_point();
        ctx.set_theme(if self.prefs.light { egui::Theme::Light } else { egui::Theme::Dark });
        for action in actions::pressed(&ctx) {
            self.act(action, now);
        }
        self.dragging = false;
        self.narrow = ctx.content_rect().width() < size::DOCKED_FROM;
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
        if self.prefs.panel && !self.narrow {
            let shown = egui::Panel::right("panel")
                .default_size(self.prefs.panel_width)
                .size_range(size::PANEL_RANGE)
                .frame(egui::Frame::new().fill(theme.panel))
                .show(ui, |ui| self.panel(ui, now));
            self.prefs.panel_width = shown.response.rect.width();
        }
        egui::CentralPanel::default().frame(egui::Frame::new().fill(theme.canvas)).show(ui, |ui| {
            self.area = ui.available_rect_before_wrap();
            self.viewport_ui(ui, pixels, now);
        });
        if let Some(place) = self.drawer_place() {
            self.drawer_ui(&ctx, place, now);
        }
        self.show_help(&ctx);
        if let Some(engine) = &self.engine {
            self.self_test.show(&ctx, &engine.gpu);
        }
        if !self.dragging && !ctx.input(|i| i.pointer.any_down()) {
            self.history.commit(&self.scene, &self.lab.own);
            self.keep_session(&ctx, now);
        }
    }

    /// Where the panel lies over the picture.
    fn drawer_place(&self) -> Option<Rect> {
        let mut room = self.area;
        if self.banner {
            room.min.y += size::BANNER;
        }
        let width = self.prefs.panel_width.min(room.width() - 2.0 * size::PADDING);
        (self.narrow && self.drawer).then(|| Rect::from_min_max(pos2(room.right() - width, room.top()), room.max))
    }

    fn drawer_ui(&mut self, ctx: &egui::Context, place: Rect, now: f64) {
        let theme = Theme::current(ctx);
        let area = egui::Area::new(egui::Id::unique("drawer")).order(egui::Order::Middle).fixed_pos(place.min);
        area.constrain(false).show(ctx, |ui| {
            egui::Frame::new().fill(theme.panel).shadow(theme.card_shadow()).show(ui, |ui| {
                ui.set_min_size(place.size());
                ui.set_max_size(place.size());
                self.panel(ui, now);
            });
        });
    }

    fn top_bar(&mut self, ui: &mut Ui, now: f64) {
        ui.horizontal_centered(|ui| {
            let compact = ui.ctx().content_rect().width() < size::COMPACT_BELOW;
            let mut chosen = tool(ui, (icon::OPEN, Action::Open, false, true));
            let name = volume_name(&self.scene.volume);
            file_name(ui, &name, &self.facts.grid, (ui.available_width() * 0.4).max(80.0));
            let steps = self.steps();
            let panel_shown = if self.narrow { self.drawer } else { self.prefs.panel };
            let tools = [
                (if self.held { icon::PLAY } else { icon::PAUSE }, Action::Pause, self.held, true),
                (icon::COMPARE, Action::Lab, self.lab.controls.open, true),
                (icon::CAPTURE, Action::Capture, false, self.engine.as_ref().is_some_and(Engine::has_picture)),
                (icon::HELP, Action::Help, self.help.open, true),
                (icon::PANEL, Action::Panel, panel_shown, true),
            ];
            let tools = steps.into_iter().filter(|_| !compact).chain(tools);
            let width = tools.clone().count() as f32 * size::TOOL_PITCH;
            ui.add_space((ui.available_width() - width).max(0.0));
            ui.spacing_mut().item_spacing.x = size::TOOL_PITCH - size::TOOL;
            for each in tools {
                chosen = tool(ui, each).or(chosen);
            }
            if let Some(action) = chosen {
                self.act(action, now);
            }
        });
    }

    /// The tools of undo.
    fn steps(&self) -> [Tool; 2] {
        [
            (icon::UNDO, Action::Undo, false, self.history.can_undo()),
            (icon::REDO, Action::Redo, false, self.history.can_redo()),
        ]
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
        let mut cells = vec![
            Cell { value: &samples, unit: "spp", widest: "000 000", name: "Samples", ..Cell::default() },
            Cell { value: &seconds, unit: "s", widest: "00 000.0", name: "Time", rank: 3, ..Cell::default() },
            Cell {
                value: &ms,
                unit: "ms / sample",
                widest: "0 000",
                name: "Time per sample",
                rank: 4,
                ..Cell::default()
            },
            Cell { value: &paths, unit: "M paths/s", widest: "0.000", name: "Speed", rank: 5, ..Cell::default() },
            Cell {
                value: &scale,
                unit: "scale",
                widest: "0.00",
                tone: if f.scale < 1.0 { Tone::Warn } else { Tone::Plain },
                name: "Resolution scale",
                rank: 1,
                ..Cell::default()
            },
            Cell { value: &error, unit: "% error", widest: "00.0", name: "Relative error", rank: 2, ..Cell::default() },
        ];
        if let Some(reuses) = engine.renderer.as_ref().and_then(Renderer::reuses_now) {
            let [value, tip] = if reuses { REUSED } else { INDEPENDENT };
            cells.push(Cell { value, tip, widest: INDEPENDENT[0], name: "Frames", rank: 3, ..Cell::default() });
        }
        let biases = self.scene.biases();
        let brief = Bias::brief(&biases);
        let tip = biases.iter().map(|b| format!("{}: {}", b.label, b.why)).collect::<Vec<_>>().join("\n");
        let limit = engine.sample_limit;
        let adapter = format!("{} · {}", engine.gpu.info.name, engine.gpu.backend());
        let bar = StatusBar {
            progress: match (engine.loading(), limit) {
                (Some(_), _) => Some(0.0),
                (None, 0) => None,
                (None, n) => Some((f.samples as f32 / n as f32).min(1.0)),
            },
            cells: &cells,
            trust: match (f.scale < 1.0, &brief) {
                (true, _) => Trust::Preview("preview"),
                (false, Some(by)) => Trust::Biased { by, tip: &tip },
                (false, None) => Trust::Unbiased,
            },
            adapter: &adapter,
            software: engine.gpu.is_software(),
        };
        bar.show(ui);
    }

    /// The panel: the lab's switch, then what scrolls.
    fn panel(&mut self, ui: &mut Ui, now: f64) {
        let open = self.lab.controls.open;
        if open {
            self.lab_switch(ui);
        }
        panel_scroll(ui, |ui| {
            self.steps_row(ui, now);
            if open {
                self.lab_section(ui);
            }
            for wish in self.as_shown_side(|app| app.sections(ui)) {
                self.grant(wish, now);
            }
        });
    }

    fn steps_row(&mut self, ui: &mut Ui, now: f64) {
        if ui.ctx().content_rect().width() < size::COMPACT_BELOW {
            // The top bar has no room for them.
            let steps = self.steps();
            let chosen = ui.horizontal(|ui| {
                ui.add_space(size::PADDING - size::SPACE);
                steps.into_iter().fold(None, |chosen, step| tool(ui, step).or(chosen))
            });
            if let Some(action) = chosen.inner {
                self.act(action, now);
            }
        }
    }

    /// The sections of the side that is shown; what the user asked for beyond settings.
    fn sections(&mut self, ui: &mut Ui) -> Vec<Wish> {
        self.refresh_facts();
        let facts = std::mem::take(&mut self.facts);
        let view = self.view();
        let automatic = |key: &str| -> Option<Value> {
            let vector = |v: DVec3| Value::List(v.to_array().map(Value::Float).to_vec());
            if !facts.known {
                return None;
            }
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
        let state = panels::State {
            dynamic: self.prefs.dynamic,
            sample_limit: self.prefs.sample_limit,
            bookmarks: self.prefs.cameras.each_ref().map(Option::is_some),
        };
        let wishes = panels::show(ui, &mut rows, &facts, &mut self.prefs.open, &state);
        self.dragging |= rows.dragging;
        self.facts = facts;
        wishes
    }

    fn grant(&mut self, wish: Wish, now: f64) {
        match wish {
            Wish::Browse(key) => self.browse = Some(key),
            Wish::Act(action) => self.act(action, now),
            Wish::Dynamic(on) => self.set_dynamic(on),
            Wish::SampleLimit(n) => {
                self.prefs.sample_limit = n;
                if let Some(engine) = &mut self.engine {
                    engine.sample_limit = n;
                }
            }
        }
    }

    /// Gives the picture its place: all of the room, or that of the reference's shape. Its size in pixels.
    fn place_picture(&mut self, pixels: f32) -> (u32, u32) {
        self.viewport = self.area;
        let Some((width, height)) = self.reference_size() else {
            let side = |points: f32| (points * pixels).round() as u32;
            return (side(self.area.width()), side(self.area.height()));
        };
        let shape = egui::vec2(width as f32, height as f32);
        let scale = (self.area.width() / shape.x).min(self.area.height() / shape.y);
        self.viewport = Rect::from_center_size(self.area.center(), shape * scale);
        (width, height)
    }

    fn viewport_ui(&mut self, ui: &mut Ui, pixels: f32, now: f64) {
        let size = self.place_picture(pixels);
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
        self.draw(size, now, false);
        if let (Some(engine), Some(presenter)) = (&self.engine, &self.presenter) {
            match &engine.renderer {
                Some(_) if engine.has_picture() && self.lab.controls.open => self.paint_lab(ui, rect),
                Some(renderer) if engine.has_picture() => {
                    let painting = presenter.painting(renderer);
                    ui.painter().add(egui_wgpu::Callback::new_paint_callback(rect, painting));
                }
                _ => self.waiting(ui, engine.loading().is_some()),
            }
        }
        self.overlays(ui, now);
        self.look_closer(ui, &response, now);
    }

    /// What the colours of the overlay mean, and the pixel inspector.
    fn look_closer(&mut self, ui: &mut Ui, response: &egui::Response, now: f64) {
        let mut place = self.viewport;
        if self.banner {
            place.min.y += size::BANNER;
        }
        let Some(renderer) = self.engine.as_mut().and_then(|e| e.renderer.as_mut()) else { return };
        if let Some(look) = heat::look(renderer.scene.display.overlay) {
            let range = renderer.overlay_range();
            let legend = Legend {
                name: look.name,
                unit: look.unit,
                range: range.map(|r| [r.low, r.median, r.high].map(|x| x * look.factor)),
                median_at: range.map_or(0.0, |r| r.share(&look, r.median) as f32),
                waits: look.waits(),
                log: look.is_log(),
                names: look.names(),
                colour: &heat::colour,
            };
            legend.show(ui, place);
        }
        let share = |p: egui::Pos2| {
            let at = (p - self.viewport.min) / self.viewport.size();
            (f64::from(at.x), f64::from(at.y))
        };
        let pointer = response.hover_pos().map(share);
        let inspected = self.inspector.show(ui, place, pointer, response.clicked(), renderer, now);
        if let Err(e) = inspected {
            self.report(now, &e);
        }
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
        let rect = self.area;
        let mut seen = self.viewport;
        if self.banner {
            seen.min.y = seen.min.y.max(rect.top() + size::BANNER);
        }
        self.lab_overlays(ui, seen, rect);
        if now - self.moved < GIZMO && !self.shows_plot(rect) {
            if let Some((view, _)) = self.view() {
                let rows = glam::DMat3::from_cols(view.right, view.up, -view.forward).transpose();
                axis_gizmo(ui, rect, rows.as_mat3());
            }
            ui.ctx().request_repaint_after_secs(GIZMO as f32);
        }
        self.banner_ui(ui, rect);
        // Clear of the drawer where there is room beside it.
        let free = match self.drawer_place() {
            Some(drawer) if drawer.left() - rect.left() >= LEAST_FREE => rect.with_max_x(drawer.left()),
            _ => rect,
        };
        if self.dropping {
            drop_target(ui, rect);
        }
        self.toasts.show(ui, free, now);
    }

    /// One lasting condition at a time, the gravest first.
    fn banner_ui(&mut self, ui: &mut Ui, place: Rect) {
        let software = self.engine.as_ref().map(|e| &e.gpu).filter(|gpu| gpu.is_software());
        let (text, brief, action) = if self.scene.lights.iter().all(is_dark) {
            let text = "There is no light: the picture is black. Add one in the Light section.".to_owned();
            (text, "There is no light: the picture is black.", "")
        } else if let Some(session) = &self.prefs.session {
            let how = if session.broken { "stopped without closing" } else { "had another scene" };
            (format!("The last session {how}. It can go on where it was."), "The last session can go on.", RESTORE)
        } else if let Some(gpu) = software {
            let name = &gpu.info.name;
            let text = format!("Drawing on {name}: pictures are right, but slow. A graphics driver makes them fast.");
            (text, "Drawing without a GPU: right, but slow.", "")
        } else {
            (String::new(), "", "")
        };
        self.banner = !text.is_empty() && text != self.banner_closed;
        if !self.banner {
            return;
        }
        let mut child = ui.new_child(egui::UiBuilder::new().max_rect(place));
        match (Banner { text: &text, brief, action }).show(&mut child, place) {
            Some(BannerAnswer::Act) => self.restore_session(),
            Some(BannerAnswer::Close) if action == RESTORE => self.prefs.session = None,
            Some(BannerAnswer::Close) => self.banner_closed = text,
            None => {}
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
        entries.dedup_by_key(|entry| entry.text);
        entries.extend(actions::MOUSE.iter().map(|(keys, text)| HelpEntry { group: "Mouse", keys, text }));
        self.help.show(ctx, &entries, "Bare keys work while no field has the keyboard.");
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

/// The name of the volume for people.
fn volume_name(volume: &Volume) -> String {
    match (volume_file::asset(&volume.file.0), volume.source()) {
        (Ok(Some(asset)), _) => asset.label.into(),
        (_, Source::File(path)) => {
            Path::new(&path).file_name().map_or(path.clone(), |n| n.to_string_lossy().into_owned())
        }
        (_, Source::Cumulus { .. }) => "Cumulus".into(),
        (_, Source::Analytic) => volume.analytic.label().into(),
    }
}
