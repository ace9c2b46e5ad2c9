//! From a setting's declaration to its row in the panel: label, range, unit, tooltip, reset, all from `scene::row`.

use egui::Ui;

use super::widgets::{
    Auto, CheckRow, Choice, ColourRow, ComboRow, Digits, Head, RowResponse, Scale, SegmentsRow, SliderRow, TextRow,
    Tip, VectorRow,
};
use crate::app::theme::icon;
use crate::scene::row::{Row, Scale as Spread};
use crate::scene::value::{Kind, Value};
use crate::scene::{FreeFlight, Light, Scene, Transmittance};

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
        let biased = match (row.kind, &value) {
            (Kind::Choice(_), _) => row.bias(&value).is_some(),
            _ => !row.biased.is_empty() && self.has_biased(key),
        };
        let head = Head {
            label: row.label,
            symbol: row.symbol,
            changed,
            biased,
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
                let choice = |c: &'static crate::scene::value::Choice| Choice {
                    biased: !c.bias.is_empty(),
                    blocked: if self.can_be(key, c.name) { "" } else { NEEDS_FORMULA },
                    ..Choice::new(c.label)
                };
                let names: Vec<Choice> = choices.iter().map(choice).collect();
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
        self.apply(ui, key, row, new, &response, default);
    }

    /// Whether a choice of the section of `key` makes the picture biased.
    fn has_biased(&self, key: &str) -> bool {
        let section = |key: &str| key.split('.').next().map(str::to_owned);
        self.scene.biases().iter().any(|bias| section(&bias.key) == section(key))
    }

    /// Whether an estimator can be chosen, with a change of other ones if need be.
    fn can_be(&self, key: &str, name: &str) -> bool {
        if !key.starts_with(TRACKING) {
            return true;
        }
        let mut scene = self.scene.clone();
        scene.assign(key, &Value::Text(name.into())).is_ok() && (scene.check().is_ok() || fitted(&scene, key).is_some())
    }

    fn apply(&mut self, ui: &Ui, key: &str, row: &Row, new: Value, response: &RowResponse, default: Option<Value>) {
        self.dragging |= response.dragging;
        let new = match (response.auto, response.reset, row.word, default) {
            (true, _, Some(word), _) => Value::Text(word.into()),
            (_, true, Some(_), Some(default @ Value::Text(_))) => default,
            _ if response.changed => new,
            _ => return,
        };
        // A value that does not fit (a vector of length 0, say) is not taken; the row shows the old one again.
        let old = self.scene.clone();
        if self.scene.assign(key, &new).is_err() {
            *self.scene = old;
            return;
        }
        if self.scene.check().is_ok() {
            // While a slider moves, what it changed on its way is still news.
            if key.starts_with(TRACKING) && !response.dragging {
                ui.data_mut(|data| data.remove::<String>(note_id()));
            }
            return;
        }
        match fitted(self.scene, key) {
            Some((scene, note)) => {
                *self.scene = scene;
                ui.data_mut(|data| data.insert_temp(note_id(), note));
            }
            None => *self.scene = old,
        }
    }
}

/// Settings that must fit one another.
const TRACKING: &str = "tracking.";
/// Why the closed forms cannot be chosen for voxels.
const NEEDS_FORMULA: &str = "analytic volumes only";

fn note_id() -> egui::Id {
    egui::Id::unique("what was changed to fit")
}

/// What was changed beside the last choice, so that the estimators fit one another; "" if nothing was.
pub fn fitting_note(ui: &Ui) -> String {
    ui.data(|data| data.get_temp(note_id())).unwrap_or_default()
}

/// `scene`, which does not fit since the setting `key` was chosen, with the fewest other estimators changed to the nearest
/// that fit; and what was changed, in words. `None` if there is no way.
pub fn fitted(scene: &Scene, key: &str) -> Option<(Scene, String)> {
    let tracking = &scene.tracking;
    let flight = match tracking.free_flight {
        FreeFlight::ClosedForm => FreeFlight::Regular,
        FreeFlight::Decomposition | FreeFlight::WeightedDecomposition => FreeFlight::WeightedDecomposition,
        _ => FreeFlight::WeightedDelta,
    };
    let shadows = match tracking.transmittance {
        Transmittance::ClosedForm => Transmittance::Regular,
        _ => Transmittance::Ratio,
    };
    let text = |name: &str| Value::Text(name.into());
    let ways = [
        ("tracking.control", text("min")),
        ("tracking.majorant_factor", Value::Float(1.0)),
        ("tracking.free_flight", text(flight.name())),
        ("tracking.transmittance", text(shadows.name())),
    ];
    let open: Vec<&(&str, Value)> =
        ways.iter().filter(|(k, new)| *k != key && scene.get(k).as_ref() != Some(new)).collect();
    // One bit for each way: fewer changes first, then in the order above.
    let mut sets: Vec<u32> = (1..1 << open.len()).collect();
    sets.sort_by_key(|set| set.count_ones());
    for set in sets {
        let mut other = scene.clone();
        let chosen = open.iter().enumerate().filter(|(i, _)| set >> i & 1 == 1).map(|(_, way)| way);
        let mut words = Vec::new();
        for (k, new) in chosen {
            let (Some(row), Some(old)) = (scene.row(k), scene.get(k)) else { continue };
            if other.assign(k, new).is_ok() {
                words.push(format!("{} was {}, is now {}", row.label, shown(row, &old), shown(row, new)));
            }
        }
        if other.check().is_ok() {
            let row = scene.row(key)?;
            let value = scene.get(key).map_or(String::new(), |v| shown(row, &v));
            return Some((other, format!("{}: needed by {} {value}.", words.join("; "), row.label.to_lowercase())));
        }
    }
    None
}

/// A value as the panel names it.
fn shown(row: &Row, value: &Value) -> String {
    match value {
        Value::Text(name) => row.choice(name).map_or(name.clone(), |choice| choice.label.to_owned()),
        other => other.to_string(),
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
