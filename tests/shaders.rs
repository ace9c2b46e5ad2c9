//! The shaders without an adapter: every variant links and validates, structs match Rust, names and sizes keep to the
//! rules of the house, and messages of mistakes point into the files.

use std::collections::{BTreeSet, HashMap};
use std::fmt::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

use nephele::gpu::layout::{self, GpuStruct};
use nephele::gpu::shader::{CATALOGUE, Linked, Source, Variant};
use nephele::light::environment::AliasEntry;
use nephele::render::lights::GpuLight;
use nephele::render::params::{Params, Slice};
use nephele::render::reuse::Frame;
use rayon::prelude::*;
use wgpu::naga;

#[path = "shaders/reuse.rs"]
mod reuse;

/// Files that fill each slot.
const SLOTS: [(&str, &[&str]); 8] = [
    ("medium", &[DENSE[0], DENSE[1], DENSE[2], ANALYTIC[0], ANALYTIC[1], ANALYTIC[2]]),
    ("majorant", &["majorant/grid", "majorant/tree", "majorant/whole", "majorant/profile"]),
    ("phase", &["phase/hg", "phase/isotropic", "phase/rayleigh", "phase/two_lobe_hg"]),
    ("spectrum", &["spectrum/grey", "spectrum/colour"]),
    (
        "flight",
        &[
            "flight/delta",
            "flight/weighted_delta",
            "flight/decomposition",
            "flight/weighted_decomposition",
            "flight/spectral_max",
            "flight/spectral_avg",
            "flight/spectral_history",
            "flight/regular",
            "flight/ray_marching",
            "flight/closed_form",
        ],
    ),
    (
        "transmittance",
        &[
            "transmittance/ratio",
            "transmittance/residual_ratio",
            "transmittance/delta",
            "transmittance/next_flight",
            "transmittance/unbiased_ray_marching",
            "transmittance/telescoping",
            "transmittance/power_series",
            "transmittance/regular",
            "transmittance/ray_marching",
            "transmittance/jackknife",
            "transmittance/closed_form",
        ],
    ),
    ("proxy", &PROXIES),
    ("aim", &AIMS),
];
/// What a path is worth, to mode "restir" and to "restir-2021".
const AIMS: [&str; 2] = ["aim/sighted", "aim/marched"];
/// The density from afar, of voxels and of formulas.
const PROXIES: [&str; 2] = ["proxy/dense", "proxy/analytic"];
/// Files of slot `medium` for voxels, and for formulas.
const DENSE: [&str; 3] = ["medium/dense", "medium/dense_exact", "medium/dense_nearest"];
const ANALYTIC: [&str; 3] = ["medium/homogeneous", "medium/linear", "medium/exponential"];

/// Most lines of a shader file, and the files that may be longer: they are one algorithm each.
const MAX_LINES: usize = 200;
const LONG_FILES: [&str; 1] = ["integrate/path"];
const MAX_LONG_LINES: usize = 280;

/// Top-level names that do not begin with their file's stem: the second structure of a pair that belongs together.
const STRANGE_NAMES: [(&str, &str); 3] =
    [("core/params", "Slice"), ("core/params", "slice"), ("reuse/reservoir", "Path")];

fn shaders_folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("shaders")
}

/// Which lights there are: flags of `Lights::variant`, for every list that a scene can have.
fn light_flags() -> Vec<[bool; 6]> {
    let mut all = Vec::new();
    for map in [false, true] {
        // sampled, map, list, many, disc, point
        all.push([map, map, false, false, false, false]);
        for (disc, point) in [(false, false), (true, false), (false, true)] {
            all.push([true, map, true, false, disc, point]);
        }
        for (disc, point) in [(false, false), (true, false), (false, true), (true, true)] {
            all.push([true, map, true, true, disc, point]);
        }
    }
    all
}

fn with_lights(variant: Variant, [sampled, map, list, many, disc, point]: [bool; 6]) -> Variant {
    variant
        .flag("LIGHT_SAMPLED", sampled)
        .flag("LIGHT_HAS_MAP", map)
        .flag("LIGHT_HAS_LIST", list)
        .flag("LIGHT_HAS_MANY", many)
        .flag("LIGHT_HAS_DISC", disc)
        .flag("LIGHT_HAS_POINT", point)
}

