//! OpenVDB files: any bytes give grids that can be used, or an error; no grid is larger than the file can justify.
#![no_main]

use libfuzzer_sys::fuzz_target;

mod grids;

/// Bytes of a grid per byte of its file at most, as `io::vdb` promises.
const MAX_EXPANSION: usize = 128;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(file) = nephele::io::vdb::read(bytes) {
        grids::use_all(&file, MAX_EXPANSION * bytes.len());
    }
});
