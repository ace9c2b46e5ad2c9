//! The scene: every setting, declared once.
//!
//! A setting is one row below: its name, type, default, range, unit, meaning and what a change of it touches. The scene
//! file, `--set`, `[[animation]]`, the panels, undo, tooltips, `nephele settings` and the text inside pictures are all
//! made from these rows.

use glam::DVec3;

pub mod animation;
mod bias;
mod restir;
pub mod row;
pub mod text;
pub mod value;

use animation::Track;
pub use bias::Bias;
pub use restir::{History, Mode, Restir};
use row::{Effect, Layers, Row, Scale, Section, section};
use value::{Auto, Bounds, Colour, FilePath, Limit, Matrix, Pair, Value, choice};

/// The version of the scene format.
pub const VERSION: i64 = 1;

choice! {
    /// A volume made by a recipe.
    Procedural {
        None = "", "None", "No procedural volume.";
        Cumulus = "cumulus", "Cumulus", "A fair-weather cumulus, made from its seed.";
    }
}

choice! {
    /// A volume given by a formula.
    Analytic {
        None = "", "None", "No analytic volume.";
        Homogeneous = "homogeneous", "Homogeneous", "Density 1 inside the bounds.";
        Linear = "linear", "Linear", "Density linear along an axis, from one face of the bounds to the other.";
        Exponential = "exponential", "Exponential", "Density exp(−h / scale height), h from the lower face along an axis.";
    }
}

choice! {
    /// An axis of the box of an analytic volume.
    Axis {
        X = "x", "x", "Along x.";
        Y = "y", "y", "Along y.";
        Z = "z", "z", "Along z.";
    }
}

choice! {
    /// Interpolation between voxels.
    Filter {
        Trilinear = "trilinear", "Trilinear", "Between the eight nearest voxels.";
        Nearest = "nearest", "Nearest", "The value of the nearest voxel.";
    }
}

choice! {
    /// Storage of the density on the adapter.
    Precision {
        Auto = "auto", "Auto", "What is fastest on this adapter: 16-bit floats.";
        F32 = "f32", "32 bit", "32-bit floats: exact.";
        F16 = "f16", "16 bit", "16-bit floats, relative to the maximum: error at most 1/2048 of the value.";
        U8 = "u8", "8 bit", "256 levels from 0 to the maximum: error at most 1/510 of the maximum.";
    }
}

choice! {
    /// Phase functions.
    Phase {
        Isotropic = "isotropic", "Isotropic", "The same in all directions.";
        Rayleigh = "rayleigh", "Rayleigh", "Molecules: 3/(16π) · (1 + cos²θ).";
        Hg = "hg", "Henyey–Greenstein", "One lobe of mean cosine g.";
        TwoLobeHg = "two-lobe-hg", "Two-lobe HG", "A mixture of two Henyey–Greenstein lobes.";
    }
}

choice! {
    /// Free-flight samplers.
    FreeFlight {
        Delta = "delta", "Delta", "Delta (Woodcock) tracking; with coloured extinction its channel is drawn as a hero.";
        Hero = "hero", "Hero channel", "One channel draws the path, all three weigh it; for grey extinction the same as delta.";
        WeightedDelta = "weighted-delta", "Weighted delta", "Signed weights, so that the majorant need not bound.";
        Decomposition = "decomposition", "Decomposition", "Collisions with the cell's minimum need no lookup; delta's law.";
        WeightedDecomposition = "weighted-decomposition", "Weighted decomposition", "Any control by signed weights; weights are unbounded.";
        SpectralMax = "spectral-max", "Spectral, max", "All channels at once, events by the greatest.";
        SpectralAvg = "spectral-avg", "Spectral, average", "All channels at once, events by the mean.";
        SpectralHistory = "spectral-history", "Spectral, history", "All channels at once, events by the mean of what the path carries.";
        Regular = "regular", "Regular", "Exact inversion from cell to cell.";
        ClosedForm = "closed-form", "Closed form", "The formula of an analytic volume.";
        RayMarching = "ray-marching", "Ray marching", "Steps of fixed size. Biased by their size.", biased("ray marching of free flights");
    }
}

