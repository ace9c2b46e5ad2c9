//! Scenes as text: TOML in and out, keys by name, messages that name the key, the line and the nearest known key.

use std::fmt::Write as _;
use std::path::{Component, Path, PathBuf};

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::animation::Track;
use super::row::{Row, Section};
use super::value::{Kind, Value, asset_name};
use super::{Light, SECTIONS, Scene, VERSION};
use crate::error::{Code, Error, Result};

impl Scene {
    /// The section and row index of a full key such as `medium.g` or `lights.0.direction`.
    fn find(&self, key: &str) -> Option<(&dyn Section, usize)> {
        let (prefix, last) = key.rsplit_once('.')?;
        let section = match prefix.strip_prefix("lights.") {
            Some(index) => self.lights.get(index.parse::<usize>().ok()?)?.section(),
            None => self.section(prefix)?,
        };
        let index = section.rows().iter().position(|row| row.key == last)?;
        Some((section, index))
    }

    /// The row of a full key.
    pub fn row(&self, key: &str) -> Option<&'static Row> {
        self.find(key).map(|(section, index)| &section.rows()[index])
    }

    /// The value of a full key.
    pub fn get(&self, key: &str) -> Option<Value> {
        self.find(key).map(|(section, index)| section.get(index))
    }

    /// Sets one value; an error in words.
    pub fn assign(&mut self, key: &str, value: &Value) -> std::result::Result<(), String> {
        let Some((_, index)) = self.find(key) else { return Err(self.unknown_key(key)) };
        let prefix = key.rsplit_once('.').map_or("", |(prefix, _)| prefix);
        let section = match prefix.strip_prefix("lights.") {
            Some(light) => light.parse::<usize>().ok().and_then(|i| self.lights.get_mut(i)).map(Light::section_mut),
            None => self.section_mut(prefix),
        };
        section.expect("found above").set(index, value)
    }

    /// Words for a key that does not exist, with the nearest that does.
    pub fn unknown_key(&self, key: &str) -> String {
        let keys = self.settings().into_iter().map(|(key, row, _)| (key, row.range_text()));
        format!("unknown key \"{key}\".{}", nearest(key, keys))
    }

    /// Applies one `--set KEY=VALUE`; relative paths start at `folder`.
    pub fn set(&mut self, assignment: &str, folder: &Path) -> Result<()> {
        let bad = |why: String| {
            Error::new(Code::BadKey, format!("--set {assignment}: {why}"))
                .hint("`nephele settings` lists every key with its range.")
        };
        let (key, text) = assignment.split_once('=').ok_or_else(|| bad("no '=' in it.".into()))?;
        let mut value = Value::parse_or_text(text.trim());
        let key = key.trim();
        if key == "lights" && value == Value::List(Vec::new()) {
            self.lights.clear();
            return self.check().map_err(|why| bad(why.to_string()));
        }
        if self.row(key).is_some_and(|row| row.kind == Kind::Path) {
            value = resolve(value, folder);
        }
        self.assign(key, &value).map_err(bad)?;
        self.check().map_err(bad)
    }

    /// What no single row can check; an error in words.
    pub fn check(&self) -> std::result::Result<(), String> {
        self.find_fault().map_or(Ok(()), |(_, why)| Err(why))
    }

    /// The first fault that no single row can see: the path of the section or key where it stands, and the error.
    fn find_fault(&self) -> Option<(Vec<String>, String)> {
        use super::{Analytic, Procedural};
        let fault = |path: &str, why: &str| Some((path.split('.').map(str::to_owned).collect(), why.to_owned()));
        let sources = [
            !self.volume.file.0.is_empty(),
            self.volume.procedural != Procedural::None,
            self.volume.analytic != Analytic::None,
        ];
        if sources.iter().filter(|&&named| named).count() > 1 {
            return fault("volume", "a volume takes at most one of file, procedural and analytic.");
        }
        let linear = glam::DMat3::from_mat4(self.volume.to_world.to_mat());
        let last_row = &self.volume.to_world.0[12..];
        if last_row != [0.0, 0.0, 0.0, 1.0] || !linear.determinant().is_normal() {
            let why = "volume.to_world is no invertible affine map (its last row must be 0, 0, 0, 1).";
            return fault("volume.to_world", why);
        }
        let [low, high] = self.volume.bounds.0;
        if !low.cmplt(high).all() {
            return fault("volume.bounds", "volume.bounds: each lower side must lie below the upper one.");
        }
        let axis = self.volume.axis as usize;
        let fits = match self.volume.analytic {
            Analytic::Linear => low[axis].is_finite() && high[axis].is_finite(),
            Analytic::Exponential => low[axis].is_finite(),
            Analytic::None | Analytic::Homogeneous => true,
        };
        if !fits {
            let why = "volume.bounds: along volume.axis a formula needs a finite lower side, a linear one both.";
            return fault("volume.bounds", why);
        }
        if let Err(why) = self.tracking.check(self.volume.analytic != Analytic::None) {
            return fault("tracking", &why);
        }
        for (i, light) in self.lights.iter().enumerate() {
            if let Light::Sun(sun) = light
                && sun.direction == glam::DVec3::ZERO
            {
                return fault(&format!("lights.{i}.direction"), "a sun's direction may not be the zero vector.");
            }
        }
        if self.camera.up == glam::DVec3::ZERO {
            return fault("camera.up", "camera.up may not be the zero vector.");
        }
        self.animation.iter().enumerate().find_map(|(i, track)| {
            let why = track.check(self).err()?;
            fault(&format!("animation.{i}"), &format!("animation {i}: {why}"))
        })
    }

    /// Reads a scene; `name` is its file for messages, relative paths start at `folder`.
    pub fn parse(text: &str, name: &str, folder: &Path) -> Result<Scene> {
        Reader { text, name, folder }.scene()
    }

    /// The whole scene as TOML. Paths are written relative to `folder`, unless it is empty.
    pub fn to_toml(&self, folder: &Path) -> String {
        let mut out = format!("version = {VERSION}\n");
        let mut section = |title: &str, section: &dyn Section, kind: Option<&str>| {
            let _ = write!(out, "\n{title}\n");
            if let Some(kind) = kind {
                let _ = writeln!(out, "kind = \"{kind}\"");
            }
            for (i, row) in section.rows().iter().enumerate() {
                let mut value = section.get(i);
                if let (Kind::Path, Value::Text(path)) = (row.kind, &value) {
                    value = Value::Text(relative(path, folder));
                }
                let _ = writeln!(out, "{} = {value}", row.key);
            }
        };
        for name in SECTIONS {
            section(&format!("[{name}]"), self.section(name).expect("every name of SECTIONS is a section"), None);
            if name == "medium" {
                for light in &self.lights {
                    section("[[lights]]", light.section(), Some(light.kind()));
                }
            }
        }
        for track in &self.animation {
            let frames = Value::List(track.frames.iter().map(|&f| Value::Float(f)).collect());
            let values = Value::List(track.values.clone());
            let key = Value::Text(track.key.clone());
            let _ = write!(out, "\n[[animation]]\nkey = {key}\nframes = {frames}\nvalues = {values}\n");
        }
        if self.lights.is_empty() {
            out.insert_str(out.find('\n').map_or(0, |i| i + 1), "lights = []\n");
        }
        out
    }
}

