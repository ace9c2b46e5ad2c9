//! How much work fits a time, from how long the last pieces took; and at which scale a picture is drawn while things move
//! and on its way to rest.

use super::{Progress, Work};

/// Samples of a pass where there is time for many: enough that lanes even out.
const FULL_PASS: f64 = 32.0;
/// Workgroups that keep every core of an adapter busy to the end of a dispatch.
const LEAST_GROUPS: f64 = 64.0;
/// A slice grows by at most this factor over what was measured last, and shrinks by at most its square.
const GROWTH: f64 = 2.0;

/// Linear scales of the picture while things move.
const SCALES: [f64; 14] = [1.0, 0.85, 0.7, 0.6, 0.5, 0.42, 0.35, 0.3, 0.27, 0.25, 0.21, 0.18, 0.15, LEAST_SCALE];
/// The smallest of them.
pub const LEAST_SCALE: f64 = 0.125;
/// A growing scale must fit with this reserve, so that it does not swing.
const RESERVE: f64 = 0.9;
/// Scales on the way from motion to rest.
const RUNGS: [f64; 3] = [0.25, 0.5, 1.0];
/// A rung must be finer by this factor (twice the pixels), else it is not worth its time.
const FINER: f64 = std::f64::consts::SQRT_2;
/// Samples that a picture of reduced scale gets before a finer one begins.
const FEW: u32 = 4;

/// Chooses the size of the next piece of work so that it takes about `budget` seconds.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    /// Seconds that a piece should take.
    pub budget: f64,
    /// Samples of the whole picture that a second allows, about; `None` before the first measurement.
    rate: Option<f64>,
}

impl Pace {
    /// A pace for pieces of `budget` seconds.
    pub fn new(budget: f64) -> Pace {
        Pace { budget, rate: None }
    }

    /// The rate, samples of the whole picture a second.
    pub fn rate(&self) -> Option<f64> {
        self.rate
    }

    /// Scales the rate to a picture with `ratio` times as many pixels.
    pub fn rescale(&mut self, ratio: f64) {
        self.rate = self.rate.map(|r| r / ratio);
    }

    /// The next piece, where `left` samples of each pixel are still wanted and the picture has `tiles` tiles.
    pub fn next(&self, progress: Progress, left: u32, tiles: u32) -> Work {
        let Some(rate) = self.rate else {
            return Work { samples: 1, groups: LEAST_GROUPS as u32 };
        };
        let affordable = rate * self.budget;
        let samples = if progress.pass > 0 {
            f64::from(progress.pass)
        } else {
            // Several samples a lane even out the lanes; but not so many that too few workgroups fit a piece, nor more
            // than the picture has already: the first ones come soon.
            let by_groups = affordable * f64::from(tiles) / LEAST_GROUPS;
            let most = f64::from(left.min(progress.samples).max(1));
            affordable.max(FULL_PASS.min(by_groups)).min(most).max(1.0).floor()
        };
        let groups = (affordable / samples * f64::from(tiles)).max(1.0);
        Work { samples: samples as u32, groups: groups.min(f64::from(u32::MAX)) as u32 }
    }

    /// Notes that `done` samples of the whole picture took `seconds`.
    pub fn note(&mut self, done: f64, seconds: f64) {
        let measured = done / seconds.max(1e-6);
        self.rate = Some(match self.rate {
            None => measured,
            Some(old) => measured.clamp(old / (GROWTH * GROWTH), old * GROWTH),
        });
    }
}

/// A picture on its way.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stage {
    /// Linear scale to the viewport, up to 1.
    pub scale: f64,
    /// Samples of each of its pixels.
    pub samples: u32,
}

impl Stage {
    /// Whether it is a picture of full scale.
    pub fn is_whole(self) -> bool {
        self.scale == 1.0
    }
}

/// The scale for a picture that moves: `current` is the last one, `pixels` the viewport's, and `affordable` the samples
/// of one pixel each that fit a frame.
pub fn moving_scale(current: f64, pixels: f64, affordable: f64) -> f64 {
    let fits = |s: f64, share: f64| s * s * pixels <= affordable * share;
    let larger = SCALES.into_iter().rev().find(|&s| s > current).unwrap_or(1.0);
    if current < 1.0 && fits(current, 1.0) && !fits(larger, RESERVE) {
        return current;
    }
    SCALES.into_iter().find(|&s| fits(s, RESERVE)).unwrap_or(LEAST_SCALE)
}

/// Samples that a picture of `scale` shall get where the user wants `limit` (0: no end).
pub fn wanted(scale: f64, limit: u32) -> u32 {
    let limit = if limit == 0 { u32::MAX } else { limit };
    if scale < 1.0 { FEW.min(limit) } else { limit }
}

/// The scale for a picture at rest that stands at `stage`: the same until it has a few samples, then a finer one.
pub fn rest_scale(stage: Stage, limit: u32) -> f64 {
    if stage.scale >= 1.0 || stage.samples < wanted(stage.scale, limit) {
        return stage.scale;
    }
    RUNGS.into_iter().find(|&s| s >= stage.scale * FINER).unwrap_or(1.0)
}

