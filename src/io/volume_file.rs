//! The one door for volumes: files, told apart by content, and those that the program carries. Names grids, and picks the
//! one to draw.

use std::collections::HashMap;
use std::path::Path;

use super::{LFS_POINTER, nvdb, vdb};
use crate::error::{Code, Error, Result, Warning};
use crate::scene::value::{ASSET, asset_name};
use crate::volume::grid::{Entry, Grid, Values, VolumeFile};

/// The grid that is drawn where none is named.
const DEFAULT_GRID: &str = "density";
/// Most grids that a message lists, and most characters of a name in it.
const LISTED: usize = 12;
const NAME_SHOWN: usize = 60;
/// Least similarity (0 … 1) of a name that is offered in place of an unknown one.
const SIMILAR: f64 = 0.7;

/// A volume that the program carries; `asset:NAME` stands for it wherever a volume file can be named.
#[derive(Debug)]
pub struct Asset {
    /// Its name in scene files and on the command line.
    pub name: &'static str,
    /// Its name on screen.
    pub label: &'static str,
    /// What it is.
    pub text: &'static str,
    /// Who made it, and under which licence it may be passed on.
    pub licence: &'static str,
    bytes: &'static [u8],
}

/// The volumes that the program carries; their licences are told in `assets/README.md` as well.
pub static ASSETS: [Asset; 3] = [
    Asset {
        name: "disney-cloud",
        label: "Disney cloud",
        text: "The Disney cloud at a sixteenth of its resolution.",
        licence: "CC BY-SA 3.0: Walt Disney Animation Studios cloud data set, (c) 2017 Disney Enterprises, Inc., \
                  https://creativecommons.org/licenses/by-sa/3.0/; the cloud was modelled after a photograph by \
                  Kevin Udy",
        bytes: include_bytes!("../../assets/volumes/disney-cloud.vdb"),
    },
    Asset {
        name: "smoke-column",
        label: "Smoke column",
        text: "A frame of a simulation of rising smoke.",
        licence: "MIT or Apache-2.0: own work of the nephele project",
        bytes: include_bytes!("../../assets/volumes/smoke-column.vdb"),
    },
    Asset {
        name: "fire",
        label: "Fire",
        text: "The smoke of a frame of a simulated fire.",
        licence: "MIT or Apache-2.0: own work of the nephele project",
        bytes: include_bytes!("../../assets/volumes/fire.vdb"),
    },
];

/// The built-in volume that `path` stands for; `None` for the path of a file.
///
/// # Errors
/// [`Code::NotFound`] for a name that no built-in volume has.
pub fn asset(path: &str) -> Result<Option<&'static Asset>> {
    let Some(name) = asset_name(path) else { return Ok(None) };
    let known = || ASSETS.iter().map(|asset| asset.name);
    match ASSETS.iter().find(|asset| asset.name == name) {
        Some(asset) => Ok(Some(asset)),
        None => Err(Error::new(Code::NotFound, format!("There is no built-in volume {}.", shown(name)))
            .why(format!("There are {}.", known().map(|name| format!("{ASSET}{name}")).collect::<Vec<_>>().join(", ")))
            .hint(nearest(name, known()).map_or(String::new(), |close| format!("Did you mean {ASSET}{close}?")))),
    }
}

/// Reads a volume file, or a built-in volume, and gives its grids unique names. Warns where there is nothing to show.
///
/// # Errors
/// As [`asset`]; [`Code::NotFound`] and [`Code::Denied`] for a file that cannot be read, [`Code::PointerFile`] and
/// [`Code::UnknownFormat`] for other content, those of [`vdb::read`] and [`nvdb::read`], and, if there are grids but none
/// can be drawn, the error of the one grid or one that lists them.
pub fn open(path: &Path) -> Result<VolumeFile> {
    if let Some(asset) = asset(&path.to_string_lossy())? {
        return parse(asset.bytes);
    }
    if path.is_dir() {
        return Err(folder_given(path));
    }
    let bytes = std::fs::read(path).map_err(|e| unreadable(path, &e))?;
    parse(&bytes).map_err(|mut error| {
        error.what = format!("{}: {}", path.display(), error.what);
        error
    })
}