/// Whether an estimator's file needs a formula for the density.
fn is_closed(file: &str) -> bool {
    file.ends_with("closed_form") || file == PROXIES[1]
}

/// Slots and constants of the estimators, and of what else the tracking loop is made of.
fn with_tracking(variant: Variant, medium: &'static str, flight: &'static str, transmittance: &'static str) -> Variant {
    let walks = |file: &str| {
        ["regular", "ray_marching", "closed_form", "telescoping", "power_series", "jackknife"]
            .iter()
            .any(|name| file.ends_with(name))
    };
    variant
        .slot("proxy", if DENSE.contains(&medium) { PROXIES[0] } else { PROXIES[1] })
        .slot("aim", AIMS[0])
        .flag("REUSE", true)
        .flag("REUSE_SECOND", true)
        .slot("medium", medium)
        .slot("flight", flight)
        .slot("transmittance", transmittance)
        .flag("FLIGHT_WALKS", walks(flight))
        .flag("TRANSMITTANCE_WALKS", walks(transmittance))
        .flag("MAJORANT_CONTROL", true)
        .flag("MAJORANT_TIGHT", medium == "medium/homogeneous")
        .flag("MEDIUM_NEAREST", medium == "medium/dense_nearest")
        .count("TRACK_STEPS", 2)
        .count("PATH_MOST_ROUNDS", 1 << 16)
}

/// Variants of the path tracer that `Renderer::variant` can make: with the default estimators every one (the count of
/// tracking steps is a number and changes no code), and every pair of estimators in each medium and spectrum.
fn path_variants() -> Vec<Variant> {
    let mut all = Vec::new();
    let majorants = |medium: &str| if DENSE.contains(&medium) { &SLOTS[1].1[..2] } else { &SLOTS[1].1[2..] };
    let base = |phase, spectrum, lens, layers| {
        Variant::default()
            .slot("phase", phase)
            .slot("spectrum", spectrum)
            .flag("CAMERA_LENS", lens)
            .flag("FILM_AOV", layers)
            .flag("FILM_COST", layers)
    };
    for &medium in SLOTS[0].1 {
        for &majorant in majorants(medium) {
            for &phase in SLOTS[2].1 {
                for &spectrum in SLOTS[3].1 {
                    for (lens, aov) in [(false, false), (true, true)] {
                        for lights in light_flags() {
                            let variant = base(phase, spectrum, lens, aov).slot("majorant", majorant);
                            let variant = with_tracking(variant, medium, SLOTS[4].1[0], SLOTS[5].1[0]);
                            all.push(with_lights(variant, lights));
                        }
                    }
                }
            }
        }
        for &flight in SLOTS[4].1 {
            for &transmittance in SLOTS[5].1 {
                if DENSE.contains(&medium) && (is_closed(flight) || is_closed(transmittance)) {
                    continue;
                }
                for &spectrum in SLOTS[3].1 {
                    let variant = base("phase/hg", spectrum, false, false).slot("majorant", majorants(medium)[0]);
                    let lights = [true, false, true, false, false, false];
                    all.push(with_lights(with_tracking(variant, medium, flight, transmittance), lights));
                }
            }
        }
    }
    all
}

/// A variant with a choice for every slot and constant, for kernels that need only some.
fn any_variant() -> Variant {
    let variant = Variant::default()
        .flag("CAMERA_LENS", true)
        .flag("FILM_AOV", true)
        .flag("FILM_COST", true)
        .slot("majorant", "majorant/grid")
        .slot("phase", "phase/two_lobe_hg")
        .slot("spectrum", "spectrum/colour");
    let variant = with_tracking(variant, "medium/dense_exact", "flight/decomposition", "transmittance/residual_ratio");
    with_lights(variant, [true; 6])
}

/// Files with an entry point.
fn kernels() -> Vec<&'static str> {
    CATALOGUE
        .iter()
        .filter(|(_, text)| text.contains("@compute") || text.contains("@fragment"))
        .map(|(n, _)| *n)
        .collect()
}

fn linked(entry: &str, variant: &Variant) -> Linked {
    Source::standard().link(entry, variant).unwrap_or_else(|e| panic!("{entry}: {e}"))
}

fn module(entry: &str) -> naga::Module {
    linked(entry, &any_variant()).validate().unwrap_or_else(|e| panic!("{entry}: {e}"))
}