/// `path` without `.` and `..`, by its text alone.
fn normal(path: &Path) -> PathBuf {
    let mut out = PathBuf::new();
    for part in path.components() {
        match part {
            Component::CurDir => {}
            Component::ParentDir if matches!(out.components().next_back(), Some(Component::Normal(_))) => {
                out.pop();
            }
            other => out.push(other),
        }
    }
    out
}

/// `path` as seen from `folder`; as it is where `folder` is empty or the two have no root in common.
fn relative(path: &str, folder: &Path) -> String {
    let (path_parts, folder) = (normal(Path::new(path)), normal(folder));
    let (mut ours, mut theirs) = (path_parts.components().peekable(), folder.components().peekable());
    if path.is_empty() || folder.as_os_str().is_empty() || ours.peek() != theirs.peek() {
        return path.to_owned();
    }
    while ours.peek().is_some() && ours.peek() == theirs.peek() {
        ours.next();
        theirs.next();
    }
    let up = theirs.map(|_| Component::ParentDir);
    up.chain(ours).collect::<PathBuf>().to_string_lossy().into_owned()
}

fn resolve(value: Value, folder: &Path) -> Value {
    match value {
        Value::Text(path) if !path.is_empty() && asset_name(&path).is_none() && Path::new(&path).is_relative() => {
            Value::Text(normal(&folder.join(path)).to_string_lossy().into_owned())
        }
        other => other,
    }
}