choice! {
    /// Transmittance estimators of shadow rays.
    Transmittance {
        Ratio = "ratio", "Ratio", "Ratio tracking.";
        ResidualRatio = "residual-ratio", "Residual ratio", "A control in closed form, ratio tracking for the rest.";
        Delta = "delta", "Delta", "1 where delta tracking gets through, else 0.";
        NextFlight = "next-flight", "Next flight", "The majorant's transmittance from each collision on.";
        UnbiasedRayMarching = "unbiased-ray-marching", "Unbiased marching", "A power series around a march, of random order.";
        Telescoping = "telescoping", "Telescoping", "A march, and by chance the difference that finer ones make.";
        PowerSeries = "power-series", "Power series", "The series of exp around the majorant, stopped by roulette.";
        Regular = "regular", "Regular", "Exact integration from cell to cell.";
        ClosedForm = "closed-form", "Closed form", "The formula of an analytic volume.";
        RayMarching = "ray-marching", "Ray marching", "Steps of fixed size. Biased by their size.", biased("ray marching of shadow rays");
        Jackknife = "jackknife", "Jackknife", "Two marches whose difference removes most bias. Biased.", biased("jackknife transmittance");
    }
}

choice! {
    /// Bounds of the extinction.
    MajorantKind {
        Global = "global", "Global", "One majorant for the whole volume.";
        Grid = "grid", "Grid", "A majorant for each cell.";
        KdTree = "kd-tree", "kd-tree", "Boxes split where that saves most steps and lookups.";
        Hierarchy = "hierarchy", "Hierarchy", "An octree, split while the density varies much in a node.";
    }
}

choice! {
    /// Controls: densities that are integrated in closed form.
    Control {
        Min = "min", "Minimum", "The least density of the cell: all factors are in 0 … 1.";
        Mean = "mean", "Mean", "The mean density of the cell: less noise, but estimates may leave 0 … 1.";
    }
}

choice! {
    /// Tone maps.
    ToneMap {
        Agx = "agx", "AgX", "Troy Sobotka's AgX: film-like, holds hues in bright light.";
        Neutral = "neutral", "Neutral", "Khronos PBR Neutral: colours as they are up to near white.";
        Aces = "aces", "ACES", "Stephen Hill's fit of ACES: strong contrast.";
        Linear = "linear", "Linear", "No tone map; clipped at 1.";
        FalseColour = "false-colour", "False colour", "Luminance in stops as colours.";
    }
}

choice! {
    /// Views of other quantities than radiance.
    Overlay {
        None = "none", "None", "The picture.";
        Noise = "noise", "Noise", "Relative standard error of each pixel.";
        Samples = "samples", "Samples", "Samples of each pixel.";
        Lookups = "lookups", "Lookups", "Density lookups per sample.";
        Steps = "steps", "Cell steps", "Segments of the bounds walked per sample.";
        NullShare = "null-share", "Null share", "Share of null collisions among those of free flights.";
        PathLength = "path-length", "Path length", "Real collisions per sample.";
        Confidence = "confidence", "Confidence", "Samples that a pixel's kept path stands for (modes that reuse paths).";
        Age = "age", "Path age", "Frames since a pixel's kept path was drawn.";
        Source = "source", "Path source", "Where a pixel's kept path comes from: its own, the frame before, a neighbour.";
        Weight = "weight", "Path weight", "Contribution weight of a pixel's kept path, times its target.";
    }
}

