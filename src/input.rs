//! What a person names on the command line or drops on the window: a scene, a volume, or a picture that nephele saved.

use std::path::Path;

use crate::error::{Code, Error, Result};
use crate::io::{picture, volume_file};
use crate::scene::Scene;

/// Bytes that tell what a file is.
const HEAD: usize = 64;
/// Scenes are text; a larger file is none.
const MAX_SCENE: u64 = 16 << 20;

/// The scene that `path` stands for.
///
/// # Errors
/// Those of [`volume_file::asset`], [`Scene::parse`] and [`picture::read_scene`], and of files that cannot be read. Whether
/// a volume can be drawn shows when it is loaded.
pub fn open(path: &Path) -> Result<Scene> {
    let text = path.to_string_lossy();
    if volume_file::asset(&text)?.is_some() {
        return Ok(Scene::of_volume(&text));
    }
    let read = |e: std::io::Error| Error::reading(path, &e);
    let head = {
        use std::io::Read;
        let mut head = Vec::new();
        std::fs::File::open(path).and_then(|f| f.take(HEAD as u64).read_to_end(&mut head)).map_err(read)?;
        head
    };
    let folder = std::path::absolute(path).ok().and_then(|p| p.parent().map(Path::to_path_buf)).unwrap_or_default();
    let name = path.display().to_string();
    if picture::Format::of_bytes(&head).is_some() {
        let text = picture::read_scene(path)?.ok_or_else(|| {
            Error::new(Code::BadKey, format!("{name} holds no scene."))
                .why("Only pictures saved by nephele as PNG or EXR carry one.")
                .hint("Give a scene (.toml), a volume (.vdb, .nvdb) or such a picture.")
        })?;
        return Scene::parse(&text, &name, &folder);
    }
    let is_scene = path.extension().is_some_and(|e| e.eq_ignore_ascii_case("toml"));
    let size = std::fs::metadata(path).map_err(read)?.len();
    if is_scene && size <= MAX_SCENE {
        let bytes = std::fs::read(path).map_err(read)?;
        let text = String::from_utf8(bytes)
            .map_err(|e| Error::new(Code::BadKey, format!("{name} is no text.")).why(e.to_string()))?;
        return Scene::parse(&text, &name, &folder);
    }
    // Whether it is a volume, the door for volumes says when it is loaded.
    let full = std::path::absolute(path).map_err(read)?;
    Ok(Scene::of_volume(&full.to_string_lossy()))
}
