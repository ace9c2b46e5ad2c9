//! Figures of what was measured: one run, the runs of a row, the rows of a setting.

use crate::cli::bench::trace::Trace;
use crate::image::tone::LUMINANCE;
use crate::scene::Tracking;

use super::plan::{Row, bound_name, name};

/// One run of one row. Counts are of all its paths.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Round {
    /// CPU seconds of the process on a software adapter, else wall seconds.
    pub seconds: f64,
    /// Wall seconds.
    pub wall: f64,
    /// Samples of pixels.
    pub paths: f64,
    /// Density lookups.
    pub lookups: f64,
    /// Majorant segments.
    pub steps: f64,
    /// Null collisions of free flights.
    pub nulls: f64,
    /// Real collisions.
    pub reals: f64,
    /// Shadow rays.
    pub shadows: f64,
    /// Samples that were not finite and segments with fewer looks than wanted.
    pub faults: f64,
    /// Lookups above the bound; a majorant factor below 1 asks for them.
    pub violations: f64,
    /// Variance of a sample, mean over pixels; channels weighted as in luminance.
    pub variance: f64,
    /// Mean luminance of the picture.
    pub mean: f64,
    /// Variance of that mean; in coloured media an upper limit, as if channels were fully correlated.
    pub mean_variance: f64,
}

impl Round {
    /// The figures of a run; `seconds` is for the caller to choose.
    pub fn of(trace: &Trace, seconds: f64) -> Round {
        let (sums, c) = (&trace.sums, &trace.counters);
        let weights = LUMINANCE.map(f64::from);
        let weigh = |v: [f64; 3]| (0..3).map(|i| weights[i] * v[i]).sum::<f64>();
        let pixels = sums.sum.len();
        let mut round = Round {
            seconds,
            wall: trace.wall,
            lookups: c.lookups as f64,
            steps: c.cell_steps as f64,
            nulls: c.null_collisions as f64,
            reals: c.real_collisions as f64,
            shadows: c.shadow_rays as f64,
            faults: (c.nonfinite + c.capped) as f64,
            violations: c.violations as f64,
            ..Round::default()
        };
        for pixel in 0..pixels {
            let samples = sums.square[pixel][3];
            round.paths += samples;
            round.mean += weigh(sums.mean(pixel)) / pixels as f64;
            if let Some(of_mean) = sums.variance(pixel) {
                round.variance += weigh(of_mean) * samples / pixels as f64;
                round.mean_variance += weigh(of_mean.map(f64::sqrt)).powi(2) / (pixels * pixels) as f64;
            }
        }
        round
    }

    /// Seconds of a path.
    fn seconds_per_path(&self) -> f64 {
        self.seconds / self.paths
    }
}

/// What was measured of one row.
#[derive(Clone, Debug, PartialEq)]
pub struct Measured {
    /// Which.
    pub row: Row,
    /// Bytes of the bounds on the adapter.
    pub bound_bytes: u64,
    /// Seconds that building them took, the least of all times.
    pub bound_seconds: f64,
    /// Its runs.
    pub rounds: Vec<Round>,
}

impl Measured {
    /// A count of all rounds.
    pub fn sum(&self, figure: impl Fn(&Round) -> f64) -> f64 {
        self.rounds.iter().map(figure).sum()
    }

    /// A count for each path.
    pub fn per_path(&self, count: impl Fn(&Round) -> f64) -> f64 {
        self.sum(count) / self.sum(|r| r.paths)
    }

    /// A figure of each round, weighted by its paths.
    fn mean_of(&self, figure: impl Fn(&Round) -> f64) -> f64 {
        self.sum(|r| figure(r) * r.paths) / self.sum(|r| r.paths)
    }

    /// Variance of a path.
    pub fn variance(&self) -> f64 {
        self.mean_of(|r| r.variance)
    }

    /// Relative standard error of the variance, from its spread over the rounds; 0 for one round.
    pub fn variance_error(&self) -> f64 {
        let n = self.rounds.len() as f64;
        let variance = self.variance();
        if n < 2.0 || variance == 0.0 {
            return 0.0;
        }
        (self.sum(|r| (r.variance - variance).powi(2)) / (n * (n - 1.0))).sqrt() / variance
    }

    /// Mean luminance of the picture.
    pub fn mean(&self) -> f64 {
        self.mean_of(|r| r.mean)
    }

    /// Its standard error.
    pub fn error(&self) -> f64 {
        self.sum(|r| r.mean_variance * r.paths * r.paths).sqrt() / self.sum(|r| r.paths)
    }

