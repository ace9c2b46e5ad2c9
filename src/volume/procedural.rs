//! The default cloud: a cumulus as a pure function of a seed.
//!
//! A hierarchy of spheres ([`skeleton`]) gives a signed distance, noise ([`noise`]) displaces it, and the density is a
//! profile of the displaced distance: a sharp shell, more water inwards and upwards, frayed patches low down, a flat
//! base. Nothing is simulated. Feature positions are in world units, so clouds of all resolutions are the same cloud;
//! only the least width of the edge and the finest octave follow the voxel's size.
//!
//! All arithmetic is in `f32` by + − × ÷ √ and floor in a fixed order: the same bits on every platform, however many
//! threads there are.

use glam::{DMat4, DVec3, UVec3, Vec3, Vec4};
use rayon::prelude::*;

use super::Dense;

mod noise;
mod skeleton;

use noise::{billow, gradient, smoothstep};
use skeleton::{LONGEST_SIDE, Skeleton, Sphere, skeleton};

/// Fewest voxels along the longest side.
pub const MIN_RESOLUTION: u32 = 16;
/// Most voxels along the longest side.
pub const MAX_RESOLUTION: u32 = 512;

/// Greatest slope of the gradient noise that the bounds of a block allow for: an estimate, not a proof (steeper places
/// exist but are rare and small; bounds so loose that nothing is culled give the same bits).
const WARP_SLOPE: f32 = 2.0;

/// The domain warp, coarse and fine: amplitude in world units, features per world unit.
const WARP: [(f32, f32); 2] = [(0.09, 2.2), (0.022, 6.5)];

/// Voxels along the side of a block and of its parts, each with its own shorter list of spheres.
const BLOCK: u32 = 8;
const PART: u32 = 4;

/// The cumulus of `seed` with `resolution` voxels along its longest side (clamped to [`MIN_RESOLUTION`] …
/// [`MAX_RESOLUTION`]). That side is 2 world units long, the box's centre is 0, the base is down (−Y). Densities lie in
/// 0 … 1. Runs on all threads of the current rayon pool.
pub fn cumulus(seed: u32, resolution: u32) -> Dense {
    const FIRST_STREAM: u32 = 9; // makes seed 1 a handsome one
    let stream = seed.wrapping_add(FIRST_STREAM);
    let resolution = resolution.clamp(MIN_RESOLUTION, MAX_RESOLUTION);
    let cloud = skeleton(stream);
    let h = LONGEST_SIDE / resolution as f32;
    let size = (cloud.size / h).ceil().as_uvec3().min(UVec3::splat(resolution));
    let field = Field::new(stream, &cloud, size, h);

    let mut data = vec![0.0; size.x as usize * size.y as usize * size.z as usize];
    let row_blocks = size.y.div_ceil(BLOCK) as usize;
    // Rows of blocks along x: each is the y-range of one task in each of its z-layers.
    let mut rows: Vec<Vec<&mut [f32]>> = Vec::new();
    rows.resize_with(row_blocks * size.z.div_ceil(BLOCK) as usize, Vec::new);
    for (z, layer) in data.chunks_mut((size.x * size.y) as usize).enumerate() {
        for (y, strip) in layer.chunks_mut((size.x * BLOCK) as usize).enumerate() {
            rows[z / BLOCK as usize * row_blocks + y].push(strip);
        }
    }
    rows.into_par_iter().enumerate().for_each(|(i, mut strips)| {
        let from = UVec3::new(0, (i % row_blocks) as u32, (i / row_blocks) as u32) * BLOCK;
        for x in (0..size.x).step_by(BLOCK as usize) {
            field.block(&cloud.spheres, from.with_x(x), BLOCK, &mut |voxel, density| {
                let in_row = voxel - from;
                strips[in_row.z as usize][(in_row.y * size.x + in_row.x) as usize] = density;
            });
        }
    });

    let h = f64::from(LONGEST_SIDE) / f64::from(resolution);
    let first = (DVec3::ONE - size.as_dvec3()) * (0.5 * h);
    let world_from_index = DMat4::from_translation(first) * DMat4::from_scale(DVec3::splat(h));
    Dense { size, data, world_from_index, warnings: Vec::new() }
}

