//! Values of settings: the one form in which scene files, `--set`, animation, panels and metadata hand them on.

use std::fmt;

use glam::DVec3;

/// A value of a setting, as TOML writes it.
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Int(i64),
    /// Any other number, ±inf included.
    Float(f64),
    /// A string.
    Text(String),
    /// An array.
    List(Vec<Value>),
}

impl Value {
    /// The number, whole or not.
    pub fn number(&self) -> Option<f64> {
        match *self {
            Value::Int(i) => Some(i as f64),
            Value::Float(x) => Some(x),
            _ => None,
        }
    }

    /// All numbers in it, nested lists included.
    pub fn numbers(&self) -> Vec<f64> {
        match self {
            Value::List(items) => items.iter().flat_map(Value::numbers).collect(),
            other => other.number().into_iter().collect(),
        }
    }

    /// The value between `a` (`t` = 0) and `b` (`t` = 1), number by number; `None` where the two differ in shape.
    pub fn lerp(a: &Value, b: &Value, t: f64) -> Option<Value> {
        match (a, b) {
            (Value::List(a), Value::List(b)) if a.len() == b.len() => {
                a.iter().zip(b).map(|(a, b)| Value::lerp(a, b, t)).collect::<Option<_>>().map(Value::List)
            }
            _ => Some(Value::Float(a.number()? * (1.0 - t) + b.number()? * t)),
        }
    }

    /// The value that a piece of TOML stands for; what is not TOML is taken as a string (`--set`).
    pub fn parse_or_text(text: &str) -> Value {
        let is_value = toml::de::DeValue::parse(text).ok().and_then(|v| Value::from_toml(v.get_ref()));
        is_value.unwrap_or_else(|| Value::Text(text.to_owned()))
    }

    /// The value of a parsed piece of TOML; `None` for tables and dates.
    pub fn from_toml(value: &toml::de::DeValue) -> Option<Value> {
        use toml::de::DeValue;
        Some(match value {
            DeValue::Boolean(b) => Value::Bool(*b),
            DeValue::String(s) => Value::Text(s.to_string()),
            DeValue::Integer(i) => Value::Int(i64::from_str_radix(i.as_str(), i.radix()).ok()?),
            DeValue::Float(x) => Value::Float(x.as_str().parse().ok()?),
            DeValue::Array(items) => {
                Value::List(items.iter().map(|v| Value::from_toml(v.get_ref())).collect::<Option<_>>()?)
            }
            DeValue::Datetime(_) | DeValue::Table(_) => return None,
        })
    }

    /// As JSON; ±inf and NaN, which JSON lacks, as strings.
    pub fn to_json(&self) -> serde_json::Value {
        match self {
            Value::Bool(b) => (*b).into(),
            Value::Int(i) => (*i).into(),
            Value::Float(x) => serde_json::Number::from_f64(*x).map_or_else(|| x.to_string().into(), Into::into),
            Value::Text(s) => s.clone().into(),
            Value::List(items) => items.iter().map(Value::to_json).collect(),
        }
    }
}

/// TOML text.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Value::Bool(b) => write!(f, "{b}"),
            Value::Int(i) => write!(f, "{i}"),
            Value::Float(x) => write!(f, "{x:?}"),
            Value::Text(s) => write!(f, "{}", toml::Value::String(s.clone())),
            Value::List(items) => {
                f.write_str("[")?;
                for (i, item) in items.iter().enumerate() {
                    let comma = if i == 0 { "" } else { ", " };
                    write!(f, "{comma}{item}")?;
                }
                f.write_str("]")
            }
        }
    }
}

/// One named value of a [`Kind::Choice`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Choice {
    /// Its name in scene files.
    pub name: &'static str,
    /// Its name on screen.
    pub label: &'static str,
    /// What it does.
    pub help: &'static str,
    /// By what it makes the picture biased; "" for most.
    pub bias: &'static str,
}

/// The shape of a setting's value; decides the widget that edits it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// A tick box.
    Bool,
    /// A number.
    Number,
    /// A whole number.
    Integer,
    /// A string.
    Text,
    /// The path of a file.
    Path,
    /// One of a few names.
    Choice(&'static [Choice]),
    /// Three numbers.
    Vector,
    /// Three numbers, one for each of red, green, blue.
    Colour,
    /// A 4×4 matrix by rows.
    Matrix,
    /// The lowest and the highest corner of a box.
    Bounds,
    /// Two numbers.
    Pair,
}

