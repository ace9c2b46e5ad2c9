//! The values of one node as an OpenVDB file stores them: perhaps without the inactive ones, as half, compressed.

use std::borrow::Cow;
use std::ops::Neg;

use half::f16;

use crate::error::{Code, Error, Result};
use crate::io::bytes::Bytes;
use crate::io::codec;

/// First file version in which nodes say which inactive values they leave out.
pub(super) const NODE_MASK_VERSION: u32 = 222;

/// Compression flags of a grid.
const ZIP: u32 = 1;
const ACTIVE_MASK: u32 = 2;
const BLOSC: u32 = 4;

/// How a node stores its inactive values under mask compression.
const INACTIVE_BACKGROUND: u8 = 0;
const ONE_INACTIVE: u8 = 2;
const MASK: u8 = 3;
const MASK_AND_ONE_INACTIVE: u8 = 4;
const MASK_AND_TWO_INACTIVE: u8 = 5;
const ALL_VALUES: u8 = 6;

/// How a number is stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Encoding {
    Half,
    Float,
    Double,
}

impl Encoding {
    /// Its bytes.
    pub(super) fn size(self) -> usize {
        match self {
            Encoding::Half => 2,
            Encoding::Float => 4,
            Encoding::Double => 8,
        }
    }
}

/// A number that values are decoded to.
pub(super) trait Real: Copy + Default + Into<f64> + Neg<Output = Self> + Send + Sync {
    fn from_f16(value: f16) -> Self;
    fn from_f32(value: f32) -> Self;
    fn from_f64(value: f64) -> Self;
}

impl Real for f32 {
    fn from_f16(value: f16) -> f32 {
        value.to_f32()
    }
    fn from_f32(value: f32) -> f32 {
        value
    }
    fn from_f64(value: f64) -> f32 {
        value as f32
    }
}

impl Real for f64 {
    fn from_f16(value: f16) -> f64 {
        value.to_f64()
    }
    fn from_f32(value: f32) -> f64 {
        value.into()
    }
    fn from_f64(value: f64) -> f64 {
        value
    }
}

/// Decodes as many numbers of `raw` as fit into `out`.
fn decode_numbers<T: Real>(raw: &[u8], encoding: Encoding, out: &mut [T]) {
    fn each<T, const N: usize>(raw: &[u8], out: &mut [T], number: impl Fn([u8; N]) -> T) {
        for (value, bytes) in out.iter_mut().zip(raw.as_chunks::<N>().0) {
            *value = number(*bytes);
        }
    }
    match encoding {
        Encoding::Half => each(raw, out, |b| T::from_f16(f16::from_le_bytes(b))),
        Encoding::Float => each(raw, out, |b| T::from_f32(f32::from_le_bytes(b))),
        Encoding::Double => each(raw, out, |b| T::from_f64(f64::from_le_bytes(b))),
    }
}

/// The number that `raw` starts with.
pub(super) fn number<T: Real>(raw: &[u8], encoding: Encoding) -> T {
    let mut value = [T::default()];
    decode_numbers(raw, encoding, &mut value);
    value[0]
}

/// How many ones a mask of bits has.
pub(super) fn ones(mask: &[u8]) -> usize {
    mask.iter().map(|byte| byte.count_ones() as usize).sum()
}

/// Whether bit `i` of a mask is one.
pub(super) fn bit(mask: &[u8], i: usize) -> bool {
    mask[i >> 3] >> (i & 7) & 1 == 1
}

/// What packs the bytes of a block.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Packing {
    None,
    Zip,
    Blosc,
}

/// How all blocks of a grid are stored.
#[derive(Clone, Copy, Debug)]
pub(super) struct Layout {
    /// File version.
    pub(super) version: u32,
    /// What packs the values.
    pub(super) packing: Packing,
    /// Whether inactive values may be left out.
    pub(super) masked: bool,
    /// Bytes of a single value: background, tile of the root, inactive value.
    pub(super) value_size: usize,
    /// Bytes of a value among many, which may be stored as half.
    pub(super) packed_size: usize,
    /// Whether values among many are stored as half, where blocks of no values have not even a length.
    pub(super) as_half: bool,
}

impl Layout {
    /// Packing and masking from the flags of a grid; `None` where a flag is unknown.
    pub(super) fn compression(flags: u32) -> Option<(Packing, bool)> {
        let packing = match flags {
            _ if flags & !(ZIP | ACTIVE_MASK | BLOSC) != 0 => return None,
            _ if flags & BLOSC != 0 => Packing::Blosc,
            _ if flags & ZIP != 0 => Packing::Zip,
            _ => Packing::None,
        };
        Some((packing, flags & ACTIVE_MASK != 0))
    }
}

