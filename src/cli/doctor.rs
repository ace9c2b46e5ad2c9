//! `nephele doctor`: what graphics there is, what nephele makes of it, what is missing and how to get it; and the
//! self-test.

use std::io::Write;
use std::sync::Arc;

use serde_json::{Value, json};

use crate::error::{Code, Error, Result};
use crate::gpu::device::{Gpu, adapters, instance};
use crate::gpu::shader::{Source, Variant};
use crate::render::Renderer;
use crate::render::field::Field;
use crate::render::medium::{Medium, Storage};
use crate::render::self_test::{CHECKS, Check, Outcome};
use crate::scene::{MajorantKind, Precision, Procedural, Scene};

mod system;

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
/// Texels that the density texture has more than voxels, along each side.
const BORDER: u32 = 2;
/// Bytes of a pixel in each buffer of the film.
const FILM_BYTES: u64 = 16;

/// Writes the report to `out`. Without any adapter the report comes first, then the error.
pub fn run(args: &DoctorArgs, out: &mut dyn Write) -> Result<()> {
    let instance = instance();
    let all: Vec<wgpu::AdapterInfo> = adapters(&instance).iter().map(wgpu::Adapter::get_info).collect();
    let opened = Gpu::open(instance, None).map(Arc::new);
    let used = opened.as_ref().ok().map(|gpu| used(gpu, &all)).transpose()?;
    let software = opened.as_ref().is_ok_and(|gpu| gpu.is_software());
    let mut report = json!({
        "version": env!("CARGO_PKG_VERSION"),
        "system": std::env::consts::OS,
        "adapters": all.iter().map(adapter_json).collect::<Value>(),
        "used": used,
        "environment": system::environment(),
        "display": system::display(),
        "missing": system::missing(all.is_empty(), software),
    });
    let mut print = |text: &str| {
        let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
        written.map_err(|e| Error::writing("standard output".as_ref(), &e))
    };
    if !args.json {
        print(&for_people(&report))?;
    }
    let result = match &opened {
        Err(e) => Err(e.clone()),
        Ok(gpu) if args.self_test => {
            if !args.json {
                print("\nSelf-test\n")?;
            }
            let mut lines = Vec::new();
            let result = self_test(
                CHECKS,
                |check| check.run(gpu, &Source::standard()),
                |check, found| {
                    lines.push(check_json(check, found));
                    if args.json { Ok(()) } else { print(&check_line(check, found)) }
                },
            );
            report["self_test"] = lines.into();
            result
        }
        Ok(_) => Ok(()),
    };
    if args.json {
        if let Err(e) = &result {
            report["error"] = e.to_json();
        }
        print(&format!("{report:#}\n"))?;
    }
    result
}

fn adapter_json(info: &wgpu::AdapterInfo) -> Value {
    json!({
        "name": info.name, "kind": kind(info), "backend": info.backend.to_str(),
        "driver": info.driver, "driver_info": info.driver_info,
    })
}

fn kind(info: &wgpu::AdapterInfo) -> &'static str {
    match info.device_type {
        wgpu::DeviceType::DiscreteGpu => "discrete GPU",
        wgpu::DeviceType::IntegratedGpu => "integrated GPU",
        wgpu::DeviceType::VirtualGpu => "virtual GPU",
        wgpu::DeviceType::Cpu => "software on the CPU",
        wgpu::DeviceType::Other => "other",
    }
}

/// Why `Gpu::open` took this one.
fn why(used: &wgpu::AdapterInfo, all: &[wgpu::AdapterInfo], wanted: &str) -> String {
    if !wanted.is_empty() {
        return format!("NEPHELE_ADAPTER asks for {wanted:?}");
    }
    if all.len() == 1 {
        return "it is the only one".to_owned();
    }
    let same = all.iter().filter(|a| a.device_type == used.device_type).count();
    let first = if same > 1 { "the first of its kind; " } else { "" };
    format!("{first}discrete GPUs come before integrated, virtual and software ones")
}

