//! Reservoirs on the CPU, for views of them: what each pixel keeps of light paths, as shaders/reuse/reservoir.wgsl packs it.

use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::readback;

/// What a pixel keeps: the first half of its reservoir, word by word.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Reservoir([u32; 8]);

/// Places of words.
const WEIGHT: usize = 2;
const AIM: usize = 3;
const META: usize = 6;
const CONFIDENCE: usize = 7;

impl Reservoir {
    /// Bytes of one on the adapter.
    pub const BYTES: u64 = size_of::<Reservoir>() as u64;

    fn float(&self, word: usize) -> f64 {
        f64::from(f32::from_bits(self.0[word]))
    }

    /// Samples that it stands for; 0 where no frame has been drawn.
    pub fn confidence(&self) -> f64 {
        self.float(CONFIDENCE)
    }

    /// Whether it holds a path.
    pub fn holds(&self) -> bool {
        self.float(AIM) > 0.0
    }

    /// Where the path comes from: 0 it is the pixel's own, 1 of the frame before, 2 of a neighbour.
    pub fn origin(&self) -> u32 {
        self.0[META] >> 4 & 15
    }

    /// Frames since the path was drawn, 255 at most.
    pub fn age(&self) -> u32 {
        self.0[META] >> 8 & 255
    }

    /// Contribution weight of the path times its target.
    pub fn weight(&self) -> f64 {
        f64::from(f32::from_bits(self.0[WEIGHT]) * f32::from_bits(self.0[AIM]))
    }
}

/// All reservoirs of a buffer; blocks.
pub fn read(gpu: &Gpu, buffer: &wgpu::Buffer) -> Result<Vec<Reservoir>> {
    readback::values(gpu, buffer)
}
