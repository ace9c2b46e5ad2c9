//! The skeleton of a cumulus: towers of spheres, then three generations of turrets on whatever surface is exposed.

use glam::{Vec2, Vec3};

use super::noise::Random;

/// A sphere of the skeleton.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    /// Centre, world space.
    pub centre: Vec3,
    /// Radius, world units.
    pub radius: f32,
    /// Width over which it blends into the spheres before it, world units.
    pub blend: f32,
}

/// The spheres of a cloud in the order in which they blend, in a box with centre 0 and longest side [`LONGEST_SIDE`].
#[derive(Clone, Debug, PartialEq)]
pub struct Skeleton {
    /// Parents before children.
    pub spheres: Vec<Sphere>,
    /// Height of the flat base, world space.
    pub base: f32,
    /// Height of the topmost point of any sphere, world space.
    pub top: f32,
    /// Sides of the box, world units.
    pub size: Vec3,
}

/// Longest side of the cloud's box, world units.
pub const LONGEST_SIDE: f32 = 2.0;

// Lengths below are before the cloud is scaled to its box.
const BASE: f32 = -0.52;
const TOWERS: usize = 10;
/// Height of the tallest tower.
const HEIGHT: f32 = 0.60;
/// How far the wind carries a top along x.
const LEAN: f32 = 0.18;
/// Half axes of the ellipse that the towers stand in.
const FOOTPRINT: Vec2 = Vec2::new(0.80, 0.50);
/// Cosine and sine of the golden angle.
const GOLDEN_ANGLE: Vec2 = Vec2::new(-0.737_369, 0.675_490);
/// A place is taken without regard to its neighbours after so many tries.
const TRIES: usize = 300;

const CHILDREN: usize = 9;
/// Size of a child relative to its parent, one a generation.
const GENERATIONS: [f32; 3] = [0.60, 0.50, 0.50];

struct Tower {
    place: Vec2,
    height: f32,
    radius: f32,
}

/// The skeleton for generator stream `stream`.
pub fn skeleton(stream: u32) -> Skeleton {
    let mut random = Random::new(stream);
    let mut spheres = Vec::new();
    for tower in towers(&mut random) {
        column(&tower, &mut random, &mut spheres);
    }
    let mut parents = 0..spheres.len();
    for ratio in GENERATIONS {
        let elders = spheres.len();
        for parent in parents {
            turrets(parent, elders, ratio, &mut random, &mut spheres);
        }
        parents = elders..spheres.len();
    }
    normalised(spheres)
}

/// Places on a golden-angle spiral, so that the footprint is wide whatever the seed; the first is the tallest.
fn towers(random: &mut Random) -> Vec<Tower> {
    let d = random.direction();
    let mut w = Vec2::new(d.x, d.z).normalize();
    let mut towers: Vec<Tower> = Vec::with_capacity(TOWERS);
    for i in 0..TOWERS {
        let mut tries = 0;
        loop {
            w = GOLDEN_ANGLE.rotate(w);
            let spiral = (i as f32 / (TOWERS - 1) as f32).sqrt();
            let out = spiral * (0.85 + 0.3 * (random.next() - 0.5));
            let place = out * w * FOOTPRINT;
            let relative = if i == 0 {
                1.0
            } else {
                let u = random.next();
                (0.22 + 0.78 * u * u.sqrt()) * (1.0 - 0.6 * (out * out).min(1.0))
            };
            let radius = 0.12 + 0.13 * relative;
            tries += 1;
            let apart = |other: &Tower| (other.place - place).length() >= 0.5 * (radius + other.radius);
            if tries >= TRIES || towers.iter().all(apart) {
                towers.push(Tower { place, height: relative * HEIGHT, radius });
                break;
            }
        }
    }
    towers
}

