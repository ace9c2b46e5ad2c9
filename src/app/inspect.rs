//! The pixel inspector: a magnified piece of the film round the pointer, and the numbers of the pixel in its middle. It
//! reads a few pixels a few times a second; the picture goes on.

use egui::{Rect, Ui};

use super::widgets::{Digits, Loupe, LoupeLine, LoupePixel, SIDE};
use crate::error::Result;
use crate::image::tone::{Display, LUMINANCE};
use crate::render::Renderer;
use crate::render::heat::{self, Needs};
use crate::render::peek::Patch;
use crate::scene::Overlay;

/// Pixels to either side of the one that is inspected.
const RADIUS: u32 = SIDE as u32 / 2;
/// Seconds between two readings of the same pixel.
const EVERY: f64 = 0.25;
/// Digits of numbers.
const FIGURES: Digits = Digits::Significant(4);

/// The inspector's state.
#[derive(Default)]
pub struct Inspector {
    /// It is shown.
    pub on: bool,
    /// The place that it is held at, as shares of the picture; else it follows the pointer.
    held: Option<(f64, f64)>,
    last: Option<(f64, f64)>,
    read: Option<Reading>,
}

/// Pixels as they were read.
struct Reading {
    pixel: (u32, u32),
    patch: Patch,
    at: f64,
}

impl Inspector {
    /// On or off.
    pub fn toggle(&mut self) {
        *self = Inspector { on: !self.on, ..Inspector::default() };
    }

    /// Shows the card in `place`. `pointer` is where the pointer is over the picture, as shares of its sides; `clicked`
    /// there holds the pixel or lets it go. Costs are counted while the inspector is on. An error where that cannot be;
    /// then it is off.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        place: Rect,
        pointer: Option<(f64, f64)>,
        clicked: bool,
        renderer: &mut Renderer,
        now: f64,
    ) -> Result<()> {
        if let Err(e) = renderer.count_cost(self.on) {
            self.on = false;
            return Err(e);
        }
        if !self.on {
            return Ok(());
        }
        self.last = pointer.or(self.last);
        if clicked {
            self.held = if self.held.is_some() { None } else { self.last };
        }
        let Some(at) = self.held.or(self.last) else { return Ok(()) };
        let pixel = pixel_at(at, renderer.size());
        let fresh = self.read.as_ref().is_some_and(|r| r.pixel == pixel && now - r.at < EVERY);
        if !fresh {
            let patch = Patch::read(&renderer.gpu, &renderer.film, renderer.reservoirs(), pixel, RADIUS)?;
            self.read = Some(Reading { pixel, patch, at: now });
        }
        let Some(read) = &self.read else { return Ok(()) };
        let display = Display::of(&renderer.scene.display);
        let lines = lines(&read.patch, read.pixel, &display);
        let loupe =
            Loupe { pixels: &pixels(&read.patch, read.pixel, &display), lines: &lines, frozen: self.held.is_some() };
        if loupe.show(ui, place) {
            let text = lines.iter().map(|line| format!("{}\t{}\n", line.caption, line.value)).collect();
            ui.ctx().copy_text(text);
        }
        ui.ctx().request_repaint_after_secs(EVERY as f32);
        Ok(())
    }
}

/// The pixel at a place, given as shares of a picture of `size`.
fn pixel_at((x, y): (f64, f64), (width, height): (u32, u32)) -> (u32, u32) {
    let at = |share: f64, n: u32| ((share * f64::from(n)).floor().max(0.0) as u32).min(n - 1);
    (at(x, width), at(y, height))
}

/// Whether something of a pixel of the patch was not finite.
fn is_broken(patch: &Patch, place: usize) -> bool {
    let sums = &patch.sums;
    let odd = sums.sum[place].iter().chain(&sums.square[place]).any(|x| !x.is_finite());
    odd || sums.cost.get(place).is_some_and(|cost| cost.nonfinite > 0)
}

