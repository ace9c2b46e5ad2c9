//! Reads NanoVDB files of major version 32 (32.3 to 32.9, later minors by the same layout): a file of segments with
//! tables of contents, or grids written raw one behind the other.
//!
//! The layout is that of the public header `NanoVDB.h`; within major version 32 what is read here did not change, only
//! the magic numbers (32.7) and what the checksum covers. Nothing in a file is trusted: offsets are checked for range,
//! alignment and overlap before a value is read, and memory stays within a small factor of the grid's stored size.

use std::borrow::Cow;

use super::bytes::Bytes;
use super::codec;
use crate::error::{Code, Error, Result, Warning};
use crate::volume::grid::{Entry, VolumeFile};
use header::GridHeader;

mod header;
#[cfg(test)]
pub(crate) mod tests;
mod tree;

/// The first seven bytes of a file, a segment or a raw grid.
pub const MAGIC: &[u8] = b"NanoVDB";
/// The digit behind [`MAGIC`]: `0` before 32.7 for files and grids alike, `1` a grid, `2` a file.
const MAGIC_OLD: u8 = b'0';
const MAGIC_GRID: u8 = b'1';
const MAGIC_FILE: u8 = b'2';
/// The only major version that this reader knows.
const MAJOR: u32 = 32;
/// Bytes of a segment's header and of a row of its table, without the name.
const SEGMENT_HEADER: usize = 16;
const TABLE_ROW: usize = 176;
/// Blosc buffers hold at most this many bytes of a grid.
const BLOSC_CHUNK: u64 = 1 << 30;

/// Reads all grids of a NanoVDB file.
///
/// A grid that cannot be drawn or is damaged has its error in [`Entry::grid`]; `unique_name` is the plain name.
///
/// # Errors
/// [`Code::Version`] for another major version, [`Code::Unsupported`] for an unknown codec, [`Code::Corrupt`] where the
/// file's frame is damaged or cut short.
pub fn read(bytes: &[u8]) -> Result<VolumeFile> {
    let mut file = VolumeFile { format: "nvdb", version: String::new(), grids: Vec::new(), warnings: Vec::new() };
    let mut data = Bytes::new(bytes);
    if is_raw(bytes)? {
        read_raw(&mut data, &mut file)?;
    } else {
        while data.remaining() > 0 {
            if !bytes[data.position()..].starts_with(MAGIC) && !file.version.is_empty() {
                file.warnings.push(damaged(format!("{} bytes after the last grid are ignored.", data.remaining())));
                break;
            }
            read_segment(&mut data, &mut file)?;
        }
    }
    if file.grids.is_empty() {
        file.warnings.push(Warning { code: "empty_grid", text: "The file has no grids.".to_owned() });
    }
    Ok(file)
}

/// Whether the file is bare grids. Under the magic number that files and grids shared, a grid has its version where a
/// segment has the size of its first grid, and a checksum where a segment has its version.
fn is_raw(bytes: &[u8]) -> Result<bool> {
    let mut data = Bytes::new(bytes);
    if data.take(MAGIC.len())? != MAGIC {
        return Err(Bytes::new(bytes).corrupt("it does not begin with the magic number of NanoVDB"));
    }
    match data.u8()? {
        MAGIC_GRID => Ok(true),
        MAGIC_FILE => Ok(false),
        MAGIC_OLD => {
            let segment = Version(data.u32()?);
            data.u32()?;
            Ok(segment.major() != MAJOR && data.u32().is_ok_and(|version| Version(version).major() == MAJOR))
        }
        other => Err(Error::new(Code::Version, "This kind of NanoVDB file is not known.")
            .why(format!("Its first bytes end in {:?}; known are 0, 1 and 2.", char::from(other)))
            .hint("Update nephele, or write the file with NanoVDB 32.")),
    }
}

