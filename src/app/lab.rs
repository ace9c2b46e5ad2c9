//! The lab: two sets of settings of one scene, A and B, side by side, with what each costs and buys. Volume, lights, camera
//! and display are A's; medium, integrator and estimators are each side's own.

use std::path::Path;

use crate::error::{Code, Error};
use crate::io::picture;
use crate::scene::row::{Effect, Row, Scale, Section, section};
use crate::scene::value::{Value, choice};
use crate::scene::{Integrator, Medium, Restir, Scene, Tracking};

pub mod compare;
mod show;
pub mod trace;

choice! {
    /// What the viewport shows.
    View {
        Wipe = "wipe", "Wipe", "A left of the line, B right of it.";
        A = "a", "A", "Only A.";
        B = "b", "B", "Only B.";
        Difference = "difference", "Difference", "Blue where A is brighter, orange where B is.";
    }
}

choice! {
    /// How work is shared out.
    Share {
        Time = "time", "Time", "The side with less time draws.";
        Samples = "samples", "Samples", "The side with fewer samples draws.";
    }
}

choice! {
    /// What the plot's horizontal axis is.
    Axis {
        Seconds = "seconds", "Seconds", "Seconds of drawing.";
        Samples = "samples", "Samples", "Samples of each pixel.";
    }
}

choice! {
    /// A side.
    Side {
        A = "a", "A", "The scene itself.";
        B = "b", "B", "The second set of settings.";
    }
}

section! {
    /// What is shown and how work is shared out.
    Controls {
        /// Whether the lab is open.
        open: bool = false, label("Lab"), effect(Effect::Display);
        /// What the viewport shows.
        view: View = View::Wipe, label("Show"), effect(Effect::Display);
        /// Where the line is, from left to right.
        wipe: f64 = 0.5, label("Line"), range(0.0, 1.0), effect(Effect::Display);
        /// Factor on the difference B − A, after exposure.
        gain: f64 = 4.0, label("Amplify"), unit("×"), range(1.0, 100.0), scale(Scale::Log), effect(Effect::Display);
        /// What A and B get the same of.
        share: Share = Share::Time, label("Equal"), effect(Effect::Display);
        /// The horizontal axis of the plot.
        axis: Axis = Axis::Seconds, label("Plot over"), effect(Effect::Display);
        /// Relative error of both sides on logarithmic axes.
        plot: bool = true, label("Plot"), effect(Effect::Display);
        /// The side whose settings the panel shows and changes.
        side: Side = Side::A, label("Settings of"), effect(Effect::Display);
        /// Whether the lab's section of the panel is open.
        unfolded: bool = true, label("Section"), effect(Effect::Display);
    }
}

/// What B has of its own.
#[derive(Clone, Debug, PartialEq)]
pub struct Own {
    /// What the volume is made of.
    pub medium: Medium,
    /// How light is followed.
    pub integrator: Integrator,
    /// Estimators and bounds.
    pub tracking: Tracking,
    /// Resampling.
    pub restir: Restir,
}

/// The lab's part of a session.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Lab {
    /// What is shown.
    pub controls: Controls,
    /// B's settings, once the lab was opened.
    pub own: Option<Own>,
}

/// A picture that errors are measured against.
#[derive(Clone, Debug)]
pub struct Reference {
    /// Its file's name.
    pub name: String,
    /// Pixels in a row, and rows.
    pub size: (u32, u32),
    /// Radiance.
    pub pixels: Vec<[f32; 3]>,
}

/// A side's picture, for the one who shares out work.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Standing {
    /// Samples of each pixel.
    pub samples: u32,
    /// Seconds of drawing.
    pub seconds: f64,
    /// It is drawn at full resolution.
    pub whole: bool,
}

/// What a side may do in this frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Turn {
    /// It draws.
    pub draws: bool,
    /// Share of the frame's time.
    pub share: f64,
    /// Samples of each pixel at most.
    pub most: u32,
}

impl Turn {
    /// Everything: there is no other side.
    pub const ALL: Turn = Turn { draws: true, share: 1.0, most: u32::MAX };
}

/// Shares a frame out between A and B. On the way to full resolution both draw; then the one that is behind, in equal
/// samples never beyond the other.
pub fn turns(share: Share, a: Standing, b: Standing) -> [Turn; 2] {
    let both = Turn { share: 0.5, ..Turn::ALL };
    if !a.whole || !b.whole {
        return [both; 2];
    }
    let rests = Turn { draws: false, ..Turn::ALL };
    let b_is_behind = match share {
        Share::Samples => b.samples < a.samples,
        Share::Time => b.seconds < a.seconds,
    };
    let most = |own: Standing, other: Standing| match share {
        Share::Samples if own.samples < other.samples => other.samples,
        Share::Samples | Share::Time => u32::MAX,
    };
    if b_is_behind {
        [rests, Turn { most: most(b, a), ..Turn::ALL }]
    } else {
        [Turn { most: most(a, b), ..Turn::ALL }, rests]
    }
}

