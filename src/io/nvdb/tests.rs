//! Grids from a small writer of the public layout, whole and damaged.

use std::collections::BTreeSet;

use glam::{DMat4, DVec3, IVec3};

use super::*;
use crate::volume::grid::{Class, Grid, LEAF_VOXELS, Leaf, Tile, Values};
pub(crate) use writer::sample;
use writer::{DOUBLE, FLOAT, Model, ROOT, V32_4, V32_9, segment, sum_up};

mod writer;

fn only(bytes: &[u8]) -> Grid {
    let mut file = read(bytes).unwrap();
    assert_eq!(file.grids.len(), 1);
    file.grids.remove(0).grid.unwrap()
}

fn refused(bytes: &[u8]) -> Error {
    read(bytes).and_then(|mut file| file.grids.remove(0).grid).unwrap_err()
}

#[test]
fn scalar_and_quantised_grids_come_back_voxel_for_voxel() {
    for (value_type, width, name) in [
        (FLOAT, 0, "float"),
        (DOUBLE, 0, "double"),
        (13, 0, "Float4"),
        (14, 0, "Float8"),
        (15, 0, "Float16"),
        (16, 0, "FloatN"),
        (16, 1, "FloatN"),
        (16, 2, "FloatN"),
        (16, 3, "FloatN"),
        (16, 4, "FloatN"),
    ] {
        let model = Model { width, ..Model::of(value_type) };
        let mut file = read(&model.bytes()).unwrap();
        let entry = file.grids.remove(0);
        assert_eq!((&*entry.name, &*entry.value_type, &*entry.class_name), ("smoke", name, "fog volume"));
        assert_eq!((file.format, &*file.version, file.warnings), ("nvdb", "32.9", vec![]));
        assert_eq!(entry.world_from_index, Some(model.matrix));
        let grid = entry.grid.unwrap();
        assert_eq!((grid.class, grid.world_from_index, grid.background), (Class::Fog, model.matrix, 0.5));
        assert_eq!(matches!(grid.values, Values::F64(_)), value_type == DOUBLE);
        assert_eq!(grid.leaves.len(), 2);
        for (i, Leaf { origin, active }) in grid.leaves.iter().enumerate() {
            let (_, values, mask) = model.leaves.iter().find(|leaf| leaf.0 == *origin).unwrap();
            assert_eq!(active, mask);
            for n in 0..LEAF_VOXELS {
                assert_eq!(grid.values.get(i * LEAF_VOXELS + n), model.decoded(values, n), "{name} {width} {n}");
            }
        }
        let show = |tile: &Tile| (tile.side, tile.origin.to_array(), tile.value.to_bits(), tile.active);
        let tiles = |tiles: &[Tile]| tiles.iter().map(show).collect::<BTreeSet<_>>();
        assert_eq!((tiles(&grid.tiles), grid.tiles.len()), (tiles(&model.tiles), 3));
    }
}

#[test]
fn active_tiles_of_background_value_stay_and_inactive_ones_go() {
    let mut model = Model::of(FLOAT);
    model.background = f64::NAN;
    let tile = |x, active| Tile { origin: IVec3::new(x, 0, 0), side: 4096, value: f64::NAN, active };
    model.tiles = vec![tile(8192, true), tile(-8192, false)];
    let grid = only(&model.bytes());
    assert_eq!(grid.tiles.len(), 1);
    assert_eq!((grid.tiles[0].origin.x, grid.tiles[0].active), (8192, true));
}

