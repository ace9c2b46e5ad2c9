use glam::{DMat4, DVec3, IVec3, UVec3};

use super::densify;
use crate::error::Code;
use crate::volume::Dense;
use crate::volume::grid::{Class, Grid, LEAF_VOXELS, Leaf, Tile, Values};

const MANY: u64 = 1 << 24;

fn grid(class: Class, background: f64) -> Grid {
    let values = Values::F64(Vec::new());
    let world_from_index = DMat4::IDENTITY;
    Grid { class, world_from_index, background, leaves: Vec::new(), values, tiles: Vec::new() }
}

/// Adds a leaf of the values and activities that `voxel` gives for places.
fn add_leaf(grid: &mut Grid, origin: IVec3, voxel: impl Fn(IVec3) -> (f64, bool)) {
    let mut active = [0; 8];
    let Values::F64(values) = &mut grid.values else { panic!("grid() makes double precision") };
    for n in 0..LEAF_VOXELS {
        let (value, on) = voxel(origin + IVec3::new((n / 64) as i32, (n / 8 % 8) as i32, (n % 8) as i32));
        values.push(value);
        active[n / 64] |= u64::from(on) << (n % 64);
    }
    grid.leaves.push(Leaf { origin, active });
}

fn codes(dense: &Dense) -> Vec<&'static str> {
    dense.warnings.iter().map(|warning| warning.code).collect()
}

/// Leaves and tiles at odd places of a box that starts and ends within leaves, inactive values and gaps in between.
fn mixed(background: f64) -> Grid {
    let mut grid = grid(Class::Fog, background);
    let inside = |at: IVec3| at.cmpge(IVec3::new(-5, 3, -14)).all() && at.cmplt(IVec3::new(22, 14, 12)).all();
    let value = |at: IVec3| f64::from((at.x * 31 + at.y * 17 + at.z * 7).rem_euclid(64)) / 64.0;
    for origin in [[-8, 0, -16], [16, 8, 8], [0, 8, 0], [-8, 0, 8]] {
        add_leaf(&mut grid, origin.into(), |at| (value(at), inside(at) && at.x % 3 != 0));
    }
    let mut tile = |origin: [i32; 3], value, active| {
        grid.tiles.push(Tile { origin: origin.into(), side: 8, value, active });
    };
    tile([0, 8, -8], 0.75, false);
    tile([8, 0, 0], 0.5, false);
    tile([16, 8, -16], 2.0, false);
    grid
}

#[test]
fn each_voxel_of_the_active_box_has_its_stored_value() {
    for background in [0.0, 0.25] {
        let mut grid = mixed(background);
        grid.world_from_index =
            DMat4::from_cols_array(&[0.0, -2.0, 0.0, 0.0, 1.0, 0.5, 0.0, 0.0, 0.0, 0.0, 3.0, 0.0, 7.0, 8.0, 9.0, 1.0]);
        let dense = densify(&grid, "mixed", 0, MANY).unwrap();
        let bounds = grid.active_box().unwrap();
        assert_eq!(dense.size.as_ivec3(), bounds.max - bounds.min + 1);
        let (lookup, mut data) = (grid.lookup(), dense.data.iter());
        for z in bounds.min.z..=bounds.max.z {
            for y in bounds.min.y..=bounds.max.y {
                for x in bounds.min.x..=bounds.max.x {
                    let at = IVec3::new(x, y, z);
                    assert_eq!(*data.next().unwrap(), lookup.value(at) as f32, "{at}");
                }
            }
        }
        assert_eq!(data.next(), None);
        let last = dense.size.as_dvec3() - 1.0;
        assert_eq!(
            dense.world_from_index.transform_point3(last),
            grid.world_from_index.transform_point3(bounds.max.as_dvec3())
        );
        assert_eq!(codes(&dense), if background == 0.0 { vec![] } else { vec!["background"] });
    }
}

/// The mean over a part of a box, voxel by voxel.
fn mean(dense: &Dense, low: DVec3, high: DVec3) -> f64 {
    let (mut sum, size) = (0.0, dense.size);
    for (i, value) in dense.data.iter().enumerate() {
        let i = i as u32;
        let voxel = UVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y).as_dvec3();
        let sides = (high.min(voxel + 1.0) - low.max(voxel)).max(DVec3::ZERO);
        sum += f64::from(*value) * sides.element_product();
    }
    sum / (high - low).element_product()
}

