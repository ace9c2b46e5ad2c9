//! How a picture converges: its error at growing intervals, and what an error costs.

/// A point is kept when the picture has this many times the samples of the last one, at least.
const GROWTH: f64 = 1.15;
/// Seconds between two points at least: each reads the film.
const LEAST_SECONDS: f64 = 0.5;
/// Samples before the first point: the variance of fewer says little.
const LEAST_SAMPLES: u32 = 2;
/// Stretches between points that an interval is made from, at least.
const LEAST_STRETCHES: usize = 4;

/// A picture at one time.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Point {
    /// Samples of each pixel.
    pub samples: u32,
    /// Seconds of drawing.
    pub seconds: f64,
    /// Density lookups of a pixel, all of its samples together.
    pub lookups: f64,
    /// Relative error, from the picture's own variance.
    pub error: f64,
    /// relMSE against the reference, where there is one of the picture's size.
    pub rel_mse: Option<f64>,
}

/// Points of one picture, in order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trace {
    /// The points.
    pub points: Vec<Point>,
    /// When the last one was made, seconds.
    at: f64,
}

/// A number with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard error; infinite where too little is known.
    pub error: f64,
}

impl Estimate {
    /// The quotient of two independent estimates.
    pub fn over(self, other: Estimate) -> Estimate {
        let value = self.value / other.value;
        let relative = |e: Estimate| e.error / e.value;
        Estimate { value, error: value * relative(self).hypot(relative(other)) }
    }

    /// Its reciprocal.
    pub fn inverse(self) -> Estimate {
        Estimate { value: 1.0, error: 0.0 }.over(self)
    }
}

impl Trace {
    /// Whether a picture of so many samples is worth a point at `now` seconds.
    pub fn is_due(&self, samples: u32, now: f64) -> bool {
        let next = self.points.last().map_or(f64::from(LEAST_SAMPLES), |last| f64::from(last.samples) * GROWTH);
        f64::from(samples) >= next && (self.points.is_empty() || now - self.at >= LEAST_SECONDS)
    }

    /// Adds a point made at `now` seconds.
    pub fn push(&mut self, point: Point, now: f64) {
        self.at = now;
        self.points.push(point);
    }

    /// 1 / (variance × cost), where the variance is that of the picture's mean relative to its brightness: the same for
    /// every number of samples, and n times as great for a method that needs a part in n of the cost for the same error.
    /// The interval comes from the spread between stretches of samples, which are independent.
    pub fn efficiency(&self, cost: impl Fn(&Point) -> f64) -> Option<Estimate> {
        let last = self.points.last()?;
        let total = f64::from(last.samples);
        let spent = cost(last);
        if !(last.error > 0.0 && spent > 0.0) {
            return None;
        }
        let value = 1.0 / (last.error * last.error * spent);
        // Variance of a sample and cost of a sample, over the whole and over each stretch. The variance of a mean of n
        // samples, times n, is that of a sample; times n again it adds up over stretches.
        let (variance, price) = (last.error * last.error * total, spent / total);
        let mut scatter = 0.0;
        let mut before = Point::default();
        for point in &self.points {
            let n = [before, *point].map(|p| f64::from(p.samples));
            let length = n[1] - n[0];
            let sum = |p: &Point, n: f64| p.error * p.error * n * n;
            let stretch = (sum(point, n[1]) - sum(&before, n[0])) / length;
            let dearness = (cost(point) - cost(&before)) / length;
            scatter += length / total * ((stretch / variance - 1.0).powi(2) + (dearness / price - 1.0).powi(2));
            before = *point;
        }
        let stretches = self.points.len();
        let relative =
            if stretches < LEAST_STRETCHES { f64::INFINITY } else { (scatter / (stretches - 1) as f64).sqrt() };
        Some(Estimate { value, error: value * relative })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points at 4, 8, 16 … samples of variance `variance` and `seconds` each; `noise` shakes the variance.
    fn trace(variance: f64, seconds: f64, noise: f64) -> Trace {
        let mut trace = Trace::default();
        let mut sum = 0.0;
        let mut before = 0.0;
        for i in 0..10u32 {
            let n = f64::from(4u32 << i);
            sum += (n - before) * variance * (1.0 + if i % 2 == 0 { noise } else { -noise } / (n - before).sqrt());
            before = n;
            let error = sum.sqrt() / n;
            let point = Point { samples: n as u32, seconds: seconds * n, lookups: 3.0 * n, error, rel_mse: None };
            trace.push(point, f64::from(i));
        }
        trace
    }

    #[test]
    fn efficiency_does_not_depend_on_samples_and_counts_both_factors() {
        let mut short = trace(0.25, 0.1, 0.0);
        let whole = short.efficiency(|p| p.seconds).expect("points");
        assert!((whole.value - 40.0).abs() < 1e-9 && whole.error < 1e-6, "{whole:?}");
        short.points.truncate(5);
        assert!((short.efficiency(|p| p.seconds).expect("points").value - 40.0).abs() < 1e-9);
        let (a, b) = (trace(0.25, 0.1, 0.0), trace(0.5, 0.1, 0.0));
        let ratio = |cost: fn(&Point) -> f64| a.efficiency(cost).expect("a").over(b.efficiency(cost).expect("b")).value;
        assert!((ratio(|p| p.seconds) - 2.0).abs() < 1e-9);
        let (a, b) = (trace(0.25, 0.1, 0.0), trace(0.25, 0.4, 0.0));
        let ratio = |cost: fn(&Point) -> f64| a.efficiency(cost).expect("a").over(b.efficiency(cost).expect("b")).value;
        assert!((ratio(|p| p.seconds) - 4.0).abs() < 1e-9);
        assert!((ratio(|p| p.lookups) - 1.0).abs() < 1e-9, "as many lookups");
    }

    #[test]
    fn the_interval_follows_the_noise() {
        // A stretch of n samples with relative noise 1/√n: the whole of 2048 has 1/√2048.
        let e = trace(0.25, 0.1, 1.0).efficiency(|p| p.seconds).expect("points");
        let expected = 1.0 / 2048f64.sqrt();
        assert!((0.7..1.5).contains(&(e.error / e.value / expected)), "{} for {expected}", e.error / e.value);
        let mut few = trace(0.25, 0.1, 1.0);
        few.points.truncate(3);
        assert_eq!(few.efficiency(|p| p.seconds).expect("points").error, f64::INFINITY);
        let quotient = Estimate { value: 6.0, error: 0.3 }.over(Estimate { value: 2.0, error: 0.2 });
        assert!((quotient.value - 3.0).abs() < 1e-12 && (quotient.error - 3.0 * 0.0125f64.sqrt()).abs() < 1e-12);
        assert!((quotient.inverse().error / quotient.inverse().value - quotient.error / 3.0).abs() < 1e-12);
    }

    #[test]
    fn points_come_seldom_and_ever_seldomer() {
        let mut trace = Trace::default();
        assert!(!trace.is_due(1, 0.0) && trace.is_due(2, 0.0));
        let mut count = 0;
        for samples in 1..100_000u32 {
            let now = f64::from(samples) * 0.01;
            if trace.is_due(samples, now) {
                trace.push(Point { samples, ..Point::default() }, now);
                count += 1;
            }
        }
        assert!((40..70).contains(&count), "{count} points for 100 000 samples");
        assert!(!trace.is_due(1 << 20, 999.99 + 0.1) || trace.at < 999.0, "at most twice a second");
        assert_eq!(Trace::default().efficiency(|p| p.seconds), None);
    }
}
