//! Presets: whole looks to start from. A look is medium, lights and path length; some bring their volume and its view.

use glam::DVec3;

use crate::scene::value::{Auto, Colour, FilePath, Limit, asset_name};
use crate::scene::{Analytic, Camera, Constant, Integrator, Light, Medium, Phase, Scene, SkyLight, Sun, Volume};

/// Mean optical thickness that `medium.density_scale = "auto"` gives.
const AUTO_THICKNESS: f64 = 40.0;
/// ∫ density dt along a mean column of the built-in cumulus, world units; nearly the same for every seed and resolution.
const CUMULUS_COLUMN: f64 = 0.165;

/// The volume of a look.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// The one that is there.
    Any,
    /// The built-in cumulus, unless the user has opened a volume.
    Cumulus,
    /// The built-in volume of this path.
    Asset(&'static str),
}

/// How dense a look is.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Amount {
    /// Mean optical thickness, where the volume may be any.
    Thickness(f64),
    /// `medium.density_scale`, where the volume is known; 1/unit.
    Scale(f64),
}

/// A look by name.
#[derive(Debug)]
pub struct Preset {
    /// Its name in the menu.
    pub name: &'static str,
    place: Place,
    amount: Amount,
    bounces: Limit,
    medium: fn(&mut Medium),
    lights: fn() -> Vec<Light>,
}

/// The presets, in the order of the menu.
pub static PRESETS: [Preset; 8] = [
    Preset {
        name: "Default",
        place: Place::Any,
        amount: Amount::Thickness(AUTO_THICKNESS),
        bounces: Limit::AtMost(64),
        medium: |_| {},
        lights: || Scene::default().lights,
    },
    Preset {
        name: "Cumulus",
        place: Place::Cumulus,
        amount: Amount::Thickness(AUTO_THICKNESS),
        bounces: Limit::AtMost(256),
        medium: |m| m.albedo = Colour([1.0; 3]),
        lights: || vec![sun([-0.8, 0.5, 0.25], [5.6, 5.1, 4.4]), around([0.08, 0.16, 0.35])],
    },
    Preset {
        name: "Dense cumulus",
        place: Place::Cumulus,
        amount: Amount::Thickness(160.0),
        bounces: Limit::Unlimited,
        medium: |m| {
            m.albedo = Colour([1.0; 3]);
            m.g = 0.877;
        },
        lights: || vec![sun([-0.75, 0.42, 0.3], [6.4, 5.4, 4.2]), around([0.05, 0.1, 0.22])],
    },
    Preset {
        name: "Disney cloud",
        place: Place::Asset("asset:disney-cloud"),
        amount: Amount::Scale(0.4),
        bounces: Limit::AtMost(256),
        medium: |m| m.albedo = Colour([1.0; 3]),
        lights: || {
            let (sun_elevation, sun_azimuth, turbidity, scale) = (32.0, 165.0, 2.0, 1.5);
            vec![Light::Sky(SkyLight { sun_elevation, sun_azimuth, turbidity, scale, ..SkyLight::default() })]
        },
    },
    Preset {
        name: "Fog",
        place: Place::Any,
        amount: Amount::Thickness(3.0),
        bounces: Limit::AtMost(64),
        medium: |m| {
            m.albedo = Colour([0.998; 3]);
            m.g = 0.7;
        },
        lights: || vec![sun([0.45, 0.35, -0.8], [3.2, 2.4, 1.6]), around([0.045, 0.055, 0.075])],
    },
    Preset {
        name: "Smoke",
        place: Place::Asset("asset:smoke-column"),
        amount: Amount::Scale(22.0),
        bounces: Limit::AtMost(64),
        medium: |m| {
            m.albedo = Colour([0.8, 0.79, 0.78]);
            m.g = 0.4;
        },
        lights: || {
            // A warm key from above left, a cool rim from behind right.
            let (key, rim) = (sun([-0.75, 0.55, -0.1], [10.0, 8.6, 7.0]), sun([0.9, 0.15, -0.5], [1.2, 1.9, 3.2]));
            vec![key, rim, around([0.03, 0.035, 0.045])]
        },
    },
    Preset {
        name: "Milk",
        place: Place::Any,
        amount: Amount::Thickness(60.0),
        bounces: Limit::AtMost(1024),
        medium: |m| {
            // Scattering and absorption of whole milk: Jensen et al. 2001, table 1, relative to green.
            m.extinction = Colour([0.79, 1.0, 1.17]);
            m.albedo = Colour([0.99957, 0.99926, 0.99627]);
            m.g = 0.75;
        },
        lights: || vec![sun([-0.8, 0.5, 0.3], [5.5, 5.1, 4.7]), around([0.045, 0.04, 0.035])],
    },
    Preset {
        name: "White furnace",
        place: Place::Any,
        amount: Amount::Thickness(AUTO_THICKNESS),
        bounces: Limit::Unlimited,
        medium: |m| m.albedo = Colour([1.0; 3]),
        lights: || vec![around([1.0; 3])],
    },
];

fn sun(direction: [f64; 3], irradiance: [f64; 3]) -> Light {
    Light::Sun(Sun { direction: direction.into(), irradiance: Colour(irradiance), ..Sun::default() })
}

fn around(radiance: [f64; 3]) -> Light {
    Light::Constant(Constant { radiance: Colour(radiance) })
}

