//! Scene files and `--set`: any text gives a scene or an error, and a scene that was read is written and read again the
//! same.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nephele::scene::Scene;

fuzz_target!(|text: &str| {
    let folder = Path::new("");
    for assignment in text.lines().take(8) {
        let _ = Scene::default().set(assignment, folder);
    }
    let Ok(scene) = Scene::parse(text, "fuzzed", folder) else { return };
    let written = scene.to_toml(folder);
    match Scene::parse(&written, "written", folder) {
        Ok(again) => assert_eq!(again, scene, "{written}"),
        Err(error) => panic!("{error}\n{written}"),
    }
    for frame in [0.0, 0.5, 1e6] {
        let _ = scene.at_frame(frame);
    }
});
