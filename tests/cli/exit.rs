//! Exit codes and messages of what goes wrong.

use super::*;

#[test]
fn a_wrong_command_line_is_2() {
    let folder = scene_folder();
    let wrong: [&[&str]; 9] = [
        &["render", "s.toml"],
        &["render", "-o", "a.exr"],
        &["render", "s.toml", "-o", "a.exr", "--sp", "1"],
        &["render", "s.toml", "-o", "a.exr", "--spp", "0"],
        &["render", "s.toml", "-o", "a.exr", "--size", "12"],
        &["render", "s.toml", "-o", "a.exr", "--frames", "3..1"],
        &["render", "s.toml", "-o", "a.exr", "--aov", "normals"],
        &["render", "s.toml", "-o", "a.exr", "--target-error", "-1"],
        &["completions", "csh"],
    ];
    for arguments in wrong {
        let run = folder.fails(arguments, 2, "bad_key");
        assert!(run.out.is_empty(), "{arguments:?}: {}", run.out);
    }
    assert_eq!(folder.names(), ["s.toml"], "nothing was written");
}

#[test]
fn a_wrong_scene_is_2_and_names_key_line_range_and_neighbour() {
    let folder = Folder::new();
    // What the message must say, for a scene with this in its third line.
    let scenes = [
        ("[medium]\nalbdo = [1, 1, 1]", &["albdo", ":4:", "albedo"][..]),
        ("[medium]\ng = 1.5", &["g", ":4:", "−0.999", "0.999"]),
        ("[medium]\ng = \"forward\"", &["g", ":4:"]),
        ("[meduim]\ng = 0.5", &["meduim", ":3:", "medium"]),
        ("[medium]\nphase = \"cloudy\"", &["cloudy", ":4:", "rayleigh"]),
        ("[film]\nwidth = 0", &["width", ":4:", "16384"]),
        ("[[lights]]\nkind = \"lamp\"", &["lamp", ":4:", "point"]),
        ("[integrator]\nmax_bounces = -1", &["max_bounces", ":4:"]),
        ("[camera]\nup = [0, 1]", &["up", ":4:"]),
        ("[volume\nfile = 3", &[":3:"]),
        ("[[animation]]\nkey = \"film.width\"\nframes = [0, 1]\nvalues = [3, 4]", &["film.width"]),
        ("[volume]\nfile = \"a.vdb\"\nprocedural = \"cumulus\"", &["file", "procedural"]),
    ];
    for (text, says) in scenes {
        folder.write("bad.toml", format!("version = 1\n\n{text}\n"));
        let run = folder.fails(&["render", "bad.toml", "-o", "a.exr"], 2, "bad_key");
        for word in says {
            assert!(run.err.contains(word), "{word:?} is not said of\n{text}\n:\n{}", run.err);
        }
        assert!(run.err.contains("bad.toml"), "{}", run.err);
    }
    folder.write("new.toml", "version = 2\n");
    folder.fails(&["render", "new.toml", "-o", "a.exr"], 2, "bad_key");
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn a_wrong_setting_is_2() {
    let folder = scene_folder();
    let wrong = [
        ("medium.gg=0.5", "medium.g"),
        ("medium.g=2", "0.999"),
        ("medium.g", "="),
        ("lights.7.radiance=[1,1,1]", "lights.7"),
        ("medium.albedo=[0.5,0.5]", "albedo"),
        ("tracking.majorant=tree", "grid"),
        ("camera.up=[0,0,0]", "camera.up"),
        ("volume.to_world=[1,0,0,0, 0,1,0,0, 0,0,0,0, 0,0,0,1]", "to_world"),
        ("volume.bounds=[[1,1,1],[-1,-1,-1]]", "bounds"),
        ("lights.0.direction=[0,0,0]", "direction"),
    ];
    for (assignment, says) in wrong {
        let run = folder.fails(&["render", "s.toml", "-o", "a.exr", "--set", assignment], 2, "bad_key");
        assert!(run.err.contains(says) && run.err.contains("--set"), "{says:?} is not said: {}", run.err);
    }
    assert_eq!(folder.names(), ["s.toml"], "nothing was written");
}

#[test]
fn wrong_outputs_are_2() {
    let folder = scene_folder();
    folder.fails(&["render", "s.toml", "-o", "a.jpg"], 2, "bad_key");
    folder.fails(&["render", "s.toml", "-o", "a"], 2, "bad_key");
    let run = folder.fails(&["render", "s.toml", "-o", "a.png", "--aov", "depth"], 2, "bad_key");
    assert!(run.err.contains(".exr"), "{}", run.err);
    let run = folder.fails(&["render", "s.toml", "-o", "a.exr", "--frames", "0..2"], 2, "bad_key");
    assert!(run.err.contains("%04d") && run.err.contains("####"), "{}", run.err);
}

#[test]
fn a_refused_input_is_3() {
    let folder = scene_folder();
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
    let whole = volume(&["density"]);
    let inputs: [(&str, Vec<u8>, &str); 5] = [
        ("noise.vdb", (0..4096u32).map(|i| (i.wrapping_mul(2_654_435_761) >> 24) as u8).collect(), "unknown_format"),
        ("empty.vdb", Vec::new(), "unknown_format"),
        ("pointer.vdb", pointer.into(), "pointer_file"),
        ("half.vdb", whole[..whole.len() / 2].to_vec(), "corrupt"),
        ("page.nvdb", b"<!DOCTYPE html><html><body>404</body></html>".to_vec(), "pointer_file"),
    ];
    for (name, bytes, code) in inputs {
        folder.write(name, bytes);
        let run = folder.fails(&["render", name, "-o", "a.exr"], 3, code);
        assert!(run.err.contains(name), "{}", run.err);
        folder.fails(&["info", name], 3, code);
    }
    for command in [&["render", "lost.vdb", "-o", "a.exr"][..], &["render", "lost.toml", "-o", "a.exr"]] {
        let run = folder.fails(command, 3, "not_found");
        assert!(run.err.contains("lost."), "{}", run.err);
    }
    folder.fails(&["info", "lost.vdb"], 3, "not_found");
    folder.fails(&["compare", "lost.exr", "lost.exr"], 3, "not_found");
    folder.write("two.vdb", volume(&["smoke", "heat"]));
    let run = folder.fails(&["render", "two.vdb", "-o", "a.exr"], 3, "many_grids");
    assert!(run.err.contains("smoke") && run.err.contains("heat"), "{}", run.err);
    let run = folder.fails(&["render", "two.vdb", "-o", "a.exr", "--set", "volume.grid=fog"], 3, "no_density_grid");
    assert!(run.err.contains("fog") && run.err.contains("smoke"), "{}", run.err);
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn an_environment_map_that_cannot_be_read_is_3() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let sky = |file: &str| format!("{SCENE}[[lights]]\nkind = \"environment\"\nfile = \"{file}\"\n");
    folder.write("e.toml", sky("sky.hdr"));
    let missing = folder.run(&["render", "e.toml", "-o", "a.exr"]);
    assert_eq!(missing.code, 3, "{}", missing.err);
    assert!(missing.err.contains("sky.hdr"), "{}", missing.err);
    folder.write("sky.hdr", b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 4 +X 8\nshort");
    folder.fails(&["render", "e.toml", "-o", "a.exr"], 3, "bad_hdri");
    folder.write("n.toml", sky(""));
    folder.fails(&["render", "n.toml", "-o", "a.exr"], 2, "bad_key");
}

#[test]
fn a_picture_without_a_scene_is_2() {
    let folder = Folder::new();
    folder.write("a.pfm", b"PF\n1 1\n-1.0\n\0\0\0\0\0\0\0\0\0\0\0\0");
    let run = folder.fails(&["render", "a.pfm", "-o", "b.exr"], 2, "bad_key");
    assert!(run.err.contains("a.pfm"), "{}", run.err);
}

#[test]
fn no_adapter_is_4() {
    let folder = scene_folder();
    let mut command = folder.command(&["render", "s.toml", "-o", "a.exr"]);
    let run = Run::of(command.env("NEPHELE_ADAPTER", "abacus").output().expect("the program starts"));
    assert_eq!(run.code, 4, "{}", run.err);
    assert!(run.err.trim_end().ends_with("[no_adapter]"), "{}", run.err);
    assert!(run.err.contains("mesa-vulkan-drivers"), "it says what to install: {}", run.err);
    assert!(!folder.path("a.exr").exists());
}

#[test]
fn failures_while_running_are_1() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let run = folder.fails(&["render", "s.toml", "-o", "lost/a.exr", "--spp", "1"], 1, "write");
    assert!(run.err.contains("lost"), "{}", run.err);
    let huge = ["render", "s.toml", "-o", "a.exr", "--size", "16384x16384", "--spp", "1"];
    let run = folder.fails(&huge, 1, "too_large");
    assert!(run.err.contains("16384"), "{}", run.err);
    assert_eq!(folder.names(), ["s.toml"], "nothing was written");
}

#[test]
fn compare_finds_too_much_is_5() {
    let folder = Folder::new();
    let pfm = |value: f32| {
        let mut bytes = b"PF\n2 2\n-1.0\n".to_vec();
        (0..12).for_each(|_| bytes.extend(value.to_le_bytes()));
        bytes
    };
    folder.write("a.pfm", pfm(1.0));
    folder.write("b.pfm", pfm(1.1));
    folder.write("c.pfm", b"PF\n1 1\n-1.0\n\0\0\0\0\0\0\0\0\0\0\0\0");
    folder.ok(&["compare", "a.pfm", "a.pfm", "--max-relmse", "0"]);
    folder.ok(&["compare", "a.pfm", "b.pfm", "--max-relmse", "0.1"]);
    let run = folder.run(&["compare", "a.pfm", "b.pfm", "--max-relmse", "0.001"]);
    assert_eq!(run.code, 5, "{}", run.err);
    assert!(run.err.contains("0.001"), "{}", run.err);
    folder.fails(&["compare", "a.pfm", "c.pfm"], 2, "bad_key");
    let json = folder.ok(&["compare", "a.pfm", "b.pfm", "--json"]).json();
    let relmse = (1.0f64 - 1.1).powi(2) / (1.1f64.powi(2) + 0.01);
    assert!((json["relmse"].as_f64().expect("a number") / relmse - 1.0).abs() < 1e-5, "{json}");
    assert!((json["mape"].as_f64().expect("a number") / (0.1 / 1.11) - 1.0).abs() < 1e-5, "{json}");
    // A command line that does not fit says so in JSON too.
    let unfit = folder.run(&["doctor", "--json", "--self-tset"]);
    assert_eq!(unfit.json()["error"]["code"], "bad_key", "{}", unfit.out);
    let broken = folder.run(&["compare", "a.pfm", "lost.pfm", "--json"]);
    assert_eq!(broken.code, 3);
    assert_eq!(broken.json()["error"]["code"], "not_found", "{}", broken.out);
}
