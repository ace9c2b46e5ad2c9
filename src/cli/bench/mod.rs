//! `nephele bench`: how fast the program is on this machine, as ratios that hold from one machine to the next.
//!
//! The sides of a ratio are measured in turn, several times, in one run, so that other work on the machine meets both.
//! On a software adapter time is the CPU time of the process, elsewhere wall time.

use std::io::{IsTerminal, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;

use crate::error::{Code, Error, Result};
use crate::io::picture::write_whole;

mod chart;
mod clock;
mod kernel;
mod report;
mod reuse;
mod trace;
mod tracking;
mod twin;

/// What can be measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Name {
    /// The path tracer against a bare tracking kernel, majorants, what settings cost
    Kernel,
    /// Every free flight, transmittance and bound: work, noise and efficiency
    Tracking,
    /// Reuse of paths against the path tracer at equal time: error, correlation, cost
    Reuse,
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
    /// Fewer volumes and rounds: a minute or two (`reuse`: ten)
    #[arg(long)]
    pub quick: bool,
    /// `tracking`, `reuse`: measure on this volume, a name or a file, in place of the usual ones; may be given again
    #[arg(long, value_name = "VOLUME")]
    pub volume: Vec<String>,
    /// `tracking`: pixels along a side of the picture; `reuse`: along its width
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(8..=1024))]
    pub size: Option<u32>,
}

/// A file of a report: its name and text.
type Files = Vec<(String, String)>;

/// Measures and writes the table to `out`, progress to stderr where that is a terminal.
pub fn run(args: &BenchArgs, out: &mut dyn Write) -> Result<()> {
    let (table, json, files): (String, serde_json::Value, Files) = match args.name {
        Name::Kernel => {
            if !args.volume.is_empty() || args.size.is_some() {
                return Err(Error::new(Code::BadKey, "`bench kernel` takes no --volume and no --size.")
                    .why("Its aims hold for the cumulus in a picture of 256 × 256 pixels.")
                    .hint("Leave them out, or run `nephele bench tracking` or `nephele bench reuse`."));
            }
            let report = kernel::measure(args.quick)?;
            let files = vec![("kernel.csv".into(), report.to_csv()), ("kernel.svg".into(), chart::svg(&report))];
            (report.table(), report.to_json(), files)
        }
        Name::Tracking => {
            let report = tracking::measure(args.quick, &args.volume, args.size)?;
            let mut files = vec![("tracking.csv".into(), report.to_csv())];
            files.extend(tracking::chart::all(&report));
            (report.table(), report.to_json(), files)
        }
        Name::Reuse => {
            let report = reuse::measure(args.quick, &args.volume, args.size)?;
            let mut files = vec![("reuse.csv".into(), report.to_csv())];
            files.extend(reuse::chart::all(&report));
            (report.table(), report.to_json(), files)
        }
    };
    out.write_all(table.as_bytes()).map_err(|e| Error::writing("standard output".as_ref(), &e))?;
    let json = format!("{json:#}\n");
    if let Some(path) = &args.json {
        write(path, &json)?;
    }
    if let Some(folder) = &args.output {
        std::fs::create_dir_all(folder).map_err(|e| Error::writing(folder, &e))?;
        let name = args.name.to_possible_value().expect("no name is hidden");
        write(&folder.join(format!("{}.json", name.get_name())), &json)?;
        for (name, text) in files {
            write(&folder.join(name), &text)?;
        }
    }
    Ok(())
}

/// One line on a terminal in place of the last; an empty one clears it.
fn progress(text: &str) {
    if std::io::stderr().is_terminal() {
        eprint!("\r\x1b[2K{text}");
    }
}

/// A bar of the share that is done, and what is done now.
fn bar(share: f64, what: &str) -> String {
    const BAR: usize = 24;
    let full = (share.clamp(0.0, 1.0) * BAR as f64) as usize;
    format!("[{}{}] {:3.0} % {what}", "█".repeat(full), "·".repeat(BAR - full), 100.0 * share)
}

fn write(path: &Path, text: &str) -> Result<()> {
    write_whole(path, |f| f.write_all(text.as_bytes()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_bar_fills() {
        assert_eq!(bar(0.0, "a"), format!("[{}]   0 % a", "·".repeat(24)));
        assert_eq!(bar(0.5, "b"), format!("[{}{}]  50 % b", "█".repeat(12), "·".repeat(12)));
        assert_eq!(bar(1.0, "c"), format!("[{}] 100 % c", "█".repeat(24)));
    }
}
