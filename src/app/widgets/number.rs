//! Numbers as they are shown, typed and spread along a slider.

use std::ops::RangeInclusive;

/// How many digits a number is shown with. Fixed per setting, so that numbers do not jump.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Digits {
    /// This many after the decimal point.
    Decimals(usize),
    /// This many significant ones, for ranges of many decades; whole digits are never rounded away.
    Significant(usize),
}

/// Beyond these powers of ten significant digits are shown with an exponent.
const PLAIN_POWERS: RangeInclusive<i32> = -4..=6;
/// Thousands are set apart by this; egui's layout makes it from any font.
const THIN_SPACE: char = '\u{2009}';
/// The minus sign of type, as wide as the tabular plus.
const MINUS: char = '−';
/// What is shown in place of a number that is not known.
pub const UNKNOWN: &str = "–";

impl Digits {
    /// `value` as text: a proper minus sign, thin spaces between thousands, "–" for NaN.
    pub fn format(self, value: f64) -> String {
        if value.is_nan() {
            return UNKNOWN.into();
        }
        if value.is_infinite() {
            return if value > 0.0 { "∞".into() } else { format!("{MINUS}∞") };
        }
        let rounded = self.round(value);
        let magnitude = match self {
            Digits::Decimals(n) => group(&format!("{:.*}", n, rounded.abs())),
            Digits::Significant(n) if rounded != 0.0 && !PLAIN_POWERS.contains(&power(rounded)) => {
                format!("{:.*e}", n.max(1) - 1, rounded.abs()).replace('-', "−")
            }
            Digits::Significant(_) => group(&format!("{:.*}", self.decimals(rounded), rounded.abs())),
        };
        if rounded < 0.0 { format!("{MINUS}{magnitude}") } else { magnitude }
    }

    /// `value` rounded to what is shown, so that a dragged setting is what the window says it is.
    pub fn round(self, value: f64) -> f64 {
        let places = match self {
            Digits::Decimals(n) => n as i32,
            Digits::Significant(_) if value == 0.0 || !value.is_finite() => return value,
            Digits::Significant(n) => (n as i32 - 1 - power(value)).max(0),
        };
        // Through text: it is the shortest way to the nearest double of a decimal number.
        let text = format!("{value:.*}", places.min(MAX_PLACES) as usize);
        text.parse().expect("a formatted number parses")
    }

    /// The value of one unit of the last digit shown at `value`.
    pub fn unit(self, value: f64) -> f64 {
        10f64.powi(-match self {
            Digits::Decimals(n) => n as i32,
            Digits::Significant(n) if value == 0.0 || !value.is_finite() => n as i32 - 1,
            Digits::Significant(n) => (n as i32 - 1 - power(value)).max(0),
        })
    }

    fn decimals(self, value: f64) -> usize {
        match self {
            Digits::Decimals(n) => n,
            Digits::Significant(n) if value == 0.0 => n - 1,
            Digits::Significant(n) => (n as i32 - 1 - power(value)).max(0) as usize,
        }
    }
}

/// A double has no more decimal places than this.
const MAX_PLACES: i32 = 300;

/// The power of ten of the first digit of a finite, non-zero value.
fn power(value: f64) -> i32 {
    // The exponent of the scientific form is exact, where the floor of a logarithm is not.
    let text = format!("{value:e}");
    text.split('e').nth(1).and_then(|e| e.parse().ok()).expect("a formatted number has an exponent")
}

/// Thin spaces between groups of three whole digits, from four digits on.
fn group(digits: &str) -> String {
    let whole = digits.find('.').unwrap_or(digits.len());
    let mut out = String::with_capacity(digits.len() + 4);
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && i < whole && (whole - i).is_multiple_of(3) {
            out.push(THIN_SPACE);
        }
        out.push(c);
    }
    out
}

/// The number that a person typed: spaces between thousands, a typographic minus, a decimal comma, a fraction `a/b`
/// and the field's own `unit` at the end are all understood. `None` for anything else, and for NaN and infinities.
pub fn parse(text: &str, unit: &str) -> Option<f64> {
    let text = text.trim();
    let text = if unit.is_empty() { text } else { text.strip_suffix(unit).unwrap_or(text) };
    let mut text: String =
        text.chars().filter(|c| !c.is_whitespace()).map(|c| if c == MINUS { '-' } else { c }).collect();
    if !text.contains('.') && text.matches(',').count() == 1 {
        text = text.replace(',', ".");
    }
    let value = match text.split_once('/') {
        Some((a, b)) => a.parse::<f64>().ok()? / b.parse::<f64>().ok()?,
        None => text.parse().ok()?,
    };
    value.is_finite().then_some(value)
}

