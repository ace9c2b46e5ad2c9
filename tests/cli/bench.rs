//! `bench`: what it refuses, and a small run from end to end.

use super::*;

#[test]
fn bench_takes_known_names_and_fitting_flags() {
    let folder = Folder::new();
    folder.fails(&["bench", "speed"], 2, "bad_key");
    folder.fails(&["bench", "tracking", "--size", "4"], 2, "bad_key");
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