/// [`open`] for bytes at hand.
///
/// # Errors
/// As [`open`], without the name of the file.
pub fn parse(bytes: &[u8]) -> Result<VolumeFile> {
    let mut file = match Format::of(bytes)? {
        Format::Vdb => vdb::read(bytes)?,
        Format::Nvdb => nvdb::read(bytes)?,
    };
    let names = unique_names(file.grids.iter().map(|entry| &*entry.name));
    for (entry, name) in file.grids.iter_mut().zip(names) {
        entry.unique_name = name;
    }
    let mut drawable = file.grids.iter().filter_map(|entry| entry.grid.as_ref().ok()).peekable();
    if drawable.peek().is_none() && !file.grids.is_empty() {
        return Err(file.undrawable());
    }
    // Readers say by themselves that there are no grids.
    if drawable.peek().is_some() && !drawable.any(shows_something) {
        let text = "No active voxel of the file holds anything: there is nothing to show.".to_owned();
        file.warnings.push(Warning { code: "empty_grid", text });
    }
    Ok(file)
}

impl VolumeFile {
    /// The index of the grid to draw, and what to know about the choice.
    ///
    /// A name is tried as stored (the first of equals, with a warning), then as unique name, then as `#2`, the third
    /// grid. Without one: `density`, else the only grid that can be drawn. A file without grids is for the caller to
    /// notice: it draws as an empty medium.
    ///
    /// # Errors
    /// [`Code::NoDensityGrid`] for a name that is not there (or no grids), [`Code::ManyGrids`] where the choice is open,
    /// and the grid's own error where it cannot be drawn.
    pub fn select(&self, wanted: Option<&str>) -> Result<(usize, Vec<Warning>)> {
        let (index, mut equals) = match wanted {
            Some(name) => self.named(name)?,
            None => self.default_grid()?,
        };
        let entry = &self.grids[index];
        if let Err(error) = &entry.grid {
            return Err(error.clone());
        }
        equals.retain(|&other| other != index);
        let mut warnings = Vec::new();
        if !equals.is_empty() {
            let others: Vec<_> = equals.iter().map(|&i| shown(&self.grids[i].unique_name)).collect();
            warnings.push(Warning {
                code: "equal_names",
                text: format!(
                    "Several grids are named {}: the first is used; the others are {}.",
                    shown(&entry.name),
                    list(others)
                ),
            });
        }
        Ok((index, warnings))
    }

    /// The grid of this name, and all with the same stored name.
    fn named(&self, name: &str) -> Result<(usize, Vec<usize>)> {
        let stored = self.indices(|entry| entry.name == name);
        if let Some(&first) = stored.first() {
            return Ok((first, stored));
        }
        if let Some(index) = self.grids.iter().position(|entry| entry.unique_name == name) {
            return Ok((index, Vec::new()));
        }
        let numbered = name.strip_prefix('#').and_then(|number| number.parse().ok());
        if let Some(index) = numbered.filter(|&index| index < self.grids.len()) {
            return Ok((index, Vec::new()));
        }
        let close = nearest(name, self.grids.iter().map(|entry| &*entry.unique_name));
        let hint = match close {
            Some(close) => format!("Did you mean {}?", shown(close)),
            None => "Ask for one of these.".to_owned(),
        };
        let what = format!("The file has no grid {}.", shown(name));
        Err(Error::new(Code::NoDensityGrid, what).why(self.holds(|entry| shown(&entry.unique_name))).hint(hint))
    }

