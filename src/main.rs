//! The program; everything is in the library.

use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    nephele::cli::main(Instant::now())
}
