//! The density field of a scene on the CPU: read, made or given by a formula, and placed in the world.

use glam::{DMat4, DVec3};

use crate::error::{Error, Result, Warning};
use crate::io::volume_file;
use crate::scene::{Analytic, Scene, Source, Volume};
use crate::volume::densify::densify;
use crate::volume::{Dense, procedural};

/// Most voxels that are read without being asked to resample: 2 GiB of 32-bit floats.
const MAX_VOXELS: u64 = 1 << 29;
/// Where an infinite side of an analytic box is put, in its own units.
const FAR: f64 = 1e30;

/// What the density is.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Voxels.
    Dense(Dense),
    /// A formula in a box, sides may be infinite.
    Analytic {
        /// The formula.
        profile: Profile,
        /// Lowest corner.
        low: DVec3,
        /// Highest corner.
        high: DVec3,
    },
}

/// Density of an analytic volume.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Profile {
    /// 1 everywhere.
    Constant,
    /// Linear along an axis, between the values at the lower and the upper face.
    Linear(usize, [f64; 2]),
    /// exp(−h / H), h from the lower face along an axis; H is given.
    Exponential(usize, f64),
}

impl Profile {
    fn of(volume: &Volume) -> Profile {
        let axis = volume.axis as usize;
        match volume.analytic {
            Analytic::Linear => Profile::Linear(axis, volume.density.0),
            Analytic::Exponential => Profile::Exponential(axis, volume.scale_height),
            Analytic::None | Analytic::Homogeneous => Profile::Constant,
        }
    }

    /// The greatest density.
    pub fn max(&self) -> f64 {
        match self {
            Profile::Linear(_, [a, b]) => a.max(*b),
            Profile::Constant | Profile::Exponential(..) => 1.0,
        }
    }

    /// Gradient and offset of the affine function that the shaders' formula takes (shaders/medium/profile.wgsl).
    pub fn affine(&self, low: DVec3, high: DVec3) -> (DVec3, f64) {
        let (axis, start, slope) = match *self {
            Profile::Constant => return (DVec3::ZERO, 1.0),
            Profile::Linear(axis, [a, b]) => {
                let max = if a.max(b) > 0.0 { a.max(b) } else { 1.0 };
                (axis, a / max, (b - a) / (max * (high[axis] - low[axis])))
            }
            Profile::Exponential(axis, height) => (axis, 0.0, 1.0 / height),
        };
        (DVec3::AXES[axis] * slope, start - slope * low[axis])
    }

    /// Density at a point of the box.
    fn at(&self, p: DVec3, low: DVec3, high: DVec3) -> f64 {
        let (gradient, offset) = self.affine(low, high);
        let x = gradient.dot(p) + offset;
        match self {
            Profile::Constant | Profile::Linear(..) => x * self.max(),
            Profile::Exponential(..) => (-x).exp(),
        }
    }

    /// Mean of ∫ density dh over the columns along `axis`, for a box of these sides; infinite ones are not finite.
    fn column(&self, axis: usize, side: DVec3) -> f64 {
        let mean = match *self {
            Profile::Constant => 1.0,
            Profile::Linear(_, [a, b]) => 0.5 * (a + b),
            Profile::Exponential(along, height) => {
                let share = height / side[along] * (1.0 - (-side[along] / height).exp());
                if along == axis && side[along].is_infinite() { return height } else { share }
            }
        };
        mean * side[axis]
    }
}

/// A density field with its place in the world.
#[derive(Clone, Debug)]
pub struct Field {
    /// What the density is.
    pub shape: Shape,
    /// World from the file's own world.
    pub to_world: DMat4,
    /// Whether the nearest voxel counts, rather than interpolation.
    pub nearest: bool,
    /// Names of the grids that the file offers, the one in use first to find by `grid`.
    pub grids: Vec<String>,
    /// The grid in use, by its unique name; empty where there is no file.
    pub grid: String,
    /// What was noticed on the way.
    pub warnings: Vec<Warning>,
}

