//! OpenVDB files (`.vdb`), file versions 220 to 225: float, double and half grids of the usual tree.
//!
//! The format is that of the OpenVDB library (`io/Archive.cc`, `io/Compression.h`, `tree/*.h`): a head, then for each
//! grid a descriptor, metadata, a transform, the topology of its tree and the values of its leaves.
//!
//! Memory is bounded by the file: a leaf takes at least 128 bytes there and at most 4 KiB plus 80 bytes here, a tile
//! at least a quarter of a byte there and 32 bytes here, and copies of shared trees count against
//! the same bound.

use std::collections::HashMap;

use glam::{DMat4, DVec4};

use self::block::{Encoding, Layout};
use self::head::{Content, Descriptor, Header, Map, Metadata, lossy, quoted};
use crate::error::{Code, Error, Result, Warning};
use crate::io::bytes::Bytes;
use crate::volume::grid::{Class, Entry, Grid, Values, VolumeFile};

mod block;
mod head;
#[cfg(test)]
mod tests;
mod tree;
#[cfg(test)]
mod writer;

/// Most bytes of trees in memory for each byte of a file. What single trees reach at most (tiles, all of them active,
/// in packed nodes); trees that several grids share are stored once, but held once for each.
const MAX_EXPANSION: usize = 128;

/// The library's name for the class of a grid that says none, or an unknown one.
const UNKNOWN_CLASS: &str = "unknown";

/// Reads all grids of an OpenVDB file: sorted by name as the library lists them, or as they stand in one without offsets.
///
/// # Errors
/// [`Code::UnknownFormat`], [`Code::Version`], and [`Code::Corrupt`] where the file as a whole is damaged or cut short.
/// What concerns one grid only is the error of that [`Entry`]: [`Code::Corrupt`], or [`Code::Unsupported`] for
/// types, trees and transforms that are not drawn.
pub fn read(bytes: &[u8]) -> Result<VolumeFile> {
    let mut file = Bytes::new(bytes);
    let header = Header::read(&mut file)?;
    Metadata::read(&mut file)?;
    let count = file.i32()?;
    if usize::try_from(count).map_or(true, |count| count > file.remaining() / Descriptor::LEAST) {
        return Err(file.corrupt(format!("the file claims {count} grids")));
    }
    let mut warnings = Vec::new();
    let mut found = Vec::new();
    for i in 0..count {
        let descriptor = Descriptor::read(&mut file)?;
        let (body, lost) = if header.offsets {
            (read_extent(bytes, &mut file, &header, &descriptor)?, false)
        } else {
            read_next(&mut file, &header, &descriptor)?
        };
        found.push((descriptor, body));
        if lost && i + 1 < count {
            warnings.push(Warning {
                code: "unreachable",
                text: format!(
                    "{} more grids cannot be found: the file has no offsets, and the length of grid {} is unknown.",
                    count - 1 - i,
                    i + 1
                ),
            });
            break;
        }
    }
    if count == 0 {
        warnings.push(Warning { code: "empty_grid", text: "The file has no grids.".into() });
    }
    if header.offsets {
        // The order in which the library lists grids, whatever their order on disk; a stream it reads as it comes. Equal
        // names go by number, so that whoever numbers them again gives each its own: the library has 10 before 2.
        found.sort_by(|(a, _), (b, _)| a.order().cmp(&b.order()));
    }
    let grids = entries(found, MAX_EXPANSION.saturating_mul(bytes.len()));
    Ok(VolumeFile { format: "vdb", version: header.version.to_string(), grids, warnings })
}

/// A grid's own part of the file.
struct Body {
    class: Option<String>,
    world_from_index: Option<DMat4>,
    content: Result<Tree>,
}

/// The tree of a grid.
enum Tree {
    Own(tree::Tree),
    /// That of another grid.
    Shared,
}

impl Body {
    fn failed(error: Error) -> Body {
        Body { class: None, world_from_index: None, content: Err(error) }
    }
}

