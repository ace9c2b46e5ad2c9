//! `nephele compare A B`: how far a picture is from a reference.

use std::io::Write;
use std::path::PathBuf;

use serde_json::{Value, json};

use crate::error::{Code, Error, Result};
use crate::image::metrics::{self, Comparison, Range};
use crate::io::picture::{self, Format, Loaded};

/// What to compare.
#[derive(Clone, Debug, PartialEq)]
pub struct CompareArgs {
    /// The picture: EXR, PNG or PFM, told by content.
    pub a: PathBuf,
    /// The reference, of the same size.
    pub b: PathBuf,
    /// One JSON object on stdout in place of the table.
    pub json: bool,
    /// The greatest relMSE that passes.
    pub max_relmse: Option<f64>,
}

/// Compares, writes the figures to `out`, warnings and the error to `err` (with `json` also into the object on `out`),
/// and gives the exit status: 0, 2 for different sizes, 3 for a refused file, 5 where more was found than allowed (a
/// relMSE above the limit, or pixels that are not finite, which no limit allows), 1 where `out` cannot be written.
pub fn run(args: &CompareArgs, out: &mut dyn Write, err: &mut dyn Write) -> u8 {
    let mut report = Value::Object(serde_json::Map::new());
    let result = run_into(args, out, err, &mut report);
    if let Err(error) = &result {
        report["error"] = error.to_json();
        // Where messages cannot be written there is nowhere left to say so.
        let _ = writeln!(err, "{error}");
    }
    let written = match args.json {
        true => writeln!(out, "{report}").and_then(|()| out.flush()),
        false => out.flush(),
    };
    match (result, written) {
        (Err(error), _) => error.code.exit(),
        (Ok(()), Err(_)) => Code::Write.exit(),
        (Ok(()), Ok(())) => 0,
    }
}

fn run_into(args: &CompareArgs, out: &mut dyn Write, err: &mut dyn Write, report: &mut Value) -> Result<()> {
    let (a, b) = (picture::load(&args.a)?, picture::load(&args.b)?);
    let size = |loaded: &Loaded| format!("{}x{}", loaded.image.width, loaded.image.height);
    if size(&a) != size(&b) {
        return Err(Error::new(Code::BadKey, "Pictures of different sizes cannot be compared.")
            .why(format!("{} has {} pixels, {} has {}.", args.a.display(), size(&a), args.b.display(), size(&b)))
            .hint("Render one of them again with --size."));
    }
    let shown = [&a, &b].map(|loaded| loaded.format == Format::Png);
    if shown[0] != shown[1] {
        let text = "Only one of the pictures is a PNG, which holds what the screen shows, not radiance. [scale]";
        // A warning that cannot be written does not change the figures.
        let _ = writeln!(err, "{text}");
    }
    let range = if shown == [true, true] { Range::Display } else { Range::Scene };
    let found = metrics::compare(&a.image, &b.image, range, [runs(&a), runs(&b)]);
    if args.json {
        *report = to_json(args, &a, &found, range);
    } else {
        write_table(out, args, &size(&a), &found).map_err(|e| Error::writing("the standard output".as_ref(), &e))?;
    }
    match args.max_relmse {
        Some(limit) => judge(&found, limit),
        None => Ok(()),
    }
}

/// Fails where the comparison found more than `limit`, or could not tell.
fn judge(found: &Comparison, limit: f64) -> Result<()> {
    let failed = |what: String| {
        Err(Error::new(Code::Different, what)
            .why(format!("--max-relmse allows {limit}."))
            .hint("Render with more samples, or look for what changed."))
    };
    let [a, b] = found.non_finite;
    match found.rel_mse {
        _ if a + b > 0 => failed(format!("{a} and {b} pixels of the pictures are NaN or infinite.")),
        Some(rel_mse) if rel_mse <= limit => Ok(()),
        Some(rel_mse) => failed(format!("relMSE is {rel_mse:.6e}.")),
        None => failed("No pixel can be compared.".into()),
    }
}

