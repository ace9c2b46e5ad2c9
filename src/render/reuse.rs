//! Reuse of light paths over frames and neighbours: what each pixel keeps, and the passes of a frame (shaders/reuse).

use std::collections::BTreeMap;
use std::time::Instant;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::layout::gpu_struct;
use crate::gpu::readback;
use crate::gpu::shader::{Source, Variant};
use crate::scene::value::Limit;
use crate::scene::{History, Mode, Scene};

use super::film::Film;
use super::lights::GpuLight;
use super::params::{Params, TILE};
use super::pipeline::{self, Layouts};

gpu_struct! {
    /// Twin of `Frame` in shaders/reuse/frame.wgsl.
    Frame {
        frame: u32,
        candidates: u32,
        cap: f32,
        neighbours: u32,
        reach: u32,
        history: u32,
        still: u32,
        reconnect: f32,
        walks: u32,
        permute: u32,
        old_lights: u32,
        suffixes: u32,
    }
}

/// Words of 16 bytes that each half of a reservoir takes.
const HALF: u64 = 2 * 16;
/// Bytes of a buffer that nothing is kept in.
const EMPTY: u64 = 32;
/// Bits of `Frame::history`: paths all of whose factors are known, and those with light that is frozen in them.
const KNOWN: u32 = 1;
const FROZEN: u32 = 2;
/// Most vertices of a path that are kept; light of more scatterings is frozen. Twin of `RESERVOIR_VERTICES`.
const VERTICES: u32 = 3;
/// Dispatches in which long paths may end.
const CATCH_UPS: u32 = 256;

/// A pass of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Pass {
    /// Candidates of one scattering, distances of second vertices.
    Candidates,
    /// Candidates of more scatterings.
    Suffix,
    /// The frame before.
    Temporal,
    /// Each pixel's path at its neighbours.
    Pair,
    /// Neighbours' paths.
    Merge,
    /// True transmittances, and the film.
    Shade,
    /// The method of 2021: candidates.
    Initial,
    /// The frame before.
    Reproject,
    /// Neighbours' paths.
    Gather,
    /// True transmittances, and the film.
    Finish,
}

/// What a pass binds in group 3; the numbers are those of the shaders.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Bound {
    FilmSum = 0,
    FilmSquare = 1,
    Counters = 3,
    Paused = 5,
    Near = 8,
    Far = 9,
    OtherNear = 10,
    OtherFar = 11,
    Pairs = 12,
    Frame = 13,
    Onsets = 14,
}

impl Pass {
    /// Those of mode "restir", in order.
    pub const OWN: [Pass; 6] = [Pass::Candidates, Pass::Suffix, Pass::Temporal, Pass::Pair, Pass::Merge, Pass::Shade];
    /// Those of mode "restir-2021", in order.
    pub const PUBLISHED: [Pass; 5] = [Pass::Initial, Pass::Suffix, Pass::Reproject, Pass::Gather, Pass::Finish];
    /// Most passes of a frame.
    const MOST: usize = Pass::OWN.len();

    /// Its kernel's file.
    fn file(self) -> String {
        let folder = if Pass::OWN.contains(&self) { "reuse" } else { "reuse_2021" };
        format!("{folder}/{}", self.name())
    }

    /// Its name in statistics, which is that of its kernel's file and entry point.
    pub fn name(self) -> &'static str {
        match self {
            Pass::Candidates => "candidates",
            Pass::Suffix => "suffix",
            Pass::Temporal => "temporal",
            Pass::Pair => "pair",
            Pass::Merge => "merge",
            Pass::Shade => "shade",
            Pass::Initial => "initial",
            Pass::Reproject => "reproject",
            Pass::Gather => "gather",
            Pass::Finish => "finish",
        }
    }

    fn bound(self) -> &'static [Bound] {
        use Bound::{Counters, Far, FilmSquare, FilmSum, Frame, Near, Onsets, OtherFar, OtherNear, Pairs, Paused};
        match self {
            Pass::Candidates | Pass::Initial => &[Near, Far, Frame, Onsets],
            Pass::Suffix => &[Counters, Paused, Near, Far, Frame, Onsets],
            Pass::Temporal | Pass::Reproject | Pass::Gather => &[Near, Far, OtherNear, OtherFar, Frame],
            Pass::Pair => &[Near, Far, Pairs, Frame],
            Pass::Merge => &[Near, Far, OtherNear, OtherFar, Pairs, Frame],
            Pass::Shade => &[FilmSum, FilmSquare, Counters, Near, Far, Pairs, Frame],
            Pass::Finish => &[FilmSum, FilmSquare, Counters, Near, Far],
        }
    }

    fn layout(self, gpu: &Gpu) -> wgpu::BindGroupLayout {
        let entries: Vec<_> = self
            .bound()
            .iter()
            .map(|&bound| {
                let binding = bound as u32;
                match bound {
                    Bound::Frame => pipeline::entry(binding, pipeline::buffer(wgpu::BufferBindingType::Uniform)),
                    _ => pipeline::writable(binding),
                }
            })
            .collect();
        gpu.device
            .create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(self.name()), entries: &entries })
    }
}

