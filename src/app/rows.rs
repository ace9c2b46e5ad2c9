//! From a setting's declaration to its row in the panel: label, range, unit, tooltip, reset, all from `scene::row`.

use egui::Ui;

use super::widgets::{
    Auto, CheckRow, Choice, ColourRow, ComboRow, Digits, Head, RowResponse, Scale, SegmentsRow, SliderRow, TextRow,
    Tip, VectorRow,
};
use crate::app::theme::icon;
use crate::scene::row::{Row, Scale as Spread};
use crate::scene::value::{Kind, Value};
use crate::scene::{Light, Scene};

/// Segments rather than a list for so many choices, of so many letters in all.
const SEGMENTS: usize = 4;
const SEGMENT_LETTERS: usize = 24;
/// A setting that spans more than this many decades is shown with significant digits.
const DECADES: f64 = 100.0;
/// How far a point of drag moves a free vector, as a share of the scene's size.
const VECTOR_STEP: f64 = 0.005;

/// What the rows of one frame share.
pub struct Rows<'a> {
    /// The scene that they edit.
    pub scene: &'a mut Scene,
    /// What a reset gives.
    pub defaults: &'a Scene,
    /// The values behind "auto", by key.
    pub automatic: &'a dyn Fn(&str) -> Option<Value>,
    /// Length of the scene, world units.
    pub size: f64,
    /// Some row is being dragged.
    pub dragging: bool,
    /// A path row's button was pressed: its key.
    pub browse: Option<String>,
}

