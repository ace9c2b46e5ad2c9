//! Pictures that carry a scene (EXR, PNG, PFM): any bytes give a whole picture, or an error; what it carries is read.
#![no_main]

use std::path::Path;

use libfuzzer_sys::fuzz_target;
use nephele::io::picture;
use nephele::scene::Scene;

mod disk;

fuzz_target!(init: disk::let_panics_be_caught(), |bytes: &[u8]| {
    let path = disk::file(bytes);
    if let Ok(loaded) = picture::load(path) {
        assert_eq!(loaded.image.defect(), None);
    }
    if let Ok(Some(text)) = picture::read_scene(path) {
        let _ = Scene::parse(&text, "fuzzed", Path::new(""));
    }
});
