//! Runs a probe kernel on the scene's own medium, lights and parameters.

use std::sync::Arc;

use nephele::gpu::device::Gpu;
use nephele::gpu::readback;
use nephele::gpu::shader::{Source, Variant};
use nephele::render::field::Field;
use nephele::render::lights::{LightData, Lights};
use nephele::render::medium::Medium;
use nephele::render::params::{Params, Slice};
use nephele::render::pipeline::{self, Layouts};
use nephele::render::tracking;
use nephele::scene::Scene;
use wgpu::util::DeviceExt;

/// A scene ready for probes.
pub struct Probe {
    gpu: Arc<Gpu>,
    pub medium: Medium,
    pub lights: Lights,
    pub params: Params,
    /// Slots and flags for every kernel; a test may change them.
    pub variant: Variant,
}

impl Probe {
    pub fn new(gpu: &Arc<Gpu>, scene: &Scene) -> Probe {
        let field = Field::load(&scene.volume).expect("a field without files");
        Probe::with_field(gpu, scene, field)
    }

    pub fn with_field(gpu: &Arc<Gpu>, scene: &Scene, field: Field) -> Probe {
        let medium = Medium::new(gpu, Arc::new(field), scene).expect("a small medium");
        let data = LightData::load(scene).expect("readable lights");
        let lights = Lights::of(scene, &data, &medium.field, medium.unit, None);
        let params = Params::of(scene, &medium, &lights, 64, 64);
        let variant = medium.variant(lights.variant(Variant::default())).slot("phase", phase_file(scene));
        let variant = tracking::variant(scene, medium.is_analytic(), variant);
        Probe { gpu: gpu.clone(), medium, lights, params, variant }
    }

    /// Replaces the file of a slot.
    pub fn choose(&mut self, slot: &str, file: &'static str) {
        self.variant.slots.iter_mut().filter(|(s, _)| *s == slot).for_each(|choice| choice.1 = file);
    }

    /// Runs `probe/{kernel}` with `inputs` and gives the `outputs` values that it writes, `each` of them by an
    /// invocation.
    pub fn run(
        &self,
        source: &Source,
        kernel: &str,
        inputs: &[[f32; 4]],
        outputs: usize,
        each: usize,
        slice: Slice,
    ) -> Vec<[f32; 4]> {
        let gpu = &self.gpu;
        let layouts = Layouts::new(gpu, source).expect("valid shaders");
        let values_layout = pipeline::values_layout(gpu);
        let medium_layout = layouts.medium(self.medium.filterable(gpu));
        let layout = gpu.device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("probe"),
            bind_group_layouts: &[
                Some(&layouts.frame),
                Some(medium_layout),
                Some(&layouts.lights),
                Some(&values_layout),
            ],
            immediate_size: 0,
        });
        let (file, entry) = (format!("probe/probe_{kernel}"), format!("probe_{kernel}_main"));
        let pipeline = pipeline::compute(gpu, source, &file, &entry, &self.variant, Some(&layout))
            .unwrap_or_else(|e| panic!("{e}"));
        let buffer = |bytes: &[u8], usage| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor { label: None, contents: bytes, usage })
        };
        let params = buffer(bytemuck::bytes_of(&self.params), wgpu::BufferUsages::UNIFORM);
        let slice = buffer(bytemuck::bytes_of(&slice), wgpu::BufferUsages::UNIFORM);
        let nothing = [[0.0f32; 4]];
        let input = buffer(
            bytemuck::cast_slice(if inputs.is_empty() { &nothing } else { inputs }),
            wgpu::BufferUsages::STORAGE,
        );
        let output = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("probe"),
            size: 16 * outputs as u64,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let groups = [
            layouts.frame_group(gpu, &params, &slice, &params),
            self.medium.bind_group(gpu, medium_layout),
            self.lights.bind_group(gpu, &layouts.lights, &mut None, &[]),
            pipeline::group(gpu, &values_layout, &[&input, &output]),
        ];
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        {
            let mut pass = encoder.begin_compute_pass(&wgpu::ComputePassDescriptor::default());
            pass.set_pipeline(&pipeline);
            (0..).zip(&groups).for_each(|(i, group)| pass.set_bind_group(i, group, &[]));
            pass.dispatch_workgroups((outputs / each).div_ceil(64) as u32, 1, 1);
        }
        gpu.queue.submit([encoder.finish()]);
        readback::values(gpu, &output).expect("the probe runs")
    }
}

fn phase_file(scene: &Scene) -> &'static str {
    use nephele::scene::Phase;
    match scene.medium.phase {
        Phase::Isotropic => "phase/isotropic",
        Phase::Rayleigh => "phase/rayleigh",
        Phase::Hg => "phase/hg",
        Phase::TwoLobeHg => "phase/two_lobe_hg",
    }
}

/// Numbers for a probe that draws: the sample index that keys its streams.
pub fn sample(first_sample: u32) -> Slice {
    Slice { first_sample, ..Slice::default() }
}
