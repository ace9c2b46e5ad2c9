//! Environment maps, OpenEXR and Radiance: any bytes give a map of finite texels and its sampling table, or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use nephele::io::hdr;
use nephele::light::environment::AliasTable;

mod disk;

fuzz_target!(init: disk::let_panics_be_caught(), |bytes: &[u8]| {
    if let Ok((map, _)) = hdr::load(disk::file(bytes)) {
        assert_eq!(map.texels.len(), map.width as usize * map.height as usize);
        assert!(map.texels.iter().flatten().all(|x| x.is_finite() && *x >= 0.0), "a texel that was not repaired");
        AliasTable::new(&map);
    }
});
