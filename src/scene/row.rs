//! How a setting is declared: one row, from which scene files, `--set`, animation, panels, tooltips, undo,
//! `nephele settings` and picture metadata all follow.

use super::value::{Choice, Kind, Value};

/// What a change of a setting touches. The layers that it invalidates are [`Effect::layers`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Effect {
    /// Exposure, tone map, overlay: the way the picture is shown.
    Display,
    /// Nothing that is computed: limits, output.
    None,
    /// The camera moves.
    Camera,
    /// The size of the picture.
    Film,
    /// Another volume, or another resolution or storage of it.
    Volume,
    /// The box or transform of the volume, without new data.
    Placement,
    /// The factor on the extinction.
    Density,
    /// The colour of the extinction.
    Spectrum,
    /// Albedo or emission.
    Albedo,
    /// A number of the phase function.
    Phase,
    /// Another phase function.
    PhaseModel,
    /// Strength or colour of a light.
    LightStrength,
    /// Direction or place of a light.
    LightDirection,
    /// A light added, removed or with new data (environment, sky).
    LightData,
    /// Estimators, majorants, bounces, modes.
    Method,
    /// How paths are resampled.
    Reuse,
    /// The seed.
    Seed,
}

/// What has to be made anew.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Layers {
    /// Volume data: read, generate, upload.
    pub data: bool,
    /// Majorants.
    pub majorants: bool,
    /// Environment maps and their sampling tables.
    pub lights: bool,
    /// Shader pipelines (only where the variant differs).
    pub pipelines: bool,
    /// The accumulated picture.
    pub accumulation: bool,
    /// The view of it.
    pub view: bool,
    /// Light paths kept from earlier frames.
    pub history: bool,
    /// Those among them that hold an estimate of light scattered more than once.
    pub suffixes: bool,
}

impl Layers {
    /// Both together.
    pub fn union(self, other: Layers) -> Layers {
        Layers {
            data: self.data || other.data,
            majorants: self.majorants || other.majorants,
            lights: self.lights || other.lights,
            pipelines: self.pipelines || other.pipelines,
            accumulation: self.accumulation || other.accumulation,
            view: self.view || other.view,
            history: self.history || other.history,
            suffixes: self.suffixes || other.suffixes,
        }
    }
}

impl Effect {
    /// All effects, for tests and tables.
    pub const ALL: [Effect; 17] = [
        Effect::Display,
        Effect::None,
        Effect::Camera,
        Effect::Film,
        Effect::Volume,
        Effect::Placement,
        Effect::Density,
        Effect::Spectrum,
        Effect::Albedo,
        Effect::Phase,
        Effect::PhaseModel,
        Effect::LightStrength,
        Effect::LightDirection,
        Effect::LightData,
        Effect::Method,
        Effect::Reuse,
        Effect::Seed,
    ];

    /// The layers that a change invalidates.
    pub fn layers(self) -> Layers {
        let restart = Layers { accumulation: true, view: true, ..Layers::default() };
        // Paths stay valid with the weights that they have; only estimates of light that depend on the change do not.
        let edit = Layers { suffixes: true, ..restart };
        let anew = Layers { history: true, ..edit };
        match self {
            Effect::None => Layers::default(),
            Effect::Display => Layers { view: true, ..Layers::default() },
            Effect::Camera | Effect::Film | Effect::Reuse => restart,
            Effect::Albedo | Effect::Phase | Effect::LightStrength | Effect::LightDirection => edit,
            Effect::Placement | Effect::Seed => anew,
            // Bounds are stored for the raw density and scaled at use; only the choice of levels follows the density,
            // in steps of two (`volume::majorant`).
            Effect::Density => edit,
            Effect::Spectrum => Layers { pipelines: true, ..edit },
            Effect::PhaseModel => Layers { pipelines: true, ..anew },
            Effect::LightData => Layers { lights: true, pipelines: true, ..anew },
            Effect::Method => Layers { majorants: true, pipelines: true, ..anew },
            Effect::Volume => Layers { data: true, majorants: true, pipelines: true, ..anew },
        }
    }

    /// In words, for tooltips.
    pub fn cost(self) -> &'static str {
        match self {
            Effect::Display | Effect::None => "Free: the picture goes on.",
            Effect::Volume => "Loads the volume and starts the picture anew.",
            Effect::LightData | Effect::Method | Effect::PhaseModel | Effect::Spectrum => {
                "Starts the picture anew; the first use may build a shader."
            }
            _ => "Starts the picture anew.",
        }
    }
}

