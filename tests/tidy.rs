//! The rules of the house, from the sources alone: floors, texts, files. What shaders must hold beyond that is in
//! `tests/shaders.rs`.
//!
//! A comment `tidy: allow(rule) reason` silences one rule on its own line and the next (`length`: for the file); one that
//! silences nothing is an error.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;

/// Lines that a Rust file stays below.
const MAX_LINES: usize = 600;
/// Bytes of the largest file that needs no row in assets/README.md.
const MAX_BYTES: u64 = 1 << 20;
/// Where printing is the task; elsewhere it is the caller who decides what a person sees.
const PRINTERS: [&str; 2] = ["src/cli/", "src/main.rs"];
/// Macros that are left behind by work in progress.
const LEFTOVERS: [&str; 3] = ["dbg!", "todo!", "unimplemented!"];
/// First folders of paths that exist on one machine only.
const MACHINE_FOLDERS: [&str; 5] = ["home", "root", "work", "Users", "tmp"];
/// Hosts that files may name: the name space of SVG, the magic of pointer files, licences of assets, and the index that
/// Cargo.lock names.
const HOSTS: [&str; 4] =
    ["www.w3.org", "git-lfs.github.com", "creativecommons.org", "github.com/rust-lang/crates.io-index"];

/// A line of a text file.
#[derive(Default)]
struct Line {
    /// All of it.
    raw: String,
    /// Without comments and what stands in quotes; all of it where the language is not read.
    code: String,
    /// The comment, from its first slash; all of the line where the language is not read.
    comment: String,
}

/// A text file of the tree.
struct File {
    /// From the root, with slashes.
    path: String,
    lines: Vec<Line>,
    /// Whether the last line has an end.
    ended: bool,
}

/// Line (from 1) and what is wrong there.
type Finding = (usize, String);