impl Field {
    /// Reads or makes the field that `volume` names. Slow: call it off the window's thread.
    pub fn load(volume: &Volume) -> Result<Field> {
        let nearest = volume.filter == crate::scene::Filter::Nearest;
        let mut field = Field {
            shape: Shape::Dense(Dense::empty(Vec::new())),
            to_world: volume.to_world.to_mat(),
            nearest,
            grids: Vec::new(),
            grid: String::new(),
            warnings: Vec::new(),
        };
        match volume.source() {
            Source::Analytic => {
                let [low, high] = volume.bounds.0;
                field.shape = Shape::Analytic { profile: Profile::of(volume), low, high };
            }
            Source::Cumulus { seed, resolution } => {
                field.shape = Shape::Dense(procedural::cumulus(seed, resolution));
            }
            Source::File(path) => {
                let file = volume_file::open(std::path::Path::new(&path))?;
                let wanted = (!volume.grid.is_empty()).then_some(volume.grid.as_str());
                field.warnings.extend(file.warnings.iter().cloned());
                field.grids = file.grids.iter().filter(|e| e.grid.is_ok()).map(|e| e.unique_name.clone()).collect();
                if file.grids.is_empty() {
                    field.shape = Shape::Dense(Dense::empty(Vec::new()));
                    return Ok(field);
                }
                let (index, warnings) = file.select(wanted)?;
                field.warnings.extend(warnings);
                let entry = &file.grids[index];
                field.grid = entry.unique_name.clone();
                let grid = entry.grid.as_ref().map_err(Error::clone)?;
                let dense = densify(grid, &entry.unique_name, volume.max_resolution, MAX_VOXELS)?;
                field.warnings.extend(dense.warnings.iter().cloned());
                field.shape = Shape::Dense(dense);
            }
        }
        Ok(field)
    }

    /// Local space (see shaders/core/params.wgsl) from the scene's world.
    pub fn local_from_world(&self) -> DMat4 {
        match &self.shape {
            // One texel of border, and texel centres at halves.
            Shape::Dense(dense) => {
                DMat4::from_translation(DVec3::splat(1.5)) * (self.to_world * dense.world_from_index).inverse()
            }
            Shape::Analytic { .. } => self.to_world.inverse(),
        }
    }

    /// The support of the field in local space.
    pub fn local_box(&self) -> (DVec3, DVec3) {
        match &self.shape {
            Shape::Dense(dense) => {
                // Interpolation reaches the border's centres; the nearest voxel, only its own cell.
                let inset = if self.nearest { 1.0 } else { 0.5 };
                (DVec3::splat(inset), dense.size.as_dvec3() + 2.0 - inset)
            }
            Shape::Analytic { low, high, .. } => {
                (low.clamp(DVec3::splat(-FAR), DVec3::splat(FAR)), high.clamp(DVec3::splat(-FAR), DVec3::splat(FAR)))
            }
        }
    }

    /// The world box of the voxels' cells; of an analytic box, with infinite sides taken as ±1.
    pub fn world_box(&self) -> (DVec3, DVec3) {
        let corners: [DVec3; 8] = match &self.shape {
            Shape::Dense(dense) => dense.corners().map(|p| self.to_world.transform_point3(p)),
            Shape::Analytic { low, high, .. } => {
                let finite =
                    |p: DVec3, end: f64| DVec3::from(p.to_array().map(|x| if x.is_finite() { x } else { end }));
                let (low, high) = (finite(*low, -1.0), finite(*high, 1.0));
                std::array::from_fn(|i| {
                    let pick = |axis: usize| if i >> axis & 1 == 0 { low[axis] } else { high[axis] };
                    self.to_world.transform_point3(DVec3::new(pick(0), pick(1), pick(2)))
                })
            }
        };
        let low = corners.iter().copied().fold(DVec3::INFINITY, DVec3::min);
        let high = corners.iter().copied().fold(DVec3::NEG_INFINITY, DVec3::max);
        (low, high)
    }

    /// The greatest density.
    pub fn max(&self) -> f64 {
        match &self.shape {
            Shape::Dense(dense) => f64::from(dense.max()),
            Shape::Analytic { profile, .. } => profile.max(),
        }
    }

