use std::io::Write as _;
use std::panic::catch_unwind;

use tempfile::TempDir;

use super::*;
use crate::image::Layer;
use crate::image::tone::{ToneMap, decode_srgb};

const WIDTH: u32 = 21;
const HEIGHT: u32 = 37;

fn layer(name: &str, channels: &[&str], seed: f32) -> Layer {
    let values = (WIDTH * HEIGHT) as usize * channels.len();
    let data = (0..values).map(|i| seed + (i as f32 * 0.37).sin()).collect();
    Layer { name: name.into(), channels: channels.iter().map(|c| c.to_string()).collect(), data }
}

/// A picture with every AOV of the contract, and values that only floats hold.
fn image() -> Image {
    let mut picture = layer("", &["R", "G", "B", "A"], 1.0);
    picture.data[0] = f32::INFINITY;
    picture.data[1] = 1e-40;
    picture.data[2] = -3.5;
    let mut layers = vec![
        picture,
        layer("albedo", &["R", "G", "B"], 2.0),
        layer("depth", &["mean", "spread"], 3.0),
        layer("multiple", &["R", "G", "B"], 4.0),
        layer("samples", &[""], 5.0),
        layer("single", &["R", "G", "B"], 6.0),
        layer("transmittance", &[""], 7.0),
        layer("variance", &["R", "G", "B"], 8.0),
    ];
    layers[4].data[3] = 16_777_216.0;
    Image { width: WIDTH, height: HEIGHT, layers }
}

/// A picture with only values that a PNG holds too.
fn plain() -> Image {
    let data = (0..WIDTH * HEIGHT).flat_map(|i| [i as f32 / 800.0, 0.5, 1.0 - i as f32 / 800.0, 1.0]).collect();
    Image::from_rgba(WIDTH, HEIGHT, data)
}

fn meta() -> Metadata {
    Metadata {
        scene_toml: "version = 1\n[volume]\nfile = \"wölkchen ☁ 雲.vdb\"\n".repeat(400),
        stats_json: "{\"spp\": 256, \"adapter\": \"µ\"}".into(),
        software: "nephele 0.1.0".into(),
        description: "A cloud – at noon".into(),
    }
}

fn found() -> Texts {
    let meta = meta();
    Texts {
        scene_toml: Some(meta.scene_toml),
        stats_json: Some(meta.stats_json),
        software: Some(meta.software),
        description: Some(meta.description),
    }
}

fn linear() -> Display {
    Display { exposure: 0.0, tone_map: ToneMap::Linear }
}

fn saved(name: &str, image: &Image) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join(name);
    save(&path, image, &meta(), &linear()).expect("saves");
    (folder, path)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .expect("a folder")
        .map(|entry| entry.expect("an entry").file_name().into_string().expect("UTF-8"))
        .collect();
    names.sort();
    names
}

#[test]
fn exr_keeps_every_bit_layer_and_text() {
    let (folder, path) = saved("a.EXR", &image());
    let loaded = load(&path).expect("loads");
    assert_eq!(loaded.format, Format::Exr);
    assert_eq!(loaded.image, image());
    assert_eq!(loaded.texts, found());
    assert_eq!(read_scene(&path), Ok(Some(meta().scene_toml)));
    assert_eq!(names(folder.path()), ["a.EXR"]);
    // The same bytes again: nothing in the file depends on chance.
    let (_second_folder, second) = saved("a.exr", &image());
    assert_eq!(fs::read(&path).expect("reads"), fs::read(second).expect("reads"));
}

#[test]
fn exr_header_says_what_the_contract_says() {
    let (_folder, path) = saved("a.exr", &image());
    let headers = MetaHeaders::of(&path);
    let header = &headers.0[0];
    assert_eq!(headers.0.len(), 1);
    assert_eq!(header.compression, ::exr::meta::attribute::Compression::ZIP16);
    assert_eq!(header.blocks, ::exr::meta::BlockDescription::ScanLines);
    let primaries = header.shared_attributes.chromaticities.expect("chromaticities");
    assert_eq!(primaries.red, ::exr::math::Vec2(0.64, 0.33));
    let channels: Vec<String> = header.channels.list.iter().map(|c| c.name.to_string()).collect();
    let expected = "A B G R albedo.B albedo.G albedo.R depth.mean depth.spread multiple.B multiple.G multiple.R samples \
                    single.B single.G single.R transmittance variance.B variance.G variance.R";
    assert_eq!(channels.join(" "), expected);
    let float = ::exr::meta::attribute::SampleType::F32;
    assert!(header.channels.list.iter().all(|c| c.sample_type == float));
}

