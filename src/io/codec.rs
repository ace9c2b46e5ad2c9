//! The compressed blocks of both volume formats: zip (a zlib stream) and Blosc 1.
//!
//! Every function returns exactly the bytes that were expected or an error, whatever the input. The size that a file
//! claims is held against what its compressed bytes can expand to at most before anything of that size is allocated,
//! so memory is bounded by the file's size times the bound of its codec:
//!
//! | codec | bound | because |
//! | --- | --- | --- |
//! | Deflate | 1032 | two bits (a length and a distance code of one bit each) yield at most 258 bytes |
//! | LZ4, BloscLZ | 255 | a further length byte yields at most 255 bytes |
//! | Snappy | 22 | a copy of three bytes yields at most 64 bytes |
//! | Zstandard | 2¹⁵ | a block of at least four bytes yields at most 128 KiB |
//!
//! A Zstandard frame may ask for a window of its own; the decoder refuses one of more than 100 MiB.

use std::io::Read;

use crate::error::{Code, Error, Result};

/// Greatest expansion of a Deflate stream, bytes out per byte in.
const DEFLATE_RATIO: usize = 1032;
/// Greatest expansion of LZ4 and BloscLZ.
const LZ_RATIO: usize = 255;
/// Greatest expansion of Snappy.
const SNAPPY_RATIO: usize = 22;
/// Greatest expansion of Zstandard.
const ZSTD_RATIO: usize = 1 << 15;

/// Bytes of a Blosc header.
const BLOSC_HEADER: usize = 16;
/// The version of the format that all of Blosc 1 writes.
const BLOSC_VERSION: u8 = 2;
/// Header flags.
const BLOSC_SHUFFLE: u8 = 1;
const BLOSC_COPIED: u8 = 2;
const BLOSC_BIT_SHUFFLE: u8 = 4;
const BLOSC_FUTURE: u8 = 8;
const BLOSC_UNSPLIT: u8 = 16;
/// The codec stands in the flags from this bit on.
const BLOSC_CODEC_SHIFT: u32 = 5;
/// A block is split into one stream per byte of the type up to this size …
const BLOSC_MAX_SPLITS: usize = 16;
/// … if each stream has at least this many bytes.
const BLOSC_MIN_SPLIT: usize = 128;

/// Decodes a zlib stream of exactly `expected` bytes. Bytes after the end of the stream are ignored, as zlib does.
///
/// # Errors
/// [`Code::Corrupt`] for a damaged stream, a wrong checksum or another length; [`Code::TooLarge`] without the memory.
pub fn unzip(data: &[u8], expected: usize) -> Result<Vec<u8>> {
    justified("zip", data.len(), expected, DEFLATE_RATIO)?;
    let mut out = Vec::new();
    out.try_reserve_exact(expected).map_err(|_| no_memory(expected))?;
    // One byte more than expected, so that a longer stream shows, and so that the end with its checksum is read.
    let read = flate2::read::ZlibDecoder::new(data).take(expected as u64 + 1).read_to_end(&mut out);
    match read {
        Err(e) => Err(corrupt(format!("The zip stream cannot be decoded: {e}."))),
        Ok(n) if n == expected => Ok(out),
        Ok(n) => Err(corrupt(format!("The zip stream holds {} bytes, not {expected}.", at_most(n, expected)))),
    }
}

