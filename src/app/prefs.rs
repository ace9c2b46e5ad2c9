//! What the window remembers between runs: a small TOML file in the platform's configuration folder
//! (`NEPHELE_CONFIG_DIR` names another), and the scene of the last session beside it.

use std::path::{Path, PathBuf};

use crate::error::Result;
use crate::io::picture;
use crate::scene::{Camera, Scene};

use super::lab::{Lab, fill, table_of};
use super::panels::Open;

/// Bookmarks of the camera.
pub const BOOKMARKS: usize = 4;

/// The scene of the last run.
#[derive(Clone, Debug, PartialEq)]
pub struct Session {
    /// The scene.
    pub scene: Scene,
    /// The lab.
    pub lab: Lab,
    /// The run ended without closing its window.
    pub broken: bool,
}

/// Remembered state of the window.
#[derive(Clone, Debug, PartialEq)]
pub struct Prefs {
    /// Size of the window, points.
    pub window: (u32, u32),
    /// Width of the side panel, points.
    pub panel_width: f32,
    /// Whether the panel is shown.
    pub panel: bool,
    /// Light rather than dark.
    pub light: bool,
    /// Zoom of the interface.
    pub zoom: f32,
    /// Reduced resolution while things move.
    pub dynamic: bool,
    /// Samples after which a picture is done; 0: never.
    pub sample_limit: u32,
    /// Which sections are open.
    pub open: Open,
    /// Bookmarks of the camera.
    pub cameras: [Option<Camera>; BOOKMARKS],
    /// The scene of the last run, until it is restored or refused; not part of the file.
    pub session: Option<Session>,
    /// Keys that a newer version wrote; kept.
    unknown: toml::Table,
}

impl Default for Prefs {
    fn default() -> Prefs {
        Prefs {
            window: (1280, 800),
            panel_width: super::theme::size::PANEL,
            panel: true,
            light: false,
            zoom: 1.0,
            dynamic: true,
            sample_limit: 0,
            open: Open::default(),
            cameras: Default::default(),
            session: None,
            unknown: toml::Table::new(),
        }
    }
}

/// The folder of preferences, if the platform has one.
pub fn folder() -> Option<PathBuf> {
    match std::env::var_os("NEPHELE_CONFIG_DIR") {
        Some(dir) if !dir.is_empty() => Some(PathBuf::from(dir)),
        _ => directories::ProjectDirs::from("", "", "nephele").map(|d| d.config_dir().to_path_buf()),
    }
}

const FILE: &str = "window.toml";
const SESSION: &str = "session.toml";
/// The table of the lab in it.
const LAB: &str = "lab";
/// First line of a session whose window has not been closed yet.
const BROKEN: &str = "# The window is open, or stopped without closing.\n";
/// Smallest and largest size of a window that is remembered.
const SIDES: std::ops::RangeInclusive<i64> = 200..=16384;

impl Prefs {
    /// The preferences of the last run, and its scene; what is missing or does not fit is the default.
    pub fn load() -> Prefs {
        let read = |name: &str| folder().and_then(|f| std::fs::read_to_string(f.join(name)).ok()).unwrap_or_default();
        Prefs { session: parse_session(&read(SESSION)), ..Prefs::parse(&read(FILE)) }
    }

    fn parse(text: &str) -> Prefs {
        let mut prefs = Prefs::default();
        let Ok(mut table) = text.parse::<toml::Table>() else { return prefs };
        let side =
            |v: Option<toml::Value>| v.and_then(|v| v.as_integer()).filter(|n| SIDES.contains(n)).map(|n| n as u32);
        let number = |v: toml::Value| v.as_float().map(|x| x as f32);
        if let (Some(w), Some(h)) = (side(table.remove("width")), side(table.remove("height"))) {
            prefs.window = (w, h);
        }
        if let Some(w) = table.remove("panel_width").and_then(number) {
            prefs.panel_width =
                w.clamp(*super::theme::size::PANEL_RANGE.start(), *super::theme::size::PANEL_RANGE.end());
        }
        if let Some(zoom) = table.remove("zoom").and_then(number) {
            prefs.zoom = zoom.clamp(0.5, 3.0);
        }
        for (key, slot) in [("panel", &mut prefs.panel), ("light", &mut prefs.light), ("dynamic", &mut prefs.dynamic)] {
            if let Some(on) = table.remove(key).and_then(|v| v.as_bool()) {
                *slot = on;
            }
        }
        if let Some(n) = table.remove("sample_limit").and_then(|v| v.as_integer()) {
            prefs.sample_limit = u32::try_from(n).unwrap_or(0);
        }
        if let Some(list) = table.remove("open").and_then(|v| v.as_array().cloned()) {
            for (slot, value) in prefs.open.0.iter_mut().zip(list) {
                *slot = value.as_bool().unwrap_or(*slot);
            }
        }
        for (i, slot) in prefs.cameras.iter_mut().enumerate() {
            *slot = table.remove(&camera_key(i)).and_then(|v| parse_camera(v.as_table()?));
        }
        prefs.unknown = table;
        prefs
    }