struct MetaHeaders(::exr::meta::Headers);

impl MetaHeaders {
    fn of(path: &Path) -> MetaHeaders {
        MetaHeaders(::exr::meta::MetaData::read_from_file(path, true).expect("a valid header").headers)
    }
}

#[test]
fn exr_of_other_programs_is_read() {
    use ::exr::prelude::*;
    let folder = tempfile::tempdir().expect("a folder");
    let size = Vec2(5, 3);
    let value = |x: usize, y: usize| (x + 10 * y) as f32;
    // Half floats in tiles, RLE, shifted data window, no alpha.
    let path = folder.path().join("tiles.exr");
    let channels = SpecificChannels::rgb(|p: Vec2<usize>| {
        let v = f16::from_f32(value(p.x(), p.y()));
        (v, v + f16::ONE, v + f16::from_f32(2.0))
    });
    let encoding = Encoding {
        compression: Compression::RLE,
        blocks: Blocks::Tiles(Vec2(2, 2)),
        line_order: LineOrder::Increasing,
    };
    let attributes = LayerAttributes { layer_position: Vec2(-7, 4), ..LayerAttributes::default() };
    ::exr::prelude::Image::from_layer(::exr::prelude::Layer::new(size, attributes, encoding, channels))
        .write()
        .to_file(&path)
        .expect("writes");
    let loaded = load(&path).expect("loads");
    assert_eq!((loaded.image.width, loaded.image.height), (5, 3));
    assert_eq!(loaded.image.layers[0].data[4 * 7..][..4], [12.0, 13.0, 14.0, 1.0]);
    assert_eq!(loaded.texts, Texts::default());
    assert_eq!(read_scene(&path), Ok(None));
    // Grey, with whole numbers beside it.
    let path = folder.path().join("grey.exr");
    let grey = AnyChannel::new("Y", FlatSamples::F32((0..15).map(|i| i as f32).collect()));
    let id = AnyChannel::new("id", FlatSamples::U32((100..115).collect()));
    let channels = AnyChannels::sort([grey, id].into_iter().collect());
    ::exr::prelude::Image::from_channels(size, channels).write().to_file(&path).expect("writes");
    let loaded = load(&path).expect("loads");
    assert_eq!(loaded.image.layers[0].data[4..8], [1.0, 1.0, 1.0, 1.0]);
    assert_eq!(loaded.image.layers[0].data[56..60], [14.0, 14.0, 14.0, 1.0]);
    assert_eq!(loaded.image.layer("id").expect("the layer").data[14], 114.0);
    // Lossy codecs are named, not decoded.
    let path = folder.path().join("b44.exr");
    let channels = SpecificChannels::rgb(|_| (f16::ONE, f16::ONE, f16::ONE));
    let encoding =
        Encoding { compression: Compression::B44, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    ::exr::prelude::Image::from_encoded_channels(size, encoding, channels).write().to_file(&path).expect("writes");
    let error = load(&path).expect_err("refused");
    assert!(error.code == Code::Unsupported && error.why.contains("b44"), "{error}");
    // Depth alone is no picture.
    let path = folder.path().join("depth.exr");
    let depth = AnyChannel::new("Z", FlatSamples::F32(vec![1.0; 15]));
    let channels = AnyChannels::sort([depth].into_iter().collect());
    ::exr::prelude::Image::from_channels(size, channels).write().to_file(&path).expect("writes");
    assert_eq!(load(&path).expect_err("refused").code, Code::Unsupported);
}

#[test]
fn png_holds_the_shown_picture_and_the_texts() {
    let (folder, path) = saved("a.png", &plain());
    let bytes = fs::read(&path).expect("reads");
    assert!(bytes.windows(5).any(|w| w == b"sRGB\0"), "no sRGB chunk");
    assert_eq!(bytes.windows(17).filter(|w| w == b"iTXtnephele.scene").count(), 1);
    assert_eq!(names(folder.path()), ["a.png"]);
    let loaded = load(&path).expect("loads");
    assert_eq!((loaded.format, loaded.texts), (Format::Png, found()));
    assert_eq!(read_scene(&path), Ok(Some(meta().scene_toml)));
    // Pixels are the display's bytes, back in linear light.
    for (got, expected) in loaded.image.rgb().zip(plain().rgb()) {
        assert_eq!(got, linear().apply_8bit(expected).map(|byte| decode_srgb(f32::from(byte) / 255.0)));
    }
    // 0.5 is 188 in sRGB, one stop less 137; alpha is not stored.
    assert_eq!(loaded.image.layers[0].data[1], decode_srgb(188.0 / 255.0));
    assert_eq!(loaded.image.layers[0].data[3], 1.0);
    let display = Display { exposure: -1.0, tone_map: ToneMap::Linear };
    save(&path, &plain(), &Metadata::default(), &display).expect("saves");
    let loaded = load(&path).expect("loads");
    assert_eq!(loaded.image.layers[0].data[1], decode_srgb(137.0 / 255.0));
    assert_eq!(loaded.texts, Texts::default());
}

#[test]
fn png_of_other_programs_is_read() {
    fn encode(color: ::png::ColorType, depth: ::png::BitDepth, data: &[u8], late: bool) -> Vec<u8> {
        let mut bytes = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut bytes, 2, 1);
        encoder.set_color(color);
        encoder.set_depth(depth);
        if color == ::png::ColorType::Indexed {
            encoder.set_palette(vec![0, 0, 0, 255, 0, 128]);
        }
        let mut writer = encoder.write_header().expect("a header");
        writer.write_image_data(data).expect("pixels");
        if late {
            // Behind the pixels and compressed, as some optimisers leave it.
            let mut chunk = ::png::text_metadata::ITXtChunk::new("nephele.scene", "version = 1");
            chunk.compressed = true;
            writer.write_text_chunk(&chunk).expect("a text");
        }
        writer.finish().expect("an end");
        bytes
    }
    use ::png::BitDepth::{Eight, Sixteen};
    use ::png::ColorType::{Grayscale, GrayscaleAlpha, Indexed, Rgba};
    let half = decode_srgb(128.0 / 255.0);
    for (bytes, expected) in [
        (encode(Grayscale, Eight, &[0, 128], true), [half, half, half, 1.0]),
        (encode(GrayscaleAlpha, Eight, &[0, 0, 128, 255], true), [half, half, half, 1.0]),
        (encode(Indexed, Eight, &[0, 1], true), [1.0, 0.0, half, 1.0]),
        (encode(Rgba, Sixteen, &[0, 0, 0, 0, 0, 0, 0, 0, 255, 255, 0, 0, 128, 128, 0, 0], true), [1.0, 0.0, half, 0.0]),
    ] {
        let (image, texts) = png::read(&bytes).expect("reads");
        assert_eq!(image.layers[0].data[4..], expected);
        assert_eq!(texts.scene_toml.as_deref(), Some("version = 1"));
        assert_eq!(png::read_texts(&bytes).expect("reads").scene_toml.as_deref(), Some("version = 1"));
    }
}

