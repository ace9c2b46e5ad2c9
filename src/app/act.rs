//! What an action does.

use std::path::Path;

use glam::DVec3;

use super::actions::{self, Action};
use super::widgets::Kind;
use super::{App, capture, orbit};
use crate::error::{Code, Error};
use crate::gpu::shader::Source;
use crate::render::Renderer;
use crate::render::params::fit_distance;
use crate::scene::value::Auto;
use crate::scene::{Overlay, ToneMap};

/// Exposure of one press, EV.
const EXPOSURE_STEP: f64 = 0.5;

impl App {
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
            Action::GoTo(i) => match &self.prefs.cameras[usize::from(i)] {
                Some(stored) => self.scene.camera = stored.clone(),
                None => {
                    let keys = actions::shortcut(Action::Store(i));
                    let (what, more) = (format!("View {} is empty", i + 1), format!("{keys} keeps the view of now."));
                    self.toasts.push(now, Kind::Info, what, more, Vec::new());
                }
            },
            Action::Store(i) => {
                let mut camera = self.scene.camera.clone();
                if let Some((view, _)) = &view {
                    // A bookmark is a place, whatever volume is open when it is used.
                    camera.position = Auto::Is(view.position);
                    camera.target = Auto::Is(view.target);
                }
                self.prefs.cameras[usize::from(i)] = Some(camera);
                let keys = actions::shortcut(Action::GoTo(i));
                let (what, more) = (format!("Kept as view {}", i + 1), format!("{keys} goes back to it."));
                self.toasts.push(now, Kind::Ok, what, more, Vec::new());
            }
            Action::Open => self.browse = Some(String::new()),
            Action::SaveScene => match self.as_shown_side(|app| capture::scene(&app.scene)) {
                Ok(path) => self.saved(now, &path, "The scene as TOML"),
                Err(e) => self.report(now, &e),
            },
            Action::Capture => self.as_shown_side(|app| app.capture(now)),
            Action::Undo => self.history.undo(&mut self.scene, &mut self.lab.own),
            Action::Redo => self.history.redo(&mut self.scene, &mut self.lab.own),
            Action::CameraBack => self.history.camera_back(&mut self.scene),
            Action::Reload => {
                if let Some(engine) = &mut self.engine {
                    engine.reload();
                }
            }
            Action::Panel if self.narrow => self.drawer = !self.drawer,
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
            Action::Inspect => self.inspector.toggle(),
            Action::SelfTest => {
                if let Some(engine) = &self.engine {
                    self.self_test.toggle(&engine.gpu);
                }
            }
            Action::Pause => self.held = !self.held,
            Action::Step => self.step = self.held,
            Action::Restart => {
                for renderer in self.renderers() {
                    renderer.restart();
                }
            }
            Action::DropHistory => {
                let dropped = self.renderers().filter_map(|r| r.drop_history().then_some(())).count();
                if dropped == 0 {
                    let more = "Modes that reuse light paths keep one: see Mode in the section Method.";
                    self.toasts.push(now, Kind::Info, "There is no history to drop", more, Vec::new());
                }
            }
            Action::ReloadShaders => {
                let read = self.renderers().try_for_each(|r| r.reload_shaders(Source::standard()));
                match read {
                    Ok(()) => {
                        self.toasts.push(now, Kind::Ok, "Shaders are new", "", Vec::new());
                    }
                    Err(e) => self.report(now, &e),
                }
            }
            Action::DynamicScale => self.set_dynamic(!self.prefs.dynamic),
            Action::Lab => self.toggle_lab(),
            Action::NextView => self.next_view(),
            Action::Theme => self.prefs.light = !self.prefs.light,
            Action::Quit => self.quit = true,
        }
    }

    /// The renderers of all sides.
    fn renderers(&mut self) -> impl Iterator<Item = &mut Renderer> {
        self.engine.iter_mut().chain(&mut self.b).filter_map(|e| e.renderer.as_mut())
    }

    pub(super) fn set_dynamic(&mut self, on: bool) {
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

    pub(super) fn capture(&mut self, now: f64) {
        let Some(engine) = &mut self.engine else { return };
        self.capturing = engine.has_picture() && !engine.is_whole();
        if self.capturing {
            let more = "What is on screen now is a preview; it is not yet drawn at full resolution.";
            self.toasts.push(now, Kind::Info, "The picture is saved in a moment", more, Vec::new());
            return;
        }
        let sums = engine.sums();
        let saved = sums.and_then(|sums| match (sums, &engine.renderer) {
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
}
