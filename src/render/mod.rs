//! The renderer: a scene in, a picture out, progressively. It owns no window, no clock and no thread.

use std::collections::HashMap;
use std::sync::{Arc, mpsc};

use wgpu::util::DeviceExt;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, Variant};
use crate::scene::row::Layers;
use crate::scene::{Phase, Scene};

pub mod field;
pub mod film;
mod frames;
pub mod heat;
pub mod lights;
pub mod medium;
pub mod pace;
pub mod params;
pub mod peek;
pub mod pipeline;
pub mod reservoir;
pub mod reuse;
pub mod self_test;
pub mod tracking;

use film::{BLOCK, Film, Sums};
use heat::{Gauge, Needs, Range};
use lights::{DomeBuffers, LightData, Lights};
use medium::Medium;
use params::{Params, Slice};
use pipeline::{Layouts, Pipeline};
use reuse::Reuse;

/// Where a picture stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Samples that every pixel has.
    pub samples: u32,
    /// Samples of each pixel in the pass under way; 0 if there is none.
    pub pass: u32,
}

/// A piece of work to submit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Work {
    /// Samples of each pixel in the next pass, if one has to begin.
    pub samples: u32,
    /// Workgroups (tiles) of this submission at most.
    pub groups: u32,
}

/// The progressive renderer.
pub struct Renderer {
    /// The device.
    pub gpu: Arc<Gpu>,
    /// The scene that is drawn.
    pub scene: Scene,
    /// The medium on the adapter.
    pub medium: Medium,
    /// The film.
    pub film: Film,
    layouts: Arc<Layouts>,
    source: Source,
    pipelines: HashMap<Variant, Arc<Pipeline>>,
    building: Option<Building>,
    light_data: LightData,
    dome: Option<DomeBuffers>,
    lights: Lights,
    params: wgpu::Buffer,
    /// What it holds.
    params_now: Params,
    slice: wgpu::Buffer,
    /// The uniform of the frame before, where paths are reused.
    previous: wgpu::Buffer,
    reuse: Option<Reuse>,
    /// Every pass is a frame of its own, with history and nothing averaged: what is seen while things move.
    moves: bool,
    frame_group: wgpu::BindGroup,
    medium_group: wgpu::BindGroup,
    light_group: wgpu::BindGroup,
    film_group: wgpu::BindGroup,
    size: (u32, u32),
    tiles: u32,
    samples: u32,
    pass_samples: u32,
    next_group: u32,
    /// The last pass, after which some lanes may lack samples.
    behind: Option<Slice>,
    picture: wgpu::Texture,
    gauge: Gauge,
    /// Someone beside the overlay wants to know what each pixel costs.
    counts_cost: bool,
}

/// A pipeline that a worker thread builds.
struct Building {
    variant: Variant,
    result: mpsc::Receiver<Result<Pipeline>>,
}

