//! `nephele settings`: every setting from its one declaration.

use std::fmt::Write as _;
use std::io::Write;

use clap::Args;
use serde_json::json;

use crate::error::{Error, Result};
use crate::scene::row::Row;
use crate::scene::value::{Kind, Value};
use crate::scene::{Light, Scene};

/// A setting: full key, kind of light (empty elsewhere), row, default.
type Setting = (String, &'static str, &'static Row, Value);

/// Every setting with its default; those of lights stand under `lights.N` with the kind they belong to.
fn all() -> Vec<Setting> {
    let scene = Scene { lights: Vec::new(), ..Scene::default() };
    let mut rows: Vec<Setting> = scene.settings().into_iter().map(|(key, row, value)| (key, "", row, value)).collect();
    let at = rows.iter().position(|(key, ..)| key.starts_with("camera.")).unwrap_or(rows.len());
    let mut lights = Vec::new();
    for (kind, _) in Light::KINDS {
        let light = Light::of_kind(kind).expect("KINDS lists what of_kind makes");
        for (i, row) in light.section().rows().iter().enumerate() {
            lights.push((format!("lights.N.{}", row.key), *kind, row, light.section().get(i)));
        }
    }
    rows.splice(at..at, lights);
    rows
}

/// Flags of `settings`.
#[derive(Clone, Copy, Debug, Args)]
pub struct SettingsArgs {
    /// As JSON
    #[arg(long)]
    pub json: bool,
    /// As the page docs/settings.md
    #[arg(long, conflicts_with = "json")]
    pub markdown: bool,
}

/// Writes the list to `out`: text, JSON or Markdown.
pub fn run(args: &SettingsArgs, out: &mut dyn Write) -> Result<()> {
    let rows = all();
    let text = if args.json {
        let rows: Vec<_> = rows.iter().map(|(key, kind, row, value)| to_json(key, kind, row, value)).collect();
        format!("{:#}\n", json!({ "settings": rows }))
    } else if args.markdown {
        to_markdown(&rows)
    } else {
        rows.iter().map(|(key, kind, row, value)| to_text(key, kind, row, value)).collect()
    };
    out.write_all(text.as_bytes()).map_err(|e| Error::writing("standard output".as_ref(), &e))
}

fn to_json(key: &str, kind: &str, row: &Row, value: &Value) -> serde_json::Value {
    let mut object = json!({
        "key": key,
        "label": row.label,
        "symbol": row.symbol,
        "unit": row.unit,
        "help": row.help.trim(),
        "range": row.range_text(),
        "default": value.to_json(),
        "change": row.effect.cost(),
        "biased": row.biased_text(),
    });
    if !kind.is_empty() {
        object["light"] = kind.into();
    }
    if let Kind::Choice(choices) = row.kind {
        object["values"] = choices.iter().map(|c| json!({ "name": c.name, "help": c.help })).collect();
    }
    object
}

fn to_text(key: &str, kind: &str, row: &Row, value: &Value) -> String {
    let light = if kind.is_empty() { String::new() } else { format!(" ({kind})") };
    let symbol = if row.symbol.is_empty() { String::new() } else { format!("  {}", row.symbol) };
    let unit = if row.unit.is_empty() { String::new() } else { format!(" {}", row.unit) };
    let biased = match row.biased_text() {
        none if none.is_empty() => none,
        which => format!("  Biased: {which}."),
    };
    format!(
        "{key}{light}{symbol} = {value}{unit}\n    {}\n    {}. {}{biased}\n",
        row.help.trim(),
        row.range_text(),
        row.effect.cost()
    )
}

const PAGE_HEAD: &str = "\
# Settings

<!-- Made from the rows of src/scene/mod.rs; renew by: cargo run -- settings --markdown > docs/settings.md -->

Keys of a scene file (TOML). `--set medium.g=0.5` and `--set 'lights.0.direction=[0,1,0]'` change one; `nephele settings`
prints the same list and what a change costs. Lengths are in units of the world, radiance is linear Rec.709.
";

/// The page docs/settings.md: a table for each section, and what the names of a choice mean below it.
fn to_markdown(rows: &[Setting]) -> String {
    let mut page = PAGE_HEAD.to_owned();
    for section in rows.chunk_by(|a, b| title(a) == title(b)) {
        let _ = writeln!(page, "\n## {}\n", title(&section[0]));
        page += "| key | symbol | unit | range | default | meaning | biased |\n| --- | --- | --- | --- | --- | --- | --- |\n";
        let mut choices = String::new();
        for (key, _, row, value) in section {
            let key = key.rsplit('.').next().unwrap_or(key);
            let (range, default, biased) = (row.range_text(), format!("`{value}`"), row.biased_text());
            let cells = [&format!("`{key}`"), row.symbol, row.unit, &range, &default, row.help, &biased];
            page += "|";
            for cell in cells.map(|cell| cell.trim().replace('|', "\\|")) {
                let space = if cell.is_empty() { "" } else { " " };
                let _ = write!(page, "{space}{cell} |");
            }
            page += "\n";
            if let Kind::Choice(names) = row.kind {
                let meanings: Vec<_> = names.iter().map(|c| format!("`\"{}\"` {}", c.name, c.help)).collect();
                let _ = writeln!(choices, "- `{key}`: {}", meanings.join(" "));
            }
        }
        if !choices.is_empty() {
            let _ = write!(page, "\n{choices}");
        }
    }
    page
}

/// The head of the setting's section in a scene file.
fn title((key, kind, ..): &Setting) -> String {
    match key.split_once('.') {
        Some(("lights", _)) => format!("lights, kind = \"{kind}\""),
        Some((section, _)) => section.to_owned(),
        None => key.clone(),
    }
}