/// ` Did you mean …?`, or nothing if nothing is near.
fn nearest(key: &str, keys: impl Iterator<Item = (String, String)>) -> String {
    /// Below this Jaro–Winkler likeness a key is no likely misspelling.
    const LIKELY: f64 = 0.75;
    let best = keys
        .map(|(name, range)| (strsim::jaro_winkler(key, &name), name, range))
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .filter(|best| best.0 > LIKELY);
    best.map_or(String::new(), |(_, name, range)| format!(" Did you mean \"{name}\" ({range})?"))
}

/// Where the last part of `path` stands that the file has; the start of the file where it has none.
fn place(table: &Spanned<DeTable>, path: &[String]) -> usize {
    let mut at = 0;
    let mut value: Option<&DeValue> = None;
    for (depth, part) in path.iter().enumerate() {
        let next = match value {
            None if depth == 0 => table.get_ref().get_key_value(part.as_str()).map(|(k, v)| (k.span().start, v)),
            Some(DeValue::Table(t)) => t.get_key_value(part.as_str()).map(|(k, v)| (k.span().start, v)),
            Some(DeValue::Array(list)) => {
                part.parse().ok().and_then(|i: usize| list.get(i)).map(|v| (v.span().start, v))
            }
            _ => None,
        };
        let Some((start, found)) = next else { break };
        at = start;
        value = Some(found.get_ref());
    }
    at
}

/// Reads one scene file.
struct Reader<'a> {
    text: &'a str,
    name: &'a str,
    folder: &'a Path,
}

