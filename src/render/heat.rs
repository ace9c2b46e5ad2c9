//! Overlays as colours: what each shows of a pixel, on which scale, and from where to where. The window's shaders
//! (film/resolve, display/present) and the pictures of the command line show the same.

use crate::gpu::device::Gpu;
use crate::gpu::readback;
use crate::image::Image;
use crate::image::tone::{FALSE_COLOUR_GREY, FALSE_COLOUR_STOPS, ToneMap, decode_srgb};
use crate::scene::Overlay;

use super::film::Sums;
use super::params::Params;
use super::reservoir::Reservoir;

/// Pixels along a side that film/resolve keeps by themselves, at most.
const SPARSE: u32 = 64;
/// Share of the pixels beyond either end of the colours, so that a few odd ones do not take them all.
const OUTSIDE: f64 = 0.02;
/// A logarithmic scale spans at most this factor, and at least the square root of the other.
const MOST_SPAN: f64 = 1e4;
const LEAST_SPAN: f64 = 4.0;
/// Ends that moved by less than this factor stay, so that colours do not swim.
const STEADY: f64 = 1.1;
/// sRGB grey of a pixel of which nothing is known; that of shaders/display/present.wgsl.
const UNKNOWN: f32 = 0.25;
/// The least value with a logarithm, as there.
const LEAST: f64 = 1e-9;

/// What an overlay shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The quantity, for people.
    pub name: &'static str,
    /// Its unit; "" for a pure number.
    pub unit: &'static str,
    /// From the value to the number that is shown with that unit.
    pub factor: f64,
    /// How values become colours.
    pub scale: Scale,
    /// Where the scale begins and ends, if that does not depend on the picture.
    pub fixed: Option<[f64; 2]>,
    /// What it is made from.
    pub needs: Needs,
}

/// How values become colours. The numbers are those of shaders/display/present.wgsl.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// By the value itself, from 0.
    Even,
    /// By its logarithm.
    Log,
    /// Each whole number from 0 has a name and an sRGB colour.
    Names(&'static [(&'static str, [u8; 3])]),
}

/// What an overlay is made from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// The film's sums.
    Sums,
    /// What each pixel costs, which the film must count.
    Cost,
    /// The reservoirs of modes that reuse paths.
    Reservoirs,
}

impl Look {
    /// Words while nothing is known.
    pub fn waits(&self) -> &'static str {
        match self.needs {
            Needs::Sums | Needs::Cost => "counting begins",
            Needs::Reservoirs => "no frame has reused paths",
        }
    }

    /// Whether colours follow the logarithm.
    pub fn is_log(&self) -> bool {
        self.scale == Scale::Log
    }

    /// Names of the values and their colours, where they have some.
    pub fn names(&self) -> &'static [(&'static str, [u8; 3])] {
        if let Scale::Names(names) = self.scale { names } else { &[] }
    }
}

/// Where a pixel's path comes from. Colours that people of any colour vision tell apart (Okabe and Ito 2008), each lighter
/// than the one before; as in shaders/display/present.wgsl.
const SOURCES: &[(&str, [u8; 3])] =
    &[("none", [0, 0, 0]), ("its own", [0, 114, 178]), ("frame before", [230, 159, 0]), ("neighbour", [240, 228, 66])];

/// The look of an overlay; `None` for the picture itself.
pub fn look(overlay: Overlay) -> Option<Look> {
    let of = |needs, name| Look { name, unit: "", factor: 1.0, scale: Scale::Even, fixed: None, needs };
    let counted = |name| of(Needs::Cost, name);
    let kept = |name| of(Needs::Reservoirs, name);
    Some(match overlay {
        Overlay::None => return None,
        Overlay::Noise => Look { unit: "%", factor: 100.0, scale: Scale::Log, ..of(Needs::Sums, "Relative error") },
        Overlay::Samples => Look { scale: Scale::Log, ..of(Needs::Sums, "Samples") },
        Overlay::Lookups => counted("Lookups per sample"),
        Overlay::Steps => counted("Cell steps per sample"),
        Overlay::NullShare => Look { unit: "%", factor: 100.0, fixed: Some([0.0, 1.0]), ..counted("Null collisions") },
        Overlay::PathLength => counted("Collisions per sample"),
        Overlay::Confidence => Look { unit: "samples", ..kept("Confidence") },
        Overlay::Age => Look { unit: "frames", ..kept("Path age") },
        Overlay::Source => {
            let last = (SOURCES.len() - 1) as f64;
            Look { scale: Scale::Names(SOURCES), fixed: Some([0.0, last]), ..kept("Path source") }
        }
        Overlay::Weight => Look { scale: Scale::Log, ..kept("Path weight") },
    })
}