#[test]
fn pfm_has_exactly_the_bytes_of_the_contract() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.pfm");
    let top = [1.0, 2.0, 3.0, 0.5, 4.0, 5.0, 6.0, 0.5];
    let bottom = [-7.0, 8.0, f32::INFINITY, 0.5, 10.0, 11.0, 12.0, 0.5];
    let image = Image::from_rgba(2, 2, [top, bottom].concat());
    save(&path, &image, &meta(), &Display::default()).expect("saves");
    let mut expected = b"PF\n2 2\n-1.0\n".to_vec();
    for value in [-7.0f32, 8.0, f32::INFINITY, 10.0, 11.0, 12.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0] {
        expected.extend(value.to_le_bytes());
    }
    assert_eq!(fs::read(&path).expect("reads"), expected);
    let loaded = load(&path).expect("loads");
    assert_eq!(loaded.format, Format::Pfm);
    assert!(loaded.image.rgb().eq(image.rgb()));
    assert_eq!(loaded.image.layers[0].data[3], 1.0);
    assert_eq!(read_scene(&path), Ok(None));
}

#[test]
fn pfm_of_other_programs_is_read() {
    let grey = [b"Pf 2\t1\r\n1.0\n".to_vec(), 1.5f32.to_be_bytes().to_vec(), 2.5f32.to_be_bytes().to_vec()];
    // Two white-space bytes before the scale, one after it: the data follows at once.
    let image = pfm::read(&grey.concat()).expect("reads");
    assert_eq!(image.layers[0].data, [1.5, 1.5, 1.5, 1.0, 2.5, 2.5, 2.5, 1.0]);
    let pixel = [0u8; 12];
    for bad in [
        &b"PF\n1 1\n0\n"[..],
        b"PF\n1 1\nnan\n",
        b"PF\n-1 1\n-1.0\n",
        b"PF\n1 2\n-1.0\n",
        b"PF\n0 0\n-1.0\n",
        b"PF\n4294967295 4294967295\n-1.0\n",
        b"PF\n1 1",
        b"PF\n1 1 1 1\n-1.0\n",
    ] {
        assert!(pfm::read(&[bad, &pixel].concat()).is_err(), "{:?}", String::from_utf8_lossy(bad));
    }
    assert!(pfm::read(b"PF\n0 0\n-1.0\n").is_err());
    assert!(pfm::read(&[b"PF\n1 1\n-1.0\n", &pixel[..], b"x"].concat()).is_err(), "trailing bytes");
}