/// Reads a grid from its own extent of the file, and goes to the end of that. Extents follow one another, so that no
/// byte is read for two grids.
fn read_extent(bytes: &[u8], file: &mut Bytes, header: &Header, descriptor: &Descriptor) -> Result<Body> {
    let [start, _, end] = descriptor.positions;
    let here = file.position();
    let (Ok(start), Ok(end)) = (usize::try_from(start), usize::try_from(end)) else {
        return Err(file.corrupt(format!("the grid {} claims to lie before the file", quoted(&descriptor.unique_name))));
    };
    if start < here || end < start {
        return Err(file.corrupt(format!(
            "the grid {} claims bytes {start} to {end}, before this place or in the wrong order",
            quoted(&descriptor.unique_name)
        )));
    }
    let Some(extent) = bytes.get(..end) else {
        let (name, size) = (quoted(&descriptor.unique_name), bytes.len());
        return Err(file.corrupt(format!("the grid {name} ends at byte {end}, but the file has only {size}")));
    };
    file.seek(end as u64)?;
    let mut body = Bytes::new(extent);
    body.seek(start as u64)?;
    Ok(match read_body(&mut body, header, descriptor) {
        Ok((found, true)) if found.content.is_ok() && body.remaining() > 0 => {
            let error = body.corrupt(format!("{} bytes are left after the grid", body.remaining()));
            Body { content: Err(named(error, &descriptor.unique_name)), ..found }
        }
        Ok((found, _)) => Body { content: found.content.map_err(|e| named(e, &descriptor.unique_name)), ..found },
        Err(error) => Body::failed(named(error, &descriptor.unique_name)),
    })
}

/// Reads the grid that follows in a file without offsets. Any damage hides all that comes after, so it is an error of
/// the file; what is merely not drawn is passed over. Also says whether its end could not be found.
fn read_next(file: &mut Bytes, header: &Header, descriptor: &Descriptor) -> Result<(Body, bool)> {
    let (body, ended) = read_body(file, header, descriptor).map_err(|e| named(e, &descriptor.unique_name))?;
    match body.content {
        Err(error) if error.code != Code::Unsupported => Err(named(error, &descriptor.unique_name)),
        _ => Ok((body, !ended)),
    }
}

/// Reads what follows a descriptor, and says whether the grid was read to its end.
fn read_body(file: &mut Bytes, header: &Header, descriptor: &Descriptor) -> Result<(Body, bool)> {
    let (packing, masked) = header.compression(file)?;
    let metadata = Metadata::read(file)?;
    let map = Map::read(file, header.version)?;
    let name = &descriptor.unique_name;
    let (world_from_index, refused) = match &map {
        Map::Linear(matrix) => (Some(*matrix), refused_matrix(matrix)),
        Map::Frustum => (None, Some("is a perspective frustum".to_owned())),
        Map::Unknown(word) => (None, Some(format!("has the unknown type {}", quoted(word)))),
    };
    let refused = refused.map(|why| {
        Error::new(Code::Unsupported, format!("The grid {} has a transform that is not drawn.", quoted(name)))
            .why(format!("It {why}; linear maps are drawn."))
            .hint("Resample the grid to one with a linear transform.")
    });
    let body = |content| Body { class: metadata.class.clone(), world_from_index, content };
    if let (Map::Unknown(_), Some(refused)) = (&map, &refused) {
        return Ok((body(Err(refused.clone())), false));
    }
    let layout = |value_size, packed_size, as_half| Layout {
        version: header.version,
        packing,
        masked,
        value_size,
        packed_size,
        as_half,
    };
    let shared = !descriptor.parent.is_empty();
    let (tree, ended) = match descriptor.content() {
        Content::Scalar(_) if shared => (Ok(Tree::Shared), true),
        Content::Scalar(single) => {
            let many = if metadata.as_half { Encoding::Half } else { single };
            let layout = layout(single.size(), many.size(), metadata.as_half);
            let values_at = header.offsets.then_some(descriptor.positions[1]);
            (tree::read(file, &layout, (single, many), values_at).map(Tree::Own), true)
        }
        Content::Other { value_size, half_size, leaves } if !shared && !header.offsets => {
            let as_half = metadata.as_half && half_size != value_size;
            let packed_size = if as_half { half_size } else { value_size };
            tree::skip(file, &layout(value_size, packed_size, as_half), leaves)?;
            (Err(not_drawn(descriptor)), true)
        }
        Content::Other { .. } | Content::Opaque => (Err(not_drawn(descriptor)), shared),
    };
    let tree = match refused {
        Some(refused) => tree.and(Err(refused)),
        None => tree,
    };
    Ok((body(tree), ended))
}