section! {
    /// The density field.
    Volume {
        /// A `.vdb` or `.nvdb` file, told apart by content.
        file: FilePath = FilePath::default(), label("File"), effect(Effect::Volume);
        /// The grid that is the density: a name, `name[1]` for the second of that name, or `#2` for the third grid. Empty: `density`, else the only scalar grid.
        grid: String = String::new(), label("Grid"), effect(Effect::Volume);
        /// A volume made by a recipe.
        procedural: Procedural = Procedural::None, label("Recipe"), effect(Effect::Volume);
        /// The seed of the recipe.
        seed: u32 = 1, label("Cloud seed"), range(0.0, 4294967295.0), slider(0.0, 100.0), effect(Effect::Volume);
        /// Voxels along the longest side of the recipe's volume.
        resolution: u32 = 128, label("Resolution"), unit("voxels"), range(16.0, 512.0), effect(Effect::Volume);
        /// A volume given by a formula.
        analytic: Analytic = Analytic::None, label("Formula"), effect(Effect::Volume);
        /// The box of the formula, before to_world; sides may be infinite.
        bounds: Bounds = Bounds([DVec3::NEG_ONE, DVec3::ONE]), label("Bounds"), effect(Effect::Volume);
        /// The axis of a linear or exponential formula.
        axis: Axis = Axis::Y, label("Axis"), effect(Effect::Volume);
        /// Density at the lower and the upper face of a linear formula.
        density: Pair = Pair([0.0, 1.0]), label("Densities"), range(0.0, 1e30), effect(Effect::Volume);
        /// Height over which the density of an exponential formula falls by a factor e.
        scale_height: f64 = 1.0, label("Scale height"), symbol("H"), unit("units"), range(1e-12, 1e12), slider(0.01, 10.0), scale(Scale::Log), effect(Effect::Volume);
        /// Interpolation between voxels.
        filter: Filter = Filter::Trilinear, label("Filter"), effect(Effect::Volume);
        /// World from the file's own world: a 4×4 matrix by rows, any invertible affine map.
        to_world: Matrix = Matrix::IDENTITY, label("To world"), effect(Effect::Placement);
        /// Resample so that no side has more voxels; 0: as stored.
        max_resolution: u32 = 0, label("Max resolution"), unit("voxels"), range(0.0, 65536.0), slider(0.0, 1024.0), effect(Effect::Volume);
        /// Storage of the density on the adapter.
        precision: Precision = Precision::Auto, label("Precision"), effect(Effect::Volume);
    }
}

section! {
    /// What the density is made of.
    Medium {
        /// Factor from density to extinction. Auto: columns through the volume have a mean optical thickness of 40.
        density_scale: Auto<f64> = Auto::Auto, label("Density"), symbol("σ"), unit("1/unit"), range(0.0, 1e30), slider(0.01, 10000.0), scale(Scale::Log), effect(Effect::Density);
        /// Extinction factor of red, green and blue.
        extinction: Colour = Colour([1.0; 3]), label("Extinction"), symbol("σₜ"), range(0.0, 1e6), slider(0.0, 1.0), effect(Effect::Spectrum);
        /// Single-scattering albedo: the share of the light that a collision scatters and does not absorb.
        albedo: Colour = Colour([0.99; 3]), label("Albedo"), symbol("ϖ"), range(0.0, 1.0), slider(0.0, 0.99999), scale(Scale::OneMinusLog), decimals(5), effect(Effect::Albedo);
        /// The phase function: where a collision sends the light.
        phase: Phase = Phase::Hg, label("Phase"), effect(Effect::PhaseModel);
        /// Mean cosine of the scattering angle: above 0 forward, below 0 backward.
        g: f64 = 0.85, label("Anisotropy"), symbol("g"), range(-0.999, 0.999), decimals(3), effect(Effect::Phase);
        /// Mean cosine of the second lobe.
        g2: f64 = -0.3, label("Second lobe"), symbol("g₂"), range(-0.999, 0.999), decimals(3), effect(Effect::Phase);
        /// Share of the first lobe.
        lobe_weight: f64 = 0.5, label("Lobe weight"), symbol("w"), range(0.0, 1.0), effect(Effect::Phase);
    }
}

