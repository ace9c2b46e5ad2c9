//! Still pictures: what is in the files and in the statistics.

use nephele::image::tone::{Display, ToneMap};

use super::*;

/// Every field that the contract names.
const STATS: [&str; 21] = [
    "version",
    "adapter",
    "backend",
    "width",
    "height",
    "spp",
    "seed",
    "mode",
    "setup_seconds",
    "render_seconds",
    "paths",
    "paths_per_second",
    "lookups",
    "null_collisions",
    "real_collisions",
    "cell_steps",
    "shadow_rays",
    "lookups_per_path",
    "relative_error",
    "biased",
    "warnings",
];

#[test]
fn statistics_have_every_field_and_add_up() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let arguments = ["render", "s.toml", "-o", "a.exr", "--spp", "8", "--seed", "5", "--stats", "a.json"];
    folder.ok(&arguments);
    let stats = folder.json("a.json");
    for key in STATS {
        assert!(!stats[key].is_null(), "{key} in {stats:#}");
    }
    for key in ["volume", "majorant", "film", "reservoirs"] {
        assert!(stats["bytes"][key].is_u64(), "bytes.{key}");
    }
    let number = |key: &str| stats[key].as_f64().unwrap_or_else(|| panic!("{key} is a number: {}", stats[key]));
    assert_eq!((number("width"), number("height"), number("spp"), number("seed")), (12.0, 8.0, 8.0, 5.0));
    assert_eq!(stats["mode"], "path");
    assert_eq!(number("paths"), 12.0 * 8.0 * 8.0, "misses included");
    assert!((number("paths_per_second") * number("render_seconds") / number("paths") - 1.0).abs() < 1e-6);
    assert!((number("lookups_per_path") * number("paths") / number("lookups") - 1.0).abs() < 1e-6);
    assert!(number("real_collisions") > 0.0 && number("shadow_rays") > 0.0);
    assert_eq!(number("null_collisions"), 0.0, "a homogeneous medium has a tight majorant");
    // Lookups of free flights are collisions; those of shadow rays come on top.
    assert!(number("lookups") >= number("null_collisions") + number("real_collisions"));
    assert!(number("cell_steps") >= number("lookups"));
    assert!(number("setup_seconds") > 0.0 && number("render_seconds") > 0.0);
    assert!((0.0..1.0).contains(&number("relative_error")));
    // The same figures are in the picture.
    let inside: Value =
        serde_json::from_str(&folder.picture("a.exr").texts.stats_json.expect("statistics")).expect("JSON");
    assert_eq!(inside, stats);
    // One sample has no variance.
    folder.ok(&["render", "s.toml", "-o", "a.exr", "--spp", "1", "--stats", "one.json"]);
    assert!(folder.json("one.json")["relative_error"].is_null());
}

#[test]
fn limits_end_a_picture() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let spp = |arguments: &[&str]| {
        let all = [&["render", "s.toml", "-o", "a.pfm", "--stats", "a.json"], arguments].concat();
        folder.ok(&all);
        (folder.json("a.json")["spp"].as_u64().expect("a count"), folder.json("a.json"))
    };
    assert_eq!(spp(&[]).0, 256, "the default");
    assert_eq!(spp(&["--spp", "3", "--seconds", "100"]).0, 3);
    let (samples, stats) = spp(&["--target-error", "0.05"]);
    assert!(stats["relative_error"].as_f64().expect("a number") <= 0.05, "{stats:#}");
    let (more, _) = spp(&["--target-error", "0.025"]);
    assert!(more >= 2 * samples, "half the error takes four times the samples: {samples}, {more}");
    let (_, stats) = spp(&["--seconds", "0.2"]);
    let seconds = stats["render_seconds"].as_f64().expect("a number");
    assert!(seconds >= 0.19, "{seconds}");
}

