use glam::{DVec3, IVec3};

use super::writer::{BLOSC, Format, GridSpec, MASK, Sketch, ZIP, file, scale};
use super::*;
use crate::volume::densify::densify;
use crate::volume::grid::Grid;

/// Leaves in two root children (one at negative coordinates), tiles of every level, a background.
fn sketch() -> Sketch {
    let mut tree = Sketch { background: 0.25, ..Sketch::default() };
    // Multiples of 1/256 are exact as half.
    let leaf = |seed: i32| (0..512).map(|n| (f64::from((n * 7 + seed) % 200) / 256.0, n % 3 != 0)).collect();
    for (i, origin) in [[0, 0, 0], [0, 0, 8], [8, 128, 0], [-8, -136, -4096], [120, 8, 16]].into_iter().enumerate() {
        tree.leaves.insert(origin, leaf(i as i32));
    }
    let background = |active| (0.25, active);
    tree.leaves.insert([16, 0, 0], (0..512).map(|n| if n == 100 { (1.0, true) } else { background(false) }).collect());
    tree.leaves.insert([24, 0, 0], vec![(0.5, true); 512]);
    tree.leaves.insert([32, 0, 0], vec![(-0.25, false); 512]);
    tree.tiles.insert((8, [64, 0, 0]), (0.75, true));
    tree.tiles.insert((8, [64, 8, 0]), (0.125, false));
    tree.tiles.insert((8, [64, 16, 0]), background(true));
    tree.tiles.insert((128, [256, 0, 384]), (2.0, true));
    tree.tiles.insert((128, [-256, -128, -4096]), (-0.25, false));
    tree.tiles.insert((4096, [8192, -4096, 4096]), (3.0, true));
    tree.tiles.insert((4096, [-8192, 0, 0]), background(false));
    tree
}

fn one(format: Format, tree: Sketch) -> Vec<u8> {
    file(&[GridSpec::new("density", format, tree)])
}

fn read_one(bytes: &[u8]) -> Grid {
    let mut file = read(bytes).unwrap();
    assert_eq!(file.grids.len(), 1);
    file.grids.remove(0).grid.unwrap()
}

/// Holds every voxel of the leaves, both corners of the tiles and some of the background against the sketch.
fn assert_holds(grid: &Grid, tree: &Sketch, case: &str) {
    assert_eq!(grid.background, tree.background, "{case}");
    assert_eq!(grid.leaves.len(), tree.leaves.len(), "{case}");
    let lookup = grid.lookup();
    for leaf in &grid.leaves {
        for (n, &(value, active)) in tree.leaves[&leaf.origin.to_array()].iter().enumerate() {
            let at = leaf.origin + IVec3::new(n as i32 >> 6, n as i32 >> 3 & 7, n as i32 & 7);
            assert_eq!((lookup.value(at), leaf.is_active(n)), (value, active), "{case}: {at}");
        }
    }
    let kept = tree.tiles.iter().filter(|(_, tile)| **tile != (tree.background, false));
    assert_eq!(grid.tiles.len(), kept.count(), "{case}");
    for tile in &grid.tiles {
        assert_eq!((tile.value, tile.active), tree.tiles[&(tile.side, tile.origin.to_array())], "{case}");
        assert_eq!([lookup.value(tile.origin), lookup.value(tile.bounds().max)], [tile.value; 2], "{case}");
    }
    for at in [[0, 8, 0], [-1, 0, 0], [4096, 0, 0], [i32::MAX; 3], [i32::MIN; 3]] {
        assert_eq!(lookup.value(at.into()), tree.background, "{case}: {at:?}");
    }
}