/// Reads grids that stand one behind the other.
fn read_raw(data: &mut Bytes, file: &mut VolumeFile) -> Result<()> {
    while data.remaining() > 0 {
        let rest = data.clone().take(data.remaining())?;
        if !rest.starts_with(MAGIC) && !file.grids.is_empty() {
            file.warnings.push(damaged(format!("{} bytes after the last grid are ignored.", rest.len())));
            break;
        }
        let header = GridHeader::parse(rest)?;
        file.add_version(header.version);
        let size = usize::try_from(header.grid_size).ok().filter(|&size| (tree::ROOT_MIN..=rest.len()).contains(&size));
        let Some(size) = size else {
            return Err(data.corrupt(format!("a grid claims {} bytes, {} are left", header.grid_size, rest.len())));
        };
        file.add(&header, data.take(size)?);
    }
    Ok(())
}

/// Reads a segment: its header, its table of contents and its grids.
fn read_segment(data: &mut Bytes, file: &mut VolumeFile) -> Result<()> {
    let mut header = Bytes::new(data.take(SEGMENT_HEADER)?);
    header.take(MAGIC.len() + 1)?;
    let version = Version(header.u32()?);
    version.check()?;
    file.add_version(version);
    let (count, codec) = (header.u16()?, Codec::of(header.u16()?)?);
    let mut rows = Vec::new(); // not allocated ahead: the count is untrusted
    for _ in 0..count {
        rows.push(Row::parse(data)?);
    }
    for row in rows {
        let start = data.position();
        let packed = codec.frame(data, row.grid_size)?;
        if (data.position() - start) as u64 != row.file_size {
            let (claim, found) = (row.file_size, data.position() - start);
            file.warnings
                .push(damaged(format!("The table says {claim} bytes for grid {:?}; it has {found}.", row.name)));
        }
        match codec.decode(&packed, row.grid_size).and_then(|grid| Ok((GridHeader::parse(&grid)?, grid))) {
            Ok((header, grid)) => {
                if (header.value_type, header.class) != (row.value_type, row.class) {
                    let text = format!("The table and grid {:?} itself disagree about its type or class.", header.name);
                    file.warnings.push(damaged(text));
                }
                file.add(&header, &grid);
            }
            Err(error) if error.code == Code::Version => return Err(error),
            Err(error) => file.grids.push(row.broken(error)),
        }
    }
    Ok(())
}

impl VolumeFile {
    /// Keeps the version of the first segment or grid.
    fn add_version(&mut self, version: Version) {
        if self.version.is_empty() {
            self.version = format!("{}.{}", version.major(), version.minor());
        }
    }

    /// Adds the grid whose bytes are `grid`.
    fn add(&mut self, header: &GridHeader, grid: &[u8]) {
        if header.checksum_holds(grid) == Some(false) {
            let text = format!("The checksum of grid {:?} does not match: it is damaged or was changed.", header.name);
            self.warnings.push(Warning { code: "checksum", text });
        }
        let decoded = tree::read(header, grid).map_err(|mut error| {
            if error.code == Code::Corrupt {
                error.what = format!("Grid {:?} is damaged or cut short.", header.name);
            }
            error
        });
        self.grids.push(Entry {
            name: header.name.clone(),
            unique_name: header.name.clone(),
            value_type: header::type_name(header.value_type),
            class_name: header::class_name(header.class),
            world_from_index: Some(header.world_from_index),
            grid: decoded,
        });
    }
}

/// A row of a segment's table of contents, as far as it is needed.
struct Row {
    /// Bytes of the grid in memory and in the file.
    grid_size: u64,
    file_size: u64,
    value_type: u32,
    class: u32,
    name: String,
}

impl Row {
    fn parse(data: &mut Bytes) -> Result<Row> {
        let mut row = Bytes::new(data.take(TABLE_ROW)?);
        let (grid_size, file_size) = (row.u64()?, row.u64()?);
        row.take(2 * 8)?; // hash of the name, number of active voxels
        let (value_type, class) = (row.u32()?, row.u32()?);
        row.take(6 * 8 + 6 * 4 + 3 * 8)?; // boxes in world and index space, size of a voxel
        let name_bytes = row.u32()? as usize;
        let name = header::text(data.take(name_bytes)?);
        Ok(Row { grid_size, file_size, value_type, class, name })
    }

