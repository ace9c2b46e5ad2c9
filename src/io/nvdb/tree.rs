//! The tree of a grid: root table, upper nodes of 32³, lower nodes of 16³, leaves of 8³ voxels.
//!
//! First the nodes are found and their places checked, then the leaves are decoded.

use std::collections::HashSet;

use glam::IVec3;

use super::header::{self, GridHeader};
use crate::error::{Code, Error, Result};
use crate::io::bytes::Bytes;
use crate::volume::grid::{Class, Grid, LEAF_SIDE, LEAF_VOXELS, Leaf, Tile, Values};

/// Bytes of the tree's header, which follows the grid's.
pub(super) const HEADER: usize = 64;
/// Fewest bytes of a grid: two headers.
pub(super) const ROOT_MIN: usize = header::SIZE + HEADER;
/// Nodes begin at multiples of this.
const ALIGN: usize = 32;
/// Bytes of a row of the root table, whatever the value type here.
const ROOT_ROW: usize = 32;
/// Bits of an upper and a lower node's side, in children.
const UPPER: Level = Level { log2: 5, child_side: 128 };
const LOWER: Level = Level { log2: 4, child_side: LEAF_SIDE };
/// Bits of each coordinate in a root key, each above the side of an upper node.
const KEY_BITS: u32 = 21;
const UPPER_SIDE_LOG2: u32 = 12;
/// Bytes before the masks of an upper or lower node: box and flags.
const NODE_HEAD: usize = 32;
/// Bytes before a leaf's mask: lowest corner, extent, flags.
const LEAF_HEAD: usize = 16;
/// Bytes of a leaf before its codes, if it is quantised.
const QUANTISED_HEAD: usize = 96;

/// A level of nodes between root and leaves.
#[derive(Clone, Copy)]
struct Level {
    /// Children along a side: 2 to this power.
    log2: u32,
    /// Voxels along a child's side.
    child_side: i32,
}

impl Level {
    fn children(self) -> usize {
        1 << (3 * self.log2)
    }

    /// Bytes before the table: head, two masks and the statistics (within one or, for double, exactly one alignment).
    fn table(self) -> usize {
        NODE_HEAD + 2 * self.children() / 8 + ALIGN
    }

    fn size(self) -> usize {
        self.table() + 8 * self.children()
    }

    /// Where child `n` lies in the node: x slowest, z fastest.
    fn offset(self, n: usize) -> IVec3 {
        let mask = (1 << self.log2) - 1;
        let n = n as i32;
        IVec3::new(n >> (2 * self.log2), n >> self.log2 & mask, n & mask) * self.child_side
    }
}

/// How a grid stores its values.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Float,
    Double,
    /// Codes of 2 to this power bits, scaled and shifted per leaf.
    Quantised(u32),
    /// The same with a width per leaf.
    Variable,
}

impl Kind {
    fn of(header: &GridHeader) -> Result<Kind> {
        Ok(match header.value_type {
            1 => Kind::Float,
            2 => Kind::Double,
            13 => Kind::Quantised(2),
            14 => Kind::Quantised(3),
            15 => Kind::Quantised(4),
            16 => Kind::Variable,
            _ => {
                let why = "Only scalar grids can: float, double, Float4, Float8, Float16 and FloatN.";
                return Err(header.unsupported(why).hint("Choose another grid, or export a float density."));
            }
        })
    }

    /// Bytes of a leaf before its values or codes.
    fn leaf_head(self) -> usize {
        match self {
            Kind::Float | Kind::Quantised(_) | Kind::Variable => QUANTISED_HEAD,
            Kind::Double => 128,
        }
    }

    /// Bytes of a leaf whose flags are given; `None` for flags that make no sense.
    fn leaf_size(self, flags: u8) -> Option<usize> {
        let codes = |log2: u32| (LEAF_VOXELS << log2) / 8;
        Some(match self {
            Kind::Float => self.leaf_head() + 4 * LEAF_VOXELS,
            Kind::Double => self.leaf_head() + 8 * LEAF_VOXELS,
            Kind::Quantised(log2) => self.leaf_head() + codes(log2),
            Kind::Variable => self.leaf_head() + codes(variable_width(flags)?),
        })
    }

    /// A value of the root or of a node's table.
    fn value(self, data: &mut Bytes) -> Result<f64> {
        match self {
            Kind::Double => data.f64(),
            _ => data.f32().map(f64::from),
        }
    }
}

