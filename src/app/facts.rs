//! Facts about the volume and the picture that the panel shows.

use super::{App, capture};
use crate::render::field::Shape;

/// Bins of the density histogram.
const BINS: usize = 76;

/// Facts about the picture and the volume that the panel shows.
#[derive(Clone, Debug, Default)]
pub struct Facts {
    /// There is a volume; without one nothing below says anything.
    pub known: bool,
    /// Texels along each side, without the border; `None` for an analytic volume.
    pub voxels: Option<[u32; 3]>,
    /// Size of the world box.
    pub extent: [f64; 3],
    /// Counts of densities above 0 in equal bins up to `density_max`.
    pub histogram: Vec<u64>,
    /// The greatest density.
    pub density_max: f64,
    /// Mean of the densities above 0.
    pub density_mean: f64,
    /// Share of voxels above 0.
    pub filled: f64,
    /// Grids that the file offers, and the one in use.
    pub grids: Vec<String>,
    /// The grid in use.
    pub grid: String,
    /// ∫ density dt along a mean column.
    pub mean_column: Option<f64>,
    /// Density scale in use.
    pub density_scale: f64,
    /// Density lookups of a path.
    pub lookups_per_path: Option<f64>,
    /// Share of null collisions among those of free flights.
    pub null_ratio: Option<f64>,
    /// Real collisions of a path that meets the medium.
    pub bounces: Option<f64>,
    /// Majorant segments that a path walks.
    pub steps_per_path: Option<f64>,
    /// Shadow rays of a path.
    pub shadows_per_path: Option<f64>,
    /// Bytes of the majorants on the adapter, and seconds that it took to make them.
    pub bounds: (u64, f64),
    /// Lookups of a density above its bound, segments with fewer looks than wanted, samples that were not finite.
    pub mishaps: [u64; 3],
    /// Side of a majorant cell, voxels.
    pub cell: u32,
    /// Bytes of density and majorants on the adapter.
    pub bytes: u64,
    /// Warnings of the volume.
    pub warnings: Vec<String>,
    /// The folder that captures go to.
    pub captures: String,
}

impl App {
    /// Facts that only a new volume changes.
    pub(super) fn gather_static(&self) -> Facts {
        let Some(field) = self.field() else { return Facts::default() };
        let (low, high) = field.world_box();
        let mut facts = Facts {
            known: true,
            extent: (high - low).to_array(),
            grids: field.grids.clone(),
            grid: field.grid.clone(),
            density_max: field.max(),
            density_mean: 1.0,
            filled: 1.0,
            warnings: field.warnings.iter().map(|w| w.text.clone()).collect(),
            captures: capture::folder().display().to_string(),
            ..Facts::default()
        };
        if let Shape::Dense(dense) = &field.shape {
            facts.voxels = Some(dense.size.to_array());
            let mut bins = vec![0u64; BINS];
            let (mut sum, mut count) = (0.0, 0u64);
            let scale = BINS as f32 / dense.max().max(f32::MIN_POSITIVE);
            for &d in dense.data.iter().filter(|d| **d > 0.0) {
                bins[((d * scale) as usize).min(BINS - 1)] += 1;
                sum += f64::from(d);
                count += 1;
            }
            facts.histogram = bins;
            facts.density_mean = sum / count.max(1) as f64;
            facts.filled = count as f64 / dense.data.len() as f64;
        }
        facts
    }

    pub(super) fn refresh_facts(&mut self) {
        let Some(engine) = &self.engine else { return };
        let Some(renderer) = &engine.renderer else { return };
        let (c, f) = (&engine.figures.counters, &mut self.facts);
        f.density_scale = renderer.medium.density_scale(&self.scene);
        f.mean_column = renderer.medium.mean_column;
        f.cell = renderer.medium.cell;
        f.bytes = renderer.medium.volume_bytes + renderer.medium.majorant_bytes;
        f.bounds = (renderer.medium.majorant_bytes, renderer.medium.majorant_seconds);
        f.mishaps = [c.violations, c.capped, c.nonfinite];
        let paths = engine.figures.paths;
        if c.lookups > 0 && paths > 0.0 {
            f.lookups_per_path = Some(c.lookups as f64 / paths);
            f.null_ratio = Some(c.null_collisions as f64 / (c.null_collisions + c.real_collisions).max(1) as f64);
            f.bounces = Some(c.real_collisions as f64 / paths);
            f.steps_per_path = Some(c.cell_steps as f64 / paths);
            f.shadows_per_path = Some(c.shadow_rays as f64 / paths);
        }
    }
}
