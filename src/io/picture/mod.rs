//! Pictures as files: EXR (linear, with AOVs), PNG (for the screen) and PFM (linear RGB), with the scene that made them.
//!
//! Reading takes any bytes: the answer to bad ones is an error, and no buffer is larger than the file can justify.

use std::fs::{self, File};
use std::io::{self, BufWriter, Cursor, Read, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};

use crate::error::{Code, Error, Result};
use crate::image::Image;
use crate::image::tone::Display;

mod exr;
pub use exr::refused_codec;
mod pfm;
mod png;

/// Name of the attribute (EXR) or iTXt keyword (PNG) that holds the scene as TOML.
const SCENE_KEY: &str = "nephele.scene";
/// Name of the attribute (EXR) or iTXt keyword (PNG) that holds the statistics as JSON.
const STATS_KEY: &str = "nephele.stats";

/// No codec here makes more than about 1400 bytes of one (deflate: 1032, with a quarter dropped by PXR24); a picture
/// that claims more is refused before memory is taken for it.
const MAX_EXPANSION: u64 = 2048;

/// A kind of picture file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// OpenEXR: 32-bit float, every layer, texts.
    Exr,
    /// 8-bit sRGB after exposure and tone map, texts.
    Png,
    /// Portable float map: 32-bit float RGB only.
    Pfm,
}

impl Format {
    /// The format that a file name asks for by its extension, in any case. Else [`Code::BadKey`].
    pub fn of_path(path: &Path) -> Result<Format> {
        match path.extension().and_then(|e| e.to_str()).map(str::to_ascii_lowercase).as_deref() {
            Some("exr") => Ok(Format::Exr),
            Some("png") => Ok(Format::Png),
            Some("pfm") => Ok(Format::Pfm),
            _ => Err(Error::new(Code::BadKey, format!("Cannot tell the format of {}.", path.display()))
                .why("Pictures are written as .exr, .png or .pfm.")
                .hint("Give the output one of these endings.")),
        }
    }

    /// The format of a file from its first eight bytes.
    pub fn of_bytes(head: &[u8]) -> Option<Format> {
        match head {
            [0x76, 0x2f, 0x31, 0x01, ..] => Some(Format::Exr),
            [0x89, b'P', b'N', b'G', b'\r', b'\n', 0x1a, b'\n', ..] => Some(Format::Png),
            [b'P', b'F' | b'f', b'\n' | b'\r' | b' ' | b'\t', ..] => Some(Format::Pfm),
            _ => None,
        }
    }
}

/// The texts that are written into a picture; empty ones are left out.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Metadata {
    /// The whole scene as rendered, paths relative to the picture.
    pub scene_toml: String,
    /// The object of `--stats`.
    pub stats_json: String,
    /// Program and version.
    pub software: String,
    /// One line for people.
    pub description: String,
}

/// A picture that was read.
#[derive(Clone, Debug, PartialEq)]
pub struct Loaded {
    /// Linear Rec.709. The first layer is always `R G B A` (A is 1 where the file has none), whatever the file holds.
    pub image: Image,
    /// The format by content.
    pub format: Format,
    /// The texts in it.
    pub texts: Texts,
}

/// The texts found in a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Texts {
    /// The embedded scene, TOML.
    pub scene_toml: Option<String>,
    /// The embedded statistics, JSON.
    pub stats_json: Option<String>,
    /// Program and version that wrote it.
    pub software: Option<String>,
    /// A description for people.
    pub description: Option<String>,
}

/// Writes a picture in the format of the file's ending, whole or not at all (see [`write_whole`]). EXR takes every
/// layer; PNG and PFM only the picture itself, and only PNG applies `display`.
///
/// Errors: [`Code::BadKey`] for another ending, [`Code::Write`], [`Code::Failed`] for an image whose layers do not fit.
pub fn save(path: &Path, image: &Image, meta: &Metadata, display: &Display) -> Result<()> {
    let format = Format::of_path(path)?;
    if let Some(defect) = image.defect() {
        return Err(Error::new(Code::Failed, format!("Cannot write {}: the image is not whole.", path.display()))
            .why(defect)
            .hint("This is a mistake in nephele; please report it."));
    }
    write_whole(path, |file| match format {
        Format::Exr => exr::write(file, image, meta),
        Format::Png => png::write(file, image, meta, display),
        Format::Pfm => pfm::write(file, image),
    })
}

/// Reads a picture, its format told by content.
///
/// Errors: [`Code::NotFound`], [`Code::Denied`], [`Code::UnknownFormat`], [`Code::Corrupt`], [`Code::Unsupported`].
pub fn load(path: &Path) -> Result<Loaded> {
    let (format, bytes) = read(path)?;
    let read = match format {
        Format::Exr => exr::read(&bytes),
        Format::Png => png::read(&bytes),
        Format::Pfm => pfm::read(&bytes).map(|image| (image, Texts::default())),
    };
    let (image, texts) = read.map_err(|fault| fault.of(path))?;
    Ok(Loaded { image, format, texts })
}