#[test]
fn resampling_takes_means_and_keeps_the_faces() {
    for background in [0.0, 0.25] {
        let mut grid = mixed(background);
        grid.world_from_index =
            DMat4::from_translation(DVec3::new(1.0, 2.0, 3.0)) * DMat4::from_scale(DVec3::new(0.5, -1.0, 2.0));
        let exact = densify(&grid, "mixed", 0, MANY).unwrap();
        for max_resolution in [1, 2, 5, 11, 13, 25] {
            let coarse = densify(&grid, "mixed", max_resolution, MANY).unwrap();
            assert_eq!(coarse.size.max_element(), max_resolution);
            let step = exact.size.as_dvec3() / coarse.size.as_dvec3();
            for (i, &value) in coarse.data.iter().enumerate() {
                let (i, size) = (i as u32, coarse.size);
                let cell = UVec3::new(i % size.x, i / size.x % size.y, i / size.x / size.y).as_dvec3();
                let expected = mean(&exact, cell * step, (cell + 1.0) * step);
                assert!((f64::from(value) - expected).abs() < 1e-6, "{max_resolution}, {cell}: {value}, {expected}");
            }
            for (a, b) in coarse.corners().into_iter().zip(exact.corners()) {
                assert!(a.distance(b) < 1e-9, "{max_resolution}: {a}, {b}");
            }
        }
    }
}

#[test]
fn a_resolution_that_suffices_changes_nothing() {
    let grid = mixed(0.0);
    let exact = densify(&grid, "mixed", 0, MANY).unwrap();
    let longest = exact.size.max_element();
    assert_eq!(densify(&grid, "mixed", longest, MANY).unwrap().data, exact.data);
    assert_eq!(densify(&grid, "mixed", longest - 1, MANY).unwrap().size.max_element(), longest - 1);
}

#[test]
fn huge_boxes_are_resampled_from_the_sparse_tree() {
    let mut tiles = grid(Class::Fog, 0.0);
    for i in 0..8 {
        let origin = IVec3::new(i >> 2 & 1, i >> 1 & 1, i & 1) * 4096 - 4096;
        tiles.tiles.push(Tile { origin, side: 4096, value: f64::from(i + 1), active: true });
    }
    let dense = densify(&tiles, "tiles", 16, MANY).unwrap();
    assert_eq!(dense.size, UVec3::splat(16));
    assert_eq!([dense.data[0], dense.data[15], dense.data[16 * 15], dense.data[4095]], [1.0, 5.0, 3.0, 8.0]);

    let mut apart = grid(Class::Fog, 0.0);
    for (origin, voxel) in [(IVec3::MIN, IVec3::MIN), (IVec3::MAX - 7, IVec3::MAX)] {
        add_leaf(&mut apart, origin, |at| if at == voxel { (1e30, true) } else { (0.0, false) });
    }
    let dense = densify(&apart, "apart", 4, MANY).unwrap();
    assert_eq!(dense.size, UVec3::splat(4));
    let expected = (1e30 / 2_f64.powi(90)) as f32;
    assert_eq!((dense.data[0], dense.data[63]), (expected, expected));
    assert!(dense.data[1..63].iter().all(|&value| value == 0.0));
    let error = densify(&apart, "apart", 0, MANY).unwrap_err();
    assert_eq!(error.code, Code::TooLarge);
    assert!(error.why.contains(&(4_u128 << 96).to_string()), "{error}");
    assert_eq!(error.hint, "Resample it: --set volume.max_resolution=256");
}

#[test]
fn too_large_offers_a_resolution_that_is_allowed() {
    let mut line = grid(Class::Fog, 0.0);
    line.tiles.push(Tile { origin: IVec3::ZERO, side: 128, value: 1.0, active: true });
    let error = densify(&line, "line", 100, 300_000).unwrap_err();
    assert_eq!((error.code, &*error.hint), (Code::TooLarge, "Resample it: --set volume.max_resolution=64"));
    assert_eq!(densify(&line, "line", 64, 300_000).unwrap().size, UVec3::splat(64));
    assert_eq!(densify(&line, "line", 0, MANY).unwrap().data, vec![1.0; 128 * 128 * 128]);
    let error = densify(&line, "line", 0, 7).unwrap_err();
    assert!(!error.hint.contains("max_resolution"), "{error}");
}