#[test]
fn every_variant_links_and_validates() {
    let variants = path_variants();
    // Media with their majorants, phase functions, spectra, lens and layers, lights; then pairs of estimators, in two
    // spectra.
    assert_eq!(variants.len(), (3 * 2 + 3 * 2) * 4 * 2 * 2 * 16 + (3 * 9 * 10 + 3 * 10 * 11) * 2);
    let failures: Vec<String> = variants
        .par_iter()
        .filter_map(|variant| {
            let module = Source::standard().link("integrate/path", variant).and_then(|l| l.validate());
            match module {
                Ok(module) if module.entry_points.iter().any(|e| e.name == "path_main") => None,
                Ok(_) => Some(format!("{variant:?}: no entry point path_main")),
                Err(e) => Some(format!("{variant:?}: {e}")),
            }
        })
        .collect();
    assert!(failures.is_empty(), "{} variants fail; the first: {}", failures.len(), failures[0]);
}

#[test]
fn every_kernel_validates_with_each_choice_of_each_slot() {
    let mut failures = String::new();
    for kernel in kernels() {
        for (slot, files) in SLOTS {
            for &file in files {
                let mut variant = any_variant();
                for choice in variant.slots.iter_mut() {
                    if choice.0 == slot {
                        choice.1 = file;
                    } else if choice.0 == "medium" && is_closed(file) {
                        choice.1 = ANALYTIC[0];
                    }
                }
                if let Err(e) = Source::standard().link(kernel, &variant).and_then(|l| l.validate()) {
                    let _ = writeln!(failures, "{kernel} with {file}: {e}");
                }
            }
        }
    }
    assert!(failures.is_empty(), "{failures}");
}

/// Chrome's compiler reads the language more strictly than naga in places. Where it is installed, every kernel passes it.
#[test]
fn tint_agrees() {
    if Command::new("tint").arg("--help").output().is_err() {
        eprintln!("skipped: no tint on PATH");
        return;
    }
    let folder = tempfile::tempdir().expect("a temporary folder");
    let plain = with_lights(Variant::default(), [false; 6])
        .flag("CAMERA_LENS", false)
        .flag("FILM_AOV", false)
        .flag("FILM_COST", false)
        .slot("majorant", "majorant/whole")
        .slot("phase", "phase/hg")
        .slot("spectrum", "spectrum/grey");
    let plain = with_tracking(plain, "medium/homogeneous", "flight/closed_form", "transmittance/closed_form");
    let mut sampler = any_variant();
    sampler.slots.iter_mut().filter(|s| s.0 == "medium").for_each(|s| s.1 = "medium/dense");
    for kernel in kernels() {
        for variant in [&any_variant(), &plain, &sampler] {
            let path = folder.path().join("kernel.wgsl");
            std::fs::write(&path, linked(kernel, variant).text).expect("a writable folder");
            let output = Command::new("tint").arg("--format").arg("wgsl").arg(&path).output().expect("tint runs");
            let said = String::from_utf8_lossy(&output.stderr).into_owned();
            assert!(output.status.success(), "{kernel}: tint says {said}");
        }
    }
}

/// `GpuLight` under the name that it has in the shader.
#[repr(transparent)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Light(GpuLight);

impl GpuStruct for Light {
    const NAME: &'static str = "Light";
    const FIELDS: &'static [layout::Field] = GpuLight::FIELDS;
}

#[test]
fn structs_match_rust() {
    let path = module("integrate/path");
    assert_eq!(layout::compare::<Params>(&path), Ok(()));
    assert_eq!(layout::compare::<Slice>(&path), Ok(()));
    assert_eq!(layout::compare::<Light>(&path), Ok(()));
    assert_eq!(layout::compare::<Frame>(&module("reuse/temporal")), Ok(()));
    // The table of the environment is plain data of the light module; its second field has another name there, as
    // `alias` is a reserved word of WGSL.
    let (_, entry) = path.types.iter().find(|(_, t)| t.name.as_deref() == Some("EnvironmentEntry")).expect("used");
    let naga::TypeInner::Struct { members, span } = &entry.inner else { panic!("EnvironmentEntry is a struct") };
    assert_eq!(*span as usize, size_of::<AliasEntry>());
    let found: Vec<(&str, u32)> = members.iter().map(|m| (m.name.as_deref().unwrap_or_default(), m.offset)).collect();
    let rust = [
        ("threshold", std::mem::offset_of!(AliasEntry, threshold)),
        ("alias_texel", std::mem::offset_of!(AliasEntry, alias)),
        ("pdf", std::mem::offset_of!(AliasEntry, pdf)),
        ("pdf_alias", std::mem::offset_of!(AliasEntry, pdf_alias)),
    ];
    assert_eq!(found, rust.map(|(name, offset)| (name, offset as u32)));
}

