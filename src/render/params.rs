//! The uniform that every pass reads, and the only code that writes it.

use glam::{DMat3, DMat4, DVec3};

use crate::gpu::layout::gpu_struct;
use crate::scene::value::{Auto, Limit};
use crate::scene::{Camera, Scene};

use super::field::{Field, Shape};
use super::lights::Lights;
use super::medium::Medium;

gpu_struct! {
    /// Twin of `Params` in shaders/core/params.wgsl, where every field is explained.
    Params {
        camera_local: [f32; 3],
        aperture: f32,
        camera_right: [f32; 3],
        focus: f32,
        camera_up: [f32; 3],
        seed: u32,
        camera_forward: [f32; 3],
        max_bounces: u32,
        local_from_world_x: [f32; 3],
        width: u32,
        local_from_world_y: [f32; 3],
        height: u32,
        local_from_world_z: [f32; 3],
        epsilon: f32,
        world_from_local_x: [f32; 3],
        sigma: f32,
        world_from_local_y: [f32; 3],
        inv_cell: f32,
        world_from_local_z: [f32; 3],
        cell: f32,
        box_min: [f32; 3],
        g: f32,
        box_max: [f32; 3],
        g2: f32,
        extinction: [f32; 3],
        lobe_weight: f32,
        albedo: [f32; 3],
        light_count: u32,
        constant_radiance: [f32; 3],
        light_reference: f32,
        environment_scale: f32,
        environment_sin: f32,
        environment_cos: f32,
        environment_share: f32,
        length_unit: f32,
        majorant_factor: f32,
        tiles_x: u32,
        tiles: u32,
        tile_stride: u32,
        overlay: u32,
        exposure: f32,
        tone_map: u32,
        inv_texels: [f32; 3],
        inv_width: f32,
        last_cell: [i32; 3],
        inv_height: f32,
        profile: [f32; 3],
        profile_offset: f32,
        step: f32,
        overlay_low: f32,
        overlay_high: f32,
        overlay_scale: u32,
        inv_proxy: [f32; 3],
        proxy_inv_cell: f32,
        proxy_last: f32,
        proxy_weakest: f32,
        unused0: f32,
        unused1: f32,
    }
}

gpu_struct! {
    /// Twin of `Slice` in shaders/core/params.wgsl.
    Slice {
        first_group: u32,
        first_sample: u32,
        samples: u32,
        unused: u32,
    }
}

/// Pixels along the side of a workgroup's tile.
pub const TILE: u32 = 8;

/// Where the camera stands, with every "auto" resolved; world space.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position.
    pub position: DVec3,
    /// The point that it looks at.
    pub target: DVec3,
    /// Unit vector to the right of the picture.
    pub right: DVec3,
    /// Unit vector up the picture.
    pub up: DVec3,
    /// Unit vector along the axis.
    pub forward: DVec3,
    /// Distance of the sharp plane along the axis.
    pub focus: f64,
}

impl View {
    /// The view of `camera` on a volume that fills `field`'s box, in a picture `aspect` times as wide as high.
    pub fn of(camera: &Camera, field: &Field, aspect: f64) -> View {
        let (low, high) = field.world_box();
        let target = camera.target.unwrap_or_else(|| (low + high) * 0.5);
        let position = camera.position.unwrap_or_else(|| target + DVec3::Z * fit_distance(camera, low, high, aspect));
        let mut forward = (target - position).normalize_or_zero();
        if forward == DVec3::ZERO {
            forward = DVec3::NEG_Z;
        }
        let mut right = forward.cross(camera.up).normalize_or_zero();
        if right == DVec3::ZERO {
            // Looking straight along `up`: any direction will do, but always the same one.
            right = forward.cross(DVec3::NEG_Z).try_normalize().unwrap_or(DVec3::X);
        }
        let up = right.cross(forward);
        let focus = camera.focus_distance.unwrap_or_else(|| (target - position).length().max(f64::MIN_POSITIVE));
        View { position, target, right, up, forward, focus }
    }
}

/// The distance at which the sphere round a box just fits the smaller of the two angles of view.
pub fn fit_distance(camera: &Camera, low: DVec3, high: DVec3, aspect: f64) -> f64 {
    let half_y = (camera.fov_y * 0.5).to_radians();
    let half_x = (half_y.tan() * aspect).atan();
    (high - low).length() * 0.5 / half_y.min(half_x).sin()
}

