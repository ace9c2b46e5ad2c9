//! What tests that draw share: the adapter, planted errors, and statistics.

#![allow(dead_code)] // each test binary uses its own part

use std::path::Path;
use std::sync::{Arc, Condvar, Mutex, Once};

use nephele::gpu::device::Gpu;
use nephele::gpu::shader::{CATALOGUE, Source};

pub mod statistics;

/// Tests that draw at once: small pictures and the making of kernels keep a software adapter's cores half busy.
const DEVICES: usize = 2;

/// Devices that no test has; those that nobody has asked for yet are not there yet.
static IDLE: (Mutex<Vec<Option<Arc<Gpu>>>>, Condvar) = (Mutex::new(Vec::new()), Condvar::new());

/// A device of the adapter, for one test at a time.
pub struct Adapter {
    pub gpu: Arc<Gpu>,
}

impl Drop for Adapter {
    fn drop(&mut self) {
        give_back(Some(self.gpu.clone()));
    }
}

fn give_back(device: Option<Arc<Gpu>>) {
    IDLE.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner()).push(device);
    IDLE.1.notify_one();
}

/// The adapter; `None` where there is none, which CI does not allow.
pub fn adapter() -> Option<Adapter> {
    static LENT: Once = Once::new();
    LENT.call_once(|| (0..DEVICES).for_each(|_| give_back(None)));
    let mut idle = IDLE.0.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let device = loop {
        match idle.pop() {
            Some(device) => break device,
            None => idle = IDLE.1.wait(idle).unwrap_or_else(|poisoned| poisoned.into_inner()),
        }
    };
    drop(idle);
    let gpu = match device.map_or_else(|| Gpu::headless().map(Arc::new), Ok) {
        Ok(gpu) => gpu,
        Err(e) => {
            give_back(None);
            assert!(std::env::var_os("CI").is_none(), "CI draws on a software adapter: {e}");
            eprintln!("skipped: no adapter");
            return None;
        }
    };
    // What an earlier test left behind is not this one's fault.
    let _ = gpu.check();
    Some(Adapter { gpu })
}

/// Shaders with one error in them.
pub struct Planted {
    pub source: Source,
    _folder: tempfile::TempDir,
}

/// The shaders with `to` in place of `from`, which stands exactly once in `file`.
pub fn plant(file: &str, from: &str, to: &str) -> Planted {
    plant_all(&[(file, from, to)])
}

/// The same with several edits.
pub fn plant_all(edits: &[(&str, &str, &str)]) -> Planted {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for (file, from, to) in edits {
        let path = folder.path().join(format!("{file}.wgsl"));
        let listed = CATALOGUE.iter().find(|(n, _)| n == file).unwrap_or_else(|| panic!("no shader {file}")).1;
        let text = std::fs::read_to_string(&path).unwrap_or_else(|_| listed.to_owned());
        assert_eq!(text.matches(from).count(), 1, "{from:?} must stand once in {file}");
        std::fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).expect("a writable folder");
        std::fs::write(&path, text.replace(from, to)).expect("a writable folder");
    }
    Planted { source: Source { folder: Some(folder.path().to_path_buf()), plants: Vec::new() }, _folder: folder }
}

/// A stream of numbers for choosing test cases; not the one under test.
pub struct Dice(u64);

impl Dice {
    pub fn new(seed: u64) -> Dice {
        Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ 0x1234_5678)
    }

    /// Uniform in [0, 1) (splitmix64, Steele et al. 2014).
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }

    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }

    /// A unit vector, uniform over the sphere.
    pub fn direction(&mut self) -> glam::DVec3 {
        let y = self.between(-1.0, 1.0);
        let (sin, cos) = self.between(0.0, std::f64::consts::TAU).sin_cos();
        let r = (1.0 - y * y).sqrt();
        glam::DVec3::new(r * cos, y, r * sin)
    }
}

/// Writes `texels` (u fastest, the zenith first) as an environment map.
pub fn write_map(path: &Path, width: u32, height: u32, texels: &[[f32; 3]]) {
    use nephele::image::{Image, tone};
    let rgba = texels.iter().flat_map(|&[r, g, b]| [r, g, b, 1.0]).collect();
    let image = Image::from_rgba(width, height, rgba);
    nephele::io::picture::save(path, &image, &nephele::io::picture::Metadata::default(), &tone::Display::default())
        .expect("a writable folder");
}

/// Voxels with empty parts, nearly even parts where bounds are tight, steep edges between them, and odd sizes.
pub fn random_dense(size: [u32; 3], seed: u64) -> nephele::volume::Dense {
    const BLOCK: u32 = 3;
    let mut dice = Dice::new(seed);
    let mut data: Vec<f32> = Vec::new();
    for z in 0..size[2] {
        for y in 0..size[1] {
            for x in 0..size[0] {
                let number = x / BLOCK + 100 * (y / BLOCK) + 10_000 * (z / BLOCK);
                let mut block = Dice::new(seed + 7919 * u64::from(number));
                let value = if block.next() < 0.4 { 0.0 } else { block.between(0.2, 5.0) };
                data.push((value * dice.between(0.98, 1.0)) as f32);
            }
        }
    }
    let world_from_index = glam::DMat4::from_scale(glam::DVec3::splat(0.25));
    nephele::volume::Dense { size: size.into(), data, world_from_index, warnings: Vec::new() }
}

/// A field of those voxels where they are.
pub fn field_of(dense: nephele::volume::Dense, to_world: glam::DMat4, nearest: bool) -> nephele::render::field::Field {
    nephele::render::field::Field {
        shape: nephele::render::field::Shape::Dense(dense),
        to_world,
        nearest,
        grids: Vec::new(),
        grid: String::new(),
        warnings: Vec::new(),
    }
}
