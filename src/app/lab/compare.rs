//! What the lab does to the window: side B's engine, whose turn it is, the panel of B, the reference.

use std::path::Path;
use std::sync::Arc;

use super::{Lab, Own, Reference, Turn, View, turns};
use crate::app::App;
use crate::app::engine::Engine;
use crate::app::widgets::Kind;
use crate::io::picture;
use crate::scene::Scene;

/// The key under which the window asks for a reference.
pub const REFERENCE: &str = "lab.reference";

impl Lab {
    /// Whether the panel shows B.
    pub fn is_b(&self) -> bool {
        self.controls.open && self.controls.side == super::Side::B
    }

    /// B's scene beside `a`, while the lab is open.
    pub fn scene_b(&self, a: &Scene) -> Option<Scene> {
        let own = self.own.as_ref().filter(|_| self.controls.open)?;
        Some(own.beside_shared(a))
    }
}

impl App {
    /// Opens or closes the lab.
    pub(in crate::app) fn toggle_lab(&mut self) {
        self.lab.controls.open ^= true;
        self.lab.own.get_or_insert_with(|| Own::beside(&self.scene));
    }

    /// The next of what the viewport can show.
    pub(in crate::app) fn next_view(&mut self) {
        let all = View::ALL;
        self.lab.controls.view = all[(self.lab.controls.view as usize + 1) % all.len()];
    }

    /// Gives A's settings to B, but for the seed.
    pub(super) fn copy_to_b(&mut self) {
        self.lab.own = Some(Own::copy(&self.scene));
    }

    /// Does something as if B were the only side: its scene and engine stand in for A's. What is shared goes to A.
    pub(in crate::app) fn as_shown_side<R>(&mut self, work: impl FnOnce(&mut App) -> R) -> R {
        let is_b = self.lab.is_b();
        let Some(mut own) = self.lab.own.take_if(|_| is_b) else { return work(self) };
        let b = own.beside_shared(&self.scene);
        let a = std::mem::replace(&mut self.scene, b);
        std::mem::swap(&mut self.engine, &mut self.b);
        let result = work(self);
        std::mem::swap(&mut self.engine, &mut self.b);
        let b = std::mem::replace(&mut self.scene, a);
        own.take_apart(b, &mut self.scene);
        self.lab.own = Some(own);
        result
    }

    /// Makes or drops B's engine, and says who draws in this frame.
    pub(in crate::app) fn share_out(&mut self) {
        let Some(a) = &mut self.engine else { return };
        let fits = self.lab.scene_b(&self.scene).is_some_and(|b| b.check().is_ok());
        (a.turn, a.traced) = (Turn::ALL, self.lab.controls.open);
        a.reference = self.reference.clone().filter(|_| self.lab.controls.open);
        if !self.lab.controls.open {
            self.b = None;
            return;
        }
        let b = self.b.get_or_insert_with(|| Engine::new(a.gpu.clone()));
        b.follow(a);
        (b.dynamic, b.sample_limit, b.traced, b.reference) = (a.dynamic, a.sample_limit, true, a.reference.clone());
        if fits && a.has_picture() {
            [a.turn, b.turn] = turns(self.lab.controls.share, a.standing(), b.standing());
        }
    }

    /// Draws B for this frame, after A; whether more is to come.
    pub(in crate::app) fn draw_b(&mut self, size: (u32, u32), now: f64, held: bool) -> bool {
        let (Some(a), Some(b), Some(scene)) = (&self.engine, &mut self.b, self.lab.scene_b(&self.scene)) else {
            return false;
        };
        // B shows the volume that A shows, and begins when A has its first picture.
        let Some(volume) = a.volume().cloned().filter(|_| a.has_picture()) else { return false };
        let scene = Scene { volume, ..scene };
        if scene.check().is_err() {
            return false;
        }
        let outcome = b.frame(&scene, size, now, held, false);
        for error in &outcome.errors {
            self.report(now, error);
        }
        outcome.busy
    }

    /// Seconds of drawing of both sides' pictures.
    pub(in crate::app) fn traced_seconds(&self) -> f64 {
        self.engine.iter().chain(&self.b).map(|engine| engine.figures.seconds).sum()
    }

    /// Measures errors against the picture at `path` from now on; the picture takes its size, and its camera if it has one.
    pub(in crate::app) fn take_reference(&mut self, path: &Path, now: f64) {
        match Reference::load(path) {
            Ok(reference) => {
                let scene = picture::read_scene(path).ok().flatten();
                if let Some(scene) = scene.and_then(|text| Scene::parse(&text, &reference.name, Path::new("")).ok()) {
                    self.scene.camera = scene.camera;
                }
                let (what, (w, h)) = (format!("Errors are measured against {}", reference.name), reference.size);
                let more = format!("The picture takes its size, {w} × {h}, and its camera.");
                self.toasts.push(now, Kind::Info, what, more, Vec::new());
                self.reference = Some(Arc::new(reference));
            }
            Err(e) => self.report(now, &e),
        }
    }

    /// The size of the reference, while there is one in use.
    pub(in crate::app) fn reference_size(&self) -> Option<(u32, u32)> {
        self.reference.as_ref().filter(|_| self.lab.controls.open).map(|r| r.size)
    }
}
