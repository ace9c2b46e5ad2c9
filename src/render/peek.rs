//! A few pixels of the film, for the inspector: a small readback, whatever the size of the picture.

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::readback;

use super::film::{Cost, Film, Sums};
use super::reservoir::Reservoir;

/// Bytes of what a pixel costs.
const COST: u64 = size_of::<Cost>() as u64;

/// A square of pixels cut out of the film, clipped at its edges.
#[derive(Clone, Debug, PartialEq)]
pub struct Patch {
    /// The low corner: column and row of the film.
    pub corner: (u32, u32),
    /// The pixels.
    pub sums: Sums,
}

impl Patch {
    /// Reads the pixels at most `radius` columns and rows from `(x, y)`, a pixel of the film, and of `reservoirs` where
    /// there are some; blocks.
    pub fn read(
        gpu: &Gpu,
        film: &Film,
        reservoirs: Option<&wgpu::Buffer>,
        (x, y): (u32, u32),
        radius: u32,
    ) -> Result<Patch> {
        let corner = (x.saturating_sub(radius), y.saturating_sub(radius));
        let end = ((x + radius + 1).min(film.width), (y + radius + 1).min(film.height));
        let (width, height) = (end.0 - corner.0, end.1 - corner.1);
        // Words of each pixel, and where its piece of the staging buffer begins.
        let vec4 = size_of::<[f32; 4]>() as u64;
        let mut parts = vec![(&film.sum, vec4), (&film.totals[0], vec4), (&film.square, vec4), (&film.totals[1], vec4)];
        if film.aov {
            parts.extend([(&film.extra, 2 * vec4), (&film.totals[2], 2 * vec4)]);
        }
        if film.counts_cost {
            parts.push((&film.cost, COST));
        }
        parts.extend(reservoirs.map(|buffer| (buffer, Reservoir::BYTES)));
        let pixels = u64::from(width * height);
        let staging = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("peek"),
            size: parts.iter().map(|(_, each)| each * pixels).sum(),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        let mut encoder = gpu.device.create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        let mut to = 0;
        for (buffer, each) in &parts {
            let row = each * u64::from(width);
            for y in corner.1..end.1 {
                let from = each * (u64::from(y) * u64::from(film.width) + u64::from(corner.0));
                encoder.copy_buffer_to_buffer(buffer, from, &staging, to, row);
                to += row;
            }
        }
        gpu.queue.submit([encoder.finish()]);
        let bytes = readback::bytes(gpu, &staging)?;
        let mut rest = &bytes[..];
        let mut piece = |each: u64| {
            let (piece, after) = rest.split_at((each * pixels) as usize);
            rest = after;
            piece
        };
        let mut total = |each: u64| -> Vec<[f64; 4]> {
            let block: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(piece(each));
            let total: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(piece(each));
            let add = |(a, b): (&[f32; 4], &[f32; 4])| std::array::from_fn(|c| f64::from(a[c]) + f64::from(b[c]));
            block.iter().zip(&total).map(add).collect()
        };
        let (sum, square) = (total(vec4), total(vec4));
        let extra = if film.aov { total(2 * vec4) } else { Vec::new() };
        let cost = if film.counts_cost { bytemuck::pod_collect_to_vec(piece(COST)) } else { Vec::new() };
        let reservoirs = bytemuck::pod_collect_to_vec(rest);
        Ok(Patch { corner, sums: Sums { width, height, sum, square, extra, cost, reservoirs } })
    }

    /// The place in `sums` of a pixel of the film, if it is in the patch.
    pub fn place(&self, (x, y): (u32, u32)) -> Option<usize> {
        let (column, row) = (x.checked_sub(self.corner.0)?, y.checked_sub(self.corner.1)?);
        (column < self.sums.width && row < self.sums.height).then(|| (row * self.sums.width + column) as usize)
    }
}
