//! PNG: 8-bit sRGB for the screen, with the texts as iTXt.

use ::png::{BitDepth, ColorType, Decoder, DecodingError, Encoder, EncodingError, Limits, SrgbRenderingIntent};

use super::*;
use crate::image::tone::decode_srgb;

/// iTXt keywords that the PNG specification registers.
const SOFTWARE_KEY: &str = "Software";
const DESCRIPTION_KEY: &str = "Description";
/// The most bytes that a compressed text may have; scenes and statistics are some kilobytes.
const MAX_TEXT: usize = 64 << 20;
/// What the decoder may take for a chunk, beyond the file's own size.
const MAX_CHUNK: usize = 64 << 20;

/// RGB after exposure and tone map, rounded to nearest, without alpha.
pub fn write(file: &mut impl Write, image: &Image, meta: &Metadata, display: &Display) -> io::Result<()> {
    let mut encoder = Encoder::new(file, image.width, image.height);
    encoder.set_color(ColorType::Rgb);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::Perceptual);
    let texts = [
        (SOFTWARE_KEY, &meta.software),
        (DESCRIPTION_KEY, &meta.description),
        (SCENE_KEY, &meta.scene_toml),
        (STATS_KEY, &meta.stats_json),
    ];
    for (key, text) in texts.into_iter().filter(|(_, text)| !text.is_empty()) {
        encoder.add_itxt_chunk(key.into(), text.clone()).map_err(encoding)?;
    }
    let pixels: Vec<u8> = image.rgb().flat_map(|rgb| display.apply_8bit(rgb)).collect();
    let mut writer = encoder.write_header().map_err(encoding)?;
    writer.write_image_data(&pixels).map_err(encoding)?;
    writer.finish().map_err(encoding)
}

/// Any PNG, as linear light: grey, palette and 16 bits too. Taken as sRGB, as other colour spaces are not read.
pub fn read(bytes: &[u8]) -> std::result::Result<(Image, Texts), Fault> {
    let mut decoder = decoder(bytes);
    let info = decoder.read_header_info().map_err(decoding)?;
    let (width, height) = info.size();
    check_size(width.into(), height.into(), info.bytes_per_pixel() as u64, bytes.len())?;
    decoder.set_transformations(::png::Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(decoding)?;
    let size = reader.output_buffer_size().ok_or_else(|| Fault::Unsupported("It is too large.".into()))?;
    let mut raw = vec![0; size];
    reader.next_frame(&mut raw).map_err(decoding)?;
    let (color, depth) = reader.output_color_type();
    let wide = depth == BitDepth::Sixteen;
    let sample = |pixel: &[u8], channel: usize| match wide {
        true => f32::from(u16::from_be_bytes([pixel[2 * channel], pixel[2 * channel + 1]])) / f32::from(u16::MAX),
        false => f32::from(pixel[channel]) / f32::from(u8::MAX),
    };
    let (colours, alpha) = match color {
        ColorType::Grayscale => ([0, 0, 0], None),
        ColorType::GrayscaleAlpha => ([0, 0, 0], Some(1)),
        ColorType::Rgb => ([0, 1, 2], None),
        ColorType::Rgba => ([0, 1, 2], Some(3)),
        ColorType::Indexed => return Err(Fault::Unsupported("Its palette cannot be expanded.".into())),
    };
    let pixel_bytes = color.samples() * if wide { 2 } else { 1 };
    let data = raw
        .chunks_exact(pixel_bytes)
        .flat_map(|pixel| {
            let [r, g, b] = colours.map(|c| decode_srgb(sample(pixel, c)));
            [r, g, b, alpha.map_or(1.0, |a| sample(pixel, a))]
        })
        .collect();
    reader.finish().map_err(decoding)?;
    Ok((Image::from_rgba(width, height, data), texts(reader.info())?))
}

/// The texts, without decoding pixels unless no scene stands before them.
pub fn read_texts(bytes: &[u8]) -> std::result::Result<Texts, Fault> {
    let mut reader = decoder(bytes).read_info().map_err(decoding)?;
    let found = texts(reader.info())?;
    if found.scene_toml.is_some() {
        return Ok(found);
    }
    reader.finish().map_err(decoding)?;
    texts(reader.info())
}

fn decoder(bytes: &[u8]) -> Decoder<Cursor<&[u8]>> {
    Decoder::new_with_limits(Cursor::new(bytes), Limits { bytes: MAX_CHUNK + bytes.len() })
}

/// The texts that have been read so far.
fn texts(info: &::png::Info) -> std::result::Result<Texts, Fault> {
    let find = |key: &str| -> std::result::Result<Option<String>, Fault> {
        let Some(chunk) = info.utf8_text.iter().find(|chunk| chunk.keyword == key) else { return Ok(None) };
        let mut chunk = chunk.clone();
        chunk.decompress_text_with_limit(MAX_TEXT).map_err(decoding)?;
        chunk.get_text().map(Some).map_err(decoding)
    };
    Ok(Texts {
        scene_toml: find(SCENE_KEY)?,
        stats_json: find(STATS_KEY)?,
        software: find(SOFTWARE_KEY)?,
        description: find(DESCRIPTION_KEY)?,
    })
}

fn encoding(error: EncodingError) -> io::Error {
    match error {
        EncodingError::IoError(e) => e,
        other => io::Error::other(other.to_string()),
    }
}

fn decoding(error: DecodingError) -> Fault {
    match error {
        DecodingError::LimitsExceeded => Fault::Unsupported("It needs more memory than a file of its size may.".into()),
        other => Fault::Corrupt(format!("{}.", other.to_string().trim_end_matches('.'))),
    }
}
