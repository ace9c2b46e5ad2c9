//! The adapter and its device.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex};

use crate::error::{Code, Error, Result};

/// Features that make things faster or exact where an adapter has them; everything works without.
const WANTED: wgpu::Features = wgpu::Features::FLOAT32_FILTERABLE.union(wgpu::Features::TIMESTAMP_QUERY);

/// The graphics device that everything is drawn on.
pub struct Gpu {
    /// Where adapters come from.
    pub instance: wgpu::Instance,
    /// The adapter in use.
    pub adapter: wgpu::Adapter,
    /// Its device.
    pub device: wgpu::Device,
    /// Its queue.
    pub queue: wgpu::Queue,
    /// Name, kind, driver.
    pub info: wgpu::AdapterInfo,
    /// Features that the device has.
    pub features: wgpu::Features,
    /// Limits that the device was opened with: the adapter's own.
    pub limits: wgpu::Limits,
    lost: Arc<AtomicBool>,
    errors: Arc<Mutex<Vec<String>>>,
}

/// An instance for the backends that the environment names (`WGPU_BACKEND`); else for the modern ones, and with GL only
/// where those have no adapter: GL is slow to ask and prints to stderr.
pub fn instance() -> wgpu::Instance {
    instance_by(wgpu::InstanceDescriptor::new_without_display_handle_from_env)
}

/// The same for windows of `display`, which GL has to know before it can show anything.
pub fn instance_on(display: impl wgpu::wgt::WgpuHasDisplayHandle + Clone + 'static) -> wgpu::Instance {
    instance_by(|| wgpu::InstanceDescriptor::new_with_display_handle_from_env(Box::new(display.clone())))
}

fn instance_by(descriptor: impl Fn() -> wgpu::InstanceDescriptor) -> wgpu::Instance {
    if std::env::var_os("WGPU_BACKEND").is_some() {
        return wgpu::Instance::new(descriptor());
    }
    let modern = wgpu::InstanceDescriptor { backends: wgpu::Backends::PRIMARY, ..descriptor() };
    let modern = wgpu::Instance::new(modern);
    if !adapters(&modern).is_empty() {
        return modern;
    }
    wgpu::Instance::new(descriptor())
}

/// Every adapter of an instance, best first.
pub fn adapters(instance: &wgpu::Instance) -> Vec<wgpu::Adapter> {
    let mut all = pollster::block_on(instance.enumerate_adapters(wgpu::Backends::all()));
    all.sort_by_key(|a| rank(&a.get_info()));
    all
}

/// Real devices before software ones.
fn rank(info: &wgpu::AdapterInfo) -> u8 {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => 0,
        wgpu::DeviceType::IntegratedGpu => 1,
        wgpu::DeviceType::VirtualGpu => 2,
        wgpu::DeviceType::Other => 3,
        wgpu::DeviceType::Cpu => 4,
    }
}

/// The message for a machine without any adapter.
fn no_adapter(why: String) -> Error {
    Error::new(Code::NoAdapter, "No graphics adapter can be used.").why(why).hint(
        "Install a driver; a software one works: `apt install mesa-vulkan-drivers libvulkan1`. See `nephele doctor`.",
    )
}

impl Gpu {
    /// Opens the best adapter (`NEPHELE_ADAPTER`: the best whose name holds that text) that can draw on `surface`.
    pub fn open(instance: wgpu::Instance, surface: Option<&wgpu::Surface>) -> Result<Gpu> {
        let wanted = std::env::var("NEPHELE_ADAPTER").unwrap_or_default();
        let all = adapters(&instance);
        let names: Vec<String> = all.iter().map(|a| a.get_info().name).collect();
        let fits = |a: &wgpu::Adapter| {
            a.get_info().name.to_lowercase().contains(&wanted.to_lowercase())
                && surface.is_none_or(|s| a.is_surface_supported(s))
        };
        let adapter = all.into_iter().find(fits).ok_or_else(|| {
            no_adapter(match (names.is_empty(), wanted.is_empty()) {
                (true, _) => "There is no Vulkan, Metal, DX12 or GL driver.".into(),
                (false, true) => format!("None of these can draw on the window: {}.", names.join(", ")),
                (false, false) => format!("NEPHELE_ADAPTER is {wanted:?}; there are: {}.", names.join(", ")),
            })
        })?;
        Gpu::on(instance, adapter)
    }