#[test]
fn every_encoding_gives_the_same_values() {
    let tree = sketch();
    for version in 220..=225 {
        for packing in [0, ZIP, BLOSC] {
            for masked in [0, MASK] {
                for (value_type, as_half) in
                    [("float", false), ("float", true), ("double", false), ("double", true), ("half", false)]
                {
                    for offsets in [true, false] {
                        let flags = packing | masked;
                        let format = Format { version, offsets, flags, value_type, as_half, reversed: offsets };
                        // Such files do not exist.
                        if version < 222 && flags > ZIP {
                            continue;
                        }
                        let case = format!("{format:?}");
                        let grid = read_one(&one(format, tree.clone()));
                        assert_holds(&grid, &tree, &case);
                        assert_eq!(matches!(grid.values, Values::F64(_)), value_type == "double", "{case}");
                    }
                }
            }
        }
    }
}

#[test]
fn inactive_values_come_back_in_every_way_they_are_left_out() {
    let (mut tree, active) = (Sketch { background: 0.25, ..Sketch::default() }, 0.5);
    let inactive: [&[f64]; 8] =
        [&[0.25], &[-0.25], &[2.0], &[-0.25, 0.25], &[2.0, 0.25], &[2.0, 3.0], &[2.0, -0.25], &[1.0, 2.0, 3.0]];
    for (i, values) in inactive.iter().enumerate() {
        let voxels = (0..512).map(|n| if n % 5 == 0 { (active, true) } else { (values[n % values.len()], false) });
        tree.leaves.insert([8 * i as i32, 0, 0], voxels.collect());
    }
    for flags in [MASK, MASK | ZIP, MASK | BLOSC] {
        for as_half in [false, true] {
            let format = Format { flags, as_half, ..Format::default() };
            assert_holds(&read_one(&one(format, tree.clone())), &tree, &format!("{format:?}"));
        }
    }
}

/// Replaces the first `old` by `new`.
fn replaced(bytes: &[u8], old: &[u8], new: &[u8]) -> Vec<u8> {
    let at = bytes.windows(old.len()).position(|window| window == old).expect("it is there");
    [&bytes[..at], new, &bytes[at + old.len()..]].concat()
}

