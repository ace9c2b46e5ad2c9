//! A small writer of the public layout.

use std::collections::{BTreeMap, BTreeSet};
use std::io::Read;

use glam::{DMat4, DVec3, IVec3};

use super::super::*;
use crate::volume::grid::Tile;

pub(super) const FLOAT: u32 = 1;
pub(super) const DOUBLE: u32 = 2;
const FOG: u32 = 2;
pub(super) const V32_4: u32 = 32 << 21 | 4 << 10;
pub(super) const V32_9: u32 = 32 << 21 | 9 << 10;
/// Where the writer puts the root.
pub(super) const ROOT: usize = 736;

/// A whole file, zipped, of one-leaf grids with these names and value types (1 float, 6 a vector), for other tests:
/// voxel n of the leaf at (−8, 0, 128) is n/100 + ¼ in single precision, the background ½.
pub(crate) fn sample(grids: &[(&'static str, u32)]) -> Vec<u8> {
    let grid = |&(name, value_type)| {
        let mut grid = Model { name, ..Model::small(FLOAT) }.bytes();
        grid[636..640].copy_from_slice(&u32::to_le_bytes(value_type));
        grid
    };
    segment(&grids.iter().map(grid).collect::<Vec<_>>(), 1, MAGIC_FILE, V32_9)
}

/// What the writer writes.
pub(super) struct Model {
    pub(super) value_type: u32,
    pub(super) class: u32,
    pub(super) name: &'static str,
    pub(super) matrix: DMat4,
    pub(super) background: f64,
    /// Origin, values, active voxels.
    pub(super) leaves: Vec<(IVec3, Vec<f64>, [u64; 8])>,
    /// With the sides 4096, 128 and 8.
    pub(super) tiles: Vec<Tile>,
    /// Logarithm of the bits of FloatN codes.
    pub(super) width: u32,
    pub(super) magic: u8,
    pub(super) version: u32,
}

impl Model {
    /// Two leaves in different upper nodes, and tiles of all sides.
    pub(super) fn of(value_type: u32) -> Model {
        let values = |scale: f64| (0..512).map(|n| f64::from((n as f64 * scale) as f32 + 0.25)).collect();
        let tile = |origin: [i32; 3], side, value, active| Tile { origin: origin.into(), side, value, active };
        Model {
            value_type,
            class: FOG,
            name: "smoke",
            matrix: DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DMat4::from_rotation_x(0.3),
            background: 0.5,
            leaves: vec![
                (IVec3::new(-8, 0, 128), values(0.01), [0xff00_ff00_1234_5678, 0, 1, 2, 3, 4, 5, u64::MAX]),
                (IVec3::new(4096, 8, 16), values(-0.125), [1 << 63, 0, 0, 0, 0, 0, 0, 1]),
            ],
            tiles: vec![
                tile([-16, 8, 136], 8, 0.75, true),
                tile([-256, 1024, 0], 128, -2.0, false),
                tile([8192, -4096, i32::MAX - 4095], 4096, 3.0, true),
            ],
            width: 0,
            magic: MAGIC_GRID,
            version: V32_9,
        }
    }

    /// The same with one leaf, in one upper node.
    pub(super) fn small(value_type: u32) -> Model {
        let mut model = Model::of(value_type);
        model.leaves.truncate(1);
        model
    }

    fn quantised(&self) -> Option<u32> {
        match self.value_type {
            13..=15 => Some(self.value_type - 11),
            16 => Some(self.width),
            _ => None,
        }
    }

    /// The bytes of a leaf.
    fn leaf(&self, origin: IVec3, values: &[f64], active: &[u64; 8]) -> Vec<u8> {
        let mut out: Vec<u8> = origin.to_array().iter().flat_map(|n| n.to_le_bytes()).collect();
        out.extend([7, 7, 7, (self.width << 5) as u8]);
        out.extend(active.iter().flat_map(|word| word.to_le_bytes()));
        let least = values.iter().copied().fold(f64::INFINITY, f64::min) as f32;
        let greatest = values.iter().copied().fold(f64::NEG_INFINITY, f64::max) as f32;
        let Some(width) = self.quantised() else {
            let double = self.value_type == DOUBLE;
            out.resize(if double { 128 } else { 96 }, 0);
            for &value in values {
                if double { out.extend(value.to_le_bytes()) } else { out.extend((value as f32).to_le_bytes()) }
            }
            return out;
        };
        let bits = 1 << width;
        let quantum = (greatest - least) / ((1u32 << bits) - 1) as f32;
        out.extend(least.to_le_bytes());
        out.extend(quantum.to_le_bytes());
        out.resize(96, 0);
        let code = |value: f64| ((value as f32 - least) / quantum + 0.5) as u32;
        if bits == 16 {
            out.extend(values.iter().flat_map(|&value| (code(value) as u16).to_le_bytes()));
        } else {
            for group in values.chunks(8 / bits as usize) {
                out.push(group.iter().rev().fold(0, |byte, &value| byte << bits | code(value)) as u8);
            }
        }
        out
    }

    /// The value that a stored one decodes to.
    pub(super) fn decoded(&self, values: &[f64], n: usize) -> f64 {
        let Some(width) = self.quantised() else { return values[n] };
        let (least, greatest) =
            values.iter().fold((f32::INFINITY, f32::NEG_INFINITY), |(a, b), &v| (a.min(v as f32), b.max(v as f32)));
        let quantum = (greatest - least) / ((1u32 << (1 << width)) - 1) as f32;
        (((values[n] as f32 - least) / quantum + 0.5).floor() * quantum + least).into()
    }

    pub(super) fn value(&self, value: f64) -> Vec<u8> {
        if self.value_type == DOUBLE { value.to_le_bytes().to_vec() } else { (value as f32).to_le_bytes().to_vec() }
    }

    /// The grid's bytes, without checksums.
    pub(super) fn bytes(&self) -> Vec<u8> {
        let down = |at: IVec3, side: i32| at & !(side - 1);
        let inner = || self.tiles.iter().filter(|tile| tile.side < 4096);
        let uppers: BTreeSet<[i32; 3]> = self
            .leaves
            .iter()
            .map(|leaf| leaf.0)
            .chain(inner().map(|tile| tile.origin))
            .map(|at| down(at, 4096).into())
            .collect();
        let lowest = inner().filter(|tile| tile.side == 8).map(|tile| tile.origin);
        let lowers: BTreeSet<[i32; 3]> =
            self.leaves.iter().map(|leaf| leaf.0).chain(lowest).map(|at| down(at, 128).into()).collect();
        let leaves: BTreeMap<[i32; 3], Vec<u8>> = self
            .leaves
            .iter()
            .map(|(origin, values, active)| (origin.to_array(), self.leaf(*origin, values, active)))
            .collect();
        // Where everything goes.
        let double = self.value_type == DOUBLE;
        let root_head = if double { 96 } else { 64 };
        let root_tiles: Vec<&Tile> = self.tiles.iter().filter(|tile| tile.side == 4096).collect();
        let rows = uppers.len() + root_tiles.len();
        let mut at = ROOT + root_head + 32 * rows;
        let mut place = |size: usize| {
            at += size;
            at - size
        };
        let upper_at: BTreeMap<_, _> = uppers.iter().map(|&origin| (origin, place(8256 + 8 * 32768))).collect();
        let lower_at: BTreeMap<_, _> = lowers.iter().map(|&origin| (origin, place(1088 + 8 * 4096))).collect();
        let leaf_at: BTreeMap<_, _> = leaves.iter().map(|(&origin, leaf)| (origin, place(leaf.len()))).collect();
        let mut out = self.head(at);
        // The tree's head.
        let first = |nodes: &BTreeMap<[i32; 3], usize>| nodes.values().next().map_or(0, |&at| (at - 672) as u64);
        for offset in [first(&leaf_at), first(&lower_at), first(&upper_at), 64] {
            out.extend(offset.to_le_bytes());
        }
        for count in [leaf_at.len(), lower_at.len(), upper_at.len(), 0, 0, 0, 0, 0] {
            out.extend((count as u32).to_le_bytes());
        }
        // The root.
        out.extend([0; 24]);
        out.extend((rows as u32).to_le_bytes());
        out.extend(if double { &[0; 4][..] } else { &[] });
        out.extend(self.value(self.background));
        out.resize(ROOT + root_head, 0);
        let key = |origin: IVec3| {
            let part = |n: i32| u64::from(n as u32 >> 12);
            part(origin.x) << 42 | part(origin.y) << 21 | part(origin.z)
        };
        let mut row = |origin: IVec3, child: usize, active: bool, value: f64| {
            out.extend(key(origin).to_le_bytes());
            out.extend((child as u64).to_le_bytes());
            out.extend(u32::from(active).to_le_bytes());
            out.extend(if double { &[0; 4][..] } else { &[] });
            out.extend(self.value(value));
            out.resize(out.len().next_multiple_of(32), 0);
        };
        for (&origin, &at) in &upper_at {
            row(origin.into(), at - ROOT, false, 0.0);
        }
        for tile in root_tiles {
            row(tile.origin, 0, tile.active, tile.value);
        }
        // Upper and lower nodes, then leaves.
        self.nodes(&mut out, 5, 128, &upper_at, &lower_at);
        self.nodes(&mut out, 4, 8, &lower_at, &leaf_at);
        out.extend(leaves.into_values().flatten());
        assert_eq!(out.len(), at);
        out
    }

    /// Appends a level of nodes with these children.
    fn nodes(
        &self,
        out: &mut Vec<u8>,
        log2: u32,
        child_side: i32,
        nodes: &BTreeMap<[i32; 3], usize>,
        children: &BTreeMap<[i32; 3], usize>,
    ) {
        for (&origin, &at) in nodes {
            let origin = IVec3::from(origin);
            let count = 1 << (3 * log2);
            let (mut active, mut child) = (vec![0u8; count / 8], vec![0u8; count / 8]);
            let mut table: Vec<[u8; 8]> = Vec::new();
            for n in 0..count {
                let mask = (1 << log2) - 1;
                let local = IVec3::new((n >> (2 * log2)) as i32, (n >> log2 & mask) as i32, (n & mask) as i32);
                let here = origin + local * child_side;
                let tile = self.tiles.iter().find(|tile| tile.side == child_side && tile.origin == here);
                let mut entry = [0; 8];
                if let Some(&child_at) = children.get(&here.to_array()) {
                    child[n / 8] |= 1 << (n % 8);
                    entry = ((child_at - at) as u64).to_le_bytes();
                } else {
                    let value = self.value(tile.map_or(self.background, |tile| tile.value));
                    entry[..value.len()].copy_from_slice(&value);
                    active[n / 8] |= u8::from(tile.is_some_and(|tile| tile.active)) << (n % 8);
                }
                table.push(entry);
            }
            out.extend([0; 32]);
            out.extend(active);
            out.extend(child);
            out.extend([0; 32]); // statistics
            out.extend(table.into_flattened());
        }
    }

    /// The grid's head.
    fn head(&self, size: usize) -> Vec<u8> {
        let mut out = [MAGIC, &[self.magic]].concat();
        out.extend([0xff; 8]);
        out.extend(self.version.to_le_bytes());
        out.extend([0; 12]);
        out.extend((size as u64).to_le_bytes());
        out.extend(self.name.as_bytes());
        out.resize(40 + 256 + 22 * 4, 0);
        let (matrix, shift) = (self.matrix.transpose().to_cols_array(), self.matrix.w_axis);
        let rows = (0..9).map(|i| matrix[i / 3 * 4 + i % 3]);
        out.extend(rows.chain([0.0; 9]).chain(shift.truncate().to_array()).flat_map(f64::to_le_bytes));
        out.resize(632, 0);
        out.extend(self.class.to_le_bytes());
        out.extend(self.value_type.to_le_bytes());
        out.resize(672, 0);
        out
    }
}

/// Sets the checksums of a grid of the new kind.
pub(super) fn sum_up(grid: &mut [u8], full: bool) {
    let crc = |bytes: &[u8]| {
        let mut crc = flate2::Crc::new();
        crc.update(bytes);
        crc.sum().to_le_bytes()
    };
    let head = crc(&grid[16..736]);
    grid[8..12].copy_from_slice(&head);
    if full {
        let tail = &grid[736..];
        let (whole, last) = tail.split_at((tail.len() / 4096 - 1) * 4096);
        let sums: Vec<u8> = whole.chunks(4096).chain([last]).flat_map(crc).collect();
        let sum = crc(&sums);
        grid[12..16].copy_from_slice(&sum);
    }
}

/// A segment of these grids.
pub(super) fn segment(grids: &[Vec<u8>], codec: u16, magic: u8, version: u32) -> Vec<u8> {
    let packed: Vec<Vec<u8>> = grids
        .iter()
        .map(|grid| match codec {
            1 => {
                let mut zip = Vec::new();
                flate2::read::ZlibEncoder::new(&**grid, flate2::Compression::fast()).read_to_end(&mut zip).unwrap();
                [&(zip.len() as u64).to_le_bytes()[..], &zip].concat()
            }
            2 => {
                // A Blosc buffer that only copies.
                let sizes = [grid.len(), grid.len(), grid.len() + 16];
                let sizes: Vec<u8> = sizes.iter().flat_map(|&n| (n as u32).to_le_bytes()).collect();
                [&(grid.len() as u64 + 16).to_le_bytes()[..], &[2, 1, 2, 4], &sizes, grid].concat()
            }
            _ => grid.clone(),
        })
        .collect();
    let mut out = [MAGIC, &[magic]].concat();
    out.extend(version.to_le_bytes());
    out.extend((grids.len() as u16).to_le_bytes());
    out.extend(codec.to_le_bytes());
    for (grid, packed) in grids.iter().zip(&packed) {
        let name = &grid[40..40 + 256];
        let name = &name[..=name.iter().position(|&byte| byte == 0).unwrap()];
        let row = out.len();
        out.extend((grid.len() as u64).to_le_bytes());
        out.extend((packed.len() as u64).to_le_bytes());
        out.resize(row + 32, 0);
        out.extend(&grid[636..640]);
        out.extend(&grid[632..636]);
        out.resize(row + 136, 0);
        out.extend((name.len() as u32).to_le_bytes());
        out.resize(row + 176, 0);
        out.extend(name);
    }
    out.extend(packed.concat());
    out
}
