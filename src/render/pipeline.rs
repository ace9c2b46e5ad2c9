//! Bind group layouts and compute pipelines of the renderer.

use wgpu::ShaderStages;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, Variant};

use super::film::Film;
use super::params::TILE;
use super::reservoir::Reservoir;
use super::reuse::Kernels;

/// Everything that pipelines of the renderer share.
pub struct Layouts {
    /// Group 0: uniform of the picture and of the dispatch.
    pub frame: wgpu::BindGroupLayout,
    /// Group 2: lights.
    pub lights: wgpu::BindGroupLayout,
    /// Group 3: film.
    pub film: wgpu::BindGroupLayout,
    medium_filtered: wgpu::BindGroupLayout,
    medium_plain: wgpu::BindGroupLayout,
    flush: wgpu::ComputePipeline,
    resolve: wgpu::ComputePipeline,
    /// One that stands for no sample, bound where there are none.
    no_reservoirs: wgpu::Buffer,
}

pub(super) fn entry(binding: u32, ty: wgpu::BindingType) -> wgpu::BindGroupLayoutEntry {
    let visibility = ShaderStages::COMPUTE | ShaderStages::FRAGMENT;
    wgpu::BindGroupLayoutEntry { binding, visibility, ty, count: None }
}

pub(super) fn writable(binding: u32) -> wgpu::BindGroupLayoutEntry {
    let ty = wgpu::BufferBindingType::Storage { read_only: false };
    wgpu::BindGroupLayoutEntry {
        binding,
        visibility: ShaderStages::COMPUTE,
        ty: wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None },
        count: None,
    }
}

pub(super) fn buffer(ty: wgpu::BufferBindingType) -> wgpu::BindingType {
    wgpu::BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

pub(super) fn texture(
    sample_type: wgpu::TextureSampleType,
    view_dimension: wgpu::TextureViewDimension,
) -> wgpu::BindingType {
    wgpu::BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

impl Layouts {
    /// The layouts, and the pipelines that no scene changes.
    pub fn new(gpu: &Gpu, source: &Source) -> Result<Layouts> {
        let layout = |label: &str, entries: &[wgpu::BindGroupLayoutEntry]| {
            gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor { label: Some(label), entries })
        };
        let uniform = buffer(wgpu::BufferBindingType::Uniform);
        let readable = buffer(wgpu::BufferBindingType::Storage { read_only: true });
        let medium = |filterable: bool| {
            let sampler =
                if filterable { wgpu::SamplerBindingType::Filtering } else { wgpu::SamplerBindingType::NonFiltering };
            layout(
                "medium",
                &[
                    entry(0, texture(wgpu::TextureSampleType::Float { filterable }, wgpu::TextureViewDimension::D3)),
                    entry(1, wgpu::BindingType::Sampler(sampler)),
                    entry(2, texture(wgpu::TextureSampleType::Uint, wgpu::TextureViewDimension::D3)),
                    entry(
                        3,
                        texture(wgpu::TextureSampleType::Float { filterable: true }, wgpu::TextureViewDimension::D3),
                    ),
                    entry(4, wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering)),
                ],
            )
        };
        // Plants are for the path tracer.
        let plain = Source { folder: source.folder.clone(), plants: Vec::new() };
        // Views of reservoirs need their first half only.
        let near = Variant::default().flag("REUSE_SECOND", false);
        let plain_float = wgpu::TextureSampleType::Float { filterable: false };
        Ok(Layouts {
            frame: layout("frame", &[entry(0, uniform), entry(1, uniform), entry(2, uniform)]),
            lights: layout(
                "lights",
                &[
                    entry(0, readable),
                    entry(1, texture(plain_float, wgpu::TextureViewDimension::D2)),
                    entry(2, readable),
                ],
            ),
            film: layout("film", &[writable(0), writable(1), writable(2), writable(3), writable(4), writable(5)]),
            medium_filtered: medium(true),
            medium_plain: medium(false),
            flush: compute(gpu, &plain, "film/flush", "flush_main", &Variant::default(), None)?,
            resolve: compute(gpu, &plain, "film/resolve", "resolve_main", &near, None)?,
            no_reservoirs: gpu.device.create_buffer(&wgpu::BufferDescriptor {
                label: Some("no reservoirs"),
                size: Reservoir::BYTES,
                usage: wgpu::BufferUsages::STORAGE,
                mapped_at_creation: false,
            }),
        })
    }

    /// Group 1, by whether the density texture can be filtered.
    pub fn medium(&self, filterable: bool) -> &wgpu::BindGroupLayout {
        if filterable { &self.medium_filtered } else { &self.medium_plain }
    }

    /// The layout of every kernel that traces.
    pub fn tracer(&self, gpu: &Gpu, filterable: bool) -> wgpu::PipelineLayout {
        gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("tracer"),
            bind_group_layouts: &[
                Some(&self.frame),
                Some(self.medium(filterable)),
                Some(&self.lights),
                Some(&self.film),
            ],
            immediate_size: 0,
        })
    }

    /// Bind group 0: uniforms of the picture, of the dispatch, and of the picture a frame before.
    pub fn frame_group(
        &self,
        gpu: &Gpu,
        params: &wgpu::Buffer,
        slice: &wgpu::Buffer,
        previous: &wgpu::Buffer,
    ) -> wgpu::BindGroup {
        group(gpu, &self.frame, &[params, slice, previous])
    }

    /// Bind group 3.
    pub fn film_group(&self, gpu: &Gpu, film: &Film) -> wgpu::BindGroup {
        let rest = [&film.counters, &film.cost, &film.paused];
        group(gpu, &self.film, &[&[&film.sum, &film.square, &film.extra][..], &rest].concat())
    }

    /// Adds the film's block sums to the totals.
    pub fn flush(&self, gpu: &Gpu, film: &Film) {
        /// Threads of a workgroup of the kernel.
        const GROUP: u64 = 64;
        /// Workgroups in a row of the dispatch.
        const ROW: u64 = 1 << 14;
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for (block, total) in film.blocks().into_iter().zip(&film.totals) {
            let groups = (block.size() / 16).div_ceil(GROUP);
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.flush);
            pass.set_bind_group(0, &group(gpu, &self.flush.get_bind_group_layout(0), &[block, total]), &[]);
            pass.dispatch_workgroups(groups.min(ROW) as u32, groups.div_ceil(ROW) as u32, 1);
        }
        gpu.queue.submit([encoder.finish()]);
    }
}