/// Decodes a Blosc 1 buffer of exactly `expected` bytes: shuffle or bit-shuffle, split streams, plain copies; codecs
/// BloscLZ, LZ4, Snappy, zlib and Zstandard. Needs one block (at most `expected` bytes) beside the result.
///
/// # Errors
/// [`Code::Corrupt`] for damaged data or another length, [`Code::Unsupported`] for an unknown codec or version, by
/// name; [`Code::TooLarge`] without the memory.
pub fn unblosc(data: &[u8], expected: usize) -> Result<Vec<u8>> {
    let header = Header::parse(data, expected)?;
    let data = &data[..header.compressed];
    if header.flags & BLOSC_COPIED != 0 {
        return match &data[BLOSC_HEADER..] {
            body if body.len() == expected => Ok(body.to_vec()),
            body => Err(corrupt(format!("The Blosc buffer stores {} bytes, not {expected}.", body.len()))),
        };
    }
    if expected == 0 {
        return Ok(Vec::new());
    }
    let codec = Codec::of(header.flags >> BLOSC_CODEC_SHIFT)?;
    justified(codec.name(), data.len(), expected, codec.ratio())?;
    let mut out = zeros(expected)?;
    // Plain bytes need no second buffer.
    let shuffled = header.flags & (BLOSC_SHUFFLE | BLOSC_BIT_SHUFFLE) != 0;
    let mut scratch = zeros(if shuffled { header.block.min(expected) } else { 0 })?;
    for (i, block) in out.chunks_mut(header.block).enumerate() {
        let start = u32_at(data, BLOSC_HEADER + 4 * i).ok_or_else(|| blosc_short(data))? as usize;
        // Only a shorter last block is never split.
        let streams = if header.splits(block.len()) { header.type_size } else { 1 };
        if !shuffled {
            streams_of(codec, data, start, streams, block)?;
            continue;
        }
        let planes = &mut scratch[..block.len()];
        streams_of(codec, data, start, streams, planes)?;
        if header.flags & BLOSC_SHUFFLE != 0 {
            unshuffle(planes, block, header.type_size);
        } else {
            unshuffle_bits(planes, block, header.type_size);
        }
    }
    Ok(out)
}

/// What the first 16 bytes of a Blosc buffer say, checked against the data at hand.
struct Header {
    flags: u8,
    type_size: usize,
    block: usize,
    compressed: usize,
}

impl Header {
    fn parse(data: &[u8], expected: usize) -> Result<Header> {
        if data.len() < BLOSC_HEADER {
            return Err(blosc_short(data));
        }
        let word = |at: usize| u32_at(data, at).expect("the header is there") as usize;
        let (version, flags, type_size) = (data[0], data[2], data[3] as usize);
        let (bytes, block, compressed) = (word(4), word(8), word(12));
        if version != BLOSC_VERSION || flags & BLOSC_FUTURE != 0 {
            return Err(Error::new(Code::Unsupported, "A block is compressed with another version of Blosc.")
                .why(format!("It says format {version}, flags {flags:#04x}; this build reads Blosc 1 (format 2)."))
                .hint("Write the file again with OpenVDB or NanoVDB, or without compression."));
        }
        if bytes != expected {
            return Err(corrupt(format!("The Blosc buffer holds {bytes} bytes, not {expected}.")));
        }
        if compressed < BLOSC_HEADER || compressed > data.len() {
            let have = data.len();
            return Err(corrupt(format!("The Blosc buffer claims {compressed} compressed bytes and has {have}.")));
        }
        if expected > 0 && (block == 0 || type_size == 0) {
            return Err(corrupt("The Blosc buffer has blocks or values of no bytes."));
        }
        Ok(Header { flags, type_size, block, compressed })
    }

    /// Whether a block of this many bytes is stored as one stream per byte of the type.
    fn splits(&self, block: usize) -> bool {
        self.flags & BLOSC_UNSPLIT == 0
            && self.type_size <= BLOSC_MAX_SPLITS
            && block / self.type_size >= BLOSC_MIN_SPLIT
            && block == self.block
    }
}