section! {
    /// A sun: parallel light, or a disc in the sky.
    Sun {
        /// From the scene towards the light.
        direction: DVec3 = DVec3::new(0.3, 0.8, 0.5), label("Direction"), effect(Effect::LightDirection);
        /// Irradiance on a surface that faces it.
        irradiance: Colour = Colour([3.0, 2.9, 2.7]), label("Irradiance"), symbol("E"), range(0.0, 1e12), slider(0.01, 100.0), scale(Scale::Log), effect(Effect::LightStrength);
        /// Angular diameter; 0 is a delta light that the camera does not see.
        angular_diameter: f64 = 0.0, label("Diameter"), symbol("α"), unit("°"), range(0.0, 180.0), effect(Effect::LightData);
    }
}

section! {
    /// The same radiance from everywhere.
    Constant {
        /// Radiance.
        radiance: Colour = Colour([0.4, 0.5, 0.7]), label("Radiance"), symbol("L"), range(0.0, 1e12), slider(0.001, 10.0), scale(Scale::Log), decimals(3), effect(Effect::LightStrength);
    }
}

section! {
    /// A picture of everything around.
    Environment {
        /// An equirectangular `.exr` or `.hdr` map.
        file: FilePath = FilePath::default(), label("File"), effect(Effect::LightData);
        /// Factor on its radiance.
        scale: f64 = 1.0, label("Scale"), range(0.0, 1e12), slider(0.01, 100.0), scale(Scale::Log), effect(Effect::LightStrength);
        /// Turn about +Y, counter-clockwise seen from above.
        rotation: f64 = 0.0, label("Rotation"), unit("°"), range(-36000.0, 36000.0), slider(-180.0, 180.0), decimals(1), effect(Effect::LightDirection);
    }
}

section! {
    /// A daylight sky with its sun (Hosek and Wilkie 2012).
    SkyLight {
        /// Height of the sun above the horizon.
        sun_elevation: f64 = 30.0, label("Elevation"), unit("°"), range(-90.0, 90.0), decimals(1), effect(Effect::LightData);
        /// Direction of the sun, from −Z towards +X.
        sun_azimuth: f64 = 0.0, label("Azimuth"), unit("°"), range(-36000.0, 36000.0), slider(-180.0, 180.0), decimals(1), effect(Effect::LightData);
        /// Haze: 1 is pure air, 10 thick haze.
        turbidity: f64 = 3.0, label("Turbidity"), range(1.0, 10.0), effect(Effect::LightData);
        /// Share of the light that the ground reflects.
        ground_albedo: f64 = 0.2, label("Ground"), range(0.0, 1.0), effect(Effect::LightData);
        /// Factor on its radiance; at 1 a white horizontal surface under the default sky has luminance 1.
        scale: f64 = 1.0, label("Scale"), range(0.0, 1e12), slider(0.01, 100.0), scale(Scale::Log), effect(Effect::LightStrength);
    }
}

section! {
    /// A point light.
    Point {
        /// Where it is.
        position: DVec3 = DVec3::ZERO, label("Position"), unit("units"), effect(Effect::LightDirection);
        /// Radiant intensity.
        intensity: Colour = Colour([1.0; 3]), label("Intensity"), symbol("I"), unit("1/sr"), range(0.0, 1e30), slider(0.01, 10000.0), scale(Scale::Log), effect(Effect::LightStrength);
    }
}

section! {
    /// The camera.
    Camera {
        /// Where it is. Auto: the volume fits the picture.
        position: Auto<DVec3> = Auto::Auto, label("Position"), unit("units"), effect(Effect::Camera);
        /// What it looks at. Auto: the centre of the volume.
        target: Auto<DVec3> = Auto::Auto, label("Target"), unit("units"), effect(Effect::Camera);
        /// The direction that is up in the picture.
        up: DVec3 = DVec3::Y, label("Up"), effect(Effect::Camera);
        /// Full vertical angle of view.
        fov_y: f64 = 40.0, label("Field of view"), unit("°"), range(0.1, 179.0), slider(5.0, 120.0), decimals(1), effect(Effect::Camera);
        /// Radius of the lens; 0 is a pinhole.
        aperture_radius: f64 = 0.0, label("Aperture"), unit("units"), range(0.0, 1e12), slider(0.0, 1.0), decimals(3), effect(Effect::Camera);
        /// Distance along the axis at which the picture is sharp. Auto: the distance to the target.
        focus_distance: Auto<f64> = Auto::Auto, label("Focus"), unit("units"), range(1e-12, 1e12), slider(0.01, 1000.0), scale(Scale::Log), effect(Effect::Camera);
    }
}