/// The values of a node, not yet decoded.
#[derive(Clone, Debug)]
pub(super) struct Block<'a> {
    /// Where in the file it starts.
    position: usize,
    /// One of the codes above.
    code: u8,
    /// The inactive values that stand in the file.
    inactive: [Option<&'a [u8]>; 2],
    /// Which voxels have the second inactive value.
    selection: Option<&'a [u8]>,
    /// How many values are stored.
    count: usize,
    packing: Packing,
    data: &'a [u8],
}

impl<'a> Block<'a> {
    /// The next block: of a node of `total` values (before version 222: of stored ones), those of `active` active.
    pub(super) fn read(file: &mut Bytes<'a>, layout: &Layout, total: usize, active: &[u8]) -> Result<Block<'a>> {
        let position = file.position();
        let code = if layout.version >= NODE_MASK_VERSION { file.u8()? } else { ALL_VALUES };
        if code > ALL_VALUES {
            return Err(file.corrupt(format!("a node stores its inactive values in the unknown way {code}")));
        }
        let mut inactive = [None; 2];
        if matches!(code, ONE_INACTIVE | MASK_AND_ONE_INACTIVE | MASK_AND_TWO_INACTIVE) {
            inactive[0] = Some(file.take(layout.value_size)?);
        }
        if code == MASK_AND_TWO_INACTIVE {
            inactive[1] = Some(file.take(layout.value_size)?);
        }
        let selection = match code {
            MASK | MASK_AND_ONE_INACTIVE | MASK_AND_TWO_INACTIVE => Some(file.take(active.len())?),
            _ => None,
        };
        let count = if layout.masked && code != ALL_VALUES { ones(active) } else { total };
        let (packing, data) = Self::data(file, layout, count)?;
        Ok(Block { position, code, inactive, selection, count, packing, data })
    }

    /// Goes beyond the data of `count` values that stand without a mask.
    pub(super) fn skip_data(file: &mut Bytes<'a>, layout: &Layout, count: usize) -> Result<()> {
        Self::data(file, layout, count).map(drop)
    }

    fn data(file: &mut Bytes<'a>, layout: &Layout, count: usize) -> Result<(Packing, &'a [u8])> {
        let size = count * layout.packed_size;
        if layout.packing == Packing::None || (layout.as_half && count == 0) {
            return Ok((Packing::None, file.take(size)?));
        }
        let length = file.i64()?;
        let bytes = usize::try_from(length.unsigned_abs()).unwrap_or(usize::MAX);
        if length > 0 {
            return Ok((layout.packing, file.take(bytes)?));
        }
        // A length below zero: packing would not have made it smaller.
        if bytes != size {
            return Err(file.corrupt(format!("a node of {size} bytes of values has {bytes}")));
        }
        Ok((Packing::None, file.take(size)?))
    }

    /// Decodes all values of the node into `out`: the stored ones where `stored` has a one (all if as many are
    /// stored), the inactive values elsewhere.
    pub(super) fn decode<T: Real>(
        &self,
        (single, many): (Encoding, Encoding),
        background: T,
        stored: &[u8],
        out: &mut [T],
    ) -> Result<()> {
        let size = self.count * many.size();
        let raw = match self.packing {
            Packing::None => Cow::Borrowed(self.data),
            Packing::Zip => Cow::Owned(codec::unzip(self.data, size).map_err(|e| self.at(e))?),
            Packing::Blosc => Cow::Owned(codec::unblosc(self.data, size).map_err(|e| self.at(e))?),
        };
        decode_numbers(&raw, many, &mut out[..self.count]);
        if self.count == out.len() {
            return Ok(());
        }
        let unstored = if self.code == INACTIVE_BACKGROUND { background } else { -background };
        let inactive = [
            self.inactive[0].map_or(unstored, |raw| number(raw, single)),
            self.inactive[1].map_or(background, |raw| number(raw, single)),
        ];
        // The stored values stand packed at the start; from the end, none is overwritten before it has moved.
        let mut next = self.count;
        for i in (0..out.len()).rev() {
            out[i] = if bit(stored, i) {
                next -= 1;
                out[next]
            } else {
                inactive[usize::from(self.selection.is_some_and(|mask| bit(mask, i)))]
            };
        }
        Ok(())
    }

    /// The codec's error with the place of this block.
    fn at(&self, error: Error) -> Error {
        if error.code != Code::Corrupt {
            return error;
        }
        let detail = if error.why.is_empty() { error.what } else { error.why };
        Error::new(Code::Corrupt, "The file is damaged or cut short.")
            .why(format!("In the node at byte {}: {detail}", self.position))
            .hint("Copy or export the file again.")
    }
}
