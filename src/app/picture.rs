//! Paints resolved pictures inside egui's own pass.

use egui_wgpu::{CallbackResources, CallbackTrait};
use wgpu::util::DeviceExt;

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, Variant};
use crate::render::{Renderer, pipeline};

/// The pipelines that show pictures on one kind of surface.
pub struct Presenter {
    picture: wgpu::RenderPipeline,
    difference: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
}

/// What one frame paints.
pub struct Painting {
    pipeline: wgpu::RenderPipeline,
    params: wgpu::BindGroup,
    picture: wgpu::BindGroup,
}

/// How a difference is shown.
#[derive(Clone, Copy, Debug)]
pub struct Style {
    /// Colour of no difference, of more in A and of more in B.
    pub colours: [egui::Color32; 3],
    /// Factor on the difference.
    pub gain: f64,
}

impl Presenter {
    /// A presenter for surfaces of `format` (not an sRGB one: the shader encodes).
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Result<Presenter> {
        let picture = drawing(gpu, format, "display/present", ["present_vertex", "present_fragment"])?;
        let difference = drawing(gpu, format, "display/difference", ["difference_vertex", "difference_fragment"])?;
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Presenter { picture, difference, sampler })
    }

    /// What shows the renderer's picture as it stands.
    pub fn painting(&self, renderer: &Renderer) -> Painting {
        let view = view(renderer);
        self.paint(
            &self.picture,
            renderer,
            &[wgpu::BindingResource::TextureView(&view), wgpu::BindingResource::Sampler(&self.sampler)],
        )
    }

    /// What shows how the picture of `b` differs from that of `a`, at the exposure of `a`.
    pub fn difference(&self, a: &Renderer, b: &Renderer, style: Style) -> Painting {
        let mut words = style.colours.map(|colour| colour.to_srgba_unmultiplied().map(|x| f32::from(x) / 255.0));
        words[0][3] = style.gain as f32;
        let uniform = a.gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
            label: Some("difference"),
            contents: bytemuck::cast_slice(&words),
            usage: wgpu::BufferUsages::UNIFORM,
        });
        let views = [view(a), view(b)];
        self.paint(
            &self.difference,
            a,
            &[
                wgpu::BindingResource::TextureView(&views[0]),
                wgpu::BindingResource::TextureView(&views[1]),
                wgpu::BindingResource::Sampler(&self.sampler),
                uniform.as_entire_binding(),
            ],
        )
    }

    fn paint(
        &self,
        pipeline: &wgpu::RenderPipeline,
        renderer: &Renderer,
        resources: &[wgpu::BindingResource<'_>],
    ) -> Painting {
        let params = pipeline::group(&renderer.gpu, &pipeline.get_bind_group_layout(0), &[renderer.params()]);
        let entries: Vec<wgpu::BindGroupEntry> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource: resource.clone() })
            .collect();
        let picture = renderer.gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &pipeline.get_bind_group_layout(1),
            entries: &entries,
        });
        Painting { pipeline: pipeline.clone(), params, picture }
    }
}

fn view(renderer: &Renderer) -> wgpu::TextureView {
    renderer.picture().create_view(&wgpu::TextureViewDescriptor::default())
}

/// A pipeline that draws one triangle by the entry points of `file`.
fn drawing(
    gpu: &Gpu,
    format: wgpu::TextureFormat,
    file: &str,
    [vertex, fragment]: [&str; 2],
) -> Result<wgpu::RenderPipeline> {
    let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
    let module = pipeline::module(gpu, &Source::standard(), file, &Variant::default())?;
    let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(file),
        layout: None,
        vertex: wgpu::VertexState {
            module: &module,
            entry_point: Some(vertex),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            buffers: &[],
        },
        primitive: wgpu::PrimitiveState::default(),
        depth_stencil: None,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module: &module,
            entry_point: Some(fragment),
            compilation_options: wgpu::PipelineCompilationOptions::default(),
            targets: &[Some(format.into())],
        }),
        multiview_mask: None,
        cache: None,
    });
    match pollster::block_on(scope.pop()) {
        Some(e) => Err(pipeline::refused(gpu, file, &e)),
        None => Ok(pipeline),
    }
}

impl CallbackTrait for Painting {
    fn paint(&self, _: egui::PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.pipeline);
        pass.set_bind_group(0, &self.params, &[]);
        pass.set_bind_group(1, &self.picture, &[]);
        pass.draw(0..3, 0..1);
    }
}
