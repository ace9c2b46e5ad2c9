//! The passes of reuse: every variant is valid, and binds no more than a default device lends.

use super::*;

/// Kernels of the passes of reuse.
const PASSES: [&str; 6] =
    ["reuse/candidates", "reuse/suffix", "reuse/temporal", "reuse/pair", "reuse/merge", "reuse/shade"];
/// Storage buffers that a default device lends a kernel.
const MOST_BUFFERS: usize = 8;

/// Variants of the passes of reuse: media, spectra, phase functions, lights, lens and second vertices.
fn reuse_variants() -> Vec<Variant> {
    let mut all = Vec::new();
    for medium in [DENSE[0], DENSE[1], DENSE[2], ANALYTIC[0], ANALYTIC[2]] {
        let majorant = if DENSE.contains(&medium) { "majorant/grid" } else { "majorant/profile" };
        for &spectrum in SLOTS[3].1 {
            for (lens, phase) in [(false, "phase/hg"), (true, "phase/rayleigh")] {
                for second in [false, true] {
                    for lights in light_flags() {
                        let variant = Variant::default()
                            .slot("phase", phase)
                            .slot("spectrum", spectrum)
                            .slot("majorant", majorant)
                            .flag("CAMERA_LENS", lens)
                            .flag("FILM_AOV", lens)
                            .flag("FILM_COST", lens);
                        let mut variant = with_tracking(variant, medium, SLOTS[4].1[0], SLOTS[5].1[0]);
                        for (name, value) in &mut variant.constants {
                            if *name == "REUSE_SECOND" {
                                *value = second.to_string();
                            }
                        }
                        all.push(with_lights(variant, lights));
                    }
                }
            }
        }
    }
    all
}

/// Storage buffers that the entry point of a pass reads or writes in group 3, and all those of the lights.
fn storage_buffers(module: &naga::Module) -> usize {
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::all());
    let info = validator.validate(module).expect("it was valid before");
    // A kernel of another pass may be in the text: the pass's own is the last.
    let entry = info.get_entry_point(module.entry_points.len() - 1);
    let counts = |(handle, variable): (naga::Handle<naga::GlobalVariable>, &naga::GlobalVariable)| {
        let storage = matches!(variable.space, naga::AddressSpace::Storage { .. });
        let group = variable.binding.map_or(0, |b| b.group);
        storage && group == 3 && !entry[handle].is_empty()
    };
    /// Of bind group 2.
    const LIGHTS: usize = 2;
    LIGHTS + module.global_variables.iter().filter(|v| counts(*v)).count()
}

#[test]
fn passes_of_reuse_validate_and_bind_few_buffers() {
    let variants = reuse_variants();
    assert_eq!(variants.len(), 5 * 2 * 2 * 2 * 16);
    for pass in PASSES {
        let failures: Vec<String> = variants
            .par_iter()
            .filter_map(|variant| match Source::standard().link(pass, variant).and_then(|l| l.validate()) {
                Ok(module) if storage_buffers(&module) <= MOST_BUFFERS => None,
                Ok(module) => Some(format!("{pass} binds {} storage buffers", storage_buffers(&module))),
                Err(e) => Some(format!("{pass}: {variant:?}: {e}")),
            })
            .collect();
        assert!(failures.is_empty(), "{} variants of {pass} fail; the first: {}", failures.len(), failures[0]);
    }
    // The count sees what is bound: merging reads and writes reservoirs and pairs.
    assert!(storage_buffers(&module("reuse/merge")) >= 7);
}