#[test]
fn files_hold_several_segments_of_several_grids_and_codecs() {
    let one = Model { name: "one", ..Model::of(FLOAT) }.bytes();
    let two = Model { name: "two", class: 1, ..Model::of(16) }.bytes();
    let old = Model { name: "old", class: 0, magic: MAGIC_OLD, version: V32_4, ..Model::of(14) }.bytes();
    let file = [
        segment(&[old, one.clone()], 1, MAGIC_OLD, V32_4),
        segment(std::slice::from_ref(&two), 0, MAGIC_FILE, V32_9),
        segment(&[one.clone(), two.clone()], 2, MAGIC_FILE, V32_9),
    ]
    .concat();
    let names = |bytes: &[u8]| {
        let file = read(bytes).unwrap();
        assert_eq!(file.warnings, []);
        (file.version, file.grids.iter().map(|e| format!("{} {}", e.name, e.class_name)).collect::<Vec<_>>().join(", "))
    };
    let all = "old unknown, one fog volume, two level set, one fog volume, two level set";
    assert_eq!(names(&file), ("32.4".to_owned(), all.to_owned()));
    assert_eq!(names(&[one, two].concat()), ("32.9".to_owned(), "one fog volume, two level set".to_owned()), "raw");
    let raw = Model { magic: MAGIC_OLD, version: V32_4, ..Model::of(FLOAT) }.bytes();
    assert_eq!(names(&raw).1, "smoke fog volume", "raw under the shared magic number");
}

#[test]
fn other_types_are_refused_by_name_and_leave_the_rest() {
    let good = Model::of(FLOAT).bytes();
    for (value_type, name) in
        [(6, "Vec3f"), (8, "Mask"), (19, "Index"), (20, "OnIndex"), (23, "PointIndex"), (77, "type 77")]
    {
        let mut other = Model { name: "other", ..Model::of(FLOAT) }.bytes();
        other[636..640].copy_from_slice(&u32::to_le_bytes(value_type));
        let file = read(&segment(&[other, good.clone()], 0, MAGIC_FILE, V32_9)).unwrap();
        let error = file.grids[0].grid.as_ref().unwrap_err();
        assert_eq!((error.code, &*file.grids[0].value_type), (Code::Unsupported, name));
        assert!(error.what.contains("\"other\"") && error.what.contains(name), "{error}");
        assert!(file.grids[1].grid.is_ok());
    }
}

#[test]
fn other_versions_and_codecs_are_refused() {
    let grid = Model::of(FLOAT).bytes();
    for major in [29, 33] {
        let file = segment(std::slice::from_ref(&grid), 0, MAGIC_FILE, major << 21 | 3 << 10);
        let error = read(&file).unwrap_err();
        assert_eq!((error.code, error.what.contains(&format!("{major}.3"))), (Code::Version, true), "{error}");
    }
    let raw = Model { version: 33 << 21, ..Model::of(FLOAT) }.bytes();
    assert_eq!(read(&raw).unwrap_err().code, Code::Version);
    let error = read(&segment(&[grid], 7, MAGIC_FILE, V32_9)).unwrap_err();
    assert_eq!((error.code, error.what.contains('7')), (Code::Unsupported, true), "{error}");
    assert_eq!(read(b"NanoVDB7 and more").unwrap_err().code, Code::Version);
    assert_eq!(read(b"nothing of the kind").unwrap_err().code, Code::Corrupt);
}

#[test]
fn checksums_are_compared() {
    let codes = |grid: &[u8]| read(grid).unwrap().warnings.iter().map(|w| w.code).collect::<Vec<_>>();
    let model = Model::of(FLOAT);
    let last = model.bytes().len() - 1;
    for full in [false, true] {
        let mut grid = model.bytes();
        sum_up(&mut grid, full);
        assert_eq!(codes(&grid), [""; 0], "full {full}");
        grid[last] ^= 1;
        assert_eq!(codes(&grid), vec!["checksum"; usize::from(full)], "a value, full {full}");
        grid[last] ^= 1;
        grid[600] ^= 1;
        assert_eq!(codes(&grid), ["checksum"], "the head, full {full}");
    }
    // Up to 32.6.0 the first sum also covers the root.
    let mut old = Model { version: V32_4, ..model }.bytes();
    let mut crc = flate2::Crc::new();
    crc.update(&old[16..ROOT + 64 + 32 * 3]);
    old[8..12].copy_from_slice(&crc.sum().to_le_bytes());
    assert_eq!(codes(&old), ["checksum"; 0]);
    old[ROOT + 3] ^= 1;
    assert_eq!(codes(&old), ["checksum"]);
}