    /// The grid to draw where none is named, and all that would do as well.
    fn default_grid(&self) -> Result<(usize, Vec<usize>)> {
        let drawable = self.indices(|entry| entry.grid.is_ok());
        let densities = self.indices(|entry| entry.grid.is_ok() && entry.name == DEFAULT_GRID);
        match (&*densities, &*drawable) {
            ([first, ..], _) => Ok((*first, densities)),
            ([], [only]) => Ok((*only, Vec::new())),
            ([], []) if self.grids.is_empty() => Err(Error::new(Code::NoDensityGrid, "The file holds no grids.")),
            ([], []) => Err(self.undrawable()),
            ([], [first, ..]) => {
                let choice = |&i: &usize| format!("{} ({})", shown(&self.grids[i].unique_name), size(&self.grids[i]));
                let example = shown(&self.grids[*first].unique_name);
                Err(Error::new(Code::ManyGrids, format!("{} grids could be the density.", drawable.len()))
                    .why(format!("They are {}.", list(drawable.iter().map(choice).collect())))
                    .hint(format!("Choose one: --set volume.grid={example:?}, in `info` --grid {example:?}.")))
            }
        }
    }

    fn indices(&self, which: impl Fn(&Entry) -> bool) -> Vec<usize> {
        (0..self.grids.len()).filter(|&i| which(&self.grids[i])).collect()
    }

    /// A sentence that lists the grids.
    fn holds(&self, show: impl Fn(&Entry) -> String) -> String {
        match &*self.grids {
            [] => "It holds no grids.".to_owned(),
            grids => format!("It holds {}.", list(grids.iter().map(show).collect())),
        }
    }

    /// The error for a file without any grid that can be drawn.
    fn undrawable(&self) -> Error {
        let errors: Vec<&Error> = self.grids.iter().filter_map(|entry| entry.grid.as_ref().err()).collect();
        let damaged = errors.iter().find(|error| error.code != Code::Unsupported);
        match (damaged, &*errors) {
            (Some(error), _) | (None, [error]) => (*error).clone(),
            (None, _) => Error::new(Code::Unsupported, "The file has no grid that can be drawn.")
                .why(self.holds(|entry| format!("{} ({})", shown(&entry.unique_name), entry.value_type)))
                .hint("Only scalar grids can be: export a float density."),
        }
    }
}

/// Names that tell equal ones apart, as OpenVDB makes them: a name that is there once stays as it is, equal ones get
/// `[0]`, `[1]`, … in order, and an empty one always gets its number.
pub fn unique_names<'a>(names: impl Iterator<Item = &'a str> + Clone) -> Vec<String> {
    let mut counts: HashMap<&str, (usize, usize)> = HashMap::new(); // all, and those named so far
    for name in names.clone() {
        counts.entry(name).or_default().0 += 1;
    }
    let unique = |name: &str| {
        let (all, named) = counts.get_mut(name).expect("every name was counted");
        *named += 1;
        if *all == 1 && !name.is_empty() { name.to_owned() } else { format!("{name}[{}]", *named - 1) }
    };
    names.map(unique).collect()
}

/// Whether any voxel is active and any value, active or not, is finite and not zero.
fn shows_something(grid: &Grid) -> bool {
    let active =
        grid.tiles.iter().any(|tile| tile.active) || grid.leaves.iter().any(|leaf| leaf.active.iter().any(|&w| w != 0));
    let counts = |value: f64| value.is_finite() && value != 0.0;
    let value = || match &grid.values {
        Values::F32(values) => values.iter().any(|&value| counts(value.into())),
        Values::F64(values) => values.iter().any(|&value| counts(value)),
    };
    active && (grid.tiles.iter().any(|tile| counts(tile.value)) || counts(grid.background) || value())
}

/// The size in voxels of a grid, for a list of choices.
fn size(entry: &Entry) -> String {
    match entry.grid.as_ref().ok().and_then(Grid::active_box) {
        None => "empty".to_owned(),
        Some(found) => {
            let side = |axis: usize| i64::from(found.max[axis]) - i64::from(found.min[axis]) + 1;
            format!("{}×{}×{}", side(0), side(1), side(2))
        }
    }
}

/// A name for a message: no control characters, not too long, and something even if it is empty.
pub fn shown(name: &str) -> String {
    let mut text: String = name.chars().take(NAME_SHOWN).flat_map(show_char).collect();
    if name.chars().nth(NAME_SHOWN).is_some() {
        text.push('…');
    }
    if text.is_empty() { "(no name)".to_owned() } else { text }
}

