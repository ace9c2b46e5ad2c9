//! The built program as its users run it: exit codes, messages, files and figures of the contract.

use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};
use std::sync::LazyLock;

use nephele::io::picture::{self, Loaded};
use serde_json::Value;

mod bench;
mod doctor;
mod exit;
mod info;
mod pictures;
mod sequences;
mod stop;
mod text;

#[allow(dead_code)] // the reader's own tests use all of it
#[path = "../../src/io/vdb/writer.rs"]
mod vdb;

/// A temporary folder to run the program in.
struct Folder(tempfile::TempDir);

/// What a run of the program did.
struct Run {
    code: i32,
    out: String,
    err: String,
}

impl Folder {
    fn new() -> Folder {
        Folder(tempfile::tempdir().expect("a temporary folder"))
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = self.path(name);
        std::fs::create_dir_all(path.parent().expect("it lies in the folder")).expect("a writable folder");
        std::fs::write(&path, bytes).expect("a writable folder");
        path
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }

    fn names(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.0.path()).expect("a readable folder");
        let mut names: Vec<String> = entries.flatten().map(|e| e.file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }

    /// The program, not yet started; its own environment variables are unset.
    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_nephele"));
        command.args(arguments).current_dir(self.0.path()).stdin(Stdio::null());
        for name in ["NEPHELE_LOG", "NEPHELE_CONFIG_DIR", "NO_COLOR", "CLICOLOR_FORCE"] {
            command.env_remove(name);
        }
        // Drivers complain on stderr where this names no folder.
        command.env("XDG_RUNTIME_DIR", self.0.path());
        command
    }

    fn run(&self, arguments: &[&str]) -> Run {
        Run::of(self.command(arguments).output().expect("the program starts"))
    }

    /// Runs and expects success.
    fn ok(&self, arguments: &[&str]) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, 0, "{arguments:?}: {}{}", run.out, run.err);
        run
    }

    /// Runs and expects that exit code and one message that ends with that code, of one to three lines.
    fn fails(&self, arguments: &[&str], code: i32, name: &str) -> Run {
        let run = self.run(arguments);
        assert_eq!(run.code, code, "{arguments:?}: {}{}", run.out, run.err);
        let message = run.err.trim_end();
        assert!(message.ends_with(&format!("[{name}]")), "{arguments:?}: {message}");
        assert!((1..=3).contains(&message.lines().count()), "one message of one to three lines: {message}");
        assert!(!message.contains('\u{1b}'), "no colours where nobody looks: {message}");
        run
    }

    fn picture(&self, name: &str) -> Loaded {
        picture::load(&self.path(name)).unwrap_or_else(|e| panic!("{e}"))
    }

    fn json(&self, name: &str) -> Value {
        serde_json::from_slice(&self.read(name)).unwrap_or_else(|e| panic!("{name}: {e}"))
    }
}

impl Run {
    fn of(output: Output) -> Run {
        let text = |bytes: &[u8]| String::from_utf8(bytes.to_vec()).expect("the program writes UTF-8");
        Run { code: output.status.code().unwrap_or(-1), out: text(&output.stdout), err: text(&output.stderr) }
    }

    fn json(&self) -> Value {
        serde_json::from_str(&self.out).unwrap_or_else(|e| panic!("no JSON ({e}): {}", self.out))
    }
}

/// A small scene that is quick to draw: a homogeneous cube in one sun and a constant sky.
const SCENE: &str = "\
version = 1
[volume]
analytic = \"homogeneous\"
[medium]
density_scale = 2.0
albedo = [0.9, 0.8, 0.7]
[film]
width = 12
height = 8
";

/// Whether the program finds an adapter; without one, tests that draw are skipped, but not in CI.
fn can_draw() -> bool {
    static FOUND: LazyLock<bool> = LazyLock::new(|| {
        let folder = Folder::new();
        folder.write("s.toml", SCENE);
        let run = folder.run(&["render", "s.toml", "-o", "s.pfm", "--spp", "1"]);
        assert!(run.code == 0 || run.code == 4, "{}", run.err);
        assert!(run.code == 0 || std::env::var_os("CI").is_none(), "CI draws on a software adapter: {}", run.err);
        run.code == 0
    });
    if !*FOUND {
        eprintln!("skipped: no adapter");
    }
    *FOUND
}

/// A folder with the small scene in `s.toml`.
fn scene_folder() -> Folder {
    let folder = Folder::new();
    folder.write("s.toml", SCENE);
    folder
}

/// A small OpenVDB file: one leaf with a gradient and a tile, of which `density` and `heat` grids are made.
fn volume(names: &[&str]) -> Vec<u8> {
    let mut tree = vdb::Sketch::default();
    tree.leaves.insert([0, 0, 0], (0..512).map(|n| (f64::from(n % 8) / 8.0, n % 8 != 0)).collect());
    tree.tiles.insert((8, [8, 0, 0]), (0.5, true));
    let grids: Vec<vdb::GridSpec> =
        names.iter().map(|name| vdb::GridSpec::new(name, vdb::Format::default(), tree.clone())).collect();
    vdb::file(&grids)
}

/// Whether two files hold the same picture, bit for bit, layers and all.
fn same_pixels(a: &Loaded, b: &Loaded) -> bool {
    let bits = |l: &Loaded| -> Vec<Vec<u32>> {
        l.image.layers.iter().map(|l| l.data.iter().map(|x| x.to_bits()).collect()).collect()
    };
    (a.image.width, a.image.height) == (b.image.width, b.image.height) && bits(a) == bits(b)
}

fn is_whole(path: &Path) -> bool {
    picture::load(path).is_ok()
}
