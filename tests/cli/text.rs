//! Settings, completions, help, and what goes to which stream.

use std::collections::BTreeSet;

use super::*;

#[test]
fn settings_list_every_key_with_what_the_contract_asks() {
    let folder = Folder::new();
    let json = folder.ok(&["settings", "--json"]).json();
    let rows = json["settings"].as_array().expect("a list");
    let mut keys = BTreeSet::new();
    for row in rows {
        for field in ["key", "symbol", "unit", "range", "change", "biased", "help", "label"] {
            assert!(row[field].is_string(), "{field} of {row}");
        }
        assert!(!row["default"].is_null(), "{row}");
        assert!(!row["help"].as_str().unwrap_or_default().is_empty(), "{row}");
        assert!(keys.insert((row["key"].to_string(), row["light"].to_string())), "twice: {row}");
    }
    // Keys of the contract's first sections, and of each light.
    let has = |key: &str| rows.iter().any(|r| r["key"] == key);
    for key in [
        "volume.file",
        "volume.grid",
        "volume.filter",
        "volume.to_world",
        "volume.max_resolution",
        "volume.precision",
        "medium.density_scale",
        "medium.extinction",
        "medium.albedo",
        "medium.phase",
        "medium.g",
        "camera.position",
        "camera.fov_y",
        "camera.aperture_radius",
        "film.width",
        "integrator.max_bounces",
        "integrator.seed",
        "tracking.majorant",
        "tracking.cell",
        "display.exposure",
        "display.tone_map",
    ] {
        assert!(has(key), "{key}");
    }
    let lights: BTreeSet<&str> = rows.iter().filter_map(|r| r["light"].as_str()).collect();
    assert_eq!(lights, BTreeSet::from(["constant", "environment", "point", "sky", "sun"]));
    let text = folder.ok(&["settings"]).out;
    assert!(rows.iter().all(|r| text.contains(r["key"].as_str().unwrap_or("?"))));
}

#[test]
fn completions_are_made_for_every_shell() {
    let folder = Folder::new();
    for shell in ["bash", "zsh", "fish", "powershell"] {
        let out = folder.ok(&["completions", shell]).out;
        assert!(out.contains("nephele") && out.contains("render") && out.contains("target-error"), "{shell}");
    }
    let bash = folder.ok(&["completions", "bash"]).out;
    if let Ok(mut check) = Command::new("bash").arg("-n").stdin(Stdio::piped()).spawn() {
        use std::io::Write;
        check.stdin.take().expect("a pipe").write_all(bash.as_bytes()).expect("bash reads");
        assert!(check.wait().expect("bash ends").success(), "bash reads its completions");
    }
}

#[test]
fn help_and_version_go_to_stdout_without_colours() {
    let folder = Folder::new();
    let help = folder.ok(&["--help"]);
    assert!(help.err.is_empty());
    for word in ["render", "info", "compare", "settings", "completions", "view"] {
        assert!(help.out.contains(word), "{word}");
    }
    assert!(folder.ok(&["--version"]).out.starts_with("nephele "));
    for arguments in [&["--help"][..], &["render", "--help"], &["info", "--help"], &["settings"]] {
        let plain = folder.ok(arguments);
        assert!(!plain.out.contains('\u{1b}') && !plain.err.contains('\u{1b}'), "{arguments:?}");
        let mut command = folder.command(arguments);
        let run = Run::of(command.env("NO_COLOR", "1").output().expect("the program starts"));
        assert_eq!(run.out, plain.out, "{arguments:?}");
    }
}

#[test]
fn drawing_to_a_pipe_says_nothing_and_progress_has_no_escapes() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let quiet = folder.ok(&["render", "s.toml", "-o", "a.exr", "--spp", "4"]);
    assert_eq!((&*quiet.out, &*quiet.err), ("", ""), "no progress where nobody looks");
    let loud = folder.ok(&["render", "s.toml", "-o", "a.exr", "--seconds", "0.3", "--progress"]);
    assert_eq!(loud.out, "");
    assert!(!loud.err.contains('\u{1b}') && !loud.err.contains('\r'), "{:?}", loud.err);
}
