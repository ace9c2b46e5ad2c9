//! EXR: 32-bit float scan lines, ZIP. The picture has the channels `R G B A`; a channel of an AOV is named
//! `layer.channel`, or `layer` alone where the channel has no name.

use std::collections::HashSet;
use std::panic::{AssertUnwindSafe, catch_unwind};

use ::exr::block::reader::{ChunksReader, Reader};
use ::exr::block::{self, UncompressedBlock};
use ::exr::image::write::WritableImage;
use ::exr::image::{AnyChannel, AnyChannels, Blocks, Encoding, FlatSamples};
use ::exr::meta::MetaData;
use ::exr::meta::attribute::{AttributeValue, Chromaticities, LineOrder, SampleType, Text};
use ::exr::meta::header::{Header, LayerAttributes};
use ::exr::prelude::{Compression, Vec2};
use half::f16;

use super::*;
use crate::image::Layer;

/// Primaries and white point of ITU-R BT.709.
const REC709: Chromaticities = Chromaticities {
    red: Vec2(0.64, 0.33),
    green: Vec2(0.30, 0.60),
    blue: Vec2(0.15, 0.06),
    white: Vec2(0.3127, 0.3290),
};

/// Every layer; texts as UTF-8.
pub fn write(file: &mut BufWriter<File>, image: &Image, meta: &Metadata) -> io::Result<()> {
    let mut channels = Vec::new();
    for layer in &image.layers {
        for (index, channel) in layer.channels.iter().enumerate() {
            let name = match (layer.name.as_str(), channel.as_str()) {
                ("", channel) => channel.to_owned(),
                (layer, "") => layer.to_owned(),
                (layer, channel) => format!("{layer}.{channel}"),
            };
            let samples = layer.data.iter().skip(index).step_by(layer.channels.len()).copied().collect();
            channels.push(AnyChannel::new(text(&name), FlatSamples::F32(samples)));
        }
    }
    let encoding =
        Encoding { compression: Compression::ZIP16, blocks: Blocks::ScanLines, line_order: LineOrder::Increasing };
    let mut attributes = LayerAttributes {
        software_name: some_text(&meta.software),
        comments: some_text(&meta.description),
        ..LayerAttributes::default()
    };
    // One text in each of the two maps: their order in the file would be random within one.
    if let Some(scene) = some_text(&meta.scene_toml) {
        attributes.other.insert(text(SCENE_KEY), AttributeValue::Text(scene));
    }
    let size = (image.width as usize, image.height as usize);
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let mut picture = ::exr::image::Image::from_layer(::exr::image::Layer::new(size, attributes, encoding, channels));
    picture.attributes.chromaticities = Some(REC709);
    if let Some(stats) = some_text(&meta.stats_json) {
        picture.attributes.other.insert(text(STATS_KEY), AttributeValue::Text(stats));
    }
    picture.write().to_buffered(file).map_err(|e| match e {
        ::exr::error::Error::Io(e) => e,
        other => io::Error::other(other.to_string()),
    })
}

/// The first part that has R, G, B (or Y, grey): its data window is the picture, its other channels the AOVs.
pub fn read(bytes: &[u8]) -> std::result::Result<(Image, Texts), Fault> {
    let reader = block::read(Cursor::new(bytes), false).map_err(decoding)?;
    let part = reader.headers().iter().position(|header| colours(header).is_some()).ok_or_else(|| {
        let names: Vec<String> = reader.headers().iter().flat_map(channel_names).collect();
        Fault::Unsupported(format!("It has no channels R, G, B or Y but: {}.", names.join(", ")))
    })?;
    let header = reader.headers()[part].clone();
    if header.deep || header.channels.list.iter().any(|channel| channel.sampling != Vec2(1, 1)) {
        return Err(Fault::Unsupported("It has deep or subsampled pixels.".into()));
    }
    check_codec(header.compression)?;
    let (width, height) = (header.layer_size.width() as u64, header.layer_size.height() as u64);
    check_size(width, height, 4 * header.channels.list.len() as u64, bytes.len())?;
    let texts = texts_of(reader.headers());
    let mut image = Image::from_rgba(width as u32, height as u32, vec![1.0; (width * height * 4) as usize]);
    let targets = targets(&header, &mut image);
    // The PIZ decoder of `exr` 1.74 indexes out of range on some damaged blocks (one in some ten thousand mutations).
    // A half-filled image is dropped, so nothing broken outlives the panic.
    let filled = catch_unwind(AssertUnwindSafe(|| fill(reader, part, &header, &targets, &mut image)));
    filled.unwrap_or_else(|_| Err(Fault::Corrupt("The decoder met impossible data.".into())))?;
    Ok((image, texts))
}