    /// The distance from `origin` along unit vector `direction` (world space) at which half of the light is left, for
    /// an extinction of `scale` per density; `None` where more than that gets through.
    pub fn median_depth(&self, origin: DVec3, direction: DVec3, scale: f64) -> Option<f64> {
        /// Steps through the support.
        const STEPS: u32 = 512;
        let local = self.local_from_world();
        let (o, d) = (local.transform_point3(origin), local.transform_vector3(direction));
        let (low, high) = self.local_box();
        let (a, b) = ((low - o) / d, (high - o) / d);
        let near = a.min(b).max_element().max(0.0);
        let far = a.max(b).min_element();
        if !(near < far && far.is_finite()) {
            return None;
        }
        let step = (far - near) / f64::from(STEPS);
        let mut depth = 0.0;
        for i in 0..STEPS {
            let t = near + (f64::from(i) + 0.5) * step;
            depth += self.density_near(o + d * t) * scale * step;
            if depth > std::f64::consts::LN_2 {
                return Some(t);
            }
        }
        None
    }

    /// Density of the voxel nearest to a point in local space.
    fn density_near(&self, p: DVec3) -> f64 {
        match &self.shape {
            Shape::Analytic { profile, low, high } => profile.at(p, *low, *high),
            Shape::Dense(dense) => {
                let index = (p - 1.0).floor();
                let inside = index.cmpge(DVec3::ZERO).all() && index.cmplt(dense.size.as_dvec3()).all();
                if !inside {
                    return 0.0;
                }
                let i = index.as_usizevec3();
                let size = dense.size.as_usizevec3();
                f64::from(dense.data[i.x + size.x * (i.y + size.y * i.z)])
            }
        }
    }

    /// The mean of ∫ density dt over the columns along the three axes that hold any density (of an analytic box: over
    /// its finite sides), in density · world units; `None` where there is none.
    pub fn mean_column(&self) -> Option<f64> {
        let to_world = glam::DMat3::from_mat4(self.to_world);
        match &self.shape {
            Shape::Analytic { profile, low, high } => {
                let side = *high - *low;
                let finite: Vec<f64> = (0..3)
                    .map(|axis| to_world.col(axis).length() * profile.column(axis, side))
                    .filter(|&column| column.is_finite() && column > 0.0)
                    .collect();
                (!finite.is_empty()).then(|| finite.iter().sum::<f64>() / finite.len() as f64)
            }
            Shape::Dense(dense) => {
                let linear = to_world * glam::DMat3::from_mat4(dense.world_from_index);
                let size = dense.size.as_usizevec3();
                let mut columns =
                    [vec![0.0f64; size.y * size.z], vec![0.0; size.x * size.z], vec![0.0; size.x * size.y]];
                for (row, line) in dense.data.chunks_exact(size.x).enumerate() {
                    let (y, z) = (row % size.y, row / size.y);
                    for (x, &d) in line.iter().enumerate() {
                        let d = f64::from(d);
                        columns[0][row] += d;
                        columns[1][x + size.x * z] += d;
                        columns[2][x + size.x * y] += d;
                    }
                }
                let mut sum = 0.0;
                let mut count = 0u64;
                for (axis, column) in columns.iter().enumerate() {
                    let length = linear.col(axis).length();
                    for &c in column.iter().filter(|&&c| c > 0.0) {
                        sum += c * length;
                        count += 1;
                    }
                }
                (count > 0).then(|| sum / count as f64)
            }
        }
    }
}

/// Mean optical thickness that `density_scale = "auto"` gives the columns.
const AUTO_THICKNESS: f64 = 40.0;

/// The density scale of a scene with "auto" resolved, from [`Field::mean_column`].
pub fn density_scale(scene: &Scene, mean_column: Option<f64>) -> f64 {
    scene.medium.density_scale.unwrap_or_else(|| {
        let colour = scene.medium.extinction.0.iter().sum::<f64>() / 3.0;
        match mean_column {
            Some(column) if column * colour > 0.0 => AUTO_THICKNESS / (column * colour),
            _ => 1.0,
        }
    })
}
