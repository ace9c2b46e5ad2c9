//! The command line: every command, its flags, and how errors reach the user.

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;
use std::time::Instant;

use clap::{Args, CommandFactory, Parser, Subcommand};

use crate::app::prefs::Prefs;
use crate::app::shell;
use crate::error::{Code, Error, Result};
use crate::input;
use crate::scene::Scene;

pub mod bench;
pub mod compare;
pub mod completions;
pub mod doctor;
pub mod info;
pub mod render;
pub mod settings;

/// An interactive, unbiased volume path tracer. Without a command: the window.
#[derive(Debug, Parser)]
#[command(name = "nephele", version, args_conflicts_with_subcommands = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    view: ViewArgs,
}

const EXAMPLES: &str = "\
Examples:
  nephele cloud.vdb                            open a cloud in the window
  nephele render cloud.vdb -o cloud.exr        draw it without a window
  nephele render shot.png -o big.png --size 3840x2160 --spp 1024
  nephele info cloud.vdb                       what is in the file";

#[derive(Debug, Subcommand)]
enum Command {
    /// Open the window
    View(ViewArgs),
    /// Draw a picture or a sequence without a window
    Render(render::RenderArgs),
    /// Say what volume files hold
    Info(InfoFlags),
    /// Compare a picture with a reference
    Compare(CompareFlags),
    /// Measure how fast the program is on this machine
    Bench(bench::BenchArgs),
    /// Say what graphics there is, what is missing, and test it
    Doctor(doctor::DoctorArgs),
    /// List every setting
    Settings(settings::SettingsArgs),
    /// Print completions for a shell
    Completions {
        /// bash, zsh, fish or powershell
        shell: clap_complete::Shell,
    },
}

/// Flags of `view`.
#[derive(Clone, Debug, Args)]
pub struct ViewArgs {
    /// A scene (.toml), a volume (.vdb, .nvdb), or a picture that nephele saved
    pub input: Option<PathBuf>,
    /// Orbit once, print the timings, and end
    #[arg(long, value_name = "NAME", value_parser = ["orbit"])]
    pub benchmark: Option<String>,
    /// Frames of the benchmark
    #[arg(long, value_name = "N", default_value_t = 120, value_parser = clap::value_parser!(u32).range(1..), requires = "benchmark")]
    pub frames: u32,
    /// Write the benchmark's figures to a file
    #[arg(long, value_name = "FILE", requires = "benchmark")]
    pub json: Option<PathBuf>,
}

#[derive(Debug, Args)]
struct InfoFlags {
    /// Volume files
    #[arg(required = true)]
    files: Vec<PathBuf>,
    /// As JSON
    #[arg(long)]
    json: bool,
    /// Only this grid: a name, or #2 for the third
    #[arg(long, value_name = "NAME")]
    grid: Option<String>,
    /// Read lines `i j k` of index coordinates from a file (- for standard input); answer one value a line
    #[arg(long, value_name = "FILE", requires = "grid")]
    at: Option<String>,
}

#[derive(Debug, Args)]
struct CompareFlags {
    /// The picture
    a: PathBuf,
    /// The reference
    b: PathBuf,
    /// As JSON
    #[arg(long)]
    json: bool,
    /// Exit with 5 if relMSE is larger
    #[arg(long, value_name = "X")]
    max_relmse: Option<f64>,
}

/// Runs the program; `start` is when it began.
pub fn main(start: Instant) -> ExitCode {
    let mut builder = env_logger::Builder::new();
    builder.parse_filters(&std::env::var("NEPHELE_LOG").unwrap_or_else(|_| "off".into())).init();
    let cli = match Cli::try_parse() {
        Ok(cli) => cli,
        Err(e) if e.use_stderr() => return usage_error(&e),
        // Help and version.
        Err(e) => e.exit(),
    };
    let (out, err) = (&mut std::io::stdout(), &mut std::io::stderr());
    let result = match cli.command {
        None => view(cli.view, start),
        Some(Command::View(args)) => view(args, start),
        Some(Command::Render(args)) => render::run(&args, start),
        Some(Command::Info(f)) => {
            let args = info::InfoArgs { files: f.files, json: f.json, grid: f.grid, at: f.at };
            return ExitCode::from(info::run(&args, out, err));
        }
        Some(Command::Compare(f)) => {
            let args = compare::CompareArgs { a: f.a, b: f.b, json: f.json, max_relmse: f.max_relmse };
            return ExitCode::from(compare::run(&args, out, err));
        }
        Some(Command::Bench(args)) => bench::run(&args, out),
        Some(Command::Doctor(args)) => doctor::run(&args, out),
        Some(Command::Settings(args)) => settings::run(&args, out),
        Some(Command::Completions { shell }) => completions::run(shell, &mut Cli::command(), out),
    };
    let _ = out.flush();
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(error.code.exit())
        }
    }
}

/// One message for a command line that does not fit, as for every other error; on stdout too where JSON was asked for.
fn usage_error(e: &clap::Error) -> ExitCode {
    let text = e.to_string();
    let mut lines = text.lines().map(str::trim).filter(|l| !l.is_empty());
    let what = lines.next().unwrap_or("The command line does not fit.").trim_start_matches("error: ").to_owned();
    let hints: Vec<&str> =
        lines.filter(|l| l.starts_with("tip:") || l.starts_with('<') || l.starts_with('-')).collect();
    let error = Error::new(Code::BadKey, what).why(hints.join(" ")).hint("`nephele --help` lists commands and flags.");
    eprintln!("{error}");
    if std::env::args().any(|a| a == "--json") {
        println!("{}", serde_json::json!({ "error": error.to_json() }));
    }
    ExitCode::from(error.code.exit())
}

/// Opens the window.
fn view(args: ViewArgs, start: Instant) -> Result<()> {
    let scene = match &args.input {
        Some(path) => input::open(path)?,
        None => Scene::default(),
    };
    let benchmark = args.benchmark.map(|_| shell::Benchmark { frames: args.frames, json: args.json, start });
    let prefs = if benchmark.is_some() { Prefs::default() } else { Prefs::load() };
    shell::run(scene, prefs, Vec::new(), benchmark)
}
