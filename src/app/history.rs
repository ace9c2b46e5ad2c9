//! Undo and redo. Moves of the camera have a stack of their own, so that undoing a setting never moves the view.

use crate::scene::{Camera, Scene};

/// Steps that are kept.
const STEPS: usize = 200;

/// What can be taken back.
#[derive(Debug)]
pub struct History {
    undo: Vec<Scene>,
    redo: Vec<Scene>,
    /// The scene of the last step; its camera does not count.
    committed: Scene,
    cameras: Vec<Camera>,
    camera: Camera,
}

impl History {
    /// A history that begins with `scene`.
    pub fn new(scene: &Scene) -> History {
        History {
            undo: Vec::new(),
            redo: Vec::new(),
            committed: scene.clone(),
            cameras: Vec::new(),
            camera: scene.camera.clone(),
        }
    }

    /// Makes the scene as it stands a step, if it differs from the last one.
    pub fn commit(&mut self, scene: &Scene) {
        if scene.camera != self.camera {
            push(&mut self.cameras, std::mem::replace(&mut self.camera, scene.camera.clone()));
        }
        let same_view = Scene { camera: self.committed.camera.clone(), ..scene.clone() };
        if same_view != self.committed {
            push(&mut self.undo, std::mem::replace(&mut self.committed, same_view));
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
    pub fn undo(&mut self, scene: &mut Scene) {
        travel(&mut self.undo, &mut self.redo, &mut self.committed, scene);
    }

    /// Does the step again that was taken back last.
    pub fn redo(&mut self, scene: &mut Scene) {
        travel(&mut self.redo, &mut self.undo, &mut self.committed, scene);
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

fn travel(from: &mut Vec<Scene>, to: &mut Vec<Scene>, committed: &mut Scene, scene: &mut Scene) {
    let Some(step) = from.pop() else { return };
    to.push(std::mem::replace(committed, step.clone()));
    *scene = Scene { camera: scene.camera.clone(), ..step };
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
        history.commit(&scene);
        scene.camera.position = Auto::Is(glam::DVec3::X);
        history.commit(&scene);
        scene.medium.g = 0.6;
        history.commit(&scene);
        history.commit(&scene);
        history.undo(&mut scene);
        assert_eq!((scene.medium.g, scene.camera.position), (0.5, Auto::Is(glam::DVec3::X)));
        history.undo(&mut scene);
        assert!(scene.medium == Default::default() && !history.can_undo());
        history.redo(&mut scene);
        history.camera_back(&mut scene);
        assert_eq!((scene.medium.g, scene.camera.position), (0.5, Auto::Auto));
        history.redo(&mut scene);
        assert!(scene.medium.g == 0.6 && !history.can_redo());
        history.undo(&mut scene);
        scene.medium.g = 0.1;
        history.commit(&scene);
        assert!(!history.can_redo(), "a new step ends the way forward");
    }

    #[test]
    fn only_so_many_steps_are_kept() {
        let mut scene = Scene::default();
        let mut history = History::new(&scene);
        for seed in 1..STEPS as u32 + 10 {
            scene.integrator.seed = seed;
            history.commit(&scene);
        }
        while history.can_undo() {
            history.undo(&mut scene);
        }
        assert_eq!(scene.integrator.seed, 9);
    }
}
