//! The density from afar: means over cells that double from level to level, for the targets and proposals of resampling.

use glam::UVec3;
use rayon::prelude::*;

use super::majorant::Padded;

/// Levels at most.
const LEVELS: u32 = 6;
/// Cells along the longest side of the coarsest level, at least: fewer tell nothing, and make the finest level longer.
const FEWEST: u32 = 8;
/// The least value where there is any density: 16-bit floats hold no smaller normal number.
const LEAST: f32 = 6.2e-5;

/// Share of a wider mean that a cell has at least. It makes up for looks beside the middle of a cell; a greater one makes the
/// medium's edge too dense (0.5: a sixth more error).
const FRINGE: f32 = 0.1;

/// One level: values of cells, x fastest.
#[derive(Clone, Debug)]
pub struct Level {
    /// Cells along x, y, z.
    pub size: UVec3,
    /// Their values, over the density's greatest.
    pub data: Vec<f32>,
}

/// All levels, the finest first. Level l has cells of `side`·2^l texels and half the cells of the level before.
#[derive(Clone, Debug)]
pub struct Proxy {
    /// Texels along the side of a cell of the finest level.
    pub side: u32,
    /// The levels.
    pub levels: Vec<Level>,
}

impl Proxy {
    /// Cells of `side` texels of `field`: the mean, or `FRINGE` of the mean with one more layer of texels around, whichever is
    /// greater, so that a cell is above 0 wherever the interpolated density is.
    pub fn new(field: &Padded, side: u32) -> Proxy {
        let (size, levels) = shape(field.size, side);
        let plane = (size.x * size.y) as usize;
        let mut data = vec![0.0f32; plane * size.z as usize];
        data.par_chunks_mut(plane).enumerate().for_each(|(z, out)| {
            for (i, value) in out.iter_mut().enumerate() {
                let cell = UVec3::new(i as u32 % size.x, i as u32 / size.x, z as u32);
                let own = mean(field, cell * side, cell * side + side);
                let wide = mean(field, (cell * side).saturating_sub(UVec3::ONE), cell * side + side + 1);
                *value = least(own.max(FRINGE * wide));
            }
        });
        let mut all = vec![Level { size, data }];
        while all.len() < levels as usize {
            all.push(halved(all.last().expect("the finest")));
        }
        Proxy { side, levels: all }
    }

    /// Bytes that cells of `side` texels of a field of `size` take on the adapter, where a value takes two.
    pub fn bytes(size: UVec3, side: u32) -> u64 {
        let (finest, levels) = shape(size, side);
        let cells = |l: u32| (finest >> l).max(UVec3::ONE).as_u64vec3().element_product();
        (0..levels).map(|l| 2 * cells(l)).sum()
    }

    /// The side of cells, at least `least`, with which a field of `size` takes no more than `most` bytes.
    pub fn side_within(size: UVec3, least: u32, most: u64) -> u32 {
        (least..=size.max_element().max(least)).find(|&side| Proxy::bytes(size, side) <= most).unwrap_or(least)
    }
}

/// Cells of the finest level of a field of `size` texels, and the number of levels.
fn shape(size: UVec3, side: u32) -> (UVec3, u32) {
    let cells = size.map(|n| n.div_ceil(side));
    let levels = (1..=LEVELS).rev().find(|l| cells.max_element() >> (l - 1) >= FEWEST).unwrap_or(1);
    (cells.map(|n| n.next_multiple_of(1 << (levels - 1))), levels)
}

fn least(x: f32) -> f32 {
    if x > 0.0 { x.max(LEAST) } else { 0.0 }
}

/// Mean of the texels from `low` to `high`, exclusive; those outside the field are 0.
fn mean(field: &Padded, low: UVec3, high: UVec3) -> f32 {
    let inside = high.min(field.size);
    let mut sum = 0.0;
    for z in low.z..inside.z {
        for y in low.y..inside.y {
            let row = (y + field.size.y * z) as usize * field.size.x as usize;
            if low.x < inside.x {
                sum += field.data[row + low.x as usize..row + inside.x as usize].iter().sum::<f32>();
            }
        }
    }
    let all = high - low;
    sum / (all.x * all.y * all.z) as f32
}