impl Params {
    /// The uniform for a picture of `width` × `height` pixels of `scene`; the overlay's range is `heat::Range::write`'s.
    pub fn of(scene: &Scene, medium: &Medium, lights: &Lights, width: u32, height: u32) -> Params {
        let aspect = f64::from(width) / f64::from(height);
        let view = View::of(&scene.camera, &medium.field, aspect);
        let half = (scene.camera.fov_y * 0.5).to_radians().tan();
        let unit = medium.unit;
        let local_from_scene: DMat4 = medium.field.local_from_world();
        let to_local = DMat3::from_mat4(local_from_scene) * unit;
        let to_world = to_local.inverse();
        let (box_min, box_max) = medium.field.local_box();
        let extinction = DVec3::from(scene.medium.extinction.0);
        let strongest = extinction.max_element();
        let colour = if strongest > 0.0 { extinction / strongest } else { DVec3::ONE };
        let tiles_x = width.div_ceil(TILE);
        let (gradient, offset) = match &medium.field.shape {
            Shape::Analytic { profile, low, high } => profile.affine(*low, *high),
            Shape::Dense(_) => (DVec3::ZERO, 0.0),
        };
        let tiles = tiles_x * height.div_ceil(TILE);
        Params {
            camera_local: local_from_scene.transform_point3(view.position).as_vec3().to_array(),
            aperture: (scene.camera.aperture_radius / unit) as f32,
            camera_right: (view.right * half * aspect).as_vec3().to_array(),
            focus: (view.focus / unit) as f32,
            camera_up: (view.up * half).as_vec3().to_array(),
            seed: scene.integrator.seed,
            camera_forward: view.forward.as_vec3().to_array(),
            max_bounces: match scene.integrator.max_bounces {
                Limit::Unlimited => u32::MAX,
                Limit::AtMost(n) => n,
            },
            local_from_world_x: to_local.x_axis.as_vec3().to_array(),
            width,
            local_from_world_y: to_local.y_axis.as_vec3().to_array(),
            height,
            local_from_world_z: to_local.z_axis.as_vec3().to_array(),
            epsilon: medium.epsilon(),
            world_from_local_x: to_world.x_axis.as_vec3().to_array(),
            sigma: medium.sigma(scene) as f32,
            world_from_local_y: to_world.y_axis.as_vec3().to_array(),
            inv_cell: 1.0 / medium.cell as f32,
            world_from_local_z: to_world.z_axis.as_vec3().to_array(),
            cell: medium.cell as f32,
            box_min: box_min.as_vec3().to_array(),
            g: scene.medium.g as f32,
            box_max: box_max.as_vec3().to_array(),
            g2: scene.medium.g2 as f32,
            extinction: colour.as_vec3().to_array(),
            lobe_weight: scene.medium.lobe_weight as f32,
            albedo: scene.medium.albedo.0.map(|x| x as f32),
            light_count: lights.list.len() as u32,
            constant_radiance: lights.constant,
            light_reference: lights.reference,
            environment_scale: lights.map_scale,
            environment_sin: lights.map_rotation.sin(),
            environment_cos: lights.map_rotation.cos(),
            environment_share: lights.map_share,
            length_unit: unit as f32,
            majorant_factor: scene.tracking.majorant_factor as f32,
            tiles_x,
            tiles,
            tile_stride: tile_stride(tiles),
            overlay: scene.display.overlay as u32,
            exposure: scene.display.exposure.exp2() as f32,
            tone_map: scene.display.tone_map as u32,
            inv_texels: medium.size.as_vec3().recip().to_array(),
            inv_width: 1.0 / width as f32,
            last_cell: (medium.cells.as_ivec3() - 1).to_array(),
            inv_height: 1.0 / height as f32,
            profile: gradient.as_vec3().to_array(),
            profile_offset: offset as f32,
            step: (scene.tracking.step * medium.texel()) as f32,
            overlay_low: 0.0,
            overlay_high: 0.0,
            overlay_scale: 0,
            inv_proxy: medium.proxy.span().as_vec3().recip().to_array(),
            proxy_inv_cell: 1.0 / medium.proxy.side as f32,
            proxy_last: medium.proxy.levels.saturating_sub(1) as f32,
            proxy_weakest: colour.to_array().into_iter().filter(|e| *e > 0.0).fold(1.0, f64::min) as f32,
            unused0: 0.0,
            unused1: 0.0,
        }
    }
}

/// A stride that visits every one of `tiles` tiles and puts neighbours in time far apart on screen. Small enough that
/// tile · stride fits 32 bits for any picture.
fn tile_stride(tiles: u32) -> u32 {
    const PRIMES: [u32; 4] = [509, 503, 499, 491];
    PRIMES.into_iter().find(|p| !tiles.is_multiple_of(*p)).unwrap_or(1)
}

impl<T: Copy> Auto<T> {
    /// Whether the program finds the value.
    pub fn is_auto(&self) -> bool {
        matches!(self, Auto::Auto)
    }
}