/// The texts; reads headers only.
pub fn read_texts(bytes: &[u8]) -> std::result::Result<Texts, Fault> {
    let meta = MetaData::read_from_buffered(Cursor::new(bytes), false).map_err(decoding)?;
    Ok(texts_of(&meta.headers))
}

/// Refuses the codecs whose decoders in `exr` 1.74 do not stand damaged data: B44 overflows (a panic in debug builds),
/// DWA asks for as much memory as the data claims and then aborts, HTJ2K is optional there.
fn check_codec(codec: Compression) -> std::result::Result<(), Fault> {
    refused_codec(codec).map_or(Ok(()), |why| Err(Fault::Unsupported(why)))
}

/// Why a codec is refused; `None` if it is read.
pub fn refused_codec(codec: Compression) -> Option<String> {
    use Compression::{PIZ, PXR24, RLE, Uncompressed, ZIP1, ZIP16};
    match codec {
        Uncompressed | RLE | ZIP1 | ZIP16 | PIZ | PXR24 => None,
        _ => Some(format!("Its compression is {codec}; none, RLE, ZIP, PIZ and PXR24 are read.")),
    }
}

/// Where a channel of the file goes: to these channels of that layer.
struct Target {
    layer: usize,
    channels: Vec<usize>,
}

/// Which channel of the file each of R, G, B comes from, if the part is a picture.
fn colours(header: &Header) -> Option<[usize; 3]> {
    let names: Vec<String> = channel_names(header).collect();
    let find = |name: &str| names.iter().position(|n| n == name);
    match (find("R"), find("G"), find("B"), find("Y")) {
        (Some(r), Some(g), Some(b), _) => Some([r, g, b]),
        (None, None, None, Some(y)) => Some([y; 3]),
        _ => None,
    }
}

fn channel_names(header: &Header) -> impl Iterator<Item = String> {
    header.channels.list.iter().map(|channel| String::from_utf8_lossy(channel.name.as_slice()).into_owned())
}

/// The target of every channel of the file; adds the layers of the AOVs to the image.
fn targets(header: &Header, image: &mut Image) -> Vec<Target> {
    let colours = colours(header).expect("the part was chosen for its colours");
    let pixels = image.pixels();
    let mut targets: Vec<Target> = Vec::new();
    let mut aovs: Vec<(usize, String, String)> = Vec::new();
    for (index, name) in channel_names(header).enumerate() {
        let channels: Vec<usize> =
            if name == "A" { vec![3] } else { (0..3).filter(|&c| colours[c] == index).collect() };
        if channels.is_empty() {
            // What stands before the point is no name where it is empty: that is the picture's own layer.
            let (layer, channel) = name.rsplit_once('.').filter(|(layer, _)| !layer.is_empty()).unwrap_or((&name, ""));
            aovs.push((index, layer.to_owned(), channel.to_owned()));
        }
        targets.push(Target { layer: 0, channels });
    }
    // EXR sorts names; colours have their own order, the rest keep the file's.
    aovs.sort_by_key(|(_, layer, channel)| (layer.clone(), "RGBA".find(channel.as_str()).unwrap_or(usize::MAX)));
    for (index, layer, channel) in aovs {
        if image.layers.last().is_none_or(|last| last.name != layer) {
            image.layers.push(Layer { name: layer, channels: Vec::new(), data: Vec::new() });
        }
        let number = image.layers.len() - 1;
        let last = &mut image.layers[number];
        targets[index] = Target { layer: number, channels: vec![last.channels.len()] };
        last.channels.push(channel);
    }
    for layer in &mut image.layers[1..] {
        layer.data = vec![0.0; pixels * layer.channels.len()];
    }
    targets
}