#[test]
fn oddities_that_do_no_harm_are_warnings() {
    let codes = |bytes: &[u8]| read(bytes).unwrap().warnings.iter().map(|w| w.code).collect::<Vec<_>>();
    let good = segment(&[Model::of(FLOAT).bytes()], 1, MAGIC_FILE, V32_9);
    assert_eq!(codes(&good), [""; 0]);
    assert_eq!(codes(&[&good[..], b"trailing bytes"].concat()), ["damaged"]);
    assert_eq!(codes(&[&Model::of(FLOAT).bytes()[..], &[0; 9]].concat()), ["damaged"]);
    for byte in [16 + 8, 16 + 32] {
        let mut odd = good.clone();
        odd[byte] ^= 2; // size in the file, type in the table
        assert_eq!(codes(&odd), ["damaged"], "{byte}");
    }
    assert_eq!(codes(&segment(&[], 0, MAGIC_FILE, V32_9)), ["empty_grid"]);
}

#[test]
fn a_grid_without_nodes_is_empty() {
    let mut model = Model::of(FLOAT);
    (model.leaves, model.tiles) = (Vec::new(), Vec::new());
    let grid = only(&model.bytes());
    assert_eq!((grid.leaves.len(), grid.tiles.len(), grid.background), (0, 0, 0.5));
}

/// The writer's grid with some bytes replaced.
fn with(model: &Model, changes: &[(usize, &[u8])]) -> Vec<u8> {
    let mut grid = model.bytes();
    for (at, bytes) in changes {
        grid[*at..at + bytes.len()].copy_from_slice(bytes);
    }
    grid
}

#[test]
fn wrong_offsets_and_counts_are_corrupt() {
    let mut model = Model::of(16);
    model.width = 1;
    model.leaves[0].2[3] = 1 << 61; // a width of codes too, where a leaf 32 bytes on would have it
    let good = model.bytes();
    assert!(read(&good).unwrap().grids[0].grid.is_ok());
    let u64_at = |at: usize| u64::from_le_bytes(*good[at..].first_chunk().unwrap());
    let row = ROOT + 64; // the first of the root table
    let upper = ROOT + u64_at(row + 8) as usize;
    let lower = 672 + u64_at(672 + 8) as usize;
    let leaf = 672 + u64_at(672) as usize;
    let child = (0..4096).map(|n| lower + 1088 + 8 * n).find(|&at| u64_at(at) as usize + lower == leaf).unwrap();
    let wild = |n: i64| n.to_le_bytes();
    let cases: [(&str, Vec<u8>); 15] = [
        ("The root is said to lie 1099511627776 bytes", with(&model, &[(672 + 24, &wild(1 << 40))])),
        ("The root is said to lie -700 bytes", with(&model, &[(672 + 24, &wild(-700))])),
        ("The root is said to lie -32 bytes", with(&model, &[(672 + 24, &wild(-32))])), // in the grid's head
        ("137438953504 bytes are needed", with(&model, &[(ROOT + 24, &[0xff; 4])])),
        ("Two rows of the root table", with(&model, &[(row + 32, &good[row..row + 8])])),
        ("An upper node is said to lie", with(&model, &[(row + 8, &wild(1 << 40))])),
        ("270400 bytes are needed", with(&model, &[(row + 8, &wild((leaf - ROOT) as i64))])),
        ("overlap", with(&model, &[(row + 40, &good[row + 8..row + 16])])),
        ("no multiple of 32", with(&model, &[(child, &wild((leaf - lower) as i64 + 8))])),
        ("overlap", with(&model, &[(child, &wild((leaf - lower) as i64 + 32))])),
        ("A leaf is said to lie -9223372036854775808", with(&model, &[(child, &wild(i64::MIN))])),
        ("has codes of 2^5 bits", with(&model, &[(leaf + 15, &[5 << 5])])),
        ("The first node is said to lie", with(&model, &[(672, &wild(1 << 40))])),
        ("No node of the tree", with(&model, &[(672, &wild((leaf - 672) as i64 + 32))])),
        ("claims 3 nodes on a level and has 2", with(&model, &[(672 + 32, &[3])])),
    ];
    for (why, bytes) in cases {
        let error = refused(&bytes);
        assert_eq!((error.code, error.why.contains(why)), (Code::Corrupt, true), "{why}: {error}");
        assert!(error.what.contains("smoke"), "{error}");
    }
    // A mask that makes every entry of an upper node the same child: what is kept stays bounded on the way.
    let child =
        &good[upper + 8256..][..8 * 32768].chunks(8).map(|entry| u64::from_le_bytes(*entry.first_chunk().unwrap()));
    let child = child.clone().find(|&offset| upper + offset as usize == lower).unwrap().to_le_bytes();
    let many = with(&model, &[(upper + 32 + 4096, &[0xff; 4096]), (upper + 8256, &child.repeat(32768))]);
    assert!(refused(&many).why.contains("used twice"));
}

