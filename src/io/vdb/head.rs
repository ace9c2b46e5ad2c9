//! What stands before the trees: the head of the file, descriptors of grids, metadata, transforms.

use glam::{DMat4, DVec3};

use super::block::{Encoding, Layout, NODE_MASK_VERSION, Packing};
use super::tree::Leaves;
use crate::error::{Code, Error, Result};
use crate::io::bytes::Bytes;

/// The first eight bytes of a file.
const MAGIC: u64 = 0x5644_4220;
/// File versions that are read. 225 differs from 224 only in that it may hold half grids.
const OLDEST_VERSION: u32 = 220;
const NEWEST_VERSION: u32 = 225;
/// Characters of the file's unique identifier.
const UUID: usize = 36;
/// First version whose frustum transforms store their box in floating point.
const FRUSTUM_FLOAT_VERSION: u32 = 221;

/// Stands between a grid's name and the number that makes it unique.
const NAME_SEPARATOR: u8 = 0x1e;
/// Ends the type of a grid whose values are stored as half.
const HALF_SUFFIX: &str = "_HalfFloat";
/// The only tree that is drawn: the usual one of the library.
const TREE_CONFIGURATION: &str = "_5_4_3";

/// Most characters of a name in a message.
const QUOTED: usize = 60;

/// The head of a file.
#[derive(Clone, Copy, Debug)]
pub(super) struct Header {
    pub(super) version: u32,
    /// Whether grids say where they start and end; if not, they stand one after the other.
    pub(super) offsets: bool,
    /// Whether all grids are packed by zip (only before version 222).
    zip: bool,
}

impl Header {
    pub(super) fn read(file: &mut Bytes) -> Result<Header> {
        if file.u64()? != MAGIC {
            return Err(Error::new(Code::UnknownFormat, "The file is not an OpenVDB file.")
                .why("Its first bytes are not those of the format.")
                .hint("Open a .vdb or .nvdb file."));
        }
        let version = file.u32()?;
        let library = (file.u32()?, file.u32()?);
        if !(OLDEST_VERSION..=NEWEST_VERSION).contains(&version) {
            return Err(Error::new(Code::Version, format!("The file has OpenVDB file version {version}."))
                .why(format!(
                    "It was written by library {}.{}; file versions {OLDEST_VERSION} to {NEWEST_VERSION} are read.",
                    library.0, library.1
                ))
                .hint("Write it again with OpenVDB 10 or 11."));
        }
        let offsets = file.u8()? != 0;
        let zip = version < NODE_MASK_VERSION && file.u8()? != 0;
        file.take(UUID)?;
        Ok(Header { version, offsets, zip })
    }

    /// How a grid's blocks are packed, and whether they leave out inactive values.
    pub(super) fn compression(&self, file: &mut Bytes) -> Result<(Packing, bool)> {
        if self.version < NODE_MASK_VERSION {
            return Ok((if self.zip { Packing::Zip } else { Packing::None }, false));
        }
        let flags = file.u32()?;
        Layout::compression(flags).ok_or_else(|| file.corrupt(format!("the compression flags {flags:#x} are unknown")))
    }
}

/// The next text: its length, then its bytes.
fn text<'a>(file: &mut Bytes<'a>) -> Result<&'a [u8]> {
    let length = file.u32()? as usize;
    file.take(length)
}

/// Bytes as text; what is not UTF-8 stands as U+FFFD.
pub(super) fn lossy(text: &[u8]) -> String {
    String::from_utf8_lossy(text).into_owned()
}

/// A name from a file for a message: quoted, its control characters escaped, cut where it is long.
pub(super) fn quoted(name: &str) -> String {
    let short: String = name.chars().take(QUOTED).collect();
    format!("{short:?}{}", if short.len() < name.len() { "…" } else { "" })
}

/// What the metadata of a grid say that matters here.
#[derive(Clone, Debug, Default)]
pub(super) struct Metadata {
    /// The word for the class.
    pub(super) class: Option<String>,
    /// Whether the values are stored as half.
    pub(super) as_half: bool,
}

impl Metadata {
    /// Reads metadata of any type, which all say their size.
    pub(super) fn read(file: &mut Bytes) -> Result<Metadata> {
        let mut known = Metadata::default();
        for _ in 0..file.u32()? {
            let (name, kind, value) = (text(file)?, text(file)?, text(file)?);
            match (name, kind) {
                (b"class", b"string") => known.class = Some(lossy(value)),
                (b"is_saved_as_half_float", b"bool") => known.as_half = value.iter().any(|&byte| byte != 0),
                _ => {}
            }
        }
        Ok(known)
    }
}

/// What a file says about a grid before the grid itself.
#[derive(Clone, Debug)]
pub(super) struct Descriptor<'a> {
    /// Name with the number that makes it unique.
    pub(super) raw_name: &'a [u8],
    /// Name as stored, and as in `density[1]`.
    pub(super) name: String,
    pub(super) unique_name: String,
    /// Type of the tree, without the suffix for half.
    pub(super) tree_type: String,
    /// Raw unique name of the grid whose tree it shares; empty: it has its own.
    pub(super) parent: &'a [u8],
    /// Positions of the grid, of its leaf values and of its end.
    pub(super) positions: [i64; 3],
}