section! {
    /// The picture.
    Film {
        /// Pixels from left to right.
        width: u32 = 1280, label("Width"), unit("px"), range(1.0, 16384.0), effect(Effect::Film);
        /// Pixels from top to bottom.
        height: u32 = 720, label("Height"), unit("px"), range(1.0, 16384.0), effect(Effect::Film);
    }
}

section! {
    /// How light is followed.
    Integrator {
        /// How the picture is made.
        mode: Mode = Mode::Path, label("Mode"), effect(Effect::Method);
        /// Scattering events on a path at most; 0 is unscattered light only. A limit is part of what the picture means: the light of longer paths is not in it.
        max_bounces: Limit = Limit::AtMost(64), label("Bounces"), range(0.0, 1000000.0), slider(1.0, 1024.0), scale(Scale::Log), effect(Effect::Method);
        /// The seed of the random numbers.
        seed: u32 = 0, label("Seed"), range(0.0, 4294967295.0), slider(0.0, 100.0), effect(Effect::Seed);
    }
}

section! {
    /// Estimators and bounds.
    Tracking {
        /// How free flights are sampled.
        free_flight: FreeFlight = FreeFlight::Delta, label("Free flight"), effect(Effect::Method);
        /// How the transmittance of shadow rays is estimated.
        transmittance: Transmittance = Transmittance::Ratio, label("Transmittance"), effect(Effect::Method);
        /// What bounds the extinction.
        majorant: MajorantKind = MajorantKind::Grid, label("Majorant"), symbol("µ̄"), effect(Effect::Method);
        /// Voxels along the side of a majorant cell. Auto: a level grid, whose cells follow the density.
        cell: Auto<u32> = Auto::Auto, label("Cell"), unit("voxels"), range(1.0, 64.0), effect(Effect::Method);
        /// Density that decomposition and residual ratio tracking treat in closed form.
        control: Control = Control::Min, label("Control"), symbol("µc"), effect(Effect::Method);
        /// Factor on all bounds. Below 1 they do not bound, which only weighted flights and estimators of ratios allow.
        majorant_factor: f64 = 1.0, label("Majorant factor"), range(0.3, 3.0), effect(Effect::Method);
        /// Size of the steps of ray marching and jackknife.
        step: f64 = 1.0, label("Step"), unit("voxels"), range(0.01, 1000.0), slider(0.1, 32.0), scale(Scale::Log), effect(Effect::Method), biased("of ray marching and jackknife: longer steps, more bias");
    }
}

section! {
    /// The way the picture is shown; never changes the data.
    Display {
        /// Exposure: the picture times 2 to this power.
        exposure: f64 = 0.0, label("Exposure"), unit("EV"), range(-30.0, 30.0), slider(-6.0, 6.0), decimals(2), effect(Effect::Display);
        /// From radiance to the screen.
        tone_map: ToneMap = ToneMap::Agx, label("Tone map"), effect(Effect::Display);
        /// Another quantity in place of the picture.
        overlay: Overlay = Overlay::None, label("Overlay"), effect(Effect::Display);
    }
}

