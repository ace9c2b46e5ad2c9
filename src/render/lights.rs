//! The lights of a scene as the shaders take them: a constant, a list, one environment map with its sampling table.

use std::path::Path;

use glam::DVec3;
use rayon::prelude::*;
use wgpu::util::DeviceExt;

use crate::error::{Code, Error, Result, Warning};
use crate::gpu::device::Gpu;
use crate::gpu::layout::gpu_struct;
use crate::gpu::shader::Variant;
use crate::io::hdr;
use crate::light::environment::{AliasEntry, AliasTable, Map, luminance};
use crate::light::sky::{Sky, SkyParams, sky};
use crate::scene::{Light, Scene, SkyLight, Sun};

use super::field::Field;

gpu_struct! {
    /// Twin of `Light` in shaders/light/light.wgsl.
    GpuLight {
        axis: [f32; 3],
        kind: u32,
        value: [f32; 3],
        share: f32,
        chord2: f32,
        unused0: f32,
        unused1: f32,
        unused2: f32,
    }
}

const DELTA_SUN: u32 = 0;
const DISC: u32 = 1;
const POINT: u32 = 2;

/// A sun of less than so many degrees is a delta light: 32-bit directions cannot tell its edge from its inside.
const LEAST_DISC: f64 = 0.01;

/// Data of lights that are dear to make; kept while only strengths and directions change.
#[derive(Clone, Debug, Default)]
pub struct LightData {
    /// One entry for each light of the scene: the map of an environment, a sky.
    entries: Vec<Entry>,
    /// What was noticed.
    pub warnings: Vec<Warning>,
}

#[derive(Clone, Debug)]
enum Entry {
    Plain,
    Environment(Map),
    Sky(Box<Sky>),
}

impl LightData {
    /// Reads the maps and makes the skies of `scene`.
    pub fn load(scene: &Scene) -> Result<LightData> {
        let mut data = LightData::default();
        for light in &scene.lights {
            data.entries.push(match light {
                Light::Environment(e) if e.file.0.is_empty() => {
                    return Err(Error::new(Code::BadKey, "An environment light names no file.")
                        .hint("Give lights.file an .exr or .hdr map."));
                }
                Light::Environment(e) => {
                    let (map, warnings) = hdr::load(Path::new(&e.file.0))?;
                    data.warnings.extend(warnings);
                    Entry::Environment(map)
                }
                Light::Sky(s) => Entry::Sky(Box::new(sky(&sky_params(s)))),
                _ => Entry::Plain,
            });
        }
        Ok(data)
    }
}

/// The sky of a light at scale 1: the factor is a number of the uniform.
fn sky_params(s: &SkyLight) -> SkyParams {
    SkyParams {
        sun_elevation: s.sun_elevation,
        sun_azimuth: s.sun_azimuth,
        turbidity: s.turbidity,
        ground_albedo: s.ground_albedo,
        scale: 1.0,
    }
}

/// The lights of a scene, ready for the uniform and the bind group.
pub struct Lights {
    /// Suns, discs and points.
    pub list: Vec<GpuLight>,
    /// Sum of the constant radiances.
    pub constant: [f32; 3],
    /// A typical radiance of the picture; steers roulette.
    pub reference: f32,
    /// Factor on the map.
    pub map_scale: f32,
    /// The map's rotation about +Y, radians.
    pub map_rotation: f32,
    /// Chance that a light sample comes from the map.
    pub map_share: f32,
    map: Option<Map>,
}

/// A map with its factor and rotation (degrees).
struct Layer<'a> {
    map: &'a Map,
    scale: f64,
    rotation: f64,
}

