//! Shader text: the catalogue of WGSL files, the linker, and messages that point into the files.
//!
//! `//!use core/rng` links a file once; `//!slot phase` links the file that a [`Variant`] chose for that slot. Directives
//! become empty lines, so a line of the linked text maps back to a file and line. The text is validated by naga before
//! a driver sees it.

use std::collections::HashSet;
use std::path::PathBuf;

use wgpu::naga;

use crate::error::{Code, Error, Result};

/// Declares the catalogue: every WGSL file, embedded.
macro_rules! catalogue {
    ($($name:literal),* $(,)?) => {
        /// Every shader file by its path under `shaders/`, without the extension.
        pub const CATALOGUE: &[(&str, &str)] =
            &[ $( ($name, include_str!(concat!("../../shaders/", $name, ".wgsl"))) ),* ];
    };
}

catalogue![
    "aim/marched",
    "aim/sighted",
    "bench/bare",
    "core/camera",
    "core/math",
    "core/params",
    "core/ray",
    "core/rng",
    "display/difference",
    "display/present",
    "display/tone_map",
    "film/film",
    "film/flush",
    "film/pause",
    "film/resolve",
    "flight/closed_form",
    "flight/collide",
    "flight/decomposition",
    "flight/delta",
    "flight/hero",
    "flight/ray_marching",
    "flight/regular",
    "flight/signed",
    "flight/spectral_avg",
    "flight/spectral_history",
    "flight/spectral_max",
    "flight/walk",
    "flight/weighted",
    "flight/weighted_decomposition",
    "flight/weighted_delta",
    "integrate/path",
    "light/environment",
    "light/light",
    "light/toward",
    "majorant/grid",
    "majorant/profile",
    "majorant/segment",
    "majorant/tree",
    "majorant/whole",
    "medium/dense",
    "medium/dense_exact",
    "medium/dense_nearest",
    "medium/dual",
    "medium/exponential",
    "medium/homogeneous",
    "medium/linear",
    "medium/profile",
    "phase/hg",
    "phase/isotropic",
    "phase/lobe",
    "phase/rayleigh",
    "phase/two_lobe_hg",
    "probe/probe",
    "probe/probe_flight",
    "probe/probe_light",
    "probe/probe_majorant",
    "probe/probe_medium",
    "probe/probe_phase",
    "probe/probe_reuse",
    "probe/probe_rng",
    "probe/probe_tone_map",
    "probe/probe_transmittance",
    "proxy/analytic",
    "proxy/dense",
    "reuse/candidates",
    "reuse/end",
    "reuse/frame",
    "reuse/frozen",
    "reuse/leg",
    "reuse/look",
    "reuse/merge",
    "reuse/onset",
    "reuse/onward",
    "reuse/pair",
    "reuse/pairwise",
    "reuse/reservoir",
    "reuse/seen",
    "reuse/shade",
    "reuse/shift",
    "reuse/suffix",
    "reuse/table",
    "reuse/target",
    "reuse/temporal",
    "reuse/view",
    "reuse_2021/finish",
    "reuse_2021/gather",
    "reuse_2021/initial",
    "reuse_2021/reproject",
    "spectrum/colour",
    "spectrum/grey",
    "track/comb",
    "track/count",
    "track/exact",
    "track/march",
    "track/step",
    "transmittance/closed_form",
    "transmittance/collide",
    "transmittance/delta",
    "transmittance/depth",
    "transmittance/jackknife",
    "transmittance/next_flight",
    "transmittance/power_series",
    "transmittance/product",
    "transmittance/ratio",
    "transmittance/ray_marching",
    "transmittance/regular",
    "transmittance/residual_ratio",
    "transmittance/telescoping",
    "transmittance/unbiased_ray_marching",
    "transmittance/walk",
];

/// A choice of slot files and constants: what tells one pipeline of a kernel from another.
#[derive(Clone, Debug, Default, PartialEq, Eq, Hash)]
pub struct Variant {
    /// Slot and the file that fills it.
    pub slots: Vec<(&'static str, &'static str)>,
    /// Names and WGSL values of constants.
    pub constants: Vec<(&'static str, String)>,
}

impl Variant {
    /// Adds a slot choice.
    pub fn slot(mut self, slot: &'static str, file: &'static str) -> Variant {
        self.slots.push((slot, file));
        self
    }

    /// Adds a constant.
    pub fn flag(mut self, name: &'static str, value: bool) -> Variant {
        self.constants.push((name, value.to_string()));
        self
    }

    /// Adds a whole constant.
    pub fn count(mut self, name: &'static str, value: u32) -> Variant {
        self.constants.push((name, format!("{value}u")));
        self
    }
}

/// Where shader text comes from.
#[derive(Clone, Debug, Default)]
pub struct Source {
    /// The `shaders` folder to read from, which must be there; the embedded catalogue where it is `None` or a file is missing
    /// in it.
    pub folder: Option<PathBuf>,
    /// Edits of the linked text, for tests that plant an error: each must find its text exactly once.
    pub plants: Vec<(String, String)>,
}

impl Source {
    /// The embedded files; in a debug build run from the source tree, the files on disk.
    pub fn standard() -> Source {
        let folder = PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/shaders"));
        Source { folder: (cfg!(debug_assertions) && folder.is_dir()).then_some(folder), plants: Vec::new() }
    }

