//! The phase function as a polar plot: where light that comes from the left goes on to.

use std::f32::consts::PI;

use egui::{Align2, Color32, Mesh, Pos2, Role, Sense, Shape, Stroke, Ui, WidgetInfo, pos2, vec2};

use super::number::Digits;
use super::text_at;
use crate::app::theme::{Theme, Type, size};

/// A phase function: the density per steradian for the cosine between the two travel directions.
#[derive(Clone, Copy)]
pub struct PhasePlot<'a> {
    /// p(cos θ), 1/sr.
    pub phase: &'a dyn Fn(f32) -> f32,
}

/// What the plot tells in numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Figures {
    /// The integral over the sphere; 1 for a phase function.
    total: f32,
    /// The share of light that goes on within 90° of its way.
    forward: f32,
    /// The mean cosine.
    cosine: f32,
    /// p(0°) / p(180°).
    ratio: f32,
}

/// Height of the plot.
const HEIGHT: f32 = 100.0;
/// Radius of the outer ring: the largest value.
const RADIUS: f32 = 49.0;
/// Centre from the panel's left.
const CENTRE: f32 = 108.0;
/// The arrow of light, from the panel's left to before the centre.
const ARROW: f32 = 34.0;
const ARROW_END: f32 = 19.0;
const ARROW_HEAD: f32 = 4.0;
/// The first line of figures from the centre, and the distance of the lines.
const FIGURES: f32 = -26.0;
const FIGURE_PITCH: f32 = 19.0;
/// Where the captions of figures begin, and the least room that they and the numbers need.
const CAPTIONS: f32 = 188.0;
const FIGURES_ROOM: f32 = 124.0;
/// Each ring is a factor of ten; there are at least and at most this many.
const RINGS: std::ops::RangeInclusive<u32> = 3..=6;
/// Intervals of the curve and of the integrals, from 0° to 180°; they crowd towards 0°, where forward peaks are.
const INTERVALS: usize = 256;
/// Opacity of the lobe.
const LOBE: f32 = 0.28;
/// An integral farther from 1 than this is shown: the function is no phase function.
const TOLERANCE: f32 = 0.01;

impl PhasePlot<'_> {
    /// Shows the plot across the panel.
    pub fn show(&self, ui: &mut Ui) {
        let theme = Theme::of(ui);
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), HEIGHT), Sense::hover());
        let curve: Vec<(f32, f32)> =
            (0..=INTERVALS).map(angle).map(|theta| (theta, (self.phase)(theta.cos()).max(0.0))).collect();
        let figures = figures(&curve);
        let lines = [
            ("forward half", format!("{} %", Digits::Decimals(1).format(f64::from(100.0 * figures.forward)))),
            ("backward half", format!("{} %", Digits::Decimals(1).format(f64::from(100.0 * (1.0 - figures.forward))))),
            ("mean angle", format!("{}°", Digits::Decimals(1).format(f64::from(figures.cosine.acos().to_degrees())))),
            ("p(0°) / p(180°)", Digits::Significant(3).format(f64::from(figures.ratio))),
        ];
        response.widget_info(|| {
            let text: Vec<String> = lines.iter().map(|(caption, value)| format!("{caption} {value}")).collect();
            WidgetInfo::labeled(Role::Image, true, format!("Phase function: {}", text.join(", ")))
        });
        if !ui.is_rect_visible(rect) {
            return;
        }
        let centre = pos2(rect.left() + CENTRE, rect.center().y);
        let radii = radii(&curve);
        let painter = ui.painter();
        let rings = rings(&curve);
        for ring in 1..=rings {
            painter.circle_stroke(centre, RADIUS * ring as f32 / rings as f32, Stroke::new(1.0, theme.line));
        }
        let (from, to) = (pos2(rect.left() + ARROW, centre.y), pos2(centre.x - ARROW_END, centre.y));
        let stroke = Stroke::new(1.0, theme.edge);
        let y = painter.round_to_pixel_center(centre.y);
        painter.hline(from.x..=to.x, y, stroke);
        for side in [-1.0, 1.0] {
            painter.line_segment([to, pos2(to.x - ARROW_HEAD - 1.0, y + side * ARROW_HEAD)], stroke);
        }
        let left = rect.left() + size::PADDING;
        text_at(ui, pos2(left, centre.y - 10.0), Align2::LEFT_CENTER, "light", Type::Caption, theme.text3);
        text_at(ui, pos2(left, centre.y + 42.0), Align2::LEFT_CENTER, "log", Type::Caption, theme.text3);
        lobe(ui, centre, &radii, theme.accent);
        painter.circle_filled(centre, size::DOT, theme.text);
        let right = rect.right() - size::PADDING;
        let captions = (rect.left() + CAPTIONS).min(right - FIGURES_ROOM);
        for (i, (caption, value)) in lines.iter().enumerate() {
            let y = centre.y + FIGURES + FIGURE_PITCH * i as f32;
            text_at(ui, pos2(captions, y), Align2::LEFT_CENTER, caption, Type::Caption, theme.text3);
            text_at(ui, pos2(right, y), Align2::RIGHT_CENTER, value, Type::SmallValue, theme.text);
        }
        if (figures.total - 1.0).abs() > TOLERANCE {
            let text = format!("∫ p = {}, not 1", Digits::Significant(3).format(f64::from(figures.total)));
            text_at(ui, pos2(captions, centre.y - 45.0), Align2::LEFT_CENTER, text, Type::Caption, theme.warn);
        }
        response.on_hover_text("Each ring is a factor of ten; the outer one is the largest value.");
    }
}

