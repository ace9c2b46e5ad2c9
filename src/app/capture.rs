//! Saving what is on screen: PNG and EXR with the whole scene inside, or the scene alone.

use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::picture;
use crate::render::Renderer;
use crate::render::film::Sums;
use crate::save;
use crate::scene::Scene;
use crate::scene::value::asset_name;

/// Numbers that are tried for a free file name.
const TRIES: u32 = 100_000;

/// The folder that captures go to: the user's pictures, else the working folder.
pub fn folder() -> PathBuf {
    directories::UserDirs::new()
        .and_then(|d| d.picture_dir().map(Path::to_path_buf))
        .filter(|p| p.is_dir())
        .or_else(|| std::env::current_dir().ok())
        .unwrap_or_default()
}

/// The name of the scene's volume without its ending.
pub fn stem(scene: &Scene) -> String {
    if let Some(name) = asset_name(&scene.volume.file.0) {
        return name.to_owned();
    }
    let file = Path::new(&scene.volume.file.0).file_stem().map(|s| s.to_string_lossy().into_owned());
    file.filter(|s| !s.is_empty()).unwrap_or_else(|| "cumulus".into())
}

/// A path `folder/stem_N` none of whose endings is taken.
fn free(folder: &Path, stem: &str, endings: &[&str]) -> PathBuf {
    let path = |n: u32| folder.join(format!("{stem}_{n}"));
    let taken = |p: &Path| endings.iter().any(|e| p.with_extension(e).exists());
    (1..TRIES).map(path).find(|p| !taken(p)).unwrap_or_else(|| path(TRIES))
}

/// Saves the picture as PNG and EXR; the path of both without the ending.
pub fn picture(renderer: &Renderer, sums: &Sums, seconds: f64) -> Result<PathBuf> {
    let scene = &renderer.scene;
    let samples = sums.square.iter().map(|s| s[3]).fold(f64::INFINITY, f64::min) as u64;
    let folder = folder();
    let path = free(&folder, &format!("{}_{samples:04}spp", stem(scene)), &["png", "exr"]);
    let mut stats = save::stats(renderer, sums, samples);
    stats["render_seconds"] = seconds.into();
    let mut saved = scene.clone();
    (saved.film.width, saved.film.height) = (sums.width, sums.height);
    let image = sums.image(&[], scene.medium.albedo.0, None);
    for ending in ["png", "exr"] {
        let file = path.with_extension(ending);
        if !save::overlay(&file, sums, &saved, &mut stats)? {
            save::picture(&file, &image, &saved, &stats)?;
        }
    }
    Ok(path)
}

/// Saves the scene as TOML; its path.
pub fn scene(scene: &Scene) -> Result<PathBuf> {
    let folder = folder();
    let path = free(&folder, &stem(scene), &["toml"]).with_extension("toml");
    let text = scene.to_toml(&folder);
    picture::write_whole(&path, |f| std::io::Write::write_all(f, text.as_bytes()))
        .map_err(|e: Error| e.hint("Choose a pictures folder that can be written to."))?;
    Ok(path)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_never_taken_twice() {
        let folder = tempfile::tempdir().expect("a folder");
        let first = free(folder.path(), "a", &["png", "exr"]);
        std::fs::write(first.with_extension("exr"), "").expect("writes");
        assert_ne!(free(folder.path(), "a", &["png", "exr"]), first);
    }
}