/// Stacks the spheres of a tower, thinner towards its top, swaying and leaning with the wind.
fn column(tower: &Tower, random: &mut Random, spheres: &mut Vec<Sphere>) {
    let mut y = BASE + 0.35 * tower.radius;
    let mut sway = Vec2::ZERO;
    loop {
        let of_tower = ((y - BASE) / tower.height).min(1.0);
        let of_cloud = ((y - BASE) / HEIGHT).min(1.0);
        let radius = tower.radius * (1.12 - 0.42 * of_tower) * (0.85 + 0.3 * random.next());
        let x = tower.place.x + sway.x + LEAN * of_cloud * of_cloud;
        let centre = Vec3::new(x, y, tower.place.y + sway.y);
        spheres.push(Sphere { centre, radius, blend: 0.25 * radius });
        if y + 0.9 * radius >= BASE + tower.height {
            return;
        }
        y += 0.65 * radius;
        sway.x += (2.0 * random.next() - 1.0) * 0.3 * tower.radius;
        sway.y += (2.0 * random.next() - 1.0) * 0.3 * tower.radius;
    }
}

/// Grows the children of sphere `parent`; those that would be hidden inside the first `elders` spheres are left out.
fn turrets(parent: usize, elders: usize, ratio: f32, random: &mut Random, spheres: &mut Vec<Sphere>) {
    const UPWARDS: Vec3 = Vec3::new(0.0, 0.40, 0.0);
    const HIDDEN: f32 = 0.25;
    let Sphere { centre: origin, radius: size, .. } = spheres[parent];
    for _ in 0..CHILDREN {
        let d = (random.direction() + UPWARDS).normalize();
        let u = random.next();
        let s = ratio * (0.5 + 0.9 * u * u); // many small, few big
        let radius = size * s * (0.85 + 0.25 * d.y);
        let out = (1.12 - 0.2 * s + 0.15 * random.next()).min(1.0 + 0.45 * s); // the cap keeps small ones attached
        let centre = origin + d * (size * out);
        let deep = |elder: &Sphere| (centre - elder.centre).length() - elder.radius < -HIDDEN * radius;
        if centre.y >= BASE + 0.3 * radius && !spheres[..elders].iter().any(deep) {
            spheres.push(Sphere { centre, radius, blend: 0.15 * radius });
        }
    }
}

/// Scales and moves the cloud into its box.
fn normalised(mut spheres: Vec<Sphere>) -> Skeleton {
    const MARGIN: f32 = 0.07;
    const MARGIN_BELOW: f32 = 0.06;
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for sphere in &spheres {
        low = low.min(sphere.centre - sphere.radius);
        high = high.max(sphere.centre + sphere.radius);
    }
    let top = high.y;
    low -= MARGIN;
    low.y = BASE - MARGIN_BELOW;
    high += MARGIN;
    let size = high - low;
    let centre = low + 0.5 * size;
    let scale = LONGEST_SIDE / size.max_element();
    for sphere in &mut spheres {
        sphere.centre = (sphere.centre - centre) * scale;
        sphere.radius *= scale;
        sphere.blend *= scale;
    }
    Skeleton { spheres, base: (BASE - centre.y) * scale, top: (top - centre.y) * scale, size: size * scale }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_cloud_is_that_of_the_recipe() {
        let first = skeleton(10);
        assert_eq!(first.spheres.len(), 2447);
        let voxels = first.size * (512.0 / LONGEST_SIDE);
        assert!((voxels.y.ceil(), voxels.z.ceil()) == (335.0, 425.0), "{voxels}");
    }

    #[test]
    fn every_cloud_fills_its_box_and_stands_on_its_base() {
        for stream in 0..40 {
            let Skeleton { spheres, base, top, size } = skeleton(stream);
            assert!((1000..3000).contains(&spheres.len()), "{} spheres", spheres.len());
            assert!((size.max_element() - LONGEST_SIDE).abs() < 1e-5 && size.y < LONGEST_SIDE, "{size}");
            assert!(-size.y / 2.0 < base && base < top && top < size.y / 2.0, "{base} {top} {size}");
            for s in &spheres {
                assert!(s.radius > 0.0 && s.blend > 0.0 && s.centre.y > base);
                let reach = s.centre.abs() + s.radius;
                assert!(reach.x < size.x / 2.0 && reach.z < size.z / 2.0 && s.centre.y + s.radius < size.y / 2.0);
            }
        }
    }
}
