//! Writes small OpenVDB files for tests, independently of the reader: the same choices as the library makes.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Write;

use flate2::Compression;
use flate2::write::ZlibEncoder;
use half::f16;

/// Compression flags.
pub const ZIP: u32 = 1;
pub const MASK: u32 = 2;
pub const BLOSC: u32 = 4;

type Coord = [i32; 3];

/// Values of a tree, whichever way they are stored.
#[derive(Clone, Debug, Default)]
pub struct Sketch {
    pub background: f64,
    /// By origin: 512 values and whether each is active.
    pub leaves: BTreeMap<Coord, Vec<(f64, bool)>>,
    /// By side and origin.
    pub tiles: BTreeMap<(i32, Coord), (f64, bool)>,
}

/// How a file is stored.
#[derive(Clone, Copy, Debug)]
pub struct Format {
    pub version: u32,
    pub offsets: bool,
    pub flags: u32,
    /// `half`, `float`, `double`, or another type whose values are written as `value_size` equal bytes.
    pub value_type: &'static str,
    pub as_half: bool,
    /// Whether the children of the root stand in the wrong order.
    pub reversed: bool,
}

impl Default for Format {
    fn default() -> Format {
        Format { version: 224, offsets: true, flags: MASK, value_type: "float", as_half: false, reversed: false }
    }
}

/// A grid of a file.
#[derive(Clone, Debug)]
pub struct GridSpec {
    pub name: Vec<u8>,
    pub class: Option<&'static str>,
    pub format: Format,
    /// Name and content of the transform.
    pub map: (&'static str, Vec<f64>),
    pub parent: &'static str,
    pub tree: Sketch,
}

impl GridSpec {
    pub fn new(name: &str, format: Format, tree: Sketch) -> GridSpec {
        let map = ("UniformScaleMap", scale([0.5; 3]));
        GridSpec { name: name.into(), class: Some("fog volume"), format, map, parent: "", tree }
    }
}

/// The content of a scale map.
pub fn scale(sides: [f64; 3]) -> Vec<f64> {
    let derived: [fn(f64) -> f64; 5] = [|s| s, f64::abs, f64::recip, |s| (s * s).recip(), |s| 0.5 / s];
    derived.iter().flat_map(|derive| sides.map(derive)).collect()
}

/// A whole file; version and offsets are those of the first grid (or of `Format::default`).
pub fn file(grids: &[GridSpec]) -> Vec<u8> {
    let format = grids.first().map_or_else(Format::default, |grid| grid.format);
    let mut out = Vec::new();
    out.extend(0x5644_4220_u64.to_le_bytes());
    for word in [format.version, 12, 0] {
        out.extend(word.to_le_bytes());
    }
    out.push(format.offsets.into());
    if format.version < 222 {
        out.push((format.flags & ZIP != 0).into());
    }
    out.extend([b'0'; 36]);
    metadata(&mut out, &[("creator", "string", b"tests"), ("odd", "unheard of", &[1, 2, 3])]);
    out.extend((grids.len() as u32).to_le_bytes());
    for grid in grids {
        grid.write(&mut out);
    }
    out
}

fn text(out: &mut Vec<u8>, text: &[u8]) {
    out.extend((text.len() as u32).to_le_bytes());
    out.extend(text);
}

fn metadata(out: &mut Vec<u8>, entries: &[(&str, &str, &[u8])]) {
    out.extend((entries.len() as u32).to_le_bytes());
    for (name, kind, value) in entries {
        text(out, name.as_bytes());
        text(out, kind.as_bytes());
        text(out, value);
    }
}

impl GridSpec {
    fn write(&self, out: &mut Vec<u8>) {
        let format = self.format;
        text(out, &self.name);
        let suffix = if format.as_half { "_HalfFloat" } else { "" };
        text(out, format!("Tree_{}_5_4_3{suffix}", format.value_type).as_bytes());
        text(out, self.parent.as_bytes());
        let positions = out.len();
        out.extend([0; 24]);
        let start = out.len();
        if format.version >= 222 {
            out.extend(format.flags.to_le_bytes());
        }
        let mut entries: Vec<(&str, &str, &[u8])> = Vec::new();
        entries.extend(self.class.map(|class| ("class", "string", class.as_bytes())));
        entries.push(("is_saved_as_half_float", "bool", if format.as_half { &[1] } else { &[0] }));
        metadata(out, &entries);
        text(out, self.map.0.as_bytes());
        out.extend(self.map.1.iter().flat_map(|number| number.to_le_bytes()));
        let mut blocks = 0;
        if self.parent.is_empty() {
            out.extend(1_i32.to_le_bytes());
            self.topology(out);
            blocks = out.len();
            self.buffers(out);
        }
        if format.offsets {
            let ends = [start, blocks, out.len()].map(|position| position as i64);
            for (i, position) in ends.into_iter().enumerate() {
                out[positions + 8 * i..][..8].copy_from_slice(&position.to_le_bytes());
            }
        }
    }

