//! The lights of a scene as the shaders take them: a constant, a list, one environment map with its sampling table.

use std::path::Path;
use std::sync::Arc;

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
use crate::scene::value::Colour;
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
    Environment(Arc<Dome>),
    Sky { sun: Sun, dome: Arc<Dome> },
}

/// A map with what is dear to know of it.
#[derive(Clone, Debug)]
struct Dome {
    map: Map,
    /// Mean luminance over the sphere.
    mean: f64,
    /// Empty for a black map.
    table: Vec<AliasEntry>,
}

impl Dome {
    fn new(map: Map) -> Arc<Dome> {
        let table = AliasTable::new(&map).map_or(Vec::new(), |table| table.entries);
        Arc::new(Dome { mean: mean_luminance(&map), table, map })
    }
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
                    Entry::Environment(Dome::new(map))
                }
                Light::Sky(s) => {
                    let Sky { map, sun_direction, sun_irradiance, sun_angular_diameter } = sky(&sky_params(s));
                    let sun = Sun {
                        direction: sun_direction,
                        irradiance: Colour(sun_irradiance.map(f64::from)),
                        angular_diameter: f64::from(sun_angular_diameter),
                    };
                    Entry::Sky { sun, dome: Dome::new(map) }
                }
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
    dome: Option<Arc<Dome>>,
    /// What `dome` was added up from.
    layers: Vec<Layer>,
}

/// A map with its factor and rotation (degrees).
#[derive(Clone, Debug)]
struct Layer {
    dome: Arc<Dome>,
    scale: f64,
    rotation: f64,
}

impl PartialEq for Layer {
    fn eq(&self, other: &Layer) -> bool {
        Arc::ptr_eq(&self.dome, &other.dome) && (self.scale, self.rotation) == (other.scale, other.rotation)
    }
}

/// A dome on the adapter.
pub struct DomeBuffers {
    dome: Option<Arc<Dome>>,
    map: wgpu::TextureView,
    table: wgpu::Buffer,
}

impl Lights {
    /// Gathers the lights of `scene`, whose dear parts are `data`; what `previous` added up already is kept.
    pub fn of(scene: &Scene, data: &LightData, field: &Field, unit: f64, previous: Option<&Lights>) -> Lights {
        let mut lights = Lights {
            list: Vec::new(),
            constant: [0.0; 3],
            reference: 0.0,
            map_scale: 1.0,
            map_rotation: 0.0,
            map_share: 0.0,
            dome: None,
            layers: Vec::new(),
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
                (Light::Environment(e), Entry::Environment(dome)) => {
                    layers.push(Layer { dome: dome.clone(), scale: e.scale, rotation: e.rotation });
                }
                (Light::Sky(s), Entry::Sky { sun, dome }) => {
                    layers.push(Layer { dome: dome.clone(), scale: s.scale, rotation: 0.0 });
                    let irradiance = Colour(sun.irradiance.0.map(|e| e * s.scale));
                    lights.add_sun(&Sun { irradiance, ..sun.clone() }, &mut powers);
                }
                (Light::Environment(_) | Light::Sky(_), _) => unreachable!("LightData::load made every entry"),
            }
        }
        layers.retain(|l| l.scale > 0.0);
        lights.add_maps(layers, previous);
        let map_radiance = lights.dome.as_ref().map_or(0.0, |d| d.mean * f64::from(lights.map_scale));
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
    fn add_maps(&mut self, layers: Vec<Layer>, previous: Option<&Lights>) {
        match &*layers {
            [] => {}
            [one] => {
                self.map_scale = one.scale as f32;
                self.map_rotation = one.rotation.to_radians() as f32;
                self.dome = Some(one.dome.clone());
            }
            many if previous.is_some_and(|p| p.layers == many) => self.dome = previous.and_then(|p| p.dome.clone()),
            many => {
                let width = many.iter().map(|l| l.dome.map.width).max().unwrap_or(1);
                let height = many.iter().map(|l| l.dome.map.height).max().unwrap_or(1);
                let texel = |i: usize| {
                    let (x, y) = (i as u32 % width, i as u32 / width);
                    let phi = std::f64::consts::TAU * ((f64::from(x) + 0.5) / f64::from(width) - 0.5);
                    let theta = std::f64::consts::PI * (f64::from(y) + 0.5) / f64::from(height);
                    let w = DVec3::new(theta.sin() * phi.sin(), theta.cos(), -theta.sin() * phi.cos());
                    let mut sum = [0.0f32; 3];
                    for layer in many {
                        let rotated = glam::DMat3::from_rotation_y(-layer.rotation.to_radians()) * w;
                        let radiance = layer.dome.map.radiance(rotated);
                        (0..3).for_each(|c| sum[c] += radiance[c] * layer.scale as f32);
                    }
                    sum
                };
                let texels = (0..width as usize * height as usize).into_par_iter().map(texel).collect();
                self.dome = Some(Dome::new(Map { width, height, texels }));
            }
        }
        self.layers = layers;
    }

    /// Sets shares and the reference radiance.
    fn share(&mut self, powers: &[f64], map_radiance: f64) {
        let map_power = std::f64::consts::PI * map_radiance;
        let total: f64 = powers.iter().sum::<f64>() + map_power;
        if self.dome.is_some() {
            self.map_share = if total > 0.0 { (map_power / total) as f32 } else { 0.0 };
        }
        for (light, power) in self.list.iter_mut().zip(powers) {
            light.share = (power / total) as f32;
        }
        if self.map_share <= 0.0 {
            self.dome = None;
        }
        self.list.retain(|l| l.share > 0.0);
        let sphere = 4.0 * std::f64::consts::PI;
        let constant = luminance(self.constant.map(f64::from));
        self.reference =
            ((constant + map_radiance + powers.iter().sum::<f64>() / sphere) as f32).max(f32::MIN_POSITIVE);
    }