/// The scene (TOML) that a PNG or EXR carries, without decoding its pixels; `None` where there is none. Errors as
/// [`load`].
pub fn read_scene(path: &Path) -> Result<Option<String>> {
    let (format, bytes) = read(path)?;
    let texts = match format {
        Format::Exr => exr::read_texts(&bytes),
        Format::Png => png::read_texts(&bytes),
        Format::Pfm => Ok(Texts::default()),
    };
    Ok(texts.map_err(|fault| fault.of(path))?.scene_toml)
}

/// Writes a file whole or not at all: into a new file in the same folder, which then takes the name. On an error, in
/// `write` too, an older file of that name is untouched and nothing is left behind. A link stays a link (its target is
/// replaced), a file that may not be written stays. Errors: [`Code::Write`].
pub fn write_whole(path: &Path, write: impl FnOnce(&mut BufWriter<File>) -> io::Result<()>) -> Result<()> {
    let target = fs::canonicalize(path).unwrap_or_else(|_| path.to_path_buf());
    let attempt = || -> io::Result<()> {
        if fs::metadata(&target).is_ok_and(|old| old.permissions().readonly()) {
            return Err(io::Error::new(io::ErrorKind::PermissionDenied, "the file is read-only"));
        }
        let (file, temporary) = Temporary::beside(&target)?;
        let mut file = BufWriter::new(file);
        write(&mut file)?;
        file.into_inner().map_err(|e| e.into_error())?.sync_all()?;
        temporary.rename(&target)
    };
    attempt().map_err(|e| Error::writing(path, &e))
}

/// A file that is removed when dropped, unless it was renamed.
struct Temporary {
    path: PathBuf,
    renamed: bool,
}

impl Temporary {
    /// A new file in the folder of `target`.
    fn beside(target: &Path) -> io::Result<(File, Temporary)> {
        static COUNT: AtomicU64 = AtomicU64::new(0);
        loop {
            let count = COUNT.fetch_add(1, Ordering::Relaxed);
            let path = target.with_file_name(format!(".nephele-{}-{count}.part", std::process::id()));
            match File::create_new(&path) {
                Ok(file) => return Ok((file, Temporary { path, renamed: false })),
                Err(e) if e.kind() == io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(e),
            }
        }
    }

    /// Gives it the name `target`, in place of a file that has it.
    fn rename(mut self, target: &Path) -> io::Result<()> {
        fs::rename(&self.path, target)?;
        self.renamed = true;
        Ok(())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if !self.renamed {
            // The first error is the one to report; this is the best that can be done after it.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// What is wrong with the bytes of a picture.
#[derive(Debug)]
enum Fault {
    /// Damaged or truncated: why.
    Corrupt(String),
    /// Valid but not read here: why.
    Unsupported(String),
}

impl Fault {
    fn of(self, path: &Path) -> Error {
        match self {
            Fault::Corrupt(why) => Error::new(Code::Corrupt, format!("{} is damaged.", path.display()))
                .why(why)
                .hint("Copy or render it again."),
            Fault::Unsupported(why) => Error::new(Code::Unsupported, format!("Cannot read {}.", path.display()))
                .why(why)
                .hint("Save it as an EXR with ZIP compression, a PNG or a PFM."),
        }
    }
}

/// Checks a claimed size against the file's: `width` × `height` pixels of `bytes_per_pixel` each when decoded.
fn check_size(width: u64, height: u64, bytes_per_pixel: u64, file_bytes: usize) -> std::result::Result<(), Fault> {
    let decoded = width.checked_mul(height).and_then(|n| n.checked_mul(bytes_per_pixel));
    let side = u64::from(u32::MAX);
    if width == 0 || height == 0 || width > side || height > side {
        return Err(Fault::Corrupt(format!("A picture cannot have {width}x{height} pixels.")));
    }
    match decoded {
        Some(bytes) if bytes <= MAX_EXPANSION * file_bytes as u64 => Ok(()),
        _ => Err(Fault::Corrupt(format!("{file_bytes} bytes cannot hold {width}x{height} pixels."))),
    }
}

/// The format and all bytes of a file; nothing but the first bytes is read of a file of another kind.
fn read(path: &Path) -> Result<(Format, Vec<u8>)> {
    const HEAD: u64 = 64;
    let failed = |e| Error::reading(path, &e);
    let mut file = File::open(path).map_err(failed)?;
    let mut bytes = Vec::new();
    (&file).take(HEAD).read_to_end(&mut bytes).map_err(failed)?;
    let Some(format) = Format::of_bytes(&bytes) else {
        if bytes.starts_with(super::LFS_POINTER) {
            return Err(Error::new(Code::PointerFile, format!("{} is a Git LFS pointer.", path.display()))
                .why("The data was not downloaded.")
                .hint("Run `git lfs pull`."));
        }
        return Err(Error::new(
            Code::UnknownFormat,
            format!("{} is not a picture file that nephele knows.", path.display()),
        )
        .why("Its first bytes are those of no EXR, PNG or PFM.")
        .hint("Convert it to one of these."));
    };
    file.read_to_end(&mut bytes).map_err(failed)?;
    Ok((format, bytes))
}

#[cfg(test)]
mod tests;