#[test]
fn a_failed_write_leaves_the_old_file_and_nothing_else() {
    let (folder, path) = saved("a.exr", &plain());
    let before = fs::read(&path).expect("reads");
    let stopped = write_whole(&path, |file| {
        file.write_all(&[7; 100_000])?;
        Err(io::Error::other("disk full"))
    });
    let error = stopped.expect_err("fails");
    assert_eq!(error.code, Code::Write);
    assert!(error.to_string().contains("a.exr") && error.to_string().contains("Disk full"), "{error}");
    assert_eq!(fs::read(&path).expect("reads"), before);
    assert_eq!(names(folder.path()), ["a.exr"]);
    // Nor does a panic of the writer.
    let hidden = catch_unwind(|| write_whole(&path, |_| panic!("planted")));
    assert!(hidden.is_err());
    assert_eq!((fs::read(&path).expect("reads"), names(folder.path())), (before, vec!["a.exr".to_owned()]));
    // A success replaces it.
    save(&path, &image(), &meta(), &linear()).expect("saves");
    assert_eq!(load(&path).expect("loads").image, image());
}

#[test]
fn targets_that_cannot_be_written_are_refused() {
    let (folder, path) = saved("a.png", &plain());
    let before = fs::read(&path).expect("reads");
    let mut rights = fs::metadata(&path).expect("metadata").permissions();
    rights.set_readonly(true);
    fs::set_permissions(&path, rights.clone()).expect("sets");
    assert_eq!(save(&path, &image(), &meta(), &linear()).expect_err("read-only").code, Code::Write);
    assert_eq!(fs::read(&path).expect("reads"), before);
    let missing = folder.path().join("no/such/a.png");
    assert_eq!(save(&missing, &plain(), &meta(), &linear()).expect_err("no folder").code, Code::Write);
    let taken = folder.path().join("folder.exr");
    fs::create_dir(&taken).expect("creates");
    assert_eq!(save(&taken, &plain(), &meta(), &linear()).expect_err("a folder").code, Code::Write);
    assert_eq!(names(folder.path()), ["a.png", "folder.exr"]);
    for name in ["a.jpg", "a", ".exr", "a.exr.tmp"] {
        let error = save(&folder.path().join(name), &plain(), &meta(), &linear()).expect_err("ending");
        assert_eq!(error.code, Code::BadKey);
        assert!(error.why.contains(".exr, .png or .pfm"));
    }
    let mut broken = image();
    broken.layers[3].data.pop();
    let error = save(&folder.path().join("b.exr"), &broken, &meta(), &linear()).expect_err("not whole");
    assert_eq!(error.code, Code::Failed);
    assert_eq!(names(folder.path()), ["a.png", "folder.exr"]);
}

#[cfg(unix)]
#[test]
fn a_link_stays_a_link() {
    let (folder, path) = saved("a.pfm", &plain());
    let link = folder.path().join("link.pfm");
    std::os::unix::fs::symlink(&path, &link).expect("links");
    let mut other = plain();
    other.layers[0].data[0] = 9.0;
    save(&link, &other, &meta(), &linear()).expect("saves");
    assert!(fs::symlink_metadata(&link).expect("metadata").is_symlink());
    assert_eq!(load(&path).expect("loads").image.layers[0].data[0], 9.0);
}

#[test]
fn what_is_no_picture_is_named() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.exr");
    assert_eq!(load(&path).expect_err("missing").code, Code::NotFound);
    for (bytes, code) in [
        (&b""[..], Code::UnknownFormat),
        (b"P6\n1 1\n255\n...", Code::UnknownFormat),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0", Code::PointerFile),
        (b"PF\n", Code::Corrupt),
        (b"\x89PNG\r\n\x1a\n", Code::Corrupt),
        (b"\x76\x2f\x31\x01", Code::Corrupt),
    ] {
        fs::write(&path, bytes).expect("writes");
        assert_eq!(load(&path).expect_err("refused").code, code);
        if code != Code::Corrupt {
            assert_eq!(read_scene(&path).expect_err("refused").code, code);
        }
    }
}

