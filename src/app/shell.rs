//! The window itself: winit's events, the surface, egui's painter, a device that is lost.

use std::path::{Path, PathBuf};
use std::sync::{Arc, mpsc};
use std::time::{Duration, Instant};

use egui_wgpu::ScreenDescriptor;
use egui_winit::accesskit_winit;
use winit::application::ApplicationHandler;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow, EventLoop, EventLoopProxy};
use winit::window::{Fullscreen, Window, WindowId};

use super::actions::Action;
use super::lab::compare::REFERENCE;
use super::picture::Presenter;
use super::prefs::Prefs;
use super::widgets::Kind;
use super::{App, theme};
use crate::error::{Code, Error, Result};
use crate::gpu::device::{Gpu, instance_on};
use crate::scene::Scene;

mod benchmark;
mod watch;

pub use benchmark::Benchmark;
use benchmark::Timings;
use watch::Watch;

/// Smallest window, points.
const SMALLEST: (u32, u32) = (480, 320);
/// Seconds between two looks at work that is not the window's own (a loading thread).
const POLL: Duration = Duration::from_millis(15);

/// A device that is lost so many times within so many seconds is given up.
const MOST_LOSSES: usize = 3;
const LOSS_WINDOW: f64 = 60.0;
/// To try it: seconds after the start, with commas between, at which the device is given away as if it were lost.
const LOSE_DEVICE: &str = "NEPHELE_LOSE_DEVICE";

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
        watch: Watch::shaders(),
        losses: Vec::new(),
        planned_losses: planned_losses(),
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

/// When the device shall be lost, the last first.
fn planned_losses() -> Vec<f64> {
    let list = std::env::var(LOSE_DEVICE).unwrap_or_default();
    let mut seconds: Vec<f64> = list.split(',').filter_map(|s| s.parse().ok()).collect();
    seconds.sort_by(|a, b| b.total_cmp(a));
    seconds
}

/// A file dialog that is open, and the setting that its answer goes to.
struct Dialog {
    key: String,
    answer: mpsc::Receiver<Option<PathBuf>>,
}

/// Everything that exists while the window does.
struct Open {
    window: Arc<Window>,
    canvas: Canvas,
    input: egui_winit::State,
    next: Option<Instant>,
}

/// What is lost with the device.
struct Canvas {
    gpu: Arc<Gpu>,
    surface: wgpu::Surface<'static>,
    config: wgpu::SurfaceConfiguration,
    painter: egui_wgpu::Renderer,
}

impl Canvas {
    fn new(window: &Arc<Window>, present_mode: wgpu::PresentMode) -> Result<Canvas> {
        let instance = instance_on(window.clone());
        let surface = instance.create_surface(window.clone()).map_err(|e| no_display(&e.to_string()))?;
        let gpu = Arc::new(Gpu::open(instance, Some(&surface))?);
        let capabilities = surface.get_capabilities(&gpu.adapter);
        let format =
            egui_wgpu::preferred_framebuffer_format(&capabilities.formats).map_err(|e| no_display(&e.to_string()))?;
        let size = window.inner_size();
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
        let painter = egui_wgpu::Renderer::new(&gpu.device, format, egui_wgpu::RendererOptions::default());
        Ok(Canvas { gpu, surface, config, painter })
    }

    fn presenter(&self) -> Result<Presenter> {
        Presenter::new(&self.gpu, self.config.format)
    }

    fn max_texture_side(&self) -> usize {
        self.gpu.limits.max_texture_dimension_2d as usize
    }