    /// Opens `adapter`.
    pub fn on(instance: wgpu::Instance, adapter: wgpu::Adapter) -> Result<Gpu> {
        let info = adapter.get_info();
        let features = adapter.features() & WANTED;
        let limits = adapter.limits();
        let opened = pollster::block_on(adapter.request_device(&wgpu::DeviceDescriptor {
            label: Some("nephele"),
            required_features: features,
            required_limits: limits.clone(),
            ..Default::default()
        }));
        let (device, queue) = opened.map_err(|e| no_adapter(format!("{} refuses: {e}", info.name)))?;
        let lost = Arc::new(AtomicBool::new(false));
        let errors = Arc::new(Mutex::new(Vec::new()));
        let flag = lost.clone();
        device.set_device_lost_callback(move |reason, message| {
            if reason != wgpu::DeviceLostReason::Destroyed {
                log::error!("device lost: {message}");
            }
            flag.store(true, Ordering::Relaxed);
        });
        let sink = errors.clone();
        device.on_uncaptured_error(Arc::new(move |e: wgpu::Error| {
            let text = e.to_string();
            let mut all = sink.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
            if !all.contains(&text) {
                log::error!("{text}");
                all.push(text);
            }
        }));
        Ok(Gpu { instance, adapter, device, queue, info, features, limits, lost, errors })
    }

    /// Opens a device for work without a window.
    pub fn headless() -> Result<Gpu> {
        Gpu::open(instance(), None)
    }

    /// Whether the adapter is a program on the CPU.
    pub fn is_software(&self) -> bool {
        self.info.device_type == wgpu::DeviceType::Cpu
    }

    /// The API in lower case: `vulkan`, `gl`, `metal`, `dx12`.
    pub fn backend(&self) -> String {
        self.info.backend.to_str().to_lowercase()
    }

    /// Whether the device went away: nothing that is on it can be used any more, and only a new one helps.
    pub fn is_lost(&self) -> bool {
        self.lost.load(Ordering::Relaxed)
    }

    /// Gives the device away as a driver's reset would, to try what follows.
    pub fn lose(&self) {
        self.device.destroy();
        // The loss is told when all work is done; that it happened is no news here.
        let _ = self.wait();
    }

    /// An error if the device was lost or reported errors since the last call.
    pub fn check(&self) -> Result<()> {
        if self.is_lost() {
            return Err(Error::new(Code::DeviceLost, "The graphics device was reset.")
                .why("A driver time-out, an update or sleep.")
                .hint("Start again; with smaller pictures if it comes back."));
        }
        let mut errors = self.errors.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        match errors.drain(..).next() {
            None => Ok(()),
            Some(text) => {
                let memory = text.to_lowercase().contains("memory");
                let code = if memory { Code::Oom } else { Code::Failed };
                // The cause stands at the end of wgpu's messages.
                let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
                Err(Error::new(code, format!("{} reports an error.", self.info.name)).why(line))
            }
        }
    }

    /// Waits until all submitted work is done.
    pub fn wait(&self) -> Result<()> {
        let wait = || self.device.poll(wgpu::PollType::wait_indefinitely());
        // wgpu panics where the driver loses the device while one waits for it.
        let why = match std::panic::catch_unwind(std::panic::AssertUnwindSafe(wait)) {
            Ok(Ok(_)) => return self.check(),
            Ok(Err(e)) => e.to_string(),
            Err(_) => "The driver lost it.".into(),
        };
        self.lost.store(true, Ordering::Relaxed);
        Err(Error::new(Code::DeviceLost, "The graphics device does not answer.").why(why))
    }
}
