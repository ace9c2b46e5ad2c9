//! `info`.

use super::*;

#[test]
fn info_tells_what_is_in_a_file() {
    let folder = Folder::new();
    folder.write("a.vdb", volume(&["density", "heat", "heat"]));
    let json = folder.ok(&["info", "a.vdb", "--json"]).json();
    let file = &json["files"][0];
    assert_eq!((&file["path"], &file["format"]), (&"a.vdb".into(), &"vdb".into()));
    assert_eq!(file["file_version"], "224");
    assert!(file["warnings"].is_array());
    let grids = file["grids"].as_array().expect("a list");
    let names: Vec<&str> = grids.iter().filter_map(|g| g["unique_name"].as_str()).collect();
    assert_eq!(names, ["density", "heat[0]", "heat[1]"]);
    let grid = &grids[0];
    assert_eq!((&grid["name"], &grid["type"]), (&"density".into(), &"float".into()));
    assert_eq!(grid["class"], "fog volume");
    // 7 of 8 values of the leaf, and the tile's 512 voxels.
    assert_eq!(grid["active_voxels"], 448 + 512);
    // Of the leaf, z = 0 is not active; the tile is.
    assert_eq!(grid["active_bbox"], serde_json::json!([[0, 0, 0], [15, 7, 7]]));
    assert_eq!((grid["min"].as_f64(), grid["max"].as_f64()), (Some(0.125), Some(0.875)));
    assert_eq!(grid["sum"].as_f64(), Some(64.0 * 3.5 + 256.0));
    assert_eq!((&grid["background"], &grid["nan_voxels"]), (&0.0.into(), &0.into()));
    assert_eq!((&grid["inf_voxels"], &grid["negative_voxels"]), (&0.into(), &0.into()));
    assert_eq!(grid["zero_voxels"], 0);
    assert_eq!(grid["matrix"][0], serde_json::json!([0.5, 0.0, 0.0, 0.0]));
    assert_eq!(grid["matrix"][3], serde_json::json!([0.0, 0.0, 0.0, 1.0]));

    let text = folder.ok(&["info", "a.vdb"]).out;
    for word in ["a.vdb", "density", "heat[1]", "float", "fog volume", "960"] {
        assert!(text.contains(word), "{word} in {text}");
    }
}

#[test]
fn info_answers_values_at_coordinates() {
    let folder = Folder::new();
    folder.write("a.vdb", volume(&["density"]));
    folder.write("at.txt", "0 0 3\n7 7 7\n9 3 3\n-1 0 0\n0 0 2.5\n");
    let run = folder.ok(&["info", "a.vdb", "--grid", "density", "--at", "at.txt"]);
    let values: Vec<f64> = run.out.lines().map(|l| l.trim().parse().expect("a number a line")).collect();
    assert_eq!(values, [0.375, 0.875, 0.5, 0.0, 0.3125]);
    let run = folder.run(&["info", "a.vdb", "--grid", "density", "--at", "lost.txt"]);
    assert_eq!(run.code, 3, "{}", run.err);
}

#[test]
fn one_refused_file_of_several_is_reported_in_its_place() {
    let folder = Folder::new();
    folder.write("a.vdb", volume(&["density"]));
    folder.write("b.vdb", b"noise");
    let run = folder.run(&["info", "a.vdb", "b.vdb", "a.vdb", "--json"]);
    assert_eq!(run.code, 3);
    let json = run.json();
    assert_eq!(json["files"].as_array().map(Vec::len), Some(3));
    assert_eq!(json["files"][1]["error"]["code"], "unknown_format");
    assert!(json["files"][1]["grids"].is_null() && json["files"][2]["grids"].is_array());
    assert!(json["error"]["code"] == "unknown_format" && json["error"]["message"].is_string(), "{json}");
}

#[test]
fn what_opens_no_adapter_works_without_one() {
    let folder = Folder::new();
    folder.write("a.vdb", volume(&["density"]));
    folder.write("a.pfm", b"PF\n1 1\n-1.0\n\0\0\0\0\0\0\0\0\0\0\0\0");
    for arguments in
        [&["info", "a.vdb"][..], &["compare", "a.pfm", "a.pfm"], &["settings"], &["completions", "bash"], &["--help"]]
    {
        let mut command = folder.command(arguments);
        let run = Run::of(command.env("NEPHELE_ADAPTER", "abacus").output().expect("the program starts"));
        assert_eq!(run.code, 0, "{arguments:?}: {}", run.err);
        assert_eq!(run.err, "", "{arguments:?}");
    }
}