fn halved(fine: &Level) -> Level {
    let size = fine.size / 2;
    let size = size.max(UVec3::ONE);
    let at = |x: u32, y: u32, z: u32| {
        let p = UVec3::new(x, y, z).min(fine.size - 1);
        fine.data[(p.x + fine.size.x * (p.y + fine.size.y * p.z)) as usize]
    };
    let cell = |i: usize| {
        let i = i as u32;
        let (x, y, z) = (2 * (i % size.x), 2 * (i / size.x % size.y), 2 * (i / (size.x * size.y)));
        let sum: f32 = (0..8).map(|c| at(x + (c & 1), y + (c >> 1 & 1), z + (c >> 2))).sum();
        least(sum / 8.0)
    };
    Level { size, data: (0..(size.x * size.y * size.z) as usize).into_par_iter().map(cell).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::volume::Dense;

    fn field(size: UVec3, value: impl Fn(UVec3) -> f32) -> Padded {
        let data = (0..size.x * size.y * size.z)
            .map(|i| value(UVec3::new(i % size.x, i / size.x % size.y, i / (size.x * size.y))))
            .collect();
        let dense = Dense { size, data, world_from_index: glam::DMat4::IDENTITY, warnings: Vec::new() };
        Padded::new(&dense, |x| x)
    }

    /// What the shader's sampler gives at a point in texels.
    fn sample(proxy: &Proxy, level: usize, p: [f64; 3]) -> f64 {
        let Level { size, data } = &proxy.levels[level];
        let side = f64::from(proxy.side << level);
        let padded = Padded { size: *size, data: data.clone(), max: 1.0 };
        padded.trilinear(p.map(|x| x / side))
    }

    #[test]
    fn the_proxy_is_above_zero_wherever_the_density_is() {
        // One voxel, at places all over the cells of the coarser levels.
        for place in [UVec3::new(0, 0, 0), UVec3::new(17, 3, 30), UVec3::new(36, 32, 15), UVec3::new(8, 16, 31)] {
            let field = field(UVec3::new(37, 33, 32), |p| if p == place { 1.0 } else { 0.0 });
            let proxy = Proxy::new(&field, 1);
            assert_eq!(proxy.levels.len(), 3);
            for i in 0..5u32.pow(3) {
                // Just inside the reach of the voxel's interpolation.
                let offset = [i % 5, i / 5 % 5, i / 25].map(|n| (f64::from(n) - 2.0) * 0.49);
                let centre = place.as_dvec3().to_array().map(|x| x + 1.5);
                let p: [f64; 3] = std::array::from_fn(|a| centre[a] + offset[a]);
                assert!(field.trilinear(p) > 0.0);
                for level in 0..proxy.levels.len() {
                    assert!(sample(&proxy, level, p) > 0.0, "level {level} at {p:?}");
                }
            }
        }
    }

    #[test]
    fn levels_keep_the_mean() {
        let field = field(UVec3::splat(30), |p| ((p.x * 7 + p.y * 3 + p.z) % 11) as f32 / 10.0);
        let proxy = Proxy::new(&field, 1);
        // Cells all of whose texels are inside keep their mean through the levels.
        let mean = |l: &Level| l.data.iter().map(|x| f64::from(*x)).sum::<f64>() / l.data.len() as f64;
        let first = mean(&proxy.levels[0]);
        for level in &proxy.levels {
            assert!((mean(level) / first - 1.0).abs() < 1e-4, "{} {first}", mean(level));
            assert_eq!(level.data.len() as u32, level.size.x * level.size.y * level.size.z);
        }
        let values: usize = proxy.levels.iter().map(|l| l.data.len()).sum();
        assert_eq!(Proxy::bytes(field.size, 1), 2 * values as u64);
        assert_eq!(Proxy::side_within(field.size, 1, 2 * values as u64), 1);
        assert_eq!(Proxy::side_within(field.size, 1, 2 * values as u64 - 1), 2);
    }

    #[test]
    fn an_empty_field_has_an_empty_proxy() {
        let proxy = Proxy::new(&field(UVec3::ONE, |_| 0.0), 2);
        assert!(proxy.levels.iter().all(|l| l.data.iter().all(|x| *x == 0.0)));
    }
}