/// Logarithm of the bits of a code in a FloatN leaf: 1, 2, 4, 8 or 16 bits.
fn variable_width(flags: u8) -> Option<u32> {
    Some(u32::from(flags >> 5)).filter(|&log2| log2 <= 4)
}

/// Byte of the first upper node in the grid, if it says that there is one.
pub(super) fn first_upper(grid: &[u8]) -> Option<usize> {
    let mut data = Bytes::new(grid.get(header::SIZE..)?);
    data.take(2 * 8).ok()?;
    let offset = usize::try_from(data.u64().ok()?).ok().filter(|&offset| offset > 0)?;
    header::SIZE.checked_add(offset)
}

/// Decodes the grid with this header from its bytes.
///
/// # Errors
/// [`Code::Unsupported`] for a type without scalar values or a transform without inverse, [`Code::Corrupt`].
pub(super) fn read(header: &GridHeader, grid: &[u8]) -> Result<Grid> {
    let kind = Kind::of(header)?;
    let determinant = header.world_from_index.determinant();
    if !header.world_from_index.is_finite() || !determinant.is_finite() || determinant == 0.0 {
        let why = "Its transform has no inverse: it flattens the volume or is not a number.";
        return Err(header.unsupported(why).hint("Export it with another transform."));
    }
    if header.grid_size > grid.len() as u64 {
        let have = grid.len();
        return Err(corrupt(format!("It claims {} bytes and has {have}.", header.grid_size)));
    }
    let nodes = Nodes::find(kind, grid)?;
    let leaves = nodes.leaves.iter().map(|&(at, origin)| leaf(grid, at, origin)).collect::<Result<_>>()?;
    let values = match kind {
        Kind::Double => {
            let mut values = values_for::<f64>(nodes.leaves.len())?;
            for &(at, _) in &nodes.leaves {
                let stored = bytes_at(grid, at + kind.leaf_head(), 8 * LEAF_VOXELS)?;
                values.extend(stored.as_chunks().0.iter().map(|&bytes| f64::from_le_bytes(bytes)));
            }
            Values::F64(values)
        }
        _ => {
            let mut values = values_for::<f32>(nodes.leaves.len())?;
            for &(at, _) in &nodes.leaves {
                leaf_values(kind, grid, at, &mut values)?;
            }
            Values::F32(values)
        }
    };
    Ok(Grid {
        class: match header.class {
            1 => Class::LevelSet,
            2 => Class::Fog,
            other => Class::Other(header::class_name(other)),
        },
        world_from_index: header.world_from_index,
        background: nodes.background,
        leaves,
        values,
        tiles: nodes.tiles,
    })
}

/// The places of the leaves, and all that stands above them.
struct Nodes<'a> {
    kind: Kind,
    grid: &'a [u8],
    background: f64,
    /// Byte in the grid and origin of each leaf.
    leaves: Vec<(usize, IVec3)>,
    /// Numbers of lower and of upper nodes.
    lower: usize,
    upper: usize,
    tiles: Vec<Tile>,
    /// First byte and size of every node, and the sum of these sizes.
    spans: Vec<(usize, usize)>,
    claimed: usize,
}