/// A control character as its escape, any other as itself.
fn show_char(c: char) -> impl Iterator<Item = char> {
    let (escaped, plain) = if c.is_control() { (Some(c.escape_default()), None) } else { (None, Some(c)) };
    escaped.into_iter().flatten().chain(plain)
}

/// The first of a list, and how many more there are.
fn list(mut items: Vec<String>) -> String {
    let more = items.len().saturating_sub(LISTED);
    items.truncate(LISTED);
    match more {
        0 => items.join(", "),
        _ => format!("{} and {more} more", items.join(", ")),
    }
}

/// The known name that is most like `name`, if any is.
fn nearest<'a>(name: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let likeness = |known: &str| strsim::jaro_winkler(&name.to_lowercase(), &known.to_lowercase());
    known
        .map(|known| (likeness(known), known))
        .filter(|&(likeness, _)| likeness >= SIMILAR)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known)
}

/// The formats that this program reads.
enum Format {
    Vdb,
    Nvdb,
}

/// The first bytes of an OpenVDB file.
const VDB_MAGIC: &[u8] = b" BDV";
/// The first bytes of a NanoVDB file that a machine of the other byte order wrote, behind its digit.
const NVDB_SWAPPED: &[u8] = b"BDVonaN";
/// First bytes of what people mistake for volumes, and its name.
#[rustfmt::skip]
const KNOWN: [(&[u8], &str); 19] = [
    (b"\x89PNG", "a PNG picture"), (b"\xff\xd8\xff", "a JPEG picture"), (b"\x76\x2f\x31\x01", "an OpenEXR picture"),
    (b"#?RADIANCE", "a Radiance HDR picture"), (b"#?RGBE", "a Radiance HDR picture"), (b"GIF8", "a GIF picture"),
    (b"II*\0", "a TIFF picture"), (b"MM\0*", "a TIFF picture"), (b"PK\x03\x04", "a zip archive: unpack it first"),
    (b"\x1f\x8b", "gzip-compressed data: unpack it first"), (b"\x28\xb5\x2f\xfd", "Zstandard-compressed data: unpack it first"),
    (b"7z\xbc\xaf", "a 7-Zip archive: unpack it first"), (b"Rar!", "a RAR archive: unpack it first"),
    (b"\x89HDF", "an HDF5 file"), (b"PXR-USDC", "a USD scene"), (b"#usda", "a USD scene"), (b"glTF", "a glTF scene"),
    (b"BLENDER", "a Blender scene"), (b"%PDF", "a PDF document"),
];
/// Bytes that are looked at to tell text from data, and characters of it that a message shows.
const TEXT_SAMPLE: usize = 512;
const TEXT_SHOWN: usize = 40;

impl Format {
    /// The format of these bytes, or what they are instead.
    fn of(bytes: &[u8]) -> Result<Format> {
        if bytes.starts_with(VDB_MAGIC) {
            return Ok(Format::Vdb);
        }
        if bytes.starts_with(nvdb::MAGIC) {
            return Ok(Format::Nvdb);
        }
        if bytes.starts_with(LFS_POINTER) {
            return Err(Error::new(Code::PointerFile, "The file is a Git LFS pointer, not a volume.")
                .why("It only names the data, which was not downloaded.")
                .hint("Run `git lfs pull` in its folder."));
        }
        let text = text_of(bytes);
        let start = text.as_deref().map(|text| text.trim_start().to_lowercase()).unwrap_or_default();
        if ["<!doctype html", "<html", "<head", "<?xml"].iter().any(|tag| start.starts_with(tag)) {
            return Err(Error::new(Code::PointerFile, "The file is a web page, not a volume.")
                .why("A download page or an error page was saved in place of the data.")
                .hint("Download the file itself."));
        }
        let looks = if bytes.is_empty() {
            "The file is empty.".to_owned()
        } else if bytes.get(1..).is_some_and(|rest| rest.starts_with(NVDB_SWAPPED)) {
            "It is a NanoVDB file in big-endian byte order.".to_owned()
        } else if let Some((_, what)) = KNOWN.iter().find(|(magic, _)| bytes.starts_with(magic)) {
            format!("It looks like {what}.")
        } else if let Some(text) = text {
            let line: String = text.trim().chars().take(TEXT_SHOWN).flat_map(show_char).collect();
            format!("It looks like text: {line}")
        } else if bytes.iter().take(TEXT_SAMPLE).all(|&byte| byte == 0) {
            "It begins with zeros only.".to_owned()
        } else {
            let hex: Vec<String> = bytes.iter().take(8).map(|byte| format!("{byte:02x}")).collect();
            format!("Its first bytes are {}; an OpenVDB file begins with 20 42 44 56.", hex.join(" "))
        };
        Err(Error::new(Code::UnknownFormat, "The file is not a volume that nephele knows.")
            .why(looks)
            .hint("Open an OpenVDB (.vdb) or NanoVDB (.nvdb) file."))
    }
}

