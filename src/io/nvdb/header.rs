//! The 672 bytes at the head of a grid, and the checksum over it.

use glam::{DMat4, DVec4};

use super::{MAGIC, Version, tree};
use crate::error::{Code, Error, Result};
use crate::io::bytes::Bytes;

/// Bytes of the head; the tree's own header follows.
pub(super) const SIZE: usize = 672;
/// Bytes of the name in the head. A longer name is cut here (its whole stands among data that this reader skips).
const NAME: usize = 256;
/// Up to this version the first checksum covers all before the first upper node, later only grid and tree headers.
const OLD_CHECKSUM: Version = Version::new(32, 6, 0);
/// The checksum begins behind the magic number and itself.
const CHECKSUM_FROM: usize = 16;
/// Bytes that are summed apart in the second checksum.
const CHECKSUM_BLOCK: usize = 4096;
/// A checksum that was not made.
const NO_CHECKSUM: u32 = u32::MAX;

/// What the head says.
pub(super) struct GridHeader {
    checksum_head: u32,
    checksum_tail: u32,
    pub(super) version: Version,
    pub(super) grid_size: u64,
    /// Bytes that are not UTF-8 stand as U+FFFD.
    pub(super) name: String,
    pub(super) world_from_index: DMat4,
    /// [`class_name`] names them.
    pub(super) class: u32,
    /// [`type_name`] names them.
    pub(super) value_type: u32,
}

impl GridHeader {
    /// Parses the head of the grid at the start of `grid`.
    pub(super) fn parse(grid: &[u8]) -> Result<GridHeader> {
        let mut data = Bytes::new(grid);
        let magic = data.take(MAGIC.len() + 1)?;
        if !magic.starts_with(MAGIC) {
            return Err(Bytes::new(grid).corrupt("a grid does not begin with its magic number"));
        }
        let (checksum_head, checksum_tail) = (data.u32()?, data.u32()?);
        let version = Version(data.u32()?);
        version.check()?;
        data.take(3 * 4)?; // flags, index and number of the grids in memory
        let grid_size = data.u64()?;
        let name = text(data.take(NAME)?);
        data.take((9 + 9 + 3 + 1) * 4)?; // the map in single precision
        let mut doubles = [0.0; 9 + 9 + 3]; // rows of the matrix, its inverse, translation
        for value in &mut doubles {
            *value = data.f64()?;
        }
        data.take(8 + 6 * 8 + 3 * 8)?; // taper, box in world space, size of a voxel
        let (class, value_type) = (data.u32()?, data.u32()?);
        let column = |i: usize| DVec4::new(doubles[i], doubles[3 + i], doubles[6 + i], 0.0);
        let shift = DVec4::new(doubles[18], doubles[19], doubles[20], 1.0);
        let world_from_index = DMat4::from_cols(column(0), column(1), column(2), shift);
        Ok(GridHeader { checksum_head, checksum_tail, version, grid_size, name, world_from_index, class, value_type })
    }

    /// Whether the stored CRC-32 sums match the grid's bytes; `None` if there are none to compare.
    ///
    /// The second sum of versions to 32.6.0 is not compared: it depends on how their nodes were walked.
    pub(super) fn checksum_holds(&self, grid: &[u8]) -> Option<bool> {
        if self.checksum_head == NO_CHECKSUM {
            return None;
        }
        let body = SIZE + tree::HEADER;
        let end = if self.version > OLD_CHECKSUM { Some(body) } else { tree::first_upper(grid) };
        let head_holds = crc32(grid.get(CHECKSUM_FROM..end?)?) == self.checksum_head;
        if self.checksum_tail == NO_CHECKSUM || self.version <= OLD_CHECKSUM {
            return Some(head_holds);
        }
        let tail = grid.get(body..usize::try_from(self.grid_size).ok()?)?;
        // Whole blocks; the last one takes the rest.
        let blocks = tail.len() / CHECKSUM_BLOCK;
        let mut sums = flate2::Crc::new();
        for i in 0..blocks {
            let end = if i + 1 == blocks { tail.len() } else { (i + 1) * CHECKSUM_BLOCK };
            sums.update(&crc32(&tail[i * CHECKSUM_BLOCK..end]).to_le_bytes());
        }
        Some(head_holds && sums.sum() == self.checksum_tail)
    }

    /// An error for a grid of this kind.
    pub(super) fn unsupported(&self, why: impl Into<String>) -> Error {
        let kind = type_name(self.value_type);
        Error::new(Code::Unsupported, format!("Grid {:?} of type {kind} cannot be drawn.", self.name)).why(why)
    }
}

fn crc32(bytes: &[u8]) -> u32 {
    let mut crc = flate2::Crc::new();
    crc.update(bytes);
    crc.sum()
}

/// The text before the first zero byte.
pub(super) fn text(bytes: &[u8]) -> String {
    let end = bytes.iter().position(|&byte| byte == 0).unwrap_or(bytes.len());
    String::from_utf8_lossy(&bytes[..end]).into_owned()
}

/// The value types by number, named as the library does.
#[rustfmt::skip]
const TYPES: [&str; 27] = [
    "Unknown", "float", "double", "int16", "int32", "int64", "Vec3f", "Vec3d", "Mask", "Half", "uint32", "bool", "RGBA8",
    "Float4", "Float8", "Float16", "FloatN", "Vec4f", "Vec4d", "Index", "OnIndex", "IndexMask", "OnIndexMask",
    "PointIndex", "Vec3u8", "Vec3u16", "uint8",
];

/// The classes by number, in OpenVDB's words.
#[rustfmt::skip]
const CLASSES: [&str; 11] = [
    "unknown", "level set", "fog volume", "staggered", "point index", "point data", "topology", "voxel volume",
    "index grid", "tensor grid", "voxel bvh",
];

/// The value type's name; `type 77` for an unknown one.
pub(super) fn type_name(number: u32) -> String {
    TYPES.get(number as usize).map_or_else(|| format!("type {number}"), |&name| name.to_owned())
}

/// The class's name; `class 77` for an unknown one.
pub(super) fn class_name(number: u32) -> String {
    CLASSES.get(number as usize).map_or_else(|| format!("class {number}"), |&name| name.to_owned())
}