impl Layouts {
    /// Writes the picture of `film` to `picture`, a storage texture of its size, and a few pixels of the overlay to
    /// `sparse`; `reservoirs` are those that were shaded last.
    pub fn resolve(
        &self,
        gpu: &Gpu,
        film: &Film,
        reservoirs: Option<&wgpu::Buffer>,
        params: &wgpu::Buffer,
        picture: &wgpu::Texture,
        sparse: &wgpu::Buffer,
    ) {
        let frame = group(gpu, &self.resolve.get_bind_group_layout(0), &[params]);
        let view = picture.create_view(&wgpu::TextureViewDescriptor::default());
        let buffers = [
            (0, &film.sum),
            (1, &film.square),
            (2, &film.totals[0]),
            (3, &film.totals[1]),
            (5, &film.cost),
            (6, sparse),
        ];
        let mut entries: Vec<wgpu::BindGroupEntry> = buffers
            .into_iter()
            .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
            .collect();
        entries.push(wgpu::BindGroupEntry { binding: 4, resource: wgpu::BindingResource::TextureView(&view) });
        let layout = self.resolve.get_bind_group_layout(1);
        let film_group = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &layout,
            entries: &entries,
        });
        /// Group and binding of reservoirs, in shaders/reuse/reservoir.wgsl.
        const RESERVOIRS: (u32, u32) = (3, 8);
        let kept = gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: None,
            layout: &self.resolve.get_bind_group_layout(RESERVOIRS.0),
            entries: &[wgpu::BindGroupEntry {
                binding: RESERVOIRS.1,
                resource: reservoirs.unwrap_or(&self.no_reservoirs).as_entire_binding(),
            }],
        });
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&self.resolve);
            pass.set_bind_group(RESERVOIRS.0, &kept, &[]);
            pass.set_bind_group(0, &frame, &[]);
            pass.set_bind_group(1, &film_group, &[]);
            pass.dispatch_workgroups(film.width.div_ceil(TILE), film.height.div_ceil(TILE), 1);
        }
        gpu.queue.submit([encoder.finish()]);
    }
}