    /// Origins of nodes of this side that hold something smaller.
    fn nodes(&self, side: i32) -> BTreeSet<Coord> {
        let tiles = self.tree.tiles.keys().filter(|(tile, _)| *tile < side).map(|(_, origin)| origin);
        tiles.chain(self.tree.leaves.keys()).map(|origin| origin.map(|c| c.div_euclid(side) * side)).collect()
    }

    fn topology(&self, out: &mut Vec<u8>) {
        self.number(out, self.tree.background);
        let uppers = self.nodes(4096);
        let roots = self.tree.tiles.iter().filter(|((side, _), _)| *side == 4096);
        out.extend((roots.clone().count() as u32).to_le_bytes());
        out.extend((uppers.len() as u32).to_le_bytes());
        for ((_, origin), (value, active)) in roots {
            out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
            self.number(out, *value);
            out.push((*active).into());
        }
        let mut uppers: Vec<Coord> = uppers.into_iter().collect();
        if self.format.reversed {
            uppers.reverse();
        }
        for upper in uppers {
            out.extend(upper.iter().flat_map(|c| c.to_le_bytes()));
            self.node(out, upper, 32, 128, &self.nodes(128));
            for lower in within(&self.nodes(128), upper, 4096) {
                self.node(out, lower, 16, 8, &self.tree.leaves.keys().copied().collect());
                for leaf in within(&self.tree.leaves.keys().copied().collect(), lower, 128) {
                    out.extend(bits(self.tree.leaves[&leaf].iter().map(|voxel| voxel.1)));
                }
            }
        }
    }

    /// An internal node of `count`³ children of side `side`.
    fn node(&self, out: &mut Vec<u8>, origin: Coord, count: i32, side: i32, children: &BTreeSet<Coord>) {
        let mut places = Vec::new();
        for x in 0..count {
            for y in 0..count {
                places.extend((0..count).map(|z| [origin[0] + x * side, origin[1] + y * side, origin[2] + z * side]));
            }
        }
        let is_child: Vec<bool> = places.iter().map(|place| children.contains(place)).collect();
        let none = (self.tree.background, false);
        let values: Vec<(f64, bool)> =
            places.iter().map(|place| self.tree.tiles.get(&(side, *place)).copied().unwrap_or(none)).collect();
        out.extend(bits(is_child.iter().copied()));
        out.extend(bits(values.iter().map(|voxel| voxel.1)));
        if self.format.version < 222 {
            let stored: Vec<f64> = (0..values.len()).filter(|&i| !is_child[i]).map(|i| values[i].0).collect();
            self.data(out, &stored);
        } else {
            self.block(out, &values);
        }
    }

    fn buffers(&self, out: &mut Vec<u8>) {
        let mut leaves: Vec<(&Coord, &Vec<(f64, bool)>)> = self.tree.leaves.iter().collect();
        // By the root's children, then by the lower nodes, then by place.
        leaves.sort_by_key(|(origin, _)| [4096, 128, 8].map(|side| origin.map(|c: i32| c.div_euclid(side))));
        for (i, (origin, voxels)) in leaves.into_iter().enumerate() {
            out.extend(bits(voxels.iter().map(|voxel| voxel.1)));
            if ["bool", "mask"].contains(&self.format.value_type) {
                out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
                let values = bits(voxels.iter().map(|voxel| voxel.0 != 0.0));
                out.extend(if self.format.value_type == "bool" { values } else { Vec::new() });
                continue;
            }
            if self.format.version >= 222 {
                self.block(out, voxels);
                continue;
            }
            let values: Vec<f64> = voxels.iter().map(|voxel| voxel.0).collect();
            out.extend(origin.iter().flat_map(|c| c.to_le_bytes()));
            // The first leaf has an auxiliary buffer, as files of that time may have.
            out.push(if i == 0 { 2 } else { 1 });
            self.data(out, &values);
            if i == 0 {
                self.data(out, &vec![77.0; values.len()]);
            }
        }
    }