/// What an overlay shows of a pixel; `None` where that is not known.
pub fn value(sums: &Sums, overlay: Overlay, pixel: usize) -> Option<f64> {
    let cost = sums.cost.get(pixel).copied().unwrap_or_default();
    let kept = sums.reservoirs.get(pixel).filter(|kept| kept.confidence() > 0.0);
    match overlay {
        Overlay::None => None,
        Overlay::Noise => {
            /// Darker pixels count as this bright; as in film/resolve.
            const DARK: f64 = 1e-6;
            let variance = sums.variance(pixel)?.iter().sum::<f64>() / 3.0;
            Some(variance.sqrt() / (sums.mean(pixel).iter().sum::<f64>() / 3.0).max(DARK))
        }
        Overlay::Samples => Some(sums.square[pixel][3]),
        Overlay::Lookups => cost.per_sample(cost.lookups),
        Overlay::Steps => cost.per_sample(cost.steps),
        Overlay::NullShare => cost.null_share(),
        Overlay::PathLength => cost.per_sample(cost.reals),
        Overlay::Confidence => kept.map(Reservoir::confidence),
        Overlay::Age => kept.filter(|kept| kept.holds()).map(|kept| f64::from(kept.age())),
        Overlay::Source => kept.map(|kept| if kept.holds() { 1.0 + f64::from(kept.origin()) } else { 0.0 }),
        Overlay::Weight => kept.map(|kept| if kept.holds() { kept.weight() } else { 0.0 }),
    }
}

/// Where an overlay's colours begin and end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// The first colour's value.
    pub low: f64,
    /// Half the pixels lie below.
    pub median: f64,
    /// The last colour's value.
    pub high: f64,
}

impl Range {
    /// The range that `values` (NaN and negative: not known) ask for; `None` where there is nothing to show.
    pub fn of(look: &Look, values: impl IntoIterator<Item = f64>) -> Option<Range> {
        let least = if look.is_log() { LEAST } else { 0.0 };
        let mut known: Vec<f64> = values.into_iter().filter(|x| *x >= least && x.is_finite()).collect();
        known.sort_by(f64::total_cmp);
        let at = |share: f64| known.get(((known.len().max(1) - 1) as f64 * share).round() as usize).copied();
        let (low, median, high) = (at(OUTSIDE)?, at(0.5)?, at(1.0 - OUTSIDE)?);
        if let Some([low, high]) = look.fixed {
            return Some(Range { low, median, high });
        }
        if !look.is_log() {
            return Some(Range { low: 0.0, median, high: if high > 0.0 { high } else { 1.0 } });
        }
        let low = low.max(high / MOST_SPAN);
        let widen = (LEAST_SPAN / (high / low)).max(1.0).sqrt();
        Some(Range { low: low / widen, median, high: high * widen })
    }

    /// This range, with the ends of `old` where they hardly moved.
    fn steadied(self, old: Option<Range>) -> Range {
        let near = |a: f64, b: f64| a <= b * STEADY && b <= a * STEADY;
        match old {
            Some(old) if near(self.low, old.low) && near(self.high, old.high) => Range { median: self.median, ..old },
            _ => self,
        }
    }

