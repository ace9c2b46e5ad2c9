//! What the window remembers between runs: a small TOML file in the platform's configuration folder
//! (`NEPHELE_CONFIG_DIR` names another), and the scene of the last session beside it.

use std::path::PathBuf;

use crate::error::Result;
use crate::io::picture;

use super::panels::Open;

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
/// Smallest and largest size of a window that is remembered.
const SIDES: std::ops::RangeInclusive<i64> = 200..=16384;

impl Prefs {
    /// The preferences of the last run; what is missing or does not fit is the default.
    pub fn load() -> Prefs {
        let text = folder().and_then(|f| std::fs::read_to_string(f.join(FILE)).ok()).unwrap_or_default();
        Prefs::parse(&text)
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
        table.to_string()
    }

    /// Writes the preferences, and the scene of the session.
    pub fn save(&self, scene: &crate::scene::Scene) -> Result<()> {
        let Some(folder) = folder() else { return Ok(()) };
        std::fs::create_dir_all(&folder).map_err(|e| crate::error::Error::writing(&folder, &e))?;
        let write = |name: &str, text: String| {
            picture::write_whole(&folder.join(name), |f| std::io::Write::write_all(f, text.as_bytes()))
        };
        write(FILE, self.to_toml())?;
        write(SESSION, scene.to_toml(std::path::Path::new("")))
    }
}

/// The scene file of the last session, if there is one.
pub fn session() -> Option<PathBuf> {
    folder().map(|f| f.join(SESSION)).filter(|p| p.is_file())
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
}