impl Lights {
    /// Gathers the lights of `scene`, whose dear parts are `data`.
    pub fn of(scene: &Scene, data: &LightData, field: &Field, unit: f64) -> Lights {
        let mut lights = Lights {
            list: Vec::new(),
            constant: [0.0; 3],
            reference: 0.0,
            map_scale: 1.0,
            map_rotation: 0.0,
            map_share: 0.0,
            map: None,
        };
        let local_from_world = field.local_from_world();
        let (low, high) = field.world_box();
        let centre = (low + high) * 0.5;
        let radius = ((high - low).length() * 0.5).max(f64::MIN_POSITIVE);
        // The irradiance that each light of the list gives the volume, about; the lights' shares follow it.
        let mut powers: Vec<f64> = Vec::new();
        let mut layers: Vec<Layer> = Vec::new();
        for (light, entry) in scene.lights.iter().zip(&data.entries) {
            match (light, entry) {
                (Light::Constant(c), _) => (0..3).for_each(|i| lights.constant[i] += c.radiance.0[i] as f32),
                (Light::Sun(sun), _) => lights.add_sun(sun, &mut powers),
                (Light::Point(point), _) => {
                    let value = point.intensity.0.map(|i| i / (unit * unit));
                    let distance = (point.position - centre).length().max(radius);
                    powers.push(luminance(point.intensity.0) / (distance * distance));
                    lights.list.push(GpuLight {
                        axis: local_from_world.transform_point3(point.position).as_vec3().to_array(),
                        kind: POINT,
                        value: value.map(|x| x as f32),
                        ..GpuLight::default()
                    });
                }
                (Light::Environment(e), Entry::Environment(map)) => {
                    layers.push(Layer { map, scale: e.scale, rotation: e.rotation });
                }
                (Light::Sky(s), Entry::Sky(sky)) => {
                    layers.push(Layer { map: &sky.map, scale: s.scale, rotation: 0.0 });
                    lights.add_sun(
                        &Sun {
                            direction: sky.sun_direction,
                            irradiance: crate::scene::value::Colour(sky.sun_irradiance.map(|e| f64::from(e) * s.scale)),
                            angular_diameter: f64::from(sky.sun_angular_diameter),
                        },
                        &mut powers,
                    );
                }
                (Light::Environment(_) | Light::Sky(_), _) => unreachable!("LightData::load made every entry"),
            }
        }
        layers.retain(|l| l.scale > 0.0);
        lights.add_maps(&layers);
        let map_radiance = lights.map.as_ref().map_or(0.0, |m| mean_luminance(m) * f64::from(lights.map_scale));
        lights.share(&powers, map_radiance);
        lights
    }

    fn add_sun(&mut self, sun: &Sun, powers: &mut Vec<f64>) {
        let axis = sun.direction.normalize().as_vec3().to_array();
        let irradiance = sun.irradiance.0;
        if irradiance.iter().all(|&e| e <= 0.0) {
            return;
        }
        powers.push(luminance(irradiance));
        let half = (sun.angular_diameter * 0.5).to_radians();
        self.list.push(if sun.angular_diameter >= LEAST_DISC {
            let projected = std::f64::consts::PI * half.sin().powi(2);
            let value = irradiance.map(|e| (e / projected) as f32);
            let chord2 = (4.0 * (half * 0.5).sin().powi(2)) as f32;
            GpuLight { axis, kind: DISC, value, chord2, ..GpuLight::default() }
        } else {
            GpuLight { axis, kind: DELTA_SUN, value: irradiance.map(|e| e as f32), ..GpuLight::default() }
        });
    }

    /// One map as it is; several are added up in one of the greatest size.
    fn add_maps(&mut self, layers: &[Layer]) {
        match layers {
            [] => {}
            [one] => {
                self.map_scale = one.scale as f32;
                self.map_rotation = one.rotation.to_radians() as f32;
                self.map = Some(one.map.clone());
            }
            many => {
                let width = many.iter().map(|l| l.map.width).max().unwrap_or(1);
                let height = many.iter().map(|l| l.map.height).max().unwrap_or(1);
                let texel = |i: usize| {
                    let (x, y) = (i as u32 % width, i as u32 / width);
                    let phi = std::f64::consts::TAU * ((f64::from(x) + 0.5) / f64::from(width) - 0.5);
                    let theta = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(height);
                    let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                    let mut sum = [0.0f32; 3];
                    for layer in many {
                        let rotated = glam::DMat3::from_rotation_y(-layer.rotation.to_radians()) * w;
                        let radiance = layer.map.radiance(rotated);
                        (0..3).for_each(|c| sum[c] += radiance[c] * layer.scale as f32);
                    }
                    sum
                };
                let texels = (0..width as usize * height as usize).into_par_iter().map(texel).collect();
                self.map = Some(Map { width, height, texels });
            }
        }
    }