/// Decodes the `streams` equal streams of a block, the first at byte `start`, each behind its compressed length.
fn streams_of(codec: Codec, data: &[u8], start: usize, streams: usize, out: &mut [u8]) -> Result<()> {
    if !out.len().is_multiple_of(streams) {
        return Err(corrupt(format!("A Blosc block of {} bytes cannot be split {streams} times.", out.len())));
    }
    let size = out.len() / streams;
    let mut at = start;
    for stream in out.chunks_exact_mut(size) {
        let length = u32_at(data, at).ok_or_else(|| blosc_short(data))? as usize;
        let body = at + 4;
        let packed = data.get(body..).and_then(|rest| rest.get(..length)).ok_or_else(|| blosc_short(data))?;
        at = body + length;
        if length == size {
            stream.copy_from_slice(packed); // did not shrink
        } else {
            codec.decode(packed, stream)?;
        }
    }
    Ok(())
}

/// The codecs inside Blosc, by their number in the header.
#[derive(Clone, Copy)]
enum Codec {
    BloscLz,
    Lz4,
    Snappy,
    Zlib,
    Zstd,
}

impl Codec {
    fn of(number: u8) -> Result<Codec> {
        Ok(match number {
            0 => Codec::BloscLz,
            1 => Codec::Lz4, // LZ4HC writes the same
            2 => Codec::Snappy,
            3 => Codec::Zlib,
            4 => Codec::Zstd,
            _ => {
                return Err(Error::new(Code::Unsupported, format!("A block uses Blosc codec number {number}."))
                    .why("This build knows BloscLZ, LZ4, Snappy, zlib and Zstandard (0 to 4).")
                    .hint("Write the file again with one of them, or without compression."));
            }
        })
    }

    fn name(self) -> &'static str {
        match self {
            Codec::BloscLz => "BloscLZ",
            Codec::Lz4 => "LZ4",
            Codec::Snappy => "Snappy",
            Codec::Zlib => "zlib",
            Codec::Zstd => "Zstandard",
        }
    }

    /// Greatest number of bytes that a compressed byte yields; see the head of this file.
    fn ratio(self) -> usize {
        match self {
            Codec::BloscLz | Codec::Lz4 => LZ_RATIO,
            Codec::Snappy => SNAPPY_RATIO,
            Codec::Zlib => DEFLATE_RATIO,
            Codec::Zstd => ZSTD_RATIO,
        }
    }

    /// Fills `out` from one compressed stream.
    fn decode(self, data: &[u8], out: &mut [u8]) -> Result<()> {
        let expected = out.len();
        let decoded = match self {
            Codec::BloscLz => un_blosc_lz(data, out).ok_or_else(|| "the stream is damaged".to_owned()),
            Codec::Lz4 => lz4_flex::block::decompress_into(data, out).map_err(|e| e.to_string()),
            Codec::Snappy => snap::raw::Decoder::new().decompress(data, out).map_err(|e| e.to_string()),
            Codec::Zlib => {
                unzip(data, expected).map(|bytes| out.copy_from_slice(&bytes)).map(|()| expected).map_err(|e| e.why)
            }
            Codec::Zstd => ruzstd::decoding::FrameDecoder::new().decode_all(data, out).map_err(|e| e.to_string()),
        };
        match decoded {
            Ok(n) if n == expected => Ok(()),
            Ok(n) => Err(corrupt(format!("A {} stream holds {n} bytes, not {expected}.", self.name()))),
            Err(e) => Err(corrupt(format!("A {} stream cannot be decoded: {}.", self.name(), e.trim_end_matches('.')))),
        }
    }
}

