//! Settings that change over frames.

use super::Scene;
use super::value::Value;
use crate::error::{Code, Error, Result};

/// One animated setting: linear between its keys, held outside them.
#[derive(Clone, Debug, PartialEq)]
pub struct Track {
    /// The setting's full key.
    pub key: String,
    /// Frames, increasing.
    pub frames: Vec<f64>,
    /// The value at each frame.
    pub values: Vec<Value>,
}

/// Sections whose settings may be animated.
const ANIMATED: [&str; 4] = ["medium", "lights", "camera", "display"];

impl Track {
    /// Whether the track fits `scene`; an error in words otherwise.
    pub fn check(&self, scene: &Scene) -> std::result::Result<(), String> {
        let section = self.key.split('.').next().unwrap_or_default();
        if !ANIMATED.contains(&section) {
            return Err(format!("\"{}\" cannot be animated: only settings of {} can.", self.key, ANIMATED.join(", ")));
        }
        let row = scene.row(&self.key).ok_or_else(|| scene.unknown_key(&self.key))?;
        if !row.is_real() {
            return Err(format!("\"{}\" cannot be animated: it is no real number or vector.", self.key));
        }
        if self.frames.is_empty() || self.frames.len() != self.values.len() {
            return Err(format!("{} frames but {} values.", self.frames.len(), self.values.len()));
        }
        if self.frames.iter().any(|f| !f.is_finite()) || self.frames.windows(2).any(|w| w[0] >= w[1]) {
            return Err("frames must increase.".into());
        }
        let mut probe = scene.clone();
        for value in &self.values {
            probe.assign(&self.key, value)?;
        }
        let shape = |v: &Value| v.numbers().len();
        if self.values.iter().any(|v| shape(v) != shape(&self.values[0]) || shape(v) == 0) {
            return Err("values differ in shape.".into());
        }
        Ok(())
    }

    /// The value at `frame`.
    fn at(&self, frame: f64) -> Value {
        let next = self.frames.partition_point(|&f| f <= frame);
        if next == 0 {
            return self.values[0].clone();
        }
        if next == self.frames.len() {
            return self.values[next - 1].clone();
        }
        let (a, b) = (self.frames[next - 1], self.frames[next]);
        let t = (frame - a) / (b - a);
        Value::lerp(&self.values[next - 1], &self.values[next], t).expect("Track::check saw equal shapes")
    }
}

impl Scene {
    /// The scene as it stands at `frame`; without tracks, itself.
    pub fn at_frame(&self, frame: f64) -> Result<Scene> {
        let mut scene = self.clone();
        for track in &self.animation {
            scene
                .assign(&track.key, &track.at(frame))
                .map_err(|why| Error::new(Code::BadKey, format!("animation of {}: {why}", track.key)))?;
        }
        Ok(scene)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_between_keys_and_held_outside() {
        let mut scene = Scene::default();
        scene.animation.push(Track {
            key: "medium.g".into(),
            frames: vec![2.0, 4.0],
            values: vec![Value::Float(0.0), Value::Float(0.5)],
        });
        let g = |frame| scene.at_frame(frame).expect("a checked track").medium.g;
        assert_eq!([g(0.0), g(2.0), g(3.0), g(4.0), g(9.0)], [0.0, 0.0, 0.25, 0.5, 0.5]);
    }

    #[test]
    fn tracks_that_do_not_fit_are_refused() {
        let scene = Scene::default();
        let track = |key: &str, frames: &[f64], values: &[Value]| Track {
            key: key.into(),
            frames: frames.into(),
            values: values.into(),
        };
        let x = [Value::Float(0.1), Value::Float(0.2)];
        assert!(track("medium.g", &[0.0, 1.0], &x).check(&scene).is_ok());
        assert!(track("medium.g", &[1.0, 0.0], &x).check(&scene).is_err());
        assert!(track("medium.g", &[0.0], &x).check(&scene).is_err());
        assert!(track("film.width", &[0.0, 1.0], &x).check(&scene).is_err());
        assert!(track("medium.phase", &[0.0, 1.0], &x).check(&scene).is_err());
        assert!(track("medium.gg", &[0.0, 1.0], &x).check(&scene).is_err());
        assert!(track("camera.position", &[0.0, 1.0], &x).check(&scene).is_err());
        assert!(track("medium.g", &[0.0, 1.0], &[Value::Float(0.1), Value::Float(2.0)]).check(&scene).is_err());
    }
}
