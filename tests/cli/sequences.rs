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

/// Lights and bounces of all kinds, so that kernels branch by as much as they can.
#[cfg(target_os = "linux")]
const MANY_LIGHTS: &str = "
[[lights]]
kind = \"sun\"
angular_diameter = 3
[[lights]]
kind = \"sun\"
direction = [-1, 0.5, 0]
[[lights]]
kind = \"point\"
[[lights]]
kind = \"constant\"
[[animation]]
key = \"lights.0.direction\"
frames = [0, 3]
values = [[0, 1, 0], [0.3, 1, 0]]
";

/// Bytes that a command held at most.
#[cfg(target_os = "linux")]
fn peak(folder: &Folder, arguments: &[&str]) -> u64 {
    let mut child = folder.command(arguments).stderr(Stdio::null()).spawn().expect("the program starts");
    let status = format!("/proc/{}/status", child.id());
    let mut most = 0;
    while child.try_wait().expect("the program ends").is_none() {
        let text = std::fs::read_to_string(&status).unwrap_or_default();
        let line = text.lines().find_map(|line| line.strip_prefix("VmHWM:"));
        let words = line.and_then(|line| line.split_whitespace().next());
        most = words.and_then(|kib| kib.parse::<u64>().ok()).map_or(most, |kib| most.max(1024 * kib));
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    most
}

/// Mesa's software driver keeps a kernel for each dispatch of those that branch by uniforms alone (shaders/core/params.wgsl).
#[cfg(target_os = "linux")]
#[test]
fn frames_leave_nothing_in_memory() {
    if !can_draw() {
        return;
    }
    /// Of 400 dispatches or more; one that is kept takes half as much as 1 % of this.
    const MOST: u64 = 64 << 20;
    let folder = Folder::new();
    folder.write("m.toml", format!("{SCENE}{MANY_LIGHTS}"));
    for mode in ["path", "restir", "restir-2021"] {
        for bounces in ["1", "3", "9"] {
            let (mode, bounces) = (format!("integrator.mode=\"{mode}\""), format!("integrator.max_bounces={bounces}"));
            let sets = [&mode[..], &bounces, "volume.analytic=\"\"", "volume.resolution=32"];
            let common = ["render", "m.toml", "-o", "m.exr", "--frames", "3..3", "--spp", "1"];
            let sets: Vec<&str> = sets.into_iter().flat_map(|set| ["--set", set]).collect();
            let held = |repeats: &str| peak(&folder, &[&common[..], &sets, &["--repeat", repeats]].concat());
            let (few, many) = (held("1"), held("101"));
            assert!(many < few + MOST, "{mode}, {bounces}: {few} bytes, {many} after 100 more runs of 4 frames");
        }
    }
}
