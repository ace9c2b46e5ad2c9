//! The passes of reuse: every variant is valid, and binds no more than a default device lends.

use super::*;

/// Kernels of the passes of reuse, and what tells a path's worth in them.
const PASSES: [(&str, &str); 11] = [
    ("reuse/candidates", AIMS[0]),
    ("reuse/suffix", AIMS[0]),
    ("reuse/temporal", AIMS[0]),
    ("reuse/pair", AIMS[0]),
    ("reuse/merge", AIMS[0]),
    ("reuse/shade", AIMS[0]),
    ("reuse_2021/initial", AIMS[1]),
    ("reuse/suffix", AIMS[1]),
    ("reuse_2021/reproject", AIMS[1]),
    ("reuse_2021/gather", AIMS[1]),
    ("reuse_2021/finish", AIMS[1]),
];
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

/// The module of a pass whose slot `aim` holds that file.
fn linked_for(pass: &str, aim: &'static str, variant: &Variant) -> nephele::error::Result<naga::Module> {
    let mut variant = variant.clone();
    variant.slots.iter_mut().filter(|(slot, _)| *slot == "aim").for_each(|(_, file)| *file = aim);
    Source::standard().link(pass, &variant).and_then(|l| l.validate())
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
    for (pass, aim) in PASSES {
        let failures: Vec<String> = variants
            .par_iter()
            .filter_map(|variant| match linked_for(pass, aim, variant) {
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
