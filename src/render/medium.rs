//! The medium on the adapter: density texture and majorant cells.

use std::sync::Arc;

use glam::UVec3;
use wgpu::util::DeviceExt;

use crate::error::{Code, Error, Result};
use crate::gpu::device::Gpu;
use crate::gpu::shader::Variant;
use crate::scene::value::Auto;
use crate::scene::{Control, MajorantKind, Precision, Scene};
use crate::volume::majorant::{Padded, Words, level_sigma};
use crate::volume::proxy::Proxy;

use super::field::{Field, Profile, Shape, density_scale};
use super::tracking;

/// Storage of the density on the adapter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Storage {
    /// No voxels: a formula.
    Analytic,
    /// 32-bit floats.
    F32,
    /// 16-bit floats.
    F16,
    /// 256 levels.
    U8,
}

impl Storage {
    fn of(precision: Precision) -> Storage {
        match precision {
            Precision::F32 => Storage::F32,
            Precision::U8 => Storage::U8,
            Precision::F16 | Precision::Auto => Storage::F16,
        }
    }

    fn format(self) -> wgpu::TextureFormat {
        match self {
            Storage::F32 => wgpu::TextureFormat::R32Float,
            Storage::F16 | Storage::Analytic => wgpu::TextureFormat::R16Float,
            Storage::U8 => wgpu::TextureFormat::R8Unorm,
        }
    }

    fn bytes(self) -> u32 {
        match self {
            Storage::F32 => 4,
            Storage::F16 => 2,
            Storage::U8 | Storage::Analytic => 1,
        }
    }

    /// The value in 0 … 1 that storing `x` leaves.
    fn round(self, x: f32) -> f32 {
        match self {
            Storage::F32 | Storage::Analytic => x,
            Storage::F16 => half::f16::from_f32(x).to_f32(),
            Storage::U8 => (x * 255.0).round() / 255.0,
        }
    }
}

/// What the majorant cells depend on; they are made anew when it changes.
#[derive(Clone, Copy, Debug, PartialEq)]
struct CellKey {
    kind: MajorantKind,
    /// Side of a uniform grid's cells.
    side: Option<u32>,
    /// Extinction per texel that the cells are chosen for; 0 where they do not depend on it.
    sigma: f64,
    control: Option<Control>,
}

/// The density from afar on the adapter, for resampling; one empty texel where nobody asks for it.
pub struct Afar {
    /// Texels along the side of a cell of the finest level.
    pub side: u32,
    /// Cells of the finest level along x, y, z.
    pub size: UVec3,
    /// Levels.
    pub levels: u32,
    /// Bytes of the texture.
    pub bytes: u64,
    texture: wgpu::Texture,
    sampler: wgpu::Sampler,
}