/// The texture that a film is resolved to.
pub fn picture_texture(gpu: &Gpu, width: u32, height: u32) -> wgpu::Texture {
    gpu.device.create_texture(&wgpu::TextureDescriptor {
        label: Some("picture"),
        size: wgpu::Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format: wgpu::TextureFormat::Rgba16Float,
        usage: wgpu::TextureUsages::STORAGE_BINDING | wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
}

/// Group 3 of kernels in shaders/probe: values in, values out.
pub fn values_layout(gpu: &Gpu) -> wgpu::BindGroupLayout {
    let values_in = entry(0, buffer(wgpu::BufferBindingType::Storage { read_only: true }));
    gpu.device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
        label: Some("probe"),
        entries: &[values_in, writable(1)],
    })
}

/// A bind group of whole buffers, numbered from 0.
pub fn group(gpu: &Gpu, layout: &wgpu::BindGroupLayout, buffers: &[&wgpu::Buffer]) -> wgpu::BindGroup {
    let entries: Vec<wgpu::BindGroupEntry> = (0..)
        .zip(buffers)
        .map(|(binding, buffer)| wgpu::BindGroupEntry { binding, resource: buffer.as_entire_binding() })
        .collect();
    gpu.device.create_bind_group(&wgpu::BindGroupDescriptor { label: None, layout, entries: &entries })
}

/// Links, validates and loads a shader file.
pub fn module(gpu: &Gpu, source: &Source, file: &str, variant: &Variant) -> Result<wgpu::ShaderModule> {
    let linked = source.link(file, variant)?;
    linked.validate()?;
    log::debug!(target: "shader", "{file}\n{}", linked.text);
    let descriptor =
        wgpu::ShaderModuleDescriptor { label: Some(file), source: wgpu::ShaderSource::Wgsl(linked.text.into()) };
    let checks = wgpu::ShaderRuntimeChecks { force_loop_bounding: false, ..wgpu::ShaderRuntimeChecks::checked() };
    // SAFETY: our own shaders. Every loop has a bound of its own (path: PATH_MAX_ITERATIONS, others count up to a
    // uniform); indices into buffers keep their checks.
    Ok(unsafe { gpu.device.create_shader_module_trusted(descriptor, checks) })
}

/// The error for a pipeline of `file` that the driver refused.
pub fn refused(gpu: &Gpu, file: &str, e: &wgpu::Error) -> Error {
    Error::new(Code::Shader, format!("shaders/{file}.wgsl could not be built on {}.", gpu.info.name))
        .why(e.to_string().lines().next().unwrap_or_default().to_owned())
        .hint("Please report it with the output of `nephele doctor`.")
}

/// Links, validates and builds a compute pipeline; with `layout` `None`, its layout follows the shader.
pub fn compute(
    gpu: &Gpu,
    source: &Source,
    file: &str,
    entry_point: &str,
    variant: &Variant,
    layout: Option<&wgpu::PipelineLayout>,
) -> Result<wgpu::ComputePipeline> {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = module(gpu, source, file, variant)?;
    let pipeline = gpu.device.create_compute_pipeline(&wgpu::ComputePipelineDescriptor {
        label: Some(file),
        layout,
        module: &module,
        entry_point: Some(entry_point),
        compilation_options: wgpu::PipelineCompilationOptions::default(),
        cache: None,
    });
    match pollster::block_on(scope.pop()) {
        None => Ok(pipeline),
        Some(e) => Err(refused(gpu, file, &e)),
    }
}

/// The kernels that draw a scene.
pub struct Pipeline {
    /// The path tracer.
    pub pipeline: wgpu::ComputePipeline,
    /// The passes of resampling, where the variant asks for them.
    pub reuse: Option<Kernels>,
}

impl Pipeline {
    /// Builds the path tracer's `variant`.
    pub fn new(gpu: &Gpu, source: &Source, layouts: &Layouts, variant: &Variant, filterable: bool) -> Result<Pipeline> {
        let layout = layouts.tracer(gpu, filterable);
        let pipeline = compute(gpu, source, "integrate/path", "path_main", variant, Some(&layout))?;
        let reuses = variant.constants.iter().any(|(name, value)| *name == "REUSE" && value == "true");
        let reuse = reuses.then(|| Kernels::new(gpu, source, layouts, variant, filterable)).transpose()?;
        Ok(Pipeline { pipeline, reuse })
    }
}