impl Own {
    /// B's settings when the lab is first opened on `a`: the same medium, the default method, another seed, so that the two
    /// pictures are independent.
    pub fn beside(a: &Scene) -> Own {
        let seed = a.integrator.seed.wrapping_add(1);
        let integrator = Integrator { seed, ..Integrator::default() };
        Own { medium: a.medium.clone(), integrator, tracking: Tracking::default(), restir: Restir::default() }
    }

    /// A copy of `a`'s settings with another seed.
    pub fn copy(a: &Scene) -> Own {
        let own = Own::of(a);
        Own { integrator: Integrator { seed: own.integrator.seed.wrapping_add(1), ..own.integrator }, ..own }
    }

    fn of(scene: &Scene) -> Own {
        Own {
            medium: scene.medium.clone(),
            integrator: scene.integrator.clone(),
            tracking: scene.tracking.clone(),
            restir: scene.restir.clone(),
        }
    }

    /// The whole scene of B, where A's is `a`.
    pub fn beside_shared(&self, a: &Scene) -> Scene {
        let Own { medium, integrator, tracking, restir } = self.clone();
        Scene { medium, integrator, tracking, restir, ..a.clone() }
    }

    /// Takes B's scene apart after an edit: its own part is kept here, what is shared goes to `a`.
    pub fn take_apart(&mut self, b: Scene, a: &mut Scene) {
        *self = Own::of(&b);
        let Own { medium, integrator, tracking, restir } = Own::of(a);
        *a = Scene { medium, integrator, tracking, restir, ..b };
    }

    fn sections(&self) -> [(&'static str, &dyn Section); 4] {
        [
            ("medium", &self.medium),
            ("integrator", &self.integrator),
            ("tracking", &self.tracking),
            ("restir", &self.restir),
        ]
    }
}

impl Lab {
    /// Exchanges A's own settings in `a` with B's.
    pub fn swap(&mut self, a: &mut Scene) {
        let Some(own) = &mut self.own else { return };
        std::mem::swap(&mut own.medium, &mut a.medium);
        std::mem::swap(&mut own.integrator, &mut a.integrator);
        std::mem::swap(&mut own.tracking, &mut a.tracking);
        std::mem::swap(&mut own.restir, &mut a.restir);
    }

    /// As a table of a session.
    pub fn to_toml(&self) -> toml::Table {
        let mut table = table_of(&self.controls);
        for (name, section) in self.own.iter().flat_map(Own::sections) {
            table.insert(name.into(), table_of(section).into());
        }
        table
    }

    /// From such a table; a value that does not fit is the default.
    pub fn parse(mut table: toml::Table) -> Lab {
        let mut own = Own::of(&Scene::default());
        let mut sections: [(&str, &mut dyn Section); 4] = [
            ("medium", &mut own.medium),
            ("integrator", &mut own.integrator),
            ("tracking", &mut own.tracking),
            ("restir", &mut own.restir),
        ];
        let mut found = false;
        for (name, section) in &mut sections {
            if let Some(toml::Value::Table(values)) = table.remove(*name) {
                fill(*section, &values);
                found = true;
            }
        }
        let mut controls = Controls::default();
        fill(&mut controls, &table);
        Lab { controls, own: found.then_some(own) }
    }
}

/// The settings of a section as a table.
pub fn table_of(section: &dyn Section) -> toml::Table {
    let line = |(i, row): (usize, &Row)| format!("{} = {}\n", row.key, section.get(i));
    let text: String = section.rows().iter().enumerate().map(line).collect();
    text.parse().expect("values print as TOML")
}

/// Sets what a table names; whether all of it fits.
pub fn fill(section: &mut dyn Section, table: &toml::Table) -> bool {
    let mut fits = true;
    for (key, value) in table {
        let index = section.rows().iter().position(|row| row.key == key);
        let set = index.map(|i| section.set(i, &Value::parse_or_text(&value.to_string())));
        fits &= matches!(set, Some(Ok(())));
    }
    fits
}

impl Reference {
    /// Reads one from a picture file of radiance (EXR or PFM).
    ///
    /// # Errors
    /// Those of [`picture::load`], and [`Code::Unsupported`] for pictures of display values.
    pub fn load(path: &Path) -> crate::error::Result<Reference> {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let loaded = picture::load(path)?;
        if loaded.format == picture::Format::Png {
            return Err(Error::new(Code::Unsupported, format!("{name} cannot be a reference."))
                .why("A PNG holds display values, not radiance.")
                .hint("Take the EXR that was saved with it."));
        }
        let image = loaded.image;
        Ok(Reference { name, size: (image.width, image.height), pixels: image.rgb().collect() })
    }

