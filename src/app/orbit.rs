//! The camera under the hand: orbit, pan, dolly, fly, views. Plain functions from a view to the scene's camera.

use glam::{DQuat, DVec2, DVec3};

use crate::render::params::View;
use crate::scene::Camera;
use crate::scene::value::Auto;

/// Radians of a drag across the height of the viewport.
const ORBIT_SPEED: f64 = std::f64::consts::PI;
/// The camera stays this far (radians) from looking along `up`.
const POLE: f64 = 0.01;
/// A notch of the wheel brings the camera this much nearer.
const DOLLY: f64 = 0.88;
/// A dolly never comes nearer to the pivot than this share of the volume's size.
const NEAREST: f64 = 1e-3;

fn place(camera: &mut Camera, position: DVec3, target: DVec3) {
    camera.position = Auto::Is(position);
    camera.target = Auto::Is(target);
}

/// Turns about the target by a drag of `delta` viewport heights (x right, y down); `up` is kept.
pub fn orbit(camera: &mut Camera, view: &View, delta: DVec2) {
    let up = camera.up.normalize();
    let arm = view.position - view.target;
    let yaw = DQuat::from_axis_angle(up, -delta.x * ORBIT_SPEED);
    let angle = up.angle_between(arm);
    let wanted = (angle - delta.y * ORBIT_SPEED).clamp(POLE, std::f64::consts::PI - POLE);
    let pitch = DQuat::from_axis_angle(view.right, wanted - angle);
    place(camera, view.target + yaw * (pitch * arm), view.target);
}

/// Shifts camera and target so that the point at the target's depth follows a drag of `delta` viewport heights.
pub fn pan(camera: &mut Camera, view: &View, delta: DVec2) {
    let height = 2.0 * (camera.fov_y * 0.5).to_radians().tan() * (view.target - view.position).length();
    let shift = (view.up * delta.y - view.right * delta.x) * height;
    place(camera, view.position + shift, view.target + shift);
}

/// Moves by `notches` of the wheel towards the point under the cursor at the target's depth. `cursor` is the place in
/// the viewport, −1 … 1 on both axes, y up; `size` is the size of the volume.
pub fn dolly(camera: &mut Camera, view: &View, notches: f64, cursor: DVec2, aspect: f64, size: f64) {
    let distance = (view.target - view.position).length();
    let half = (camera.fov_y * 0.5).to_radians().tan();
    let under = view.position
        + (view.forward + view.right * (cursor.x * half * aspect) + view.up * (cursor.y * half)) * distance;
    let nearest = NEAREST * size / distance;
    let factor = DOLLY.powf(notches).max(nearest.min(1.0));
    place(camera, under + (view.position - under) * factor, under + (view.target - under) * factor);
}

/// Rolls about the axis by `angle` radians.
pub fn roll(camera: &mut Camera, view: &View, angle: f64) {
    camera.up = (DQuat::from_axis_angle(view.forward, angle) * view.up).normalize();
}

/// Flies by `step` (right, up, forward) in world units.
pub fn fly(camera: &mut Camera, view: &View, step: DVec3) {
    let shift = view.right * step.x + view.up * step.y + view.forward * step.z;
    place(camera, view.position + shift, view.target + shift);
}

/// Turns the head by a drag of `delta` viewport heights; the position is kept.
pub fn look(camera: &mut Camera, view: &View, delta: DVec2) {
    let up = camera.up.normalize();
    let arm = view.target - view.position;
    let yaw = DQuat::from_axis_angle(up, -delta.x * ORBIT_SPEED);
    let angle = up.angle_between(arm);
    let wanted = (angle + delta.y * ORBIT_SPEED).clamp(POLE, std::f64::consts::PI - POLE);
    let pitch = DQuat::from_axis_angle(view.right, angle - wanted);
    place(camera, view.position, view.position + yaw * (pitch * arm));
}

/// Looks at the target from `direction`, from the same distance.
pub fn look_from(camera: &mut Camera, view: &View, direction: DVec3) {
    let distance = (view.target - view.position).length();
    // Straight from above or below the picture's up must not lie along the axis.
    camera.up = if direction.y.abs() > 0.99 { -DVec3::Z * direction.y.signum() } else { DVec3::Y };
    place(camera, view.target + direction * distance, view.target);
}

/// Fits the box into the picture, keeping the direction of view; `distance` is what fits it.
pub fn frame(camera: &mut Camera, view: &View, low: DVec3, high: DVec3, distance: f64) {
    let target = (low + high) * 0.5;
    place(camera, target - view.forward * distance, target);
}

/// Makes `pivot` the point that orbits turn about, and keeps the picture: only the distance to the target changes.
pub fn pivot(camera: &mut Camera, view: &View, depth: f64) {
    place(camera, view.position, view.position + view.forward * depth);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::field::{Field, Profile, Shape};

    fn field() -> Field {
        Field {
            shape: Shape::Analytic { profile: Profile::Constant, low: DVec3::NEG_ONE, high: DVec3::ONE },
            to_world: glam::DMat4::IDENTITY,
            nearest: false,
            grids: vec![],
            grid: String::new(),
            warnings: vec![],
        }
    }

    fn view(camera: &Camera) -> View {
        View::of(camera, &field(), 1.5)
    }

    #[test]
    fn orbit_keeps_distance_and_target_and_stops_at_the_pole() {
        let mut camera = Camera::default();
        let before = view(&camera);
        orbit(&mut camera, &before, DVec2::new(0.3, 0.2));
        let after = view(&camera);
        let length = |v: &View| (v.position - v.target).length();
        assert!((length(&before) - length(&after)).abs() < 1e-9 && before.target == after.target);
        assert!(after.position.y > before.position.y, "dragging down raises the camera");
        for _ in 0..10 {
            let v = view(&camera);
            orbit(&mut camera, &v, DVec2::new(0.0, 0.5));
        }
        assert!(view(&camera).right.is_finite() && view(&camera).forward.y > -1.0);
    }

    #[test]
    fn a_dolly_keeps_the_point_under_the_cursor() {
        let mut camera = Camera::default();
        let (cursor, aspect) = (DVec2::new(0.4, -0.3), 1.5);
        let half = (camera.fov_y * 0.5).to_radians().tan();
        let ray = |v: &View| (v.forward + v.right * (cursor.x * half * aspect) + v.up * (cursor.y * half)).normalize();
        let before = view(&camera);
        let point = before.position + ray(&before) * 2.0;
        let depth = (before.target - before.position).length();
        let under = before.position + ray(&before) * (depth / before.forward.dot(ray(&before)));
        dolly(&mut camera, &before, 3.0, cursor, aspect, 1.0);
        let after = view(&camera);
        assert!(((under - after.position).normalize() - ray(&after)).length() < 1e-9);
        assert!((under - after.position).length() < (under - before.position).length());
        assert!(point.is_finite());
        for _ in 0..200 {
            let v = view(&camera);
            dolly(&mut camera, &v, 5.0, DVec2::ZERO, aspect, 1.0);
        }
        let v = view(&camera);
        assert!((v.target - v.position).length() > 1e-4, "never through the pivot");
    }

    #[test]
    fn views_look_at_the_target() {
        let mut camera = Camera::default();
        for direction in [DVec3::X, DVec3::Y, DVec3::NEG_Y, DVec3::Z] {
            let v = view(&camera);
            look_from(&mut camera, &v, direction);
            let v = view(&camera);
            assert!((v.forward + direction).length() < 1e-9 && v.right.length() > 0.99);
        }
    }
}
