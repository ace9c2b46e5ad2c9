//! Environment maps from OpenEXR and Radiance HDR files, told apart by content.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

use exr::prelude::{ReadChannels, ReadLayers, ReadSpecificChannel};
use image::ImageDecoder;

use super::picture::refused_codec;
use crate::error::{Code, Error, Result, Warning};
use crate::light::environment::Map;

/// Texels of the largest file that is read: 16384 × 8192.
const MAX_FILE_TEXELS: u64 = 1 << 27;
/// Texels of the largest map that is used, 4096 × 2048; larger files are averaged down.
const MAX_MAP_TEXELS: u64 = 1 << 23;
/// Most texels that a byte of any compression here can stand for (deflate: 1032 bytes, a texel has 2 at least): a small
/// file cannot ask for much memory.
const MAX_TEXELS_PER_BYTE: u64 = 516;
/// What an infinite texel becomes: the greatest half float, where most encoders of maps clip.
const CLAMPED: f32 = 65_504.0;

const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
const RADIANCE_MAGIC: [u8; 2] = *b"#?";

/// The environment map in the file at `path`, taken as equirectangular whatever its proportions; `.exr` (the first layer
/// with R, G, B or with Y) or `.hdr`.
///
/// Texels that are not finite or are negative are repaired, and large maps averaged down, each with a warning
/// (`bad_hdri`, `limits`). Errors: [`Code::NotFound`], [`Code::Denied`], [`Code::BadHdri`].
pub fn load(path: &Path) -> Result<(Map, Vec<Warning>)> {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let bad = |why: String| {
        Error::new(Code::BadHdri, format!("Cannot read the environment map {}.", path.display()))
            .why(why)
            .hint("Use an equirectangular .exr or .hdr picture.")
    };
    let mut magic = Vec::new();
    let mut file = BufReader::new(File::open(path).map_err(|e| Error::reading(path, &e))?);
    file.by_ref().take(EXR_MAGIC.len() as u64).read_to_end(&mut magic).map_err(|e| Error::reading(path, &e))?;
    let length = file.seek(SeekFrom::End(0)).map_err(|e| Error::reading(path, &e))?;
    file.seek(SeekFrom::Start(0)).map_err(|e| Error::reading(path, &e))?;
    let mut map = if magic.starts_with(&EXR_MAGIC) {
        read_exr(file, length).map_err(bad)?
    } else if magic.starts_with(&RADIANCE_MAGIC) {
        read_radiance(file, length).map_err(bad)?
    } else {
        return Err(bad("It starts like neither an OpenEXR nor a Radiance file.".into()));
    };
    let mut warnings = Vec::new();
    warnings.extend(repair(&mut map, &name));
    if u64::from(map.width) * u64::from(map.height) > MAX_MAP_TEXELS {
        let (width, height) = (map.width, map.height);
        map = reduced(&map, MAX_MAP_TEXELS);
        let text = format!("{name} has {width} × {height} texels and is used at {} × {}.", map.width, map.height);
        warnings.push(Warning { code: "limits", text });
    }
    Ok((map, warnings))
}

/// Width and height of a picture in `length` bytes that can be held in memory, or why not.
fn checked(width: u64, height: u64, length: u64) -> std::result::Result<(u32, u32), String> {
    if width == 0 || height == 0 {
        return Err("It has no texels.".into());
    }
    if width.saturating_mul(height) / MAX_TEXELS_PER_BYTE > length {
        return Err(format!("It says that it has {width} × {height} texels, too many for its {length} bytes."));
    }
    match (u32::try_from(width), u32::try_from(height)) {
        (Ok(w), Ok(h)) if width.saturating_mul(height) <= MAX_FILE_TEXELS => Ok((w, h)),
        _ => Err(format!("It has {width} × {height} texels; {MAX_FILE_TEXELS} are the most that is read.")),
    }
}