/// What is used, and what the renderer decides on it.
fn used(gpu: &Arc<Gpu>, all: &[wgpu::AdapterInfo]) -> Result<Value> {
    let l = &gpu.limits;
    let texels = |bytes: f64| (l.max_buffer_size as f64 / bytes).cbrt().min(f64::from(l.max_texture_dimension_3d));
    let side = |bytes: f64| (texels(bytes) as u32).saturating_sub(BORDER);
    let feature = |flag, for_what: &str, without: &str| {
        let there = gpu.features.contains(flag);
        json!({ "there": there, "for": for_what, "without": without })
    };
    let wanted = std::env::var("NEPHELE_ADAPTER").unwrap_or_default();
    let mut used = adapter_json(&gpu.info);
    used["why"] = why(&gpu.info, all, &wanted).into();
    used["software"] = gpu.is_software().into();
    used["limits"] = json!({
        "max_texture_dimension_2d": l.max_texture_dimension_2d,
        "max_texture_dimension_3d": l.max_texture_dimension_3d,
        "max_buffer_gib": l.max_buffer_size as f64 / GIB,
        "max_binding_gib": l.max_storage_buffer_binding_size as f64 / GIB,
        "max_storage_buffers": l.max_storage_buffers_per_shader_stage,
        "max_workgroup_invocations": l.max_compute_invocations_per_workgroup,
    });
    used["largest_cube"] = json!({ "f32": side(4.0), "f16": side(2.0), "u8": side(1.0) });
    used["largest_picture_pixels"] = (l.max_storage_buffer_binding_size.min(l.max_buffer_size) / FILM_BYTES).into();
    used["features"] = json!({
        "float32_filterable": feature(
            wgpu::Features::FLOAT32_FILTERABLE,
            "samplers for 32-bit volumes",
            "the shader interpolates them: the same picture, slower",
        ),
        "timestamps": feature(
            wgpu::Features::TIMESTAMP_QUERY,
            "times of single passes in benchmarks",
            "benchmarks take the time from outside",
        ),
    });
    used["choices"] = choices(gpu)?;
    Ok(used)
}

/// What the renderer decides for this adapter, asked of the renderer itself with a small volume.
fn choices(gpu: &Arc<Gpu>) -> Result<Value> {
    /// Voxels along the longest side: the fewest that the recipe makes.
    const VOXELS: u32 = 16;
    /// Pixels along the side of a picture that nobody draws.
    const SIDE: u32 = 8;
    let mut scene = Scene::default();
    (scene.volume.procedural, scene.volume.resolution) = (Procedural::Cumulus, VOXELS);
    let field = Arc::new(Field::load(&scene.volume)?);
    let medium = |scene: &Scene| Medium::new(gpu, field.clone(), scene);
    let mut renderer = Renderer::new(gpu.clone(), Source::standard(), &scene, medium(&scene)?, (SIDE, SIDE), false)?;
    let auto = storage_name(renderer.medium.storage);
    let grid = track_steps(&renderer.variant());
    scene.tracking.majorant = MajorantKind::Global;
    renderer.update(&scene, (SIDE, SIDE), None)?;
    let global = track_steps(&renderer.variant());
    let mut interpolation = json!({});
    for precision in [Precision::F32, Precision::F16, Precision::U8] {
        scene.volume.precision = precision;
        renderer.update(&scene, (SIDE, SIDE), Some(medium(&scene)?))?;
        interpolation[storage_name(renderer.medium.storage)] = sampler(&renderer.variant()).into();
    }
    Ok(json!({
        "storage": auto,
        "storage_why": storage_why(auto),
        "interpolation": interpolation,
        "tracking_steps": { "grid": grid, "global": global },
    }))
}

fn storage_name(storage: Storage) -> &'static str {
    match storage {
        Storage::Analytic => "none",
        Storage::F32 => "f32",
        Storage::F16 => "f16",
        Storage::U8 => "u8",
    }
}

/// Why `precision = "auto"` is what it is.
fn storage_why(storage: &str) -> &'static str {
    match storage {
        "f16" => {
            "half the memory of 32-bit floats, and samplers are fastest with it; errors stay below 1/2048 of a value"
        }
        "u8" => "a quarter of the memory of 32-bit floats",
        _ => "exact",
    }
}

/// Tracking steps of one turn of the path tracer's loop.
fn track_steps(variant: &Variant) -> u32 {
    let value = variant.constants.iter().find(|(name, _)| *name == "TRACK_STEPS").map(|(_, value)| value);
    value.and_then(|v| v.trim_end_matches('u').parse().ok()).expect("every variant of the path tracer sets it")
}