/// The number of runs whose spread the AOV `variance` states: `repeat` in the statistics of `render --repeat`, else 1,
/// where it is the variance of the picture's own mean.
fn runs(loaded: &Loaded) -> f64 {
    let stats = loaded.texts.stats_json.as_deref().and_then(|text| serde_json::from_str::<Value>(text).ok());
    stats.and_then(|stats| stats.get("repeat")?.as_f64()).filter(|runs| *runs >= 1.0).unwrap_or(1.0)
}

fn range_name(exposures: Option<(f32, f32, u32)>) -> &'static str {
    if exposures.is_some() { "hdr" } else { "ldr" }
}

fn to_json(args: &CompareArgs, a: &Loaded, found: &Comparison, range: Range) -> Value {
    let exposures =
        found.flip.exposures.map(|(first, last, count)| json!({"first": first, "last": last, "count": count}));
    let z = found.z.map(|z| {
        // JSON has no infinity; the contract writes what it lacks as a string.
        let number = |x: f64| if x.is_finite() { json!(x) } else { json!("inf") };
        json!({
            "tile": metrics::TILE,
            "max_abs": number(z.max_abs),
            "mean_square": number(z.mean_square),
            "count": z.count,
            "unknown": z.unknown,
        })
    });
    json!({
        "a": args.a.display().to_string(),
        "b": args.b.display().to_string(),
        "width": a.image.width,
        "height": a.image.height,
        "range": match range { Range::Display => "display", Range::Scene => "scene" },
        "mse": found.mse,
        "relmse": found.rel_mse,
        "mape": found.mape,
        "flip": found.flip.mean,
        "flip_max": found.flip.max,
        "flip_kind": range_name(found.flip.exposures),
        "flip_exposures": exposures,
        "energy_ratio": found.energy_ratio,
        "z": z,
        "non_finite": {"a": found.non_finite[0], "b": found.non_finite[1]},
    })
}

