//! Files to data and back.

pub mod bytes;
pub mod codec;
pub mod hdr;
pub mod nvdb;
pub mod picture;
pub mod vdb;
pub mod volume_file;

/// The first bytes of what stands in place of a file in a repository without its large files.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";
