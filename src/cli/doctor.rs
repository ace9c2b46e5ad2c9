//! `nephele doctor`: what graphics there is, what nephele makes of it, what is missing; and a self-test of closed forms.

use std::io::Write;
use std::sync::Arc;

use serde_json::{Value, json};

use crate::error::{Error, Result};
use crate::gpu::device::{Gpu, adapters, instance};
use crate::gpu::shader::Source;
use crate::render::field::Field;
use crate::render::film::Sums;
use crate::render::medium::Medium;
use crate::render::{Renderer, Work};
use crate::scene::Scene;

/// Flags of `doctor`.
#[derive(Debug, clap::Args)]
pub struct DoctorArgs {
    /// Draw closed forms on this adapter and compare
    #[arg(long)]
    pub self_test: bool,
    /// As JSON
    #[arg(long)]
    pub json: bool,
}

/// Bytes of a gibibyte.
const GIB: f64 = (1u64 << 30) as f64;

/// Writes the report to `out`. Without any adapter the report comes first, then the error.
pub fn run(args: &DoctorArgs, out: &mut dyn Write) -> Result<()> {
    let instance = instance();
    let all: Vec<Value> = adapters(&instance)
        .iter()
        .map(|a| {
            let i = a.get_info();
            json!({
                "name": i.name, "kind": format!("{:?}", i.device_type), "backend": i.backend.to_str(),
                "driver": i.driver, "driver_info": i.driver_info,
            })
        })
        .collect();
    let display = std::env::var("WAYLAND_DISPLAY").or_else(|_| std::env::var("DISPLAY")).unwrap_or_default();
    let opened = Gpu::open(instance, None);
    let mut report = json!({ "version": env!("CARGO_PKG_VERSION"), "adapters": all, "display": display });
    let mut failed = Vec::new();
    if let Ok(gpu) = &opened {
        report["used"] = used(gpu);
        if args.self_test {
            let checks = self_test(Gpu::headless()?)?;
            failed = checks.iter().filter(|c| !c.passes).map(|c| c.name).collect();
            report["self_test"] = checks.iter().map(Check::to_json).collect();
        }
    }
    let text = if args.json { format!("{report:#}\n") } else { for_people(&report) };
    out.write_all(text.as_bytes()).map_err(|e| Error::writing("standard output".as_ref(), &e))?;
    opened?;
    if failed.is_empty() {
        return Ok(());
    }
    Err(Error::new(crate::error::Code::Failed, format!("The self-test failed: {}.", failed.join(", ")))
        .why("This adapter or its driver does not compute as it should.")
        .hint("Try another adapter by NEPHELE_ADAPTER, or a newer driver; please report it."))
}

fn used(gpu: &Gpu) -> Value {
    let l = &gpu.limits;
    let side = |bytes: f64| (l.max_buffer_size as f64 / bytes).cbrt().min(f64::from(l.max_texture_dimension_3d)) as u32;
    json!({
        "name": gpu.info.name,
        "backend": gpu.backend(),
        "software": gpu.is_software(),
        "float32_filterable": gpu.features.contains(wgpu::Features::FLOAT32_FILTERABLE),
        "timestamps": gpu.features.contains(wgpu::Features::TIMESTAMP_QUERY),
        "max_texture_dimension_3d": l.max_texture_dimension_3d,
        "max_buffer_gib": l.max_buffer_size as f64 / GIB,
        "max_binding_gib": l.max_storage_buffer_binding_size as f64 / GIB,
        "largest_cube": { "f32": side(4.0), "f16": side(2.0), "u8": side(1.0) },
        "storage": "f16",
    })
}

fn for_people(report: &Value) -> String {
    let text = |v: &Value| v.as_str().map_or_else(|| v.to_string(), str::to_owned);
    let mut out = format!("nephele {}\n\nAdapters, best first\n", text(&report["version"]));
    let adapters = report["adapters"].as_array().cloned().unwrap_or_default();
    for a in &adapters {
        out += &format!(
            "  {} · {} · {} · {} {}\n",
            text(&a["name"]),
            text(&a["kind"]),
            text(&a["backend"]),
            text(&a["driver"]),
            text(&a["driver_info"])
        );
    }
    if adapters.is_empty() {
        out += "  none. Debian, Ubuntu: apt install mesa-vulkan-drivers libvulkan1 (works without a GPU)\n";
    }
    if let Some(used) = report["used"].as_object() {
        out += "\nIn use (NEPHELE_ADAPTER chooses another)\n";
        for (key, value) in used {
            out += &format!("  {key:<26}{}\n", text(value));
        }
        if used["software"] == true {
            out += "  Pictures are right, but slow: no GPU driver was found.\n";
        }
    }
    let display = text(&report["display"]);
    out += &match display.as_str() {
        "" => "\nDisplay: none, so no window. `nephele render INPUT -o picture.png` works.\n".to_owned(),
        name => format!("\nDisplay: {name}\n"),
    };
    if let Some(checks) = report["self_test"].as_array() {
        out += "\nSelf-test\n";
        for c in checks {
            let verdict = if c["passes"] == true { "pass" } else { "FAIL" };
            let number = |key: &str| c[key].as_f64().unwrap_or(f64::NAN);
            let (name, got, want, within) =
                (text(&c["name"]), number("measured"), number("expected"), number("within"));
            out += &format!("  {verdict}  {name:<34}{got:>11.6}  expected {want:>9.6} ± {within:.6}\n");
        }
    }
    out
}

/// One closed form and what was measured.
struct Check {
    name: &'static str,
    measured: f64,
    expected: f64,
    within: f64,
    passes: bool,
}