/// The angle of node `i`, radians.
fn angle(i: usize) -> f32 {
    let u = i as f32 / INTERVALS as f32;
    PI * u * u
}

/// Integrals by Simpson's rule over the nodes' parameter u (θ = π u²), which is smooth where θ crowds.
fn figures(curve: &[(f32, f32)]) -> Figures {
    let (mut total, mut forward, mut cosine) = (0.0f64, 0.0f64, 0.0f64);
    // The step at 90° is blurred over this width of the cosine, so that the rule does not see an edge.
    const EDGE: f64 = 0.02;
    for (i, &(theta, p)) in curve.iter().enumerate() {
        let u = i as f64 / INTERVALS as f64;
        let weight = match i {
            0 | INTERVALS => 1.0,
            _ if i % 2 == 1 => 4.0,
            _ => 2.0,
        } / (3.0 * INTERVALS as f64);
        let theta = f64::from(theta);
        let dtheta = 2.0 * std::f64::consts::PI * u;
        let flux = weight * f64::from(p) * std::f64::consts::TAU * theta.sin() * dtheta;
        let c = theta.cos();
        total += flux;
        cosine += flux * c;
        forward += flux * (0.5 + c / (2.0 * EDGE)).clamp(0.0, 1.0);
    }
    let share = |x: f64| if total > 0.0 { (x / total) as f32 } else { f32::NAN };
    let (first, last) = (curve[0].1, curve[curve.len() - 1].1);
    Figures {
        total: total as f32,
        forward: share(forward),
        cosine: share(cosine).clamp(-1.0, 1.0),
        ratio: first / last,
    }
}

/// How many factors of ten the plot spans.
fn rings(curve: &[(f32, f32)]) -> u32 {
    let most = curve.iter().map(|p| p.1).fold(0.0, f32::max);
    let least = curve.iter().map(|p| p.1).filter(|p| *p > 0.0).fold(most, f32::min);
    let decades = if least > 0.0 { (most / least).log10() } else { 0.0 };
    // A little more than the decades needed, so that the smallest value is not lost in the centre.
    ((decades + 0.3).ceil() as u32).clamp(*RINGS.start(), *RINGS.end())
}

/// Angles and radii of the lobe's upper half.
fn radii(curve: &[(f32, f32)]) -> Vec<(f32, f32)> {
    let most = curve.iter().map(|p| p.1).fold(f32::MIN_POSITIVE, f32::max);
    let rings = rings(curve) as f32;
    let radius = |p: f32| if p > 0.0 { (1.0 + (p / most).log10() / rings).max(0.0) * RADIUS } else { 0.0 };
    curve.iter().map(|&(theta, p)| (theta, radius(p))).collect()
}

/// The lobe, filled as a fan about the centre (it need not be convex) and outlined.
fn lobe(ui: &Ui, centre: Pos2, radii: &[(f32, f32)], ink: Color32) {
    let point = |(theta, r): (f32, f32), side: f32| centre + vec2(r * theta.cos(), side * r * theta.sin());
    let upper = radii.iter().map(|&p| point(p, -1.0));
    let lower = radii.iter().rev().skip(1).map(|&p| point(p, 1.0));
    let outline: Vec<Pos2> = upper.chain(lower.take(radii.len().saturating_sub(2))).collect();
    let mut fan = Mesh::default();
    let fill = ink.gamma_multiply(LOBE);
    fan.colored_vertex(centre, fill);
    for &p in &outline {
        fan.colored_vertex(p, fill);
    }
    let n = outline.len() as u32;
    for i in 0..n {
        fan.add_triangle(0, 1 + i, 1 + (i + 1) % n);
    }
    ui.painter().add(Shape::mesh(fan));
    ui.painter().add(Shape::closed_line(outline, Stroke::new(1.5, ink)));
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(phase: impl Fn(f32) -> f32) -> Vec<(f32, f32)> {
        (0..=INTERVALS).map(angle).map(|theta| (theta, phase(theta.cos()))).collect()
    }

    fn henyey_greenstein(g: f32) -> impl Fn(f32) -> f32 {
        move |c| (1.0 - g * g) / (4.0 * PI * (1.0 + g * g - 2.0 * g * c).powf(1.5))
    }

    #[test]
    fn figures_are_those_of_the_closed_form() {
        for g in [-0.6f32, 0.0, 0.5, 0.85, 0.97] {
            let f = figures(&curve(henyey_greenstein(g)));
            assert!((f.total - 1.0).abs() < 2e-3, "{g} {f:?}");
            assert!((f.cosine - g).abs() < 2e-3, "{g} {f:?}");
            let forward =
                if g == 0.0 { 0.5 } else { (1.0 - g * g) / (2.0 * g) * (1.0 / (1.0 - g) - 1.0 / (1.0 + g * g).sqrt()) };
            assert!((f.forward - forward).abs() < 2e-3, "{g} {f:?} {forward}");
            let ratio = ((1.0 + g) / (1.0 - g)).powi(3);
            assert!((f.ratio / ratio - 1.0).abs() < 1e-3, "{g} {f:?} {ratio}");
        }
    }

    #[test]
    fn the_largest_value_touches_the_outer_ring() {
        let r = radii(&curve(henyey_greenstein(0.85)));
        assert!((r[0].1 - RADIUS).abs() < 1e-3);
        assert!(r[INTERVALS].1 > 0.0, "the smallest is not lost");
        assert_eq!(rings(&curve(|_| 1.0)), 3);
        assert_eq!(rings(&curve(henyey_greenstein(0.85))), 4);
        let flat = radii(&curve(|_| 0.08));
        assert!(flat.iter().all(|p| (p.1 - RADIUS).abs() < 1e-3));
    }
}