/// How a slider spreads its range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly.
    Linear,
    /// Evenly in the logarithm.
    Log,
    /// Evenly in −log₁₀(1 − x): each nine of an albedo takes the same way.
    OneMinusLog,
}

/// A setting: everything but its value.
#[derive(Clone, Copy, Debug)]
pub struct Row {
    /// Key within its section.
    pub key: &'static str,
    /// Name on screen.
    pub label: &'static str,
    /// Symbol in formulas; empty if it has none.
    pub symbol: &'static str,
    /// Unit; empty for a pure number.
    pub unit: &'static str,
    /// What it means, in one or two sentences.
    pub help: &'static str,
    /// Shape of the value.
    pub kind: Kind,
    /// A word that may stand in place of a value.
    pub word: Option<&'static str>,
    /// Lowest number allowed.
    pub min: f64,
    /// Highest number allowed.
    pub max: f64,
    /// What the slider spans, where the range itself is too wide for one.
    pub slider: (f64, f64),
    /// Spread of the slider.
    pub scale: Scale,
    /// Digits after the point on screen.
    pub decimals: usize,
    /// What a change touches.
    pub effect: Effect,
    /// Whether numbers of this setting make the picture biased; says which.
    pub biased: &'static str,
}

impl Row {
    /// A row without range; the builder methods below add what differs from the plain case.
    pub const fn new(key: &'static str, help: &'static str, kind: Kind, word: Option<&'static str>) -> Row {
        Row {
            key,
            label: key,
            symbol: "",
            unit: "",
            help,
            kind,
            word,
            min: f64::NEG_INFINITY,
            max: f64::INFINITY,
            slider: (0.0, 1.0),
            scale: Scale::Linear,
            decimals: 2,
            effect: Effect::None,
            biased: "",
        }
    }

    /// Name on screen.
    pub const fn label(mut self, label: &'static str) -> Row {
        self.label = label;
        self
    }

    /// Symbol in formulas.
    pub const fn symbol(mut self, symbol: &'static str) -> Row {
        self.symbol = symbol;
        self
    }

    /// Unit.
    pub const fn unit(mut self, unit: &'static str) -> Row {
        self.unit = unit;
        self
    }

    /// Allowed numbers, ends included; also what the slider spans.
    pub const fn range(mut self, min: f64, max: f64) -> Row {
        self.min = min;
        self.max = max;
        self.slider = (min, max);
        self
    }

    /// What the slider spans, where the range itself is too wide for one.
    pub const fn slider(mut self, low: f64, high: f64) -> Row {
        self.slider = (low, high);
        self
    }

    /// Spread of the slider.
    pub const fn scale(mut self, scale: Scale) -> Row {
        self.scale = scale;
        self
    }

    /// Digits after the point.
    pub const fn decimals(mut self, decimals: usize) -> Row {
        self.decimals = decimals;
        self
    }

    /// What a change touches.
    pub const fn effect(mut self, effect: Effect) -> Row {
        self.effect = effect;
        self
    }

    /// Which numbers are biased.
    pub const fn biased(mut self, why: &'static str) -> Row {
        self.biased = why;
        self
    }

    /// The range in words: `0 … 1`, `≥ 0`, the names of a choice.
    pub fn range_text(&self) -> String {
        let word = self.word.map(|w| format!("\"{w}\" or ")).unwrap_or_default();
        let body = match self.kind {
            Kind::Choice(choices) => {
                return choices.iter().map(|c| format!("\"{}\"", c.name)).collect::<Vec<_>>().join(", ");
            }
            Kind::Bool => return "true, false".into(),
            Kind::Text => return "a string".into(),
            Kind::Path => return "a path".into(),
            _ => match (self.min.is_finite(), self.max.is_finite()) {
                (true, true) => format!("{} … {}", plain(self.min), plain(self.max)),
                (true, false) => format!("≥ {}", plain(self.min)),
                (false, true) => format!("≤ {}", plain(self.max)),
                (false, false) => "any number".into(),
            },
        };
        let shape = match self.kind {
            Kind::Vector | Kind::Colour => "3 numbers, ",
            Kind::Matrix => "16 numbers, ",
            Kind::Bounds => "2 corners of 3 numbers, ",
            Kind::Pair => "2 numbers, ",
            Kind::Integer => "a whole number, ",
            _ => "",
        };
        format!("{word}{shape}{body}")
    }

