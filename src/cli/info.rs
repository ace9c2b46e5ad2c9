//! `nephele info`: what volume files hold, for people and as JSON, and single values of a grid.

use std::io::{BufRead, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use glam::{DVec3, IVec3};
use serde_json::{Map, Value, json};

use crate::error::{Code, Error, Result, Warning};
use crate::io::volume_file::{self, shown};
use crate::volume::grid::{Class, Entry, Grid, Stats, VolumeFile};

/// What `info` is asked for.
#[derive(Clone, Debug, Default)]
pub struct InfoArgs {
    /// The files, in the order of the report.
    pub files: Vec<PathBuf>,
    /// One JSON object in place of text.
    pub json: bool,
    /// Only this grid (by name, unique name or `#2`).
    pub grid: Option<String>,
    /// A file of index coordinates, `i j k` a line, or `-` for standard input: answers values in place of the report.
    pub at: Option<String>,
}

/// Runs `info`: results go to `out`, errors to `err`; returns the exit status.
///
/// With [`InfoArgs::json`] `out` gets `{"files": […]}`; a refused file has `error` in place of `grids`, and the first
/// error also stands beside `files`.
pub fn run(args: &InfoArgs, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let written = match &args.at {
        Some(at) => values(args, at, out, err),
        None => report(args, out, err),
    };
    written.unwrap_or_else(|e| {
        let error = Error::new(Code::Write, "The report cannot be written.").why(format!("{e}."));
        // If this fails too there is nobody left to tell.
        let _ = writeln!(err, "{error}");
        error.code.exit()
    })
}

/// What is known about a file after reading it: the file, its grids in the report, and all warnings.
struct Report {
    file: VolumeFile,
    /// Index and figures (of those that can be drawn).
    grids: Vec<(usize, Option<Stats>)>,
    warnings: Vec<Warning>,
}

impl Report {
    fn of(path: &Path, grid: Option<&str>) -> Result<Report> {
        let file = volume_file::open(path)?;
        let (wanted, mut warnings) = match grid {
            Some(name) => file.select(Some(name)).map(|(index, warnings)| (vec![index], warnings))?,
            None => ((0..file.grids.len()).collect(), Vec::new()),
        };
        warnings.splice(0..0, file.warnings.iter().cloned());
        let mut grids = Vec::new();
        for index in wanted {
            let entry = &file.grids[index];
            let stats = entry.grid.as_ref().ok().map(|grid| {
                let stats = grid.stats();
                warnings.extend(remarks(entry, grid, &stats));
                stats
            });
            grids.push((index, stats));
        }
        Ok(Report { file, grids, warnings })
    }
}

/// What the renderer will treat in its own way, by the figures of a grid.
fn remarks(entry: &Entry, grid: &Grid, stats: &Stats) -> Vec<Warning> {
    let name = shown(&entry.unique_name);
    let mut remarks = Vec::new();
    let mut remark = |code, text: String| remarks.push(Warning { code, text: format!("{name} {text}") });
    let level_set = grid.class == Class::LevelSet;
    if stats.active_voxels == 0 {
        remark("empty_grid", "has no active voxels.".to_owned());
    }
    if level_set {
        remark(
            "level_set",
            "is a level set: drawn as a density that is 1 inside and fades out at the surface.".to_owned(),
        );
    }
    let negative = if level_set { 0 } else { stats.negative_voxels };
    let bad = [(stats.nan_voxels, "not a number"), (stats.inf_voxels, "infinite"), (negative, "negative")];
    for (count, what) in bad.into_iter().filter(|&(count, _)| count > 0) {
        let voxels = if count == 1 { "voxel that is" } else { "voxels that are" };
        remark("bad_values", format!("has {} {voxels} {what}: drawn as 0.", grouped(count)));
    }
    if grid.background != 0.0 && !level_set {
        let background = number(grid.background);
        remark("background", format!("has the background {background}: drawn as 0 outside the box of active voxels."));
    }
    remarks
}

/// The report on all files.
fn report(args: &InfoArgs, out: &mut dyn Write, err: &mut dyn Write) -> std::io::Result<u8> {
    let mut first_error = None;
    let mut files = Vec::new();
    for path in &args.files {
        match Report::of(path, args.grid.as_deref()) {
            Ok(report) if args.json => files.push(file_json(path, &report)),
            Ok(report) => write_text(path, &report, out)?,
            Err(error) => {
                writeln!(err, "{error}")?;
                files.push(json!({"path": path.to_string_lossy(), "error": error.to_json()}));
                first_error.get_or_insert(error);
            }
        }
    }
    if args.json {
        let mut all = Map::from_iter([("files".to_owned(), Value::from(files))]);
        if let Some(error) = &first_error {
            all.insert("error".to_owned(), error.to_json());
        }
        writeln!(out, "{:#}", Value::from(all))?;
    }
    Ok(first_error.map_or(0, |error| error.code.exit()))
}

/// One value a line, for the points that `at` names.
fn values(args: &InfoArgs, at: &str, out: &mut dyn Write, err: &mut dyn Write) -> std::io::Result<u8> {
    match answers(args, at) {
        Ok(lines) => out.write_all(lines.as_bytes()).map(|()| 0),
        Err(error) => {
            writeln!(err, "{error}")?;
            if args.json {
                writeln!(out, "{:#}", json!({"error": error.to_json()}))?;
            }
            Ok(error.code.exit())
        }
    }
}

fn answers(args: &InfoArgs, at: &str) -> Result<String> {
    let [path] = &*args.files else {
        return Err(Error::new(Code::BadKey, format!("--at asks for values of one file, not {}.", args.files.len()))
            .hint("Name one file."));
    };
    let file = volume_file::open(path)?;
    let (index, _) = file.select(args.grid.as_deref())?;
    let grid = file.grids[index].grid.as_ref().map_err(Clone::clone)?.lookup();
    let points: Box<dyn Read> = match at {
        "-" => Box::new(std::io::stdin()),
        name => Box::new(std::fs::File::open(name).map_err(|e| Error::reading(Path::new(name), &e))?),
    };
    let mut answers = String::new();
    for (n, line) in BufReader::new(points).lines().enumerate() {
        let line = line.map_err(|e| Error::reading(Path::new(at), &e))?;
        if line.trim().is_empty() {
            continue;
        }
        let point = point(&line).ok_or_else(|| {
            Error::new(Code::BadKey, format!("Line {} of the points is {:?}.", n + 1, shown(&line)))
                .why("Three index coordinates within ±2147483648 are expected.")
                .hint("Write lines such as: 12 0 -3.5")
        })?;
        let whole = point.fract() == DVec3::ZERO;
        let value = if whole { grid.value(point.as_ivec3()) } else { grid.trilinear(point) };
        answers.push_str(&number(value));
        answers.push('\n');
    }
    Ok(answers)
}

/// The point on a line of three numbers, if they are within the index space.
fn point(line: &str) -> Option<DVec3> {
    let numbers: Vec<f64> = line.split_whitespace().map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let [x, y, z] = *numbers else { return None };
    let point = DVec3::new(x, y, z);
    (point.cmpge(IVec3::MIN.as_dvec3()).all() && point.cmple(IVec3::MAX.as_dvec3()).all()).then_some(point)
}

/// A file of the report as JSON.
fn file_json(path: &Path, report: &Report) -> Value {
    let file = &report.file;
    let grids: Vec<Value> = report.grids.iter().map(|(i, stats)| grid_json(&file.grids[*i], stats.as_ref())).collect();
    let warnings: Vec<Value> = report.warnings.iter().map(|w| json!({"code": w.code, "message": w.text})).collect();
    json!({
        "path": path.to_string_lossy(),
        "format": file.format,
        "file_version": file.version,
        "grids": grids,
        "warnings": warnings,
    })
}

fn grid_json(entry: &Entry, stats: Option<&Stats>) -> Value {
    let mut grid = json!({
        "name": entry.name,
        "unique_name": entry.unique_name,
        "type": entry.value_type,
        "class": entry.class_name,
    });
    let mut set = |key: &str, value: Value| grid[key] = value;
    if let (Ok(grid), Some(stats)) = (&entry.grid, stats) {
        let corners = stats.active_box.map(|found| [found.min.to_array(), found.max.to_array()]);
        let finite = |value: f64| if stats.min <= stats.max { json_number(value) } else { Value::Null };
        set("active_voxels", stats.active_voxels.into());
        set("active_bbox", json!(corners));
        set("min", finite(stats.min));
        set("max", finite(stats.max));
        set("sum", json_number(stats.sum));
        set("background", json_number(grid.background));
        set("nan_voxels", stats.nan_voxels.into());
        set("inf_voxels", stats.inf_voxels.into());
        set("negative_voxels", stats.negative_voxels.into());
        set("zero_voxels", stats.zero_voxels.into());
    }
    if let Some(matrix) = entry.world_from_index {
        let row = |i: usize| Value::from_iter(matrix.row(i).to_array().map(json_number));
        set("matrix", Value::from_iter((0..4).map(row)));
    }
    if let Err(error) = &entry.grid {
        set("error", error.to_json());
    }
    grid
}

/// A number of JSON, or a string for what JSON lacks.
fn json_number(value: f64) -> Value {
    if value.is_finite() { value.into() } else { number(value).into() }
}

/// The shortest text that reads back as the same number; `nan`, `inf`, `-inf`.
fn number(value: f64) -> String {
    if value.is_nan() { "nan".to_owned() } else { format!("{value:?}") }
}

/// A file of the report for people.
fn write_text(path: &Path, report: &Report, out: &mut dyn Write) -> std::io::Result<()> {
    let file = &report.file;
    let format = if file.format == "nvdb" { "NanoVDB" } else { "OpenVDB file version" };
    let count = file.grids.len();
    let grids = if count == 1 { "grid" } else { "grids" };
    writeln!(out, "{}: {format} {}, {count} {grids}", path.display(), file.version)?;
    for (index, stats) in &report.grids {
        let entry = &file.grids[*index];
        writeln!(out, "  #{index} {}: {}, {}", shown(&entry.unique_name), entry.value_type, entry.class_name)?;
        match (&entry.grid, stats) {
            (Ok(grid), Some(stats)) => write_figures(entry, grid, stats, out)?,
            (Err(error), _) => writeln!(out, "     not drawn  {}", [&*error.what, &*error.why].join(" ").trim_end())?,
            (Ok(_), None) => unreachable!("every grid that can be drawn has figures"),
        }
    }
    for warning in &report.warnings {
        writeln!(out, "  warning: {warning}")?;
    }
    Ok(())
}

fn write_figures(entry: &Entry, grid: &Grid, stats: &Stats, out: &mut dyn Write) -> std::io::Result<()> {
    match stats.active_box {
        None => writeln!(out, "     voxels  none active; background {}", short_number(grid.background))?,
        Some(found) => {
            let (min, max) = (found.min, found.max);
            let side = |axis: usize| i64::from(max[axis]) - i64::from(min[axis]) + 1;
            let count = grouped(stats.active_voxels);
            writeln!(out, "     voxels  {count} active in {min} to {max} ({} × {} × {})", side(0), side(1), side(2))?;
            let (low, high) = (short_number(stats.min), short_number(stats.max));
            let (sum, background) = (short_number(stats.sum), short_number(grid.background));
            writeln!(out, "     values  min {low}, max {high}, sum {sum}; background {background}")?;
        }
    }
    if let Some(matrix) = entry.world_from_index {
        let size = [0, 1, 2].map(|axis| short_number(matrix.col(axis).length()));
        let origin = matrix.w_axis.truncate().to_array().map(short_number);
        let straight = (0..3).all(|i| (0..3).all(|j| i == j || matrix.col(i)[j] == 0.0));
        let turned = if straight { "" } else { ", turned or sheared" };
        writeln!(out, "     world   voxel {}, index 0 at [{}]{turned}", size.join(" × "), origin.join(", "))?;
    }
    Ok(())
}

/// A number in single precision, for reading.
fn short_number(value: f64) -> String {
    let text = format!("{:?}", value as f32);
    text.strip_suffix(".0").unwrap_or(&text).to_owned()
}

/// A count with commas between thousands.
fn grouped(count: u64) -> String {
    let digits = count.to_string();
    let mut text = String::new();
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::io::nvdb::tests::sample;

    /// Writes files, runs `info` on them and returns the status and both outputs.
    fn info(files: &[&[u8]], args: InfoArgs, points: &str) -> (u8, String, String) {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        let names = (0..files.len()).map(|i| path(&format!("{i}.nvdb")));
        let args = InfoArgs { files: names.collect(), at: args.at.map(|at| path(&at).display().to_string()), ..args };
        for (path, bytes) in args.files.iter().zip(files) {
            std::fs::write(path, bytes).unwrap();
        }
        std::fs::write(path("points"), points).unwrap();
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let code = run(&args, &mut out, &mut err);
        (code, String::from_utf8(out).unwrap(), String::from_utf8(err).unwrap())
    }

    fn json(files: &[&[u8]]) -> (u8, Value, String) {
        let (code, out, err) = info(files, InfoArgs { json: true, ..InfoArgs::default() }, "");
        (code, serde_json::from_str(&out).unwrap(), err)
    }

    #[test]
    fn json_says_what_the_contract_lists() {
        let (code, all, err) = json(&[&sample(&[("smoke", 1), ("v", 6), ("smoke", 1)])]);
        assert_eq!((code, &*err), (0, ""));
        let file = &all["files"][0];
        assert_eq!((&file["format"], &file["file_version"]), (&json!("nvdb"), &json!("32.9")));
        assert!(file["path"].as_str().unwrap().ends_with("0.nvdb"));
        let grid = &file["grids"][0];
        let keys: Vec<&String> = grid.as_object().unwrap().keys().collect();
        let expected = "name unique_name type class active_voxels active_bbox min max sum background nan_voxels \
                        inf_voxels negative_voxels zero_voxels matrix";
        assert_eq!(keys, expected.split_whitespace().collect::<Vec<_>>());
        assert_eq!((&grid["name"], &grid["unique_name"]), (&json!("smoke"), &json!("smoke[0]")));
        assert_eq!((&grid["type"], &grid["class"]), (&json!("float"), &json!("fog volume")));
        // A tile of 8³ and one of 4096³ voxels, and those of the leaf.
        let leaf: u32 =
            [0xff00_ff00_1234_5678_u64, 0, 1, 2, 3, 4, 5, u64::MAX].iter().map(|word| word.count_ones()).sum();
        assert_eq!(grid["active_voxels"], json!(512 + 4096_u64.pow(3) + u64::from(leaf)));
        assert_eq!(grid["active_bbox"], json!([[-16, -4096, 128], [12287, 15, i32::MAX]]));
        assert_eq!((&grid["max"], &grid["background"]), (&json!(f64::from(5.11_f32 + 0.25)), &json!(0.5)));
        assert_eq!(grid["matrix"][0], json!([1.0, 0.0, 0.0, 1.0]));
        assert_eq!(grid["matrix"][3], json!([0.0, 0.0, 0.0, 1.0]));
        let vector = &file["grids"][1];
        assert_eq!((&vector["error"]["code"], vector.get("min")), (&json!("unsupported"), None));
        assert_eq!(file["warnings"][0]["code"], json!("background"));
    }

    #[test]
    fn of_several_files_a_refused_one_has_its_error_and_the_exit_is_3() {
        let good = sample(&[("density", 1)]);
        let (code, all, err) = json(&[b"text", &good, b"NanoVDB2"]);
        assert_eq!(code, 3);
        assert_eq!(all["files"][0]["error"]["code"], json!("unknown_format"));
        assert!(all["files"][0].get("grids").is_none());
        assert_eq!(all["files"][1]["grids"][0]["name"], json!("density"));
        assert_eq!(all["files"][2]["error"]["code"], json!("corrupt"));
        assert_eq!(all["error"], all["files"][0]["error"], "the first error stands alone too");
        assert!(err.contains("[unknown_format]\n") && err.contains("[corrupt]\n"), "{err}");
    }

    #[test]
    fn numbers_that_json_lacks_are_strings() {
        let json = |value: f64| json_number(value).to_string();
        assert_eq!(json(f64::NAN), "\"nan\"");
        assert_eq!((json(f64::INFINITY), json(f64::NEG_INFINITY)), ("\"inf\"".to_owned(), "\"-inf\"".to_owned()));
        assert_eq!(json(f64::from(0.1_f32)), "0.10000000149011612");
    }

    #[test]
    fn a_grid_without_finite_values_has_no_least_one() {
        let mut file = crate::io::nvdb::read(&sample(&[("a", 1)])).unwrap();
        let grid = file.grids[0].grid.as_mut().unwrap();
        grid.tiles.clear();
        grid.values = crate::volume::grid::Values::F32(vec![f32::NAN; 512]);
        let stats = grid.stats();
        let grid = grid_json(&file.grids[0], Some(&stats));
        assert_eq!((&grid["min"], &grid["max"], &grid["sum"]), (&Value::Null, &Value::Null, &json!(0.0)));
        assert_eq!(grid["nan_voxels"], grid["active_voxels"]);
    }

    #[test]
    fn points_are_answered_one_a_line() {
        let args = |grid: Option<&str>| InfoArgs {
            grid: grid.map(str::to_owned),
            at: Some("points".to_owned()),
            ..InfoArgs::default()
        };
        let file = sample(&[("a", 1), ("b", 1)]);
        // The first and the tenth voxel, outside, a tile, and between two voxels.
        let points = "-8 0 128\n\n-8 1 129\n  1000 0 0\n-16.0 8 136\n-8 0 128.5\n";
        let (code, out, err) = info(&[&file], args(Some("#1")), points);
        let between = (0.25 + f64::from(0.01_f32 + 0.25)) / 2.0;
        let expected = [0.25, f64::from(0.09_f32 + 0.25), 0.5, 0.75, between];
        let values: Vec<f64> = out.lines().map(|line| line.parse().unwrap()).collect();
        assert_eq!((code, &*err, values), (0, "", expected.to_vec()));
        assert_eq!(info(&[&file], args(None), points).0, 3, "several grids");
        assert_eq!(info(&[&file], args(Some("c")), points).0, 3, "no such grid");
        assert_eq!(info(&[&file, &file], args(Some("a")), points).0, 2, "two files");
        for bad in ["1 2", "1 2 3 4", "1 2 x", "1 2 nan", "1 2 3e9"] {
            let (code, out, err) = info(&[&file], args(Some("a")), &format!("1 2 3\n{bad}\n"));
            assert_eq!((code, &*out), (2, ""), "{bad}");
            assert!(err.contains("Line 2"), "{err}");
        }
    }

    #[test]
    fn the_report_for_people_names_grids_figures_and_warnings() {
        let (code, out, _) = info(&[&sample(&[("smoke", 1), ("v", 6)])], InfoArgs::default(), "");
        assert_eq!(code, 0);
        for part in
            ["NanoVDB 32.9, 2 grids", "#0 smoke: float, fog volume", "68,719,477,", "[-16, -4096, 128]", "sheared"]
        {
            assert!(out.contains(part), "{part} in\n{out}");
        }
        assert!(out.contains("#1 v: Vec3f, fog volume\n     not drawn"), "{out}");
        assert!(out.contains("smoke has the background 0.5") && out.contains("[background]"), "{out}");
        let only = InfoArgs { grid: Some("#1".to_owned()), ..InfoArgs::default() };
        let (code, out, _) = info(&[&sample(&[("a", 1), ("b", 1)])], only, "");
        assert_eq!((code, out.contains("#0"), out.contains("#1 b")), (0, false, true), "{out}");
    }

    #[test]
    fn counts_are_grouped_by_thousands() {
        assert_eq!([0, 999, 1000, 1_234_567].map(grouped), ["0", "999", "1,000", "1,234,567"]);
    }
}