#[test]
fn a_struct_that_differs_is_seen() {
    let compare = |from: &str, to: &str| {
        let source = Source { plants: vec![(from.into(), to.into())], ..Source::standard() };
        let module = source.link("core/params", &Variant::default()).and_then(|l| l.validate()).expect("still valid");
        layout::compare::<Params>(&module)
    };
    let renamed = compare("    tiles_x: u32, ", "    tiles_y: u32, ");
    assert!(renamed.expect_err("another name").contains("tiles_x"));
    assert!(compare("    tone_map: u32,\n", "    tone_mapping: u32,\n").expect_err("renamed").contains("tone_map"));
    assert!(compare("    tone_map: u32,\n", "").is_err());
    assert!(compare("    exposure: f32,", "    exposure: vec4f,").is_err());
}

/// WGSL files under `folder`, by their names in the catalogue.
fn files_on_disk(folder: &Path, prefix: &str, out: &mut BTreeSet<String>) {
    for entry in std::fs::read_dir(folder).expect("the shader folder is readable").flatten() {
        let name = entry.file_name().to_string_lossy().into_owned();
        if entry.path().is_dir() {
            files_on_disk(&entry.path(), &format!("{prefix}{name}/"), out);
        } else {
            let stem = name.strip_suffix(".wgsl").unwrap_or_else(|| panic!("{prefix}{name} is no shader"));
            out.insert(format!("{prefix}{stem}"));
        }
    }
}

#[test]
fn the_catalogue_is_complete_and_sorted() {
    let mut disk = BTreeSet::new();
    files_on_disk(&shaders_folder(), "", &mut disk);
    let listed: Vec<String> = CATALOGUE.iter().map(|(n, _)| (*n).to_owned()).collect();
    assert_eq!(listed, disk.into_iter().collect::<Vec<_>>());
}

/// The text of `name` and what it links.
fn directives(text: &str) -> (Vec<&str>, Vec<&str>) {
    let all = |prefix: &'static str| text.lines().filter_map(move |l| l.strip_prefix(prefix)).map(str::trim).collect();
    (all("//!use "), all("//!slot "))
}

#[test]
fn every_file_is_reached_from_a_kernel() {
    let texts: HashMap<&str, &str> = CATALOGUE.iter().copied().collect();
    let mut reached: BTreeSet<&str> = BTreeSet::new();
    let mut todo = kernels();
    while let Some(name) = todo.pop() {
        if reached.insert(name) {
            let (used, slots) = directives(texts[name]);
            todo.extend(used);
            for slot in slots {
                let files = SLOTS.iter().find(|(s, _)| *s == slot).unwrap_or_else(|| panic!("unknown slot {slot}")).1;
                todo.extend(files);
            }
        }
    }
    let lost: Vec<&str> = texts.keys().copied().filter(|n| !reached.contains(n)).collect();
    assert!(lost.is_empty(), "not reached from any entry point: {lost:?}");
    for (slot, files) in SLOTS {
        let folder: Vec<&str> =
            CATALOGUE.iter().map(|(n, _)| *n).filter(|n| n.starts_with(&format!("{slot}/"))).collect();
        // Others in the folder are helpers of those that fill the slot.
        assert!(files.iter().all(|f| folder.contains(f)), "{slot}");
    }
}

/// Name of each declaration at the top level of `text`.
fn declarations(text: &str) -> Vec<&str> {
    let mut names = Vec::new();
    for line in text.lines() {
        let mut rest = line;
        while rest.starts_with('@') {
            // Attributes stand before what they belong to, on the same line or one of their own.
            rest = rest.split_once(' ').map_or("", |(_, after)| after);
            if let Some((arguments, after)) = rest.split_once(") ")
                && arguments.chars().all(|c| c.is_ascii_digit() || " ,".contains(c))
            {
                rest = after;
            }
        }
        for keyword in ["fn ", "struct ", "const ", "override ", "alias ", "var ", "var<"] {
            if let Some(mut after) = rest.strip_prefix(keyword) {
                if keyword == "var<" {
                    after = after.split_once("> ").map_or("", |(_, a)| a);
                }
                let end = after.find(|c: char| !(c.is_alphanumeric() || c == '_')).unwrap_or(after.len());
                names.push(&after[..end]);
            }
        }
    }
    names
}