/// Octaves of billows.
const OCTAVES: usize = 5;
/// Features per world unit of the first octave, and the factor from one to the next.
const BILLOW_FREQUENCY: f32 = 8.0;
const BILLOW_LACUNARITY: f32 = 2.1;
/// What the billows are centred by, so that an octave left out moves the surface little on average. Their mean is 0.37,
/// so each octave moves it inwards by a twentieth of its amplitude: coarser grids hold a little more mass.
const BILLOW_CENTRE: f32 = 0.42;
/// Distance inside the skeleton below which nothing is displaced, world units (negative: inside).
const UNDISPLACED: f32 = -0.16;
/// Features per world unit of the three octaves of wisps, and their weights.
const WISPS: [(f32, f32); 3] = [(9.0, 1.0), (20.0, 0.6), (43.0, 0.35)];
/// Densities below this are 0.
const LEAST_DENSITY: f32 = 0.002;

/// How much of a noise of `frequency` features per world unit a grid of voxel size `h` can hold, 0 … 1.
fn resolvable(frequency: f32, h: f32) -> f32 {
    1.0 - smoothstep(0.3, 0.55, frequency * h)
}

/// The density as a function of place.
struct Field {
    /// Generator stream of the cloud; all noises derive their numbers from it.
    stream: u32,
    /// Height of the base, world space.
    base: f32,
    /// From the base to the top, world units.
    height: f32,
    /// Voxels of the grid.
    size: UVec3,
    /// Voxel side, world units.
    h: f32,
    /// How much of each octave of billows the voxels can hold.
    limits: [f32; OCTAVES],
    /// By how much at most the warped place moves per distance in a block.
    stretch: f32,
    /// Greatest blend width of any sphere.
    max_blend: f32,
    /// Warp and softness.
    lattice: Lattice,
}

impl Field {
    fn new(stream: u32, cloud: &Skeleton, size: UVec3, h: f32) -> Field {
        let mut frequency = BILLOW_FREQUENCY;
        let limits = std::array::from_fn(|_| {
            let limit = resolvable(frequency, h);
            frequency *= BILLOW_LACUNARITY;
            limit
        });
        Field {
            stream,
            base: cloud.base,
            height: cloud.top - cloud.base,
            size,
            h,
            limits,
            stretch: 1.0 + WARP_SLOPE * WARP.iter().map(|(amplitude, frequency)| amplitude * frequency).sum::<f32>(),
            max_blend: cloud.spheres.iter().map(|s| s.blend).fold(0.0, f32::max),
            lattice: Lattice::new(stream, 0.5 * h * size.as_vec3()),
        }
    }

    /// World position of the point `voxel` (in voxels, from the centre of the first one).
    fn place(&self, voxel: Vec3) -> Vec3 {
        (voxel + 0.5 - 0.5 * self.size.as_vec3()) * self.h
    }

    /// Writes the voxels above 0 of the block of `side` voxels with lowest voxel `from`. `spheres` holds all those that
    /// can matter in it.
    fn block(&self, spheres: &[Sphere], from: UVec3, side: u32, write: &mut impl FnMut(UVec3, f32)) {
        let to = (from + side).min(self.size);
        if from.cmpge(to).any() {
            return;
        }
        let extent = (to - from - 1).as_vec3() * 0.5;
        let centre = self.place(from.as_vec3() + extent);
        let warped = centre + self.lattice.at(centre).truncate();
        let reach = extent.length() * self.h * self.stretch;
        let Some(spheres) = self.near(spheres, warped, reach) else { return };
        if side > PART && !spheres.is_empty() {
            for i in 0..8 {
                let part = UVec3::new(i & 1, i >> 1 & 1, i >> 2) * PART;
                self.block(&spheres, from + part, PART, write);
            }
            return;
        }
        for z in from.z..to.z {
            for y in from.y..to.y {
                for x in from.x..to.x {
                    let voxel = UVec3::new(x, y, z);
                    let density = self.density(&spheres, self.place(voxel.as_vec3()));
                    if density > 0.0 {
                        write(voxel, density);
                    }
                }
            }
        }
    }

    /// Those of `spheres` that can matter within `reach` of the warped place `p`: none of them if all of it is deep
    /// inside, `None` if all of it is outside the cloud. The others leave the distance as it is.
    fn near(&self, spheres: &[Sphere], p: Vec3, reach: f32) -> Option<Vec<Sphere>> {
        const SOLID: f32 = -0.26;
        const OUTSIDE: f32 = 0.12; // the displacement that occurs
        let distance = |s: &Sphere| (p - s.centre).length() - s.radius;
        let upper = spheres.iter().map(distance).fold(f32::INFINITY, f32::min) + reach;
        if upper < SOLID {
            return Some(Vec::new());
        }
        let matters = |s: &&Sphere| distance(s) - reach < upper.min(OUTSIDE) + s.blend + self.max_blend;
        let near: Vec<Sphere> = spheres.iter().filter(matters).copied().collect();
        if near.is_empty() { None } else { Some(near) }
    }