/// Declares the kinds of lights.
macro_rules! lights {
    ($( $Variant:ident($Section:ident) = $name:literal, $label:literal; )*) => {
        /// A light; lights add up.
        #[derive(Clone, Debug, PartialEq)]
        pub enum Light { $( #[doc = $label] $Variant($Section) ),* }
        impl Light {
            /// Name in scene files and on screen of every kind.
            pub const KINDS: &'static [(&'static str, &'static str)] = &[ $( ($name, $label) ),* ];
            /// A default light of that kind.
            pub fn of_kind(kind: &str) -> Option<Light> {
                $( if kind == $name { return Some(Light::$Variant($Section::default())); } )*
                None
            }
            /// The name of its kind.
            pub fn kind(&self) -> &'static str {
                match self { $( Light::$Variant(_) => $name ),* }
            }
            /// Its settings.
            pub fn section(&self) -> &dyn Section {
                match self { $( Light::$Variant(s) => s ),* }
            }
            /// Its settings, to change.
            pub fn section_mut(&mut self) -> &mut dyn Section {
                match self { $( Light::$Variant(s) => s ),* }
            }
        }
    };
}

lights! {
    Sun(Sun) = "sun", "Sun";
    Constant(Constant) = "constant", "Constant";
    Environment(Environment) = "environment", "Environment map";
    Sky(SkyLight) = "sky", "Daylight sky";
    Point(Point) = "point", "Point";
}

/// Everything that a picture depends on.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// The density field.
    pub volume: Volume,
    /// What it is made of.
    pub medium: Medium,
    /// The lights; they add up.
    pub lights: Vec<Light>,
    /// The camera.
    pub camera: Camera,
    /// The picture's size.
    pub film: Film,
    /// How light is followed.
    pub integrator: Integrator,
    /// Estimators and bounds.
    pub tracking: Tracking,
    /// Resampling.
    pub restir: Restir,
    /// Settings that change over frames.
    pub animation: Vec<Track>,
    /// How the picture is shown.
    pub display: Display,
}

impl Default for Scene {
    fn default() -> Scene {
        Scene {
            volume: Volume::default(),
            medium: Medium::default(),
            lights: vec![Light::Sun(Sun::default()), Light::Constant(Constant::default())],
            camera: Camera::default(),
            film: Film::default(),
            integrator: Integrator::default(),
            tracking: Tracking::default(),
            restir: Restir::default(),
            animation: Vec::new(),
            display: Display::default(),
        }
    }
}

/// Where the density comes from.
#[derive(Clone, Debug, PartialEq)]
pub enum Source {
    /// A file.
    File(String),
    /// The procedural cumulus.
    Cumulus {
        /// Its seed.
        seed: u32,
        /// Voxels along its longest side.
        resolution: u32,
    },
    /// A formula in a box.
    Analytic,
}

impl Volume {
    /// Where the density comes from; the cumulus where nothing is named.
    pub fn source(&self) -> Source {
        if !self.file.0.is_empty() {
            Source::File(self.file.0.clone())
        } else if self.analytic != Analytic::None {
            Source::Analytic
        } else {
            Source::Cumulus { seed: self.seed, resolution: self.resolution }
        }
    }
}

impl Tracking {
    /// Whether these estimators fit one another and the volume, `analytic` or not; an error in words.
    pub fn check(&self, analytic: bool) -> Result<(), String> {
        let closed = self.free_flight == FreeFlight::ClosedForm || self.transmittance == Transmittance::ClosedForm;
        if closed && !analytic {
            return Err("tracking: \"closed-form\" needs an analytic volume; \"regular\" is exact for voxels.".into());
        }
        if self.free_flight == FreeFlight::Decomposition && self.control == Control::Mean {
            let why = "a mean lies above the density in places";
            let advice = "choose tracking.control \"min\" or tracking.free_flight \"weighted-decomposition\"";
            return Err(format!("tracking.free_flight \"decomposition\" takes no mean control: {why}; {advice}."));
        }
        let bounds = !matches!(self.free_flight, FreeFlight::Delta | FreeFlight::Hero | FreeFlight::Decomposition)
            && self.transmittance != Transmittance::Delta;
        if self.majorant_factor < 1.0 && !bounds {
            return Err("tracking.majorant_factor below 1 needs a free flight that stays unbiased there (weighted, \
                        spectral, regular) and a transmittance that is not \"delta\"."
                .into());
        }
        Ok(())
    }
}