/// The files that fill slot `aim`: what a path is worth.
const AIM: &str = "aim/sighted";
const AIM_PUBLISHED: &str = "aim/marched";

/// The file that fills slot `aim` in a mode that reuses paths.
pub fn aim(mode: Mode) -> Option<&'static str> {
    match mode {
        Mode::Path => None,
        Mode::Restir => Some(AIM),
        Mode::Restir2021 => Some(AIM_PUBLISHED),
    }
}

/// The kernels of all passes for one variant.
pub struct Kernels {
    passes: Vec<(Pass, wgpu::ComputePipeline, wgpu::BindGroupLayout)>,
}

impl Kernels {
    /// Builds them.
    pub fn new(gpu: &Gpu, source: &Source, layouts: &Layouts, variant: &Variant, filterable: bool) -> Result<Kernels> {
        let second = variant.constants.iter().any(|(name, value)| *name == "REUSE_SECOND" && value == "true");
        let published = variant.slots.iter().any(|(_, file)| *file == AIM_PUBLISHED);
        let all = if published { &Pass::PUBLISHED[..] } else { &Pass::OWN[..] };
        let mut passes = Vec::new();
        for &pass in all.iter().filter(|p| second || **p != Pass::Suffix) {
            let group = pass.layout(gpu);
            let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
                label: Some(pass.name()),
                bind_group_layouts: &[
                    Some(&layouts.frame),
                    Some(layouts.medium(filterable)),
                    Some(&layouts.lights),
                    Some(&group),
                ],
                immediate_size: 0,
            });
            let (file, entry) = (pass.file(), format!("{}_main", pass.name()));
            passes.push((pass, pipeline::compute(gpu, source, &file, &entry, variant, Some(&layout))?, group));
        }
        Ok(Kernels { passes })
    }
}

/// What a frame was drawn of, which the next one has to know.
#[derive(Clone, Debug, PartialEq)]
struct Drawn {
    params: Params,
    lights: Vec<GpuLight>,
    scene: Scene,
}

impl Drawn {
    /// Whether `scene` is the same but for the camera and the way it is shown.
    fn is_of(&self, scene: &Scene) -> bool {
        let Scene { camera, display, .. } = scene.clone();
        *scene == Scene { camera, display, ..self.scene.clone() }
    }
}

/// Reservoirs of all pixels, and how frames follow one another.
pub struct Reuse {
    size: (u32, u32),
    mode: Mode,
    second: bool,
    near: [wgpu::Buffer; 2],
    far: [wgpu::Buffer; 2],
    pairs: wgpu::Buffer,
    /// Distances at which second vertices are begun.
    onsets: wgpu::Buffer,
    frame: wgpu::Buffer,
    /// The uniform of the frame before.
    previous: wgpu::Buffer,
    /// Which of the buffers the next frame writes first; the other holds the history.
    turn: usize,
    number: u32,
    /// Which of the buffers the last frame of the picture shaded.
    shaded: Option<usize>,
    drawn: Option<Drawn>,
    keeps: u32,
    edited: bool,
    queries: Option<(wgpu::QuerySet, wgpu::Buffer)>,
    /// Whether passes are timed, which waits for each frame.
    pub timed: bool,
    /// Seconds that each pass took while they were timed.
    pub seconds: BTreeMap<&'static str, f64>,
}

/// What a frame is drawn of, and where to.
pub struct Picture<'a> {
    /// The film.
    pub film: &'a Film,
    /// The scene.
    pub scene: &'a Scene,
    /// What its uniform holds.
    pub params: &'a Params,
    /// Its lights.
    pub lights: &'a [GpuLight],
}

/// Whether a scene's paths may scatter more often than that.
fn exceeds(scene: &Scene, bounces: u32) -> bool {
    !matches!(scene.integrator.max_bounces, Limit::AtMost(most) if most <= bounces)
}