impl Renderer {
    /// A renderer for `scene` in `medium`, for pictures of `size` pixels, with the extra layers if `aov`.
    pub fn new(
        gpu: Arc<Gpu>,
        source: Source,
        scene: &Scene,
        medium: Medium,
        size: (u32, u32),
        aov: bool,
    ) -> Result<Renderer> {
        let layouts = Arc::new(Layouts::new(&gpu, &source)?);
        let light_data = LightData::load(scene)?;
        let lights = Lights::of(scene, &light_data, &medium.field, medium.unit, None);
        lights.fits(&gpu)?;
        let film = Film::new(&gpu, size.0, size.1, aov)?;
        let params_of = Params::of(scene, &medium, &lights, size.0, size.1);
        let uniform = |label: &str, bytes: &[u8]| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents: bytes,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            })
        };
        let params = uniform("params", bytemuck::bytes_of(&params_of));
        let slice = uniform("slice", bytemuck::bytes_of(&Slice::default()));
        let previous = uniform("previous", bytemuck::bytes_of(&params_of));
        let frame_group = layouts.frame_group(&gpu, &params, &slice, &previous);
        let medium_group = medium.bind_group(&gpu, layouts.medium(medium.filterable(&gpu)));
        let mut dome = None;
        let light_group = lights.bind_group(&gpu, &layouts.lights, &mut dome, &[]);
        let film_group = layouts.film_group(&gpu, &film);
        let mut renderer = Renderer {
            scene: scene.clone(),
            medium,
            film,
            layouts,
            source,
            pipelines: HashMap::new(),
            building: None,
            light_data,
            dome,
            lights,
            params,
            params_now: params_of,
            slice,
            previous,
            reuse: None,
            moves: false,
            frame_group,
            medium_group,
            light_group,
            film_group,
            size,
            tiles: params_of.tiles,
            samples: 0,
            pass_samples: 0,
            next_group: 0,
            behind: None,
            picture: pipeline::picture_texture(&gpu, 1, 1),
            gauge: Gauge::new(&gpu),
            counts_cost: false,
            gpu,
        };
        renderer.match_cost()?;
        renderer.match_reuse()?;
        renderer.gpu.check()?;
        Ok(renderer)
    }

    /// Warnings of the volume and the lights.
    pub fn warnings(&self) -> Vec<crate::error::Warning> {
        self.medium.field.warnings.iter().chain(&self.light_data.warnings).cloned().collect()
    }

    /// The lights in use.
    pub fn lights(&self) -> &Lights {
        &self.lights
    }

    /// Where the picture stands.
    pub fn progress(&self) -> Progress {
        Progress { samples: self.samples, pass: self.pass_samples }
    }

    /// Tiles of the picture.
    pub fn tiles(&self) -> u32 {
        self.tiles
    }

    /// Brings the renderer to `scene` in a picture of `size`; `medium` is new data where the volume changed. Restarts
    /// the picture if anything that it depends on differs. Returns what was made anew.
    pub fn update(&mut self, scene: &Scene, size: (u32, u32), medium: Option<Medium>) -> Result<Layers> {
        let mut changes = scene.changes(&self.scene);
        if changes.lights {
            let data = LightData::load(scene)?;
            self.light_data = data;
        }
        // Targets of the frame before are evaluated by the kernels of this one, which must know its spectrum.
        changes.history |= tracking::spectrum(scene) != tracking::spectrum(&self.scene);
        let old = std::mem::replace(&mut self.scene, scene.clone());
        if let Err(e) = self.rebuild(&mut changes, size, medium) {
            self.scene = old;
            return Err(e);
        }
        Ok(changes)
    }

    fn rebuild(&mut self, changes: &mut Layers, size: (u32, u32), medium: Option<Medium>) -> Result<()> {
        if let Some(medium) = medium {
            self.medium = medium;
            self.medium.update(&self.gpu, &self.scene);
            self.medium_group =
                self.medium.bind_group(&self.gpu, self.layouts.medium(self.medium.filterable(&self.gpu)));
            changes.accumulation = true;
            changes.history = true;
        } else if self.medium.update(&self.gpu, &self.scene) {
            changes.majorants = true;
            self.medium_group =
                self.medium.bind_group(&self.gpu, self.layouts.medium(self.medium.filterable(&self.gpu)));
        }
        if size != self.size {
            self.film = Film::new(&self.gpu, size.0, size.1, self.film.aov)?;
            self.film_group = self.layouts.film_group(&self.gpu, &self.film);
            self.size = size;
            changes.accumulation = true;
        }
        if changes.accumulation {
            let (field, unit) = (&self.medium.field, self.medium.unit);
            let lights = Lights::of(&self.scene, &self.light_data, field, unit, Some(&self.lights));
            lights.fits(&self.gpu)?;
            let old = self.reuse.as_ref().map_or(&[][..], Reuse::old_lights);
            self.light_group = lights.bind_group(&self.gpu, &self.layouts.lights, &mut self.dome, old);
            // The map of the frame before is gone, and targets that it gave cannot be told again.
            changes.history |= !lights.has_map_of(&self.lights);
            self.lights = lights;
            self.restart();
        }
        self.match_cost()?;
        if let Some(reuse) = &mut self.reuse {
            if changes.history {
                reuse.rewind();
            } else if changes.suffixes {
                reuse.edit(true);
            }
        }
        self.match_reuse()?;
        if changes.accumulation || changes.view {
            self.write_params();
        }
        self.gpu.check()
    }

    fn write_params(&mut self) {
        let overlay = self.scene.display.overlay;
        let mut params = Params::of(&self.scene, &self.medium, &self.lights, self.size.0, self.size.1);
        if let (Some(look), Some(range)) = (heat::look(overlay), self.gauge.range(overlay)) {
            range.write(&look, &mut params);
        }
        self.tiles = params.tiles;
        self.params_now = params;
        self.gpu.queue.write_buffer(&self.params, 0, bytemuck::bytes_of(&params));
    }

    /// Counts what each pixel costs from now on, whatever the overlay; or no longer.
    pub fn count_cost(&mut self, on: bool) -> Result<()> {
        self.counts_cost = on;
        self.match_cost()
    }

    /// Counts what each pixel costs where that is wanted. The picture goes on.
    fn match_cost(&mut self) -> Result<()> {
        if self.film.count_cost(&self.gpu, self.counts_cost || self.overlay_needs(Needs::Cost))? {
            self.film_group = self.layouts.film_group(&self.gpu, &self.film);
        }
        Ok(())
    }

    fn overlay_needs(&self, what: Needs) -> bool {
        heat::look(self.scene.display.overlay).is_some_and(|look| look.needs == what)
    }

    /// Clears the film.
    pub fn restart(&mut self) {
        let mut encoder = self.gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.film.clear(&mut encoder);
        self.gpu.queue.submit([encoder.finish()]);
        self.samples = 0;
        self.pass_samples = 0;
        self.next_group = 0;
        self.behind = None;
        if let Some(reuse) = &mut self.reuse {
            reuse.clear_shaded();
        }
    }

    /// The variant of the path tracer that the scene asks for.
    pub fn variant(&self) -> Variant {
        self.variant_counting(self.film.counts_cost)
    }

    fn variant_counting(&self, cost: bool) -> Variant {
        let phase = match self.scene.medium.phase {
            Phase::Isotropic => "phase/isotropic",
            Phase::Rayleigh => "phase/rayleigh",
            Phase::Hg => "phase/hg",
            Phase::TwoLobeHg => "phase/two_lobe_hg",
        };
        let steps = match (self.medium.is_local(), self.lights.map_share > 0.0) {
            (false, _) => TRACK_STEPS_GLOBAL,
            (true, true) => TRACK_STEPS_MAP,
            (true, false) => TRACK_STEPS_LOCAL,
        };
        let mode = self.scene.integrator.mode;
        let has_lens = self.scene.camera.aperture_radius > 0.0 && mode.has_lens();
        let variant = Variant::default()
            .slot("phase", phase)
            .flag("CAMERA_LENS", has_lens)
            .flag("FILM_AOV", self.film.aov)
            .flag("FILM_COST", cost)
            .flag("REUSE", mode.reuses())
            .flag("REUSE_SECOND", reuse::has_second(&self.scene))
            .count("TRACK_STEPS", steps)
            .count("PATH_MOST_ROUNDS", if self.gpu.is_software() { MOST_ROUNDS_SOFTWARE } else { MOST_ROUNDS });
        let variant = reuse::aim(mode).into_iter().fold(variant, |variant, file| variant.slot("aim", file));
        let variant = tracking::variant(&self.scene, self.medium.is_analytic(), variant);
        self.medium.variant(self.lights.variant(variant))
    }

    /// Builds the pipeline for the scene as it stands, its driver's compiler included; blocks.
    pub fn prepare(&mut self) -> Result<()> {
        while !self.poll()? || !self.pipelines.contains_key(&self.variant()) {
            let building = self.building.take().expect("poll began to build what is not there");
            let pipeline = building.result.recv().expect("the worker sends before it ends");
            self.pipelines.insert(building.variant, Arc::new(pipeline?));
        }
        Ok(())
    }

    /// The pipeline that draws the scene as it stands: while one that counts costs is built, the one that does not.
    fn pipeline(&self) -> Option<&Arc<Pipeline>> {
        self.pipelines.get(&self.variant()).or_else(|| self.pipelines.get(&self.variant_counting(false)))
    }

    /// Whether there is a pipeline that draws the scene as it stands; begins to build the one that it asks for on a
    /// thread if that is not there. An error is reported once for each attempt.
    pub fn poll(&mut self) -> Result<bool> {
        if let Some(building) = &self.building {
            match building.result.try_recv() {
                Err(mpsc::TryRecvError::Empty) => {}
                done => {
                    let variant = building.variant.clone();
                    self.building = None;
                    let built = done.unwrap_or_else(|_| Err(Error::new(Code::Shader, "The shader builder stopped.")));
                    self.pipelines.insert(variant, Arc::new(built?));
                }
            }
        }
        let variant = self.variant();
        if self.pipelines.contains_key(&variant) {
            return Ok(true);
        }
        if self.building.is_none() {
            self.building = Some(self.build(variant));
        }
        Ok(self.pipeline().is_some())
    }

    fn build(&self, variant: Variant) -> Building {
        let (send, result) = mpsc::channel();
        let (gpu, source) = (self.gpu.clone(), self.source.clone());
        let layouts = self.layouts.clone();
        let filterable = self.medium.filterable(&self.gpu);
        let groups = self.bind_groups();
        let wanted = variant.clone();
        std::thread::spawn(move || {
            let pipeline = Pipeline::new(&gpu, &source, &layouts, &wanted, filterable);
            if let Ok(p) = &pipeline {
                // Software drivers compile at the first dispatch; one without workgroups is enough.
                dispatch(&gpu, p, &groups, 0);
            }
            // The receiver may be gone: then nobody wants it any more.
            let _ = send.send(pipeline);
        });
        Building { variant, result }
    }

    fn bind_groups(&self) -> [wgpu::BindGroup; 4] {
        [&self.frame_group, &self.medium_group, &self.light_group, &self.film_group].map(wgpu::BindGroup::clone)
    }

    /// Submits a piece of work; the next pass begins when the last is done. Returns the share of a sample of the whole
    /// picture that was submitted.
    pub fn submit(&mut self, work: Work) -> Result<f64> {
        if !self.poll()? {
            self.prepare()?;
        }
        if let (0, Some(cap)) = (self.pass_samples, self.cap()) {
            return self.draw_frame(cap, if self.moves { work.samples.max(1) } else { 1 });
        }
        if self.pass_samples == 0 {
            // A pass never crosses the end of a block, so that sums do not depend on how passes were cut.
            let most = if self.gpu.is_software() { MOST_SAMPLES_SOFTWARE } else { BLOCK };
            self.pass_samples = work.samples.clamp(1, most.min(BLOCK - self.samples % BLOCK));
        }
        let groups = work.groups.clamp(1, self.tiles - self.next_group).min(MAX_GROUPS);
        let slice =
            Slice { first_group: self.next_group, first_sample: self.samples, samples: self.pass_samples, unused: 0 };
        self.gpu.queue.write_buffer(&self.slice, 0, bytemuck::bytes_of(&slice));
        self.behind = Some(Slice { first_group: 0, ..slice });
        let pipeline = self.pipeline().expect("it was polled or prepared");
        dispatch(&self.gpu, pipeline, &self.bind_groups(), groups);
        let done = f64::from(groups) / f64::from(self.tiles) * f64::from(self.pass_samples);
        self.next_group += groups;
        if self.next_group == self.tiles {
            self.next_group = 0;
            self.samples += self.pass_samples;
            self.pass_samples = 0;
            if self.samples.is_multiple_of(BLOCK) {
                self.catch_up()?;
                self.layouts.flush(&self.gpu, &self.film);
            }
        }
        Ok(done)
    }

    /// Lets lanes draw what they could not in their dispatch (shaders/integrate/path.wgsl); pixels that have all their
    /// samples cost next to nothing.
    fn catch_up(&mut self) -> Result<()> {
        if let (Some(slice), true) = (self.behind.take(), self.next_group == 0) {
            let mut behind = 0;
            for _ in 0..CATCH_UPS {
                let now = self.film.count(&self.gpu)?.behind;
                if now == behind {
                    break;
                }
                behind = now;
                let mut slice = slice;
                while slice.first_group < self.tiles {
                    let groups = (self.tiles - slice.first_group).min(MAX_GROUPS);
                    self.gpu.queue.write_buffer(&self.slice, 0, bytemuck::bytes_of(&slice));
                    let pipeline = self.pipeline().expect("it drew the pass");
                    dispatch(&self.gpu, pipeline, &self.bind_groups(), groups);
                    slice.first_group += groups;
                }
            }
        }
        Ok(())
    }

    /// The film's sums so far, and the reservoirs where the overlay shows them; blocks.
    pub fn sums(&mut self) -> Result<Sums> {
        self.catch_up()?;
        let mut sums = self.film.read(&self.gpu)?;
        if let (true, Some(buffer)) = (self.overlay_needs(Needs::Reservoirs), self.reservoirs()) {
            sums.reservoirs = reservoir::read(&self.gpu, buffer)?;
        }
        Ok(sums)
    }

    /// Writes the picture so far to the texture that [`Renderer::picture`] gives, and finds the range of the overlay.
    pub fn resolve(&mut self) {
        let (width, height) = self.size;
        if (self.picture.width(), self.picture.height()) != (width, height) {
            self.picture = pipeline::picture_texture(&self.gpu, width, height);
        }
        let kept = self.reservoirs();
        self.layouts.resolve(&self.gpu, &self.film, kept, &self.params, &self.picture, &self.gauge.sparse);
        if self.gauge.look(&self.gpu, self.scene.display.overlay, self.size) {
            self.write_params();
        }
    }

    /// From where to where the colours of the overlay go, once that is known.
    pub fn overlay_range(&self) -> Option<Range> {
        self.gauge.range(self.scene.display.overlay)
    }

    /// The picture as last resolved: linear radiance, and what the overlay shows in the fourth channel.
    pub fn picture(&self) -> &wgpu::Texture {
        &self.picture
    }

    /// The uniform, for the pass that shows the picture.
    pub fn params(&self) -> &wgpu::Buffer {
        &self.params
    }

    /// Size of the picture that is drawn.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Reads the shaders again (hot reload); on an error the old pipelines stay.
    pub fn reload_shaders(&mut self, source: Source) -> Result<()> {
        let layouts = Arc::new(Layouts::new(&self.gpu, &source)?);
        let filterable = self.medium.filterable(&self.gpu);
        let variant = self.variant();
        let pipeline = Pipeline::new(&self.gpu, &source, &layouts, &variant, filterable)?;
        self.source = source;
        self.pipelines.clear();
        self.building = None;
        self.pipelines.insert(variant, Arc::new(pipeline));
        self.layouts = layouts;
        self.restart();
        Ok(())
    }
}