/// Decodes a BloscLZ stream into `out` and returns the number of bytes written, or `None` for bytes that are none.
///
/// The stream is a series of runs, each begun by a control byte (the first one's upper three bits do not count). Below
/// 32: that many literals and one more follow. Else a match: its length is the upper three bits plus 2, and if those are all set,
/// the following bytes add to it up to and including the first that is not 255; its distance, less one, is the lower five bits and another
/// byte, and if all thirteen bits are set, 8191 and two more bytes, the greater first.
fn un_blosc_lz(data: &[u8], out: &mut [u8]) -> Option<usize> {
    const MATCH: u8 = 32;
    const NEAR: usize = 8191; // the distance field of thirteen bits, all set
    let mut bytes = data.iter();
    let mut next = || bytes.next().copied();
    let mut control = next()? & (MATCH - 1);
    let mut at = 0;
    loop {
        if control < MATCH {
            for _ in 0..=control {
                *out.get_mut(at)? = next()?;
                at += 1;
            }
        } else {
            let mut length = (control >> 5) as usize + 2;
            if control >> 5 == 7 {
                loop {
                    let more = next()?;
                    length += more as usize;
                    if more != u8::MAX {
                        break;
                    }
                }
            }
            let mut distance = ((control & (MATCH - 1)) as usize) << 8 | next()? as usize;
            if distance == NEAR {
                distance += (next()? as usize) << 8 | next()? as usize;
            }
            let from = at.checked_sub(distance + 1)?;
            let end = at.checked_add(length).filter(|&end| end <= out.len())?;
            if distance + 1 >= length {
                out.copy_within(from..from + length, at);
            } else {
                for i in 0..length {
                    out[at + i] = out[from + i]; // a run: reads what it wrote
                }
            }
            at = end;
        }
        match next() {
            Some(byte) => control = byte,
            None => return Some(at),
        }
    }
}

/// Undoes the byte shuffle: plane k holds byte k of every value; bytes beyond the last whole value are plain.
fn unshuffle(planes: &[u8], out: &mut [u8], type_size: usize) {
    match type_size {
        2 => unshuffle_of::<2>(planes, out),
        4 => unshuffle_of::<4>(planes, out),
        8 => unshuffle_of::<8>(planes, out),
        _ => {
            let values = planes.len() / type_size;
            for (i, value) in out.chunks_exact_mut(type_size).enumerate() {
                for (k, byte) in value.iter_mut().enumerate() {
                    *byte = planes[k * values + i];
                }
            }
            let plain = values * type_size;
            out[plain..].copy_from_slice(&planes[plain..]);
        }
    }
}

/// [`unshuffle`] for a size that the compiler knows.
fn unshuffle_of<const N: usize>(planes: &[u8], out: &mut [u8]) {
    let values = planes.len() / N;
    let plane: [&[u8]; N] = std::array::from_fn(|k| &planes[k * values..(k + 1) * values]);
    let (whole, plain) = out.as_chunks_mut::<N>();
    for (i, value) in whole.iter_mut().enumerate() {
        *value = std::array::from_fn(|k| plane[k][i]);
    }
    plain.copy_from_slice(&planes[values * N..]);
}

/// Undoes the bit shuffle: row 8k + b holds bit b of byte k of every value, eight values a byte, the first in the lowest
/// bit. Blosc leaves a block plain whose number of values is no multiple of eight.
fn unshuffle_bits(rows: &[u8], out: &mut [u8], type_size: usize) {
    let values = rows.len() / type_size;
    if !values.is_multiple_of(8) {
        out.copy_from_slice(rows);
        return;
    }
    let row_bytes = values / 8;
    for (i, value) in out.chunks_exact_mut(type_size).enumerate() {
        for (k, byte) in value.iter_mut().enumerate() {
            let bit = |b: usize| (rows[(8 * k + b) * row_bytes + i / 8] >> (i % 8) & 1) << b;
            *byte = (0..8).fold(0, |byte, b| byte | bit(b));
        }
    }
    let plain = values * type_size;
    out[plain..].copy_from_slice(&rows[plain..]);
}

/// Refuses a size that the compressed bytes cannot expand to.
fn justified(codec: &str, have: usize, expected: usize, ratio: usize) -> Result<()> {
    if expected > have.saturating_mul(ratio) {
        return Err(corrupt(format!("{have} bytes of {codec} cannot hold the {expected} bytes that the file claims.")));
    }
    Ok(())
}

/// `length` zero bytes, or an error where there is no memory for them.
fn zeros(length: usize) -> Result<Vec<u8>> {
    let mut out = Vec::new();
    out.try_reserve_exact(length).map_err(|_| no_memory(length))?;
    out.resize(length, 0);
    Ok(out)
}

