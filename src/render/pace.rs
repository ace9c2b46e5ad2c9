//! How much work fits a time: from how long the last pieces took.

use super::{Progress, Work};

/// Samples of a pass where there is time for many: enough that lanes even out.
const FULL_PASS: f64 = 32.0;
/// Workgroups that keep every core of an adapter busy to the end of a dispatch.
const LEAST_GROUPS: f64 = 64.0;
/// A slice grows by at most this factor over what was measured last, and shrinks by at most its square.
const GROWTH: f64 = 2.0;

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

#[cfg(test)]
mod tests {
    use super::*;

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