fn dispatch(gpu: &Gpu, pipeline: &Pipeline, groups: &[wgpu::BindGroup; 4], workgroups: u32) {
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    {
        let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
        pass.set_pipeline(&pipeline.pipeline);
        for (i, group) in (0..).zip(groups) {
            pass.set_bind_group(i, group, &[]);
        }
        pass.dispatch_workgroups(workgroups, 1, 1);
    }
    gpu.queue.submit([encoder.finish()]);
}

/// Tracking steps between looks at events, with tight majorants; measured on Mesa's software driver.
const TRACK_STEPS_LOCAL: u32 = 2;
/// The same where a map lights the scene: its events are long (15 % faster there than with 2).
const TRACK_STEPS_MAP: u32 = 3;
/// The same with one majorant for all, where most steps are null collisions.
const TRACK_STEPS_GLOBAL: u32 = 4;
/// Rounds of loops of one lane in one dispatch, after which it leaves the rest to the next.
const MOST_ROUNDS: u32 = 1 << 18;
/// The same on software adapters: Mesa ends all loops after 65535 rounds; the rest is for the loops of one more segment.
const MOST_ROUNDS_SOFTWARE: u32 = 3 << 14;
/// Samples of a pass there at most, so that few lanes are left behind.
const MOST_SAMPLES_SOFTWARE: u32 = 32;
/// Dispatches in which lanes may catch up at the end of a block of samples; what is missing then is lost, and said.
const CATCH_UPS: u32 = 256;
/// The most workgroups along one axis of a dispatch that every adapter takes.
const MAX_GROUPS: u32 = 65535;
