//! The graphics device: choice of an adapter, shader text, buffers back to the CPU.

pub mod device;
pub mod layout;
pub mod readback;
pub mod shader;