    fn to_toml(&self) -> String {
        let mut table = self.unknown.clone();
        let mut put = |key: &str, value: toml::Value| table.insert(key.into(), value);
        put("width", i64::from(self.window.0).into());
        put("height", i64::from(self.window.1).into());
        put("panel_width", f64::from(self.panel_width).into());
        put("panel", self.panel.into());
        put("light", self.light.into());
        put("zoom", f64::from(self.zoom).into());
        put("dynamic", self.dynamic.into());
        put("sample_limit", i64::from(self.sample_limit).into());
        put("open", self.open.0.to_vec().into());
        for (i, camera) in self.cameras.iter().enumerate() {
            if let Some(camera) = camera {
                put(&camera_key(i), table_of(camera).into());
            }
        }
        table.to_string()
    }

    /// Writes the preferences, and the scene of a session that ends well.
    ///
    /// # Errors
    /// [`crate::error::Code::Write`] where the folder cannot be written to.
    pub fn save(&self, scene: &Scene, lab: &Lab) -> Result<()> {
        write(FILE, &self.to_toml())?;
        self.save_session(scene, lab, false)
    }

    /// Writes scene and lab of the session; `broken`: the window is still open. A session that waits to be restored is not
    /// written over by a scene that nobody has touched.
    ///
    /// # Errors
    /// [`crate::error::Code::Write`] where the folder cannot be written to.
    pub fn save_session(&self, scene: &Scene, lab: &Lab, broken: bool) -> Result<()> {
        if self.session.is_some() && *scene == Scene::default() && *lab == Lab::default() {
            return Ok(());
        }
        write(SESSION, &session_text(scene, lab, broken))
    }
}

fn write(name: &str, text: &str) -> Result<()> {
    let Some(folder) = folder() else { return Ok(()) };
    std::fs::create_dir_all(&folder).map_err(|e| crate::error::Error::writing(&folder, &e))?;
    picture::write_whole(&folder.join(name), |f| std::io::Write::write_all(f, text.as_bytes()))
}

fn session_text(scene: &Scene, lab: &Lab, broken: bool) -> String {
    let mark = if broken { BROKEN } else { "" };
    let lab = toml::Table::from_iter([(LAB.to_owned(), lab.to_toml().into())]);
    format!("{mark}{}\n{lab}", scene.to_toml(Path::new("")))
}

/// Scene and lab of a session's file; nothing where the scene does not fit this version.
fn parse_session(text: &str) -> Option<Session> {
    if text.is_empty() {
        return None;
    }
    let mut table: toml::Table = text.parse().ok()?;
    let lab = match table.remove(LAB) {
        Some(toml::Value::Table(lab)) => Lab::parse(lab),
        _ => Lab::default(),
    };
    let scene = Scene::parse(&table.to_string(), SESSION, Path::new("")).ok()?;
    Some(Session { scene, lab, broken: text.starts_with(BROKEN) })
}

fn camera_key(index: usize) -> String {
    format!("camera_{}", index + 1)
}

/// The camera of a table; nothing where a value does not fit.
fn parse_camera(table: &toml::Table) -> Option<Camera> {
    let mut camera = Camera::default();
    fill(&mut camera, table).then_some(camera)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn preferences_survive_and_bad_ones_are_defaults() {
        let mut prefs = Prefs { light: true, window: (900, 700), ..Prefs::default() };
        prefs.open.0[3] = true;
        assert_eq!(Prefs::parse(&prefs.to_toml()), prefs);
        assert_eq!(Prefs::parse("width = \"x\"\nheight = 3\nzoom = nan = 1"), Prefs::default());
        let newer = Prefs::parse("future = 1\nlight = true");
        assert!(newer.light && newer.to_toml().contains("future = 1"));
    }

    #[test]
    fn bookmarks_survive_and_bad_ones_are_dropped() {
        let mut prefs = Prefs::default();
        let position = crate::scene::value::Auto::Is(glam::DVec3::new(1.0, 0.1, -3e-7));
        prefs.cameras[1] = Some(Camera { position, fov_y: 27.5, ..Camera::default() });
        assert_eq!(Prefs::parse(&prefs.to_toml()), prefs);
        let bad = Prefs::parse("light = true\n[camera_1]\nfov_y = 400.0\n[camera_2]\nfov_y = 30.0\n[camera_3]\nx = 1");
        assert_eq!(bad.cameras, [None, Some(Camera { fov_y: 30.0, ..Camera::default() }), None, None]);
        assert!(bad.light);
    }

    #[test]
    fn a_session_tells_how_its_window_ended() {
        let mut scene = Scene::of_volume("asset:smoke-column");
        scene.medium.g = 0.1;
        let mut lab = Lab { own: Some(crate::app::lab::Own::copy(&scene)), ..Lab::default() };
        lab.controls.open = true;
        for broken in [false, true] {
            let session = Session { scene: scene.clone(), lab: lab.clone(), broken };
            assert_eq!(parse_session(&session_text(&scene, &lab, broken)), Some(session));
        }
        let old = Session { scene: scene.clone(), lab: Lab::default(), broken: false };
        assert_eq!(parse_session(&scene.to_toml(Path::new(""))), Some(old), "from before there was a lab");
        assert_eq!((parse_session(""), parse_session("medium = 3")), (None, None));
    }
}