/// A type that a setting can have.
pub trait Setting: Sized {
    /// The shape of its values.
    const KIND: Kind;
    /// A word that may stand in place of the value: `auto`, `unlimited`.
    const WORD: Option<&'static str> = None;
    /// The value to write.
    fn to_value(&self) -> Value;
    /// The setting from a value; `None` where the type is wrong.
    fn from_value(value: &Value) -> Option<Self>;
}

impl Setting for bool {
    const KIND: Kind = Kind::Bool;
    fn to_value(&self) -> Value {
        Value::Bool(*self)
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Bool(b) => Some(*b),
            _ => None,
        }
    }
}

impl Setting for f64 {
    const KIND: Kind = Kind::Number;
    fn to_value(&self) -> Value {
        Value::Float(*self)
    }
    fn from_value(value: &Value) -> Option<Self> {
        value.number()
    }
}

impl Setting for u32 {
    const KIND: Kind = Kind::Integer;
    fn to_value(&self) -> Value {
        Value::Int(i64::from(*self))
    }
    fn from_value(value: &Value) -> Option<Self> {
        match *value {
            Value::Int(i) => u32::try_from(i).ok(),
            // Animation and sliders hand on fractions.
            Value::Float(x) if x.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&x) => Some(x as u32),
            _ => None,
        }
    }
}

impl Setting for String {
    const KIND: Kind = Kind::Text;
    fn to_value(&self) -> Value {
        Value::Text(self.clone())
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(s) => Some(s.clone()),
            _ => None,
        }
    }
}

/// The path of a file, empty where none is named, or `asset:NAME`, a volume that the program carries. Relative ones are
/// resolved when a scene is loaded.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FilePath(pub String);

/// What the name of a built-in volume begins with in place of a folder.
pub const ASSET: &str = "asset:";

/// The name of the built-in volume that `path` stands for; `None` for a file.
pub fn asset_name(path: &str) -> Option<&str> {
    path.strip_prefix(ASSET)
}

impl Setting for FilePath {
    const KIND: Kind = Kind::Path;
    fn to_value(&self) -> Value {
        Value::Text(self.0.clone())
    }
    fn from_value(value: &Value) -> Option<Self> {
        String::from_value(value).map(FilePath)
    }
}

/// A linear Rec.709 colour, or one factor for each of red, green, blue.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Colour(pub [f64; 3]);

fn three(value: &Value) -> Option<[f64; 3]> {
    match value {
        Value::List(items) if items.len() == 3 => Some([items[0].number()?, items[1].number()?, items[2].number()?]),
        _ => None,
    }
}

fn list(items: &[f64]) -> Value {
    Value::List(items.iter().map(|&x| Value::Float(x)).collect())
}

impl Setting for Colour {
    const KIND: Kind = Kind::Colour;
    fn to_value(&self) -> Value {
        list(&self.0)
    }
    fn from_value(value: &Value) -> Option<Self> {
        three(value).map(Colour)
    }
}

impl Setting for DVec3 {
    const KIND: Kind = Kind::Vector;
    fn to_value(&self) -> Value {
        list(&self.to_array())
    }
    fn from_value(value: &Value) -> Option<Self> {
        three(value).map(DVec3::from)
    }
}

/// A 4×4 matrix, by rows; points are column vectors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Matrix(pub [f64; 16]);

impl Matrix {
    /// The matrix that changes nothing.
    pub const IDENTITY: Matrix =
        Matrix([1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0]);

    /// As glam has it.
    pub fn to_mat(self) -> glam::DMat4 {
        glam::DMat4::from_cols_array(&self.0).transpose()
    }
}

impl Setting for Matrix {
    const KIND: Kind = Kind::Matrix;
    fn to_value(&self) -> Value {
        list(&self.0)
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::List(items) if items.len() == 16 => {
                let numbers: Vec<f64> = items.iter().map(Value::number).collect::<Option<_>>()?;
                numbers.try_into().ok().map(Matrix)
            }
            _ => None,
        }
    }
}

/// A box, ±inf allowed: lowest and highest corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds(pub [DVec3; 2]);

impl Setting for Bounds {
    const KIND: Kind = Kind::Bounds;
    fn to_value(&self) -> Value {
        Value::List(self.0.iter().map(DVec3::to_value).collect())
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::List(corners) if corners.len() == 2 => {
                Some(Bounds([DVec3::from_value(&corners[0])?, DVec3::from_value(&corners[1])?]))
            }
            _ => None,
        }
    }
}

/// Two numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pair(pub [f64; 2]);

