//! Settings that make the picture biased: which, and by what.

use super::row::{Row, Section};
use super::value::Value;
use super::{Scene, Tracking};

/// A setting whose value makes the picture biased.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bias {
    /// The full key of the setting.
    pub key: String,
    /// Its name on screen.
    pub label: &'static str,
    /// What its value brings: "ray marching of shadow rays".
    pub why: &'static str,
}

impl Bias {
    /// All of them in a few words: what one is biased by, or how many there are. `None` where there is none.
    pub fn brief(all: &[Bias]) -> Option<String> {
        match all {
            [] => None,
            [one] => Some(one.why.to_owned()),
            more => Some(format!("{} settings", more.len())),
        }
    }

    /// What each is biased by.
    pub fn whys(all: &[Bias]) -> String {
        all.iter().map(|bias| bias.why).collect::<Vec<_>>().join(", ")
    }
}

impl Scene {
    /// The settings that make the picture biased.
    pub fn biases(&self) -> Vec<Bias> {
        let bias = |(key, row, value): (String, &'static Row, Value)| {
            let why = row.bias(&value)?;
            Some(Bias { key, label: row.label, why })
        };
        self.settings().into_iter().filter_map(bias).collect()
    }
}

impl Tracking {
    /// By what the estimators are biased, if they are.
    pub fn bias(&self) -> Option<&'static str> {
        Tracking::ROWS.iter().enumerate().find_map(|(i, row)| row.bias(&self.get(i)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::value::Kind;
    use crate::scene::{FreeFlight, Transmittance};

    #[test]
    fn biases_are_those_of_the_declarations() {
        let mut scene = Scene::default();
        assert_eq!((scene.biases(), Bias::brief(&[])), (Vec::new(), None));
        scene.tracking.transmittance = Transmittance::Jackknife;
        let one = scene.biases();
        assert_eq!((one[0].key.as_str(), one[0].label), ("tracking.transmittance", "Transmittance"));
        assert_eq!(Bias::brief(&one).as_deref(), Some("jackknife transmittance"));
        assert_eq!(scene.tracking.bias(), Some("jackknife transmittance"));
        scene.tracking.free_flight = FreeFlight::RayMarching;
        let two = scene.biases();
        assert_eq!(Bias::brief(&two).as_deref(), Some("2 settings"));
        assert_eq!(Bias::whys(&two), "ray marching of free flights, jackknife transmittance");
    }

    /// What says so in words is declared as such.
    #[test]
    fn choices_that_tell_of_a_bias_are_declared_biased() {
        for (key, row, _) in Scene::default().settings() {
            let Kind::Choice(choices) = row.kind else { continue };
            for choice in choices {
                let words = choice.help.split(|c: char| !c.is_alphabetic());
                let told = words.map(str::to_lowercase).any(|word| word == "biased");
                assert_eq!(told, !choice.bias.is_empty(), "{key} = {}", choice.name);
            }
        }
    }
}
