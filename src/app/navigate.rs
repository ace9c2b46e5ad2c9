//! What mouse and keys do to camera and lights over the picture.

use egui::{PointerButton, Ui};
use glam::{DVec2, DVec3};

use super::{App, orbit};
use crate::render::params::View;
use crate::scene::Light;

/// Points of the wheel that are one notch.
const NOTCH: f64 = 50.0;
/// Flying crosses the volume in this many seconds.
const FLIGHT: f64 = 4.0;
/// Factors of Shift and Ctrl while flying.
const FAST: f64 = 4.0;
const SLOW: f64 = 0.25;
/// Degrees that a drag across the viewport's height turns the sun.
const SUN_TURN: f64 = 180.0;

impl App {
    pub(super) fn navigate(&mut self, ui: &Ui, response: &egui::Response, now: f64) {
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