impl Reader<'_> {
    fn error(&self, at: usize, why: impl std::fmt::Display) -> Error {
        let line = self.text[..at.min(self.text.len())].matches('\n').count() + 1;
        Error::new(Code::BadKey, format!("{}:{line}: {why}", self.name))
            .hint("`nephele settings` lists every key with its range.")
    }

    fn scene(&self) -> Result<Scene> {
        let table = DeTable::parse(self.text).map_err(|e| {
            self.error(e.span().map_or(0, |s| s.start), e.message().lines().next().unwrap_or("not TOML"))
        })?;
        let mut scene = Scene::default();
        for (key, value) in table.get_ref() {
            let (name, at) = (key.get_ref().as_ref(), key.span().start);
            match (name, value.get_ref()) {
                ("version", DeValue::Integer(i)) if i.as_str() == VERSION.to_string() => {}
                ("version", _) => {
                    let why = format!("version {:?} is not known: this build reads {VERSION}.", value.get_ref());
                    return Err(self.error(at, why));
                }
                ("lights", DeValue::Array(lights)) => {
                    scene.lights.clear();
                    for light in lights.iter() {
                        scene.lights.push(self.light(light.get_ref(), light.span().start)?);
                    }
                }
                ("animation", DeValue::Array(tracks)) => {
                    for track in tracks.iter() {
                        scene.animation.push(self.track(track.get_ref(), track.span().start)?);
                    }
                }
                (name, DeValue::Table(table)) if scene.section(name).is_some() => {
                    self.fill(scene.section_mut(name).expect("just found"), name, table, &[])?;
                }
                (name, _) if SECTIONS.contains(&name) || name == "lights" || name == "animation" => {
                    return Err(self.error(at, format!("\"{name}\" is a section, not a value.")));
                }
                _ => {
                    let known =
                        SECTIONS.iter().chain(&["lights", "animation"]).map(|s| ((*s).to_owned(), "a section".into()));
                    return Err(self.error(at, format!("unknown key \"{name}\".{}", nearest(name, known))));
                }
            }
        }
        match scene.find_fault() {
            None => Ok(scene),
            Some((path, why)) => Err(self.error(place(&table, &path), why)),
        }
    }

    fn fill(&self, section: &mut dyn Section, title: &str, table: &DeTable, skip: &[&str]) -> Result<()> {
        for (key, value) in table {
            let (name, at) = (key.get_ref().as_ref(), key.span().start);
            if skip.contains(&name) {
                continue;
            }
            let Some(index) = section.rows().iter().position(|row| row.key == name) else {
                let keys = section.rows().iter().map(|row| (format!("{title}.{}", row.key), row.range_text()));
                let full = format!("{title}.{name}");
                return Err(self.error(at, format!("unknown key \"{full}\".{}", nearest(&full, keys))));
            };
            let row = &section.rows()[index];
            let mut new = Value::from_toml(value.get_ref())
                .ok_or_else(|| self.error(at, format!("{title}.{name}: {} expected.", row.range_text())))?;
            if row.kind == Kind::Path {
                new = resolve(new, self.folder);
            }
            section.set(index, &new).map_err(|why| self.error(at, format!("{title}.{name}: {why}")))?;
        }
        Ok(())
    }

    fn light(&self, value: &DeValue, at: usize) -> Result<Light> {
        let kinds = || Light::KINDS.iter().map(|(k, _)| format!("\"{k}\"")).collect::<Vec<_>>().join(", ");
        let table = value.as_table().ok_or_else(|| self.error(at, "a light is a table: [[lights]]."))?;
        let value = table.get("kind");
        let kind = value.and_then(|v| v.get_ref().as_str());
        let kind = kind.ok_or_else(|| self.error(at, format!("a light needs a kind: {}.", kinds())))?;
        let place = value.map_or(at, |v| v.span().start);
        let mut light = Light::of_kind(kind)
            .ok_or_else(|| self.error(place, format!("lights.kind: \"{kind}\" is not one of {}.", kinds())))?;
        self.fill(light.section_mut(), "lights", table, &["kind"])?;
        Ok(light)
    }

    fn track(&self, value: &DeValue, at: usize) -> Result<Track> {
        let table = value.as_table().ok_or_else(|| self.error(at, "an animation is a table: [[animation]]."))?;
        let known = ["key", "frames", "values"];
        for (key, _) in table {
            if !known.contains(&key.get_ref().as_ref()) {
                let why = format!("unknown key \"animation.{}\": it takes {}.", key.get_ref(), known.join(", "));
                return Err(self.error(key.span().start, why));
            }
        }
        let get = |name: &str| {
            let value = table.get(name).and_then(|v| Value::from_toml(v.get_ref()));
            value.ok_or_else(|| self.error(at, format!("animation.{name} is missing or no value.")))
        };
        match (get("key")?, get("frames")?, get("values")?) {
            (Value::Text(key), Value::List(frames), Value::List(values)) => {
                let frames: Option<Vec<f64>> = frames.iter().map(Value::number).collect();
                let frames = frames.ok_or_else(|| self.error(at, "animation.frames: numbers expected."))?;
                Ok(Track { key, frames, values })
            }
            _ => Err(self.error(at, "animation: key is a string, frames and values are lists.")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(text: &str) -> Result<Scene> {
        Scene::parse(text, "s.toml", Path::new(""))
    }

    #[test]
    fn an_empty_file_is_the_default_scene() {
        assert_eq!(parse("").expect("empty"), Scene::default());
    }

    #[test]
    fn a_scene_survives_the_round_trip() {
        let mut scene = Scene::default();
        for (kind, _) in Light::KINDS {
            scene.lights.push(Light::of_kind(kind).expect("listed"));
        }
        scene.set("medium.g=-0.25", Path::new("")).expect("in range");
        scene.set("medium.density_scale=3", Path::new("")).expect("in range");
        scene.set("volume.bounds=[[-inf,-1,-1],[inf,1,1]]", Path::new("")).expect("a box");
        scene.set("integrator.max_bounces=unlimited", Path::new("")).expect("a word");
        scene.set("volume.grid=a \"b\"", Path::new("")).expect("a string");
        scene.animation.push(Track {
            key: "camera.fov_y".into(),
            frames: vec![0.0, 1.5],
            values: vec![Value::Float(20.0), Value::Float(30.0)],
        });
        assert_eq!(parse(&scene.to_toml(Path::new(""))).expect("own text"), scene);
        scene.lights.clear();
        scene.animation.clear();
        assert_eq!(parse(&scene.to_toml(Path::new(""))).expect("own text"), scene);
    }

    #[test]
    fn messages_name_line_range_and_nearest_key() {
        let e = parse("[medium]\n\ngg = 1").expect_err("unknown").to_string();
        assert!(
            e.contains("s.toml:3") && e.contains("medium.gg") && e.contains("\"medium.g\" (−0.999 … 0.999)"),
            "{e}"
        );
        let e = parse("[medium]\ng = 2").expect_err("range").to_string();
        assert!(e.contains("s.toml:2") && e.contains("−0.999 … 0.999"), "{e}");
        let e = parse("[medium]\nphase = \"foo\"").expect_err("choice").to_string();
        assert!(e.contains("\"rayleigh\"") && e.contains("two-lobe-hg"), "{e}");
        let e = parse("[[lights]]\nkind = \"lamp\"").expect_err("kind").to_string();
        assert!(e.contains("\"point\"") && e.contains("s.toml:2"), "{e}");
        assert!(parse("[medium]\ng = \"x\"").is_err() && parse("[film]\nwidth = 1.5").is_err());
        assert!(parse("[film]\nwidth = 0").is_err() && parse("[camera]\nposition = [1, 2]").is_err());
        assert!(parse("[camera]\nposition = [1, 2, nan]").is_err());
        assert!(parse("version = 2").is_err() && parse("medium = 3").is_err() && parse("x = = 1").is_err());
        let at = |text: &str, place: &str| {
            let e = parse(text).expect_err("does not fit").to_string();
            assert!(e.contains(place), "{place} expected: {e}");
        };
        at("[film]\nwidth = 9\n[volume]\nfile = \"a\"\nanalytic = \"homogeneous\"", "s.toml:3");
        at("[volume]\nfilter = \"nearest\"\nbounds = [[1,1,1],[0,2,2]]", "s.toml:3");
        at("[medium]\ng = 0\n[tracking]\nfree_flight = \"closed-form\"", "s.toml:3");
        at("[[lights]]\nkind = \"constant\"\n[[lights]]\nkind = \"sun\"\ndirection = [0,0,0]", "s.toml:5");
        at("[medium]\ng = 0\n[[animation]]\nkey = \"medium.h\"\nframes = [0]\nvalues = [1]", "s.toml:3");
    }

    #[test]
    fn set_takes_toml_or_text_and_paths_from_its_folder() {
        let mut scene = Scene::default();
        scene.set("volume.file=x.vdb", Path::new("/data")).expect("a path");
        assert_eq!(scene.volume.file.0, "/data/x.vdb");
        scene.set("lights.0.direction=[0,1,0]", Path::new("")).expect("a vector");
        assert!(scene.set("lights.7.direction=[0,1,0]", Path::new("")).is_err());
        assert!(scene.set("medium.g", Path::new("")).is_err());
        let seen_from = |folder: &str| parse(&scene.to_toml(Path::new(folder))).expect("own text").volume.file.0;
        assert_eq!(seen_from("/data"), "x.vdb");
        assert_eq!(seen_from("/pictures/new"), "../../data/x.vdb");
        scene.set("volume.file=asset:disney-cloud", Path::new("/data")).expect("a built-in volume");
        let text = scene.to_toml(Path::new("/data"));
        assert_eq!(parse(&text).expect("own text").volume.file.0, "asset:disney-cloud", "in no folder");
    }
}