/// Who interpolates between voxels.
fn sampler(variant: &Variant) -> &'static str {
    match variant.slots.iter().find(|(slot, _)| *slot == "medium") {
        Some((_, "medium/dense")) => "sampler",
        _ => "shader",
    }
}

fn text(v: &Value) -> String {
    v.as_str().map_or_else(|| v.to_string(), str::to_owned)
}

fn entries(v: &Value) -> impl Iterator<Item = (&String, &Value)> {
    v.as_object().into_iter().flatten()
}

fn list(v: &Value) -> impl Iterator<Item = &Value> {
    v.as_array().into_iter().flatten()
}

fn for_people(report: &Value) -> String {
    let mut out =
        format!("nephele {} on {}\n\nAdapters, best first\n", text(&report["version"]), text(&report["system"]));
    for a in list(&report["adapters"]) {
        let [name, kind, backend, driver, info] =
            ["name", "kind", "backend", "driver", "driver_info"].map(|k| text(&a[k]));
        out += &format!("  {name} · {kind} · {backend} · {driver} {info}\n");
    }
    if list(&report["adapters"]).next().is_none() {
        out += "  none\n";
    }
    let used = &report["used"];
    if !used.is_null() {
        out += &used_for_people(used);
    }
    for (name, value) in entries(&report["environment"]) {
        out += &format!("\nEnvironment: {name}={}\n", text(value));
    }
    out += &match &report["display"] {
        Value::Null => "\nDisplay: none, so no window. `nephele render INPUT -o picture.png` works.\n".to_owned(),
        name => format!("\nDisplay: {}\n", text(name)),
    };
    let mut missing = list(&report["missing"]).peekable();
    if missing.peek().is_some() {
        out += "\nMissing\n";
    }
    for m in missing {
        out += &format!("  {}\n    {}\n", text(&m["what"]), text(&m["how"]).replace('\n', "\n    "));
    }
    out
}

fn used_for_people(used: &Value) -> String {
    let mut out = format!("\nIn use: {}, for {}.\n", text(&used["name"]), text(&used["why"]));
    out += "  NEPHELE_ADAPTER=part-of-a-name chooses another.\n";
    let mut line = |name: &str, value: String| out += &format!("  {name:<26}{value}\n");
    for (name, value) in entries(&used["limits"]) {
        let short = value.as_f64().filter(|_| value.is_f64()).map(|x| format!("{x:.3}"));
        line(name, short.unwrap_or_else(|| value.to_string()));
    }
    let cube = |bits: &str| format!("{}³ as {bits}", used["largest_cube"][bits]);
    line("largest volume", ["f32", "f16", "u8"].map(cube).join(", "));
    line("largest picture", format!("{:.1} megapixels", used["largest_picture_pixels"].as_f64().unwrap_or(0.0) / 1e6));
    for (name, f) in entries(&used["features"]) {
        let value = if f["there"] == true {
            format!("yes, for {}", text(&f["for"]))
        } else {
            format!("no: {}", text(&f["without"]))
        };
        line(name, value);
    }
    let choices = &used["choices"];
    line("storage by default", format!("{}: {}", text(&choices["storage"]), text(&choices["storage_why"])));
    for (storage, by) in entries(&choices["interpolation"]) {
        line(&format!("interpolation, {storage}"), format!("by the {}", text(by)));
    }
    let steps = &choices["tracking_steps"];
    line(
        "tracking steps a turn",
        format!("{} with a grid of majorants, {} with one for all", steps["grid"], steps["global"]),
    );
    if used["software"] == true {
        out += "  Pictures are right, but slow: this adapter is a program on the CPU.\n";
    }
    out
}

/// Runs `checks` one after another by `run`; each is shown when it is done. An error that names those that fail.
fn self_test(
    checks: &[Check],
    run: impl Fn(&Check) -> Result<Outcome>,
    mut show: impl FnMut(&Check, &Result<Outcome>) -> Result<()>,
) -> Result<()> {
    let mut failed = Vec::new();
    for check in checks {
        let found = run(check);
        show(check, &found)?;
        match found {
            Ok(found) if found.passes() => {}
            // Whatever comes after it fails too.
            Err(e) if e.code == Code::DeviceLost => return Err(e),
            _ => failed.push(check.name),
        }
    }
    if failed.is_empty() {
        return Ok(());
    }
    Err(Error::new(Code::Failed, format!("The self-test failed: {}.", failed.join("; ")))
        .why("This adapter or its driver does not compute as it should.")
        .hint("Try another adapter by NEPHELE_ADAPTER, or a newer driver; please report it."))
}