#[test]
fn half_is_what_the_metadata_say() {
    let with_length = |text: &str| [&(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let (plain, suffixed) = ("Tree_float_5_4_3", "Tree_float_5_4_3_HalfFloat");
    for as_half in [true, false] {
        let format = Format { as_half, offsets: false, ..Format::default() };
        let (old, new) = if as_half { (suffixed, plain) } else { (plain, suffixed) };
        let bytes = replaced(&one(format, sketch()), &with_length(old), &with_length(new));
        assert_holds(&read_one(&bytes), &sketch(), new);
    }
}

#[test]
fn other_trees_are_refused_by_name() {
    for name in ["Tree_float_4_3_3", "Tree_flout_5_4_3", "Oak_float_5_4_3"] {
        let bytes = one(Format { offsets: true, ..Format::default() }, sketch());
        let bytes = replaced(&bytes, &b"Tree_float_5_4_3"[..name.len().min(16)], name.as_bytes());
        let Ok(found) = read(&bytes) else { panic!("{name}: the file as such is fine") };
        let error = found.grids[0].grid.as_ref().unwrap_err();
        assert_eq!(error.code, Code::Unsupported, "{name}");
        assert!(error.what.contains(name), "{error}");
    }
}

#[test]
fn transforms_are_column_matrices() {
    let translated = |shift: [f64; 3], sides| [shift.to_vec(), scale(sides)].concat();
    let mut affine = vec![0.0; 16];
    // For row vectors: index x goes to world y, y to −2 x, z to z + ½ x; the last row moves.
    (affine[1], affine[4], affine[8], affine[10], affine[15]) = (1.0, -2.0, 0.5, 1.0, 1.0);
    affine[12..15].copy_from_slice(&[10.0, 20.0, 30.0]);
    let moved = DVec3::new(11.5 - 4.0, 21.0, 33.0);
    let cases = [
        ("UniformScaleMap", scale([0.5; 3]), DVec3::new(0.5, 1.0, 1.5)),
        ("ScaleMap", scale([0.5, -1.0, 2.0]), DVec3::new(0.5, -2.0, 6.0)),
        ("UniformScaleTranslateMap", translated([1.0, 2.0, 3.0], [2.0; 3]), DVec3::new(3.0, 6.0, 9.0)),
        ("ScaleTranslateMap", translated([1.0, 2.0, 3.0], [2.0, 1.0, -1.0]), DVec3::new(3.0, 4.0, 0.0)),
        ("TranslationMap", vec![4.0, 5.0, 6.0], DVec3::new(5.0, 7.0, 9.0)),
        ("AffineMap", affine.clone(), moved),
        ("UnitaryMap", affine, moved),
    ];
    for (name, numbers, expected) in cases {
        let mut grid = GridSpec::new("density", Format::default(), sketch());
        grid.map = (name, numbers);
        let matrix = read_one(&file(&[grid])).world_from_index;
        assert_eq!(matrix.transform_point3(DVec3::new(1.0, 2.0, 3.0)), expected, "{name}");
    }
}

#[test]
fn transforms_that_are_not_drawn_are_named() {
    let flat = scale([1.0, 0.0, 1.0]).iter().map(|x| if x.is_finite() { *x } else { 0.0 }).collect();
    let mut perspective = vec![0.0; 16];
    (perspective[0], perspective[5], perspective[10], perspective[11], perspective[15]) = (1.0, 1.0, 1.0, 0.5, 1.0);
    for (name, numbers, word) in
        [("ScaleMap", flat, "determinant"), ("AffineMap", perspective, "perspective"), ("OddMap", vec![], "OddMap")]
    {
        let mut grid = GridSpec::new("density", Format::default(), sketch());
        grid.map = (name, numbers);
        let error = read(&file(&[grid])).unwrap().grids.remove(0).grid.unwrap_err();
        assert_eq!(error.code, Code::Unsupported, "{name}");
        assert!(error.why.contains(word), "{error}");
    }
    let mut grid = GridSpec::new("density", Format::default(), sketch());
    grid.map = ("ScaleMap", scale([1.0, f64::NAN, 1.0]));
    assert_eq!(read(&file(&[grid])).unwrap().grids[0].grid.as_ref().unwrap_err().code, Code::Corrupt);
}

#[test]
fn a_frustum_is_refused_by_name_and_passed_over() {
    for (version, corner) in [(220, 4), (224, 8)] {
        for offsets in [true, false] {
            let format = Format { version, offsets, flags: 0, ..Format::default() };
            let mut frustum = GridSpec::new("a", format, sketch());
            frustum.map = ("NonlinearFrustumMap", Vec::new());
            let plain = GridSpec::new("b", format, sketch());
            let mut bytes = file(&[frustum, plain]);
            let name = b"NonlinearFrustumMap";
            let at = bytes.windows(name.len()).position(|window| window == name).unwrap() + name.len();
            let mut rest = vec![0; 6 * corner + 16];
            rest.extend([&9_u32.to_le_bytes()[..], b"AffineMap"].concat());
            rest.extend(glam::DMat4::IDENTITY.to_cols_array().iter().flat_map(|x| x.to_le_bytes()));
            let shift = rest.len();
            bytes.splice(at..at, rest);
            if offsets {
                move_positions(&mut bytes, b"Tree_float_5_4_3", shift as i64);
            }
            let grids = read(&bytes).unwrap().grids;
            let error = grids[0].grid.as_ref().unwrap_err();
            assert!(error.why.contains("frustum") && error.code == Code::Unsupported, "{error}");
            assert_holds(grids[1].grid.as_ref().unwrap(), &sketch(), "after a frustum");
        }
    }
}

/// Adds to the positions in all descriptors, but not to where the first grid starts.
fn move_positions(bytes: &mut [u8], tree_type: &[u8], shift: i64) {
    let places: Vec<usize> =
        (0..bytes.len() - tree_type.len()).filter(|&i| bytes[i..].starts_with(tree_type)).collect();
    for (grid, place) in places.into_iter().enumerate() {
        for field in usize::from(grid == 0)..3 {
            let at = place + tree_type.len() + 4 + 8 * field;
            let position = i64::from_le_bytes(*bytes[at..].first_chunk().unwrap()) + shift;
            bytes[at..at + 8].copy_from_slice(&position.to_le_bytes());
        }
    }
}

#[test]
fn names_classes_and_order_are_as_in_the_library() {
    let format = Format::default();
    let grid = |name: &str, class| GridSpec { class, ..GridSpec::new(name, format, sketch()) };
    let specs = [
        grid("heat", Some("level set")),
        grid("density\x1e10", Some(" Fog Volume ")),
        grid("density\x1e9", None),
        grid("\x1e0", Some("staggered")),
        GridSpec { name: b"a\xff".to_vec(), ..grid("", Some("mist")) },
    ];
    let found = read(&file(&specs)).unwrap();
    let grids: Vec<_> = (found.grids.iter())
        .map(|e| (&*e.name, &*e.unique_name, &*e.class_name, e.grid.as_ref().unwrap().class.clone()))
        .collect();
    let other = |word: &str| Class::Other(word.into());
    let expected = [
        ("", "[0]", "staggered", other("staggered")),
        ("a\u{fffd}", "a\u{fffd}", "unknown", other("mist")),
        ("density", "density[9]", "unknown", other("unknown")),
        ("density", "density[10]", "fog volume", Class::Fog),
        ("heat", "heat", "level set", Class::LevelSet),
    ];
    assert_eq!(grids, expected);
    assert_eq!((found.format, &*found.version), ("vdb", "224"));
}

#[test]
fn grids_may_share_a_tree() {
    for offsets in [true, false] {
        let format = Format { offsets, ..Format::default() };
        let mut moved = GridSpec::new("a", format, Sketch::default());
        moved.map = ("TranslationMap", vec![1.0, 2.0, 3.0]);
        (moved.parent, moved.class) = ("z\x1e1", Some("level set"));
        let orphan = GridSpec { parent: "nobody", ..GridSpec::new("b", format, Sketch::default()) };
        let chained = GridSpec { parent: "a", ..GridSpec::new("c", format, Sketch::default()) };
        let owner = GridSpec::new("z\x1e1", format, sketch());
        let grids = read(&file(&[owner, moved, orphan, chained])).unwrap().grids;
        let by_name = |name: &str| grids.iter().find(|e| e.name == name).unwrap();
        let grid = by_name("a").grid.as_ref().unwrap();
        assert_holds(grid, &sketch(), "shared");
        assert_eq!(grid.world_from_index.transform_point3(DVec3::ZERO), DVec3::new(1.0, 2.0, 3.0));
        assert_eq!(grid.class, Class::LevelSet);
        for name in ["b", "c"] {
            assert_eq!(by_name(name).grid.as_ref().unwrap_err().code, Code::Corrupt, "{name}");
        }
    }
}

#[test]
fn copies_of_a_shared_tree_stay_within_what_the_file_can_justify() {
    let mut specs = vec![GridSpec::new("owner", Format::default(), sketch())];
    for i in 0..4000 {
        let name = format!("share {i}");
        specs.push(GridSpec { parent: "owner", ..GridSpec::new(&name, Format::default(), Sketch::default()) });
    }
    specs[0].format.flags = ZIP | MASK;
    // Many leaves of few bytes.
    for i in 0..200 {
        specs[0].tree.leaves.insert([128 + 8 * i, 0, 0], vec![(0.5, true); 512]);
    }
    let bytes = file(&specs);
    let grids = read(&bytes).unwrap().grids;
    let held: usize = grids.iter().filter_map(|entry| entry.grid.as_ref().ok()).map(Grid::bytes).sum();
    assert!(held <= (MAX_EXPANSION + 32) * bytes.len(), "{held} bytes for a file of {}", bytes.len());
    assert!(grids.iter().any(|entry| matches!(&entry.grid, Err(error) if error.code == Code::TooLarge)));
    assert!(grids.iter().filter(|entry| entry.grid.is_ok()).count() > 10);
}

#[test]
fn grids_that_are_not_drawn_do_not_hide_others() {
    for (offsets, version) in [(true, 224), (false, 224), (false, 221)] {
        for flags in [0, ZIP] {
            for (value_type, as_half) in
                [("vec3s", false), ("vec3s", true), ("int32", false), ("bool", false), ("mask", false)]
            {
                let format = Format { offsets, version, flags, value_type, as_half, ..Format::default() };
                let plain = Format { offsets, version, flags, ..Format::default() };
                let specs = [GridSpec::new("a", format, sketch()), GridSpec::new("b", plain, sketch())];
                let grids = read(&file(&specs)).unwrap().grids;
                let error = grids[0].grid.as_ref().unwrap_err();
                assert!(error.code == Code::Unsupported && error.what.contains(value_type), "{error}");
                assert_eq!(grids[0].value_type, value_type);
                assert_holds(grids[1].grid.as_ref().unwrap(), &sketch(), value_type);
            }
        }
    }
}

#[test]
fn what_follows_an_unknown_type_is_found_by_offsets_only() {
    for offsets in [true, false] {
        let format = Format { offsets, value_type: "string", ..Format::default() };
        let plain = Format { offsets, ..Format::default() };
        let specs = ["a", "b", "c"].map(|name| GridSpec::new(name, if name == "b" { format } else { plain }, sketch()));
        let found = read(&file(&specs)).unwrap();
        assert_eq!(found.grids.len(), if offsets { 3 } else { 2 });
        assert_eq!(found.warnings.len(), usize::from(!offsets));
        assert_holds(found.grids[0].grid.as_ref().unwrap(), &sketch(), "before");
    }
}

#[test]
fn versions_outside_the_range_are_refused_by_number() {
    for version in [219, 226, u32::MAX] {
        let mut bytes = one(Format::default(), sketch());
        bytes[8..12].copy_from_slice(&version.to_le_bytes());
        let error = read(&bytes).unwrap_err();
        assert!(error.code == Code::Version && error.what.contains(&version.to_string()), "{error}");
    }
    assert_eq!(read(b"not a volume").unwrap_err().code, Code::UnknownFormat);
}

#[test]
fn a_file_without_grids_says_so() {
    let found = read(&file(&[])).unwrap();
    assert!(found.grids.is_empty());
    assert_eq!(found.warnings[0].code, "empty_grid");
}

/// Small, so that all its prefixes can be tried.
fn small() -> Sketch {
    let mut tree = Sketch { background: 0.25, ..Sketch::default() };
    tree.leaves.insert([0, 0, 0], (0..512).map(|n| (f64::from(n) / 256.0, n % 2 == 0)).collect());
    tree
}

#[test]
fn no_prefix_of_a_file_is_read() {
    for offsets in [true, false] {
        for flags in [ZIP | MASK, BLOSC | MASK, 0] {
            let bytes = one(Format { offsets, flags, ..Format::default() }, small());
            read_one(&bytes);
            // Most of a plain file are values.
            for length in (0..bytes.len()).filter(|n| flags != 0 || n % 211 == 0 || n + 2100 > bytes.len()) {
                let error = read(&bytes[..length]).unwrap_err();
                assert_eq!(error.code, Code::Corrupt, "{length} of {} bytes: {error}", bytes.len());
            }
        }
    }
}

#[test]
fn bytes_after_the_last_grid_do_not_matter() {
    for offsets in [true, false] {
        let mut bytes = one(Format { offsets, ..Format::default() }, sketch());
        bytes.extend([0xaa; 99]);
        assert_holds(&read_one(&bytes), &sketch(), "trailing");
    }
}

#[test]
fn damage_gives_a_volume_or_an_error_in_bounded_memory() {
    let mut state = 1_u64;
    // The generator of Knuth's MMIX: only the upper bits are random enough.
    let mut random = |below: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    let mut tree = small();
    tree.tiles.insert((8, [64, 0, 0]), (0.75, true));
    tree.tiles.insert((4096, [4096, 0, 0]), (0.5, true));
    let mut read_anyway = 0;
    for flags in [ZIP | MASK, BLOSC | MASK, MASK] {
        for offsets in [true, false] {
            let format = Format { flags, offsets, ..Format::default() };
            let share = GridSpec { parent: "density", ..GridSpec::new("share", format, Sketch::default()) };
            let bytes = file(&[GridSpec::new("density", format, tree.clone()), share]);
            for _ in 0..700 {
                let mut damaged = bytes.clone();
                for _ in 0..=random(3) {
                    // Half of the damage goes to the start, which is denser in meaning.
                    let place = if random(2) == 0 { random(700) } else { random(bytes.len()) };
                    damaged[place] = if random(2) == 0 { damaged[place] ^ 1 << random(8) } else { random(256) as u8 };
                }
                let Ok(found) = read(&damaged) else { continue };
                for entry in found.grids {
                    let Ok(grid) = entry.grid else { continue };
                    read_anyway += 1;
                    assert!(grid.bytes() <= MAX_EXPANSION * damaged.len());
                    grid.stats();
                    grid.lookup().trilinear(DVec3::new(0.5, 1e9, -1e300));
                    densify(&grid, "damaged", 32, 1 << 20).unwrap();
                }
            }
        }
    }
    assert!(read_anyway > 100, "only {read_anyway} damaged grids were read: the test no longer reaches the values");
}

/// Where the tree starts in a file of one grid with a uniform scale: at its number of buffers.
fn tree_start(bytes: &[u8]) -> usize {
    let map = b"UniformScaleMap";
    bytes.windows(map.len()).position(|window| window == map).expect("it is there") + map.len() + 5 * 24
}

fn assert_corrupt(bytes: &[u8], why: &str) {
    let error = read(bytes).unwrap().grids.remove(0).grid.unwrap_err();
    assert!(error.code == Code::Corrupt && error.why.contains(why), "{why}: {error}");
}

#[test]
fn wild_claims_are_refused() {
    let bytes = one(Format { flags: ZIP | MASK, ..Format::default() }, small());
    let buffers = tree_start(&bytes);
    let (tiles, children) = (buffers + 8, buffers + 12);
    // A place and two masks later: how inactive values are stored, and the number of packed bytes.
    let (code, length) = (children + 4 + 12 + 2 * 4096, children + 4 + 12 + 2 * 4096 + 1);
    for (at, value, why) in [
        (buffers, 2, "2 buffers"),
        (tiles, u32::MAX, "cannot be there"),
        (children, u32::MAX, "cannot be there"),
        (children + 4, 7, "cannot be there"),
        (code, 7, "unknown way 7"),
        (length, 1 << 31, "only"),
        (length + 4, u32::MAX, "has 4294967296"),
    ] {
        let mut wild = bytes.clone();
        wild[at..at + 4].copy_from_slice(&value.to_le_bytes());
        assert_corrupt(&wild, why);
    }
}

#[test]
fn contradictions_are_refused() {
    let bytes = one(Format::default(), small());
    let positions = bytes.windows(4).position(|window| window == b"_4_3").unwrap() + 4 + 4;
    let values = i64::from_le_bytes(*bytes[positions + 8..].first_chunk().unwrap());
    let mut moved = bytes.clone();
    moved[positions + 8] ^= 1;
    assert_corrupt(&moved, "the values of the leaves start here");
    let mut masked = bytes.clone();
    masked[values as usize + 5] ^= 1;
    assert_corrupt(&masked, "two different masks");
    let mut longer = bytes.clone();
    longer.push(0);
    longer[positions + 16..positions + 24].copy_from_slice(&(bytes.len() as i64 + 1).to_le_bytes());
    assert_corrupt(&longer, "1 bytes are left");
    for (side, origin, why) in [
        (4096, [0; 3], "cannot be there"),
        (4096, [8, 0, 0], "cannot be there"),
        (128, [0; 3], "a child and a tile"),
        (8, [0; 3], "a child and a tile"),
    ] {
        let mut tree = small();
        tree.tiles.insert((side, origin), (0.5, true));
        assert_corrupt(&one(Format::default(), tree), why);
    }
}