impl Rows<'_> {
    /// The default of a setting; of a light's, the default of its kind.
    fn default(&self, key: &str) -> Option<Value> {
        if let Some(rest) = key.strip_prefix("lights.") {
            let (index, name) = rest.split_once('.')?;
            let kind = self.scene.lights.get(index.parse::<usize>().ok()?)?.kind();
            let light = Light::of_kind(kind)?;
            let at = light.section().rows().iter().position(|row| row.key == name)?;
            return Some(light.section().get(at));
        }
        self.defaults.get(key)
    }

    /// Whether a setting differs from its default.
    pub fn changed(&self, key: &str) -> bool {
        self.scene.get(key) != self.default(key)
    }

    /// Whether any setting whose key begins so differs from its default.
    pub fn any_changed(&self, prefix: &str) -> bool {
        self.scene.settings().iter().any(|(key, ..)| key.starts_with(prefix) && self.changed(key))
    }

    /// Shows the row of one setting.
    pub fn show(&mut self, ui: &mut Ui, key: &str) {
        let (Some(row), Some(value)) = (self.scene.row(key), self.scene.get(key)) else { return };
        let default = self.default(key);
        let changed = default.as_ref() != Some(&value);
        let head = Head {
            label: row.label,
            symbol: row.symbol,
            changed,
            biased: false,
            tip: Tip { key, text: row.help.trim(), cost: row.effect.cost() },
        };
        let is_auto = matches!((&value, row.word), (Value::Text(t), Some(word)) if t == word);
        let auto = match (row.word, is_auto) {
            (None, _) => Auto::Never,
            (Some(_), true) => Auto::Is,
            (Some(_), false) => Auto::Can,
        };
        let shown = if is_auto { (self.automatic)(key) } else { Some(value.clone()) };
        let default_is_word = matches!(&default, Some(Value::Text(_))) && row.word.is_some();
        let (new, response) = match row.kind {
            Kind::Number | Kind::Integer => {
                let mut number = shown.and_then(|v| v.number()).unwrap_or(f64::NAN);
                let widget = SliderRow {
                    head,
                    unit: row.unit,
                    range: row.slider.0..=row.slider.1,
                    limits: row.min..=row.max,
                    scale: scale(row),
                    digits: digits(row),
                    default: if default_is_word { None } else { default.as_ref().and_then(Value::number) },
                    auto,
                    swatch: None,
                };
                let response = widget.show(ui, &mut number);
                let whole = row.kind == Kind::Integer;
                let new = if whole { Value::Int(number.round() as i64) } else { Value::Float(number) };
                (new, response)
            }
            Kind::Bool => {
                let mut on = value == Value::Bool(true);
                let default = default == Some(Value::Bool(true));
                let response = CheckRow { head, note: "", default }.show(ui, &mut on);
                (Value::Bool(on), response)
            }
            Kind::Choice(choices) => {
                let names: Vec<Choice> = choices.iter().map(|c| Choice::new(c.label)).collect();
                let place = |v: Option<&Value>| {
                    choices.iter().position(|c| matches!(v, Some(Value::Text(t)) if t == c.name)).unwrap_or(0)
                };
                let mut chosen = place(Some(&value));
                let default = place(default.as_ref());
                let letters: usize = choices.iter().map(|c| c.label.chars().count()).sum();
                let response = if choices.len() <= SEGMENTS && letters <= SEGMENT_LETTERS {
                    SegmentsRow { head, choices: &names, default }.show(ui, &mut chosen)
                } else {
                    ComboRow { head, choices: &names, default }.show(ui, &mut chosen)
                };
                (Value::Text(choices[chosen].name.into()), response)
            }
            Kind::Colour => {
                let mut colour = triple(&value);
                let widget = ColourRow {
                    head,
                    unit: row.unit,
                    range: row.slider.0..=row.slider.1,
                    limits: row.min..=row.max,
                    scale: scale(row),
                    digits: digits(row),
                    default: default.as_ref().map_or([0.0; 3], triple),
                };
                let response = widget.show(ui, &mut colour);
                (list(colour), response)
            }
            Kind::Vector => {
                let mut vector = shown.as_ref().map_or([f64::NAN; 3], triple);
                let direction = row.unit.is_empty();
                let widget = VectorRow {
                    head,
                    unit: row.unit,
                    names: ["X", "Y", "Z"],
                    per_point: VECTOR_STEP * if direction { 1.0 } else { self.size },
                    limits: -1e30..=1e30,
                    digits: Digits::Significant(3),
                    default: if default_is_word { None } else { default.as_ref().map(triple) },
                    auto,
                };
                let response = widget.show(ui, &mut vector);
                (list(vector), response)
            }
            Kind::Text | Kind::Path => {
                let mut text = match &value {
                    Value::Text(t) => t.clone(),
                    _ => String::new(),
                };
                let is_path = row.kind == Kind::Path;
                let widget = TextRow {
                    head,
                    hint: if is_path { "none" } else { "auto" },
                    button: is_path.then_some(icon::OPEN),
                };
                let answer = widget.show(ui, &mut text);
                if answer.pressed {
                    self.browse = Some(key.to_owned());
                }
                let mut response = answer.row;
                if response.reset {
                    text = String::new();
                    response.changed = true;
                }
                (Value::Text(text), response)
            }
            // Set in the scene file.
            Kind::Matrix | Kind::Bounds | Kind::Pair => return,
        };
        self.apply(key, row, new, &response, default);
    }

    fn apply(&mut self, key: &str, row: &Row, new: Value, response: &RowResponse, default: Option<Value>) {
        self.dragging |= response.dragging;
        let new = match (response.auto, response.reset, row.word, default) {
            (true, _, Some(word), _) => Value::Text(word.into()),
            (_, true, Some(_), Some(default @ Value::Text(_))) => default,
            _ if response.changed => new,
            _ => return,
        };
        // A value that does not fit (a vector of length 0, say) is not taken; the row shows the old one again.
        let old = self.scene.clone();
        if self.scene.assign(key, &new).is_err() || self.scene.check().is_err() {
            *self.scene = old;
        }
    }
}

fn scale(row: &Row) -> Scale {
    match row.scale {
        Spread::Linear => Scale::Linear,
        Spread::Log => Scale::Log,
        Spread::OneMinusLog => Scale::OneMinusLog,
    }
}

fn digits(row: &Row) -> Digits {
    match row.kind {
        Kind::Integer => Digits::Decimals(0),
        _ if row.scale == Spread::Log && row.slider.1 / row.slider.0 > DECADES => Digits::Significant(3),
        _ => Digits::Decimals(row.decimals),
    }
}

fn triple(value: &Value) -> [f64; 3] {
    let numbers = value.numbers();
    std::array::from_fn(|i| numbers.get(i).copied().unwrap_or(f64::NAN))
}

fn list(numbers: [f64; 3]) -> Value {
    Value::List(numbers.iter().map(|&x| Value::Float(x)).collect())
}