#[test]
fn names_begin_with_the_file_or_the_slot() {
    let plain = |s: &str| s.to_lowercase().replace('_', "");
    let mut strange: BTreeSet<(&str, &str)> = BTreeSet::new();
    for (name, text) in CATALOGUE {
        let (folder, stem) = name.rsplit_once('/').expect("shader files lie in folders");
        let slot = SLOTS.iter().any(|(s, _)| *s == folder).then_some(folder);
        for declared in declarations(text) {
            let fits = |prefix: &str| plain(declared).starts_with(&plain(prefix));
            if !fits(stem) && !slot.is_some_and(fits) {
                strange.insert((name, declared));
            }
        }
    }
    assert_eq!(strange, STRANGE_NAMES.into_iter().collect(), "names without their file's stem");
    let text = "@group(0) @binding(0) var<uniform> a_b: X;\n@compute @workgroup_size(8, 8)\nfn c_d() {\n    let x = 1;\n}\n\
                const E_F: u32 = 1u;\nstruct Gh {\n@group(1) @binding(1) var i_j: sampler;\n";
    assert_eq!(declarations(text), ["a_b", "c_d", "E_F", "Gh", "i_j"]);
}

#[test]
fn slot_files_of_a_slot_declare_the_same_functions() {
    let texts: HashMap<&str, &str> = CATALOGUE.iter().copied().collect();
    let signatures = |file: &str, wanted: &[&str]| -> Vec<String> {
        let lines = texts[file].lines().filter(|l| l.starts_with("fn ") || l.starts_with("struct "));
        let all: Vec<String> = lines.map(str::to_owned).collect();
        wanted
            .iter()
            .map(|w| {
                let found = all.iter().find(|l| l.starts_with(&format!("fn {w}(")));
                found.unwrap_or_else(|| panic!("{file} has no function {w}")).clone()
            })
            .collect()
    };
    let functions: [&[&str]; 4] = [
        &["medium_density"],
        &["majorant_segment"],
        &["phase_value", "phase_drop"],
        &[
            "spectrum_hero",
            "spectrum_step",
            "spectrum_weight",
            "spectrum_extinction",
            "spectrum_max",
            "spectrum_mean",
            "spectrum_depth",
        ],
    ];
    for ((_, files), wanted) in SLOTS.iter().zip(functions) {
        let first = signatures(files[0], wanted);
        for file in &files[1..] {
            assert_eq!(signatures(file, wanted), first, "{file} against {}", files[0]);
        }
    }
    let wanted: &[&str] = &["proxy_end", "proxy_finest", "proxy_coarsest", "proxy_depth"];
    assert_eq!(signatures(PROXIES[0], wanted), signatures(PROXIES[1], wanted));
    let wanted: &[&str] = &["aim_strength", "aim_legs"];
    assert_eq!(signatures(AIMS[0], wanted), signatures(AIMS[1], wanted));
    // Formulas alone have integrals. Estimators share functions through files of their folder, which linking checks.
    let first = signatures(ANALYTIC[0], &["medium_depth", "medium_invert"]);
    for file in ANALYTIC {
        assert_eq!(signatures(file, &["medium_depth", "medium_invert"]), first, "{file}");
    }
}

#[test]
fn files_are_short() {
    for (name, text) in CATALOGUE {
        let lines = text.lines().count();
        if LONG_FILES.contains(name) {
            assert!(
                (MAX_LINES + 1..=MAX_LONG_LINES).contains(&lines),
                "{name}: {lines} lines; strike it from the list?"
            );
        } else {
            assert!(lines <= MAX_LINES, "{name} has {lines} lines, more than {MAX_LINES}: split it by role");
        }
        for (i, line) in text.lines().enumerate() {
            let clean = !line.contains('\t') && line.trim_end() == line && line.chars().count() <= 132;
            assert!(clean, "shaders/{name}.wgsl:{}: tabs, trailing space or over 132 columns", i + 1);
        }
    }
}

