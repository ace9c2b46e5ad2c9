//! The tree of a grid: root, two levels of internal nodes, leaves; first all topology, then all values of leaves.

use std::collections::HashSet;

use glam::IVec3;
use rayon::prelude::*;

use super::block::{Block, Encoding, Layout, NODE_MASK_VERSION, Real, bit, number, ones};
use crate::error::{Code, Error, Result};
use crate::io::bytes::Bytes;
use crate::volume::grid::{LEAF_SIDE, LEAF_VOXELS, Leaf, Tile, Values};

/// Children along the side of an internal node, as a power of two.
const UPPER_LOG2: u32 = 5;
const LOWER_LOG2: u32 = 4;
/// Voxels along the side of a child of the root (an upper node) and of its children (lower nodes).
const UPPER_SIDE: i32 = LOWER_SIDE << UPPER_LOG2;
const LOWER_SIDE: i32 = LEAF_SIDE << LOWER_LOG2;

/// Bytes of the mask of a leaf.
const LEAF_MASK: usize = LEAF_VOXELS / 8;
/// Bytes of a coordinate.
const COORD: usize = 12;

/// The content of a tree, as in [`Grid`](crate::volume::grid::Grid).
pub(super) struct Tree {
    pub(super) background: f64,
    pub(super) leaves: Vec<Leaf>,
    pub(super) values: Values,
    pub(super) tiles: Vec<Tile>,
}

/// How the leaves of a tree store their values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Leaves {
    /// As a block.
    Numbers,
    /// As one more mask.
    Bits,
    /// Not at all: a voxel is its mask.
    Mask,
}

/// An internal node.
struct Node<'a> {
    origin: IVec3,
    /// Children along its side, as a power of two.
    log2: u32,
    /// Voxels along the side of a child.
    child_side: i32,
    /// Bits of children, and of active tiles.
    children: &'a [u8],
    active: &'a [u8],
    tiles: Block<'a>,
}