/// Names of the sections, in the order of the scene file; `lights` stands between `medium` and `camera`.
pub const SECTIONS: [&str; 8] = ["volume", "medium", "camera", "film", "integrator", "tracking", "restir", "display"];

impl Scene {
    /// A scene that names only a volume file.
    pub fn of_volume(path: &str) -> Scene {
        Scene { volume: Volume { file: FilePath(path.to_owned()), ..Volume::default() }, ..Scene::default() }
    }

    /// The section of that name.
    pub fn section(&self, name: &str) -> Option<&dyn Section> {
        Some(match name {
            "volume" => &self.volume,
            "medium" => &self.medium,
            "camera" => &self.camera,
            "film" => &self.film,
            "integrator" => &self.integrator,
            "tracking" => &self.tracking,
            "restir" => &self.restir,
            "display" => &self.display,
            _ => return None,
        })
    }

    /// The section of that name, to change.
    pub fn section_mut(&mut self, name: &str) -> Option<&mut dyn Section> {
        Some(match name {
            "volume" => &mut self.volume,
            "medium" => &mut self.medium,
            "camera" => &mut self.camera,
            "film" => &mut self.film,
            "integrator" => &mut self.integrator,
            "tracking" => &mut self.tracking,
            "restir" => &mut self.restir,
            "display" => &mut self.display,
            _ => return None,
        })
    }

    /// Every setting of this scene: its full key (`medium.g`, `lights.0.direction`), row and value.
    pub fn settings(&self) -> Vec<(String, &'static Row, Value)> {
        let mut all = Vec::new();
        let mut add = |prefix: &str, section: &dyn Section| {
            for (i, row) in section.rows().iter().enumerate() {
                all.push((format!("{prefix}.{}", row.key), row, section.get(i)));
            }
        };
        for name in SECTIONS {
            add(name, self.section(name).expect("every name of SECTIONS is a section"));
            if name == "medium" {
                for (i, light) in self.lights.iter().enumerate() {
                    add(&format!("lights.{i}"), light.section());
                }
            }
        }
        all
    }

    /// The layers that a change from `old` to `self` invalidates.
    pub fn changes(&self, old: &Scene) -> Layers {
        let mut layers = Layers::default();
        let kinds = |s: &Scene| s.lights.iter().map(Light::kind).collect::<Vec<_>>();
        let same_lights = kinds(self) == kinds(old);
        if !same_lights {
            layers = layers.union(Effect::LightData.layers());
        }
        for (key, row, value) in self.settings() {
            if key.starts_with("lights.") && !same_lights {
                continue;
            }
            if old.get(&key).as_ref() != Some(&value) {
                layers = layers.union(row.effect.layers());
            }
        }
        layers
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_default_is_in_its_range() {
        let mut rows: Vec<(String, &Row, Value)> = Scene::default().settings();
        for (kind, _) in Light::KINDS {
            let light = Light::of_kind(kind).expect("a listed kind");
            for (i, row) in light.section().rows().iter().enumerate() {
                rows.push((format!("{kind}.{}", row.key), row, light.section().get(i)));
            }
        }
        for (key, row, value) in rows {
            assert_eq!(row.check(&value), Ok(()), "{key}");
            assert!(!row.help.trim().is_empty() && row.label != row.key, "{key} needs help and label");
        }
    }

    #[test]
    fn a_change_touches_what_its_row_says() {
        let old = Scene::default();
        let mut new = old.clone();
        new.display.exposure = 1.0;
        assert_eq!(new.changes(&old), Effect::Display.layers());
        assert!(!new.changes(&old).accumulation);
        new.medium.g = 0.5;
        assert!(new.changes(&old).accumulation && !new.changes(&old).data);
        new.lights.pop();
        assert!(new.changes(&old).lights);
        assert_eq!(old.changes(&old), Layers::default());
    }
}
