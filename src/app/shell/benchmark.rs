//! The benchmark that orbits: one turn in so many frames, timed.

use std::path::PathBuf;
use std::time::Instant;

use glam::DVec2;
use winit::event_loop::ActiveEventLoop;

use super::Shell;
use crate::app::engine::Engine;
use crate::app::{App, orbit};
use crate::error::Result;
use crate::render::params::View;
use crate::scene::Scene;

/// An orbit of so many frames, timed.
#[derive(Clone, Debug)]
pub struct Benchmark {
    /// Frames of the orbit.
    pub frames: u32,
    /// Where the figures go, beside standard output.
    pub json: Option<PathBuf>,
    /// When the program began.
    pub start: Instant,
}

/// Figures of a benchmark.
#[derive(Debug, Default)]
pub(super) struct Timings {
    first_picture: Option<f64>,
    start_view: Option<View>,
    frame: u32,
    last: Option<Instant>,
    seconds: Vec<f64>,
    scales: Vec<f64>,
}

impl Shell {
    /// Places the camera of the next frame of a benchmark.
    pub(super) fn step_benchmark(&mut self) {
        let Some((benchmark, timings)) = &mut self.benchmark else { return };
        let Some(renderer) = self.app.engine.as_ref().and_then(|e| e.renderer.as_ref()) else { return };
        let aspect = f64::from(self.app.scene.film.width) / f64::from(self.app.scene.film.height);
        let field = &renderer.medium.field;
        let start = *timings.start_view.get_or_insert_with(|| View::of(&self.app.scene.camera, field, aspect));
        if timings.first_picture.is_some() {
            // A whole turn in radians is two viewport heights of drag.
            let share = f64::from(timings.frame) / f64::from(benchmark.frames);
            orbit::orbit(&mut self.app.scene.camera, &start, DVec2::new(2.0 * share, 0.0));
        }
    }

    /// Books a presented frame of a benchmark; ends after the last.
    pub(super) fn book_benchmark(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some((benchmark, timings)) = &mut self.benchmark else { return Ok(()) };
        let Some(engine) = self.app.engine.as_ref().filter(|e| e.has_picture()) else { return Ok(()) };
        let now = Instant::now();
        match timings.last {
            None => timings.first_picture = Some(benchmark.start.elapsed().as_secs_f64()),
            Some(last) => {
                timings.seconds.push((now - last).as_secs_f64());
                timings.scales.push(engine.figures.scale);
                timings.frame += 1;
            }
        }
        timings.last = Some(now);
        if timings.frame < benchmark.frames {
            if let Some(open) = &self.open {
                open.window.request_redraw();
            }
            return Ok(());
        }
        let figures = report(benchmark, timings, engine, &self.app.scene);
        // tidy: allow(print) the figures are the result of `view --benchmark`
        println!("{figures:#}");
        let written = match &benchmark.json {
            Some(path) => crate::io::picture::write_whole(path, |f| {
                std::io::Write::write_all(f, format!("{figures:#}\n").as_bytes())
            }),
            None => Ok(()),
        };
        self.end(event_loop, written.err());
        Ok(())
    }
}

impl App {
    /// A frame of the benchmark: the picture alone, edge to edge.
    pub(super) fn benchmark_frame(&mut self, ui: &mut egui::Ui, now: f64) {
        egui::CentralPanel::default().frame(egui::Frame::new()).show(ui, |ui| {
            let rect = ui.available_rect_before_wrap();
            let pixels = ui.ctx().pixels_per_point();
            let size = ((rect.width() * pixels).round() as u32, (rect.height() * pixels).round() as u32);
            self.draw(size, now, true);
            if let (Some(engine), Some(presenter)) = (&self.engine, &self.presenter)
                && let Some(renderer) = engine.renderer.as_ref().filter(|_| engine.has_picture())
            {
                let painting = presenter.painting(renderer);
                ui.painter().add(egui_wgpu::Callback::new_paint_callback(rect, painting));
            }
        });
        self.animating = true;
    }
}

fn report(benchmark: &Benchmark, timings: &Timings, engine: &Engine, scene: &Scene) -> serde_json::Value {
    let mut sorted = timings.seconds.clone();
    sorted.sort_by(f64::total_cmp);
    let at = |share: f64| sorted[((sorted.len() - 1) as f64 * share).round() as usize] * 1e3;
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    serde_json::json!({
        "benchmark": "orbit",
        "frames": benchmark.frames,
        "mean_ms": mean(&timings.seconds) * 1e3,
        "p50_ms": at(0.5),
        "p95_ms": at(0.95),
        "p99_ms": at(0.99),
        "first_picture_seconds": timings.first_picture,
        "resolution_scale": {
            "min": timings.scales.iter().copied().fold(f64::INFINITY, f64::min),
            "mean": mean(&timings.scales),
        },
        "samples_per_pixel": 1,
        "width": scene.film.width,
        "height": scene.film.height,
        "mode": scene.integrator.mode.name(),
        "adapter": engine.gpu.info.name,
        "backend": engine.gpu.backend(),
    })
}
