//! Files to data and back.

pub mod bytes;
pub mod codec;
pub mod hdr;
pub mod nvdb;
pub mod picture;
pub mod vdb;
pub mod volume_file;