impl<'a> Nodes<'a> {
    /// Walks root, upper and lower nodes.
    fn find(kind: Kind, grid: &'a [u8]) -> Result<Nodes<'a>> {
        let (leaves, tiles, spans) = (Vec::new(), Vec::new(), Vec::new());
        let mut nodes = Nodes { kind, grid, background: 0.0, leaves, lower: 0, upper: 0, tiles, spans, claimed: 0 };
        let mut tree = Bytes::new(grid);
        tree.seek(header::SIZE as u64)?;
        let first = [tree.i64()?, tree.i64()?, tree.i64()?]; // leaf, lower, upper node
        let offset = tree.i64()?;
        let counts = [tree.u32()?, tree.u32()?, tree.u32()?];
        if offset == 0 {
            return Ok(nodes); // no root: nothing at all
        }
        let root = nodes.place(header::SIZE, offset, "The root")?;
        let mut data = Bytes::new(grid);
        data.seek(root as u64)?;
        data.take(6 * 4)?; // box of the active voxels
        let rows = data.u32()? as usize;
        let head = match kind {
            Kind::Double => {
                data.take(4)?; // padding
                96
            }
            _ => 64,
        };
        nodes.background = kind.value(&mut data)?;
        nodes.claim(root, rows.saturating_mul(ROOT_ROW).saturating_add(head))?;
        let mut origins = HashSet::with_capacity(rows);
        for row in 0..rows {
            data.seek((root + head + row * ROOT_ROW) as u64)?;
            let (key, child, active) = (data.u64()?, data.i64()?, data.u32()? != 0);
            let field = |shift: u32| (key >> shift) as u32 & ((1 << KEY_BITS) - 1);
            let along = |shift: u32| (field(shift) << UPPER_SIDE_LOG2) as i32;
            let origin = IVec3::new(along(2 * KEY_BITS), along(KEY_BITS), along(0));
            if !origins.insert(origin) {
                return Err(corrupt(format!("Two rows of the root table are at {origin}.")));
            }
            if child != 0 {
                let at = nodes.place(root, child, "An upper node")?;
                nodes.node(UPPER, at, origin)?;
                nodes.upper += 1;
            } else {
                if kind == Kind::Double {
                    data.take(4)?; // padding
                }
                let value = kind.value(&mut data)?;
                nodes.tile(origin, 1 << UPPER_SIDE_LOG2, value, active);
            }
        }
        nodes.check(first, counts)?;
        Ok(nodes)
    }

    /// Reads an upper or lower node and all below it.
    fn node(&mut self, level: Level, at: usize, origin: IVec3) -> Result<()> {
        self.claim(at, level.size())?;
        let grid = self.grid;
        let mask_bytes = level.children() / 8;
        let active = bytes_at(grid, at + NODE_HEAD, mask_bytes)?;
        let child = bytes_at(grid, at + NODE_HEAD + mask_bytes, mask_bytes)?;
        let table = bytes_at(grid, at + level.table(), 8 * level.children())?;
        for (n, entry) in table.as_chunks::<8>().0.iter().enumerate() {
            let bit = |mask: &[u8]| mask[n / 8] >> (n % 8) & 1 != 0;
            let origin = origin.wrapping_add(level.offset(n));
            if bit(child) {
                let offset = i64::from_le_bytes(*entry);
                if level.child_side == LEAF_SIDE {
                    let at = self.place(at, offset, "A leaf")?;
                    let flags = *bytes_at(grid, at + LEAF_HEAD - 1, 1)?.first().expect("one byte was asked for");
                    let size = self
                        .kind
                        .leaf_size(flags)
                        .ok_or_else(|| corrupt(format!("The leaf at byte {at} has codes of 2^{} bits.", flags >> 5)))?;
                    self.claim(at, size)?;
                    self.leaves.push((at, origin));
                } else {
                    let at = self.place(at, offset, "A lower node")?;
                    self.node(LOWER, at, origin)?;
                    self.lower += 1;
                }
            } else {
                let value = self.kind.value(&mut Bytes::new(entry))?;
                self.tile(origin, level.child_side, value, bit(active));
            }
        }
        Ok(())
    }

    /// Keeps a tile that differs from empty space.
    fn tile(&mut self, origin: IVec3, side: i32, value: f64, active: bool) {
        let plain = value == self.background || value.is_nan() && self.background.is_nan();
        if active || !plain {
            self.tiles.push(Tile { origin, side, value, active });
        }
    }

    /// The byte at `offset` from the node at `from`, where a node may begin.
    fn place(&self, from: usize, offset: i64, what: &str) -> Result<usize> {
        let at = i64::try_from(from).ok().and_then(|from| from.checked_add(offset));
        let at = at.and_then(|at| usize::try_from(at).ok()).filter(|&at| at >= ROOT_MIN && at < self.grid.len());
        match at {
            Some(at) if at.is_multiple_of(ALIGN) => Ok(at),
            Some(at) => Err(corrupt(format!("{what} is said to begin at byte {at}, no multiple of {ALIGN}."))),
            None => Err(corrupt(format!(
                "{what} is said to lie {offset} bytes from byte {from}; the grid has {} bytes.",
                self.grid.len()
            ))),
        }
    }

    /// Notes that a node takes `size` bytes from `at` on. As no two may share a byte, more bytes than the grid has are an
    /// error at once: what is kept for the nodes stays within bounds, though overlaps show only at the end.
    fn claim(&mut self, at: usize, size: usize) -> Result<()> {
        bytes_at(self.grid, at, size)?;
        self.spans.push((at, size));
        self.claimed += size; // at most twice the grid
        if self.claimed > self.grid.len() {
            return Err(corrupt("Its nodes take more bytes than it has: some are used twice."));
        }
        Ok(())
    }

    /// Refuses nodes that share bytes, and a tree header that names another first node or number of nodes on a level
    /// (leaf, lower, upper) than were found.
    fn check(&mut self, first: [i64; 3], counts: [u32; 3]) -> Result<()> {
        self.spans.sort_unstable();
        for pair in self.spans.windows(2) {
            let [(a, size), (b, _)] = pair else { unreachable!("windows of two") };
            if a + size > *b {
                return Err(corrupt(format!("The nodes at bytes {a} and {b} overlap.")));
            }
        }
        let found = [self.leaves.len(), self.lower, self.upper];
        for ((first, count), found) in first.into_iter().zip(counts).zip(found) {
            if count as usize != found {
                return Err(corrupt(format!("The tree claims {count} nodes on a level and has {found}.")));
            }
            let at = self.place(header::SIZE, first, "The first node");
            if count > 0 && self.spans.binary_search_by_key(&at?, |&(at, _)| at).is_err() {
                return Err(corrupt(format!("No node of the tree is {first} bytes from its head.")));
            }
        }
        Ok(())
    }
}

/// The leaf at byte `at`.
fn leaf(grid: &[u8], at: usize, origin: IVec3) -> Result<Leaf> {
    let mask = bytes_at(grid, at + LEAF_HEAD, LEAF_VOXELS / 8)?;
    let mut active = [0; LEAF_VOXELS / 64];
    for (word, bytes) in active.iter_mut().zip(mask.as_chunks().0) {
        *word = u64::from_le_bytes(*bytes);
    }
    Ok(Leaf { origin, active })
}

/// Appends the 512 values of the leaf at byte `at`, which is not of doubles.
fn leaf_values(kind: Kind, grid: &[u8], at: usize, values: &mut Vec<f32>) -> Result<()> {
    let head = at + kind.leaf_head();
    let width = match kind {
        Kind::Quantised(log2) => log2,
        Kind::Variable => {
            let flags = bytes_at(grid, at + LEAF_HEAD - 1, 1)?[0];
            variable_width(flags).expect("checked when the leaf was found")
        }
        Kind::Float | Kind::Double => {
            let stored = bytes_at(grid, head, 4 * LEAF_VOXELS)?;
            values.extend(stored.as_chunks().0.iter().map(|&bytes| f32::from_le_bytes(bytes)));
            return Ok(());
        }
    };
    let mut scale = Bytes::new(bytes_at(grid, at + LEAF_HEAD + LEAF_VOXELS / 8, 8)?);
    let (least, quantum) = (scale.f32()?, scale.f32()?);
    // As the library computes it: two roundings, no fused multiply-add.
    let value = |code: u16| f32::from(code) * quantum + least;
    let codes = bytes_at(grid, head, (LEAF_VOXELS << width) / 8)?;
    if width == 4 {
        values.extend(codes.as_chunks().0.iter().map(|&bytes| value(u16::from_le_bytes(bytes))));
    } else {
        // The first code of a byte is in its lowest bits.
        let (bits, per_byte) = (1 << width, 8 >> width);
        let mask = ((1u16 << bits) - 1) as u8;
        let codes = codes.iter().flat_map(|&byte| (0..per_byte).map(move |i| byte >> (i * bits) & mask));
        values.extend(codes.map(|code| value(u16::from(code))));
    }
    Ok(())
}

/// An error about the tree; bytes in it count from the start of the grid.
fn corrupt(why: impl Into<String>) -> Error {
    Error::new(Code::Corrupt, "A grid is damaged or cut short.").why(why).hint("Copy or export the file again.")
}

/// `size` bytes from `at` on.
fn bytes_at(grid: &[u8], at: usize, size: usize) -> Result<&[u8]> {
    let mut data = Bytes::new(grid);
    data.seek(at as u64)?;
    data.take(size)
}

/// Room for the values of so many leaves.
fn values_for<T>(leaves: usize) -> Result<Vec<T>> {
    let mut values = Vec::new();
    values.try_reserve_exact(leaves * LEAF_VOXELS).map_err(|_| {
        Error::new(Code::TooLarge, "The grid does not fit into memory.")
            .why(format!("It has {leaves} leaves of {LEAF_VOXELS} values."))
            .hint("Close other programs or use a smaller file.")
    })?;
    Ok(values)
}