    /// Where a value lies on the scale, 0 at its low and 1 at its high end.
    pub fn share(&self, look: &Look, value: f64) -> f64 {
        let [x, low, high] = [value, self.low, self.high].map(|x| if look.is_log() { x.max(LEAST).log2() } else { x });
        ((x - low) / (high - low)).clamp(0.0, 1.0)
    }

    /// Writes it for the shaders.
    pub fn write(&self, look: &Look, params: &mut Params) {
        let [low, high] = [self.low, self.high].map(|x| if look.is_log() { x.log2() } else { x } as f32);
        (params.overlay_low, params.overlay_high) = (low, high);
        params.overlay_scale = match look.scale {
            Scale::Even => 0,
            Scale::Log => 1,
            Scale::Names(_) => 2,
        };
    }
}

/// sRGB-encoded colour at a share of the scale: lightness rises evenly in Oklab, from black to white (the false-colour
/// map of `image::tone`).
pub fn colour(share: f32) -> [f32; 3] {
    let stops = (2.0 * share.clamp(0.0, 1.0) - 1.0) * FALSE_COLOUR_STOPS;
    ToneMap::FalseColour.apply([FALSE_COLOUR_GREY * stops.exp2(); 3])
}

/// The overlay as a picture, linear so that its sRGB is the colours, and its range; `None` for `Overlay::None` and where
/// nothing is known yet.
pub fn image(sums: &Sums, overlay: Overlay) -> Option<(Image, Range)> {
    let look = look(overlay)?;
    let values: Vec<Option<f64>> = (0..sums.sum.len()).map(|p| value(sums, overlay, p)).collect();
    let range = Range::of(&look, values.iter().copied().flatten())?;
    let rgba = values.iter().flat_map(|x| {
        let named = |x: f64| look.names().get(x as usize).map(|(_, colour)| colour.map(|c| f32::from(c) / 255.0));
        let shown = |x: f64| named(x).unwrap_or_else(|| colour(range.share(&look, x) as f32));
        let [r, g, b] = x.map_or([UNKNOWN; 3], shown).map(decode_srgb);
        [r, g, b, 1.0]
    });
    Some((Image::from_rgba(sums.width, sums.height, rgba.collect()), range))
}

/// The range of the overlay that the window shows, from the pixels that film/resolve keeps.
pub struct Gauge {
    /// Those pixels.
    pub sparse: wgpu::Buffer,
    found: Option<(Overlay, Range)>,
}