    /// relMSE against this of a picture of `size` whose pixels have the radiance `mean`: the mean of (a − b)² / (b² + 0.01)
    /// over pixels and channels, as `image::metrics` has it; `None` where the sizes differ.
    pub fn rel_mse(&self, size: (u32, u32), mean: impl Fn(usize) -> [f64; 3]) -> Option<f64> {
        const FLOOR: f64 = 0.01;
        if self.size != size {
            return None;
        }
        let (mut total, mut count) = (0.0, 0u64);
        for (pixel, truth) in self.pixels.iter().enumerate().filter(|(_, rgb)| rgb.iter().all(|x| x.is_finite())) {
            let mean = mean(pixel);
            for c in 0..3 {
                let b = f64::from(truth[c]);
                total += (mean[c] - b).powi(2) / (b * b + FLOOR);
                count += 1;
            }
        }
        (count > 0).then(|| total / count as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::MajorantKind;

    fn standing(samples: u32, seconds: f64) -> Standing {
        Standing { samples, seconds, whole: true }
    }

    /// Draws by turns: a pass of `a` seconds, one of `b` seconds, each of at most `pass` samples.
    fn race(share: Share, prices: [f64; 2], pass: u32, frames: usize) -> [Standing; 2] {
        let mut sides = [standing(0, 0.0); 2];
        for _ in 0..frames {
            let turns = turns(share, sides[0], sides[1]);
            assert!(turns[0].draws != turns[1].draws, "one at a time");
            for (i, turn) in turns.iter().enumerate().filter(|(_, t)| t.draws) {
                let done = pass.min(turn.most - sides[i].samples);
                assert!(done > 0, "a turn that draws nothing never ends");
                sides[i].samples += done;
                sides[i].seconds += prices[i] * f64::from(done);
            }
        }
        sides
    }

    #[test]
    fn equal_time_and_equal_samples_are_kept() {
        let [a, b] = race(Share::Time, [0.01, 0.05], 3, 400);
        assert!((a.seconds - b.seconds).abs() <= 0.15 && a.samples > 4 * b.samples, "{a:?} {b:?}");
        let [a, b] = race(Share::Samples, [0.01, 0.05], 7, 400);
        assert!(a.samples == b.samples && a.samples == 1400, "{a:?} {b:?}");
        // One that is far behind catches up and does not go beyond.
        let turn = turns(Share::Samples, standing(100, 1.0), standing(60, 9.0));
        assert!(!turn[0].draws && turn[1].most == 100 && turn[1].share == 1.0);
        let turn = turns(Share::Time, standing(100, 1.0), standing(60, 9.0));
        assert!(turn[0].draws && !turn[1].draws && turn[0].most == u32::MAX);
    }

    #[test]
    fn both_draw_while_one_is_coarse() {
        let coarse = Standing { whole: false, ..standing(4, 0.1) };
        for [a, b] in [turns(Share::Time, coarse, standing(9, 9.0)), turns(Share::Samples, standing(9, 0.0), coarse)] {
            assert!(a.draws && b.draws && a.share + b.share <= 1.0);
        }
    }

    #[test]
    fn what_is_shared_follows_and_the_rest_is_own() {
        let mut a = Scene::default();
        a.tracking.majorant = MajorantKind::Global;
        a.camera.fov_y = 21.0;
        let mut own = Own::beside(&a);
        assert_eq!(own.tracking, Tracking::default());
        assert_ne!(own.integrator.seed, a.integrator.seed, "independent noise");
        let mut b = own.beside_shared(&a);
        assert_eq!((b.camera.fov_y, b.tracking.majorant), (21.0, MajorantKind::Grid));
        b.medium.g = 0.1;
        b.display.exposure = 2.0;
        b.lights.clear();
        let before = a.clone();
        own.take_apart(b, &mut a);
        assert_eq!((own.medium.g, a.medium.g), (0.1, before.medium.g));
        assert_eq!(a.tracking, before.tracking);
        assert!(a.display.exposure == 2.0 && a.lights.is_empty());
        let mut lab = Lab { own: Some(own), ..Lab::default() };
        lab.swap(&mut a);
        assert_eq!((a.medium.g, a.tracking.majorant), (0.1, MajorantKind::Grid));
        lab.swap(&mut a);
        assert_eq!(a.tracking, before.tracking);
    }

    #[test]
    fn the_lab_survives_as_text() {
        let mut own = Own::copy(&Scene::default());
        own.tracking.majorant_factor = 0.1 + 0.2;
        own.medium.albedo.0 = [0.1, 0.2, 1.0 / 3.0];
        let controls =
            Controls { open: true, view: View::Difference, gain: 33.3, side: Side::B, ..Controls::default() };
        for lab in [Lab { controls, own: Some(own) }, Lab::default()] {
            let text = lab.to_toml().to_string();
            assert_eq!(Lab::parse(text.parse().expect("a table")), lab, "{text}");
        }
        let odd = Lab::parse("gain = 1e9\nview = \"b\"\nnew = 3".parse().expect("a table"));
        assert_eq!(odd, Lab { controls: Controls { view: View::B, ..Controls::default() }, own: None });
    }

    #[test]
    fn an_error_against_a_reference_is_relmse() {
        let pixels = vec![[1.0, 0.0, 2.0], [f32::NAN; 3]];
        let reference = Reference { name: String::new(), size: (2, 1), pixels };
        let mean = |_| [1.1, 0.1, 2.1];
        let expected = (0.01 / 1.01 + 0.01 / 0.01 + 0.01 / 4.01) / 3.0;
        assert!((reference.rel_mse((2, 1), mean).expect("same size") - expected).abs() < 1e-6);
        assert_eq!(Reference { size: (1, 2), ..reference }.rel_mse((2, 1), mean), None);
    }
}
