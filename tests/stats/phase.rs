//! Phase functions: samples follow the density, the density is the formula and integrates to one.

use std::f64::consts::{PI, TAU};

use nephele::scene::{Analytic, Phase, Scene};

use super::probe::{self, Probe};
use super::support::statistics::{uniform, z_of};
use super::support::{Adapter, adapter, plant};
use super::*;

const SAMPLES: usize = 1 << 18;
const BINS: usize = 64;

/// A phase function in closed form.
#[derive(Clone, Copy, Debug)]
enum Law {
    Isotropic,
    Rayleigh,
    Hg(f64),
    TwoLobe(f64, f64, f64),
}

impl Law {
    /// Per steradian.
    fn value(self, c: f64) -> f64 {
        match self {
            Law::Isotropic => 0.25 / PI,
            Law::Rayleigh => 3.0 * (1.0 + c * c) / (16.0 * PI),
            Law::Hg(g) => (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * c).powf(1.5)),
            Law::TwoLobe(g, g2, w) => w * Law::Hg(g).value(c) + (1.0 - w) * Law::Hg(g2).value(c),
        }
    }

    /// Chance of a cosine below c.
    fn below(self, c: f64) -> f64 {
        match self {
            Law::Isotropic => 0.5 * (1.0 + c),
            Law::Rayleigh => (4.0 + 3.0 * c + c * c * c) / 8.0,
            Law::Hg(g) if g.abs() < 1e-3 => {
                // To first order in g, where the closed form has no digits.
                0.5 * (1.0 + c) + 0.75 * g * (c * c - 1.0)
            }
            Law::Hg(g) => (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 + g * g - 2.0 * g * c).sqrt() - 1.0 / (1.0 + g)),
            Law::TwoLobe(g, g2, w) => w * Law::Hg(g).below(c) + (1.0 - w) * Law::Hg(g2).below(c),
        }
    }

    fn moments(self) -> (f64, f64) {
        match self {
            Law::Isotropic => (0.0, 1.0 / 3.0),
            Law::Rayleigh => (0.0, 0.4),
            Law::Hg(g) => (g, (1.0 + 2.0 * g * g) / 3.0),
            Law::TwoLobe(g, g2, w) => {
                let ((a, b), (p, q)) = (Law::Hg(g).moments(), Law::Hg(g2).moments());
                (w * a + (1.0 - w) * p, w * b + (1.0 - w) * q)
            }
        }
    }

    /// Error that 32-bit floats leave in the value: the denominator of a lobe loses digits towards its peak.
    fn rounding(self, c: f64) -> f64 {
        let lobe = |g: f64| 2e-6 + 1.5 * 5e-7 / (1.0 + g * g - 2.0 * g * c);
        match self {
            Law::Isotropic | Law::Rayleigh => 2e-6,
            Law::Hg(g) => lobe(g),
            Law::TwoLobe(g, g2, _) => lobe(g).max(lobe(g2)),
        }
    }

    fn scene(self) -> Scene {
        let mut scene = Scene::default();
        scene.volume.analytic = Analytic::Homogeneous;
        let medium = &mut scene.medium;
        medium.phase = match self {
            Law::Isotropic => Phase::Isotropic,
            Law::Rayleigh => Phase::Rayleigh,
            Law::Hg(g) => {
                medium.g = g;
                Phase::Hg
            }
            Law::TwoLobe(g, g2, weight) => {
                (medium.g, medium.g2, medium.lobe_weight) = (g, g2, weight);
                Phase::TwoLobeHg
            }
        };
        scene
    }

    /// Cosines of a probe: its own samples with their values, and the values at `SAMPLES` angles from 0 to π.
    fn probe(self, a: &Adapter, source: &Source) -> Vec<[f32; 4]> {
        let inputs: Vec<[f32; 4]> = (0..SAMPLES).map(|i| [angle(i).cos() as f32, 0.0, 0.0, 0.0]).collect();
        Probe::new(&a.gpu, &self.scene()).run(source, "phase", &inputs, SAMPLES, 1, probe::sample(1))
    }

    fn checks(self, a: &Adapter, source: &Source) -> Vec<Check> {
        let found = self.probe(a, source);
        let cosines = || found.iter().map(|v| f64::from(v[0]));
        let (mean, square) = self.moments();
        vec![
            (format!("χ² of {self:?}"), uniform(cosines().map(|c| self.below(c)), BINS)),
            (format!("mean cosine of {self:?}"), z_of(cosines(), mean)),
            (format!("mean square of {self:?}"), z_of(cosines().map(|c| c * c), square)),
        ]
    }
}