impl<'a> Node<'a> {
    fn read(file: &mut Bytes<'a>, layout: &Layout, origin: IVec3, log2: u32, child_side: i32) -> Result<Node<'a>> {
        let count = 1_usize << (3 * log2);
        let children = file.take(count / 8)?;
        let active = file.take(count / 8)?;
        if children.iter().zip(active).any(|(child, active)| child & active != 0) {
            return Err(file.corrupt("a node has a child and a tile in one place"));
        }
        let stored = if layout.version < NODE_MASK_VERSION { count - ones(children) } else { count };
        let tiles = Block::read(file, layout, stored, active)?;
        Ok(Node { origin, log2, child_side, children, active, tiles })
    }

    fn place(&self, i: usize) -> IVec3 {
        let (i, last) = (i as i32, (1 << self.log2) - 1);
        self.origin + IVec3::new(i >> (2 * self.log2), i >> self.log2 & last, i & last) * self.child_side
    }

    /// Origins of the children, in file order.
    fn child_origins(&self) -> impl Iterator<Item = IVec3> {
        (0..8 * self.children.len()).filter(|&i| bit(self.children, i)).map(|i| self.place(i))
    }
}

/// Topology of a tree; `root_tile` gets origin, raw value and activity, `node` each internal node.
/// Gives the leaves in the order of their values.
fn topology<'a>(
    file: &mut Bytes<'a>,
    layout: &Layout,
    mut root_tile: impl FnMut(IVec3, &[u8], bool),
    mut node: impl FnMut(&Node<'a>) -> Result<()>,
) -> Result<Vec<Leaf>> {
    let tile_count = file.u32()?;
    let child_count = file.u32()?;
    let mut places = HashSet::new();
    let mut place = |file: &mut Bytes| {
        let origin = IVec3::new(file.i32()?, file.i32()?, file.i32()?);
        if origin & (UPPER_SIDE - 1) != IVec3::ZERO || !places.insert(origin) {
            return Err(file.corrupt(format!("the root has something at {origin} that cannot be there")));
        }
        Ok(origin)
    };
    for _ in 0..tile_count {
        let origin = place(file)?;
        let value = file.take(layout.value_size)?;
        root_tile(origin, value, file.u8()? != 0);
    }
    let mut leaves = Vec::new();
    for _ in 0..child_count {
        let origin = place(file)?;
        let upper = Node::read(file, layout, origin, UPPER_LOG2, LOWER_SIDE)?;
        node(&upper)?;
        for origin in upper.child_origins() {
            let lower = Node::read(file, layout, origin, LOWER_LOG2, LEAF_SIDE)?;
            node(&lower)?;
            for origin in lower.child_origins() {
                let mask = file.array::<LEAF_MASK>()?;
                let words = mask.as_chunks::<8>().0;
                leaves.push(Leaf { origin, active: std::array::from_fn(|i| u64::from_le_bytes(words[i])) });
            }
        }
    }
    // The library reads values in the order of the root's table, which is sorted, whatever the order of the topology.
    leaves.sort_by_key(|leaf| (leaf.origin & !(UPPER_SIDE - 1)).to_array());
    Ok(leaves)
}

/// The number of trees in one, which has been 1 in all file versions that are read.
fn buffers(file: &mut Bytes) -> Result<()> {
    match file.i32()? {
        1 => Ok(()),
        other => Err(file.corrupt(format!("the tree claims {other} buffers"))),
    }
}

/// What stands before the values of a leaf; gives the number of buffers that follow the first one.
fn leaf_head(file: &mut Bytes, layout: &Layout, leaf: &Leaf) -> Result<usize> {
    let mask = file.take(LEAF_MASK)?;
    if mask.as_chunks::<8>().0.iter().zip(leaf.active).any(|(bytes, word)| u64::from_le_bytes(*bytes) != word) {
        return Err(file.corrupt(format!("the leaf at {} has two different masks", leaf.origin)));
    }
    if layout.version >= NODE_MASK_VERSION {
        return Ok(0);
    }
    file.take(COORD)?;
    Ok(file.u8()?.saturating_sub(1).into())
}

/// The next tree, of values that are stored in the `encodings` for one alone and for many in a block. Its leaf values
/// must start at byte `values_at` where that is known.
pub(super) fn read(
    file: &mut Bytes,
    layout: &Layout,
    encodings: (Encoding, Encoding),
    values_at: Option<i64>,
) -> Result<Tree> {
    match encodings.0 {
        Encoding::Half | Encoding::Float => read_as(file, layout, encodings, values_at, Values::F32),
        Encoding::Double => read_as(file, layout, encodings, values_at, Values::F64),
    }
}

fn read_as<T: Real>(
    file: &mut Bytes,
    layout: &Layout,
    encodings: (Encoding, Encoding),
    values_at: Option<i64>,
    values: fn(Vec<T>) -> Values,
) -> Result<Tree> {
    let single = encodings.0;
    buffers(file)?;
    let background: T = number(file.take(layout.value_size)?, single);
    let background_f64: f64 = background.into();
    let kept =
        |value: f64, active: bool| active || (value != background_f64 && !(value.is_nan() && background_f64.is_nan()));
    let mut root_tiles = Vec::new();
    let mut tiles = Vec::new();
    let mut table = Vec::new();
    let root_tile = |origin, raw: &[u8], active| {
        let value = number::<T>(raw, single).into();
        if kept(value, active) {
            root_tiles.push(Tile { origin, side: UPPER_SIDE, value, active });
        }
    };
    let leaves = topology(file, layout, root_tile, |node| {
        let old = layout.version < NODE_MASK_VERSION;
        let childless: Vec<u8> = if old { node.children.iter().map(|byte| !byte).collect() } else { Vec::new() };
        table.clear();
        table.resize(8 * node.children.len(), T::default());
        let stored = if old { &childless } else { node.active };
        node.tiles.decode(encodings, background, stored, &mut table)?;
        for (i, &value) in table.iter().enumerate() {
            let (value, active) = (value.into(), bit(node.active, i));
            if !bit(node.children, i) && kept(value, active) {
                tiles.push(Tile { origin: node.place(i), side: node.child_side, value, active });
            }
        }
        Ok(())
    })?;
    tiles.append(&mut root_tiles);

    if let Some(at) = values_at.filter(|&at| usize::try_from(at) != Ok(file.position())) {
        return Err(file.corrupt(format!("the values of the leaves start here, but the file says at byte {at}")));
    }
    if leaves.len() > file.remaining() / LEAF_MASK {
        return Err(file.corrupt(format!("there are no values for {} leaves", leaves.len())));
    }
    let blocks = leaves
        .iter()
        .map(|leaf| {
            let more = leaf_head(file, layout, leaf)?;
            let block = Block::read(file, layout, LEAF_VOXELS, &mask_bytes(leaf))?;
            (0..more).try_for_each(|_| Block::skip_data(file, layout, LEAF_VOXELS))?;
            Ok(block)
        })
        .collect::<Result<Vec<Block>>>()?;
    let mut numbers: Vec<T> = Vec::new();
    let count = leaves.len() * LEAF_VOXELS;
    numbers.try_reserve_exact(count).map_err(|_| {
        Error::new(Code::TooLarge, "There is not enough memory for the grid.")
            .why(format!("Its values take {} MiB.", (count * size_of::<T>()) >> 20))
            .hint("Close other programs, or export the grid with larger voxels.")
    })?;
    numbers.resize(count, T::default());
    let failed = (numbers.par_chunks_mut(LEAF_VOXELS).zip(&blocks).zip(&leaves))
        .find_map_first(|((out, block), leaf)| block.decode(encodings, background, &mask_bytes(leaf), out).err());
    match failed {
        Some(error) => Err(error),
        None => Ok(Tree { background: background_f64, leaves, values: values(numbers), tiles }),
    }
}

fn mask_bytes(leaf: &Leaf) -> [u8; LEAF_MASK] {
    std::array::from_fn(|i| (leaf.active[i / 8] >> (8 * (i % 8))) as u8)
}

/// Goes beyond the next tree, which is not drawn, to the grid after it.
pub(super) fn skip(file: &mut Bytes, layout: &Layout, kind: Leaves) -> Result<()> {
    buffers(file)?;
    file.take(layout.value_size)?;
    for leaf in topology(file, layout, |_, _, _| (), |_| Ok(()))? {
        match kind {
            Leaves::Mask => drop(file.take(LEAF_MASK + COORD)?),
            Leaves::Bits => drop(file.take(LEAF_MASK + COORD + LEAF_MASK)?),
            Leaves::Numbers => {
                let more = leaf_head(file, layout, &leaf)?;
                Block::read(file, layout, LEAF_VOXELS, &mask_bytes(&leaf))?;
                (0..more).try_for_each(|_| Block::skip_data(file, layout, LEAF_VOXELS))?;
            }
        }
    }
    Ok(())
}