impl Check {
    fn new(name: &'static str, measured: f64, expected: f64, within: f64) -> Check {
        Check { name, measured, expected, within, passes: (measured - expected).abs() <= within }
    }

    fn to_json(&self) -> Value {
        json!({
            "name": self.name, "measured": self.measured, "expected": self.expected,
            "within": self.within, "passes": self.passes,
        })
    }
}

/// Standard errors that a stochastic check may be off by.
const SIGMAS: f64 = 5.0;
/// Slack for rounding in 32-bit floats.
const ROUNDING: f64 = 1e-5;

/// A unit cube seen by a narrow camera along −x, an eye of direction light, and what the scene adds.
const CUBE: &str = "[volume]\nanalytic = \"homogeneous\"\nbounds = [[0,0,0],[1,1,1]]\n[camera]\nposition = [2,0.5,0.5]\n\
    target = [0,0.5,0.5]\nfov_y = 0.2\n[film]\nwidth = 32\nheight = 32\n";
const FURNACE: &str = "[volume]\nprocedural = \"cumulus\"\nresolution = 32\n[medium]\nalbedo = [1,1,1]\n\
    [[lights]]\nkind = \"constant\"\nradiance = [1,1,1]\n[film]\nwidth = 32\nheight = 32\n[integrator]\nmax_bounces = \"unlimited\"\n";
const CLOUD: &str = "[volume]\nprocedural = \"cumulus\"\nresolution = 32\n[medium]\nphase = \"isotropic\"\n\
    [film]\nwidth = 32\nheight = 32\n";

fn draw(gpu: &Arc<Gpu>, text: &str, samples: u32) -> Result<Sums> {
    let scene = Scene::parse(text, "self-test", std::path::Path::new(""))?;
    let field = Arc::new(Field::load(&scene.volume)?);
    let medium = Medium::new(gpu, field, &scene)?;
    let size = (scene.film.width, scene.film.height);
    let mut renderer = Renderer::new(gpu.clone(), Source::standard(), &scene, medium, size, false)?;
    while renderer.progress().samples < samples {
        let left = samples - renderer.progress().samples;
        renderer.submit(Work { samples: left, groups: u32::MAX })?;
        gpu.wait()?;
    }
    renderer.film.read(gpu)
}

/// Mean of the red channel and its standard error.
fn mean(sums: &Sums) -> (f64, f64) {
    let n = sums.sum.len() as f64;
    let mean = (0..sums.sum.len()).map(|p| sums.mean(p)[0]).sum::<f64>() / n;
    let variance = (0..sums.sum.len()).filter_map(|p| sums.variance(p)).map(|v| v[0]).sum::<f64>() / (n * n);
    (mean, variance.sqrt())
}

fn self_test(gpu: Gpu) -> Result<Vec<Check>> {
    let gpu = Arc::new(gpu);
    let mut checks = Vec::new();
    let furnace = draw(&gpu, FURNACE, 16)?;
    let worst = (0..furnace.sum.len()).map(|p| (furnace.mean(p)[0] - 1.0).abs()).fold(0.0, f64::max);
    checks.push(Check::new("white furnace, worst pixel", 1.0 + worst, 1.0, 3e-3));
    let mut stochastic = |name, sums: &Sums, expected: f64| {
        let (measured, error) = mean(sums);
        checks.push(Check::new(name, measured, expected, SIGMAS * error + ROUNDING));
    };
    let absorb = format!(
        "{CUBE}[medium]\ndensity_scale = 1\nalbedo = [0,0,0]\n[[lights]]\nkind = \"constant\"\nradiance = [1,1,1]\n"
    );
    stochastic("transmittance of depth 1", &draw(&gpu, &absorb, 256)?, (-1f64).exp());
    // Single scattering of a unit cube at extinction 1, isotropic: p · K with K of the side and the back (closed forms).
    let single = |direction: &str| {
        format!(
            "{CUBE}[medium]\ndensity_scale = 1\nalbedo = [1,1,1]\nphase = \"isotropic\"\n[[lights]]\nkind = \"sun\"\n\
             direction = {direction}\nirradiance = [1,1,1]\n[integrator]\nmax_bounces = 1\n"
        )
    };
    let p = 0.25 / std::f64::consts::PI;
    let side = (-0.5f64).exp() * (1.0 - (-1f64).exp());
    stochastic("single scattering, sun at the side", &draw(&gpu, &single("[0,1,0]"), 1024)?, p * side);
    stochastic(
        "single scattering, sun behind",
        &draw(&gpu, &single("[1,0,0]"), 1024)?,
        p * (1.0 - (-2f64).exp()) / 2.0,
    );
    let grid = draw(&gpu, CLOUD, 128)?;
    let global = draw(&gpu, &format!("{CLOUD}[tracking]\nmajorant = \"global\"\n"), 128)?;
    let ((a, ea), (b, eb)) = (mean(&grid), mean(&global));
    checks.push(Check::new("grid against global majorant", a, b, SIGMAS * ea.hypot(eb)));
    let again = draw(&gpu, CLOUD, 128)?;
    checks.push(Check::new("same picture twice (1: yes)", f64::from(u8::from(again == grid)), 1.0, 0.0));
    Ok(checks)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_report_names_what_is_missing() {
        let text = for_people(&json!({ "version": "1", "adapters": [], "display": "" }));
        assert!(text.contains("mesa-vulkan-drivers") && text.contains("no window"), "{text}");
    }

    #[test]
    fn a_check_fails_beyond_its_tolerance() {
        assert!(Check::new("x", 1.01, 1.0, 0.02).passes && !Check::new("x", 1.03, 1.0, 0.02).passes);
        assert!(!Check::new("x", f64::NAN, 1.0, 0.02).passes);
    }
}