    /// Whether `value`, of the right type, lies in the range; an error in words otherwise.
    pub fn check(&self, value: &Value) -> Result<(), String> {
        let infinite_allowed = matches!(self.kind, Kind::Bounds);
        for x in value.numbers() {
            let finite = x.is_finite() || (infinite_allowed && !x.is_nan());
            if !finite || x < self.min || x > self.max {
                return Err(format!("{} is out of range: {}.", plain(x), self.range_text()));
            }
        }
        Ok(())
    }

    /// Which values make the picture biased, in words: of a choice their names; "" for most settings.
    pub fn biased_text(&self) -> String {
        match self.kind {
            Kind::Choice(choices) => {
                let biased = choices.iter().filter(|c| !c.bias.is_empty());
                biased.map(|c| format!("\"{}\"", c.name)).collect::<Vec<_>>().join(", ")
            }
            _ => self.biased.to_owned(),
        }
    }

    /// By what `value` makes the picture biased; `None` where it does not.
    pub fn bias(&self, value: &Value) -> Option<&'static str> {
        let Value::Text(name) = value else { return None };
        self.choice(name).map(|choice| choice.bias).filter(|bias| !bias.is_empty())
    }

    /// Whether an `[[animation]]` may move it: any real number or vector.
    pub fn is_real(&self) -> bool {
        matches!(self.kind, Kind::Number | Kind::Vector | Kind::Colour)
    }

    /// The choice of that name.
    pub fn choice(&self, name: &str) -> Option<&'static Choice> {
        match self.kind {
            Kind::Choice(choices) => choices.iter().find(|c| c.name == name),
            _ => None,
        }
    }
}

/// A number as people write it; very large and very small ones with a power of ten.
pub fn plain(x: f64) -> String {
    /// Longer numbers are hard to read.
    const READABLE: usize = 11;
    let (plain, power) = (format!("{x}"), format!("{x:e}"));
    let text = if plain.len() > READABLE && power.len() < plain.len() { power } else { plain };
    text.replace('-', "−")
}

/// A group of settings with one struct behind it.
pub trait Section {
    /// Its rows.
    fn rows(&self) -> &'static [Row];
    /// The value of row `index`.
    fn get(&self, index: usize) -> Value;
    /// Sets row `index`; an error in words if type or range is wrong.
    fn set(&mut self, index: usize, value: &Value) -> Result<(), String>;
}

/// Declares a section: a struct with one public field a row, its default, and its rows.
macro_rules! section {
    ($(#[doc = $doc:literal])* $Name:ident { $(
        $(#[doc = $help:literal])* $field:ident: $Type:ty = $default:expr $(, $option:ident($($argument:expr),*))*;
    )* }) => {
        $(#[doc = $doc])*
        #[derive(Clone, Debug, PartialEq)]
        pub struct $Name { $( $(#[doc = $help])* pub $field: $Type ),* }
        impl Default for $Name {
            fn default() -> $Name {
                $Name { $( $field: $default ),* }
            }
        }
        impl $Name {
            /// The settings of this section.
            pub const ROWS: &'static [$crate::scene::row::Row] = &[ $(
                $crate::scene::row::Row::new(
                    stringify!($field),
                    concat!($($help),*),
                    <$Type as $crate::scene::value::Setting>::KIND,
                    <$Type as $crate::scene::value::Setting>::WORD,
                )$(.$option($($argument),*))*
            ),* ];
        }
        impl $crate::scene::row::Section for $Name {
            fn rows(&self) -> &'static [$crate::scene::row::Row] {
                Self::ROWS
            }
            fn get(&self, index: usize) -> $crate::scene::value::Value {
                let key = Self::ROWS[index].key;
                $( if key == stringify!($field) {
                    return $crate::scene::value::Setting::to_value(&self.$field);
                } )*
                unreachable!("every row has a field")
            }
            fn set(&mut self, index: usize, value: &$crate::scene::value::Value) -> Result<(), String> {
                let row = &Self::ROWS[index];
                $( if row.key == stringify!($field) {
                    let new = <$Type as $crate::scene::value::Setting>::from_value(value)
                        .ok_or_else(|| format!("{value} does not fit: {}.", row.range_text()))?;
                    row.check(value)?;
                    self.$field = new;
                } )*
                Ok(())
            }
        }
    };
}
pub(crate) use section;