fn write_table(out: &mut dyn Write, args: &CompareArgs, size: &str, found: &Comparison) -> std::io::Result<()> {
    let number = |value: Option<f64>| value.map_or("unknown".to_owned(), |value| format!("{value:.6e}"));
    writeln!(out, "A        {}", args.a.display())?;
    writeln!(out, "B        {} (reference)", args.b.display())?;
    writeln!(out, "size     {size}")?;
    writeln!(out, "MSE      {}", number(found.mse))?;
    writeln!(out, "relMSE   {}", number(found.rel_mse))?;
    writeln!(out, "MAPE     {}", number(found.mape))?;
    let mean = found.flip.mean.map_or("unknown".to_owned(), |mean| format!("{mean:.6}"));
    let kind = match found.flip.exposures {
        Some((first, last, count)) => format!("HDR, {count} exposures from {first:+.2} to {last:+.2} EV"),
        None => "LDR".to_owned(),
    };
    writeln!(out, "ꟻLIP     {mean} (largest {:.6}; {kind})", found.flip.max)?;
    let ratio = |c: usize| found.energy_ratio[c].map_or("unknown".to_owned(), |ratio| format!("{ratio:.6}"));
    writeln!(out, "energy   R {}  G {}  B {}  (A / B)", ratio(0), ratio(1), ratio(2))?;
    match found.z {
        Some(z) => {
            let tile = metrics::TILE;
            let (count, unknown) = (z.count, z.unknown);
            write!(out, "tile z   largest |z| {:.3}, mean z² {:.3}", z.max_abs, z.mean_square)?;
            writeln!(out, " over {count} means of {tile}x{tile} pixels ({unknown} without variance)")?;
        }
        None => writeln!(out, "tile z   unknown: not both pictures have an AOV variance")?,
    }
    let [a, b] = found.non_finite;
    if a + b > 0 {
        writeln!(out, "bad      {a} pixels of A and {b} of B are NaN or infinite; left out of the figures above")?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::image::{Image, Layer};
    use crate::io::picture::{Metadata, save};

    /// 9x8 pixels, two tiles; every channel is `value` but one pixel's red in each tile, and the variance is `variance`.
    fn picture(value: f32, extra: f32, variance: f32) -> Image {
        let mut image = Image::from_rgba(9, 8, [value, value, value, 1.0].repeat(72));
        image.layers[0].data[0] += extra;
        let channels = ["R", "G", "B"].map(String::from).to_vec();
        image.layers.push(Layer { name: "variance".into(), channels, data: vec![variance; 72 * 3] });
        image
    }

    struct Folder(tempfile::TempDir);

    impl Folder {
        fn new() -> Folder {
            Folder(tempfile::tempdir().expect("a folder"))
        }

        fn save(&self, name: &str, image: &Image, stats: &str) -> PathBuf {
            let path = self.0.path().join(name);
            let meta = Metadata { stats_json: stats.into(), ..Metadata::default() };
            save(&path, image, &meta, &Default::default()).expect("saves");
            path
        }
    }

    fn compare(a: &Path, b: &Path, json: bool, max_relmse: Option<f64>) -> (u8, String, String) {
        let (mut out, mut err) = (Vec::new(), Vec::new());
        let args = CompareArgs { a: a.into(), b: b.into(), json, max_relmse };
        let status = run(&args, &mut out, &mut err);
        (status, String::from_utf8(out).expect("UTF-8"), String::from_utf8(err).expect("UTF-8"))
    }

    #[test]
    fn figures_go_out_as_a_table_and_as_json() {
        let folder = Folder::new();
        let a = folder.save("a.exr", &picture(1.0, 7.2, 0.5), "");
        let b = folder.save("b.exr", &picture(1.0, 0.0, 0.0), "not json");
        let (status, out, err) = compare(&a, &b, true, None);
        assert_eq!((status, err.as_str()), (0, ""));
        let json: Value = serde_json::from_str(&out).expect("one JSON object");
        let near = |value: &Value, expected: f64| {
            let value = value.as_f64().unwrap_or_else(|| panic!("no number: {json}"));
            assert!((value - expected).abs() < 1e-6 * expected, "{value} is not {expected}");
        };
        // One of 216 values is 7.2 more.
        near(&json["mse"], 7.2 * 7.2 / 216.0);
        near(&json["relmse"], 7.2 * 7.2 / 216.0 / 1.01);
        near(&json["mape"], 7.2 / 216.0 / 1.01);
        near(&json["energy_ratio"][0], 79.2 / 72.0);
        near(&json["energy_ratio"][1], 1.0);
        // The tile has 64 pixels: z = 7.2 / sqrt(64 * 0.5); the other five means are equal.
        near(&json["z"]["max_abs"], 7.2 / 32.0f64.sqrt());
        near(&json["z"]["mean_square"], 7.2 * 7.2 / 32.0 / 6.0);
        assert_eq!((&json["z"]["count"], &json["z"]["unknown"]), (&json!(6), &json!(0)));
        assert_eq!((&json["flip_kind"], &json["range"]), (&json!("hdr"), &json!("scene")));
        assert!(json["flip"].as_f64().is_some_and(|flip| flip > 0.001 && flip < 0.5));
        assert_eq!(json["non_finite"], json!({"a": 0, "b": 0}));
        let (status, table, _) = compare(&a, &b, false, None);
        assert_eq!(status, 0);
        for line in ["MSE      2.400000e-1", "relMSE   2.37623", "energy   R 1.100000  G 1.000000", "|z| 1.273"] {
            assert!(table.contains(line), "{line} is not in\n{table}");
        }
    }

    #[test]
    fn the_variance_between_runs_is_that_of_one_run() {
        let folder = Folder::new();
        let b = folder.save("b.exr", &picture(1.0, 0.0, 0.0), "");
        let z = |stats: &str| {
            let a = folder.save("a.exr", &picture(1.0, 7.2, 0.5), stats);
            let json: Value = serde_json::from_str(&compare(&a, &b, true, None).1).expect("JSON");
            json["z"]["max_abs"].as_f64().expect("a number")
        };
        // Of 16 runs the mean's standard error is a quarter.
        assert!((z("{\"repeat\": 16}") / z("{}") - 4.0).abs() < 1e-9);
        assert_eq!(z("{\"repeat\": null}"), z(""));
    }

    #[test]
    fn the_limit_decides_between_0_and_5() {
        let folder = Folder::new();
        let a = folder.save("a.pfm", &picture(1.0, 7.2, 0.0), "");
        let b = folder.save("b.exr", &picture(1.0, 0.0, 0.0), "");
        assert_eq!(compare(&a, &b, false, Some(0.2377)).0, 0);
        let (status, out, err) = compare(&a, &b, false, Some(0.2376));
        assert_eq!(status, 5);
        assert!(out.contains("relMSE   2.37623") && err.trim_end().ends_with("[different]"), "{out}{err}");
        assert!(out.contains("tile z   unknown"), "{out}");
        let (status, out, _) = compare(&a, &b, true, Some(0.0));
        let json: Value = serde_json::from_str(&out).expect("one JSON object");
        assert_eq!((status, &json["error"]["code"]), (5, &json!("different")));
        assert!(json["relmse"].is_number(), "{json}");
        assert_eq!(compare(&a, &a, false, Some(0.0)).0, 0);
        assert_eq!(compare(&a, &b, false, Some(f64::NAN)).0, 5);
    }

    #[test]
    fn pixels_that_are_not_finite_are_counted_and_never_pass() {
        let folder = Folder::new();
        let mut broken = picture(1.0, 0.0, 0.0);
        broken.layers[0].data[5] = f32::NAN;
        broken.layers[0].data[10] = f32::INFINITY;
        let (a, b) = (folder.save("a.exr", &broken, ""), folder.save("b.exr", &picture(1.0, 0.0, 0.0), ""));
        let (status, out, err) = compare(&a, &b, false, None);
        assert_eq!((status, err.as_str()), (0, ""));
        assert!(out.contains("bad      2 pixels of A and 0 of B") && out.contains("MSE      0.000000e0"), "{out}");
        assert_eq!(compare(&a, &b, false, Some(1e9)).0, 5);
        assert_eq!(compare(&b, &a, false, Some(1e9)).0, 5);
    }

    #[test]
    fn unusable_inputs_have_their_codes() {
        let folder = Folder::new();
        let a = folder.save("a.exr", &picture(1.0, 0.0, 0.0), "");
        let small = folder.save("b.exr", &Image::from_rgba(8, 9, vec![1.0; 288]), "");
        let (status, out, err) = compare(&a, &small, true, None);
        let json: Value = serde_json::from_str(&out).expect("one JSON object");
        assert_eq!((status, &json["error"]["code"]), (2, &json!("bad_key")));
        assert!(err.contains("9x8") && err.contains("8x9") && json.get("mse").is_none(), "{err}{json}");
        assert_eq!(compare(&a, &folder.0.path().join("none.exr"), false, None).0, 3);
        std::fs::write(&small, "text").expect("writes");
        assert_eq!(compare(&small, &a, false, None).0, 3);
    }

    #[test]
    fn shown_pictures_are_compared_as_shown() {
        let folder = Folder::new();
        let (dark, bright) = (picture(0.1, 0.0, 0.0), picture(0.2, 0.0, 0.0));
        let (a, b) = (folder.save("a.png", &dark, ""), folder.save("b.png", &bright, ""));
        let json: Value = serde_json::from_str(&compare(&a, &b, true, None).1).expect("JSON");
        assert_eq!((&json["flip_kind"], &json["range"], &json["z"]), (&json!("ldr"), &json!("display"), &Value::Null));
        let (status, out, err) = compare(&a, &folder.save("b.pfm", &bright, ""), true, None);
        assert!(status == 0 && err.contains("Only one of the pictures is a PNG"), "{err}");
        assert!(out.contains(r#""range":"scene""#), "{out}");
    }

    #[test]
    fn an_output_that_cannot_be_written_is_a_failure() {
        struct Full;
        impl Write for Full {
            fn write(&mut self, _: &[u8]) -> std::io::Result<usize> {
                Err(std::io::Error::other("full"))
            }
            fn flush(&mut self) -> std::io::Result<()> {
                Ok(())
            }
        }
        let folder = Folder::new();
        let a = folder.save("a.exr", &picture(1.0, 0.0, 0.0), "");
        for json in [false, true] {
            let args = CompareArgs { a: a.clone(), b: a.clone(), json, max_relmse: None };
            assert_eq!(run(&args, &mut Full, &mut Vec::new()), 1);
        }
    }
}
