//! PFM: three header lines (`PF`, `W H`, scale), then 32-bit floats, the bottom row first.

use super::*;

/// Little-endian RGB, scale −1.0.
pub fn write(file: &mut impl Write, image: &Image) -> io::Result<()> {
    write!(file, "PF\n{} {}\n-1.0\n", image.width, image.height)?;
    let picture = &image.layers[0];
    for row in picture.data.chunks_exact(image.width as usize * picture.channels.len()).rev() {
        for pixel in row.chunks_exact(picture.channels.len()) {
            for value in &pixel[..3] {
                file.write_all(&value.to_le_bytes())?;
            }
        }
    }
    Ok(())
}

/// Colour (`PF`) or grey (`Pf`), either byte order (the sign of the scale; its size, a unit, is ignored). Header words
/// may be parted by any white space, as readers of the format allow.
pub fn read(bytes: &[u8]) -> std::result::Result<Image, Fault> {
    let mut at = 0;
    let mut words = [""; 4];
    for word in &mut words {
        *word = next_word(bytes, &mut at).ok_or_else(|| Fault::Corrupt("Its header is not whole.".into()))?;
    }
    let channels: usize = if words[0] == "PF" { 3 } else { 1 };
    let bad = |what: &str, word: &str| Fault::Corrupt(format!("Its {what} is {word:?}."));
    let width: u32 = words[1].parse().map_err(|_| bad("width", words[1]))?;
    let height: u32 = words[2].parse().map_err(|_| bad("height", words[2]))?;
    let scale: f32 = words[3].parse().map_err(|_| bad("scale", words[3]))?;
    if scale.is_nan() || scale == 0.0 {
        return Err(bad("scale", words[3]));
    }
    let body = &bytes[at..];
    let row_bytes = width as u64 * channels as u64 * 4;
    if row_bytes.checked_mul(height.into()) != Some(body.len() as u64) || body.is_empty() {
        return Err(Fault::Corrupt(format!(
            "{width}x{height} pixels with {channels} channels do not fit its {} bytes of data.",
            body.len()
        )));
    }
    let value = |raw: &[u8]| {
        let raw = [raw[0], raw[1], raw[2], raw[3]];
        if scale < 0.0 { f32::from_le_bytes(raw) } else { f32::from_be_bytes(raw) }
    };
    let mut data = Vec::with_capacity(body.len() / (4 * channels) * 4);
    for row in body.chunks_exact(row_bytes as usize).rev() {
        for pixel in row.chunks_exact(4 * channels) {
            // Grey fills all three.
            data.extend((0..3).map(|c| value(&pixel[4 * (c % channels)..][..4])).chain([1.0]));
        }
    }
    Ok(Image::from_rgba(width, height, data))
}

/// The next word and the one white-space byte that ends it. Words are at most 32 bytes.
fn next_word<'a>(bytes: &'a [u8], at: &mut usize) -> Option<&'a str> {
    const LONGEST: usize = 32;
    let start = *at + bytes[*at..].iter().take(LONGEST).position(|b| !b.is_ascii_whitespace())?;
    let length = bytes[start..].iter().take(LONGEST).position(u8::is_ascii_whitespace)?;
    *at = start + length + 1;
    std::str::from_utf8(&bytes[start..start + length]).ok()
}