impl Preset {
    /// Gives `scene` this look. `column`: ∫ density dt along a mean column of the loaded volume, world units, where it is
    /// known. The camera moves only where another volume comes.
    pub fn apply(&self, scene: &mut Scene, column: Option<f64>) {
        let before = scene.volume.source();
        let own = scene.volume.analytic != Analytic::None
            || !scene.volume.file.0.is_empty() && asset_name(&scene.volume.file.0).is_none();
        match self.place {
            Place::Any => {}
            Place::Cumulus if own => {}
            Place::Cumulus => {
                scene.volume.file = FilePath::default();
                scene.volume.grid = String::new();
            }
            Place::Asset(path) if scene.volume.file.0 == path => {}
            Place::Asset(path) => scene.volume = Volume { file: FilePath(path.into()), ..Volume::default() },
        }
        if scene.volume.source() != before {
            scene.camera = view_of(&scene.volume);
        }
        let is_cumulus = scene.volume.file.0.is_empty() && scene.volume.analytic == Analytic::None;
        let column = if is_cumulus { Some(CUMULUS_COLUMN) } else { column.filter(|c| *c > 0.0) };
        let mut medium = Medium { phase: Phase::Hg, ..Medium::default() };
        (self.medium)(&mut medium);
        medium.density_scale = match (self.amount, column) {
            (Amount::Scale(scale), _) => Auto::Is(scale),
            (Amount::Thickness(AUTO_THICKNESS), _) | (_, None) => Auto::Auto,
            (Amount::Thickness(thickness), Some(column)) => Auto::Is(two_digits(thickness / column)),
        };
        scene.medium = medium;
        scene.lights = (self.lights)();
        scene.integrator = Integrator { max_bounces: self.bounces, ..scene.integrator.clone() };
    }
}

/// The first preset that changes nothing in `scene`.
pub fn preset_of(scene: &Scene, column: Option<f64>) -> Option<&'static Preset> {
    PRESETS.iter().find(|preset| {
        let mut probe = scene.clone();
        preset.apply(&mut probe, column);
        probe == *scene
    })
}

/// A view that shows a built-in volume at its best.
fn view_of(volume: &Volume) -> Camera {
    let (position, target, fov_y) = match asset_name(&volume.file.0) {
        // From the ground, so that the horizon stays out of the picture.
        Some("disney-cloud") => ([700.0, -240.0, -44.0], [6.0, 62.0, -44.0], 38.0),
        Some("smoke-column") => ([0.0, 2.4, 11.0], [0.0, 2.6, 0.0], 34.0),
        _ => ([0.0, -0.35, 3.3], [0.0, 0.0, 0.0], 30.0),
    };
    let (position, target) = (DVec3::from(position), DVec3::from(target));
    Camera { position: Auto::Is(position), target: Auto::Is(target), fov_y, ..Camera::default() }
}

/// Rounded to two significant digits.
fn two_digits(x: f64) -> f64 {
    // Through text: it is the shortest way to the nearest double of a decimal number.
    format!("{x:.1e}").parse().expect("a formatted number parses")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_preset_is_recognised_and_fits_its_ranges() {
        let named = |scene: &Scene, column| preset_of(scene, column).map(|p| p.name);
        assert_eq!(named(&Scene::default(), None), Some("Default"), "what the window starts with");
        for preset in &PRESETS {
            for (volume, column) in [("", None), ("cloud.vdb", Some(2.5)), ("asset:smoke-column", Some(1.1))] {
                let mut scene = Scene::of_volume(volume);
                scene.medium.phase = Phase::Isotropic;
                preset.apply(&mut scene, column);
                assert_eq!(named(&scene, column), Some(preset.name), "{volume}");
                assert_eq!(scene.check(), Ok(()));
                for (key, row, value) in scene.settings() {
                    assert_eq!(row.check(&value), Ok(()), "{} {key}", preset.name);
                }
                scene.medium.g = 0.123;
                assert_eq!(named(&scene, column), None);
            }
        }
    }

    #[test]
    fn looks_bring_their_volume_and_leave_a_file_of_the_user() {
        let apply = |name: &str, scene: &mut Scene| {
            PRESETS.iter().find(|p| p.name == name).expect("a preset").apply(scene, Some(4.0));
        };
        let mut scene = Scene::default();
        apply("Disney cloud", &mut scene);
        assert_eq!(scene.volume.file.0, "asset:disney-cloud");
        assert!(scene.camera.position != Auto::Auto, "its own view");
        let view = scene.camera.clone();
        apply("Milk", &mut scene);
        assert_eq!((scene.volume.file.0.as_str(), &scene.camera), ("asset:disney-cloud", &view), "the volume stays");
        assert_eq!(scene.medium.density_scale, Auto::Is(15.0), "60 / 4: as thick as wished in any volume");
        apply("Cumulus", &mut scene);
        assert_eq!(scene.volume, Volume::default());
        let mut scene = Scene::of_volume("my.vdb");
        apply("Dense cumulus", &mut scene);
        assert_eq!((scene.volume.file.0.as_str(), &scene.camera), ("my.vdb", &Camera::default()));
        for preset in &PRESETS {
            if let Place::Asset(path) = preset.place {
                assert!(crate::io::volume_file::asset(path).is_ok_and(|a| a.is_some()), "{path}");
            }
        }
    }
}