    /// Sets shares and the reference radiance.
    fn share(&mut self, powers: &[f64], map_radiance: f64) {
        let map_power = std::f64::consts::PI * map_radiance;
        let total: f64 = powers.iter().sum::<f64>() + map_power;
        if self.map.is_some() {
            self.map_share = if total > 0.0 { (map_power / total) as f32 } else { 0.0 };
        }
        for (light, power) in self.list.iter_mut().zip(powers) {
            light.share = (power / total) as f32;
        }
        if self.map_share <= 0.0 {
            self.map = None;
        }
        self.list.retain(|l| l.share > 0.0);
        let sphere = 4.0 * std::f64::consts::PI;
        let constant = luminance(self.constant.map(f64::from));
        self.reference =
            ((constant + map_radiance + powers.iter().sum::<f64>() / sphere) as f32).max(f32::MIN_POSITIVE);
    }

    /// The constants that these lights choose.
    pub fn variant(&self, variant: Variant) -> Variant {
        let has = |kind: u32| self.list.iter().any(|l| l.kind == kind);
        variant
            .flag("LIGHT_SAMPLED", !self.list.is_empty() || self.map.is_some())
            .flag("LIGHT_HAS_MAP", self.map.is_some())
            .flag("LIGHT_HAS_LIST", !self.list.is_empty())
            .flag("LIGHT_HAS_MANY", self.list.len() > 1)
            .flag("LIGHT_HAS_DISC", has(DISC))
            .flag("LIGHT_HAS_POINT", has(POINT))
    }

    /// Bind group 2.
    pub fn bind_group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let storage = |label: &str, bytes: &[u8]| {
            gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some(label),
                contents: bytes,
                usage: wgpu::BufferUsages::STORAGE,
            })
        };
        let none = [GpuLight::default()];
        let list = if self.list.is_empty() { &none[..] } else { &self.list[..] };
        let list = storage("lights", bytemuck::cast_slice(list));
        let table = self.map.as_ref().and_then(AliasTable::new);
        let empty = [AliasEntry { threshold: 1.0, alias: 0, pdf: 0.0, pdf_alias: 0.0 }];
        let table =
            storage("environment table", bytemuck::cast_slice(table.as_ref().map_or(&empty[..], |t| &t.entries)));
        let black = Map { width: 1, height: 1, texels: vec![[0.0; 3]] };
        let map = self.map.as_ref().unwrap_or(&black);
        let texels: Vec<[f32; 4]> = map.texels.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
        let texture = gpu.device.create_texture_with_data(
            &gpu.queue,
            &wgpu::TextureDescriptor {
                label: Some("environment"),
                size: wgpu::Extent3d { width: map.width, height: map.height, depth_or_array_layers: 1 },
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: wgpu::TextureFormat::Rgba32Float,
                usage: wgpu::TextureUsages::TEXTURE_BINDING,
                view_formats: &[],
            },
            wgpu::util::TextureDataOrder::LayerMajor,
            bytemuck::cast_slice(&texels),
        );
        let view = texture.create_view(&wgpu::TextureViewDescriptor::default());
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("lights"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: list.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&view) },
                wgpu::BindGroupEntry { binding: 2, resource: table.as_entire_binding() },
            ],
        })
    }

    /// An error if the adapter does not take the map.
    pub fn fits(&self, gpu: &Gpu) -> Result<()> {
        let Some(map) = &self.map else { return Ok(()) };
        let table = 16 * u64::from(map.width) * u64::from(map.height);
        let side = gpu.limits.max_texture_dimension_2d;
        if map.width.max(map.height) <= side && table <= gpu.limits.max_storage_buffer_binding_size {
            return Ok(());
        }
        Err(Error::new(Code::TooLarge, format!("The environment map of {} × {} is too large.", map.width, map.height))
            .why(format!(
                "{} takes {side} texels a side and {} texels in all.",
                gpu.info.name,
                gpu.limits.max_storage_buffer_binding_size / 16
            ))
            .hint("Scale the map down to half its size."))
    }
}

fn mean_luminance(map: &Map) -> f64 {
    let row_sum = |row: u32| -> f64 {
        let line = &map.texels[(row * map.width) as usize..][..map.width as usize];
        map.solid_angle(row) * line.iter().map(|t| luminance(t.map(f64::from))).sum::<f64>()
    };
    (0..map.height).map(row_sum).sum::<f64>() / (4.0 * std::f64::consts::PI)
}