    /// Seconds of a path in the quickest round: other work on the machine only ever adds.
    pub fn seconds(&self) -> f64 {
        self.rounds.iter().map(Round::seconds_per_path).fold(f64::INFINITY, f64::min)
    }

    /// Lookups and segments of a path.
    pub fn work(&self) -> f64 {
        self.per_path(|r| r.lookups + r.steps)
    }

    /// 1 / (variance · seconds).
    pub fn efficiency(&self) -> f64 {
        1.0 / (self.variance() * self.seconds())
    }

    /// 1 / (variance · (lookups + segments)).
    pub fn work_efficiency(&self) -> f64 {
        1.0 / (self.variance() * self.work())
    }

    /// Share of the tentative collisions of free flights that are null.
    pub fn null_ratio(&self) -> f64 {
        let nulls = self.sum(|r| r.nulls);
        if nulls > 0.0 { nulls / (nulls + self.sum(|r| r.reals)) } else { 0.0 }
    }

    /// Lookups of the free flights of a path, without those of shadow rays; of a flight that looks at every collision.
    pub fn flight_lookups(&self) -> f64 {
        self.per_path(|r| r.nulls + r.reals)
    }

    /// Why it is biased, if it is.
    pub fn bias(&self) -> Option<&'static str> {
        self.row.tracking.bias()
    }

    /// Standard errors between its mean and that of `other`.
    pub fn z(&self, other: &Measured) -> f64 {
        let error = self.error().hypot(other.error());
        if error > 0.0 { (self.mean() - other.mean()) / error } else { 0.0 }
    }
}

/// Every row on one volume in one setting.
#[derive(Clone, Debug, PartialEq)]
pub struct Case {
    /// The volume.
    pub volume: String,
    /// The setting: thickness and colour.
    pub setting: String,
    /// Mean optical thickness.
    pub thickness: f64,
    /// Rows; the first is the baseline, the second the default.
    pub rows: Vec<Measured>,
}

impl Case {
    /// The unbiased row of those that `which` lets through with the greatest `figure`.
    pub fn best(&self, which: impl Fn(&Row) -> bool, figure: impl Fn(&Measured) -> f64) -> &Measured {
        let candidates = self.rows.iter().filter(|m| m.bias().is_none() && which(&m.row));
        let finite = candidates.filter(|m| figure(m).is_finite());
        finite.max_by(|a, b| figure(a).total_cmp(&figure(b))).unwrap_or(&self.rows[0])
    }

    /// The row of these settings.
    pub fn row(&self, tracking: &Tracking) -> Option<&Measured> {
        self.rows.iter().find(|m| name(&m.row.tracking) == name(tracking))
    }
}

/// Decomposition against delta tracking by the same bounds.
#[derive(Clone, Debug, PartialEq)]
pub struct Saving {
    /// Volume and setting.
    pub medium: String,
    /// The bounds.
    pub bound: String,
    /// Lookups of a path's free flights by delta tracking.
    pub delta: f64,
    /// By decomposition.
    pub decomposition: f64,
    /// 1 − ⟨µc/µ̄⟩, from walks on the CPU.
    pub predicted: f64,
}

impl Saving {
    /// From the two rows. Shadow rays are the same in both, but decomposition's own lookups are not counted apart.
    pub fn of(medium: &str, delta: &Measured, decomposition: &Measured, predicted: f64) -> Saving {
        let shadows = delta.per_path(|r| r.lookups) - delta.flight_lookups();
        Saving {
            medium: medium.into(),
            bound: bound_name(&delta.row.tracking),
            delta: delta.flight_lookups(),
            decomposition: decomposition.per_path(|r| r.lookups) - shadows,
            predicted,
        }
    }

    /// Decomposition's lookups over delta's.
    pub fn ratio(&self) -> f64 {
        self.decomposition / self.delta
    }
}

/// Error of an estimator that marches against the size of its steps.
#[derive(Clone, Debug, PartialEq)]
pub struct March {
    /// Volume.
    pub medium: String,
    /// What marches.
    pub estimator: String,
    /// Size in voxels, error of the mean over the mean, its standard error.
    pub points: Vec<[f64; 3]>,
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::cli::bench::tracking::plan::{Group, baseline};
    use crate::cli::bench::tracking::report::tests::example;
    use crate::render::film::{Counters, Sums};