#[test]
fn huge_claims_are_refused_before_memory_is_taken() {
    // An EXR of 2³⁰ x 2³⁰ pixels and a PNG of 2³¹−1 squared.
    let (_folder, path) = saved("a.exr", &plain());
    let mut bytes = fs::read(&path).expect("reads");
    let window = b"dataWindow\0box2i\0\x10\0\0\0";
    let at = bytes.windows(window.len()).position(|w| w == window).expect("a data window") + window.len();
    bytes[at + 8..at + 12].copy_from_slice(&((1i32 << 30) - 1).to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&((1i32 << 30) - 1).to_le_bytes());
    assert!(exr::read(&bytes).is_err());
    // As wide as memory would just allow.
    bytes[at + 8..at + 12].copy_from_slice(&((1i32 << 24) - 1).to_le_bytes());
    bytes[at + 12..at + 16].copy_from_slice(&36i32.to_le_bytes());
    assert!(matches!(exr::read(&bytes), Err(Fault::Corrupt(why)) if why.contains("cannot hold 16777216x37")));
    let (_folder, path) = saved("a.png", &plain());
    let mut bytes = fs::read(&path).expect("reads");
    bytes[16..20].copy_from_slice(&0x7fff_ffffu32.to_be_bytes());
    bytes[20..24].copy_from_slice(&0x7fff_ffffu32.to_be_bytes());
    assert!(png::read(&bytes).is_err());
    // The limits themselves.
    assert!(check_size(1000, 1000, 16, 16_000_000).is_ok());
    assert!(check_size(1000, 1000, 16, 7000).is_err());
    assert!(check_size(0, 5, 16, 7000).is_err());
    assert!(check_size(1 << 32, 1 << 32, 16, 7000).is_err());
}

#[test]
fn damaged_files_are_errors_and_never_panics() {
    for name in ["a.exr", "a.png", "a.pfm"] {
        let (_folder, path) = saved(name, &image());
        let whole = fs::read(&path).expect("reads");
        let read = |bytes: &[u8]| match Format::of_bytes(bytes) {
            Some(Format::Exr) => exr::read(bytes).map(|(image, _)| image),
            Some(Format::Png) => png::read(bytes).map(|(image, _)| image),
            Some(Format::Pfm) => pfm::read(bytes),
            None => Err(Fault::Corrupt(String::new())),
        };
        let expected = read(&whole).expect("reads");
        // Truncated anywhere: an error.
        for length in (0..whole.len()).step_by(whole.len() / 97 + 1).chain([whole.len() - 1]) {
            assert!(read(&whole[..length]).is_err(), "{name} cut to {length} of {}", whole.len());
        }
        // One byte changed anywhere: an error or a picture of the size that it says, never a panic.
        let mut state = 1u32;
        for _ in 0..300 {
            let mut bytes = whole.clone();
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            let at = state as usize % bytes.len();
            bytes[at] ^= 1 << (state >> 29);
            if let Ok(image) = read(&bytes) {
                assert_eq!(image.defect(), None, "{name}, byte {at}");
                assert!(image.pixels() <= 16 * expected.pixels());
            }
        }
    }
}

#[test]
fn a_channel_without_a_layer_before_its_point_is_a_layer() {
    let (_folder, path) = saved("a.exr", &plain());
    let mut bytes = fs::read(&path).expect("reads");
    let list = b"chlist\0";
    let at = bytes.windows(list.len()).position(|w| w == list).expect("channels") + list.len() + 4;
    assert_eq!(bytes[at..at + 2], *b"A\0");
    bytes[at] = b'.';
    let (image, _) = exr::read(&bytes).expect("reads");
    assert_eq!((image.defect(), &*image.layers[1].name), (None, "."));
    assert!(image.rgb().eq(plain().rgb()));
}

#[test]
fn an_offset_table_that_names_a_block_twice_is_refused() {
    let (_folder, path) = saved("a.exr", &plain());
    let mut bytes = fs::read(&path).expect("reads");
    // 37 rows in blocks of 16: three offsets, the first of which points behind the table.
    let first = (0..bytes.len() - 8)
        .find(|&at| u64::from_le_bytes(bytes[at..at + 8].try_into().expect("eight bytes")) == at as u64 + 24)
        .expect("an offset table");
    bytes.copy_within(first..first + 8, first + 8);
    assert!(matches!(exr::read(&bytes), Err(Fault::Corrupt(why)) if why.contains("offsets")));
}