#[test]
fn settings_of_the_command_line_are_in_the_picture() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    folder.ok(&[
        "render",
        "s.toml",
        "-o",
        "a.exr",
        "--spp",
        "1",
        "--size",
        "5x9",
        "--seed",
        "77",
        "--set",
        "medium.g=0.25",
        "--set",
        "medium.phase=isotropic",
        "--set",
        "lights.0.direction=[0,1,0]",
        "--set",
        "integrator.max_bounces=unlimited",
        "--set",
        "camera.position=[0, 0, 6]",
    ]);
    let loaded = folder.picture("a.exr");
    assert_eq!((loaded.image.width, loaded.image.height), (5, 9));
    let toml = loaded.texts.scene_toml.expect("a scene");
    let scene = nephele::scene::Scene::parse(&toml, "a.exr", folder.0.path()).expect("its own text");
    assert_eq!((scene.film.width, scene.film.height, scene.integrator.seed), (5, 9, 77));
    assert_eq!(scene.medium.g, 0.25);
    assert_eq!(scene.medium.phase, nephele::scene::Phase::Isotropic);
    assert_eq!(scene.integrator.max_bounces, nephele::scene::value::Limit::Unlimited);
    assert_eq!(scene.camera.position, nephele::scene::value::Auto::Is(glam::DVec3::new(0.0, 0.0, 6.0)));
    assert!(toml.contains("direction = [0") && toml.contains("0.9"), "{toml}");
}

#[test]
fn a_picture_restores_its_scene_to_the_same_bits() {
    if !can_draw() {
        return;
    }
    let folder = Folder::new();
    folder.write("data/cloud.vdb", volume(&["density"]));
    folder.write(
        "scenes/s.toml",
        "version = 1\n[volume]\nfile = \"../data/cloud.vdb\"\nfilter = \"nearest\"\n[medium]\nphase = \"two-lobe-hg\"\n\
         extinction = [1, 0.5, 0.25]\n[film]\nwidth = 9\nheight = 7\n[display]\nexposure = 1.5\ntone_map = \"aces\"\n",
    );
    std::fs::create_dir(folder.path("out")).expect("a writable folder");
    let draw = |input: &str, output: &str| folder.ok(&["render", input, "-o", output, "--spp", "6"]);
    draw("scenes/s.toml", "out/a.exr");
    draw("scenes/s.toml", "out/a.png");
    draw("out/a.exr", "b.exr");
    draw("out/a.png", "c.exr");
    draw("out/a.exr", "out/d.png");
    let first = folder.picture("out/a.exr");
    assert!(same_pixels(&first, &folder.picture("b.exr")), "from an EXR");
    assert!(same_pixels(&first, &folder.picture("c.exr")), "from a PNG");
    assert!(same_pixels(&folder.picture("out/a.png"), &folder.picture("out/d.png")));
}

#[test]
fn paths_in_a_picture_are_relative_to_it() {
    if !can_draw() {
        return;
    }
    let folder = Folder::new();
    folder.write("data/cloud.vdb", volume(&["density"]));
    folder.write("s.toml", "version = 1\n[volume]\nfile = \"data/cloud.vdb\"\n[film]\nwidth = 9\nheight = 7\n");
    std::fs::create_dir(folder.path("out")).expect("a writable folder");
    let draw = |input: &str, output: &str| folder.ok(&["render", input, "-o", output, "--spp", "2"]);
    draw("s.toml", "out/a.exr");
    let first = folder.picture("out/a.exr");
    let toml = first.texts.scene_toml.clone().expect("a scene");
    assert!(toml.contains("\"../data/cloud.vdb\""), "paths are relative to the picture: {toml}");
    assert!(!toml.contains(&*folder.0.path().to_string_lossy()), "{toml}");
    // Picture and data still belong together after both moved.
    std::fs::create_dir(folder.path("moved")).expect("a writable folder");
    std::fs::rename(folder.path("out"), folder.path("moved/out")).expect("moves");
    std::fs::rename(folder.path("data"), folder.path("moved/data")).expect("moves");
    draw("moved/out/a.exr", "e.exr");
    assert!(same_pixels(&first, &folder.picture("e.exr")));
}

