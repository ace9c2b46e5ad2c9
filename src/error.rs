//! One error type for the whole program: what happened, why, what to do, and a code.
//!
//! An error is made where the cause is known and handled once, at the top: the command line prints it and exits with
//! [`Code::exit`], the window shows it as a toast. Nothing in between prints.

use std::fmt;

/// The kind of an error or warning; names as in the message table of the user guide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Code {
    /// A file that does not exist.
    NotFound,
    /// A file that the system does not let us read.
    Denied,
    /// First bytes of no known format.
    UnknownFormat,
    /// A Git LFS pointer or a web page in place of data.
    PointerFile,
    /// Damaged or truncated data.
    Corrupt,
    /// A format version that this build does not read.
    Version,
    /// A codec, grid type or transform that this build does not draw.
    Unsupported,
    /// The grid that was asked for is not in the file.
    NoDensityGrid,
    /// Several grids could be the density.
    ManyGrids,
    /// An environment map that cannot be read.
    BadHdri,
    /// An error of a scene or of the command line.
    BadKey,
    /// No graphics adapter at all.
    NoAdapter,
    /// More data than the adapter or memory takes.
    TooLarge,
    /// The adapter ran out of memory.
    Oom,
    /// The graphics device went away.
    DeviceLost,
    /// No window system.
    NoDisplay,
    /// A shader that does not build.
    Shader,
    /// A file that cannot be written.
    Write,
    /// `compare` found more than was allowed.
    Different,
    /// The user stopped the program.
    Interrupted,
    /// Anything else that fails while running.
    Failed,
}

impl Code {
    /// The name in messages and JSON.
    pub fn name(self) -> &'static str {
        match self {
            Code::NotFound => "not_found",
            Code::Denied => "denied",
            Code::UnknownFormat => "unknown_format",
            Code::PointerFile => "pointer_file",
            Code::Corrupt => "corrupt",
            Code::Version => "version",
            Code::Unsupported => "unsupported",
            Code::NoDensityGrid => "no_density_grid",
            Code::ManyGrids => "many_grids",
            Code::BadHdri => "bad_hdri",
            Code::BadKey => "bad_key",
            Code::NoAdapter => "no_adapter",
            Code::TooLarge => "too_large",
            Code::Oom => "oom",
            Code::DeviceLost => "device_lost",
            Code::NoDisplay => "no_display",
            Code::Shader => "shader",
            Code::Write => "write",
            Code::Different => "different",
            Code::Interrupted => "interrupted",
            Code::Failed => "failed",
        }
    }

    /// The exit status of the program that ends with this error.
    pub fn exit(self) -> u8 {
        match self {
            Code::BadKey => 2,
            Code::NotFound
            | Code::Denied
            | Code::UnknownFormat
            | Code::PointerFile
            | Code::Corrupt
            | Code::Version
            | Code::Unsupported
            | Code::NoDensityGrid
            | Code::ManyGrids
            | Code::BadHdri => 3,
            Code::NoAdapter => 4,
            Code::Different => 5,
            Code::Interrupted => 130,
            Code::TooLarge
            | Code::Oom
            | Code::DeviceLost
            | Code::NoDisplay
            | Code::Shader
            | Code::Write
            | Code::Failed => 1,
        }
    }
}

/// A message of one to three lines: what, why, what to do.
#[derive(Clone, Debug, PartialEq)]
pub struct Error {
    /// The kind.
    pub code: Code,
    /// What happened, with the file or key and the value.
    pub what: String,
    /// Why; empty if there is nothing to add.
    pub why: String,
    /// What to do; empty if there is nothing to add.
    pub hint: String,
}

/// The result of everything here that can fail.
pub type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// An error with only the first line.
    pub fn new(code: Code, what: impl Into<String>) -> Error {
        Error { code, what: what.into(), why: String::new(), hint: String::new() }
    }

    /// Adds the second line.
    pub fn why(mut self, why: impl Into<String>) -> Error {
        self.why = why.into();
        self
    }

    /// Adds the third line.
    pub fn hint(mut self, hint: impl Into<String>) -> Error {
        self.hint = hint.into();
        self
    }

    /// The error for a failed read of `path`.
    pub fn reading(path: &std::path::Path, e: &std::io::Error) -> Error {
        let (code, hint) = match e.kind() {
            std::io::ErrorKind::NotFound => (Code::NotFound, "Check the name and the folder."),
            std::io::ErrorKind::PermissionDenied => (Code::Denied, "Change its permissions."),
            _ => (Code::Denied, "Check that it is a readable file."),
        };
        Error::new(code, format!("Cannot open {}.", path.display())).why(sentence(&e.to_string())).hint(hint)
    }

    /// The error for a failed write of `path`.
    pub fn writing(path: &std::path::Path, e: &std::io::Error) -> Error {
        Error::new(Code::Write, format!("Cannot write {}.", path.display()))
            .why(sentence(&e.to_string()))
            .hint("Choose another folder or free some space.")
    }
}

impl Error {
    /// As the object that `--json` puts under `error`.
    pub fn to_json(&self) -> serde_json::Value {
        let message = format!("{} {}", self.what, self.why);
        serde_json::json!({ "code": self.code.name(), "message": message.trim(), "hint": self.hint })
    }
}

/// `text` as a sentence: first letter large, a full stop at the end.
fn sentence(text: &str) -> String {
    let mut chars = text.chars();
    let first: String = chars.next().map(|c| c.to_uppercase().collect()).unwrap_or_default();
    format!("{first}{}.", chars.as_str().trim_end_matches('.'))
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let lines: Vec<&str> =
            [&*self.what, &*self.why, &*self.hint].into_iter().filter(|line| !line.is_empty()).collect();
        write!(f, "{} [{}]", lines.join("\n"), self.code.name())
    }
}

impl std::error::Error for Error {}

/// Something the user should know that did not stop the work.
#[derive(Clone, Debug, PartialEq)]
pub struct Warning {
    /// A short name: `empty_grid`, `level_set`, `bad_values`, `scale`, `software`, `limits`, `background`, …
    pub code: &'static str,
    /// One plain sentence.
    pub text: String,
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} [{}]", self.text, self.code)
    }
}