    /// Whether the map is that of `other`, apart from its factor and rotation.
    pub fn has_map_of(&self, other: &Lights) -> bool {
        same_dome(&self.dome, &other.dome)
    }

    /// The constants that these lights choose.
    pub fn variant(&self, variant: Variant) -> Variant {
        let has = |kind: u32| self.list.iter().any(|l| l.kind == kind);
        variant
            .flag("LIGHT_SAMPLED", !self.list.is_empty() || self.dome.is_some())
            .flag("LIGHT_HAS_MAP", self.dome.is_some())
            .flag("LIGHT_HAS_LIST", !self.list.is_empty())
            .flag("LIGHT_HAS_MANY", self.list.len() > 1)
            .flag("LIGHT_HAS_DISC", has(DISC))
            .flag("LIGHT_HAS_POINT", has(POINT))
    }

    /// Bind group 2. The dome's own part is kept in `kept`: it is dear, and seldom another one. The list of a frame before,
    /// `previous`, follows the lights' own.
    pub fn bind_group(
        &self,
        gpu: &Gpu,
        layout: &wgpu::BindGroupLayout,
        kept: &mut Option<DomeBuffers>,
        previous: &[GpuLight],
    ) -> wgpu::BindGroup {
        let mut list = self.list.clone();
        list.extend_from_slice(previous);
        list.resize(list.len().max(1), GpuLight::default());
        let list = storage(gpu, "lights", bytemuck::cast_slice(&list));
        let dome = match kept.take().filter(|k| same_dome(&k.dome, &self.dome)) {
            Some(dome) => kept.insert(dome),
            None => kept.insert(DomeBuffers::new(gpu, self.dome.clone())),
        };
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("lights"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: list.as_entire_binding() },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::TextureView(&dome.map) },
                wgpu::BindGroupEntry { binding: 2, resource: dome.table.as_entire_binding() },
            ],
        })
    }

    /// An error if the adapter does not take the map.
    pub fn fits(&self, gpu: &Gpu) -> Result<()> {
        let Some(map) = self.dome.as_ref().map(|d| &d.map) else { return Ok(()) };
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

/// Whether both are the same dome, or none.
fn same_dome(a: &Option<Arc<Dome>>, b: &Option<Arc<Dome>>) -> bool {
    match (a, b) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b),
        (a, b) => a.is_none() && b.is_none(),
    }
}

impl DomeBuffers {
    /// Uploads a dome; a black texel where there is none.
    fn new(gpu: &Gpu, dome: Option<Arc<Dome>>) -> DomeBuffers {
        let nothing = [AliasEntry { threshold: 1.0, alias: 0, pdf: 0.0, pdf_alias: 0.0 }];
        let entries = dome.as_ref().map(|d| &*d.table).filter(|t| !t.is_empty()).unwrap_or(&nothing);
        let table = storage(gpu, "environment table", bytemuck::cast_slice(entries));
        let black = Map { width: 1, height: 1, texels: vec![[0.0; 3]] };
        let map = dome.as_ref().map_or(&black, |d| &d.map);
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
        DomeBuffers { map: texture.create_view(&wgpu::TextureViewDescriptor::default()), table, dome }
    }
}

fn storage(gpu: &Gpu, label: &str, bytes: &[u8]) -> wgpu::Buffer {
    gpu.device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
        label: Some(label),
        contents: bytes,
        usage: wgpu::BufferUsages::STORAGE,
    })
}

fn mean_luminance(map: &Map) -> f64 {
    let row_sum = |row: u32| -> f64 {
        let line = &map.texels[(row * map.width) as usize..][..map.width as usize];
        map.solid_angle(row) * line.iter().map(|t| luminance(t.map(f64::from))).sum::<f64>()
    };
    (0..map.height).map(row_sum).sum::<f64>() / (4.0 * std::f64::consts::PI)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::field::{Profile, Shape};

    #[test]
    fn domes_are_kept_until_they_differ() {
        let field = Field {
            shape: Shape::Analytic { profile: Profile::Constant, low: DVec3::NEG_ONE, high: DVec3::ONE },
            to_world: glam::DMat4::IDENTITY,
            nearest: false,
            grids: vec![],
            grid: String::new(),
            warnings: vec![],
        };
        let sky = || Light::of_kind("sky").expect("listed");
        let mut scene = Scene { lights: vec![sky(), sky()], ..Scene::default() };
        let data = LightData::load(&scene).expect("no files");
        let first = Lights::of(&scene, &data, &field, 1.0, None);
        let kept = |a: &Lights, b: &Lights| match (&a.dome, &b.dome) {
            (Some(a), Some(b)) => Arc::ptr_eq(a, b),
            _ => false,
        };
        scene.camera.fov_y = 20.0;
        assert!(kept(&first, &Lights::of(&scene, &data, &field, 1.0, Some(&first))));
        if let Light::Sky(s) = &mut scene.lights[0] {
            s.scale = 2.0;
        }
        let brighter = Lights::of(&scene, &data, &field, 1.0, Some(&first));
        assert!(!kept(&first, &brighter));
        let mean = |l: &Lights| l.dome.as_ref().map_or(0.0, |d| d.mean);
        assert!((mean(&brighter) / mean(&first) - 1.5).abs() < 1e-3, "two skies, one of twice the strength");
        let fresh = LightData::load(&scene).expect("no files");
        assert!(!kept(&brighter, &Lights::of(&scene, &fresh, &field, 1.0, Some(&brighter))));
    }
}