    fn configure(&self) {
        self.surface.configure(&self.gpu.device, &self.config);
    }
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
    watch: Option<Watch>,
    /// When the device was lost, seconds.
    losses: Vec<f64>,
    planned_losses: Vec<f64>,
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
        // egui asks for another frame at each one that the system asks for: the window would never rest.
        if response.repaint && event != WindowEvent::RedrawRequested {
            open.window.request_redraw();
        }
        match event {
            WindowEvent::CloseRequested => self.end(event_loop, None),
            WindowEvent::Resized(size) if size.width > 0 && size.height > 0 => {
                open.canvas.config.width = size.width;
                open.canvas.config.height = size.height;
                open.canvas.configure();
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
                let mut drawn = self.redraw(event_loop);
                if self.open.as_ref().is_some_and(|open| open.canvas.gpu.is_lost()) {
                    drawn = self.recover();
                }
                if let Err(e) = drawn {
                    self.end(event_loop, Some(e));
                }
            }
            _ => {}
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if self.watch.as_mut().is_some_and(Watch::changed) {
            self.reload_shaders();
        }
        let Some(open) = &mut self.open else { return };
        let now = Instant::now();
        if open.next.is_some_and(|at| at <= now) {
            open.window.request_redraw();
            open.next = None;
        }
        let wake = open.next.into_iter().chain(self.watch.as_ref().map(|w| w.next)).min();
        event_loop.set_control_flow(wake.map_or(ControlFlow::Wait, ControlFlow::WaitUntil));
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
        let canvas = Canvas::new(&window, self.present_mode())?;
        let mut input = egui_winit::State::new(
            self.context.clone(),
            egui::ViewportId::ROOT,
            &window,
            Some(window.scale_factor() as f32),
            window.theme(),
            Some(canvas.max_texture_side()),
        );
        input.init_accesskit(event_loop, &window, self.proxy.clone());
        window.set_visible(true);
        self.context.set_zoom_factor(self.app.prefs.zoom);
        self.app.attach(canvas.gpu.clone(), canvas.presenter()?);
        for note in self.notes.drain(..) {
            self.app.report(0.0, &note);
        }
        canvas.gpu.check()?;
        window.request_redraw();
        Ok(Open { window, canvas, input, next: None })
    }

    fn present_mode(&self) -> wgpu::PresentMode {
        if self.benchmark.is_some() { wgpu::PresentMode::AutoNoVsync } else { wgpu::PresentMode::AutoVsync }
    }

    /// Goes on with a new device after the old one was lost, unless that happens again and again.
    fn recover(&mut self) -> Result<()> {
        let Some(Open { window, canvas, mut input, .. }) = self.open.take() else { return Ok(()) };
        let now = self.clock.elapsed().as_secs_f64();
        if given_up(&mut self.losses, now) {
            return Err(Error::new(
                Code::DeviceLost,
                format!("The graphics device was lost {MOST_LOSSES} times within a minute."),
            )
            .why("A driver that fails, work that takes it too long, or a device that is going away.")
            .hint(
                "Update the driver, or draw on another adapter: NEPHELE_ADAPTER names it, `nephele doctor` lists them.",
            ));
        }
        // Two surfaces of one window do not go together.
        drop(canvas);
        let canvas = Canvas::new(&window, self.present_mode())?;
        self.app.presenter = Some(canvas.presenter()?);
        for engine in self.app.engine.iter_mut().chain(&mut self.app.b) {
            engine.recover(canvas.gpu.clone())?;
        }
        input.set_max_texture_side(canvas.max_texture_side());
        // Makes egui draw its glyphs anew, into a new texture.
        self.context.set_font_providers(Vec::new());
        let seconds = self.clock.elapsed().as_secs_f64() - now;
        log::warn!("the graphics device was lost; another one is open after {seconds:.2} s");
        let more = format!("Recovered in {seconds:.1} s on {}; the picture starts anew.", canvas.gpu.info.name);
        self.app.toasts.push(now, Kind::Warn, "The graphics device was reset".to_owned(), more, Vec::new());
        window.request_redraw();
        self.open = Some(Open { window, canvas, input, next: None });
        Ok(())
    }