impl Afar {
    fn new(gpu: &Gpu, proxy: Option<&Proxy>) -> Afar {
        let size = proxy.map_or(UVec3::ONE, |p| p.levels[0].size);
        let levels = proxy.map_or(1, |p| p.levels.len() as u32);
        let zero = |x: f32| half::f16::from_f32(x).to_bits().to_le_bytes();
        let bytes: Vec<u8> = match proxy {
            Some(p) => p.levels.iter().flat_map(|l| &l.data).flat_map(|&x| zero(x)).collect(),
            None => zero(0.0).to_vec(),
        };
        let descriptor = wgpu::TextureDescriptor {
            mip_level_count: levels,
            ..texture_3d("density from afar", size, wgpu::TextureFormat::R16Float)
        };
        let order = wgpu::util::TextureDataOrder::LayerMajor;
        let texture = gpu.device.create_texture_with_data(&gpu.queue, &descriptor, order, &bytes);
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("density from afar"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Afar { side: proxy.map_or(1, |p| p.side), size, levels, bytes: bytes.len() as u64, texture, sampler }
    }

    /// Texels that it spans.
    pub fn span(&self) -> UVec3 {
        self.size * self.side
    }
}

/// The medium on the adapter.
pub struct Medium {
    /// Where it comes from.
    pub field: Arc<Field>,
    /// Scene units of one world unit of the shaders.
    pub unit: f64,
    /// Side of a majorant cell in local units.
    pub cell: u32,
    /// Majorant cells along x, y, z.
    pub cells: UVec3,
    /// Storage of the density.
    pub storage: Storage,
    /// Texels, border included.
    pub size: UVec3,
    /// Bytes of the density texture.
    pub volume_bytes: u64,
    /// Bytes of the majorant cells.
    pub majorant_bytes: u64,
    /// Seconds that their making took.
    pub majorant_seconds: f64,
    /// ∫ density dt along a mean column; see [`Field::mean_column`].
    pub mean_column: Option<f64>,
    /// The density from afar.
    pub proxy: Afar,
    padded: Option<Padded>,
    cell_key: CellKey,
    proxy_key: Option<u32>,
    exact: bool,
    texture: wgpu::Texture,
    cell_texture: wgpu::Texture,
    sampler: wgpu::Sampler,
}

impl Medium {
    /// Uploads `field` as `scene` asks.
    pub fn new(gpu: &Gpu, field: Arc<Field>, scene: &Scene) -> Result<Medium> {
        let storage = match field.shape {
            Shape::Dense(_) => Storage::of(scene.volume.precision),
            Shape::Analytic { .. } => Storage::Analytic,
        };
        let (low, high) = field.world_box();
        let diagonal = (high - low).length();
        let unit = if diagonal > 0.0 && diagonal.is_finite() { diagonal } else { 1.0 };
        let padded = match &field.shape {
            Shape::Dense(dense) => {
                fits(gpu, dense.size + 2, storage)?;
                Some(Padded::new(dense, |x| storage.round(x)))
            }
            Shape::Analytic { .. } => None,
        };
        let size = padded.as_ref().map_or(UVec3::ONE, |p| p.size);
        let texture = upload_density(gpu, padded.as_ref(), storage);
        gpu.check()?;
        // Samplers of real devices round the weights; software ones do not, but for 8-bit textures.
        let exact = match storage {
            Storage::F32 => !(gpu.is_software() && gpu.features.contains(wgpu::Features::FLOAT32_FILTERABLE)),
            Storage::U8 => gpu.is_software(),
            Storage::F16 | Storage::Analytic => false,
        };
        // Where 32-bit floats cannot be filtered, the shader interpolates, and the layout takes no filtering sampler.
        let filterable = storage != Storage::F32 || gpu.features.contains(wgpu::Features::FLOAT32_FILTERABLE);
        let filter = if field.nearest || !filterable { wgpu::FilterMode::Nearest } else { wgpu::FilterMode::Linear };
        let sampler = gpu.device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("density"),
            mag_filter: filter,
            min_filter: filter,
            ..Default::default()
        });
        let mean_column = field.mean_column();
        let volume_bytes = u64::from(size.x) * u64::from(size.y) * u64::from(size.z) * u64::from(storage.bytes());
        let placeholder = cells_texture(gpu, &Words { cells: UVec3::ONE, side: 1, channels: 1, words: vec![0] });
        let mut medium = Medium {
            field,
            unit,
            cell: 1,
            cells: UVec3::ONE,
            storage,
            size,
            volume_bytes,
            majorant_bytes: 0,
            majorant_seconds: 0.0,
            mean_column,
            proxy: Afar::new(gpu, None),
            padded,
            proxy_key: None,
            cell_key: CellKey { kind: MajorantKind::Global, side: None, sigma: 0.0, control: None },
            exact,
            texture,
            cell_texture: placeholder,
            sampler,
        };
        medium.cell_key = medium.wanted_cells(scene);
        medium.build_cells(gpu);
        medium.match_proxy(gpu, scene);
        Ok(medium)
    }

    /// Brings the majorant cells up to `scene`; whether anything changed.
    pub fn update(&mut self, gpu: &Gpu, scene: &Scene) -> bool {
        let key = self.wanted_cells(scene);
        let other = self.match_proxy(gpu, scene);
        let changes = key != self.cell_key || other;
        if key != self.cell_key {
            self.cell_key = key;
            self.build_cells(gpu);
        }
        changes
    }

    fn wanted_cells(&self, scene: &Scene) -> CellKey {
        let t = &scene.tracking;
        let side = match (t.majorant, t.cell) {
            (MajorantKind::Grid, Auto::Is(side)) => Some(side),
            _ => None,
        };
        let sigma = if t.majorant == MajorantKind::Global || side.is_some() {
            0.0
        } else {
            // Extinction per texel, by the mean size of a texel.
            let texel = glam::DMat3::from_mat4(self.field.local_from_world()).determinant().abs().cbrt().recip();
            level_sigma(self.sigma(scene) / self.unit * texel)
        };
        let is_level_grid = t.majorant == MajorantKind::Grid && side.is_none();
        let kind = if is_level_grid && tracking::needs_fixed_bounds(t) { MajorantKind::Hierarchy } else { t.majorant };
        CellKey { kind, side, sigma, control: tracking::needs_control(t).then_some(t.control) }
    }

    /// Makes the density from afar where the scene's mode asks for it, or lets it go; whether that is a change.
    fn match_proxy(&mut self, gpu: &Gpu, scene: &Scene) -> bool {
        let key = scene.integrator.mode.reuses().then_some(scene.restir.proxy_cell);
        let changes = key != self.proxy_key;
        if changes {
            self.proxy_key = key;
            // Larger cells where the adapter does not lend so much.
            let most = gpu.limits.max_buffer_size;
            let build = |least, p: &Padded| Proxy::new(p, Proxy::side_within(p.size, least, most));
            let proxy = key.zip(self.padded.as_ref()).map(|(least, p)| build(least, p));
            self.proxy = Afar::new(gpu, proxy.as_ref());
        }
        changes
    }

    fn build_cells(&mut self, gpu: &Gpu) {
        let Some(padded) = &self.padded else { return };
        let CellKey { kind, side, sigma, control } = self.cell_key;
        let begin = std::time::Instant::now();
        let words = match (kind, side) {
            (MajorantKind::Global, _) => Words::global(padded, control),
            (MajorantKind::Grid, Some(side)) => Words::uniform(padded, side, control),
            (MajorantKind::Grid, None) => Words::levels(padded, sigma, control),
            (MajorantKind::KdTree, _) => Words::kd_tree(padded, sigma, control),
            (MajorantKind::Hierarchy, _) => Words::octree(padded, sigma, control),
        };
        self.majorant_seconds = begin.elapsed().as_secs_f64();
        self.cell = words.side;
        self.majorant_bytes = words.bytes();
        self.cells = words.cells;
        self.cell_texture = cells_texture(gpu, &words);
    }

    /// The density scale with "auto" resolved.
    pub fn density_scale(&self, scene: &Scene) -> f64 {
        density_scale(scene, self.mean_column)
    }

    /// Extinction of a stored value of 1 in the strongest channel, per world unit of the shaders.
    pub fn sigma(&self, scene: &Scene) -> f64 {
        let strongest = scene.medium.extinction.0.into_iter().fold(0.0, f64::max);
        self.density_scale(scene) * strongest * self.unit * self.field.max()
    }

    /// A step that surely crosses a cell's face, in local units; far below the half texel that the apron allows.
    pub fn epsilon(&self) -> f32 {
        const ROUNDING: f32 = 1.0 / (1 << 21) as f32;
        self.size.max_element() as f32 * ROUNDING
    }

    /// The slots and constants that this medium decides.
    pub fn variant(&self, variant: Variant) -> Variant {
        let profile = match &self.field.shape {
            Shape::Analytic { profile, .. } => Some(*profile),
            Shape::Dense(_) => None,
        };
        let medium = match (profile, self.field.nearest, self.exact) {
            (Some(Profile::Constant), ..) => "medium/homogeneous",
            (Some(Profile::Linear(..)), ..) => "medium/linear",
            (Some(Profile::Exponential(..)), ..) => "medium/exponential",
            (None, true, _) => "medium/dense_nearest",
            (None, false, true) => "medium/dense_exact",
            (None, false, false) => "medium/dense",
        };
        let majorant = match (profile, self.cell_key.kind) {
            (Some(Profile::Exponential(..)), _) => "majorant/profile",
            (Some(_), _) => "majorant/whole",
            (None, MajorantKind::KdTree) => "majorant/tree",
            (None, _) => "majorant/grid",
        };
        variant
            .slot("proxy", if profile.is_some() { "proxy/analytic" } else { "proxy/dense" })
            .slot("medium", medium)
            .slot("majorant", majorant)
            .flag("MAJORANT_CONTROL", self.cell_key.control.is_some())
            .flag("MAJORANT_TIGHT", profile == Some(Profile::Constant))
            .flag("MEDIUM_NEAREST", self.field.nearest)
    }

    /// Whether the majorants are tight, so that short tracking loops pay.
    pub fn is_local(&self) -> bool {
        self.cell_key.kind != MajorantKind::Global
    }

    /// Whether the density is a formula.
    pub fn is_analytic(&self) -> bool {
        self.storage == Storage::Analytic
    }

    /// Mean size of a texel in world units of the shaders; a share of the box for a formula.
    pub fn texel(&self) -> f64 {
        /// Steps of size 1 across the diagonal of an analytic box.
        const ANALYTIC_STEPS: f64 = 128.0;
        if self.is_analytic() {
            return 1.0 / ANALYTIC_STEPS;
        }
        let local = glam::DMat3::from_mat4(self.field.local_from_world()) * self.unit;
        local.determinant().abs().cbrt().recip()
    }

    /// Bind group 1.
    pub fn bind_group(&self, gpu: &Gpu, layout: &wgpu::BindGroupLayout) -> wgpu::BindGroup {
        let density = self.texture.create_view(&wgpu::TextureViewDescriptor::default());
        let cells = self.cell_texture.create_view(&wgpu::TextureViewDescriptor::default());
        let afar = self.proxy.texture.create_view(&wgpu::TextureViewDescriptor::default());
        gpu.device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("medium"),
            layout,
            entries: &[
                wgpu::BindGroupEntry { binding: 0, resource: wgpu::BindingResource::TextureView(&density) },
                wgpu::BindGroupEntry { binding: 1, resource: wgpu::BindingResource::Sampler(&self.sampler) },
                wgpu::BindGroupEntry { binding: 2, resource: wgpu::BindingResource::TextureView(&cells) },
                wgpu::BindGroupEntry { binding: 3, resource: wgpu::BindingResource::TextureView(&afar) },
                wgpu::BindGroupEntry { binding: 4, resource: wgpu::BindingResource::Sampler(&self.proxy.sampler) },
            ],
        })
    }

    /// Whether the density texture can be filtered by a sampler.
    pub fn filterable(&self, gpu: &Gpu) -> bool {
        self.storage != Storage::F32 || gpu.features.contains(wgpu::Features::FLOAT32_FILTERABLE)
    }
}