/// The magnified pixels round `pixel`.
pub fn pixels(patch: &Patch, pixel: (u32, u32), display: &Display) -> Vec<LoupePixel> {
    let side = 2 * RADIUS + 1;
    let one = |i: u32| {
        let at = |centre: u32, offset: u32| (centre + offset).checked_sub(RADIUS);
        let place = at(pixel.0, i % side).zip(at(pixel.1, i / side)).and_then(|p| patch.place(p));
        match place {
            None => LoupePixel::Outside,
            Some(p) if patch.sums.square[p][3] == 0.0 => LoupePixel::Outside,
            Some(p) if is_broken(patch, p) => LoupePixel::Broken,
            Some(p) => LoupePixel::Colour(display.apply(patch.sums.mean(p).map(|x| x as f32))),
        }
    };
    (0..side * side).map(one).collect()
}

/// The numbers of `pixel`.
pub fn lines(patch: &Patch, pixel: (u32, u32), display: &Display) -> Vec<LoupeLine> {
    let Some(p) = patch.place(pixel) else { return Vec::new() };
    let sums = &patch.sums;
    let mut lines = Vec::new();
    let mut add = |caption, value: String, caution| lines.push(LoupeLine { caption, value, caution });
    let figure = |x: f64| FIGURES.format(x);
    let three = |c: [f64; 3]| c.map(|x| Digits::Significant(3).format(x)).join(" ");
    let samples = sums.square[p][3];
    add("Pixel", format!("{}, {}", pixel.0, pixel.1), false);
    add("Samples", Digits::Decimals(0).format(samples), false);
    if is_broken(patch, p) {
        add("Broken", "not finite".into(), true);
    }
    if samples > 0.0 {
        let mean = sums.mean(p);
        let luminance: f64 = mean.iter().zip(LUMINANCE).map(|(x, w)| x * f64::from(w)).sum();
        add("Linear", three(mean), false);
        add("Luminance", figure(luminance), false);
        add("On screen", display.apply_8bit(mean.map(|x| x as f32)).map(|x| x.to_string()).join(" "), false);
        if let Some(variance) = sums.variance(p) {
            add("Variance", three(variance), false);
            let [error, level] = [variance, mean].map(|c| c.iter().sum::<f64>() / 3.0);
            add("Error", format!("{} %", figure(100.0 * error.sqrt() / level)), false);
        }
        add("Transmittance", figure(1.0 - sums.sum[p][3] / samples), false);
    }
    if let [near, far] = sums.extra.get(2 * p..2 * p + 2).unwrap_or_default() {
        let hits = sums.sum[p][3].max(1.0);
        let mean = near[3] / hits;
        add("Depth", format!("{} ± {}", figure(mean), figure((far[3] / hits - mean * mean).max(0.0).sqrt())), false);
    }
    let cost = sums.cost.get(p).copied().unwrap_or_default();
    if cost.samples > 0 {
        let per = |count| figure(cost.per_sample(count).unwrap_or(f64::NAN));
        add("Lookups", per(cost.lookups), false);
        add("Cell steps", per(cost.steps), false);
        add("Null share", figure(cost.null_share().unwrap_or(f64::NAN)), false);
        add("Collisions", per(cost.reals), false);
        add("Shadow rays", per(cost.shadows), false);
        if cost.violations > 0 {
            add("Above bound", cost.violations.to_string(), true);
        }
        if cost.nonfinite > 0 {
            add("Not finite", cost.nonfinite.to_string(), true);
        }
    }
    for &overlay in Overlay::ALL {
        let look = heat::look(overlay).filter(|look| look.needs == Needs::Reservoirs);
        let Some((look, value)) = look.zip(heat::value(sums, overlay, p)) else { continue };
        let text = match look.names().get(value as usize) {
            Some((name, _)) => (*name).to_owned(),
            None => format!("{} {}", figure(value * look.factor), look.unit).trim_end().to_owned(),
        };
        lines.push(LoupeLine { caption: look.name, value: text, caution: false });
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::film::{Cost, Sums};

    /// Two by two pixels of 4 samples in the low corner of a picture; the last one is not a number.
    fn patch() -> Patch {
        let nan = f64::NAN;
        let cost = Cost { lookups: 40, steps: 80, nulls: 3, reals: 1, shadows: 2, samples: 4, ..Cost::default() };
        Patch {
            corner: (0, 0),
            sums: Sums {
                width: 2,
                height: 2,
                sum: vec![[4.0, 2.0, 0.0, 1.0], [0.0; 4], [0.0; 4], [nan, 0.0, 0.0, 0.0]],
                square: vec![[4.0, 4.0, 0.0, 4.0], [0.0, 0.0, 0.0, 4.0], [0.0, 0.0, 0.0, 4.0], [0.0, 0.0, 0.0, 4.0]],
                extra: Vec::new(),
                cost: vec![cost, Cost { nonfinite: 1, violations: 2, ..cost }, cost, Cost::default()],
                reservoirs: Vec::new(),
            },
        }
    }

    fn value(lines: &[LoupeLine], caption: &str) -> Option<String> {
        lines.iter().find(|l| l.caption == caption).map(|l| l.value.clone())
    }

    #[test]
    fn numbers_are_those_of_the_pixel() {
        let display = Display::default();
        let lines = lines(&patch(), (0, 0), &display);
        let has = |caption: &str, text: &str| assert_eq!(value(&lines, caption).as_deref(), Some(text));
        has("Samples", "4");
        has("Linear", "1.00 0.500 0.00");
        has("Luminance", "0.5702");
        // Of the mean: (4/4 − 0.5²) / 3 for green.
        has("Variance", "0.00 0.250 0.00");
        has("Transmittance", "0.7500");
        has("Lookups", "10.00");
        has("Cell steps", "20.00");
        has("Null share", "0.7500");
        assert_eq!(value(&lines, "Depth"), None, "no layers are kept");
        assert!(lines.iter().all(|l| !l.caution));
    }

    #[test]
    fn what_a_pixel_keeps_is_listed_where_it_keeps_something() {
        let mut patch = patch();
        let word = f32::to_bits;
        // W = 3, target 0.5, of a neighbour, drawn 7 frames ago, for 18 samples.
        let kept: [u32; 8] = [0, 0, word(3.0), word(0.5), 0, 0, 1 | (2 << 4) | (7 << 8), word(18.0)];
        patch.sums.reservoirs = bytemuck::cast_slice(&[kept, [0; 8], [0; 8], [0; 8]]).to_vec();
        let lines = |pixel| lines(&patch, pixel, &Display::default());
        for (caption, text) in [
            ("Confidence", "18.00 samples"),
            ("Path age", "7.000 frames"),
            ("Path source", "neighbour"),
            ("Path weight", "1.500"),
        ] {
            assert_eq!(value(&lines((0, 0)), caption).as_deref(), Some(text));
            assert_eq!(value(&lines((1, 0)), caption), None, "nothing is kept there");
        }
    }

    #[test]
    fn what_is_not_finite_is_flagged() {
        let display = Display::default();
        for (pixel, flagged) in [((0, 0), false), ((1, 0), true), ((1, 1), true)] {
            let lines = lines(&patch(), pixel, &display);
            assert_eq!(value(&lines, "Broken").is_some(), flagged, "{pixel:?}");
        }
        assert_eq!(value(&lines(&patch(), (1, 0), &display), "Above bound").as_deref(), Some("2"));
        let around = pixels(&patch(), (1, 1), &display);
        let middle = SIDE * SIDE / 2;
        assert_eq!(around.len(), SIDE * SIDE);
        assert_eq!((around[middle], around[middle - SIDE]), (LoupePixel::Broken, LoupePixel::Broken));
        assert!(matches!(around[middle - SIDE - 1], LoupePixel::Colour(_)), "left and up");
        assert_eq!((around[middle + 1], around[0]), (LoupePixel::Outside, LoupePixel::Outside));
    }

    #[test]
    fn the_pointer_finds_its_pixel_at_any_scale() {
        assert_eq!(pixel_at((0.0, 0.999), (70, 21)), (0, 20));
        assert_eq!(pixel_at((1.0, 1.0), (70, 21)), (69, 20));
        assert_eq!(pixel_at((0.5, -0.1), (35, 10)), (17, 0));
    }
}
