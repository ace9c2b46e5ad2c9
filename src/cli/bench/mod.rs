//! `nephele bench`: how fast the program is on this machine, as ratios that hold from one machine to the next.
//!
//! The sides of a ratio are measured in turn, several times, in one run, so that other work on the machine meets both.
//! On a software adapter time is the CPU time of the process, elsewhere wall time.

use std::io::Write;
use std::path::{Path, PathBuf};

use crate::error::{Error, Result};
use crate::io::picture::write_whole;

mod chart;
mod clock;
mod kernel;
mod report;
mod twin;

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Name {
    /// The path tracer against a bare tracking kernel, majorants, estimators
    Kernel,
}

/// Flags of `bench`.
#[derive(Debug, clap::Args)]
pub struct BenchArgs {
    /// What to measure
    #[arg(value_enum)]
    pub name: Name,
    /// Write figures, raw rounds and a plot to a folder
    #[arg(short, long, value_name = "DIR")]
    pub output: Option<PathBuf>,
    /// Write the figures as JSON
    #[arg(long, value_name = "FILE")]
    pub json: Option<PathBuf>,
    /// Only the small volume, fewer rounds
    #[arg(long)]
    pub quick: bool,
}

/// Measures and writes the table to `out`, progress to stderr where that is a terminal.
pub fn run(args: &BenchArgs, out: &mut dyn Write) -> Result<()> {
    let report = match args.name {
        Name::Kernel => kernel::measure(args.quick)?,
    };
    out.write_all(report.table().as_bytes()).map_err(|e| Error::writing("standard output".as_ref(), &e))?;
    let json = format!("{:#}\n", report.to_json());
    if let Some(path) = &args.json {
        write(path, &json)?;
    }
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::writing(folder, &e))?;
        write(&folder.join("kernel.json"), &json)?;
        write(&folder.join("kernel.csv"), &report.to_csv())?;
        write(&folder.join("kernel.svg"), &chart::svg(&report))?;
    }
    Ok(())
}

fn write(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |f| f.write_all(text.as_bytes()))
}