/// Whether a scene's paths may have a second vertex.
pub fn has_second(scene: &Scene) -> bool {
    exceeds(scene, 1)
}

impl Reuse {
    /// Room for pictures of `size`; `previous` is the uniform that kernels read the frame before from.
    pub fn new(gpu: &Gpu, scene: &Scene, size: (u32, u32), previous: wgpu::Buffer) -> Result<Reuse> {
        let (second, mode) = (has_second(scene), scene.integrator.mode);
        let pixels = u64::from(size.0) * u64::from(size.1);
        let half = HALF * pixels;
        let most = gpu.limits.max_storage_buffer_binding_size.min(gpu.limits.max_buffer_size);
        if half > most {
            return Err(Error::new(
                Code::TooLarge,
                format!("A picture of {} × {} pixels is too large to keep paths of.", size.0, size.1),
            )
            .why(format!("It takes buffers of {half} bytes; {} lends {most}.", gpu.info.name))
            .hint("Choose a smaller film.width and film.height, or integrator.mode \"path\"."));
        }
        let buffer = |label: &str, size: u64| {
            gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some(label),
                size,
                usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            })
        };
        // The method of 2021 keeps no values of pairs.
        let own = mode == Mode::Restir;
        // Software drivers write timestamps before what they stand behind is done.
        let stamps = gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY) && !gpu.is_software();
        let queries = stamps.then(|| {
            let count = 2 * Pass::MOST as u32;
            let set = gpu.device.create_query_set(&wgpu::QuerySetDescriptor {
                label: Some("passes"),
                ty: wgpu::QueryType::Timestamp,
                count,
            });
            let resolved = gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("pass times"),
                size: 8 * u64::from(count),
                usage: wgpu::BufferUsages::QUERY_RESOLVE | wgpu::BufferUsages::COPY_SRC,
                mapped_at_creation: false,
            });
            (set, resolved)
        });
        let far = if second { half } else { EMPTY };
        let reuse = Reuse {
            size,
            mode,
            second,
            near: [buffer("reservoirs", half), buffer("reservoirs", half)],
            far: [buffer("second vertices", far), buffer("second vertices", far)],
            onsets: buffer("onsets", far),
            pairs: buffer("pairs", if own { 4 * pixels * u64::from(scene.restir.neighbours.max(1)) } else { EMPTY }),
            frame: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("frame"),
                size: size_of::<Frame>() as u64,
                usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
                mapped_at_creation: false,
            }),
            previous,
            turn: 0,
            number: 0,
            shaded: None,
            drawn: None,
            keeps: 0,
            edited: false,
            queries,
            timed: false,
            seconds: BTreeMap::new(),
        };
        gpu.check()?;
        Ok(reuse)
    }

    /// Whether the buffers fit `scene` in a picture of `size`.
    pub fn fits(&self, scene: &Scene, size: (u32, u32)) -> bool {
        let pixels = u64::from(size.0) * u64::from(size.1);
        let pairs = 4 * pixels * u64::from(scene.restir.neighbours);
        self.size == size
            && self.mode == scene.integrator.mode
            && self.second == has_second(scene)
            && (self.mode != Mode::Restir || self.pairs.size() >= pairs)
    }

    /// Bytes on the adapter.
    pub fn bytes(&self) -> u64 {
        self.near.iter().chain(&self.far).chain([&self.pairs, &self.onsets]).map(wgpu::Buffer::size).sum()
    }

    /// The lights of the frame before, which follow those of the next in the list.
    pub fn old_lights(&self) -> &[GpuLight] {
        self.drawn.as_ref().map_or(&[], |d| &d.lights)
    }

    /// The reservoirs that the last frame shaded, since [`Reuse::clear_shaded`].
    pub fn shaded(&self) -> Option<&wgpu::Buffer> {
        self.shaded.map(|i| &self.near[i])
    }

    /// A picture begins, of which no frame has been shaded; what the next one starts from stays.
    pub fn clear_shaded(&mut self) {
        self.shaded = None;
    }

    /// Forgets all paths.
    pub fn forget(&mut self) {
        self.keeps = 0;
    }

    /// Forgets paths that hold estimates of what has changed; what is left counts for less.
    pub fn edit(&mut self, suffixes: bool) {
        if suffixes {
            self.keeps &= !FROZEN;
        }
        self.edited = true;
    }

    /// Begins the sequence of frames anew: random numbers too.
    pub fn rewind(&mut self) {
        self.forget();
        self.number = 0;
        self.drawn = None;
    }

    /// What the next frame's kernels are told.
    fn next(&mut self, picture: &Picture, cap: u32, neighbours: u32) -> Frame {
        let Picture { scene, params, lights, .. } = *picture;
        let settings = scene.resampling();
        let same_kinds = |d: &Drawn| d.lights.iter().map(|l| l.kind).eq(lights.iter().map(|l| l.kind));
        if !self.drawn.as_ref().is_some_and(same_kinds) {
            self.forget();
        }
        if !self.mode.survives_edits() && !self.drawn.as_ref().is_some_and(|d| d.is_of(scene)) {
            self.forget();
        }
        // What only shows the picture, or the seed's number, moves nothing.
        let bare = |p: &Params| Params {
            overlay: 0,
            exposure: 0.0,
            tone_map: 0,
            overlay_low: 0.0,
            overlay_high: 0.0,
            overlay_scale: 0,
            ..*p
        };
        let still =
            self.drawn.as_ref().is_some_and(|d| bare(&d.params) == bare(params) && d.lights == lights) && !self.edited;
        let same_lights = self.drawn.as_ref().is_some_and(|d| d.lights == lights);
        let cap = if self.edited { (cap as f32).min(settings.edit_confidence as f32) } else { cap as f32 };
        self.edited = false;
        let frame = Frame {
            frame: self.number,
            candidates: scene.candidates(),
            cap,
            neighbours,
            reach: settings.reach,
            history: if cap > 0.0 { self.keeps } else { 0 },
            still: u32::from(still),
            reconnect: settings.reconnect_distance as f32,
            walks: settings.final_samples,
            permute: u32::from(settings.permute),
            old_lights: if same_lights { 0 } else { lights.len() as u32 },
            suffixes: settings.suffixes,
        };
        self.number = self.number.wrapping_add(1);
        self.drawn = Some(Drawn { params: *params, lights: lights.to_vec(), scene: scene.clone() });
        self.keeps = KNOWN | FROZEN;
        frame
    }

    /// The buffer that the last pass before shading writes.
    fn last_written(&self, merged: bool) -> usize {
        if merged { 1 - self.turn } else { self.turn }
    }

    fn group(
        &self,
        gpu: &Gpu,
        film: &Film,
        pass: Pass,
        layout: &wgpu::BindGroupLayout,
        merged: bool,
    ) -> wgpu::BindGroup {
        let own = if pass == Pass::Finish { self.last_written(merged) } else { self.turn };
        let entries: Vec<wgpu::BindGroupEntry> = pass
            .bound()
            .iter()
            .map(|&bound| {
                let resource = match bound {
                    Bound::FilmSum => film.sum.as_entire_binding(),
                    Bound::FilmSquare => film.square.as_entire_binding(),
                    Bound::Counters => film.counters.as_entire_binding(),
                    Bound::Paused => film.paused.as_entire_binding(),
                    Bound::Near => self.near[own].as_entire_binding(),
                    Bound::Far => self.far[own].as_entire_binding(),
                    Bound::OtherNear => self.near[1 - own].as_entire_binding(),
                    Bound::OtherFar => self.far[1 - own].as_entire_binding(),
                    Bound::Pairs => self.pairs.as_entire_binding(),
                    Bound::Onsets => self.onsets.as_entire_binding(),
                    Bound::Frame => self.frame.as_entire_binding(),
                };
                wgpu::BindGroupEntry { binding: bound as u32, resource }
            })
            .collect();
        let descriptor = wgpu::BindGroupDescriptor { label: Some(pass.name()), layout, entries: &entries };
        gpu.device.create_bind_group(&descriptor)
    }

    /// Draws one frame, a sample of every pixel, of `merged` reservoirs of new candidates. `groups` are those of the path
    /// tracer, 0 to 2; `cap` is the most that a history counts for.
    pub fn draw(
        &mut self,
        gpu: &Gpu,
        kernels: &Kernels,
        groups: [&wgpu::BindGroup; 3],
        picture: &Picture,
        cap: u32,
        merged: u32,
    ) -> Result<()> {
        let settings = picture.scene.resampling();
        let cap = if settings.temporal { cap } else { 0 };
        // All but the last are a history that counts whole.
        for i in 1..merged {
            let cap = if i == 1 { cap } else { u32::MAX };
            self.draw_part(gpu, kernels, groups, picture, cap, None)?;
        }
        let neighbours = if settings.spatial { settings.neighbours } else { 0 };
        let cap = if merged > 1 { u32::MAX } else { cap };
        self.draw_part(gpu, kernels, groups, picture, cap, Some(neighbours))
    }

    /// The passes up to the temporal one, and where the number of neighbours is given the rest as well.
    fn draw_part(
        &mut self,
        gpu: &Gpu,
        kernels: &Kernels,
        groups: [&wgpu::BindGroup; 3],
        picture: &Picture,
        cap: u32,
        shown: Option<u32>,
    ) -> Result<()> {
        let film = picture.film;
        let neighbours = shown.unwrap_or(0);
        let before = self.drawn.as_ref().map_or(*picture.params, |d| d.params);
        let frame = self.next(picture, cap, neighbours);
        gpu.queue.write_buffer(&self.previous, 0, bytemuck::bytes_of(&before));
        gpu.queue.write_buffer(&self.frame, 0, bytemuck::bytes_of(&frame));
        let runs = |pass: Pass| match pass {
            Pass::Temporal | Pass::Reproject => frame.history != 0,
            Pass::Pair | Pass::Merge | Pass::Gather => neighbours > 0,
            Pass::Shade | Pass::Finish => shown.is_some(),
            Pass::Candidates | Pass::Initial | Pass::Suffix => true,
        };
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut timed = Vec::new();
        for (pass, kernel, layout) in kernels.passes.iter().filter(|(p, ..)| runs(*p)) {
            let group = self.group(gpu, film, *pass, layout, neighbours > 0);
            let mut dispatch = |encoder: &mut wgpu::CommandEncoder| {
                let at = 2 * timed.len() as u32;
                let writes = self.queries.as_ref().filter(|_| self.timed && timed.len() < Pass::MOST);
                let writes = writes.map(|(set, _)| wgpu::ComputePassTimestampWrites {
                    query_set: set,
                    beginning_of_pass_write_index: Some(at),
                    end_of_pass_write_index: Some(at + 1),
                });
                if writes.is_some() {
                    timed.push(*pass);
                }
                let descriptor = wgpu::ComputePassDescriptor { label: Some(pass.name()), timestamp_writes: writes };
                let mut compute = encoder.begin_compute_pass(&descriptor);
                compute.set_pipeline(kernel);
                (0..).zip(groups.into_iter().chain([&group])).for_each(|(i, g)| compute.set_bind_group(i, g, &[]));
                compute.dispatch_workgroups(self.size.0.div_ceil(TILE), self.size.1.div_ceil(TILE), 1);
            };
            let begin = Instant::now();
            dispatch(&mut encoder);
            if *pass == Pass::Suffix && exceeds(picture.scene, VERTICES) {
                // Long paths go on in another dispatch; most frames have none.
                let mut behind = film.count(gpu)?.behind;
                for _ in 0..CATCH_UPS {
                    let fresh = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                    gpu.queue.submit([std::mem::replace(&mut encoder, fresh).finish()]);
                    let now = film.count(gpu)?.behind;
                    if now == behind {
                        break;
                    }
                    behind = now;
                    dispatch(&mut encoder);
                }
            }
            if self.timed && self.queries.is_none() {
                let fresh = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
                gpu.queue.submit([std::mem::replace(&mut encoder, fresh).finish()]);
                gpu.wait()?;
                *self.seconds.entry(pass.name()).or_default() += begin.elapsed().as_secs_f64();
            }
        }
        if let Some((set, resolved)) = self.queries.as_ref().filter(|_| !timed.is_empty()) {
            encoder.resolve_query_set(set, 0..2 * timed.len() as u32, resolved, 0);
        }
        gpu.queue.submit([encoder.finish()]);
        if let Some((_, resolved)) = self.queries.as_ref().filter(|_| !timed.is_empty()) {
            let ticks: Vec<u64> = readback::values(gpu, resolved)?;
            let period = f64::from(gpu.queue.get_timestamp_period()) * 1e-9;
            for (pass, pair) in timed.iter().zip(ticks.chunks(2)) {
                *self.seconds.entry(pass.name()).or_default() += pair[1].saturating_sub(pair[0]) as f64 * period;
            }
        }
        self.shaded = shown.map(|_| self.last_written(neighbours > 0));
        let keep_merged = picture.scene.resampling().history == History::Spatial && neighbours > 0;
        if !keep_merged {
            self.turn = 1 - self.turn;
        }
        Ok(())
    }
}