/// How the values of a range lie along the slider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// By their logarithm, for more than two decades; the range starts above 0.
    Log,
    /// By −log₁₀(1 − x): each nine of an albedo takes the same way. The range ends below 1.
    OneMinusLog,
}

impl Scale {
    fn warp(self, value: f64) -> f64 {
        match self {
            Scale::Linear => value,
            Scale::Log => value.log10(),
            Scale::OneMinusLog => -(1.0 - value).log10(),
        }
    }

    fn unwarp(self, y: f64) -> f64 {
        match self {
            Scale::Linear => y,
            Scale::Log => 10f64.powf(y),
            Scale::OneMinusLog => 1.0 - 10f64.powf(-y),
        }
    }

    /// The place of `value` along `range`, 0 … 1; values outside lie at the ends.
    pub fn position(self, value: f64, range: &RangeInclusive<f64>) -> f64 {
        let (start, end) = (*range.start(), *range.end());
        let (a, b) = (self.warp(start), self.warp(end));
        ((self.warp(value.clamp(start, end)) - a) / (b - a)).clamp(0.0, 1.0)
    }

    /// The value at the place `t`, 0 … 1, along `range`.
    pub fn value(self, t: f64, range: &RangeInclusive<f64>) -> f64 {
        let (a, b) = (self.warp(*range.start()), self.warp(*range.end()));
        self.unwarp(a + t * (b - a)).clamp(*range.start(), *range.end())
    }

    /// The places of the notches: decades of the scale, or 0 of a linear range with two sides. None at the ends.
    pub fn notches(self, range: &RangeInclusive<f64>) -> Vec<f64> {
        let (start, end) = (*range.start(), *range.end());
        let inside = |t: &f64| (0.001..0.999).contains(t);
        match self {
            Scale::Linear if start < 0.0 && end > 0.0 => vec![self.position(0.0, range)],
            Scale::Linear => Vec::new(),
            Scale::Log | Scale::OneMinusLog => {
                let (a, b) = (self.warp(start), self.warp(end));
                let decades = a.ceil() as i32..=b.floor() as i32;
                decades.map(|d| (f64::from(d) - a) / (b - a)).filter(inside).collect()
            }
        }
    }

    /// Where `channel` goes when the leading channel moves from `from` to `to` and colours keep their ratio: ratios of
    /// the values, on [`Scale::OneMinusLog`] ratios of the distances to 1.
    pub fn together(self, from: f64, to: f64, channel: f64) -> f64 {
        let scaled = |from: f64, to: f64, x: f64| if from == 0.0 { to } else { x * to / from };
        match self {
            Scale::Linear | Scale::Log => scaled(from, to, channel),
            Scale::OneMinusLog => 1.0 - scaled(1.0 - from, 1.0 - to, 1.0 - channel),
        }
    }
}

