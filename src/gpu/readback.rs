//! Buffers back to the CPU.

use crate::error::{Code, Error, Result};

use super::device::Gpu;

/// The bytes of `buffer` after all submitted work; blocks.
pub fn bytes(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<u8>> {
    let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
        label: Some("readback"),
        size: buffer.size(),
        usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
        mapped_at_creation: false,
    });
    let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
    encoder.copy_buffer_to_buffer(buffer, 0, &staging, 0, buffer.size());
    gpu.queue.submit([encoder.finish()]);
    staging.map_async(wgpu::MapMode::Read, .., |_| {});
    gpu.wait()?;
    let view = staging.get_mapped_range(..).map_err(|e| {
        Error::new(Code::DeviceLost, "The graphics device does not give the picture back.").why(e.to_string())
    })?;
    Ok(view.to_vec())
}

/// The same as a list of plain values.
pub fn values<T: bytemuck::Pod>(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<T>> {
    Ok(bytemuck::pod_collect_to_vec(&bytes(gpu, buffer)?))
}