#[test]
fn every_constant_of_a_variant_is_used() {
    let dense = linked("integrate/path", &any_variant()).text;
    let mut whole = any_variant();
    for (slot, file) in &mut whole.slots {
        match *slot {
            "majorant" => *file = "majorant/whole",
            "flight" => *file = "flight/regular",
            _ => {}
        }
    }
    let whole = linked("integrate/path", &whole).text;
    let reuse = linked("reuse/candidates", &any_variant()).text;
    for (name, _) in any_variant().constants {
        let read = |text: &str| text.matches(name).count() > 1;
        // Whether there are passes of reuse at all is asked on the CPU.
        assert!(name == "REUSE" || read(&dense) || read(&whole) || read(&reuse), "{name} is set and never read");
    }
}

/// What linking and validating `integrate/path` says where `file` has one line in place of another.
fn mistake(file: &str, from: &str, to: &str) -> (String, usize) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let text = CATALOGUE.iter().find(|(n, _)| *n == file).expect("a listed file").1;
    assert_eq!(text.matches(from).count(), 1, "{from:?} in {file}");
    let line = text[..text.find(from).expect("just counted")].matches('\n').count() + 1;
    let path = folder.path().join(format!("{file}.wgsl"));
    std::fs::create_dir_all(path.parent().expect("it lies in a folder")).expect("a writable folder");
    std::fs::write(path, text.replace(from, to)).expect("a writable folder");
    let source = Source { folder: Some(folder.path().to_path_buf()), plants: Vec::new() };
    let error = source.link("integrate/path", &any_variant()).and_then(|l| l.validate().map(|_| l));
    (error.expect_err("a mistake was planted").to_string(), line)
}

/// The files that are embedded would be others than those asked for.
#[test]
fn a_folder_that_is_gone_is_an_error() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let source = Source { folder: Some(folder.path().to_path_buf()), plants: Vec::new() };
    assert!(source.link("integrate/path", &any_variant()).is_ok(), "files that are missing are the embedded ones");
    drop(folder);
    let error = source.link("integrate/path", &any_variant()).expect_err("the folder is gone").to_string();
    assert!(error.contains("is gone"), "{error}");
}

#[test]
fn messages_of_mistakes_name_file_and_line() {
    let planted = [
        // Parsing, names, types in expressions, types at validation, a missing return.
        ("core/rng", "    let old = (*rng).state;\n", "    let old = (*rng).state\n"),
        ("light/light", "let chord = w - light.axis;", "let chord = w - light.axes;"),
        ("phase/lobe", "(1.0 - 0.5 * p)", "(vec3u(1u) - 0.5 * p)"),
        ("core/math", "    return max(v.x, max(v.y, v.z));", "    return vec3f(max(v.x, max(v.y, v.z)));"),
        ("track/step", "    *depth -= available;", "    *depth -= 1u;"),
        (
            "medium/dense_exact",
            "return textureLoad(medium_texture, p, 0).x;",
            "return textureLoad(medium_texture, p, 0);",
        ),
    ];
    for (file, from, to) in planted {
        let (message, line) = mistake(file, from, to);
        let at = format!("shaders/{file}.wgsl:{line}:");
        // A missing semicolon is noticed where the next line begins.
        let next = format!("shaders/{file}.wgsl:{}:", line + 1);
        assert!(message.starts_with(&at) || message.starts_with(&next), "{at} expected in: {message}");
        assert!(message.ends_with("[shader]"), "{message}");
    }
}

#[test]
fn messages_of_the_linker_say_what_is_missing() {
    let (message, _) = mistake("core/rng", "// 32 random bits.", "//!use core/dice");
    assert!(message.contains("shaders/core/dice.wgsl"), "{message}");
    let (message, _) = mistake("core/math", "// Constants and small geometry.", "//!use light/light");
    assert!(message.contains("circle") && message.contains("light/light → "), "{message}");
    let mut variant = any_variant();
    variant.slots.retain(|(slot, _)| *slot != "phase");
    let message = Source::standard().link("integrate/path", &variant).expect_err("no phase").to_string();
    assert!(message.contains("shaders/integrate/path.wgsl") && message.contains("slot phase"), "{message}");
}
