//! The window: its state, and how files come in. What a frame shows is in `frame`, what an action does in `act`, what
//! the mouse does in `navigate`; `shell` owns the window itself.

use std::path::Path;
use std::sync::Arc;

use egui::Rect;
use glam::DVec3;

use crate::error::{Code, Error};
use crate::gpu::device::Gpu;
use crate::input;
use crate::render::field::Field;
use crate::render::params::View;
use crate::scene::value::Value;
use crate::scene::{Light, Scene};

mod act;
pub mod actions;
pub mod capture;
pub mod engine;
pub mod facts;
mod frame;
pub mod history;
pub mod inspect;
pub mod lab;
mod navigate;
pub mod orbit;
pub mod panels;
pub mod picture;
pub mod prefs;
pub mod presets;
pub mod rows;
pub mod self_test;
pub mod shell;
pub mod theme;
pub mod widgets;

use engine::Engine;
use facts::Facts;
use history::History;
use inspect::Inspector;
use lab::compare::REFERENCE;
use lab::{Lab, Own, Reference};
use picture::Presenter;
use prefs::{Prefs, Session};
use self_test::SelfTest;
use widgets::{Help, Kind, Toasts};

/// Seconds between two savings of the session.
const SESSION_EVERY: f64 = 10.0;

/// The window's state.
pub struct App {
    /// The scene as the user wants it.
    pub scene: Scene,
    /// What a reset gives: the scene as it was opened.
    pub defaults: Scene,
    /// Remembered state.
    pub prefs: Prefs,
    /// The lab: side B, and how both are shown.
    pub lab: Lab,
    /// Messages.
    pub toasts: Toasts,
    /// The help overlay.
    pub help: Help,
    /// The pixel inspector.
    pub inspector: Inspector,
    /// The self-test.
    pub self_test: SelfTest,
    /// The renderer's driver, once there is a device.
    pub engine: Option<Engine>,
    /// The program shall end.
    pub quit: bool,
    /// The window shall fill the screen.
    pub full_screen: bool,
    /// Something moves by itself: the next frame must come at once.
    pub animating: bool,
    /// The driver of side B, while the lab is open.
    b: Option<Engine>,
    reference: Option<Arc<Reference>>,
    presenter: Option<Presenter>,
    facts: Facts,
    history: History,
    held: bool,
    step: bool,
    /// The picture shall be saved when it is on screen at full scale.
    capturing: bool,
    dragging: bool,
    /// Where the picture is, and the room that it has.
    viewport: Rect,
    area: Rect,
    /// The banner that was closed, and whether there is one in this frame.
    banner_closed: String,
    banner: bool,
    /// The window is too narrow for a panel beside the picture; then it is a drawer over it.
    narrow: bool,
    drawer: bool,
    /// When the session was saved, and what is in it.
    saved: (f64, Scene, Lab),
    moved: f64,
    dropping: bool,
    /// A file that the user asked for: the setting that it goes to, empty for anything.
    pub browse: Option<String>,
}

impl App {
    /// The window of `scene`.
    pub fn new(scene: Scene, mut prefs: Prefs) -> App {
        // The last session is offered only where nothing else was asked for, and where it has something to offer.
        let worth =
            |session: &Session| scene == Scene::default() && (session.scene != scene || session.lab.controls.open);
        prefs.session = prefs.session.filter(worth);
        App {
            saved: (0.0, scene.clone(), Lab::default()),
            defaults: Scene { volume: scene.volume.clone(), ..Scene::default() },
            history: History::new(&scene),
            scene,
            prefs,
            lab: Lab::default(),
            toasts: Toasts::default(),
            help: Help::default(),
            inspector: Inspector::default(),
            self_test: SelfTest::default(),
            engine: None,
            quit: false,
            full_screen: false,
            animating: false,
            b: None,
            reference: None,
            presenter: None,
            facts: Facts::default(),
            held: false,
            step: false,
            capturing: false,
            dragging: false,
            viewport: Rect::ZERO,
            area: Rect::ZERO,
            banner_closed: String::new(),
            banner: false,
            narrow: false,
            drawer: false,
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
        self.engine = Some(engine);
        self.presenter = Some(presenter);
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
                let own = self.lab.controls.open.then(|| Own::beside(&scene));
                self.take_scene(scene, own);
                let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
                self.toasts.push(now, Kind::Info, format!("Opening {name}"), "", Vec::new());
            }
            Err(e) => self.report(now, &e),
        }
    }

    /// Shows another scene, as a step that can be undone; the last session is offered no longer.
    fn take_scene(&mut self, scene: Scene, own: Option<Own>) {
        self.defaults = Scene { volume: scene.volume.clone(), ..Scene::default() };
        self.scene = scene;
        self.lab.own = own;
        self.history.commit(&self.scene, &self.lab.own);
        self.prefs.session = None;
    }

    /// Brings the scene of the last session back, if there is one.
    pub fn restore_session(&mut self) {
        if let Some(session) = self.prefs.session.take() {
            self.lab.controls = session.lab.controls;
            self.take_scene(session.scene, session.lab.own);
        }
    }

    /// Keeps what a crash would lose: the scene, some seconds after it last changed.
    fn keep_session(&mut self, ctx: &egui::Context, now: f64) {
        if self.engine.is_none() || (&self.scene, &self.lab) == (&self.saved.1, &self.saved.2) {
            return;
        }
        let wait = self.saved.0 + SESSION_EVERY - now;
        if wait > 0.0 {
            ctx.request_repaint_after_secs(wait as f32);
            return;
        }
        self.saved = (now, self.scene.clone(), self.lab.clone());
        if let Err(e) = self.prefs.save_session(&self.scene, &self.lab, true) {
            log::warn!("the session was not saved: {e}");
        }
    }

    /// A file that was dropped or chosen; `key` is the setting that it goes to, empty for what it is by itself.
    pub fn take_file(&mut self, path: &Path, key: &str, now: f64) {
        let ends = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
        let is_map = ends("hdr");
        if key == REFERENCE || key.is_empty() && self.lab.controls.open && (ends("exr") || ends("pfm")) {
            self.take_reference(path, now);
            return;
        }
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
        self.history.commit(&self.scene, &self.lab.own);
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

    /// Notes that a file hovers over the window.
    pub fn set_dropping(&mut self, on: bool) {
        self.dropping = on;
    }

    /// Draws for this frame into a viewport of `size` pixels.
    pub fn draw(&mut self, size: (u32, u32), now: f64, moving: bool) {
        self.share_out();
        let held = self.held && !self.step;
        self.step = false;
        let Some(engine) = &mut self.engine else { return };
        let outcome = engine.frame(&self.scene, size, now, held, moving);
        self.animating = outcome.busy;
        if let Some(volume) = outcome.restore_volume {
            self.scene.volume = volume;
        }
        if outcome.loaded {
            self.facts = self.gather_static();
        }
        self.refresh_facts();
        self.animating |= self.draw_b(size, now, held);
        for error in &outcome.errors {
            self.report(now, error);
        }
        self.as_shown_side(|app| {
            if app.capturing && app.engine.as_ref().is_some_and(Engine::is_whole) {
                app.capture(now);
            }
        });
    }
}