impl<'a> Descriptor<'a> {
    /// Bytes of the shortest descriptor.
    pub(super) const LEAST: usize = 3 * 4 + 3 * 8;

    pub(super) fn read(file: &mut Bytes<'a>) -> Result<Descriptor<'a>> {
        let raw_name = text(file)?;
        let full_type = lossy(text(file)?);
        let parent = text(file)?;
        let positions = [file.i64()?, file.i64()?, file.i64()?];
        let mut parts = raw_name.splitn(2, |&byte| byte == NAME_SEPARATOR);
        let name = lossy(parts.next().unwrap_or_default());
        let unique_name = match parts.next() {
            Some(number) => format!("{name}[{}]", lossy(number)),
            None => name.clone(),
        };
        let tree_type = full_type.strip_suffix(HALF_SUFFIX).unwrap_or(&full_type).to_owned();
        Ok(Descriptor { raw_name, name, unique_name, tree_type, parent, positions })
    }

    /// What grids are sorted by: the name, then the number that makes it unique.
    pub(super) fn order(&self) -> (&[u8], usize, &[u8]) {
        let end = self.raw_name.iter().position(|&byte| byte == NAME_SEPARATOR).unwrap_or(self.raw_name.len());
        let (name, number) = self.raw_name.split_at(end);
        (name, number.len(), number)
    }

    /// The type of the values, as the library names it.
    pub(super) fn value_type(&self) -> &str {
        let inner = self.tree_type.strip_prefix("Tree_").unwrap_or(&self.tree_type);
        inner.split('_').next().unwrap_or(inner)
    }

    /// What the tree holds and whether that is drawn.
    pub(super) fn content(&self) -> Content {
        let value_type = self.value_type();
        if self.tree_type != format!("Tree_{value_type}{TREE_CONFIGURATION}") {
            return Content::Opaque;
        }
        let numbers = |value_size, half_size| Content::Other { value_size, half_size, leaves: Leaves::Numbers };
        match value_type {
            "half" => Content::Scalar(Encoding::Half),
            "float" => Content::Scalar(Encoding::Float),
            "double" => Content::Scalar(Encoding::Double),
            "int32" | "uint32" => numbers(4, 4),
            "int64" => numbers(8, 8),
            "vec3i" => numbers(12, 12),
            "vec3s" => numbers(12, 6),
            "vec3d" => numbers(24, 6),
            "bool" => Content::Other { value_size: 1, half_size: 1, leaves: Leaves::Bits },
            "mask" => Content::Other { value_size: 1, half_size: 1, leaves: Leaves::Mask },
            _ => Content::Opaque,
        }
    }
}

/// What a tree holds.
#[derive(Clone, Copy, Debug)]
pub(super) enum Content {
    /// Densities or distances.
    Scalar(Encoding),
    /// Something else, but its length can be found; bytes of a value, alone and as half.
    Other { value_size: usize, half_size: usize, leaves: Leaves },
    /// Something whose length is not known.
    Opaque,
}

/// How index coordinates map to the world.
#[derive(Clone, Debug)]
pub(super) enum Map {
    /// World from index.
    Linear(DMat4),
    /// A perspective frustum.
    Frustum,
    /// A name that stands for no known map, so that its length is not known either.
    Unknown(String),
}

impl Map {
    /// The next transform.
    pub(super) fn read(file: &mut Bytes, version: u32) -> Result<Map> {
        let name = lossy(text(file)?);
        if name != "NonlinearFrustumMap" {
            return Self::linear(file, name);
        }
        let corner = if version < FRUSTUM_FLOAT_VERSION { 3 * 4 } else { 3 * 8 };
        file.take(2 * corner + 2 * 8)?;
        let inner = lossy(text(file)?);
        Ok(match Self::linear(file, inner)? {
            Map::Linear(_) => Map::Frustum,
            other => other,
        })
    }

    fn linear(file: &mut Bytes, name: String) -> Result<Map> {
        let vector = |file: &mut Bytes| Ok(DVec3::new(file.f64()?, file.f64()?, file.f64()?));
        // After the scale: voxel size, inverse, inverse of the square, half of the inverse.
        let scale = |file: &mut Bytes| {
            let scale = vector(file)?;
            file.take(4 * 3 * 8)?;
            Ok(scale)
        };
        let matrix = match &*name {
            "UniformScaleMap" | "ScaleMap" => DMat4::from_scale(scale(file)?),
            "UniformScaleTranslateMap" | "ScaleTranslateMap" => {
                let translation = vector(file)?;
                DMat4::from_translation(translation) * DMat4::from_scale(scale(file)?)
            }
            "TranslationMap" => DMat4::from_translation(vector(file)?),
            "AffineMap" | "UnitaryMap" => {
                // Rows of a matrix for row vectors are the columns of one for column vectors.
                let mut columns = [0.0; 16];
                for entry in &mut columns {
                    *entry = file.f64()?;
                }
                DMat4::from_cols_array(&columns)
            }
            _ => return Ok(Map::Unknown(name)),
        };
        if !matrix.is_finite() {
            return Err(file.corrupt("the transform is not finite"));
        }
        Ok(Map::Linear(matrix))
    }
}