fn u32_at(data: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*data.get(at..)?.first_chunk()?))
}

fn at_most(length: usize, expected: usize) -> String {
    if length > expected { format!("more than {expected}") } else { length.to_string() }
}

fn blosc_short(data: &[u8]) -> Error {
    corrupt(format!("The Blosc buffer of {} bytes ends inside a block.", data.len()))
}

fn corrupt(why: impl Into<String>) -> Error {
    Error::new(Code::Corrupt, "A compressed block is damaged.")
        .why(why)
        .hint("Copy or download the file again, or write it again.")
}

fn no_memory(bytes: usize) -> Error {
    Error::new(Code::TooLarge, "A compressed block does not fit into memory.")
        .why(format!("It holds {bytes} bytes."))
        .hint("Close other programs or use a smaller file.")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "nephele draws clouds; " over and over, 300 bytes, by c-blosc 1.21 with BloscLZ.
    const BLOSC_LZ: [u8; 54] = [
        2, 1, 0, 1, 44, 1, 0, 0, 44, 1, 0, 0, 54, 0, 0, 0, 20, 0, 0, 0, 30, 0, 0, 0, 53, 110, 101, 112, 104, 101, 108,
        101, 32, 100, 114, 97, 119, 115, 32, 99, 108, 111, 117, 100, 115, 59, 32, 224, 255, 12, 21, 1, 115, 32,
    ];
    /// The floats 0, 0.5, … 47.5, bit-shuffled, by c-blosc 1.21 with zlib.
    const BIT_SHUFFLED: [u8; 94] = [
        2, 1, 116, 4, 128, 1, 0, 0, 128, 1, 0, 0, 94, 0, 0, 0, 20, 0, 0, 0, 70, 0, 0, 0, 120, 218, 99, 96, 24, 126, 96,
        21, 16, 192, 232, 51, 64, 0, 98, 129, 232, 15, 64, 192, 176, 10, 74, 255, 103, 248, 191, 224, 12, 132, 102, 96,
        248, 255, 255, 196, 7, 8, 13, 210, 199, 3, 102, 65, 216, 124, 96, 22, 140, 13, 1, 32, 62, 31, 146, 125, 196,
        176, 63, 252, 71, 0, 100, 183, 2, 0, 152, 101, 63, 248,
    ];
    const CODECS: [Codec; 5] = [Codec::BloscLz, Codec::Lz4, Codec::Snappy, Codec::Zlib, Codec::Zstd];

    fn zip(data: &[u8]) -> Vec<u8> {
        let mut out = Vec::new();
        flate2::read::ZlibEncoder::new(data, flate2::Compression::best()).read_to_end(&mut out).unwrap();
        out
    }

    fn pack(codec: Codec, data: &[u8]) -> Vec<u8> {
        match codec {
            Codec::BloscLz => data.chunks(32).flat_map(|run| [&[run.len() as u8 - 1], run].concat()).collect(),
            Codec::Lz4 => lz4_flex::block::compress(data),
            Codec::Snappy => snap::raw::Encoder::new().compress_vec(data).unwrap(),
            Codec::Zlib => zip(data),
            Codec::Zstd => ruzstd::encoding::compress_to_vec(data, ruzstd::encoding::CompressionLevel::Fastest),
        }
    }

    /// A Blosc buffer with byte shuffle, its whole blocks split where the format wants it.
    fn blosc(codec: Codec, data: &[u8], type_size: usize, block: usize) -> Vec<u8> {
        let blocks: Vec<&[u8]> = data.chunks(block).collect();
        let number = CODECS.iter().position(|&c| c.name() == codec.name()).unwrap();
        let mut out = vec![BLOSC_VERSION, 1, (number << BLOSC_CODEC_SHIFT) as u8 | BLOSC_SHUFFLE, type_size as u8];
        out.extend([data.len(), block, 0].iter().flat_map(|&n| (n as u32).to_le_bytes()));
        out.resize(BLOSC_HEADER + 4 * blocks.len(), 0);
        for (i, plain) in blocks.iter().enumerate() {
            let start = (out.len() as u32).to_le_bytes();
            out[BLOSC_HEADER + 4 * i..][..4].copy_from_slice(&start);
            let whole = plain.len() / type_size * type_size;
            let mut planes: Vec<u8> =
                (0..type_size).flat_map(|k| plain[..whole].iter().copied().skip(k).step_by(type_size)).collect();
            planes.extend(&plain[whole..]);
            let split = plain.len() == block && type_size <= 16 && block / type_size >= 128;
            let streams = if split { type_size } else { 1 };
            for stream in planes.chunks(plain.len() / streams) {
                let mut packed = pack(codec, stream);
                if packed.len() >= stream.len() {
                    packed = stream.to_vec();
                }
                out.extend((packed.len() as u32).to_le_bytes());
                out.extend(packed);
            }
        }
        let size = (out.len() as u32).to_le_bytes();
        out[12..16].copy_from_slice(&size);
        out
    }

    fn floats(n: usize) -> Vec<u8> {
        (0..n).flat_map(|i| ((i / 3) as f32 * 0.125).to_le_bytes()).collect()
    }

    #[test]
    fn zip_returns_the_bytes_and_refuses_another_length_or_a_flip() {
        let data = floats(1000);
        let packed = zip(&data);
        assert_eq!(unzip(&packed, data.len()).unwrap(), data);
        for wrong in [0, data.len() - 1, data.len() + 1] {
            assert_eq!(unzip(&packed, wrong).unwrap_err().code, Code::Corrupt, "{wrong}");
        }
        let mut flipped = packed.clone();
        *flipped.last_mut().unwrap() ^= 1; // its checksum
        assert_eq!(unzip(&flipped, data.len()).unwrap_err().code, Code::Corrupt);
        assert_eq!(unzip(&packed[..packed.len() - 1], data.len()).unwrap_err().code, Code::Corrupt);
    }

    #[test]
    fn sizes_beyond_the_bound_of_the_codec_are_refused_before_they_are_allocated() {
        // More than any address space, yet the first check stops it.
        assert_eq!(unzip(&zip(&[0; 64]), usize::MAX / 2).unwrap_err().code, Code::Corrupt);
        // The bound itself must be reachable: zeros shrink as far as Deflate can.
        let zeros = vec![0; 1 << 20];
        assert_eq!(unzip(&zip(&zeros), zeros.len()).unwrap(), zeros);
        for codec in CODECS {
            let packed = blosc(codec, &zeros, 4, 1 << 18);
            assert_eq!(unblosc(&packed, zeros.len()).unwrap(), zeros, "{}", codec.name());
            let mut huge = packed;
            huge[4..8].copy_from_slice(&u32::MAX.to_le_bytes());
            huge[8..12].copy_from_slice(&u32::MAX.to_le_bytes());
            huge.truncate(100);
            huge[12..16].copy_from_slice(&100u32.to_le_bytes());
            let error = unblosc(&huge, u32::MAX as usize).unwrap_err();
            assert!(error.why.contains("cannot hold"), "{}: {error}", codec.name());
        }
    }

    #[test]
    fn every_codec_decodes_split_shuffled_blocks_with_a_shorter_last_one() {
        let mut data = floats(3000);
        data.extend(b"xyz"); // no whole value
        for codec in CODECS {
            for (type_size, block) in
                [(1, 4096), (2, 2048), (3, 3072), (4, 4096), (4, 512), (4, 256), (8, 8192), (17, 3400)]
            {
                let packed = blosc(codec, &data, type_size, block);
                let decoded = unblosc(&packed, data.len()).unwrap();
                assert!(decoded == data, "{} {type_size} {block}", codec.name());
                assert_eq!(unblosc(&packed, data.len() - 1).unwrap_err().code, Code::Corrupt);
            }
        }
    }

    #[test]
    fn buffers_of_the_original_library_decode() {
        let text = b"nephele draws clouds; ".repeat(14);
        assert_eq!(unblosc(&BLOSC_LZ, 300).unwrap(), text[..300]);
        let expected: Vec<u8> = (0..96).flat_map(|i| (i as f32 * 0.5).to_le_bytes()).collect();
        assert_eq!(unblosc(&BIT_SHUFFLED, 384).unwrap(), expected);
    }

    #[test]
    fn blosc_lz_reaches_far_back_and_overlaps_itself() {
        let data: Vec<u8> = (0..9000u32).map(|i| ((i * i) >> 4) as u8).collect();
        let mut packed = pack(Codec::BloscLz, &data);
        packed.extend([0xff, 0, 0xff, 0, 8]); // 9 bytes from 8191 + 8 + 1 back
        packed.extend([2 << 5 | 1, 3]); // 4 bytes from 256 + 3 + 1 back
        packed.extend([7 << 5, 255, 0, 1]); // 9 + 255 bytes from 2 back
        let mut expected = data.clone();
        expected.extend_from_within(9000 - 8200..9000 - 8200 + 9);
        expected.extend_from_within(9009 - 260..9009 - 256);
        for _ in 0..264 {
            expected.push(expected[expected.len() - 2]);
        }
        let mut out = vec![0; expected.len()];
        assert_eq!(un_blosc_lz(&packed, &mut out), Some(expected.len()));
        assert_eq!(out, expected);
        assert_eq!(un_blosc_lz(&packed, &mut out[..expected.len() - 1]), None, "one byte too few");
        assert_eq!(un_blosc_lz(&[0, b'x', 1 << 5, 1], &mut [0; 9]), None, "before the start");
    }

    #[test]
    fn copied_buffers_are_taken_as_they_are() {
        let data = floats(20);
        let mut packed = vec![BLOSC_VERSION, 1, BLOSC_COPIED, 4];
        packed.extend([80u32, 80, 96].iter().flat_map(|n| n.to_le_bytes()));
        packed.extend(&data);
        assert_eq!(unblosc(&packed, 80).unwrap(), data);
        packed[12] -= 1;
        assert_eq!(unblosc(&packed, 80).unwrap_err().code, Code::Corrupt);
    }

    #[test]
    fn unknown_codecs_and_versions_are_named() {
        let packed = blosc(Codec::Zlib, &floats(500), 4, 2000);
        let mut other = packed.clone();
        other[2] = 6 << BLOSC_CODEC_SHIFT;
        let error = unblosc(&other, 2000).unwrap_err();
        assert_eq!((error.code, error.what.contains("number 6")), (Code::Unsupported, true), "{error}");
        for (byte, value) in [(0, 5), (2, BLOSC_FUTURE)] {
            let mut other = packed.clone();
            other[byte] = value;
            assert_eq!(unblosc(&other, 2000).unwrap_err().code, Code::Unsupported);
        }
    }

    #[test]
    fn no_bytes_make_the_decoders_panic() {
        let data = floats(700);
        let mut random = 1u32;
        let mut next = || {
            random ^= random << 13;
            random ^= random >> 17;
            random ^= random << 5;
            random as usize
        };
        let good: Vec<Vec<u8>> = CODECS.iter().map(|&codec| blosc(codec, &data, 4, 1024)).collect();
        for packed in &good {
            for end in 0..packed.len() {
                assert!(unblosc(&packed[..end], data.len()).is_err(), "{end} bytes");
            }
            for _ in 0..3000 {
                let mut damaged = packed.clone();
                for _ in 0..1 + next() % 3 {
                    let at = next() % damaged.len();
                    damaged[at] ^= 1 << (next() % 8);
                }
                // Some flips only change values; the length always holds.
                assert!(unblosc(&damaged, data.len()).map_or(true, |out| out.len() == data.len()));
            }
        }
    }
}
