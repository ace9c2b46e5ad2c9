//! Undo and redo. Moves of the camera have a stack of their own, so that undoing a setting never moves the view.

use super::lab::Own;
use crate::scene::{Camera, Scene};

/// Steps that are kept.
const STEPS: usize = 200;

/// What a step brings back.
#[derive(Clone, Debug, PartialEq)]
struct Step {
    /// Its camera does not count.
    scene: Scene,
    /// The settings of the lab's side B, where it has been opened.
    b: Option<Own>,
}

/// What can be taken back.
#[derive(Debug)]
pub struct History {
    undo: Vec<Step>,
    redo: Vec<Step>,
    /// The last step.
    committed: Step,
    cameras: Vec<Camera>,
    camera: Camera,
}

impl History {
    /// A history that begins with `scene`.
    pub fn new(scene: &Scene) -> History {
        History {
            undo: Vec::new(),
            redo: Vec::new(),
            committed: Step { scene: scene.clone(), b: None },
            cameras: Vec::new(),
            camera: scene.camera.clone(),
        }
    }

    /// Makes the scene and side B as they stand a step, if they differ from the last one. That there is a side B is none.
    pub fn commit(&mut self, scene: &Scene, b: &Option<Own>) {
        if scene.camera != self.camera {
            push(&mut self.cameras, std::mem::replace(&mut self.camera, scene.camera.clone()));
        }
        if self.committed.b.is_none() {
            self.committed.b = b.clone();
        }
        let same_view = Scene { camera: self.committed.scene.camera.clone(), ..scene.clone() };
        let step = Step { scene: same_view, b: b.clone() };
        if step != self.committed {
            push(&mut self.undo, std::mem::replace(&mut self.committed, step));
            self.redo.clear();
        }
    }

    /// Whether there is something to take back.
    pub fn can_undo(&self) -> bool {
        !self.undo.is_empty()
    }

    /// Whether there is something to do again.
    pub fn can_redo(&self) -> bool {
        !self.redo.is_empty()
    }

    /// Takes the last step back; the camera stays.
    pub fn undo(&mut self, scene: &mut Scene, b: &mut Option<Own>) {
        travel(&mut self.undo, &mut self.redo, &mut self.committed, scene, b);
    }

    /// Does the step again that was taken back last.
    pub fn redo(&mut self, scene: &mut Scene, b: &mut Option<Own>) {
        travel(&mut self.redo, &mut self.undo, &mut self.committed, scene, b);
    }

    /// Takes the camera's last move back.
    pub fn camera_back(&mut self, scene: &mut Scene) {
        if let Some(camera) = self.cameras.pop() {
            scene.camera = camera.clone();
            self.camera = camera;
        }
    }
}

fn push<T>(steps: &mut Vec<T>, step: T) {
    steps.push(step);
    if steps.len() > STEPS {
        steps.remove(0);
    }
}

fn travel(from: &mut Vec<Step>, to: &mut Vec<Step>, committed: &mut Step, scene: &mut Scene, b: &mut Option<Own>) {
    let Some(mut step) = from.pop() else { return };
    // A step from before the lab was opened leaves B as it is.
    step.b = step.b.or_else(|| b.clone());
    to.push(std::mem::replace(committed, step.clone()));
    *scene = Scene { camera: scene.camera.clone(), ..step.scene };
    *b = step.b;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::value::Auto;

    #[test]
    fn settings_and_cameras_are_taken_back_apart() {
        let mut scene = Scene::default();
        let mut history = History::new(&scene);
        scene.medium.g = 0.5;
        history.commit(&scene, &None);
        scene.camera.position = Auto::Is(glam::DVec3::X);
        history.commit(&scene, &None);
        scene.medium.g = 0.6;
        history.commit(&scene, &None);
        history.commit(&scene, &None);
        history.undo(&mut scene, &mut None);
        assert_eq!((scene.medium.g, scene.camera.position), (0.5, Auto::Is(glam::DVec3::X)));
        history.undo(&mut scene, &mut None);
        assert!(scene.medium == Default::default() && !history.can_undo());
        history.redo(&mut scene, &mut None);
        history.camera_back(&mut scene);
        assert_eq!((scene.medium.g, scene.camera.position), (0.5, Auto::Auto));
        history.redo(&mut scene, &mut None);
        assert!(scene.medium.g == 0.6 && !history.can_redo());
        history.undo(&mut scene, &mut None);
        scene.medium.g = 0.1;
        history.commit(&scene, &None);
        assert!(!history.can_redo(), "a new step ends the way forward");
    }

    #[test]
    fn settings_of_side_b_are_taken_back_with_the_scene_in_order() {
        let mut scene = Scene::default();
        let mut history = History::new(&scene);
        scene.medium.g = 0.5;
        history.commit(&scene, &None);
        let mut b = Some(Own::beside(&scene));
        history.commit(&scene, &b);
        b.as_mut().expect("set").medium.g = 0.2;
        history.commit(&scene, &b);
        scene.medium.g = 0.6;
        history.commit(&scene, &b);
        let g = |scene: &Scene, b: &Option<Own>| (scene.medium.g, b.as_ref().map(|own| own.medium.g));
        history.undo(&mut scene, &mut b);
        assert_eq!(g(&scene, &b), (0.5, Some(0.2)));
        history.undo(&mut scene, &mut b);
        assert_eq!(g(&scene, &b), (0.5, Some(0.5)));
        history.undo(&mut scene, &mut b);
        assert_eq!(g(&scene, &b), (Scene::default().medium.g, Some(0.5)), "opening the lab is no step; B stays");
        for _ in 0..3 {
            history.redo(&mut scene, &mut b);
        }
        assert_eq!(g(&scene, &b), (0.6, Some(0.2)));
    }

    #[test]
    fn only_so_many_steps_are_kept() {
        let mut scene = Scene::default();
        let mut history = History::new(&scene);
        for seed in 1..STEPS as u32 + 10 {
            scene.integrator.seed = seed;
            history.commit(&scene, &None);
        }
        while history.can_undo() {
            history.undo(&mut scene, &mut None);
        }
        assert_eq!(scene.integrator.seed, 9);
    }
}