    /// Density at `p`, 0 … 1; no spheres stand for "deep inside".
    fn density(&self, spheres: &[Sphere], p: Vec3) -> f32 {
        const DEEP: Distance = Distance { value: -0.4, gradient: Vec3::ZERO, radius: 0.0 };
        let fetched = self.lattice.at(p);
        let warped = p + fetched.truncate();
        let height = (p.y - self.base) / self.height;
        let distance = if spheres.is_empty() { DEEP } else { Distance::at(spheres, warped) };

        let mut depth = self.displacement(&distance, warped, height) - distance.value;
        let mut soft = 0.0;
        if depth > -0.08 && depth < 0.12 {
            soft = smoothstep(-0.15, 0.55, fetched.w - 0.9 * (height - 0.35));
            if soft > 0.02 {
                depth += soft * 0.05 * (self.wisps(warped) - 0.25);
            }
        }
        // At least a voxel wide, and widened to both sides so that the mass stays.
        let sharp_edge = 0.008 + 0.082 * (soft * soft);
        let edge = sharp_edge.max(self.h);
        depth += (edge - sharp_edge) / 2.0;
        if depth <= 0.0 {
            return 0.0;
        }
        let core = smoothstep(0.0, edge, depth);
        let inwards = 0.4 + 0.6 * smoothstep(0.0, 0.22, depth);
        let upwards = 0.4 + 0.6 * smoothstep(0.0, 0.6, height);
        let ragged = 0.04 * gradient(4.0 * p, self.noise(9)) + 0.02 * gradient(11.0 * p, self.noise(10));
        let density = core * inwards * upwards * smoothstep(-0.01, 0.10, p.y - self.base + ragged);
        if density < LEAST_DENSITY { 0.0 } else { density }
    }

    /// The number of gradient noise `i` of this cloud.
    fn noise(&self, i: u32) -> u32 {
        self.stream.wrapping_mul(7).wrapping_add(i)
    }

    /// By how much the surface moves outwards at the warped place `p`, in world units.
    fn displacement(&self, distance: &Distance, p: Vec3, height: f32) -> f32 {
        const SHIFT: Vec3 = Vec3::new(17.3, 5.1, 11.7); // between the lattices of the octaves
        let d = distance.value;
        if d <= UNDISPLACED {
            return 0.0;
        }
        let strength = (distance.radius / 0.12).clamp(0.35, 1.5)
            * (0.6 + 0.4 * smoothstep(0.0, 0.35, height))
            * smoothstep(UNDISPLACED, -0.08, d);
        let mut amplitude = 0.05 * strength;
        let mut frequency = BILLOW_FREQUENCY;
        let mut weight = 1.0f32;
        let mut out = 0.0;
        let mut q = p - 0.3 * d * distance.gradient; // part of the way onto the surface
        for (o, limit) in self.limits.into_iter().enumerate() {
            // Neither this octave nor a later one can be held, reaches the surface, or is near enough to it.
            let invisible = 8.0 * amplitude;
            if limit <= 0.0 || d - out > 2.5 * amplitude + 0.09 || out - d >= invisible {
                break;
            }
            let octave = o as u32;
            let number = self.stream.wrapping_mul(131).wrapping_add(octave);
            let b = billow(q * frequency + o as f32 * SHIFT, number);
            let seen = limit * (1.0 - smoothstep(4.0 * amplitude, invisible, out - d));
            out += amplitude * weight * (b.value - BILLOW_CENTRE) * seen;
            weight = (weight * (0.5 + 0.9 * b.value)).min(1.3); // bumps carry more bumps, creases stay clean
            let byte = |i: u32| (b.hash >> (8 * i) & 255) as f32 - 127.5;
            let axis = Vec3::new(byte(0), byte(1), byte(2)) / 128.0;
            q += axis.cross(b.offset) * (0.5 * b.value / frequency); // each lobe rolls about its own axis
            amplitude *= 0.65;
            frequency *= BILLOW_LACUNARITY;
        }
        out
    }

    /// The noise that frays soft edges, at the warped place `p`.
    fn wisps(&self, p: Vec3) -> f32 {
        let octave = |i: usize| {
            let (frequency, weight) = WISPS[i];
            weight * gradient(frequency * p, self.noise(13 + i as u32))
        };
        octave(0) + octave(1) + octave(2) * resolvable(WISPS[2].0, self.h)
    }
}