#[test]
fn formats_hold_the_same_picture() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    for name in ["a.exr", "a.png", "a.pfm"] {
        folder.ok(&["render", "s.toml", "-o", name, "--spp", "8", "--set", "display.exposure=-0.5"]);
    }
    let exr = folder.picture("a.exr").image;
    let rgb: Vec<[f32; 3]> = exr.rgb().collect();
    // PFM: three header lines, then rows from the bottom, little-endian.
    let pfm = folder.read("a.pfm");
    let header = b"PF\n12 8\n-1.0\n";
    assert!(pfm.starts_with(header), "{:?}", String::from_utf8_lossy(&pfm[..header.len()]));
    let mut expected = Vec::new();
    for row in (0..8).rev() {
        for pixel in &rgb[row * 12..][..12] {
            pixel.iter().for_each(|x| expected.extend(x.to_le_bytes()));
        }
    }
    assert!(pfm[header.len()..] == expected[..], "the bytes of the EXR's radiance");
    // PNG: 8 bits after exposure and tone map.
    let display = Display { exposure: -0.5, tone_map: ToneMap::Agx };
    let bytes = folder.read("a.png");
    let mut reader = png::Decoder::new(std::io::Cursor::new(&bytes[..])).read_info().expect("a PNG");
    let mut pixels = vec![0; reader.output_buffer_size().expect("a small picture")];
    let info = reader.next_frame(&mut pixels).expect("whole");
    assert_eq!((info.width, info.height, info.bit_depth), (12, 8, png::BitDepth::Eight));
    let found: Vec<[u8; 3]> = pixels.chunks(info.color_type.samples()).take(96).map(|p| [p[0], p[1], p[2]]).collect();
    assert_eq!(found, rgb.iter().map(|&c| display.apply_8bit(c)).collect::<Vec<_>>());
    let layer = &exr.layers[0];
    assert_eq!(layer.channels, ["R", "G", "B", "A"]);
    assert!(layer.data.chunks(4).all(|p| (0.0..=1.0).contains(&p[3])), "opacity");
    assert!(layer.data.chunks(4).any(|p| p[3] > 0.5) && layer.data.chunks(4).any(|p| p[3] < 0.5));
}

#[test]
fn layers_are_in_the_picture() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let names = ["transmittance", "depth", "albedo", "single", "multiple", "variance", "samples"];
    let mut arguments = vec!["render", "s.toml", "-o", "a.exr", "--spp", "16"];
    names.iter().for_each(|n| arguments.extend(["--aov", n]));
    folder.ok(&arguments);
    let image = folder.picture("a.exr").image;
    for name in names {
        let layer = image.layer(name).unwrap_or_else(|| panic!("no layer {name}"));
        let channels = match name {
            "transmittance" | "samples" => 1,
            "depth" => 2,
            _ => 3,
        };
        assert_eq!(layer.channels.len(), channels, "{name}");
        assert_eq!(layer.data.len(), channels * 96, "{name}");
        assert!(layer.data.iter().all(|x| x.is_finite()), "{name}");
    }
    let samples = image.layer("samples").expect("just found");
    assert!(samples.data.iter().all(|&n| n == 16.0));
    let transmittance = image.layer("transmittance").expect("just found");
    let alpha: Vec<f32> = image.layers[0].data.chunks(4).map(|p| p[3]).collect();
    assert!(transmittance.data.iter().zip(&alpha).all(|(t, a)| (t + a - 1.0).abs() < 1e-6));
    // Layers change nothing in the picture itself.
    folder.ok(&["render", "s.toml", "-o", "plain.exr", "--spp", "16"]);
    assert_eq!(folder.picture("plain.exr").image.layers[0], image.layers[0]);
}

