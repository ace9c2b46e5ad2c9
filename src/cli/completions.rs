//! `nephele completions`.

use std::io::Write;

use crate::error::{Error, Result};

/// Writes the completions of `shell` to `out`.
pub fn run(shell: clap_complete::Shell, command: &mut clap::Command, out: &mut dyn Write) -> Result<()> {
    let mut text = Vec::new();
    clap_complete::generate(shell, command, "nephele", &mut text);
    out.write_all(&text).map_err(|e| Error::writing("standard output".as_ref(), &e))
}