    /// The entry of a grid whose bytes could not be decoded.
    fn broken(self, error: Error) -> Entry {
        Entry {
            unique_name: self.name.clone(),
            name: self.name,
            value_type: header::type_name(self.value_type),
            class_name: header::class_name(self.class),
            world_from_index: None,
            grid: Err(error),
        }
    }
}

/// How the grids of a segment are compressed.
#[derive(Clone, Copy)]
enum Codec {
    None,
    Zip,
    Blosc,
}

impl Codec {
    fn of(number: u16) -> Result<Codec> {
        match number {
            0 => Ok(Codec::None),
            1 => Ok(Codec::Zip),
            2 => Ok(Codec::Blosc),
            _ => Err(Error::new(Code::Unsupported, format!("The file uses NanoVDB codec number {number}."))
                .why("This build knows none, zip and Blosc (0 to 2).")
                .hint("Write the file again with one of them.")),
        }
    }

    /// The stored pieces of a grid of `size` bytes.
    fn frame<'a>(self, data: &mut Bytes<'a>, size: u64) -> Result<Vec<&'a [u8]>> {
        let piece = |data: &mut Bytes<'a>, length: u64| match usize::try_from(length) {
            Ok(length) if length <= data.remaining() => data.take(length),
            _ => Err(data.corrupt(format!("{length} bytes are needed, but only {} are left", data.remaining()))),
        };
        let pieces = match self {
            Codec::None => return Ok(vec![piece(data, size)?]),
            Codec::Zip => 1,
            Codec::Blosc => size.div_ceil(BLOSC_CHUNK).max(1),
        };
        let mut packed = Vec::new();
        for _ in 0..pieces {
            let length = data.u64()?;
            packed.push(piece(data, length)?);
        }
        Ok(packed)
    }

    /// The grid of `size` bytes from its stored pieces.
    fn decode<'a>(self, packed: &[&'a [u8]], size: u64) -> Result<Cow<'a, [u8]>> {
        let length = |size: u64| {
            usize::try_from(size).map_err(|_| {
                Error::new(Code::TooLarge, format!("A grid of {size} bytes does not fit into memory."))
                    .hint("Open it on a 64-bit system.")
            })
        };
        match (self, packed) {
            (Codec::None, [grid]) => Ok(Cow::Borrowed(grid)),
            (Codec::Zip, [packed]) => Ok(Cow::Owned(codec::unzip(packed, length(size)?)?)),
            (Codec::Blosc, [packed]) => Ok(Cow::Owned(codec::unblosc(packed, length(size)?)?)),
            (_, pieces) => {
                let mut grid = Vec::new();
                let mut left = size;
                for packed in pieces {
                    let chunk = left.min(BLOSC_CHUNK);
                    grid.append(&mut codec::unblosc(packed, length(chunk)?)?);
                    left -= chunk;
                }
                Ok(Cow::Owned(grid))
            }
        }
    }
}

/// A version in 11, 11 and 10 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Version(u32);

impl Version {
    const fn new(major: u32, minor: u32, patch: u32) -> Version {
        Version(major << 21 | minor << 10 | patch)
    }

    fn major(self) -> u32 {
        self.0 >> 21
    }

    fn minor(self) -> u32 {
        self.0 >> 10 & 0x7ff
    }

    /// Refuses another major version.
    fn check(self) -> Result<()> {
        if self.major() == MAJOR {
            return Ok(());
        }
        let version = format!("{}.{}", self.major(), self.minor());
        let hint = if self.major() > MAJOR { "Update nephele, or write the file" } else { "Write the file" };
        Err(Error::new(Code::Version, format!("The file has NanoVDB version {version}."))
            .why(format!("This build reads version {MAJOR}."))
            .hint(format!("{hint} again with NanoVDB {MAJOR}.")))
    }
}

fn damaged(text: String) -> Warning {
    Warning { code: "damaged", text }
}