#[test]
fn an_old_picture_survives_a_failure() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    folder.write("a.exr", b"precious");
    folder.fails(&["render", "s.toml", "-o", "a.exr", "--set", "medium.g=9"], 2, "bad_key");
    folder.fails(&["render", "s.toml", "-o", "a.exr", "--size", "16384x16384", "--spp", "1"], 1, "too_large");
    assert_eq!(folder.read("a.exr"), b"precious");
    // A folder of that name cannot be replaced by a picture, and nothing is left of the attempt.
    std::fs::create_dir(folder.path("b.exr")).expect("a writable folder");
    folder.fails(&["render", "s.toml", "-o", "b.exr", "--spp", "1"], 1, "write");
    folder.ok(&["render", "s.toml", "-o", "a.exr", "--spp", "1"]);
    assert_eq!(folder.names(), ["a.exr", "b.exr", "s.toml"]);
    assert!(is_whole(&folder.path("a.exr")));
}

#[test]
fn statistics_say_biased_and_why() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let stats = |set: &str| {
        folder.ok(&["render", "s.toml", "-o", "a.pfm", "--spp", "2", "--stats", "a.json", "--set", set]);
        let stats = folder.json("a.json");
        (stats["biased"].clone(), stats["bias"].clone())
    };
    assert_eq!(stats("tracking.transmittance=ratio"), (false.into(), Value::Null));
    assert_eq!(stats("tracking.transmittance=jackknife"), (true.into(), "jackknife transmittance".into()));
    assert_eq!(stats("tracking.free_flight=ray-marching"), (true.into(), "ray marching of free flights".into()));
}

#[test]
fn overlays_are_pictures_and_costs_are_layers() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let draw = |out: &str, more: &[&str]| {
        folder.ok(&[&["render", "s.toml", "-o", out, "--spp", "8", "--stats", "a.json"], more].concat());
        folder.json("a.json")
    };
    let plain = draw("plain.png", &[]);
    assert!(plain["overlay"].is_null());
    let shown = draw("lookups.png", &["--set", "display.overlay=lookups"]);
    assert_eq!(
        (shown["overlay"]["name"].as_str(), shown["lookups"].clone()),
        (Some("lookups"), plain["lookups"].clone())
    );
    assert!(shown["overlay"]["high"].as_f64().is_some_and(|high| high > 0.5), "{}", shown["overlay"]);
    assert!(!same_pixels(&folder.picture("plain.png"), &folder.picture("lookups.png")));
    // What frames keep of paths is shown of a sequence; a picture without such frames says that there is nothing.
    let reuse = ["--set", "integrator.mode=restir", "--set", "display.overlay=source"];
    let shown = draw("source_0.png", &[&reuse[..], &["--frames", "0..0"]].concat());
    let names = shown["overlay"]["names"].as_array().map_or(0, Vec::len);
    assert_eq!((shown["overlay"]["name"].as_str(), names), (Some("source"), 4));
    let still = draw("still.png", &reuse);
    assert!(still["overlay"].is_null() && still["warnings"].to_string().contains("[overlay]"), "{}", still["warnings"]);
    assert!(same_pixels(&folder.picture("plain.png"), &folder.picture("still.png")), "the picture itself");
    // The data of other files is what it is without; layers add up to the counters.
    let stats = draw("a.exr", &["--aov", "lookups", "--aov", "steps"]);
    draw("b.exr", &["--set", "display.overlay=steps"]);
    let (a, b) = (folder.picture("a.exr"), folder.picture("b.exr"));
    assert!(a.image.layers[0].data == b.image.layers[0].data);
    for (layer, total) in [("lookups", "lookups"), ("steps", "cell_steps")] {
        let layer = a.image.layer(layer).expect("a layer");
        let sum: f64 = layer.data.iter().map(|x| f64::from(*x)).sum();
        assert!((8.0 * sum / stats[total].as_f64().expect("a count") - 1.0).abs() < 1e-5, "{total}: {sum}");
    }
}
