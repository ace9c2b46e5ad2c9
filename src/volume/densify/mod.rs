//! From a sparse grid to the dense box of densities that is drawn, by the rules of the scene contract (§1).

use glam::DMat4;
use rayon::prelude::*;

use self::fill::fill;
use self::frame::Frame;
use super::Dense;
use super::grid::{Class, Grid, Values};
use crate::error::{Result, Warning};

mod fill;
mod frame;
#[cfg(test)]
mod tests;

/// Width of a level set's ramp, in voxels, where its background does not give one.
const RAMP_VOXELS: f64 = 3.0;

/// Makes the dense box of the active voxels of `grid`, called `name` in messages.
///
/// A voxel's density is its stored value, active or not; values that are not finite, negative or beyond `f32` are 0
/// (warning `bad_values`). A level set becomes `clamp(−d / w, 0, 1)` with `w` the background, or three voxels where
/// that is not positive and finite (warning `level_set`). What lies outside the box is lost (warning `background` where that is
/// not 0). A grid with no active voxel or no density is [`Dense::empty`] (warning `empty_grid`).
///
/// With a `max_resolution` other than 0, a box with a longer side is resampled to cubes as good as its sides allow, of
/// which no side has more: each new voxel is the mean over its part of the box, so the integral stays and the faces
/// of the box stay where they are. That takes memory for the new voxels only.
///
/// # Errors
/// [`Code::TooLarge`] for a result of more than `max_voxels`.
pub fn densify(grid: &Grid, name: &str, max_resolution: u32, max_voxels: u64) -> Result<Dense> {
    let Some(bounds) = grid.active_box() else {
        return Ok(Dense::empty(vec![empty(name, "has no active voxels")]));
    };
    let frame = Frame::new(&bounds, max_resolution);
    let size = frame.affordable(name, max_voxels)?;
    let density = Density::of(grid);
    let (data, bad) = match &grid.values {
        Values::F32(values) => fill(grid, values, &frame, &density),
        Values::F64(values) => fill(grid, values, &frame, &density),
    };
    let mut warnings = density.warnings(grid, name, bad);
    if data.par_iter().all(|&value| value == 0.0) {
        warnings.push(empty(name, "holds no density above zero"));
        return Ok(Dense::empty(warnings));
    }
    Ok(Dense { size, data, world_from_index: grid.world_from_index * frame.index_from_new(), warnings })
}

fn empty(name: &str, why: &str) -> Warning {
    Warning { code: "empty_grid", text: format!("The grid {name:?} {why}: there is nothing to see.") }
}

/// How stored values become densities.
struct Density {
    /// Distance over which a level set goes from 0 to 1; `None`: values are densities.
    ramp: Option<f64>,
    /// Density of the background.
    background: f32,
}

impl Density {
    fn of(grid: &Grid) -> Density {
        let ramp = (grid.class == Class::LevelSet).then(|| {
            let given = grid.background > 0.0 && grid.background.is_finite();
            if given { grid.background } else { RAMP_VOXELS * mean_voxel_size(&grid.world_from_index) }
        });
        let mut density = Density { ramp, background: 0.0 };
        density.background = density.at(grid.background);
        density
    }

    /// The density for a stored value.
    fn at(&self, value: f64) -> f32 {
        match self.ramp {
            _ if self.is_bad(value) => 0.0,
            Some(ramp) => (-value / ramp).clamp(0.0, 1.0) as f32,
            None => value as f32,
        }
    }

    /// Whether a value cannot stand for a density.
    fn is_bad(&self, value: f64) -> bool {
        match self.ramp {
            // The quotient, so that a ramp of no width makes nothing worse.
            Some(ramp) => !(value / ramp).is_finite(),
            // As 32 bits, so that what overflows there counts.
            None => !(value as f32).is_finite() || value < 0.0,
        }
    }

    fn warnings(&self, grid: &Grid, name: &str, bad: u64) -> Vec<Warning> {
        let mut warnings = Vec::new();
        let mut warn = |code, text| warnings.push(Warning { code, text });
        if let Some(ramp) = self.ramp {
            let text =
                format!("The grid {name:?} is a level set: drawn as a fog that reaches 1 at {ramp} below its surface.");
            warn("level_set", text);
        }
        let outside = if self.ramp.is_some() { self.background.into() } else { grid.background };
        if outside != 0.0 {
            let text = format!(
                "The grid {name:?} has the background {}; outside the box of its active voxels nothing is drawn.",
                grid.background
            );
            warn("background", text);
        }
        if bad > 0 {
            let negative = if self.ramp.is_some() { "" } else { " or negative" };
            warn(
                "bad_values",
                format!("The grid {name:?} has {bad} voxels that are not finite{negative}: drawn as 0."),
            );
        }
        warnings
    }
}

/// Mean length of the sides of a voxel, in world units.
fn mean_voxel_size(world_from_index: &DMat4) -> f64 {
    let [x, y, z] = [world_from_index.x_axis, world_from_index.y_axis, world_from_index.z_axis];
    [x, y, z].map(|axis| axis.truncate().length()).iter().sum::<f64>() / 3.0
}