/// Why a linear map cannot be drawn, if it cannot.
fn refused_matrix(matrix: &DMat4) -> Option<String> {
    if matrix.row(3) != DVec4::W {
        return Some("has a perspective part".into());
    }
    let determinant = matrix.determinant();
    (determinant == 0.0 || !determinant.is_finite()).then(|| format!("has the determinant {determinant}"))
}

/// Makes the entries, with the shared trees in place; copies of trees may take `budget` bytes.
fn entries(found: Vec<(Descriptor, Body)>, mut budget: usize) -> Vec<Entry> {
    let mut owners = HashMap::new();
    let mut shares = Vec::new();
    let mut entries: Vec<Entry> = Vec::new();
    for (i, (descriptor, body)) in found.into_iter().enumerate() {
        let (class, class_name) = class(body.class);
        let grid = body.content.map(|tree| {
            let world_from_index = body.world_from_index.expect("only grids with a linear map have a tree");
            let tree = match tree {
                Tree::Own(tree) => tree,
                Tree::Shared => {
                    shares.push((i, descriptor.parent));
                    tree::Tree {
                        background: 0.0,
                        leaves: Vec::new(),
                        values: Values::F32(Vec::new()),
                        tiles: Vec::new(),
                    }
                }
            };
            let tree::Tree { background, leaves, values, tiles } = tree;
            Grid { class, world_from_index, background, leaves, values, tiles }
        });
        if descriptor.parent.is_empty() {
            owners.entry(descriptor.raw_name).or_insert(i);
        }
        entries.push(Entry {
            value_type: descriptor.value_type().to_owned(),
            name: descriptor.name,
            unique_name: descriptor.unique_name,
            class_name,
            world_from_index: body.world_from_index,
            grid,
        });
    }
    for (i, parent) in shares {
        let tree = share(&entries[i], parent, owners.get(parent).map(|&owner| &entries[owner]), &mut budget);
        entries[i].grid = tree;
    }
    entries
}

/// The grid of `entry` with a copy of the tree of `owner`, whose raw name is `parent`.
fn share(entry: &Entry, parent: &[u8], owner: Option<&Entry>, budget: &mut usize) -> Result<Grid> {
    let grid = entry.grid.as_ref().map_err(Error::clone)?;
    let name = quoted(&entry.unique_name);
    let Some(owner) = owner else {
        return Err(Error::new(Code::Corrupt, format!("The grid {name} cannot be read."))
            .why(format!("It shares the tree of {}, and no grid in the file has that.", quoted(&lossy(parent))))
            .hint("Copy or export the file again."));
    };
    let tree = owner.grid.as_ref().map_err(|error| {
        Error::new(error.code, format!("The grid {name} cannot be read."))
            .why(format!("It shares the tree of {}, which cannot be read.", quoted(&owner.unique_name)))
            .hint(error.hint.clone())
    })?;
    let bytes = tree.bytes();
    *budget = budget.checked_sub(bytes).ok_or_else(|| {
        Error::new(Code::TooLarge, format!("The grid {name} is not read."))
            .why(format!("Its copy of a shared tree would take {bytes} bytes, too much for a file of this size."))
            .hint("Choose the grid that has the tree of its own.")
    })?;
    Ok(Grid { class: grid.class.clone(), world_from_index: grid.world_from_index, ..tree.clone() })
}

/// The class for a word of the metadata, and the library's name for it.
fn class(word: Option<String>) -> (Class, String) {
    let word = word.unwrap_or_else(|| UNKNOWN_CLASS.into());
    match &*word.trim().to_lowercase() {
        name @ "fog volume" => (Class::Fog, name.into()),
        name @ "level set" => (Class::LevelSet, name.into()),
        name @ "staggered" => (Class::Other(word.clone()), name.into()),
        _ => (Class::Other(word), UNKNOWN_CLASS.into()),
    }
}

/// The error for a grid of a type that holds no density.
fn not_drawn(descriptor: &Descriptor) -> Error {
    let error = Error::new(
        Code::Unsupported,
        format!("The grid {} has the type {}.", quoted(&descriptor.unique_name), quoted(&descriptor.tree_type)),
    );
    error
        .why("Grids of float, double or half values in the usual 5-4-3 tree are drawn.")
        .hint("Choose or export a grid of one of these types.")
}

/// The error of one grid.
fn named(error: Error, name: &str) -> Error {
    match error.code {
        Code::Corrupt => Error { what: format!("The grid {} is damaged or cut short.", quoted(name)), ..error },
        _ => error,
    }
}