/// Reads the first layer with colour, placed in the display window; what lies outside the data window is black.
fn read_exr<R: Read + Seek>(mut file: BufReader<R>, length: u64) -> std::result::Result<Map, String> {
    let told = |e: exr::error::Error| match e {
        exr::error::Error::Io(e) => format!("It is damaged or cut short ({e})."),
        exr::error::Error::NotSupported(what) => format!("It uses a feature that is not supported ({what})."),
        e => format!("It is damaged ({e})."),
    };
    let pedantic = false;
    let meta = exr::meta::MetaData::read_from_buffered(&mut file, pedantic).map_err(told)?;
    file.seek(SeekFrom::Start(0)).map_err(|e| format!("It cannot be read twice ({e})."))?;
    let window = meta.headers.first().ok_or("It has no layers.")?.shared_attributes.display_window;
    let (width, height) = checked(window.size.x() as u64, window.size.y() as u64, length)?;
    for header in &meta.headers {
        checked(header.layer_size.x() as u64, header.layer_size.y() as u64, length)?;
        if let Some(why) = refused_codec(header.compression) {
            return Err(why);
        }
    }
    let has = |channels: &[&str]| {
        meta.headers.iter().find(|header| {
            channels
                .iter()
                .all(|name| header.channels.list.iter().any(|channel| channel.name.eq_case_insensitive(name)))
        })
    };
    let (header, names) = match (has(&["R", "G", "B"]), has(&["Y"])) {
        (Some(header), _) => (header, ["R", "G", "B"]),
        (None, Some(header)) => (header, ["Y"; 3]),
        (None, None) => return Err("It has neither the channels R, G and B nor Y.".into()),
    };
    let offset = header.own_attributes.layer_position - window.position;
    let black = move || vec![[0.0f32; 3]; width as usize * height as usize];
    let place = move |texels: &mut Vec<[f32; 3]>, at: exr::math::Vec2<usize>, rgb: [f32; 3]| {
        let (x, y) = (at.x() as i64 + i64::from(offset.x()), at.y() as i64 + i64::from(offset.y()));
        if (0..i64::from(width)).contains(&x) && (0..i64::from(height)).contains(&y) {
            texels[y as usize * width as usize + x as usize] = rgb;
        }
    };
    let reader = exr::prelude::read().no_deep_data().largest_resolution_level();
    let gray = names[0] == "Y";
    // As for pictures: the PIZ decoder panics on some damaged blocks.
    let decoded = catch_unwind(AssertUnwindSafe(move || {
        if gray {
            let image = reader
                .specific_channels()
                .required("Y")
                .collect_pixels(move |_, _| black(), move |texels, at, (y,): (f32,)| place(texels, at, [y; 3]))
                .first_valid_layer()
                .all_attributes()
                .from_buffered(file)?;
            return Ok(image.layer_data.channel_data.pixels);
        }
        let image = reader
            .rgb_channels(
                move |_, _| black(),
                move |texels, at, (r, g, b): (f32, f32, f32)| place(texels, at, [r, g, b]),
            )
            .first_valid_layer()
            .all_attributes()
            .from_buffered(file)?;
        Ok(image.layer_data.channel_data.pixels)
    }));
    let texels = decoded.map_err(|_| "The decoder met impossible data.".to_owned())?.map_err(told)?;
    Ok(Map { width, height, texels })
}

fn read_radiance<R: Read + Seek>(file: BufReader<R>, length: u64) -> std::result::Result<Map, String> {
    let told = |e: image::ImageError| format!("It is damaged or cut short ({e}).");
    let decoder = image::codecs::hdr::HdrDecoder::new(file).map_err(told)?;
    let (width, height) = decoder.dimensions();
    let (width, height) = checked(width.into(), height.into(), length)?;
    let mut texels = vec![[0.0f32; 3]; width as usize * height as usize];
    decoder.read_image(bytemuck::cast_slice_mut(&mut texels)).map_err(told)?;
    Ok(Map { width, height, texels })
}

/// Makes every texel finite and not negative: infinity becomes [`CLAMPED`], NaN and negative values 0.
fn repair(map: &mut Map, name: &str) -> Option<Warning> {
    let (mut infinite, mut invalid, mut negative) = (0u64, 0u64, 0u64);
    for texel in &mut map.texels {
        let (mut inf, mut nan, mut neg) = (false, false, false);
        for value in texel {
            if value.is_nan() {
                (*value, nan) = (0.0, true);
            } else if *value < 0.0 {
                (*value, neg) = (0.0, true);
            } else if value.is_infinite() {
                (*value, inf) = (CLAMPED, true);
            }
        }
        infinite += u64::from(inf);
        invalid += u64::from(nan);
        negative += u64::from(neg);
    }
    let parts = [
        (infinite, "infinite", "clamped to 65504"),
        (invalid, "not-a-number", "set to 0"),
        (negative, "negative", "set to 0"),
    ];
    let told: Vec<String> = parts
        .iter()
        .filter(|(count, ..)| *count > 0)
        .map(|(count, what, done)| format!("{count} {what} texels ({done})"))
        .collect();
    if told.is_empty() {
        return None;
    }
    Some(Warning { code: "bad_hdri", text: format!("{name} has {}.", told.join(", ")) })
}