/// The start of the file if it is text.
fn text_of(bytes: &[u8]) -> Option<String> {
    let sample = &bytes[..bytes.len().min(TEXT_SAMPLE)];
    let text = match std::str::from_utf8(sample) {
        Ok(text) => text,
        // The sample may end inside a character.
        Err(e) if e.error_len().is_none() => std::str::from_utf8(&sample[..e.valid_up_to()]).ok()?,
        Err(_) => return None,
    };
    let plain = |c: char| !c.is_control() || c.is_whitespace();
    (!text.is_empty() && text.chars().all(plain)).then(|| text.to_owned())
}

/// The error for a file that cannot be read, with what is there in its place.
fn unreadable(path: &Path, e: &std::io::Error) -> Error {
    let error = Error::reading(path, e);
    if error.code != Code::NotFound {
        return error;
    }
    let Some((folder, name)) = parent(path).zip(path.file_name()) else {
        return error;
    };
    if !folder.is_dir() {
        return error.why(format!("There is no folder {}.", folder.display()));
    }
    let names = names_in(folder);
    match nearest(&name.to_string_lossy(), names.iter().map(|name| &**name)) {
        Some(close) => error.hint(format!("Did you mean {}?", shown(close))),
        None => error,
    }
}

/// The error for a folder in place of a file.
fn folder_given(path: &Path) -> Error {
    let is_volume = |name: &String| {
        let name = name.to_lowercase();
        name.ends_with(".vdb") || name.ends_with(".nvdb")
    };
    let volumes: Vec<String> = names_in(path).iter().filter(|name| is_volume(name)).map(|name| shown(name)).collect();
    let error = Error::new(Code::Denied, format!("{} is a folder, not a file.", path.display()));
    match volumes.is_empty() {
        true => error.why("It holds no .vdb or .nvdb files.").hint("Name a volume file."),
        false => error.why(format!("It holds {}.", list(volumes))).hint("Name one of these."),
    }
}

/// The folder that a path lies in.
fn parent(path: &Path) -> Option<&Path> {
    path.parent().map(|folder| if folder.as_os_str().is_empty() { Path::new(".") } else { folder })
}

