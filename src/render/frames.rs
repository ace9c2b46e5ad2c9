//! Frames of reused paths: when the renderer draws one in place of the path tracer's samples.

use crate::error::Result;

use super::Renderer;
use super::film::BLOCK;
use super::reuse::{self, Reuse};

impl Renderer {
    /// Makes room for paths where the scene's mode reuses them, or lets it go.
    pub(super) fn match_reuse(&mut self) -> Result<()> {
        let wanted = self.scene.integrator.mode.reuses();
        let fits = self.reuse.as_ref().is_some_and(|r| r.fits(&self.scene, self.size));
        if wanted && !fits {
            // The old buffers go first: both may not fit.
            let timed = self.reuse.take().is_some_and(|r| r.timed);
            let mut reuse = Reuse::new(&self.gpu, &self.scene, self.size, self.previous.clone())?;
            reuse.timed = timed;
            self.reuse = Some(reuse);
        } else if !wanted {
            self.reuse = None;
        }
        Ok(())
    }

    /// What is kept of paths, where the scene's mode reuses them.
    pub fn reuse(&self) -> Option<&Reuse> {
        self.reuse.as_ref()
    }

    /// The same, to change.
    pub fn reuse_mut(&mut self) -> Option<&mut Reuse> {
        self.reuse.as_mut()
    }

    /// The reservoirs that the last frame of this picture shaded, if one was drawn.
    pub fn reservoirs(&self) -> Option<&wgpu::Buffer> {
        self.reuse.as_ref()?.shaded()
    }

    /// Whether the next pass is a frame of reused paths; `None` where the mode never draws one.
    pub fn reuses_now(&self) -> Option<bool> {
        self.reuse.as_ref()?;
        Some(self.cap().is_some())
    }

    /// Forgets the paths that are kept and starts the picture anew; false where the mode keeps none.
    pub fn drop_history(&mut self) -> bool {
        let Some(reuse) = &mut self.reuse else { return false };
        reuse.forget();
        self.restart();
        true
    }

    /// Whether every pass is a frame of its own, as while things move, where paths are reused; it merges as many new
    /// samples as its work asks for.
    pub fn set_moving(&mut self, moves: bool) {
        self.moves = moves;
    }

    /// The most that a history counts for in the next pass; `None` where that is one of the path tracer.
    pub(super) fn cap(&self) -> Option<u32> {
        self.reuse.as_ref()?;
        let settings = self.scene.resampling();
        if self.moves || self.samples < settings.still_after {
            Some(settings.cap)
        } else {
            (settings.still_cap > 0).then_some(settings.still_cap)
        }
    }

    /// Whether the spread of a pixel's samples tells nothing, for all or most of them share paths.
    pub fn is_correlated(&self) -> bool {
        let settings = self.scene.resampling();
        self.reuse.is_some() && (self.moves || settings.still_cap > 0 || self.samples <= settings.still_after)
    }

    /// Independent samples that one of the picture's is worth, about.
    pub fn worth(&self) -> u32 {
        let settings = self.scene.resampling();
        let cap = if settings.temporal { settings.cap } else { 0 };
        /// More would keep a coarse picture on screen for long.
        const MOST: u32 = 4;
        if self.reuse.is_some() && self.moves { (1 + cap).min(MOST) } else { 1 }
    }

    /// Draws a frame of reused paths: a sample of every pixel.
    pub(super) fn draw_frame(&mut self, cap: u32, merged: u32) -> Result<f64> {
        let pipeline = self.pipeline().expect("it was polled or prepared").clone();
        let kernels = pipeline.reuse.as_ref().expect("the variant has them");
        let groups = [&self.frame_group, &self.medium_group, &self.light_group];
        let reuse = self.reuse.as_mut().expect("the cap says so");
        let picture = reuse::Picture {
            film: &self.film,
            scene: &self.scene,
            params: &self.params_now,
            lights: &self.lights.list,
        };
        reuse.draw(&self.gpu, kernels, groups, &picture, cap, merged)?;
        self.samples += 1;
        if self.samples.is_multiple_of(BLOCK) {
            self.layouts.flush(&self.gpu, &self.film);
        }
        Ok(1.0)
    }
}
