//! Paints the resolved picture inside egui's own pass.

use std::sync::Arc;

use egui_wgpu::{CallbackResources, CallbackTrait};

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::{Source, Variant};
use crate::render::{Renderer, pipeline};

/// The pipeline that shows pictures on one kind of surface.
pub struct Presenter {
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
}

/// What one frame paints.
pub struct Painting {
    presenter: Arc<Presenter>,
    params: wgpu::BindGroup,
    picture: wgpu::BindGroup,
}

impl Presenter {
    /// A presenter for surfaces of `format` (not an sRGB one: the shader encodes).
    pub fn new(gpu: &Gpu, format: wgpu::TextureFormat) -> Result<Presenter> {
        const FILE: &str = "display/present";
        let scope = gpu.device.push_error_scope(wgpu::ErrorFilter::Validation);
        let module = pipeline::module(gpu, &Source::standard(), FILE, &Variant::default())?;
        let pipeline = gpu.device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some(FILE),
            layout: None,
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("present_vertex"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                buffers: &[],
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("present_fragment"),
                compilation_options: wgpu::PipelineCompilationOptions::default(),
                targets: &[Some(format.into())],
            }),
            multiview_mask: None,
            cache: None,
        });
        if let Some(e) = pollster::block_on(scope.pop()) {
            return Err(pipeline::refused(gpu, FILE, &e));
        }
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("picture"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Ok(Presenter { pipeline, sampler })
    }

    /// What shows the renderer's picture as it stands.
    pub fn painting(self: &Arc<Presenter>, renderer: &Renderer) -> Painting {
        let device = &renderer.gpu.device;
        let view = renderer.picture().create_view(&wgpu::TextureViewDescriptor::default());
        let params = pipeline::group(&renderer.gpu, &self.pipeline.get_bind_group_layout(0), &[renderer.params()]);
        let picture = device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("picture"),
            layout: &self.pipeline.get_bind_group_layout(1),
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
            ],
        });
        Painting { presenter: self.clone(), params, picture }
    }
}

impl CallbackTrait for Painting {
    fn paint(&self, _: egui::PaintCallbackInfo, pass: &mut wgpu::RenderPass<'static>, _: &CallbackResources) {
        pass.set_pipeline(&self.presenter.pipeline);
        pass.set_bind_group(0, &self.params, &[]);
        pass.set_bind_group(1, &self.picture, &[]);
        pass.draw(0..3, 0..1);
    }
}