    fn read(&self, name: &str) -> Result<String> {
        let disk = self.folder.as_ref().map(|f| f.join(format!("{name}.wgsl")));
        if let Some(text) = disk.and_then(|path| std::fs::read_to_string(path).ok()) {
            return Ok(text);
        }
        let embedded = CATALOGUE.iter().find(|(n, _)| *n == name).map(|(_, text)| (*text).to_owned());
        embedded.ok_or_else(|| Error::new(Code::Shader, format!("There is no shader file shaders/{name}.wgsl.")))
    }

    /// Links `entry` with everything it uses.
    pub fn link(&self, entry: &str, variant: &Variant) -> Result<Linked> {
        // Other files than those asked for must not be taken in silence.
        if let Some(folder) = self.folder.as_ref().filter(|folder| !folder.is_dir()) {
            let what = format!("The folder of shaders {} is gone.", folder.display());
            return Err(Error::new(Code::Shader, what).hint("Put it back, or build the program anew."));
        }
        let mut linked = Linked { text: String::new(), places: Vec::new() };
        for (name, value) in &variant.constants {
            linked.text += &format!("const {name} = {value};\n");
        }
        linked.places.push((1, "variant".into()));
        let mut seen = HashSet::new();
        self.include(entry, variant, &mut seen, &mut Vec::new(), &mut linked)?;
        for (from, to) in &self.plants {
            if linked.text.matches(from.as_str()).count() == 1 {
                linked.text = linked.text.replace(from.as_str(), to);
            } else {
                let why = format!("{from:?} is there {} times, not once.", linked.text.matches(from.as_str()).count());
                return Err(Error::new(Code::Shader, format!("Cannot plant an error in {entry}.")).why(why));
            }
        }
        Ok(linked)
    }

    fn include(
        &self,
        name: &str,
        variant: &Variant,
        seen: &mut HashSet<String>,
        chain: &mut Vec<String>,
        out: &mut Linked,
    ) -> Result<()> {
        if chain.iter().any(|n| n == name) {
            let why = format!("{} → {name}", chain.join(" → "));
            return Err(Error::new(Code::Shader, "Shader files use one another in a circle.").why(why));
        }
        if !seen.insert(name.to_owned()) {
            return Ok(());
        }
        chain.push(name.to_owned());
        let text = self.read(name)?;
        for line in text.lines() {
            if let Some(used) = line.strip_prefix("//!use ") {
                self.include(used.trim(), variant, seen, chain, out)?;
            } else if let Some(slot) = line.strip_prefix("//!slot ") {
                let file = variant.slots.iter().find(|(s, _)| *s == slot.trim()).map(|(_, file)| *file);
                let file = file.ok_or_else(|| {
                    Error::new(Code::Shader, format!("shaders/{name}.wgsl needs a file for slot {}.", slot.trim()))
                })?;
                self.include(file, variant, seen, chain, out)?;
            }
        }
        out.places.push((out.text.lines().count() + 1, format!("shaders/{name}.wgsl")));
        for line in text.lines() {
            out.text += if line.starts_with("//!") { "" } else { line };
            out.text.push('\n');
        }
        chain.pop();
        Ok(())
    }
}

/// Linked text and where its lines come from.
#[derive(Clone, Debug)]
pub struct Linked {
    /// WGSL.
    pub text: String,
    /// First line of each piece, and its file.
    pub places: Vec<(usize, String)>,
}

impl Linked {
    /// File and line in it of a line of the linked text, both counted from 1.
    pub fn place(&self, line: usize) -> (String, usize) {
        let index = self.places.partition_point(|(first, _)| *first <= line).max(1) - 1;
        let (first, file) = &self.places[index];
        (file.clone(), line - first + 1)
    }

    /// Parses and validates; the module, or a message with file, line, column and the line itself.
    pub fn validate(&self) -> Result<naga::Module> {
        let module = naga::front::wgsl::parse_str(&self.text).map_err(|e| {
            let at = e.location(&self.text).map(|l| (l.line_number as usize, l.line_position as usize));
            self.error(at, e.message().to_owned())
        })?;
        let mut validator =
            naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all());
        validator.validate(&module).map_err(|e| {
            // The innermost cause and its span say most; outer ones quote whole functions.
            let at = e.spans().last().map(|(span, _)| span.location(&self.text));
            let mut why = e.as_inner().to_string();
            let mut cause: Option<&dyn std::error::Error> = std::error::Error::source(e.as_inner());
            while let Some(inner) = cause {
                why = inner.to_string();
                cause = inner.source();
            }
            self.error(at.map(|l| (l.line_number as usize, l.line_position as usize)), why)
        })?;
        Ok(module)
    }

    fn error(&self, at: Option<(usize, usize)>, why: String) -> Error {
        let Some((line, column)) = at else { return Error::new(Code::Shader, why) };
        let (file, file_line) = self.place(line);
        let quoted = self.text.lines().nth(line - 1).unwrap_or_default().trim().to_owned();
        Error::new(Code::Shader, format!("{file}:{file_line}:{column}: {why}")).why(quoted)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_point_into_the_file() {
        let mut source = Source::standard();
        source.plants.push(("return (x >> 22u) ^ x;".into(), "return (x >> 22u) ^ y;".into()));
        let variant = Variant::default();
        let linked = source.link("core/rng", &variant).expect("links");
        let message = linked.validate().expect_err("y is unknown").to_string();
        let line = CATALOGUE.iter().find(|(n, _)| *n == "core/rng").expect("listed").1;
        let line = line.lines().position(|l| l.contains("return (x >> 22u) ^ x;")).expect("there") + 1;
        assert!(message.starts_with(&format!("shaders/core/rng.wgsl:{line}:")), "{message}");
        source.plants[0].0 = "not there".into();
        assert!(source.link("core/rng", &variant).is_err());
    }
}