#[test]
fn a_segment_is_told_from_a_raw_grid_under_their_old_common_magic() {
    // The size of the first grid, here 64 MiB, stands where a raw grid has its version.
    let words = |words: [u32; 3]| [MAGIC, &[MAGIC_OLD], &words.map(u32::to_le_bytes).concat()].concat();
    assert_eq!(is_raw(&words([V32_4, 1, 32 << 21])), Ok(false));
    assert_eq!(is_raw(&words([0xdead_beef, 1, V32_4])), Ok(true));
}

#[test]
fn a_transform_without_inverse_is_refused() {
    for matrix in [DMat4::from_scale(DVec3::new(1.0, 0.0, 1.0)), DMat4::from_scale(DVec3::NAN)] {
        let error = refused(&Model { matrix, ..Model::of(FLOAT) }.bytes());
        assert_eq!((error.code, error.what.contains("smoke")), (Code::Unsupported, true), "{error}");
    }
}

#[test]
fn truncation_at_every_byte_is_an_error() {
    let zip = segment(&[Model::small(FLOAT).bytes()], 1, MAGIC_FILE, V32_9);
    let plain = segment(&[Model::small(14).bytes()], 0, MAGIC_FILE, V32_9);
    let raw = Model::small(FLOAT).bytes();
    for file in [zip, plain, raw] {
        for end in 0..file.len() {
            assert!(read(&file[..end]).is_err(), "{end} of {} bytes", file.len());
        }
    }
}

#[test]
fn no_flipped_bits_make_the_reader_panic_or_grow() {
    let mut random = 1u32;
    let mut next = |below: usize| {
        random ^= random << 13;
        random ^= random >> 17;
        random ^= random << 5;
        random as usize % below
    };
    for value_type in [FLOAT, DOUBLE, 16] {
        let model = Model::small(value_type);
        let grid = model.bytes();
        let size = grid.len();
        let zip = segment(std::slice::from_ref(&grid), 1, MAGIC_FILE, V32_9);
        // Where something stands: heads and masks, and table entries that are no plain tiles.
        let plain = model.value(model.background);
        let telling: Vec<usize> = (0..grid.len())
            .filter(|&at| at < 1000 || grid[at] != 0 && !grid[at / 8 * 8..].starts_with(&plain))
            .collect();
        for round in 0..2000 {
            let (mut bytes, mut at) = (grid.clone(), telling[next(telling.len())]);
            if round % 4 == 0 {
                bytes.clone_from(&zip);
                at = next(bytes.len());
            } else if round % 4 == 1 {
                at = next(bytes.len());
            }
            bytes[at] ^= 1 << next(8);
            let Ok(file) = read(&bytes) else { continue };
            for grid in file.grids.iter().filter_map(|entry| entry.grid.as_ref().ok()) {
                let origins: BTreeSet<_> = grid.leaves.iter().map(|leaf| leaf.origin.to_array()).collect();
                assert_eq!(origins.len(), grid.leaves.len());
                assert!(grid.bytes() < 16 * size);
            }
        }
    }
}