    /// Reads the shaders again, that which shows the picture included; on an error the old ones stay.
    fn reload_shaders(&mut self) {
        let now = self.clock.elapsed().as_secs_f64();
        let Some(open) = &self.open else { return };
        match open.canvas.presenter() {
            Ok(presenter) => {
                self.app.presenter = Some(presenter);
                self.app.act(Action::ReloadShaders, now);
            }
            Err(e) => self.app.report(now, &e),
        }
        open.window.request_redraw();
    }

    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        self.poll_dialog();
        self.step_benchmark();
        let begin = Instant::now();
        let now = self.clock.elapsed().as_secs_f64();
        let Some(open) = &mut self.open else { return Ok(()) };
        if self.planned_losses.pop_if(|at| *at <= now).is_some() {
            open.canvas.gpu.lose();
        }
        let raw = open.input.take_egui_input(&open.window);
        let traced_before = self.app.traced_seconds();
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
        let Canvas { gpu, painter, .. } = &mut open.canvas;
        if gpu.is_lost() {
            output.textures_delta.clear();
            return Ok(());
        }
        for (id, deltas) in &output.textures_delta.set {
            for delta in deltas {
                painter.update_texture(&gpu.device, &gpu.queue, *id, delta);
            }
        }
        let jobs = self.context.tessellate(output.shapes, output.pixels_per_point);
        let presented = paint(&mut open.canvas, &open.window, &jobs, output.pixels_per_point);
        for id in &output.textures_delta.free {
            open.canvas.painter.free_texture(id);
        }
        output.textures_delta.clear();
        if !presented {
            open.next = Some(Instant::now() + POLL);
            return Ok(());
        }
        open.canvas.gpu.check()?;
        let frame = begin.elapsed().as_secs_f64();
        let traced = (app.traced_seconds() - traced_before).clamp(0.0, frame);
        for engine in app.engine.iter_mut().chain(&mut app.b) {
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

    fn end(&mut self, event_loop: &ActiveEventLoop, error: Option<Error>) {
        if self.benchmark.is_none()
            && self.open.is_some()
            && let Err(e) = self.app.prefs.save(&self.app.scene, &self.app.lab)
        {
            log::warn!("preferences were not saved: {e}");
        }
        self.error = error.or(self.error.take());
        event_loop.exit();
    }
}

/// Paints and presents; whether a frame came on screen.
fn paint(canvas: &mut Canvas, window: &Window, jobs: &[egui::ClippedPrimitive], pixels_per_point: f32) -> bool {
    use wgpu::CurrentSurfaceTexture as Current;
    let (frame, stale) = match canvas.surface.get_current_texture() {
        Current::Success(frame) => (frame, false),
        Current::Suboptimal(frame) => (frame, true),
        Current::Outdated | Current::Lost => {
            canvas.configure();
            return false;
        }
        Current::Timeout | Current::Occluded | Current::Validation => return false,
    };
    // egui's painter panics where it cannot write to the device; asking for the frame is what tells of a loss.
    if canvas.gpu.is_lost() {
        return false;
    }
    let screen = ScreenDescriptor { size_in_pixels: [canvas.config.width, canvas.config.height], pixels_per_point };
    let mut encoder = canvas.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    let extra = canvas.painter.update_buffers(&canvas.gpu.device, &canvas.gpu.queue, &mut encoder, jobs, &screen);
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
        canvas.painter.render(&mut pass.forget_lifetime(), jobs, &screen);
    }
    canvas.gpu.queue.submit(extra.into_iter().chain([encoder.finish()]));
    window.pre_present_notify();
    canvas.gpu.queue.present(frame);
    if stale {
        canvas.configure();
    }
    true
}

/// Books a loss of the device at `now` seconds; whether there were too many in a short time.
fn given_up(losses: &mut Vec<f64>, now: f64) -> bool {
    losses.retain(|at| now - at < LOSS_WINDOW);
    losses.push(now);
    losses.len() >= MOST_LOSSES
}

/// Asks for a file on a thread, so that the window goes on.
fn ask(key: String) -> Dialog {
    let (send, answer) = mpsc::channel();
    let maps = key.starts_with("lights.");
    let references = key == REFERENCE;
    std::thread::spawn(move || {
        let dialog = rfd::FileDialog::new().set_title("Open");
        let dialog = if maps {
            dialog.add_filter("Environment maps", &["exr", "hdr"])
        } else if references {
            dialog.add_filter("Pictures of radiance", &["exr", "pfm"])
        } else {
            dialog.add_filter("Volumes, scenes, pictures", &["vdb", "nvdb", "toml", "png", "exr", "hdr"])
        };
        // Nobody may wait any more.
        let _ = send.send(dialog.pick_file().as_deref().map(Path::to_path_buf));
    });
    Dialog { key, answer }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_device_is_given_up_at_the_third_loss_in_a_minute() {
        let mut losses = Vec::new();
        let answers = [0.0, 30.0, 61.0, 89.0].map(|now| given_up(&mut losses, now));
        assert_eq!(answers, [false, false, false, true], "30, 61 and 89 are within a minute, 0, 30 and 61 are not");
    }
}