/// `text` cut in the middle with "…" until `fits` says that it does; the end is kept, for the extension.
pub fn elide_middle(text: &str, fits: impl Fn(&str) -> bool) -> String {
    if fits(text) {
        return text.into();
    }
    let chars: Vec<char> = text.chars().collect();
    (1..chars.len())
        .rev()
        .map(|keep| {
            let tail = keep / 2;
            let head: String = chars[..keep - tail].iter().collect();
            let tail: String = chars[chars.len() - tail..].iter().collect();
            format!("{head}…{tail}")
        })
        .find(|short| fits(short))
        .unwrap_or_else(|| "…".into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_shown_with_their_digits() {
        let decimals = |n, v| Digits::Decimals(n).format(v);
        assert_eq!(decimals(3, 0.85), "0.850");
        assert_eq!(decimals(2, -0.3), "−0.30");
        assert_eq!(decimals(1, -0.001), "0.0", "no minus before a zero");
        assert_eq!(decimals(0, 1876.0), "1\u{2009}876");
        assert_eq!(decimals(1, 1234567.25), "1\u{2009}234\u{2009}567.2");
        let significant = |n, v| Digits::Significant(n).format(v);
        assert_eq!(significant(3, 40.0), "40.0");
        assert_eq!(significant(3, 0.08123), "0.0812");
        assert_eq!(significant(3, 9.999), "10.0");
        assert_eq!(significant(3, 48112.0), "48\u{2009}112");
        assert_eq!(significant(3, 0.0), "0.00");
        assert_eq!(significant(3, -1.234e-7), "−1.23e−7");
        assert_eq!(significant(3, f64::NAN), UNKNOWN);
    }

    #[test]
    fn rounding_gives_what_is_shown() {
        assert_eq!(Digits::Decimals(3).round(0.84951), 0.85);
        assert_eq!(Digits::Significant(3).round(41.4999), 41.5);
        assert_eq!(Digits::Significant(3).round(1876.4), 1876.0);
        assert_eq!(Digits::Significant(3).round(1.2345e-6), 1.23e-6);
        assert_eq!(Digits::Significant(3).unit(41.5), 0.1);
        assert_eq!(Digits::Decimals(5).unit(0.999), 1e-5);
    }

    #[test]
    fn typed_numbers_are_understood() {
        assert_eq!(parse("40", ""), Some(40.0));
        assert_eq!(parse(" −0,3 ", ""), Some(-0.3));
        assert_eq!(parse("1\u{2009}876.5", ""), Some(1876.5));
        assert_eq!(parse("40.0 1/unit", "1/unit"), Some(40.0));
        assert_eq!(parse("1/4", ""), Some(0.25));
        assert_eq!(parse("1e-3", ""), Some(1e-3));
        for bad in ["", "abc", "1.2.3", "nan", "inf", "1/0", "1,000,000"] {
            assert_eq!(parse(bad, ""), None, "{bad}");
        }
    }

    #[test]
    fn shown_numbers_can_be_typed_again() {
        for digits in [Digits::Decimals(3), Digits::Significant(4)] {
            for v in [-1234.5, 0.25, 98765.0, 3e-9, -0.5] {
                assert_eq!(parse(&digits.format(v), ""), Some(digits.round(v) + 0.0), "{v}");
            }
        }
    }

    #[test]
    fn scales_go_there_and_back() {
        let cases = [(Scale::Linear, -0.999..=0.999), (Scale::Log, 0.01..=1e4), (Scale::OneMinusLog, 0.0..=0.99999)];
        for (scale, range) in cases {
            for i in 0..=10 {
                let t = f64::from(i) / 10.0;
                let back = scale.position(scale.value(t, &range), &range);
                assert!((back - t).abs() < 1e-9, "{scale:?} {t} {back}");
            }
            assert_eq!(scale.position(*range.start() - 1.0, &range), 0.0);
            assert_eq!(scale.position(*range.end() + 1.0, &range), 1.0);
        }
        assert!((Scale::OneMinusLog.position(0.999, &(0.0..=0.99999)) - 0.6).abs() < 1e-9);
    }

    #[test]
    fn notches_mark_decades_and_zero() {
        assert_eq!(Scale::Linear.notches(&(-1.0..=1.0)), [0.5]);
        assert!(Scale::Linear.notches(&(0.0..=1.0)).is_empty());
        let near = |a: Vec<f64>, b: &[f64]| a.len() == b.len() && a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9);
        assert!(near(Scale::Log.notches(&(0.1..=100.0)), &[1.0 / 3.0, 2.0 / 3.0]));
        assert!(near(Scale::OneMinusLog.notches(&(0.0..=0.99999)), &[0.2, 0.4, 0.6, 0.8]));
    }

    #[test]
    fn channels_keep_their_ratio() {
        assert_eq!(Scale::Linear.together(2.0, 4.0, 1.0), 2.0);
        assert_eq!(Scale::Log.together(0.0, 3.0, 0.0), 3.0);
        let moved = Scale::OneMinusLog.together(0.9, 0.99, 0.8);
        assert!((moved - 0.98).abs() < 1e-12, "{moved}");
    }

    #[test]
    fn long_names_lose_their_middle() {
        let short = elide_middle("a_very_long_cloud_0001.vdb", |s| s.chars().count() <= 12);
        assert_eq!(short, "a_very…1.vdb");
        assert_eq!(elide_middle("short", |_| true), "short");
        assert_eq!(elide_middle("none fits", |_| false), "…");
    }
}