fn passes(found: &Result<Outcome>) -> bool {
    found.as_ref().is_ok_and(Outcome::passes)
}

fn check_json(check: &Check, found: &Result<Outcome>) -> Value {
    let mut line = json!({ "name": check.name, "proves": check.proves, "passes": passes(found) });
    match found {
        Ok(o) => [("measured", o.measured), ("expected", o.expected), ("within", o.within)].into_iter().for_each(
            |(key, x)| line[key] = if x.is_finite() { x.into() } else { x.to_string().to_lowercase().into() },
        ),
        Err(e) => line["error"] = e.to_json(),
    }
    line
}

fn check_line(check: &Check, found: &Result<Outcome>) -> String {
    let verdict = if passes(found) { "pass" } else { "FAIL" };
    let figures = match found {
        Ok(Outcome { measured, expected, within }) => {
            format!("{measured:>10.6}  expected {expected:>9.6} ± {within:.6}")
        }
        Err(e) => e.to_string().replace('\n', " "),
    };
    let proves = if passes(found) { String::new() } else { format!("; should show that {}", check.proves) };
    format!("  {verdict}  {:<38}{figures}{proves}\n", check.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::self_test::Measure;

    fn check(name: &'static str) -> Check {
        Check { name, proves: "it is one", measure: Measure::Estimator(|_| {}) }
    }

    #[test]
    fn failed_checks_are_named_and_do_not_stop_the_others() {
        let checks = [check("first"), check("second"), check("third"), check("fourth")];
        let outcome = |measured| Outcome { measured, expected: 1.0, within: 0.1 };
        let mut shown = String::new();
        let mut lines = Vec::new();
        let error = self_test(
            &checks,
            |c| match c.name {
                "first" => Ok(outcome(1.05)),
                "second" => Ok(outcome(1.5)),
                "third" => Err(Error::new(Code::Shader, "It does not build.").why("A driver.")),
                _ => Ok(outcome(f64::NAN)),
            },
            |c, found| {
                shown += &check_line(c, found);
                lines.push(check_json(c, found));
                Ok(())
            },
        );
        let error = error.expect_err("three fail");
        assert_eq!((error.code, error.code.exit()), (Code::Failed, 1));
        assert!(error.what.contains("second; third; fourth") && !error.what.contains("first"), "{error}");
        assert_eq!(shown.matches("pass").count(), 1, "{shown}");
        assert_eq!(shown.matches("FAIL").count(), 3, "{shown}");
        assert!(shown.contains("It does not build. A driver. [shader]") && shown.lines().count() == 4, "{shown}");
        assert!(lines[0]["passes"] == true && lines[1]["passes"] == false && lines[1]["measured"] == 1.5);
        assert!(lines[2]["error"]["code"] == "shader" && lines[3]["measured"] == "nan", "{lines:?}");
        // A lost device ends it at once.
        let lost = self_test(&checks, |_| Err(Error::new(Code::DeviceLost, "Gone.")), |_, _| Ok(()));
        assert_eq!(lost.expect_err("lost").code, Code::DeviceLost);
        assert!(self_test(&checks, |_| Ok(outcome(1.0)), |_, _| Ok(())).is_ok());
    }

    #[test]
    fn the_reason_for_an_adapter_is_that_of_the_choice() {
        let info = |device_type| wgpu::AdapterInfo {
            name: "card".into(),
            ..wgpu::AdapterInfo::new(device_type, wgpu::Backend::Vulkan)
        };
        let (gpu, cpu) = (info(wgpu::DeviceType::DiscreteGpu), info(wgpu::DeviceType::Cpu));
        assert!(why(&cpu, &[gpu.clone(), cpu.clone()], "pipe").contains("\"pipe\""));
        assert!(why(&cpu, std::slice::from_ref(&cpu), "").contains("only"));
        assert!(why(&gpu, &[gpu.clone(), cpu.clone()], "").starts_with("discrete"));
        assert!(why(&gpu, &[gpu.clone(), gpu.clone(), cpu], "").contains("first of its kind"));
    }
}