/// A rule by its name in opt-outs.
type Rule = (&'static str, fn(&File) -> Vec<Finding>);

/// The rules that look at one file.
const RULES: [Rule; 8] = [
    ("text", text),
    ("length", length),
    ("print", print),
    ("leftover", leftover),
    ("safety", safety),
    ("fixme", fixme),
    ("path", machine_path),
    ("host", host),
];

impl File {
    fn new(path: &str, text: &str) -> File {
        let raw: Vec<&str> = text.split('\n').collect();
        let ended = raw.last() == Some(&"");
        let raw = &raw[..raw.len() - usize::from(ended)];
        let mut lines: Vec<Line> = raw.iter().map(|l| Line { raw: (*l).to_owned(), ..Line::default() }).collect();
        if path.ends_with(".rs") || path.ends_with(".wgsl") {
            split(&mut lines);
        } else {
            for line in &mut lines {
                (line.code, line.comment) = (line.raw.clone(), line.raw.clone());
            }
        }
        File { path: path.to_owned(), lines, ended }
    }

    fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// A finding for each line of which `look` says something.
    fn each(&self, look: impl Fn(usize, &Line) -> Option<String>) -> Vec<Finding> {
        self.lines.iter().enumerate().filter_map(|(i, line)| Some((i + 1, look(i, line)?))).collect()
    }
}

/// Fills code and comments of Rust (or WGSL, which has neither quotes nor lifetimes).
fn split(lines: &mut [Line]) {
    enum State {
        Code,
        /// Depth of `/* */`.
        Block(usize),
        Quoted,
        /// What ends it: a quote and signs `#`.
        Raw(String),
    }
    let mut state = State::Code;
    for line in lines {
        let chars: Vec<char> = line.raw.chars().collect();
        let starts = |at: usize, what: &str| chars[at..].iter().take(what.len()).copied().eq(what.chars());
        let mut at = 0;
        while at < chars.len() {
            let c = chars[at];
            match &mut state {
                State::Block(depth) => {
                    line.comment.push(c);
                    if starts(at, "*/") || starts(at, "/*") {
                        line.comment.push(chars[at + 1]);
                        *depth = if c == '*' { *depth - 1 } else { *depth + 1 };
                        at += 1;
                    }
                    if *depth == 0 {
                        state = State::Code;
                    }
                }
                State::Quoted if c == '\\' => at += 1,
                State::Quoted if c == '"' => state = State::Code,
                State::Raw(end) if starts(at, end) => {
                    at += end.len() - 1;
                    state = State::Code;
                }
                State::Quoted | State::Raw(_) => {}
                State::Code if starts(at, "//") => {
                    line.comment.extend(&chars[at..]);
                    break;
                }
                State::Code if starts(at, "/*") => {
                    line.comment.push_str("/*");
                    at += 1;
                    state = State::Block(1);
                }
                State::Code => {
                    line.code.push(c);
                    let hashes = chars[at + 1..].iter().take_while(|c| **c == '#').count();
                    let word_before = at > 0 && is_word(chars[at - 1]) && chars[at - 1] != 'b';
                    if c == 'r' && !word_before && chars.get(at + 1 + hashes) == Some(&'"') {
                        state = State::Raw(format!("\"{}", "#".repeat(hashes)));
                        at += 1 + hashes;
                    } else if c == '"' {
                        state = State::Quoted;
                    } else if c == '\'' && chars.get(at + 1) == Some(&'\\') {
                        // '\n', '\'', '\u{1b}': the quote that ends it comes after the escaped sign.
                        at += 2 + chars[at + 3..].iter().position(|c| *c == '\'').unwrap_or(0) + 1;
                    } else if c == '\'' && chars.get(at + 2) == Some(&'\'') {
                        at += 2;
                    }
                }
            }
            at += 1;
        }
    }
}

fn is_word(c: char) -> bool {
    c.is_alphanumeric() || c == '_'
}

/// Whether `word` stands in `text`, not as the end or the beginning of a longer one.
fn has_word(text: &str, word: &str) -> bool {
    text.match_indices(word).any(|(at, _)| {
        let longer_after = word.ends_with(is_word) && text[at + word.len()..].starts_with(is_word);
        !text[..at].ends_with(is_word) && !longer_after
    })
}

/// No tabs, carriage returns or spaces at the end of a line; the last line ends.
fn text(file: &File) -> Vec<Finding> {
    if file.path.contains("LICENSE") {
        return Vec::new(); // as their authors wrote them
    }
    let mut found = file.each(|_, line| {
        let raw = &line.raw;
        (raw.contains(['\t', '\r']) || raw.ends_with(' '))
            .then(|| "a tab, a carriage return or a space at the end".into())
    });
    if !file.ended {
        found.push((file.lines.len(), "the last line has no end".into()));
    }
    found
}

/// Rust files are short; for shaders see `tests/shaders.rs`.
fn length(file: &File) -> Vec<Finding> {
    let lines = file.lines.len();
    let long = file.is_rust() && lines >= MAX_LINES;
    long.then(|| (1, format!("{lines} lines, {MAX_LINES} or more: split it by role"))).into_iter().collect()
}

/// The library does not print; its tests may say why they skip.
fn print(file: &File) -> Vec<Finding> {
    let is_test = file.path.ends_with("/tests.rs") || file.path.contains("/tests/");
    if !file.path.starts_with("src/") || is_test || PRINTERS.iter().any(|p| file.path.starts_with(p)) {
        return Vec::new();
    }
    let printing = ["println!", "eprintln!", "print!", "eprint!"];
    file.each(|_, line| {
        let name = printing.into_iter().find(|name| has_word(&line.code, name))?;
        Some(format!("{name} in the library: return it, or use log"))
    })
}

/// Nothing of work in progress.
fn leftover(file: &File) -> Vec<Finding> {
    if !file.is_rust() {
        return Vec::new();
    }
    file.each(|_, line| {
        Some(format!("{} is left over", LEFTOVERS.into_iter().find(|name| has_word(&line.code, name))?))
    })
}

/// Each `unsafe` says why it is sound, on its line or in the comment right above.
fn safety(file: &File) -> Vec<Finding> {
    if !file.is_rust() {
        return Vec::new();
    }
    file.each(|at, line| {
        let above = file.lines[..at].iter().rev().take_while(|l| {
            let code = l.code.trim();
            (code.is_empty() && !l.comment.is_empty()) || code.starts_with("#[")
        });
        let told = std::iter::once(line).chain(above).any(|l| l.comment.contains("SAFETY:"));
        (has_word(&line.code, "unsafe") && !told).then(|| "unsafe without a comment SAFETY: right above".into())
    })
}

/// What is known to be wrong has an issue.
fn fixme(file: &File) -> Vec<Finding> {
    let [fix, plan] = [concat!("FIX", "ME"), concat!("TO", "DO")];
    file.each(|_, line| {
        if has_word(&line.comment, plan) {
            return Some(format!("{plan}: do it, or write {fix}(#issue)"));
        }
        let (_, after) = line.comment.split_once(fix)?;
        let numbered = after.strip_prefix("(#").is_some_and(|rest| rest.starts_with(|c: char| c.is_ascii_digit()));
        (!numbered).then(|| format!("{fix} without an issue: {fix}(#12)"))
    })
}

/// No paths of one machine.
fn machine_path(file: &File) -> Vec<Finding> {
    file.each(|_, line| {
        let folder = MACHINE_FOLDERS.iter().find(|folder| {
            let (unix, windows) = (format!("/{folder}/"), format!(":\\{folder}\\"));
            let here = |(at, _)| !line.raw[..at].ends_with(|c| is_word(c) || ".-}*".contains(c));
            line.raw.match_indices(&unix).any(here) || line.raw.contains(&windows)
        })?;
        Some(format!("a path of one machine, below {folder}"))
    })
}

/// No hosts but [`HOSTS`], so that no registry or mirror of one machine gets in.
fn host(file: &File) -> Vec<Finding> {
    if file.path.contains("LICENSE") {
        return Vec::new();
    }
    file.each(|_, line| {
        line.raw.split("://").skip(1).find_map(|rest| {
            let known = HOSTS.iter().any(|host| {
                rest.strip_prefix(host).is_some_and(|after| !after.starts_with(|c| is_word(c) || ".-:@".contains(c)))
            });
            let host: String = rest.chars().take_while(|c| is_word(*c) || ".-:@".contains(*c)).collect();
            (!known && !host.is_empty()).then(|| {
                format!("the host {host} is none of HOSTS in tests/tidy.rs; add it there if it is no registry")
            })
        })
    })
}

/// Floor of each module by the table of ARCHITECTURE.md: `| 2 | `src/io/` | …`.
fn floors(architecture: &str) -> BTreeMap<String, u32> {
    let mut floors = BTreeMap::new();
    for line in architecture.lines() {
        let cells: Vec<&str> = line.split('|').map(str::trim).collect();
        let [_, floor, modules, ..] = cells[..] else { continue };
        let Ok(floor) = floor.parse() else { continue };
        for path in modules.split('`').skip(1).step_by(2) {
            floors.insert(module(path).unwrap_or(path).to_owned(), floor);
        }
    }
    floors
}

/// The top module that a path of `src/` belongs to; `lib.rs` only lists them.
fn module(path: &str) -> Option<&str> {
    let inside = path.strip_prefix("src/")?;
    let name = inside.split('/').next()?;
    let name = name.strip_suffix(".rs").unwrap_or(name);
    (name != "lib").then_some(name)
}

/// The modules that a file names by `crate::x` or `crate::{x, …}` (the program: `nephele::x`), with their lines.
fn uses(file: &File) -> Vec<(usize, String)> {
    let root = if file.path == "src/main.rs" { "nephele::" } else { "crate::" };
    let mut found = Vec::new();
    for (i, line) in file.lines.iter().enumerate() {
        for (at, _) in line.code.match_indices(root).filter(|(at, _)| !line.code[..*at].ends_with(is_word)) {
            let mut rest = line.code[at + root.len()..].to_owned();
            rest.extend(file.lines[i + 1..].iter().take_while(|_| line.code.ends_with('{')).map(|l| l.code.as_str()));
            let Some(list) = rest.strip_prefix('{') else {
                found.push((i + 1, rest.chars().take_while(|c| is_word(*c)).collect()));
                continue;
            };
            let (mut depth, mut items) = (1, vec![String::new()]);
            for c in list.chars() {
                depth = if c == '{' { depth + 1 } else { depth - usize::from(c == '}') };
                match (depth, c) {
                    (0, _) => break,
                    (1, ',') => items.push(String::new()),
                    _ => items.last_mut().expect("it begins with one").push(c),
                }
            }
            let first = |item: &String| item.trim().chars().take_while(|c| is_word(*c)).collect::<String>();
            found.extend(items.iter().map(first).filter(|name| !name.is_empty()).map(|name| (i + 1, name)));
        }
    }
    found
}

/// A module uses lower floors only.
fn floor(file: &File, floors: &BTreeMap<String, u32>) -> Vec<Finding> {
    let Some(own) = module(&file.path).filter(|_| file.is_rust()) else { return Vec::new() };
    let Some(&height) = floors.get(own) else {
        return vec![(1, format!("the module {own} has no floor in ARCHITECTURE.md"))];
    };
    let mut found = Vec::new();
    for (line, name) in uses(file).into_iter().filter(|(_, name)| name != own) {
        match floors.get(&name) {
            Some(&other) if other < height => {}
            Some(other) => found.push((line, format!("{own} (floor {height}) uses {name} (floor {other})"))),
            None => found.push((line, format!("the module {name} has no floor in ARCHITECTURE.md"))),
        }
    }
    found
}

/// Everything wrong in one file, opt-outs applied, as `path:line: what [rule]`.
fn judge(file: &File, floors: &BTreeMap<String, u32>) -> Vec<String> {
    let mut findings: Vec<(usize, &str, String)> =
        floor(file, floors).into_iter().map(|(line, what)| (line, "floor", what)).collect();
    for (name, rule) in RULES {
        findings.extend(rule(file).into_iter().map(|(line, what)| (line, name, what)));
    }
    for (i, line) in file.lines.iter().enumerate() {
        let sign = line.comment.trim_start_matches(['/', '!', '#', ' ']);
        let Some((rule, reason)) = sign.strip_prefix("tidy: allow(").and_then(|s| s.split_once(')')) else { continue };
        let before = findings.len();
        findings.retain(|(at, name, _)| *name != rule || (rule != "length" && *at != i + 1 && *at != i + 2));
        if findings.len() == before {
            findings.push((i + 1, "allow", format!("this opt-out of {rule} silences nothing")));
        } else if reason.trim().is_empty() {
            findings.push((i + 1, "allow", format!("this opt-out of {rule} gives no reason")));
        }
    }
    findings.into_iter().map(|(line, rule, what)| format!("{}:{line}: {what} [{rule}]", file.path)).collect()
}

/// Assets by path, where source and licence are told: rows of the table in assets/README.md.
fn listed_assets(readme: &str) -> Vec<String> {
    let rows = readme.lines().map(|line| line.split('|').map(str::trim).collect::<Vec<_>>());
    rows.filter(|cells| cells.len() == 6 && cells[1].starts_with('`') && cells[2..5].iter().all(|c| !c.is_empty()))
        .map(|cells| format!("assets/{}", cells[1].trim_matches('`')))
        .collect()
}

/// What is wrong with a file by its name and size alone. `is_text`: it can be read as text.
fn misplaced(path: &str, bytes: u64, is_text: bool, assets: &[String], readme: &str, maker: &str) -> Option<String> {
    let is_listed = assets.iter().any(|a| a == path);
    if bytes > MAX_BYTES && !is_listed {
        return Some(format!("{path}: {bytes} bytes, more than {MAX_BYTES} and not listed in assets/README.md [size]"));
    }
    if path.starts_with("assets/") && !is_text && !is_listed {
        return Some(format!("{path}: no row with source and licence in assets/README.md [asset]"));
    }
    let picture = path.strip_prefix("screenshots/")?;
    let stem = picture.split('.').next()?;
    let is_made = has_word(maker, path) || has_word(maker, &format!("shoot {stem}"));
    (!is_made && !readme.contains(path))
        .then(|| format!("{path}: neither made by scripts/screenshots nor shown in README.md [picture]"))
}

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Paths of the tree: what git tracks or would add, else all but what is built.
fn tree() -> Vec<String> {
    let list = ["ls-files", "-z", "--cached", "--others", "--exclude-standard"];
    if let Ok(output) = Command::new("git").arg("-C").arg(root()).args(list).output()
        && output.status.success()
    {
        let names = String::from_utf8(output.stdout).expect("names of files are UTF-8");
        return names.split_terminator('\0').map(str::to_owned).collect();
    }
    let (mut paths, mut folders) = (Vec::new(), vec![PathBuf::new()]);
    while let Some(folder) = folders.pop() {
        for entry in std::fs::read_dir(root().join(&folder)).expect("a readable folder").flatten() {
            let path = folder.join(entry.file_name());
            if !entry.path().is_dir() {
                paths.push(path.to_string_lossy().replace('\\', "/"));
            } else if entry.file_name() != "target" && entry.file_name() != ".git" {
                folders.push(path);
            }
        }
    }
    paths
}

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

#[test]
fn the_tree_is_tidy() {
    let floors = floors(&read("ARCHITECTURE.md"));
    let (readme, maker, assets) =
        (read("README.md"), read("scripts/screenshots"), listed_assets(&read("assets/README.md")));
    let mut wrong = Vec::new();
    let paths = tree();
    for path in &paths {
        // What was deleted and not yet told to git is no longer there.
        let Ok(bytes) = std::fs::read(root().join(path)) else { continue };
        let size = bytes.len() as u64;
        let text = String::from_utf8(bytes).ok().filter(|text| !text.contains('\0'));
        wrong.extend(misplaced(path, size, text.is_some(), &assets, &readme, &maker));
        wrong.extend(text.iter().flat_map(|text| judge(&File::new(path, text), &floors)));
    }
    for asset in assets.iter().filter(|asset| !paths.contains(asset)) {
        wrong.push(format!("assets/README.md: lists {asset}, which is not there [asset]"));
    }
    for name in floors.keys() {
        let is_there = paths.iter().any(|path| module(path) == Some(name));
        if !is_there {
            wrong.push(format!("ARCHITECTURE.md: src/{name} has a floor and is not there [floor]"));
        }
    }
    assert!(paths.len() > 100 && floors.len() > 10, "{} files, {} floors: too few", paths.len(), floors.len());
    assert!(wrong.is_empty(), "{} things are not tidy:\n{}", wrong.len(), wrong.join("\n"));
}

#[test]
fn the_page_of_settings_is_fresh() {
    let output = Command::new(env!("CARGO_BIN_EXE_nephele")).args(["settings", "--markdown"]).output();
    let fresh = String::from_utf8(output.expect("the program runs").stdout).expect("UTF-8");
    let stale = read("docs/settings.md");
    let line = fresh.lines().zip(stale.lines()).take_while(|(a, b)| a == b).count() + 1;
    assert!(
        fresh == stale,
        "docs/settings.md:{line} is not what the settings say; renew it: cargo run -- settings --markdown > docs/settings.md"
    );
}

/// What is said of `text` as the file `path`, where `a` is on floor 0, `b` and `c` on 1.
fn said(path: &str, text: &str) -> Vec<String> {
    let table = floors("| floor | module |\n| --- | --- |\n| 0 | `src/a.rs` |\n| 1 | `src/b/`, `src/c.rs` | and |\n");
    judge(&File::new(path, text), &table)
}

/// That `text` in `path` has one finding, of `rule` on `line`.
#[track_caller]
fn assert_said(path: &str, text: &str, line: usize, rule: &str) {
    let said = said(path, text);
    let is_it =
        said.len() == 1 && said[0].starts_with(&format!("{path}:{line}: ")) && said[0].ends_with(&format!("[{rule}]"));
    assert!(is_it, "{path}:{line} [{rule}] expected, said: {said:#?} of\n{text}");
}

#[test]
fn planted_violations_are_reported() {
    let [fix, plan] = [concat!("FIX", "ME"), concat!("TO", "DO")];
    let b = "src/b/x.rs";
    for (path, text, line, rule) in [
        // Floors: the same, a higher one, none; in lists, over lines, in the program.
        (b, "use crate::a::X;\nuse crate::c::Y;\n", 2, "floor"),
        (b, "fn f() {\n    crate::c::g();\n}\n", 2, "floor"),
        (b, "use crate::{a::X, b::{Y, c}, c};\n", 1, "floor"),
        (b, "\nuse crate::{\n    a::X,\n    c::{\n        Y,\n    },\n};\n", 2, "floor"),
        (b, "use crate::nowhere::X;\n", 1, "floor"),
        ("src/a.rs", "pub use crate::b;\n", 1, "floor"),
        ("src/new/mod.rs", "fn f() {}\n", 1, "floor"),
        ("src/main.rs", "fn main() {}\n", 1, "floor"),
        // Texts.
        (b, "fn f() {\n\t}\n", 2, "text"),
        ("scripts/x", "a\nb \n", 2, "text"),
        ("x.md", "a\r\n", 1, "text"),
        ("x.toml", "a = 1", 1, "text"),
        (b, &"\n".repeat(MAX_LINES), 1, "length"),
        (b, "fn f() {\n    println!(\"x\");\n}\n", 2, "print"),
        (b, "fn f() {\n    eprint!(\"// {}\", '\"'); // x\n}\n", 2, "print"),
        ("src/b/y.rs", "/* a\n b */ dbg!(x);\n", 2, "leftover"),
        ("tests/x/y.rs", "fn f<'a>() { todo!() }\n", 1, "leftover"),
        (b, "// SAFETY: fine.\nfn f() {}\nunsafe fn g() {}\n", 3, "safety"),
        (b, &format!("// {fix}: wrong\n"), 1, "fixme"),
        ("shaders/x.wgsl", &format!("fn f() {{}} // {fix}(#x)\n"), 1, "fixme"),
        ("scripts/x", &format!("# {plan} more\n"), 1, "fixme"),
        (b, &format!("const X: &str = \"/{}/x/y\";\n", "home"), 1, "path"),
        ("x.md", &format!("C:\\{}\\x\n", "Users"), 1, "path"),
        ("Cargo.lock", &format!("source = \"registry+https:{}\"\n", "//mirror.example:8080/index"), 1, "host"),
        ("x.md", &format!("https:{}\n", "//github.com.example/rust-lang/crates.io-index"), 1, "host"),
        ("x.md", &format!("https:{}\n", "//github.com/rust-lang/crates.io-index2"), 1, "host"),
        // Opt-outs: of nothing, of another rule, too far away, without a reason.
        (b, "// tidy: allow(print) nothing here\nfn f() {}\n", 1, "allow"),
        ("src/cli/x.toml", "# tidy: allow(lines) no such rule\n", 1, "allow"),
        (b, "// tidy: allow(print)\nfn f() { print!() }\n", 1, "allow"),
    ] {
        assert_said(path, text, line, rule);
    }
    assert_eq!(said(b, "// tidy: allow(print) far\n\nfn f() { print!() }\n").len(), 2);
}

#[test]
fn what_is_right_is_not_reported() {
    let long = "\n".repeat(MAX_LINES);
    for (path, text) in [
        (
            "src/b/mod.rs",
            "use crate::a::X;\nuse crate::b::y;\npub(crate) use crate::{a, b::{c}};\nuse of_crate::c;\n// crate::c may be told of\n",
        ),
        ("src/lib.rs", "pub mod c;\n"),
        (
            "src/b/x.rs",
            "const A: &str = \"unsafe { dbg!(1) } \\\" println!()\";\nconst B: &str = r#\"todo!() \"crate::c\" \"#;\n",
        ),
        ("src/b/x.rs", "const A: [char; 3] = ['\"', '\\'', '\\u{22}'];\nfn f<'a>(x: &'a str) {} // println!\n"),
        (
            "src/b/x.rs",
            "// SAFETY: fine, and\n// long.\n#[inline]\nunsafe fn f() {}\nlet x = unsafe { g() }; // SAFETY: h\n",
        ),
        ("src/b/x.rs", concat!("// FIX", "ME(#12): slow\nfn eprintln() { blueprint!(); }\n#![deny(unsafe_code)]\n")),
        ("src/b/x.rs", "// tidy: allow(print) it is asked for\nfn f() { println!() }\n"),
        ("src/b/x.rs", &format!("// tidy: allow(length) one table\n{long}")),
        ("shaders/x.wgsl", &long),
        ("tests/x.rs", "fn f() { eprintln!(\"skipped\") }\n"),
        ("src/b/tests.rs", "fn f() { eprintln!(\"skipped\") }\n"),
        ("scripts/x", "cp \"$a/work/b\" ../tmp/ /etc/x ./root/y\n"),
        ("x.svg", "<svg xmlns=\"http://www.w3.org/2000/svg\"/>\n"),
    ] {
        assert_eq!(said(path, text), Vec::<String>::new(), "{path}\n{text}");
    }
}

#[test]
fn files_out_of_place_are_reported() {
    let table = "| File | What | Source | Licence |\n| --- | --- | --- | --- |\n| `a.bin` | A | B | C |\n| `b.bin` | A | | C |\n";
    let assets = listed_assets(table);
    assert_eq!(assets, ["assets/a.bin"], "a row without source does not count");
    let said = |path: &str, bytes, is_text| {
        let maker = "\"$program\" render x -o screenshots/made.png\nshoot window \"\"\n";
        misplaced(path, bytes, is_text, &assets, "![x](screenshots/shown.png)", maker)
    };
    let big = MAX_BYTES + 1;
    assert!(said("data/x.vdb", big, false).is_some_and(|s| s.ends_with("[size]")));
    assert!(said("assets/b.bin", 1, false).is_some_and(|s| s.ends_with("[asset]")));
    assert!(said("screenshots/lost.png", 1, false).is_some_and(|s| s.ends_with("[picture]")));
    assert!(said("screenshots/win.png", 1, false).is_some(), "a part of another's name");
    for (path, bytes, is_text) in [
        ("assets/a.bin", big, false),
        ("assets/scene.toml", 1, true),
        ("data/x.vdb", MAX_BYTES, false),
        ("screenshots/made.png", 1, false),
        ("screenshots/window.png", 1, false),
        ("screenshots/shown.png", 1, false),
    ] {
        assert_eq!(said(path, bytes, is_text), None, "{path}");
    }
}