    /// Values of a node in the library's way: without the inactive ones if those are at most two.
    fn block(&self, out: &mut Vec<u8>, voxels: &[(f64, bool)]) {
        let background = self.tree.background;
        let all: Vec<f64> = voxels.iter().map(|voxel| voxel.0).collect();
        let mut inactive: Vec<f64> = Vec::new();
        for (value, _) in voxels.iter().filter(|voxel| !voxel.1) {
            if !inactive.contains(value) {
                inactive.push(*value);
            }
        }
        if self.format.flags & MASK == 0 || inactive.len() > 2 {
            out.push(6);
            return self.data(out, &all);
        }
        // The second one is the background if it is among two.
        if inactive.len() == 2 && inactive[0] == background {
            inactive.reverse();
        }
        let code = match *inactive {
            [] => 0,
            [one] if one == background => 0,
            [one] if one == -background => 1,
            [_] => 2,
            [one, two] if one == -background && two == background => 3,
            [_, two] if two == background => 4,
            _ => 5,
        };
        out.push(code);
        if [2, 4, 5].contains(&code) {
            self.number(out, inactive[0]);
        }
        if code == 5 {
            self.number(out, inactive[1]);
        }
        if code >= 3 {
            out.extend(bits(voxels.iter().map(|voxel| !voxel.1 && voxel.0 == inactive[1])));
        }
        let active: Vec<f64> = voxels.iter().filter(|voxel| voxel.1).map(|voxel| voxel.0).collect();
        self.data(out, &active);
    }

    /// A value that stands alone.
    fn number(&self, out: &mut Vec<u8>, value: f64) {
        match self.format.value_type {
            "half" => out.extend(f16::from_f64(value).to_le_bytes()),
            "double" => out.extend(value.to_le_bytes()),
            "vec3s" => out.extend([value as f32; 3].iter().flat_map(|value| value.to_le_bytes())),
            "bool" | "mask" => out.push((value != 0.0).into()),
            _ => out.extend((value as f32).to_le_bytes()),
        }
    }

    /// Many values, packed.
    fn data(&self, out: &mut Vec<u8>, values: &[f64]) {
        let mut raw = Vec::new();
        for &value in values {
            match self.format.value_type {
                "vec3s" if self.format.as_half => {
                    raw.extend([f16::from_f64(value); 3].iter().flat_map(|v| v.to_le_bytes()))
                }
                "float" | "double" if self.format.as_half => raw.extend(f16::from_f64(value).to_le_bytes()),
                _ => self.number(&mut raw, value),
            }
        }
        let flags = self.format.flags;
        if flags & (ZIP | BLOSC) == 0 || (self.format.as_half && values.is_empty()) {
            return out.extend(raw);
        }
        let packed = if flags & BLOSC != 0 { blosc(&raw) } else { zip(&raw) };
        if packed.len() < raw.len() {
            out.extend((packed.len() as i64).to_le_bytes());
            out.extend(packed);
        } else {
            out.extend((-(raw.len() as i64)).to_le_bytes());
            out.extend(raw);
        }
    }
}

/// Those of `all` in the cube of this origin and side, by place.
fn within(all: &BTreeSet<Coord>, origin: Coord, side: i32) -> Vec<Coord> {
    all.iter().filter(|place| place.map(|c| c.div_euclid(side) * side) == origin).copied().collect()
}

fn bits(values: impl Iterator<Item = bool>) -> Vec<u8> {
    let values: Vec<bool> = values.collect();
    values.chunks(8).map(|byte| byte.iter().enumerate().fold(0, |sum, (i, &bit)| sum | u8::from(bit) << i)).collect()
}

fn zip(raw: &[u8]) -> Vec<u8> {
    let mut encoder = ZlibEncoder::new(Vec::new(), Compression::best());
    encoder.write_all(raw).expect("a vector takes all bytes");
    encoder.finish().expect("a vector takes all bytes")
}

/// A Blosc buffer of one block of one LZ4 stream without shuffling.
fn blosc(raw: &[u8]) -> Vec<u8> {
    const LZ4_UNSPLIT: u8 = 1 << 5 | 16;
    let stream = lz4_flex::block::compress(raw);
    let total = 16 + 4 + 4 + stream.len();
    let mut out = vec![2, 1, LZ4_UNSPLIT, 4];
    for word in [raw.len(), raw.len(), total, 20, stream.len()] {
        out.extend((word as u32).to_le_bytes());
    }
    out.extend(stream);
    out
}
