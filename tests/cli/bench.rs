//! `bench`: what it refuses, and a small run from end to end.

use super::*;

#[test]
fn bench_takes_known_names_and_fitting_flags() {
    let folder = Folder::new();
    folder.fails(&["bench", "speed"], 2, "bad_key");
    folder.fails(&["bench", "tracking", "--size", "4"], 2, "bad_key");
    folder.fails(&["bench", "reuse", "--size", "4"], 2, "bad_key");
    folder.fails(&["bench", "kernel", "--quick", "--size", "32"], 2, "bad_key");
    folder.fails(&["bench", "kernel", "--quick", "--volume", "cumulus"], 2, "bad_key");
}

#[test]
fn bench_tracking_measures_a_file_and_writes_all_its_files() {
    if !can_draw() {
        return;
    }
    let folder = Folder::new();
    folder.fails(&["bench", "tracking", "--quick", "--volume", "absent.vdb"], 3, "not_found");
    folder.write("cloud.vdb", volume(&["density"]));
    let arguments =
        ["bench", "tracking", "--quick", "--size", "8", "--volume", "cloud.vdb", "-o", "all", "--json", "j"];
    let run = folder.ok(&arguments);
    assert_eq!(run.err, "", "no progress where nobody looks");
    let json = folder.json("j");
    assert_eq!(folder.json("all/tracking.json"), json);
    let cases = json["cases"].as_array().expect("cases");
    assert_eq!(cases.len(), 2, "thin and dense");
    let csv = String::from_utf8(folder.read("all/tracking.csv")).expect("text");
    for case in cases {
        let rows = case["rows"].as_array().expect("rows");
        assert_eq!((&rows[0]["efficiency_by_time"], &rows[0]["z"]), (&Value::from(1.0), &Value::from(0.0)));
        for row in rows {
            let name = row["name"].as_str().expect("a name");
            assert!(run.out.contains(name) && csv.contains(name), "{name}");
            let figure = |key: &str| row[key].as_f64().expect("a number");
            let counted = ["lookups_per_path", "steps_per_path", "paths", "variance", "bound_bytes"];
            assert!(counted.into_iter().all(|key| figure(key) > 0.0), "{row}");
            assert_eq!(
                (&row["faults"], row["violations"] == 0.0),
                (&Value::from(0.0), !name.contains("0.9")),
                "{name}"
            );
            // Thousands of paths: signed weights have heavy tails, the others are near.
            let signed = name.starts_with("weighted");
            assert!(signed || figure("relative_difference").abs() < 0.2, "{row}");
        }
    }
    let savings = json["decomposition"].as_array().expect("decomposition");
    assert!(!savings.is_empty());
    for s in savings {
        let [ratio, predicted] = ["ratio", "predicted"].map(|key| s[key].as_f64().expect("a number"));
        assert!(predicted <= 1.0 && (ratio - predicted).abs() < 0.1, "{s}");
    }
    for name in ["efficiency-cloud.svg", "decomposition.svg"] {
        let text = String::from_utf8(folder.read(&format!("all/{name}"))).expect("text");
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n") && !text.contains("NaN"), "{name}");
    }
}

#[test]
fn bench_reuse_measures_a_file_and_writes_all_its_files() {
    if !can_draw() {
        return;
    }
    let folder = Folder::new();
    folder.fails(&["bench", "reuse", "--quick", "--volume", "absent.vdb"], 3, "not_found");
    folder.write("cloud.vdb", volume(&["density"]));
    let arguments = ["bench", "reuse", "--quick", "--size", "8", "--volume", "cloud.vdb", "-o", "all", "--json", "j"];
    let run = folder.ok(&arguments);
    assert_eq!(run.err, "", "no progress where nobody looks");
    let json = folder.json("j");
    assert_eq!(folder.json("all/reuse.json"), json);
    assert_eq!((&json["width"], &json["height"]), (&Value::from(8), &Value::from(6)));
    assert!(json["adapter"].as_str().is_some_and(|name| run.out.contains(name)));
    let csv = String::from_utf8(folder.read("all/reuse.csv")).expect("text");
    let cases = json["cases"].as_array().expect("cases");
    let kinds: Vec<_> = cases
        .iter()
        .map(|c| (c["framing"].as_str(), c["bounces"].as_u64(), c["motion"].as_str()))
        .map(|(framing, bounces, motion)| (framing.unwrap_or(""), bounces.unwrap_or(0), motion.unwrap_or("")))
        .collect();
    let both = |framing, bounces| [(framing, bounces, "still"), (framing, bounces, "moving")];
    assert_eq!(kinds, [both("middle", 1), both("middle", 3), both("whole", 1), both("whole", 3)].concat());
    for case in cases {
        let seeds = case["seeds"].as_array().expect("seeds").len();
        assert!(seeds > 1 && case["reference"]["noise_share"].as_f64().is_some(), "{case}");
        let sides = case["sides"].as_array().expect("sides");
        let names: Vec<&str> = sides.iter().filter_map(|s| s["name"].as_str()).collect();
        assert_eq!(names[..4], ["path", "path-1", "control", "ours"]);
        for side in sides {
            let estimates = ["rel_mse", "v99", "seconds_per_frame", "equal_time_ratio_to_ours"];
            for key in estimates {
                let figure = |part: &str| side[key][part].as_f64().unwrap_or(-1.0);
                assert!(figure("value") > 0.0 && figure("standard_error") >= 0.0, "{key}: {side}");
            }
            let number = |key: &str| side[key]["value"].as_f64().expect("a number");
            assert!(number("lag1_correlation").abs() <= 1.0 && number("energy_bias").is_finite(), "{side}");
            let reuses = !side["name"].as_str().expect("a name").starts_with("path");
            assert!(side["bytes_per_pixel"].as_f64().is_some_and(|bytes| (bytes > 0.0) == reuses), "{side}");
            assert_eq!(side["candidates"].is_u64(), reuses);
            assert!(side["per_pixel_and_frame"]["lookups"].as_f64().is_some_and(|n| n > 0.0), "{side}");
        }
        let ours = &sides[3];
        assert_eq!(ours["equal_time_ratio_to_ours"]["value"], 1.0);
        let means = case["still_means"].as_array().expect("means");
        let frames: Vec<_> = means.iter().filter(|m| m["name"] == "ours").map(|m| m["frames"].as_u64()).collect();
        let expected = if case["motion"] == "still" { vec![Some(1), Some(4), Some(16)] } else { Vec::new() };
        assert_eq!(frames, expected);
        let motion = case["motion"].as_str().expect("a name");
        let framing = case["framing"].as_str().expect("a name");
        let head = format!("\"cloud.vdb\",{framing},{},{motion},ours,1,", case["bounces"]);
        assert_eq!(csv.lines().filter(|line| line.starts_with(&head)).count(), seeds, "{csv}");
    }
    for name in ["equal-time.svg", "still.svg", "lag.svg"] {
        let text = String::from_utf8(folder.read(&format!("all/{name}"))).expect("text");
        assert!(text.starts_with("<svg") && text.ends_with("</svg>\n") && !text.contains("NaN"), "{name}");
    }
}