#[test]
fn bad_values_are_zero_and_counted_inside_the_box() {
    let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, -1.0, 1e39, 0.5, 0.0, 0.25];
    let mut bads = grid(Class::Fog, 0.0);
    // The box is 6 × 8 × 8 voxels: the last two slices in x lie outside.
    add_leaf(&mut bads, IVec3::ZERO, |at| (bad[at.z as usize], at.x < 6));
    bads.tiles.push(Tile { origin: IVec3::new(0, 0, 8), side: 8, value: -3.0, active: false });
    let dense = densify(&bads, "bads", 0, MANY).unwrap();
    assert_eq!(dense.size, UVec3::new(6, 8, 8));
    let layers: Vec<f32> = dense.data.chunks(48).map(|layer| layer[0]).collect();
    assert_eq!(layers, [0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.25]);
    assert_eq!(codes(&dense), ["bad_values"]);
    assert!(dense.warnings[0].text.contains(" 240 voxels"), "{}", dense.warnings[0]);
    // One active voxel in the tile's last layer takes half of the tile into the box.
    add_leaf(&mut bads, IVec3::new(8, 0, 8), |at| (0.0, at == IVec3::new(8, 0, 11)));
    let dense = densify(&bads, "bads", 0, MANY).unwrap();
    let count = 8 * 8 * 5 + 8 * 8 * 4;
    assert!(dense.warnings[0].text.contains(&format!(" {count} voxels")), "{}", dense.warnings[0]);
}

#[test]
fn a_background_that_is_not_a_number_is_one_warning() {
    let mut holes = grid(Class::Fog, f64::NAN);
    add_leaf(&mut holes, IVec3::ZERO, |at| if at.x % 2 == 0 { (0.5, true) } else { (f64::NAN, false) });
    let dense = densify(&holes, "holes", 0, MANY).unwrap();
    assert_eq!(codes(&dense), ["background"]);
    assert_eq!(dense.data[..4], [0.5, 0.0, 0.5, 0.0]);
}

#[test]
fn a_level_set_is_full_inside() {
    // Voxels of sides 1, 2, 3: two on average.
    let world_from_index = DMat4::from_scale(DVec3::new(1.0, -2.0, 3.0));
    let distances = [0.5, 0.0, -0.1, -0.25, -0.5, -9.0, f64::NEG_INFINITY, f64::NAN];
    let expect = |background: f64, densities: [f32; 8]| {
        let mut set = Grid { world_from_index, ..grid(Class::LevelSet, background) };
        add_leaf(&mut set, IVec3::ZERO, |at| (distances[at.x as usize], at.y == 0));
        set.tiles.push(Tile { origin: IVec3::new(0, 8, 0), side: 8, value: -background.abs(), active: true });
        let dense = densify(&set, "set", 0, MANY).unwrap();
        assert_eq!(dense.size, UVec3::new(8, 16, 8));
        assert_eq!(dense.data[..8], densities, "{background}");
        (dense.data[8 * 9], codes(&dense))
    };
    let ramp = [0.0, 0.0, 0.2, 0.5, 1.0, 1.0, 0.0, 0.0];
    assert_eq!(expect(0.5, ramp), (1.0, vec!["level_set", "bad_values"]));
    let ramp = [0.0, 0.0, 0.1 / 6.0, 0.25 / 6.0, 0.5 / 6.0, 1.0, 0.0, 0.0].map(|d: f64| d as f32);
    assert_eq!(expect(0.0, ramp), (0.0, vec!["level_set", "bad_values"]));
    // A background below zero would be drawn, were it not outside.
    assert_eq!(expect(-0.6, ramp), (0.1, vec!["level_set", "background", "bad_values"]));
}

#[test]
fn grids_of_other_classes_are_densities() {
    let mut other = grid(Class::Other("mist".into()), 0.3);
    add_leaf(&mut other, IVec3::ZERO, |_| (0.75, true));
    assert_eq!(densify(&other, "other", 0, MANY).unwrap().data, vec![0.75; 512]);
}

#[test]
fn nothing_to_see_is_an_empty_medium() {
    let mut nothing = grid(Class::Fog, 0.0);
    for value in [0.0, f64::NAN] {
        assert_eq!(codes(&densify(&nothing, "nothing", 0, MANY).unwrap()).last(), Some(&"empty_grid"));
        add_leaf(&mut nothing, IVec3::ZERO, |_| (value, true));
        let dense = densify(&nothing, "nothing", 2, MANY).unwrap();
        assert_eq!((dense.size, &*dense.data), (UVec3::ONE, &[0.0][..]));
        assert_eq!(dense.world_from_index, DMat4::IDENTITY);
        assert_eq!(codes(&dense).last(), Some(&"empty_grid"));
        nothing.leaves.clear();
        nothing.values = Values::F64(Vec::new());
    }
}