/// Whether a picture of the same things at stage `newer` shall replace the one on screen: no pixel of it has fewer samples,
/// and no part of the screen. (ꟻLIP of the default scene at half scale with 4 samples: 0.020; at full scale with 2: 0.027,
/// with 4: 0.021.)
pub fn takes_over(shown: Stage, newer: Stage) -> bool {
    let on_screen = |s: Stage| f64::from(s.samples) * s.scale * s.scale;
    newer.samples > 0 && newer.samples >= shown.samples && on_screen(newer) >= on_screen(shown)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stage(scale: f64, samples: u32) -> Stage {
        Stage { scale, samples }
    }

    #[test]
    fn a_moving_picture_fits_its_frame_and_does_not_swing() {
        let pixels = 1e6;
        assert_eq!(moving_scale(0.125, pixels, 2e6), 1.0);
        assert_eq!(moving_scale(1.0, pixels, 0.3e6), 0.5, "0.25 of the pixels fit 0.3 with a reserve");
        assert_eq!(moving_scale(0.5, pixels, 0.26e6), 0.5, "what fits stays, though the reserve is used up");
        assert_eq!(moving_scale(0.42, pixels, 0.26e6), 0.42, "and nothing grows into the reserve");
        assert_eq!(moving_scale(0.5, pixels, 0.0), LEAST_SCALE);
    }

    /// Every picture that comes on screen on the way to rest, where passes are as `Pace` cuts them.
    fn way_to_rest(mut now: Stage, limit: u32) -> Vec<Stage> {
        let mut shown = vec![now];
        for _ in 0..64 {
            let scale = rest_scale(now, limit);
            if scale != now.scale {
                assert!(scale > now.scale, "{now:?} goes down to {scale}");
                now = stage(scale, 0);
            }
            now.samples = (now.samples + now.samples.max(1)).min(wanted(scale, limit)).min(1024);
            if takes_over(shown[shown.len() - 1], now) {
                shown.push(now);
            }
        }
        shown
    }

    #[test]
    fn a_picture_at_rest_never_becomes_worse() {
        for &scale in &SCALES {
            for samples in [1, 3, 12, 40] {
                let shown = way_to_rest(stage(scale, samples), 0);
                assert_eq!(shown[shown.len() - 1], stage(1.0, 1024), "{shown:?}");
                for pair in shown.windows(2) {
                    let light = |s: Stage| f64::from(s.samples) * s.scale * s.scale;
                    assert!(pair[1].samples >= pair[0].samples, "noise: {pair:?}");
                    assert!(light(pair[1]) >= light(pair[0]), "samples on the screen: {pair:?}");
                    assert!(pair[1].scale >= pair[0].scale, "sharpness: {pair:?}");
                }
            }
        }
    }

    #[test]
    fn rungs_are_few_and_worth_their_time() {
        let rungs = |scale: f64| {
            let mut shown: Vec<f64> = way_to_rest(stage(scale, 3), 0).iter().map(|s| s.scale).collect();
            shown.dedup();
            shown
        };
        assert_eq!(rungs(0.125), [0.125, 0.25, 0.5, 1.0]);
        assert_eq!(rungs(0.35), [0.35, 0.5, 1.0]);
        assert_eq!(rungs(0.42), [0.42, 1.0]);
        assert_eq!(rest_scale(stage(0.35, 3), 0), 0.35, "a few samples first");
        assert_eq!(rest_scale(stage(0.35, 1), 1), 0.5, "no more than the user wants");
    }

    #[test]
    fn a_clean_coarse_picture_outlives_a_noisy_fine_one() {
        assert!(!takes_over(stage(0.5, 4), stage(1.0, 1)));
        assert!(takes_over(stage(0.5, 4), stage(1.0, 4)));
        assert!(!takes_over(stage(1.0, 4), stage(0.85, 4)), "fewer samples on the screen");
        assert!(!takes_over(stage(0.5, 0), stage(1.0, 0)), "nothing is no picture");
    }

    #[test]
    fn work_settles_at_the_budget() {
        let mut pace = Pace::new(0.1);
        let (tiles, true_rate) = (1000, 3.0);
        let progress = Progress { samples: 4096, pass: 0 };
        for _ in 0..20 {
            let work = pace.next(progress, 1000, tiles);
            let done = f64::from(work.samples) * f64::from(work.groups.min(tiles)) / f64::from(tiles);
            pace.note(done, done / true_rate);
        }
        let work = pace.next(progress, 1000, tiles);
        let seconds = f64::from(work.samples) * f64::from(work.groups) / f64::from(tiles) / true_rate;
        assert!((0.05..0.2).contains(&seconds), "{work:?} takes {seconds} s");
        assert_eq!(pace.next(progress, 1, tiles).samples, 1);
        assert_eq!(pace.next(Progress { samples: 0, pass: 0 }, 1000, tiles).samples, 1, "the first pass is short");
    }
}