fn angle(i: usize) -> f64 {
    PI * (i as f64 + 0.5) / SAMPLES as f64
}

const LAWS: [Law; 11] = [
    Law::Isotropic,
    Law::Rayleigh,
    Law::Hg(0.0),
    Law::Hg(1e-4),
    Law::Hg(0.3),
    Law::Hg(-0.499),
    Law::Hg(0.5),
    Law::Hg(0.85),
    Law::Hg(-0.99),
    Law::TwoLobe(0.85, -0.3, 0.5),
    Law::TwoLobe(0.6, 0.2, 0.9),
];

#[test]
fn cosines_follow_the_density() {
    let Some(a) = adapter() else { return };
    for law in LAWS {
        all_hold(&law.checks(&a, &standard()));
    }
    let plants = [
        (Law::Hg(0.85), "phase/hg", "lobe_drop(params.g, ", "lobe_drop(-params.g, "),
        (Law::Hg(0.85), "phase/hg", "lobe_drop(params.g, ", "lobe_drop(0.99 * params.g, "),
        (Law::Hg(0.3), "phase/lobe", "p * a * a", "p * a * a * 1.01"),
        (Law::Hg(0.3), "phase/lobe", "let p = 2.0 * (1.0 - xi);", "let p = 2.0 * (1.0 - xi * xi);"),
        (Law::Isotropic, "phase/isotropic", "2.0 * rng_next(rng)", "1.96 * rng_next(rng)"),
        (Law::Rayleigh, "phase/rayleigh", "1.0 / 3.0)", "0.3)"),
        (Law::TwoLobe(0.6, 0.2, 0.9), "phase/two_lobe_hg", "rng_next(rng) < params", "rng_next(rng) > params"),
        (Law::TwoLobe(0.85, -0.3, 0.5), "phase/two_lobe_hg", "< params.lobe_weight", "< 0.98 * params.lobe_weight"),
    ];
    for (law, file, from, to) in plants {
        one_sees(&format!("{law:?}: {to}"), &law.checks(&a, &plant(file, from, to).source));
    }
}

/// The greatest error of the values over what rounding allows, at sampled cosines and at given ones, and the integral.
fn values(law: Law, found: &[[f32; 4]]) -> (f64, f64) {
    let worst = |c: f64, value: f32| {
        let exact = law.value(c);
        (f64::from(value) / exact - 1.0).abs() / law.rounding(c)
    };
    let mut greatest = 0.0f64;
    let mut integral = 0.0;
    for (i, v) in found.iter().enumerate() {
        let given = f64::from(angle(i).cos() as f32);
        greatest = greatest.max(worst(f64::from(v[0]), v[1])).max(worst(given, v[2]));
        integral += f64::from(v[2]) * angle(i).sin() * TAU * PI / SAMPLES as f64;
    }
    (greatest, integral)
}

#[test]
fn values_are_the_formula_and_integrate_to_one() {
    let Some(a) = adapter() else { return };
    for law in LAWS {
        let (greatest, integral) = values(law, &law.probe(&a, &standard()));
        assert!(greatest < 1.0, "{law:?}: a value is {greatest:.2} times rounding off");
        assert!((integral - 1.0).abs() < 2e-4, "{law:?} integrates to {integral}");
    }
    let plants = [
        (Law::Hg(0.85), "phase/lobe", "return (1.0 - g * g)", "return 0.999 * (1.0 - g * g)"),
        (Law::Hg(0.3), "phase/lobe", "- 2.0 * g * cos_theta", "+ 2.0 * g * cos_theta"),
        (Law::Isotropic, "phase/isotropic", "0.25 / MATH_PI", "0.2502 / MATH_PI"),
        (Law::Rayleigh, "phase/rayleigh", "(1.0 + cos_theta * cos_theta)", "(1.0 + 0.99 * cos_theta * cos_theta)"),
        (Law::TwoLobe(0.6, 0.2, 0.9), "phase/two_lobe_hg", "lobe_value(params.g2, cos_theta), ", "0.08, "),
    ];
    for (law, file, from, to) in plants {
        let (greatest, _) = values(law, &law.probe(&a, &plant(file, from, to).source));
        assert!(greatest > 8.0, "{law:?}: {to} is not seen: {greatest}");
    }
}
