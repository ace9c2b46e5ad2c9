//! The window itself: winit's events, the surface, egui's painter, and the benchmark that orbits.

use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use egui_wgpu::ScreenDescriptor;
use egui_winit::accesskit_winit;
use glam::DVec2;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, Window, WindowId};

use super::engine::Engine;
use super::picture::Presenter;
use super::prefs::Prefs;
use super::{App, orbit, theme};
use crate::error::{Code, Error, Result};
use crate::gpu::device::{Gpu, instance};
use crate::render::params::View;
use crate::scene::Scene;

/// Smallest window, points.
const SMALLEST: (u32, u32) = (480, 320);
/// Seconds between two looks at work that is not the window's own (a loading thread).
const POLL: Duration = Duration::from_millis(15);

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
struct Timings {
    first_picture: Option<f64>,
    start_view: Option<View>,
    frame: u32,
    last: Option<Instant>,
    seconds: Vec<f64>,
    scales: Vec<f64>,
}

/// Events from outside the window.
enum Outside {
    Access(accesskit_winit::Event),
}

impl From<accesskit_winit::Event> for Outside {
    fn from(event: accesskit_winit::Event) -> Outside {
        Outside::Access(event)
    }
}

/// Opens the window on `scene` and runs until it is closed.
pub fn run(scene: Scene, prefs: Prefs, notes: Vec<Error>, benchmark: Option<Benchmark>) -> Result<()> {
    let event_loop = EventLoop::<Outside>::with_user_event().build().map_err(|e| no_display(&e.to_string()))?;
    let mut shell = Shell {
        app: App::new(scene, prefs),
        notes,
        proxy: event_loop.create_proxy(),
        context: egui::Context::default(),
        open: None,
        dialog: None,
        clock: Instant::now(),
        benchmark: benchmark.map(|b| (b, Timings::default())),
        error: None,
    };
    theme::install(&shell.context);
    event_loop.run_app(&mut shell).map_err(|e| no_display(&e.to_string()))?;
    match shell.error {
        Some(e) => Err(e),
        None => Ok(()),
    }
}

fn no_display(why: &str) -> Error {
    Error::new(Code::NoDisplay, "Cannot open a window.")
        .why(format!("{}.", why.trim_end_matches('.')))
        .hint("`nephele render INPUT -o picture.png` needs no window.")
}

/// A file dialog that is open, and the setting that its answer goes to.
struct Dialog {
    key: String,
    answer: mpsc::Receiver<Option<PathBuf>>,
}

/// Everything that exists while the window does.
struct Open {
    window: Arc<Window>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    gpu: Arc<Gpu>,
    input: egui_winit::State,
    painter: egui_wgpu::Renderer,
    next: Option<Instant>,
}

struct Shell {
    app: App,
    notes: Vec<Error>,
    proxy: EventLoopProxy<Outside>,
    context: egui::Context,
    open: Option<Open>,
    dialog: Option<Dialog>,
    clock: Instant,
    benchmark: Option<(Benchmark, Timings)>,
    error: Option<Error>,
}

