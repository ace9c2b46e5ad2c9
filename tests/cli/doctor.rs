//! `nephele doctor`: its report, the self-test, and what it does without an adapter.

use nephele::render::self_test::CHECKS;

use super::*;

/// Runs `doctor` with variables of its environment set.
fn doctor(arguments: &[&str], variables: &[(&str, &str)]) -> Run {
    let folder = Folder::new();
    let mut command = folder.command(&[&["doctor"], arguments].concat());
    Run::of(command.envs(variables.iter().copied()).output().expect("the program starts"))
}

/// Variables with which there is no adapter.
const NONE: [(&str, &str); 2] = [("VK_DRIVER_FILES", "/nonexistent"), ("WGPU_BACKEND", "vulkan")];

#[test]
fn the_report_says_what_is_used_and_why() {
    if !can_draw() {
        return;
    }
    let run = doctor(&["--json"], &[]);
    assert_eq!(run.code, 0, "{}", run.err);
    let report = run.json();
    assert!(report["error"].is_null() && report["self_test"].is_null(), "{report}");
    let adapters = report["adapters"].as_array().expect("a list");
    let used = &report["used"];
    assert!(adapters.iter().any(|a| a["name"] == used["name"] && a["backend"] == used["backend"]), "{report}");
    for key in ["why", "kind", "driver", "driver_info"] {
        assert!(used[key].is_string(), "{key}: {used}");
    }
    for key in ["max_texture_dimension_3d", "max_buffer_gib", "max_binding_gib"] {
        assert!(used["limits"][key].as_f64().is_some_and(|x| x > 0.0), "{key}: {used}");
    }
    for feature in ["float32_filterable", "timestamps"] {
        assert!(used["features"][feature]["there"].is_boolean(), "{feature}: {used}");
    }
    let choices = &used["choices"];
    assert_eq!(choices["storage"], "f16", "{choices}");
    for key in ["grid", "global"] {
        assert!(choices["tracking_steps"][key].as_u64().is_some_and(|n| n > 0), "{choices}");
    }
    for storage in ["f32", "f16", "u8"] {
        assert!(["sampler", "shader"].iter().any(|by| choices["interpolation"][storage] == *by), "{choices}");
    }
    assert!(report["missing"].is_array() && report["environment"].is_object(), "{report}");
    // The same for people.
    let text = doctor(&[], &[]);
    assert_eq!(text.code, 0, "{}", text.err);
    let name = used["name"].as_str().expect("a name");
    for word in [name, "In use", "NEPHELE_ADAPTER", "storage", "tracking steps", "timestamps", "Display"] {
        assert!(text.out.contains(word), "{word:?} is not said: {}", text.out);
    }
    assert!(!text.out.contains("Self-test") && !text.out.contains('\u{1b}'), "{}", text.out);
}

#[test]
fn the_self_test_passes() {
    if !can_draw() {
        return;
    }
    let run = doctor(&["--self-test", "--json"], &[]);
    let report = run.json();
    assert_eq!(run.code, 0, "{}{}", report["self_test"], run.err);
    let checks = report["self_test"].as_array().expect("a list");
    let names: Vec<&str> = checks.iter().filter_map(|c| c["name"].as_str()).collect();
    assert_eq!(names, CHECKS.iter().map(|c| c.name).collect::<Vec<_>>());
    for check in checks {
        assert_eq!(check["passes"], true, "{check}");
        let number = |key: &str| check[key].as_f64().unwrap_or_else(|| panic!("{key} of {check}"));
        assert!((number("measured") - number("expected")).abs() <= number("within"), "{check}");
    }
}

#[test]
fn without_an_adapter_the_report_comes_first_then_4() {
    for arguments in [&["--json"][..], &["--json", "--self-test"]] {
        let run = doctor(arguments, &NONE);
        assert_eq!(run.code, 4, "{}", run.err);
        let report = run.json();
        assert_eq!(report["error"]["code"], "no_adapter", "{report}");
        assert!(!report["error"]["hint"].as_str().unwrap_or_default().is_empty(), "{report}");
        assert!(report["used"].is_null() && report["adapters"].as_array().is_some_and(Vec::is_empty), "{report}");
        assert_eq!(report["environment"]["WGPU_BACKEND"], "vulkan", "{report}");
        assert!(run.err.trim_end().ends_with("[no_adapter]"), "{}", run.err);
    }
    let run = doctor(&[], &NONE);
    assert_eq!(run.code, 4, "{}", run.err);
    assert!(run.out.contains("none") && run.out.contains("VK_DRIVER_FILES names /nonexistent"), "{}", run.out);
    if cfg!(target_os = "linux") {
        assert!(run.out.contains("apt install mesa-vulkan-drivers"), "{}", run.out);
    }
    assert!(!run.out.contains("In use"), "{}", run.out);
    assert!(run.err.trim_end().ends_with("[no_adapter]"), "{}", run.err);
}

#[test]
fn an_adapter_that_is_not_there_is_4_with_those_that_are() {
    if !can_draw() {
        return;
    }
    let run = doctor(&["--json"], &[("NEPHELE_ADAPTER", "abacus")]);
    assert_eq!(run.code, 4, "{}", run.err);
    let report = run.json();
    assert_eq!(report["error"]["code"], "no_adapter", "{report}");
    assert!(report["error"]["message"].as_str().is_some_and(|m| m.contains("abacus")), "{report}");
    assert!(report["adapters"].as_array().is_some_and(|a| !a.is_empty()), "{report}");
    assert_eq!(report["environment"]["NEPHELE_ADAPTER"], "abacus", "{report}");
}
