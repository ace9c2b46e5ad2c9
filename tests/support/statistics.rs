//! z and χ² tests whose thresholds follow from the number of checks.

/// Chance that a whole test binary fails by chance on a driver where its figures differ from those it was made on. On
/// one driver the figures are fixed, so there the chance is 0 or 1.
const FAMILY: f64 = 1e-3;

/// A planted error must be seen at least this clearly.
const SEEN: f64 = 8.0;

/// Statistical checks in a test binary, about; more would raise the threshold only a little.
pub const CHECKS: u32 = 600;

/// A check against chance: its name and its z.
pub type Check = (String, f64);

/// Fails where one of `checks` is further from the truth than chance allows.
pub fn all_hold(checks: &[Check]) {
    let limit = limit(CHECKS);
    let bad: Vec<&Check> = checks.iter().filter(|(_, z)| z.is_nan() || z.abs() >= limit).collect();
    assert!(bad.is_empty(), "beyond {limit:.2} standard errors: {bad:.2?}");
}

/// Fails where none of `checks` sees the planted error clearly.
pub fn one_sees(what: &str, checks: &[Check]) {
    let (name, z) = checks.iter().max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).expect("there are checks");
    eprintln!("planted: {what}: {name} says {z:.1}");
    assert!(z.abs() > SEEN, "{what} is not seen: {checks:.2?}");
}

/// Chance of a standard normal number above `z` (W. J. Cody's idea in the Chebyshev form of Press et al., relative error
/// below 1.2·10⁻⁷).
fn upper_tail(z: f64) -> f64 {
    const C: [f64; 10] = [
        -1.265_512_23,
        1.000_023_68,
        0.374_091_96,
        0.096_784_18,
        -0.186_288_06,
        0.278_868_07,
        -1.135_203_98,
        1.488_515_87,
        -0.822_152_23,
        0.170_872_77,
    ];
    let x = z.abs() / std::f64::consts::SQRT_2;
    let t = 1.0 / (1.0 + 0.5 * x);
    let polynomial = C.iter().rev().fold(0.0, |sum, c| sum * t + c);
    let tail = 0.5 * t * (-x * x + polynomial).exp();
    if z >= 0.0 { tail } else { 1.0 - tail }
}

/// The |z| below which all of `checks` independent two-sided tests stay but for a chance of [`FAMILY`] (Šidák).
pub fn limit(checks: u32) -> f64 {
    let each = 1.0 - (1.0 - FAMILY).powf(1.0 / f64::from(checks));
    let (mut low, mut high) = (0.0, 40.0);
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if 2.0 * upper_tail(middle) > each { low = middle } else { high = middle }
    }
    high
}

/// Mean and standard error of the mean.
pub fn mean(values: impl Iterator<Item = f64>) -> (f64, f64) {
    let (mut n, mut mean, mut square) = (0.0, 0.0, 0.0);
    for x in values {
        n += 1.0;
        let delta = x - mean;
        mean += delta / n;
        square += delta * (x - mean);
    }
    (mean, (square / (n - 1.0) / n).sqrt())
}

/// Distance of the mean of `values` from `truth` in standard errors.
pub fn z_of(values: impl Iterator<Item = f64>, truth: f64) -> f64 {
    let (mean, error) = mean(values);
    if mean == truth { 0.0 } else { (mean - truth) / error }
}

/// χ² of counts against expectations as a standard normal number (Wilson and Hilferty 1931); bins with small
/// expectations are merged with their neighbours. `known`: restrictions on the counts, 1 where only their sum is given.
pub fn chi_square(counts: &[f64], expected: &[f64], known: u32) -> f64 {
    const LEAST: f64 = 20.0;
    let mut bins: Vec<(f64, f64)> = Vec::new();
    let mut rest = (0.0, 0.0);
    for (&c, &e) in counts.iter().zip(expected) {
        rest = (rest.0 + c, rest.1 + e);
        if rest.1 >= LEAST {
            bins.push(std::mem::take(&mut rest));
        }
    }
    match bins.last_mut() {
        Some(last) => *last = (last.0 + rest.0, last.1 + rest.1),
        None => bins.push(rest),
    }
    let sum = bins.iter().map(|(c, e)| (c - e).powi(2) / e).sum::<f64>();
    normal(sum, bins.len() as f64 - f64::from(known))
}

/// A χ² number of `freedom` degrees as a standard normal one.
pub fn normal(chi_square: f64, freedom: f64) -> f64 {
    let v = 2.0 / (9.0 * freedom);
    ((chi_square / freedom).cbrt() - (1.0 - v)) / v.sqrt()
}

/// χ² of values in [0, 1) over equal bins.
pub fn uniform(values: impl Iterator<Item = f64>, bins: usize) -> f64 {
    let mut counts = vec![0.0; bins];
    let mut n = 0.0;
    for x in values {
        counts[((x * bins as f64) as usize).min(bins - 1)] += 1.0;
        n += 1.0;
    }
    chi_square(&counts, &vec![n / bins as f64; bins], 1)
}

/// Simpson's rule over [a, b] with n (even) steps.
pub fn simpson(f: impl Fn(f64) -> f64, a: f64, b: f64, n: usize) -> f64 {
    let h = (b - a) / n as f64;
    let weight = |i: usize| if i == 0 || i == n { 1.0 } else { [2.0, 4.0][i % 2] };
    (0..=n).map(|i| weight(i) * f(a + h * i as f64)).sum::<f64>() * h / 3.0
}
