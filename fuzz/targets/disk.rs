//! Bytes as a file, for the readers that take a path.

use std::path::PathBuf;
use std::sync::LazyLock;

static PATH: LazyLock<PathBuf> =
    LazyLock::new(|| std::env::temp_dir().join(format!("nephele-fuzz-{}", std::process::id())));

/// The path of a file that holds `bytes` until the next call.
pub fn file(bytes: &[u8]) -> &'static PathBuf {
    std::fs::write(&*PATH, bytes).expect("the temporary folder is writable");
    &PATH
}

/// Lets the readers catch panics of the decoders below them, as they do in the program: libFuzzer's own hook ends the
/// process first. A panic that nobody catches is a crash still.
pub fn let_panics_be_caught() {
    drop(std::panic::take_hook());
}
