//! Ctrl-C.

use std::time::{Duration, Instant};

use super::*;

#[cfg(unix)]
#[test]
fn ctrl_c_writes_what_there_is_and_is_130() {
    if !can_draw() {
        return;
    }
    let folder = scene_folder();
    let long = ["render", "s.toml", "-o", "a.exr", "--spp", "4000000000", "--stats", "a.json", "--aov", "samples"];
    let mut command = folder.command(&long);
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the program starts");
    // Long enough to be drawing; on a slow machine it may still set up, which ends in a picture of few samples.
    std::thread::sleep(Duration::from_millis(1500));
    let interrupt = Command::new("sh").arg("-c").arg(format!("kill -INT {}", child.id())).status();
    assert!(interrupt.expect("a shell").success());
    let begin = Instant::now();
    let run = Run::of(child.wait_with_output().expect("the program ends"));
    assert!(begin.elapsed() < Duration::from_secs(20), "it ends soon: {:?}", begin.elapsed());
    assert_eq!(run.code, 130, "{}", run.err);
    assert!(run.err.trim_end().ends_with("[interrupted]"), "{}", run.err);
    let samples = folder.json("a.json")["spp"].as_u64().expect("a count");
    assert!(run.err.contains(&samples.to_string()), "it says how many samples: {}", run.err);
    assert!(samples > 0);
    let image = folder.picture("a.exr").image;
    let least = image.layer("samples").expect("asked for").data.iter().copied().fold(f32::INFINITY, f32::min);
    assert_eq!(least as u64, samples);
    assert_eq!(folder.names(), ["a.exr", "a.json", "s.toml"], "no temporary file is left");
}