impl Gauge {
    /// A gauge that has seen nothing.
    pub fn new(gpu: &Gpu) -> Gauge {
        let sparse = gpu.device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("overlay"),
            size: u64::from(SPARSE * SPARSE) * 4,
            usage: wgpu::BufferUsages::STORAGE | wgpu::BufferUsages::COPY_SRC,
            mapped_at_creation: false,
        });
        Gauge { sparse, found: None }
    }

    /// Looks at what was just resolved of a picture of `size`; blocks for a moment. True if the range is another one.
    pub fn look(&mut self, gpu: &Gpu, overlay: Overlay, size: (u32, u32)) -> bool {
        let Some(shown) = look(overlay) else { return false };
        let kept = (size.0.min(SPARSE) * size.1.min(SPARSE)) as usize;
        // A device that was lost says so elsewhere.
        let Ok(values) = readback::values::<f32>(gpu, &self.sparse) else { return false };
        let before = self.range(overlay);
        let range = Range::of(&shown, values.iter().take(kept).map(|x| f64::from(*x)));
        self.found = range.map(|range| (overlay, range.steadied(before)));
        self.range(overlay) != before
    }

    /// The range of `overlay`, once it is known.
    pub fn range(&self, overlay: Overlay) -> Option<Range> {
        self.found.filter(|(of, _)| *of == overlay).map(|(_, range)| range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::tone::LUMINANCE;

    #[test]
    fn ranges_leave_odd_pixels_out_and_are_never_empty() {
        let noise = look(Overlay::Noise).expect("an overlay");
        let range = Range::of(&noise, (1..=1000).map(f64::from).chain([1e9, f64::NAN, -1.0, 0.0])).expect("known");
        assert!((19.0..23.0).contains(&range.low) && (979.0..985.0).contains(&range.high), "{range:?}");
        assert!((499.0..503.0).contains(&range.median), "{range:?}");
        let even = Range::of(&noise, [8.0; 5]).expect("known");
        assert_eq!((even.low, even.median, even.high), (4.0, 8.0, 16.0));
        assert_eq!(even.share(&noise, 8.0), 0.5);
        assert_eq!((even.share(&noise, 0.0), even.share(&noise, 99.0)), (0.0, 1.0));
        let wide = Range::of(&noise, (0..100).map(|i| 10f64.powi(i / 10))).expect("known");
        assert_eq!(wide.high / wide.low, MOST_SPAN);
        assert_eq!(Range::of(&noise, [f64::NAN, -1.0]), None);
        let lookups = look(Overlay::Lookups).expect("an overlay");
        let linear = Range::of(&lookups, [0.0, 2.0, 4.0, 8.0, 8.0, f64::NAN]).expect("known");
        assert_eq!((linear, linear.share(&lookups, 2.0)), (Range { low: 0.0, median: 4.0, high: 8.0 }, 0.25));
        assert_eq!(Range::of(&lookups, [0.0; 3]), Some(Range { low: 0.0, median: 0.0, high: 1.0 }));
        let nulls = look(Overlay::NullShare).expect("an overlay");
        assert_eq!(Range::of(&nulls, [0.25, 0.5, 0.75]), Some(Range { low: 0.0, median: 0.5, high: 1.0 }));
    }

    #[test]
    fn colours_do_not_swim() {
        let old = Range { low: 10.0, median: 20.0, high: 100.0 };
        let steady = Range { low: 9.5, median: 21.0, high: 105.0 }.steadied(Some(old));
        assert_eq!(steady, Range { median: 21.0, ..old });
        let moved = Range { low: 9.5, median: 21.0, high: 150.0 };
        assert_eq!(moved.steadied(Some(old)), moved);
    }

    /// Names are told apart by lightness alone, from one another and from what is unknown.
    #[test]
    fn colours_of_names_need_no_hue() {
        let lightness = |rgb: [f32; 3]| {
            let y: f32 = rgb.map(decode_srgb).iter().zip(LUMINANCE).map(|(c, weight)| c * weight).sum();
            116.0 * y.cbrt() - 16.0
        };
        for overlay in Overlay::ALL.iter().filter_map(|o| look(*o)) {
            let mut all: Vec<f32> =
                overlay.names().iter().map(|(_, rgb)| lightness(rgb.map(|c| f32::from(c) / 255.0))).collect();
            all.push(lightness([UNKNOWN; 3]));
            all.sort_by(f32::total_cmp);
            assert!(all.windows(2).all(|pair| pair[1] - pair[0] > 15.0), "{}: {all:?}", overlay.name);
        }
    }

    #[test]
    fn every_overlay_has_a_look_and_the_shaders_know_its_place() {
        let resolve = include_str!("../../shaders/film/resolve.wgsl");
        for overlay in Overlay::ALL.iter().copied().filter(|o| *o != Overlay::None) {
            assert!(look(overlay).is_some_and(|look| !look.name.is_empty()));
            let name = overlay.name().to_uppercase().replace('-', "_");
            let line = format!("const RESOLVE_{name}: u32 = {}u;", overlay as u32);
            assert!(resolve.contains(&line), "no {line}");
        }
        let present = include_str!("../../shaders/display/present.wgsl");
        assert!(present.contains(&format!("PRESENT_UNKNOWN: vec3f = vec3f({UNKNOWN})")));
        let colours: Vec<String> = SOURCES.iter().map(|(_, [r, g, b])| format!("vec3f({r}.0, {g}.0, {b}.0)")).collect();
        assert!(present.contains(&colours.join(", ")) && present.contains(&format!("array<vec3f, {}>", SOURCES.len())));
        assert!(resolve.contains(&format!("RESOLVE_SPARSE: u32 = {SPARSE}u")));
    }
}
