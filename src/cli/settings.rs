//! `nephele settings`: every setting from its one declaration.

use std::io::Write;

use serde_json::json;

use crate::error::{Error, Result};
use crate::scene::row::Row;
use crate::scene::value::{Kind, Value};
use crate::scene::{Light, Scene};

/// Every setting with its default; those of lights stand under `lights.N` with the kind they belong to.
pub fn all() -> Vec<(String, &'static str, &'static Row, Value)> {
    let scene = Scene { lights: Vec::new(), ..Scene::default() };
    let mut rows: Vec<(String, &'static str, &'static Row, Value)> =
        scene.settings().into_iter().map(|(key, row, value)| (key, "", row, value)).collect();
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

/// Writes the list to `out`, as text or JSON.
pub fn run(as_json: bool, out: &mut dyn Write) -> Result<()> {
    let text = if as_json {
        let rows: Vec<_> = all().iter().map(|(key, kind, row, value)| to_json(key, kind, row, value)).collect();
        format!("{:#}\n", json!({ "settings": rows }))
    } else {
        all().iter().map(|(key, kind, row, value)| to_text(key, kind, row, value)).collect()
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
        "biased": row.biased,
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
    let biased = if row.biased.is_empty() { String::new() } else { format!("  Biased: {}.", row.biased) };
    format!(
        "{key}{light}{symbol} = {value}{unit}\n    {}\n    {}. {}{biased}\n",
        row.help.trim(),
        row.range_text(),
        row.effect.cost()
    )
}