/// `map` with at most `limit` texels, each the mean over its solid angle.
fn reduced(map: &Map, limit: u64) -> Map {
    let texels = u64::from(map.width) * u64::from(map.height);
    let mut factor = 1;
    while texels / (factor * factor) > limit {
        factor += 1;
    }
    let shrunk = |side: u32| (u64::from(side) / factor).max(1) as u32;
    let (width, height) = (shrunk(map.width), shrunk(map.height));
    let columns = overlaps(width, map.width, |u| u);
    let rows = overlaps(height, map.height, |v| -(v * std::f64::consts::PI).cos());
    let mut out = Vec::with_capacity(width as usize * height as usize);
    for row in &rows {
        for column in &columns {
            let mut sum = [0.0f64; 3];
            for (j, row_weight) in row {
                for (i, weight) in column {
                    let texel = map.texels[j * map.width as usize + i];
                    (0..3).for_each(|c| sum[c] += row_weight * weight * f64::from(texel[c]));
                }
            }
            out.push(sum.map(|s| s as f32));
        }
    }
    Map { width, height, texels: out }
}

/// For each of `new` equal intervals of 0 … 1, those of `old` ones that it overlaps and how much of it each covers, in
/// terms of `measure` of the ends.
fn overlaps(new: u32, old: u32, measure: impl Fn(f64) -> f64) -> Vec<Vec<(usize, f64)>> {
    let edge = |i: u64, n: u32| i as f64 / f64::from(n);
    let (wide_new, wide_old) = (u64::from(new), u64::from(old));
    (0..wide_new)
        .map(|i| {
            let (low, high) = (edge(i, new), edge(i + 1, new));
            let covered = i * wide_old / wide_new..((i + 1) * wide_old).div_ceil(wide_new);
            let part = |k: u64| measure(edge(k + 1, old).min(high)) - measure(edge(k, old).max(low));
            covered.map(|k| (k as usize, part(k) / (measure(high) - measure(low)))).collect()
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use exr::prelude::*;
    use std::path::PathBuf;

    fn texel(x: usize, y: usize) -> [f32; 3] {
        [x as f32 + 0.25, y as f32 * 2.0, (x * y) as f32]
    }

    fn temporary(name: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a temporary folder can be made");
        let path = folder.path().join(name);
        (folder, path)
    }

    #[test]
    fn exr_texels_stay_in_place() {
        let (_folder, path) = temporary("map.with.wrong.extension.hdr");
        let colour = |x: usize, y: usize| <(f32, f32, f32)>::from(texel(x, y));
        write_rgb_file(&path, 8, 4, colour).expect("the file can be written");
        let (map, warnings) = load(&path).expect("the file is sound");
        assert_eq!((map.width, map.height, warnings), (8, 4, vec![]));
        for (i, found) in map.texels.iter().enumerate() {
            assert_eq!(*found, texel(i % 8, i / 8));
        }
    }

    #[test]
    fn exr_data_windows_are_placed_in_the_display_window() {
        let (_folder, path) = temporary("crop.exr");
        let channels = SpecificChannels::rgb(|at: Vec2<usize>| <(f32, f32, f32)>::from(texel(at.x(), at.y())));
        let mut attributes = LayerAttributes::named("cropped");
        attributes.layer_position = Vec2(3, 1);
        let layer = Layer::new((4, 2), attributes, Encoding::FAST_LOSSLESS, channels);
        let display = IntegerBounds::new((1, 0), (8, 4));
        Image::new(ImageAttributes::new(display), layer).write().to_file(&path).expect("the file can be written");
        let (map, _) = load(&path).expect("the file is sound");
        assert_eq!((map.width, map.height), (8, 4));
        for (i, found) in map.texels.iter().enumerate() {
            let (x, y) = (i % 8, i / 8);
            let inside = (2..6).contains(&x) && (1..3).contains(&y);
            assert_eq!(*found, if inside { texel(x - 2, y - 1) } else { [0.0; 3] }, "{x} {y}");
        }
    }

    #[test]
    fn grey_exr_files_are_read() {
        let (_folder, path) = temporary("grey.exr");
        let values = FlatSamples::F32(vec![0.5, 1.5]);
        let channels = AnyChannels::sort(smallvec_of(AnyChannel::new("Y", values)));
        Image::from_channels((2, 1), channels).write().to_file(&path).expect("the file can be written");
        assert_eq!(load(&path).expect("the file is sound").0.texels, [[0.5; 3], [1.5; 3]]);
    }

    fn smallvec_of(channel: AnyChannel<FlatSamples>) -> SmallVec<[AnyChannel<FlatSamples>; 4]> {
        SmallVec::from_iter([channel])
    }

    #[test]
    fn radiance_files_are_read() {
        let (_folder, path) = temporary("map.exr");
        let texels: Vec<image::Rgb<f32>> = (0..32).map(|i| image::Rgb(texel(i % 8, i / 8))).collect();
        let file = File::create(&path).expect("the file can be written");
        image::codecs::hdr::HdrEncoder::new(file).encode(&texels, 8, 4).expect("the file can be written");
        let (map, warnings) = load(&path).expect("the file is sound");
        assert_eq!((map.width, map.height, warnings), (8, 4, vec![]));
        for (i, found) in map.texels.iter().enumerate() {
            let exact = texel(i % 8, i / 8);
            let greatest = exact.iter().copied().fold(0.0, f32::max);
            assert!(found.iter().zip(exact).all(|(a, b)| (a - b).abs() <= greatest / 100.0), "{found:?} {exact:?}");
        }
    }

    #[test]
    fn bad_values_are_repaired_and_told() {
        let (_folder, path) = temporary("sky.exr");
        let colour = |x: usize, _| match x {
            0 => (f32::INFINITY, f32::INFINITY, 1.0),
            1 => (f32::NAN, 2.0, -1.0),
            _ => (1.0, 1.0, 1.0f32),
        };
        write_rgb_file(&path, 4, 1, colour).expect("the file can be written");
        let (map, warnings) = load(&path).expect("the file is sound");
        assert_eq!(map.texels, [[65504.0, 65504.0, 1.0], [0.0, 2.0, 0.0], [1.0; 3], [1.0; 3]]);
        let text = "sky.exr has 1 infinite texels (clamped to 65504), 1 not-a-number texels (set to 0), 1 negative texels \
                    (set to 0).";
        assert_eq!(warnings, [Warning { code: "bad_hdri", text: text.into() }]);
    }

    #[test]
    fn damage_is_an_error_not_a_panic() {
        let (folder, path) = temporary("map.exr");
        write_rgb_file(&path, 16, 8, |x, y| <(f32, f32, f32)>::from(texel(x, y))).expect("the file can be written");
        let mut files = vec![std::fs::read(&path).expect("it was just written")];
        let texels: Vec<image::Rgb<f32>> = (0..128).map(|i| image::Rgb(texel(i % 16, i / 16))).collect();
        let mut radiance = Vec::new();
        image::codecs::hdr::HdrEncoder::new(&mut radiance).encode(&texels, 16, 8).expect("memory can be written");
        files.push(radiance);
        for bytes in &files {
            for cut in (0..bytes.len()).step_by(7) {
                std::fs::write(&path, &bytes[..cut]).expect("the file can be written");
                let error = load(&path).expect_err("a truncated file is refused");
                assert_eq!(error.code, Code::BadHdri, "{error}");
            }
            for at in 0..bytes.len().min(600) {
                let mut damaged = bytes.clone();
                damaged[at] ^= 0x5a;
                std::fs::write(&path, &damaged).expect("the file can be written");
                if let Err(error) = load(&path) {
                    assert_eq!(error.code, Code::BadHdri, "{error}");
                }
            }
        }
        std::fs::write(&path, b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 100000 +X 200000\n")
            .expect("it can be written");
        let error = load(&path).expect_err("a huge map is refused");
        assert!(error.code == Code::BadHdri && error.why.contains("200000 × 100000"), "{error}");
        assert!(checked(16385, 8192, 1 << 40).is_err() && checked(16384, 8192, 1 << 40).is_ok());
        std::fs::write(&path, b"a picture").expect("the file can be written");
        assert_eq!(load(&path).expect_err("it is no map").code, Code::BadHdri);
        assert_eq!(load(&folder.path().join("none.exr")).expect_err("it is missing").code, Code::NotFound);
    }

    #[test]
    fn reducing_keeps_the_power() {
        let texels = (0..37 * 19).map(|i| [1.0, (i / 37 * i / 37) as f32, 0.0]).collect();
        let map = Map { width: 37, height: 19, texels };
        let small = reduced(&map, 100);
        assert_eq!((small.width, small.height), (12, 6));
        let power = |map: &Map| {
            let rows = map.texels.chunks(map.width as usize).enumerate();
            rows.map(|(j, row)| map.solid_angle(j as u32) * row.iter().map(|t| f64::from(t[1])).sum::<f64>())
                .sum::<f64>()
        };
        let ratio = power(&small) / power(&map);
        assert!((ratio - 1.0).abs() < 1e-6, "{ratio}");
        // A constant stays one, and nothing moves sideways: along u the means of whole blocks of three.
        let plain = Map { texels: vec![[2.0; 3]; 37 * 19], ..map.clone() };
        assert!(reduced(&plain, 100).texels.iter().all(|t| (t[0] - 2.0).abs() < 1e-6));
        let even = Map { width: 36, height: 18, texels: (0..36 * 18).map(|i| texel(i % 36, i / 36)).collect() };
        let even = reduced(&even, 100);
        assert!(
            (0..12).all(|i| (even.texels[i][0] - (3.0 * i as f32 + 1.25)).abs() < 1e-5),
            "{:?}",
            &even.texels[..12]
        );
    }
}