    /// A row of that cost and variance of a path, in two rounds, the first of them slow.
    pub fn measured(tracking: Tracking, cost: f64, variance: f64, mean: f64) -> Measured {
        let round = |slow: f64, paths: f64| Round {
            seconds: slow * cost * paths,
            wall: slow * cost * paths,
            paths,
            lookups: 6.0 * paths,
            steps: 2.0 * paths,
            nulls: 3.0 * paths,
            reals: paths,
            shadows: 0.5 * paths,
            faults: 0.0,
            violations: 0.0,
            variance,
            mean,
            mean_variance: variance / paths,
        };
        let row = Row { group: Group::FreeFlight, tracking };
        Measured { row, bound_bytes: 64, bound_seconds: 0.5, rounds: vec![round(3.0, 100.0), round(1.0, 300.0)] }
    }

    #[test]
    fn figures_of_a_run_are_those_of_its_film() {
        // Two pixels of four samples: one of 0, 2, 0, 2 in all channels, one of 3 always.
        let sums = Sums {
            width: 2,
            height: 1,
            sum: vec![[4.0, 4.0, 4.0, 0.0], [12.0, 12.0, 12.0, 0.0]],
            square: vec![[8.0, 8.0, 8.0, 4.0], [36.0, 36.0, 36.0, 4.0]],
            extra: Vec::new(),
            cost: Vec::new(),
            reservoirs: Vec::new(),
        };
        let counters = Counters { lookups: 16, null_collisions: 6, real_collisions: 2, ..Counters::default() };
        let r = Round::of(&Trace { wall: 2.0, cpu: None, counters, sums }, 3.0);
        assert_eq!((r.seconds, r.wall, r.paths, r.lookups, r.nulls), (3.0, 2.0, 8.0, 16.0, 6.0));
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-6, "{a} {b}");
        near(r.mean, 2.0);
        // Unbiased variances 4/3 and 0; of the picture's mean (4/3 / 4) / 2².
        near(r.variance, 2.0 / 3.0);
        near(r.mean_variance, 1.0 / 12.0);
    }

    #[test]
    fn figures_of_a_row_pool_its_rounds() {
        let m = measured(Tracking::default(), 2.0, 0.25, 1.0);
        assert_eq!((m.seconds(), m.work(), m.per_path(|r| r.lookups)), (2.0, 8.0, 6.0), "the quickest round");
        assert_eq!((m.efficiency(), m.work_efficiency(), m.null_ratio()), (2.0, 0.5, 0.75));
        assert!((m.error() - (0.25f64 / 400.0).sqrt()).abs() < 1e-12, "the error of all paths together");
        // A round counts by its paths.
        let mut uneven = m.clone();
        uneven.rounds[0].mean = 3.0;
        assert_eq!(uneven.mean(), 1.5);
        // Variances 0.15 and 0.35 about a mean of 0.3 by paths: √((0.15² + 0.05²) / 2) / 0.3.
        (uneven.rounds[0].variance, uneven.rounds[1].variance) = (0.15, 0.35);
        assert!((uneven.variance_error() - 0.0125f64.sqrt() / 0.3).abs() < 1e-12, "{}", uneven.variance_error());
        let other = measured(Tracking::default(), 2.0, 0.25, 1.1);
        let expected = 0.1 / (2.0 * 0.25f64 / 400.0).sqrt();
        assert!((other.z(&m) - expected).abs() < 1e-9 && (m.z(&other) + expected).abs() < 1e-9);
    }

    #[test]
    fn the_best_row_is_unbiased_and_efficient() {
        let mut case = example().cases.remove(0);
        let all = |_: &Row| true;
        assert_eq!(case.best(all, Measured::efficiency).row, case.rows[1].row, "marching is out, however quick");
        assert_eq!(case.best(|r| r.tracking == baseline(), Measured::efficiency).row, case.rows[0].row);
        // A row without variance, as in a black picture, has no efficiency.
        case.rows[1].rounds.iter_mut().for_each(|r| r.variance = 0.0);
        assert_eq!(case.best(all, Measured::efficiency).row, case.rows[0].row);
    }

    #[test]
    fn savings_leave_shadow_rays_out() {
        let delta = measured(Tracking::default(), 1.0, 1.0, 1.0);
        let mut decomposition = delta.clone();
        // Delta: four collisions of flights and two lookups of shadow rays; decomposition: one and two.
        decomposition.rounds.iter_mut().for_each(|r| r.lookups = 3.0 * r.paths);
        let s = Saving::of("m", &delta, &decomposition, 0.3);
        assert_eq!((s.delta, s.decomposition, s.ratio()), (4.0, 1.0, 0.25));
    }
}