/// An error if the adapter does not take a texture of that size.
fn fits(gpu: &Gpu, size: UVec3, storage: Storage) -> Result<()> {
    let bytes = u64::from(size.x) * u64::from(size.y) * u64::from(size.z) * u64::from(storage.bytes());
    let side = gpu.limits.max_texture_dimension_3d;
    let gib = |b: u64| b as f64 / (1u64 << 30) as f64;
    if size.max_element() <= side && bytes <= gpu.limits.max_buffer_size {
        return Ok(());
    }
    let shrink = (gpu.limits.max_buffer_size as f64 / bytes as f64).cbrt().min(1.0);
    let longest = (f64::from(size.max_element()) * shrink).min(f64::from(side)) as u32 - 2;
    Err(Error::new(
        Code::TooLarge,
        format!("The volume takes {:.2} GiB on the adapter: {} × {} × {} texels.", gib(bytes), size.x, size.y, size.z),
    )
    .why(format!("{} lends {:.2} GiB and {side} texels a side.", gpu.info.name, gib(gpu.limits.max_buffer_size)))
    .hint(format!("Resample it: --set volume.max_resolution={longest}")))
}

fn upload_density(gpu: &Gpu, padded: Option<&Padded>, storage: Storage) -> wgpu::Texture {
    let empty = Padded { size: UVec3::ONE, data: vec![0.0], max: 0.0 };
    let padded = padded.unwrap_or(&empty);
    let bytes: Vec<u8> = match storage {
        Storage::F32 => bytemuck::cast_slice(&padded.data).to_vec(),
        Storage::F16 | Storage::Analytic => {
            padded.data.iter().flat_map(|&x| half::f16::from_f32(x).to_bits().to_le_bytes()).collect()
        }
        Storage::U8 => padded.data.iter().map(|&x| (x * 255.0).round() as u8).collect(),
    };
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &texture_3d("density", padded.size, storage.format()),
        wgpu::util::TextureDataOrder::LayerMajor,
        &bytes,
    )
}

fn cells_texture(gpu: &Gpu, words: &Words) -> wgpu::Texture {
    let format = match words.channels {
        1 => wgpu::TextureFormat::R32Uint,
        2 => wgpu::TextureFormat::Rg32Uint,
        _ => wgpu::TextureFormat::Rgba32Uint,
    };
    gpu.device.create_texture_with_data(
        &gpu.queue,
        &texture_3d("majorants", words.cells, format),
        wgpu::util::TextureDataOrder::LayerMajor,
        bytemuck::cast_slice(&words.words),
    )
}

fn texture_3d(label: &str, size: UVec3, format: wgpu::TextureFormat) -> wgpu::TextureDescriptor<'_> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d { width: size.x, height: size.y, depth_or_array_layers: size.z },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D3,
        format,
        usage: wgpu::TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    }
}