impl ApplicationHandler<Outside> for Shell {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if self.open.is_some() {
            return;
        }
        match self.create(event_loop) {
            Ok(open) => self.open = Some(open),
            Err(e) => self.end(event_loop, Some(e)),
        }
    }

    fn user_event(&mut self, _: &ActiveEventLoop, event: Outside) {
        let Outside::Access(event) = event;
        let Some(open) = &mut self.open else { return };
        if let accesskit_winit::WindowEvent::ActionRequested(request) = event.window_event {
            open.input.on_accesskit_action_request(request);
        }
        open.window.request_redraw();
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let now = self.clock.elapsed().as_secs_f64();
        let Some(open) = &mut self.open else { return };
        let response = open.input.on_window_event(&open.window, &event);
        if response.repaint {
            open.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => self.end(event_loop, None),
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                open.config.width = size.width;
                open.config.height = size.height;
                open.surface.configure(&open.gpu.device, &open.config);
                open.window.request_redraw();
            }
            WindowEvent::HoveredFile(_) => self.app.set_dropping(true),
            WindowEvent::HoveredFileCancelled => self.app.set_dropping(false),
            WindowEvent::DroppedFile(path) => {
                self.app.set_dropping(false);
                self.app.take_file(&path, "", now);
                open.window.request_redraw();
            }
            WindowEvent::RedrawRequested => {
                if let Err(e) = self.redraw(event_loop) {
                    self.end(event_loop, Some(e));
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        let Some(open) = &self.open else { return };
        match open.next {
            Some(at) if at <= Instant::now() => {
                open.window.request_redraw();
                event_loop.set_control_flow(ControlFlow::Wait);
            }
            Some(at) => event_loop.set_control_flow(ControlFlow::WaitUntil(at)),
            None => event_loop.set_control_flow(ControlFlow::Wait),
        }
    }
}

impl Shell {
    fn create(&mut self, event_loop: &ActiveEventLoop) -> Result<Open> {
        let (width, height) = if self.benchmark.is_some() {
            (self.app.scene.film.width, self.app.scene.film.height)
        } else {
            self.app.prefs.window
        };
        let attributes = Window::default_attributes()
            .with_title("nephele")
            .with_inner_size(winit::dpi::LogicalSize::new(width, height))
            .with_min_inner_size(winit::dpi::LogicalSize::new(SMALLEST.0, SMALLEST.1))
            .with_visible(false);
        let window = event_loop.create_window(attributes).map_err(|e| no_display(&e.to_string()))?;
        let window = Arc::new(window);
        let instance = instance();
        let surface = instance.create_surface(window.clone()).map_err(|e| no_display(&e.to_string()))?;
        let gpu = Arc::new(Gpu::open(instance, Some(&surface))?);
        let capabilities = surface.get_capabilities(&gpu.adapter);
        let format =
            egui_wgpu::preferred_framebuffer_format(&capabilities.formats).map_err(|e| no_display(&e.to_string()))?;
        let size = window.inner_size();
        let present_mode =
            if self.benchmark.is_some() { wgpu::PresentMode::AutoNoVsync } else { wgpu::PresentMode::AutoVsync };
        let config = wgpu::SurfaceConfiguration {
            usage: wgpu::TextureUsages::RENDER_ATTACHMENT,
            format,
            color_space: Default::default(),
            width: size.width.max(1),
            height: size.height.max(1),
            present_mode,
            desired_maximum_frame_latency: 2,
            alpha_mode: wgpu::CompositeAlphaMode::Auto,
            view_formats: Vec::new(),
        };
        surface.configure(&gpu.device, &config);
        let mut input = egui_winit::State::new(
            self.context.clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(gpu.limits.max_texture_dimension_2d as usize),
        );
        input.init_accesskit(event_loop, &window, self.proxy.clone());
        window.set_visible(true);
        self.context.set_zoom_factor(self.app.prefs.zoom);
        let painter = egui_wgpu::Renderer::new(&gpu.device, format, egui_wgpu::RendererOptions::default());
        self.app.attach(gpu.clone(), Presenter::new(&gpu, format)?);
        for note in self.notes.drain(..) {
            self.app.report(0.0, &note);
        }
        gpu.check()?;
        window.request_redraw();
        Ok(Open { window, surface, config, gpu, input, painter, next: None })
    }

    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        self.poll_dialog();
        self.step_benchmark();
        let begin = Instant::now();
        let now = self.clock.elapsed().as_secs_f64();
        let Some(open) = &mut self.open else { return Ok(()) };
        let raw = open.input.take_egui_input(&open.window);
        let traced_before = self.app.engine.as_ref().map_or(0.0, |e| e.figures.seconds);
        let app = &mut self.app;
        let benchmarking = self.benchmark.is_some();
        let mut output = self.context.run_ui(raw, |ui| {
            if benchmarking {
                app.benchmark_frame(ui, now);
            } else {
                app.frame(ui, now);
            }
        });
        open.input.handle_platform_output(&open.window, output.platform_output);
        for (id, deltas) in &output.textures_delta.set {
            for delta in deltas {
                open.painter.update_texture(&open.gpu.device, &open.gpu.queue, *id, delta);
            }
        }
        let jobs = self.context.tessellate(output.shapes, output.pixels_per_point);
        let presented = paint(open, &jobs, output.pixels_per_point);
        for id in &output.textures_delta.free {
            open.painter.free_texture(id);
        }
        output.textures_delta.clear();
        if !presented {
            open.next = Some(Instant::now() + POLL);
            return Ok(());
        }
        open.gpu.check()?;
        let frame = begin.elapsed().as_secs_f64();
        if let Some(engine) = &mut app.engine {
            let traced = (engine.figures.seconds - traced_before).clamp(0.0, frame);
            engine.note_overhead(frame - traced);
        }
        app.prefs.zoom = self.context.zoom_factor();
        let size = open.window.inner_size().to_logical::<u32>(open.window.scale_factor());
        if !app.full_screen && !benchmarking {
            app.prefs.window = (size.width, size.height);
        }
        let full = app.full_screen.then_some(Fullscreen::Borderless(None));
        if full.is_some() != open.window.fullscreen().is_some() {
            open.window.set_fullscreen(full);
        }
        let delay = output.viewport_output.values().map(|v| v.repaint_delay).min().unwrap_or(Duration::MAX);
        let waiting = self.dialog.is_some() || app.engine.as_ref().is_some_and(|e| e.loading().is_some());
        let delay = match (app.animating, waiting) {
            (true, false) => Duration::ZERO,
            (_, true) => delay.min(POLL),
            (false, false) => delay,
        };
        open.next = Instant::now().checked_add(delay);
        if let Some(key) = app.browse.take() {
            self.dialog = Some(ask(key));
        }
        if self.app.quit {
            self.end(event_loop, None);
        }
        self.book_benchmark(event_loop)
    }

    fn poll_dialog(&mut self) {
        let Some(dialog) = &self.dialog else { return };
        match dialog.answer.try_recv() {
            Err(mpsc::TryRecvError::Empty) => {}
            answer => {
                let key = dialog.key.clone();
                self.dialog = None;
                let now = self.clock.elapsed().as_secs_f64();
                match answer {
                    Ok(Some(path)) => self.app.take_file(&path, &key, now),
                    Ok(None) => {}
                    Err(_) => {
                        let error = Error::new(Code::Failed, "There is no file dialog on this desktop.")
                            .hint("Drop a file on the window, or type its path in Volume.");
                        self.app.report(now, &error);
                    }
                }
            }
        }
    }

    /// Places the camera of the next frame of a benchmark.
    fn step_benchmark(&mut self) {
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
    fn book_benchmark(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
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

    fn end(&mut self, event_loop: &ActiveEventLoop, error: Option<Error>) {
        if self.benchmark.is_none()
            && self.open.is_some()
            && let Err(e) = self.app.prefs.save(&self.app.scene)
        {
            log::warn!("preferences were not saved: {e}");
        }
        self.error = error.or(self.error.take());
        event_loop.exit();
    }
}

impl App {
    /// A frame of the benchmark: the picture alone, edge to edge.
    fn benchmark_frame(&mut self, ui: &mut egui::Ui, now: f64) {
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

/// Paints and presents; whether a frame came on screen.
fn paint(open: &mut Open, jobs: &[egui::ClippedPrimitive], pixels_per_point: f32) -> bool {
    use wgpu::CurrentSurfaceTexture as Current;
    let (frame, stale) = match open.surface.get_current_texture() {
        Current::Success(frame) => (frame, false),
        Current::Suboptimal(frame) => (frame, true),
        Current::Outdated | Current::Lost => {
            open.surface.configure(&open.gpu.device, &open.config);
            return false;
        }
        Current::Timeout | Current::Occluded | Current::Validation => return false,
    };
    let screen = ScreenDescriptor { size_in_pixels: [open.config.width, open.config.height], pixels_per_point };
    let mut encoder = open.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let extra = open.painter.update_buffers(&open.gpu.device, &open.gpu.queue, &mut encoder, jobs, &screen);
    {
        let view = frame.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let pass = encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("window"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &view,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations { load: wgpu::LoadOp::Clear(wgpu::Color::BLACK), store: wgpu::StoreOp::Store },
            })],
            ..Default::default()
        });
        open.painter.render(&mut pass.forget_lifetime(), jobs, &screen);
    }
    open.gpu.queue.submit(extra.into_iter().chain([encoder.finish()]));
    open.window.pre_present_notify();
    open.gpu.queue.present(frame);
    if stale {
        open.surface.configure(&open.gpu.device, &open.config);
    }
    true
}

/// Asks for a file on a thread, so that the window goes on.
fn ask(key: String) -> Dialog {
    let (send, answer) = mpsc::channel();
    let maps = key.starts_with("lights.");
    std::thread::spawn(move || {
        let dialog = rfd::FileDialog::new().set_title("Open");
        let dialog = if maps {
            dialog.add_filter("Environment maps", &["exr", "hdr"])
        } else {
            dialog.add_filter("Volumes, scenes, pictures", &["vdb", "nvdb", "toml", "png", "exr", "hdr"])
        };
        // Nobody may wait any more.
        let _ = send.send(dialog.pick_file().as_deref().map(Path::to_path_buf));
    });
    Dialog { key, answer }
}
