//! NanoVDB files: any bytes give grids that can be used, or an error; no grid is larger than the file can justify.
#![no_main]

use libfuzzer_sys::fuzz_target;

mod grids;

/// Bytes of a grid per byte of its file at most: deflate makes 1032 of one, an inactive or quantised value of half a
/// byte becomes four, or eight with its place.
const MAX_EXPANSION: usize = 1032 * 16;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(file) = nephele::io::nvdb::read(bytes) {
        grids::use_all(&file, MAX_EXPANSION * bytes.len());
    }
});