/// The signed distance to a union of spheres and what else blends with it.
struct Distance {
    /// World units, negative inside.
    value: f32,
    /// About a unit vector, outwards.
    gradient: Vec3,
    /// Radius of the spheres near by, world units.
    radius: f32,
}

impl Distance {
    /// The polynomial smooth minimum (I. Quilez) of the distances to `spheres`, each with its own width, in order.
    fn at(spheres: &[Sphere], p: Vec3) -> Distance {
        let mut d = Distance { value: f32::INFINITY, gradient: Vec3::ZERO, radius: 0.0 };
        for s in spheres {
            let v = p - s.centre;
            let squared = v.length_squared();
            let matters = d.value + s.blend + s.radius;
            if matters <= 0.0 || squared >= matters * matters {
                continue; // farther than the rest by its blend width: changes nothing
            }
            let length = squared.sqrt();
            let e = length - s.radius;
            let gradient = v / length.max(f32::MIN_POSITIVE);
            if d.value - e >= s.blend {
                // Assigned, not blended with weight 1: what came before must leave no trace in the last bits, since a
                // culled list does not hold it.
                d = Distance { value: e, gradient, radius: s.radius };
            } else {
                let t = (0.5 + (d.value - e) / (2.0 * s.blend)).clamp(0.0, 1.0);
                d.value += (e - d.value) * t - s.blend * t * (1.0 - t);
                d.gradient += (gradient - d.gradient) * t;
                d.radius += (s.radius - d.radius) * t;
            }
        }
        d
    }
}

/// Smooth noises, stored on a lattice fixed in the world and fetched trilinearly: the same at every resolution.
struct Lattice {
    /// Lattice coordinates of the first point.
    origin: glam::IVec3,
    /// Points along x, y, z.
    size: UVec3,
    /// Warp (xyz, world units) and softness (w) of each point, x fastest.
    points: Vec<Vec4>,
}

impl Lattice {
    /// Points per world unit.
    const DENSITY: f32 = 32.0;

    /// A lattice that covers −`half` … `half`.
    fn new(stream: u32, half: Vec3) -> Lattice {
        let origin = (-half * Lattice::DENSITY).floor().as_ivec3();
        let size = (1 - 2 * origin).as_uvec3() + 1;
        let number = |i: u32| stream.wrapping_mul(7).wrapping_add(i);
        let points = (0..size.x * size.y * size.z)
            .into_par_iter()
            .map(|i| {
                let at = UVec3::new(i % size.x, i / size.x % size.y, i / (size.x * size.y));
                let p = (origin + at.as_ivec3()).as_vec3() / Lattice::DENSITY;
                let three = |(amplitude, frequency): (f32, f32), first: u32| {
                    let q = frequency * p;
                    let axis = |i: u32| gradient(q, number(first + i));
                    amplitude * Vec3::new(axis(0), axis(1), axis(2))
                };
                let softness = gradient(1.9 * p, number(11)) + 0.3 * gradient(5.0 * p, number(12));
                (three(WARP[0], 1) + three(WARP[1], 4)).extend(softness)
            })
            .collect();
        Lattice { origin, size, points }
    }