/// Decodes the full-size level of one part into the image.
fn fill(
    reader: Reader<Cursor<&[u8]>>,
    part: usize,
    header: &Header,
    targets: &[Target],
    image: &mut Image,
) -> std::result::Result<(), Fault> {
    let chunks = reader
        .filter_chunks(false, |_, tile, block| block.layer == part && tile.level_index == Vec2(0, 0))
        .map_err(decoding)?;
    let mut seen = HashSet::new();
    chunks
        .decompress_sequential(false, |_, block| {
            // An offset table may name a block twice, and then leaves out another.
            if block.index.layer != part || block.index.level != Vec2(0, 0) || !seen.insert(block.index.pixel_position)
            {
                return Err(::exr::error::Error::Invalid("its table of offsets is wrong".into()));
            }
            copy(&block, header, targets, image)
        })
        .map_err(decoding)
}

/// Copies a decoded block to its place, all values as 32-bit floats.
fn copy(block: &UncompressedBlock, header: &Header, targets: &[Target], image: &mut Image) -> ::exr::error::UnitResult {
    let width = image.width as usize;
    for line in block.lines(&header.channels) {
        let target = &targets[line.location.channel];
        let layer = &mut image.layers[target.layer];
        let stride = layer.channels.len();
        let first = line.location.position.y() * width + line.location.position.x();
        let place = &mut layer.data[first * stride..][..line.location.sample_count * stride];
        let mut put = |pixel: usize, value: f32| {
            for channel in &target.channels {
                place[pixel * stride + channel] = value;
            }
        };
        match header.channels.list[line.location.channel].sample_type {
            SampleType::F32 => line.read_samples::<f32>().enumerate().try_for_each(|(i, v)| v.map(|v| put(i, v)))?,
            SampleType::F16 => {
                line.read_samples::<f16>().enumerate().try_for_each(|(i, v)| v.map(|v| put(i, v.to_f32())))?
            }
            SampleType::U32 => {
                line.read_samples::<u32>().enumerate().try_for_each(|(i, v)| v.map(|v| put(i, v as f32)))?
            }
        }
    }
    Ok(())
}

/// The texts of the first part that has each.
fn texts_of(headers: &[Header]) -> Texts {
    let other = |key: &str| {
        headers.iter().find_map(|header| {
            let value = header.own_attributes.other.get(&text(key)).or(header.shared_attributes.other.get(&text(key)));
            match value {
                Some(AttributeValue::Text(value)) => Some(string(value)),
                _ => None,
            }
        })
    };
    Texts {
        scene_toml: other(SCENE_KEY),
        stats_json: other(STATS_KEY),
        software: headers.iter().find_map(|header| header.own_attributes.software_name.as_ref().map(string)),
        description: headers.iter().find_map(|header| header.own_attributes.comments.as_ref().map(string)),
    }
}

/// UTF-8; the crate's own conversion refuses what Latin-1 lacks.
fn text(value: &str) -> Text {
    Text::from_slice_unchecked(value.as_bytes())
}

fn some_text(value: &str) -> Option<Text> {
    (!value.is_empty()).then(|| text(value))
}

fn string(text: &Text) -> String {
    String::from_utf8_lossy(text.as_slice()).into_owned()
}

fn decoding(error: ::exr::error::Error) -> Fault {
    match error {
        ::exr::error::Error::NotSupported(why) => Fault::Unsupported(format!("It needs what is not read: {why}.")),
        other => Fault::Corrupt(format!("The decoder says: {other}.")),
    }
}
