//! Sequences and repeats.

use super::*;

const MOVING: &str = "
[[animation]]
key = \"medium.density_scale\"
frames = [1, 3]
values = [1.0, 3.0]
[[animation]]
key = \"lights.0.irradiance\"
frames = [0, 4]
values = [[0, 0, 0], [4, 2, 0]]
";

#[test]
fn each_frame_is_the_still_of_its_settings() {
    if !can_draw() {
        return;
    }
    let folder = Folder::new();
    folder.write("s.toml", SCENE);
    let lights = "[[lights]]\nkind = \"sun\"\n[[lights]]\nkind = \"constant\"\n";
    folder.write("m.toml", format!("{SCENE}{lights}{MOVING}"));
    folder.write("still.toml", format!("{SCENE}{lights}"));
    let common = ["--spp", "4"];
    let sequence = ["render", "m.toml", "-o", "f_%04d.exr", "--frames", "1..3", "--stats", "f.json"];
    folder.ok(&[&sequence[..], &common].concat());
    for (frame, scale, sun) in [(1, 1.0, [1.0, 0.5, 0.0]), (2, 2.0, [2.0, 1.0, 0.0]), (3, 3.0, [3.0, 1.5, 0.0])] {
        let density = format!("medium.density_scale={scale}");
        let irradiance = format!("lights.0.irradiance={sun:?}");
        let still = ["render", "still.toml", "-o", "still.exr", "--set", &density, "--set", &irradiance];
        folder.ok(&[&still[..], &common].concat());
        let name = format!("f_{frame:04}.exr");
        assert!(same_pixels(&folder.picture(&name), &folder.picture("still.exr")), "frame {frame}");
    }
    // Statistics are sums over the frames that ran.
    assert_eq!(folder.json("f.json")["paths"].as_f64(), Some(3.0 * 96.0 * 4.0));
    assert!(!folder.path("f_0000.exr").exists());
    folder.ok(&[&["render", "m.toml", "-o", "g##.pfm", "--frames", "0..1"][..], &common].concat());
    assert!(folder.path("g00.pfm").exists() && folder.path("g01.pfm").exists());
    // One frame needs no number.
    folder.ok(&[&["render", "m.toml", "-o", "one.exr", "--frames", "2..2"][..], &common].concat());
    assert!(same_pixels(&folder.picture("one.exr"), &folder.picture("f_0002.exr")));
}

#[test]
fn repeats_are_independent_runs_with_their_mean_and_variance() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let common = ["render", "s.toml", "--spp", "4", "-o"];
    let repeat = ["all.exr", "--repeat", "3", "--seed", "11", "--aov", "variance", "--stats", "all.json"];
    folder.ok(&[&common[..], &repeat].concat());
    let singles: Vec<Vec<[f32; 3]>> = (11..14)
        .map(|seed| {
            folder.ok(&[&common[..], &["one.exr", "--seed", &seed.to_string()]].concat());
            folder.picture("one.exr").image.rgb().collect()
        })
        .collect();
    assert_ne!(singles[0], singles[1], "seeds differ");
    let image = folder.picture("all.exr").image;
    let variance: Vec<[f32; 3]> = image.layer("variance").expect("asked for").rgb().collect();
    for (p, mean) in image.rgb().enumerate() {
        for c in 0..3 {
            let runs: Vec<f64> = singles.iter().map(|s| f64::from(s[p][c])).collect();
            let expected = runs.iter().sum::<f64>() / 3.0;
            let spread = runs.iter().map(|x| (x - expected).powi(2)).sum::<f64>() / 2.0;
            assert!((f64::from(mean[c]) - expected).abs() < 1e-5 * expected.max(0.1), "mean of pixel {p}");
            let found = f64::from(variance[p][c]);
            assert!((found - spread).abs() < 1e-4 * spread.max(1e-4), "variance of pixel {p}: {found}, {spread}");
        }
    }
    let stats = folder.json("all.json");
    assert_eq!(stats["repeat"], 3, "`compare` needs it");
    assert_eq!(stats["paths"].as_f64(), Some(3.0 * 96.0 * 4.0));
    assert!(stats["relative_error"].as_f64().is_some_and(|e| e > 0.0 && e < 1.0), "{stats:#}");
}