impl Setting for Pair {
    const KIND: Kind = Kind::Pair;
    fn to_value(&self) -> Value {
        Value::List(self.0.iter().map(f64::to_value).collect())
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::List(ends) if ends.len() == 2 => {
                Some(Pair([f64::from_value(&ends[0])?, f64::from_value(&ends[1])?]))
            }
            _ => None,
        }
    }
}

/// A value, or `"auto"`: the program finds it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Auto<T> {
    /// The program finds it.
    Auto,
    /// The user's value.
    Is(T),
}

impl<T: Copy> Auto<T> {
    /// The user's value, or what `find` answers.
    pub fn unwrap_or_else(self, find: impl FnOnce() -> T) -> T {
        match self {
            Auto::Auto => find(),
            Auto::Is(value) => value,
        }
    }
}

impl<T: Setting> Setting for Auto<T> {
    const KIND: Kind = T::KIND;
    const WORD: Option<&'static str> = Some("auto");
    fn to_value(&self) -> Value {
        match self {
            Auto::Auto => Value::Text("auto".into()),
            Auto::Is(value) => value.to_value(),
        }
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(s) if s == "auto" => Some(Auto::Auto),
            other => T::from_value(other).map(Auto::Is),
        }
    }
}

/// A count, or no limit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Limit {
    /// No limit.
    Unlimited,
    /// At most so many.
    AtMost(u32),
}

impl Setting for Limit {
    const KIND: Kind = Kind::Integer;
    const WORD: Option<&'static str> = Some("unlimited");
    fn to_value(&self) -> Value {
        match self {
            Limit::Unlimited => Value::Text("unlimited".into()),
            Limit::AtMost(n) => n.to_value(),
        }
    }
    fn from_value(value: &Value) -> Option<Self> {
        match value {
            Value::Text(s) if s == "unlimited" => Some(Limit::Unlimited),
            other => u32::from_value(other).map(Limit::AtMost),
        }
    }
}

/// Declares an enum whose variants have names in scene files: one row makes variant, name, label and help, and says by
/// what it makes the picture biased where it does.
macro_rules! choice {
    ($(#[$doc:meta])* $Name:ident { $(
        $Variant:ident = $name:literal, $label:literal, $help:literal $(, biased($bias:literal))?;
    )* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum $Name { $( #[doc = $help] $Variant ),* }
        impl $Name {
            /// Every value, in the order of menus.
            pub const ALL: &'static [$Name] = &[ $( $Name::$Variant ),* ];
            /// Names and explanations, in the same order.
            pub const CHOICES: &'static [$crate::scene::value::Choice] = &[
                $( $crate::scene::value::Choice {
                    name: $name,
                    label: $label,
                    help: $help,
                    bias: concat!($($bias)?),
                } ),*
            ];
            /// Its name in scene files.
            pub fn name(self) -> &'static str {
                Self::CHOICES[self as usize].name
            }
            /// Its name on screen.
            pub fn label(self) -> &'static str {
                Self::CHOICES[self as usize].label
            }
        }
        impl $crate::scene::value::Setting for $Name {
            const KIND: $crate::scene::value::Kind = $crate::scene::value::Kind::Choice($Name::CHOICES);
            fn to_value(&self) -> $crate::scene::value::Value {
                $crate::scene::value::Value::Text(self.name().into())
            }
            fn from_value(value: &$crate::scene::value::Value) -> Option<Self> {
                match value {
                    $crate::scene::value::Value::Text(s) => Self::ALL.iter().copied().find(|v| v.name() == s),
                    _ => None,
                }
            }
        }
    };
}
pub(crate) use choice;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn toml_text_parses_back() {
        let values = [
            Value::Bool(true),
            Value::Int(-3),
            Value::Float(0.1),
            Value::Float(f64::INFINITY),
            Value::Float(1e-20),
            Value::Text("quote \" and \\ and\nline".into()),
            Value::List(vec![Value::Float(1.0), Value::List(vec![Value::Int(2)])]),
        ];
        for value in values {
            assert_eq!(Value::parse_or_text(&value.to_string()), value);
        }
        assert_eq!(Value::parse_or_text("two-lobe-hg"), Value::Text("two-lobe-hg".into()));
        assert_eq!(Value::parse_or_text("0x10"), Value::Int(16));
    }

    #[test]
    fn lerp_goes_through_lists() {
        let a = list(&[0.0, 1.0, 2.0]);
        let b = list(&[1.0, 3.0, 2.0]);
        assert_eq!(Value::lerp(&a, &b, 0.5), Some(list(&[0.5, 2.0, 2.0])));
        assert_eq!(Value::lerp(&a, &Value::Int(1), 0.5), None);
    }
}