/// The sorted names in a folder; none if it cannot be read.
fn names_in(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).into_iter().flatten().flatten();
    let mut names: Vec<String> = entries.map(|entry| entry.file_name().to_string_lossy().into_owned()).collect();
    names.sort();
    names
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::nvdb::tests::sample;

    const FLOAT: u32 = 1;
    const VECTOR: u32 = 6;

    fn file(grids: &[(&'static str, u32)]) -> VolumeFile {
        parse(&sample(grids)).unwrap()
    }

    #[test]
    fn equal_names_get_numbers_and_single_ones_stay() {
        let names = ["density", "heat", "density", "", "density[0]"];
        let unique = unique_names(names.into_iter());
        assert_eq!(unique, ["density[0]", "heat", "density[1]", "[0]", "density[0]"]);
        assert_eq!(unique_names(["", ""].into_iter()), ["[0]", "[1]"]);
    }

    #[test]
    fn without_a_name_density_wins_then_the_only_scalar_grid() {
        let index = |grids: &[(&'static str, u32)]| file(grids).select(None).unwrap();
        assert_eq!(index(&[("heat", FLOAT), ("density", FLOAT)]), (1, vec![]));
        assert_eq!(index(&[("density", VECTOR), ("heat", FLOAT), ("v", VECTOR)]), (1, vec![]));
        let (first, warnings) = index(&[("heat", FLOAT), ("density", FLOAT), ("density", FLOAT)]);
        assert_eq!((first, warnings[0].code), (1, "equal_names"));
        assert!(warnings[0].text.contains("density[1]") && !warnings[0].text.contains("density[0]"), "{}", warnings[0]);
        let error = file(&[("heat", FLOAT), ("smoke", FLOAT), ("v", VECTOR)]).select(None).unwrap_err();
        assert_eq!(error.code, Code::ManyGrids);
        assert_eq!(error.why, "They are heat (12304×4112×2147483520), smoke (12304×4112×2147483520).");
        assert!(error.hint.contains("\"heat\""), "an example: {error}");
    }

    #[test]
    fn a_name_is_tried_as_stored_then_unique_then_as_a_number() {
        let file = file(&[("a", FLOAT), ("b", FLOAT), ("b", FLOAT), ("#0", FLOAT), ("b[0]", FLOAT), ("v", VECTOR)]);
        let index = |name| file.select(Some(name)).map(|(index, warnings)| (index, warnings.len()));
        assert_eq!(index("a"), Ok((0, 0)));
        assert_eq!(index("b"), Ok((1, 1)), "the first of equals, with a warning");
        assert_eq!(index("b[1]"), Ok((2, 0)));
        assert_eq!(index("b[0]"), Ok((4, 0)), "as stored before unique");
        assert_eq!(index("#2"), Ok((2, 0)), "the third");
        assert_eq!(index("#0"), Ok((3, 0)), "a name that looks like a number");
        for absent in ["", "#6", "#", "#-1", "A"] {
            let error = index(absent).unwrap_err();
            assert_eq!(error.code, Code::NoDensityGrid, "{absent}");
            assert!(error.why.contains("b[1]"), "names what there is: {error}");
        }
        assert_eq!(index("A").unwrap_err().hint, "Did you mean a?");
        assert_eq!(index("v").unwrap_err().code, Code::Unsupported);
    }

    #[test]
    fn files_of_other_grids_are_refused_and_empty_ones_warn() {
        let error = parse(&sample(&[("u", VECTOR), ("v", VECTOR)])).unwrap_err();
        assert_eq!(error.code, Code::Unsupported);
        assert!(error.why.contains("u (Vec3f), v (Vec3f)"), "{error}");
        let error = parse(&sample(&[("u", VECTOR)])).unwrap_err();
        assert!(error.what.contains("\"u\""), "a single grid's own error: {error}");
        let empty = file(&[]);
        assert_eq!(empty.warnings[0].code, "empty_grid");
        assert_eq!(empty.select(None).unwrap_err().code, Code::NoDensityGrid);
        assert_eq!(file(&[("density", FLOAT)]).warnings, []);
    }

    #[test]
    fn nothing_shows_where_nothing_is_active_or_all_is_zero_or_not_a_number() {
        let mut grid = file(&[("density", FLOAT)]).grids.remove(0).grid.unwrap();
        assert!(shows_something(&grid));
        grid.tiles.clear();
        grid.background = 0.0;
        assert!(shows_something(&grid), "by its leaf");
        let mut dark = grid.clone();
        dark.leaves[0].active = [0; 8];
        assert!(!shows_something(&dark), "nothing active");
        grid.values = Values::F32([f32::NAN, 0.0].repeat(256));
        assert!(!shows_something(&grid), "no values");
        grid.background = 0.5;
        assert!(shows_something(&grid), "the background between voxels");
        grid.background = 0.0;
        grid.values = Values::F64(vec![1e-300; 512]);
        assert!(shows_something(&grid));
    }

    #[test]
    fn content_tells_formats_apart() {
        assert!(matches!(Format::of(b" BDV\0\0\0\0"), Ok(Format::Vdb)));
        assert!(matches!(Format::of(b"NanoVDB2"), Ok(Format::Nvdb)));
        for (bytes, code, says) in [
            (&b""[..], Code::UnknownFormat, "empty"),
            (b"\x89PNG\r\n\x1a\n", Code::UnknownFormat, "PNG"),
            (b"PK\x03\x04", Code::UnknownFormat, "unpack"),
            (b"2BDVonaN", Code::UnknownFormat, "big-endian"),
            (b"[volume]\ngrid = 1", Code::UnknownFormat, "text: [volume]\\ngrid"),
            (b"\0\0\0\0", Code::UnknownFormat, "zeros"),
            (b"\xfa\x01\x02", Code::UnknownFormat, "fa 01 02"),
            (b"version https://git-lfs.github.com/spec/v1\noid sha256:0", Code::PointerFile, "names the data"),
            (b"\n <!DOCTYPE HTML><title>404", Code::PointerFile, "download page"),
            (b"<html>", Code::PointerFile, "download page"),
        ] {
            let Err(error) = Format::of(bytes) else { panic!("{says}") };
            assert!(error.code == code && error.to_string().contains(says), "{says}: {error}");
            assert!(error.to_string().lines().count() <= 3, "{error}");
        }
        // Text that the sample cuts inside a character is still text.
        let long = "ä".repeat(400);
        assert!(text_of(long.as_bytes()).is_some() && text_of(&[b"x", long.as_bytes()].concat()).is_some());
        assert!(text_of(b"x\x01").is_none() && text_of(b"x\xff").is_none());
    }

    #[test]
    fn messages_for_what_is_not_there_name_what_is() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("cloud_01.nvdb"), sample(&[("density", FLOAT)])).unwrap();
        std::fs::write(path("bad.nvdb"), b"NanoVDB2").unwrap();
        std::fs::write(path("notes.txt"), b"").unwrap();
        assert_eq!(open(&path("cloud_01.nvdb")).unwrap().grids.len(), 1);
        let error = open(&path("clod_01.nvdb")).unwrap_err();
        assert_eq!((error.code, &*error.hint), (Code::NotFound, "Did you mean cloud_01.nvdb?"));
        let error = open(&path("absent/cloud.vdb")).unwrap_err();
        assert!(error.code == Code::NotFound && error.why.contains("no folder"), "{error}");
        let error = open(folder.path()).unwrap_err();
        assert_eq!((error.code, &*error.why), (Code::Denied, "It holds bad.nvdb, cloud_01.nvdb."));
        let error = open(&path("bad.nvdb")).unwrap_err();
        assert!(error.code == Code::Corrupt && error.what.contains("bad.nvdb: "), "{error}");
    }

    #[test]
    fn built_in_volumes_open_by_their_names_and_others_are_told() {
        for asset in &ASSETS {
            let path = format!("{ASSET}{}", asset.name);
            assert_eq!(super::asset(&path).unwrap().unwrap().label, asset.label);
            let file = open(Path::new(&path)).unwrap();
            assert_eq!((file.grids[0].name.as_str(), file.select(None).unwrap()), ("density", (0, vec![])), "{path}");
            assert!(asset.licence.contains(':') && !asset.text.is_empty());
        }
        let readme = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/assets/README.md")).unwrap();
        for asset in &ASSETS {
            assert!(readme.contains(asset.licence), "assets/README.md tells the licence of {}", asset.name);
        }
        assert!(super::asset("clouds/asset:x.vdb").unwrap().is_none(), "a file");
        let error = open(Path::new("asset:disney-clod")).unwrap_err();
        assert_eq!((error.code, &*error.hint), (Code::NotFound, "Did you mean asset:disney-cloud?"));
        assert_eq!(error.why, "There are asset:disney-cloud, asset:smoke-column, asset:fire.");
    }

    #[test]
    fn names_in_messages_are_short_and_plain() {
        assert_eq!(shown(""), "(no name)");
        assert_eq!(shown("a\u{1b}[31m\nb ☁"), "a\\u{1b}[31m\\nb ☁");
        assert_eq!(shown(&"x".repeat(4096)).chars().count(), NAME_SHOWN + 1);
        let many: Vec<String> = (0..20).map(|n| n.to_string()).collect();
        assert!(list(many).ends_with("10, 11 and 8 more"));
    }
}