    /// Warp and softness at world position `p` inside the lattice.
    fn at(&self, p: Vec3) -> Vec4 {
        let q = p * Lattice::DENSITY - self.origin.as_vec3();
        let floor = q.floor();
        let cell = floor.as_uvec3();
        let t = q - floor;
        let lerp = |a: Vec4, b: Vec4, t: f32| a + (b - a) * t;
        let row = |y: u32, z: u32| {
            let i = (cell.x + self.size.x * (cell.y + y + self.size.y * (cell.z + z))) as usize;
            lerp(self.points[i], self.points[i + 1], t.x)
        };
        let face = |z: u32| lerp(row(0, z), row(1, z), t.y);
        lerp(face(0), face(1), t.z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bits(cloud: &Dense) -> Vec<u32> {
        cloud.data.iter().map(|v| v.to_bits()).collect()
    }

    /// Integral of the density, world units³.
    fn mass(cloud: &Dense) -> f64 {
        cloud.data.iter().map(|&v| f64::from(v)).sum::<f64>() * cloud.world_from_index.determinant()
    }

    #[test]
    fn culling_leaves_the_bits_alone() {
        // Blocks all over a grid, against all spheres for every other voxel.
        let cloud = skeleton(12);
        for (resolution, stride) in [(512, 7), (64, 1)] {
            let h = LONGEST_SIDE / resolution as f32;
            let size = (cloud.size / h).ceil().as_uvec3();
            let field = Field::new(12, &cloud, size, h);
            let mut filled = 0;
            let blocks = size / (stride * BLOCK);
            for i in 0..blocks.x * blocks.y * blocks.z {
                let block = UVec3::new(i % blocks.x, i / blocks.x % blocks.y, i / (blocks.x * blocks.y));
                let from = block * stride * BLOCK;
                let mut found = [0.0; 512];
                let index = |voxel: UVec3| (voxel - from).dot(UVec3::new(1, 8, 64)) as usize;
                field.block(&cloud.spheres, from, BLOCK, &mut |voxel, density| found[index(voxel)] = density);
                for j in (0..512).step_by(3) {
                    let voxel = from + UVec3::new(j % 8, j / 8 % 8, j / 64);
                    let density = field.density(&cloud.spheres, field.place(voxel.as_vec3()));
                    assert_eq!(density.to_bits(), found[index(voxel)].to_bits(), "{voxel} of {size}");
                    filled += u32::from(density > 0.0);
                }
            }
            assert!(filled > 1000, "{filled} voxels");
        }
    }

    #[test]
    fn threads_leave_the_bits_alone() {
        let on = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            pool.install(|| bits(&cumulus(1, 48)))
        };
        assert_eq!(on(1), on(3));
    }

    #[test]
    fn bits_stay_from_build_to_build() {
        // FNV-1a over the bits: pictures and caches rely on a seed meaning one cloud.
        let hash = bits(&cumulus(1, 32))
            .into_iter()
            .fold(0xcbf2_9ce4_8422_2325u64, |h, b| (h ^ u64::from(b)).wrapping_mul(0x0100_0000_01b3));
        assert_eq!(hash, 0x1211_d9b1_8ff3_8fcc, "{hash:#x}");
    }

    #[test]
    fn the_box_is_that_of_the_contract() {
        let cloud = cumulus(1, 64);
        assert_eq!(cloud.size, UVec3::new(64, 42, 54));
        let corners = cloud.corners();
        assert_eq!((corners[0] + corners[7]).length(), 0.0);
        assert_eq!(corners[7].x - corners[0].x, 2.0);
        assert!(cloud.data.iter().all(|v| (0.0..=1.0).contains(v)) && cloud.max() > 0.5, "{}", cloud.max());
        assert_ne!(bits(&cloud), bits(&cumulus(2, 64)));
        // The flat base is down: the lowest filled layer is wide, the highest narrow.
        let layer =
            |y: u32| (0..64 * 54).filter(|i| cloud.data[(i % 64 + 64 * (y + 42 * (i / 64))) as usize] > 0.0).count();
        let filled: Vec<usize> = (0..42).map(layer).filter(|&n| n > 0).collect();
        assert!(filled[2] > 20 * filled[filled.len() - 2], "{filled:?}");
    }

    #[test]
    fn resolutions_show_the_same_cloud() {
        let (fine, coarse) = (cumulus(1, 128), cumulus(1, 64));
        let ratio = mass(&coarse) / mass(&fine);
        assert!((ratio - 1.043).abs() < 0.01, "mass {ratio}"); // the recipe: 1.067 / 1.023
        // Box-filter the finer grid at the coarse voxels' places; boxes nest up to half a voxel.
        let (mut sums, mut n) = ([0.0f64; 5], 0.0f64);
        let index_from_world = fine.world_from_index.inverse();
        for (i, &value) in coarse.data.iter().enumerate() {
            let i = i as u32;
            let voxel = UVec3::new(i % 64, i / 64 % coarse.size.y, i / (64 * coarse.size.y));
            let low = index_from_world.transform_point3(coarse.world_from_index.transform_point3(voxel.as_dvec3()));
            let mut mean = 0.0;
            for j in 0..8u32 {
                let at = (low - 0.5 + UVec3::new(j & 1, j >> 1 & 1, j >> 2).as_dvec3()).round().as_uvec3();
                let at = at.min(fine.size - 1);
                mean += f64::from(fine.data[(at.x + fine.size.x * (at.y + fine.size.y * at.z)) as usize]) / 8.0;
            }
            let value = f64::from(value);
            for (sum, term) in sums.iter_mut().zip([value, mean, value * value, mean * mean, value * mean]) {
                *sum += term;
            }
            n += 1.0;
        }
        let [a, b, aa, bb, ab] = sums.map(|s| s / n);
        let correlation = (ab - a * b) / ((aa - a * a) * (bb - b * b)).sqrt();
        assert!(correlation > 0.98, "correlation {correlation}");
    }
}
