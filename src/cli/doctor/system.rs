//! What the system lends besides adapters: variables, a display, GPUs without a driver, and how to get what is missing.

use std::path::Path;

use serde_json::{Map, Value, json};

/// Variables that change which adapters there are or which is taken.
const VARIABLES: [&str; 8] = [
    "NEPHELE_ADAPTER",
    "WGPU_BACKEND",
    "VK_DRIVER_FILES",
    "VK_ICD_FILENAMES",
    "VK_ADD_DRIVER_FILES",
    "VK_LOADER_DRIVERS_SELECT",
    "VK_LOADER_DRIVERS_DISABLE",
    "MESA_VK_DEVICE_SELECT",
];

/// Those of them whose value is a list of driver files.
const FILES: [&str; 2] = ["VK_DRIVER_FILES", "VK_ICD_FILENAMES"];

/// Where Linux lists the devices on its buses.
const PCI: &str = "/sys/bus/pci/devices";

/// The variables that are set, by name.
pub fn environment() -> Value {
    let set = |name: &str| std::env::var(name).ok().filter(|v| !v.is_empty()).map(|v| (name.to_owned(), v.into()));
    VARIABLES.iter().filter_map(|name| set(name)).collect::<Map<String, Value>>().into()
}

/// The display that a window would open on, or null. Windows and macOS have one of their own.
pub fn display() -> Value {
    if cfg!(any(windows, target_os = "macos")) {
        return "the system's".into();
    }
    let set = |name: &str| std::env::var(name).ok().filter(|v| !v.is_empty());
    set("WAYLAND_DISPLAY").or_else(|| set("DISPLAY")).map_or(Value::Null, Value::from)
}

/// What is missing and how to get it, as objects of `what` and `how`. `none`: there is no adapter; `software`: the one in
/// use is a program on the CPU.
pub fn missing(none: bool, software: bool) -> Value {
    let mut all = Vec::new();
    let os = std::env::consts::OS;
    let gpus = if none || software { undriven(Path::new(PCI)) } else { Vec::new() };
    for (name, file) in lost_files(|name| std::env::var(name).ok()) {
        all.push(json!({
            "what": format!("{name} names {file}, which is not there, and hides every other driver."),
            "how": format!("Unset {name}, or name the driver's .json file."),
        }));
    }
    if none {
        all.push(json!({ "what": "There is no graphics driver that works.", "how": driver(os) }));
    }
    for maker in gpus {
        all.push(json!({
            "what": format!("This computer has a GPU by {} that no driver in use offers.", maker.name),
            "how": format!("{}\nIn a container, pass the device to it.", maker.how),
        }));
    }
    all.into()
}

/// How to get a driver.
fn driver(os: &str) -> &'static str {
    match os {
        "windows" => {
            "Install the driver of the graphics card from its maker; Windows 10 and later bring a software one."
        }
        "macos" => "Metal is part of macOS; a virtual machine must lend its guest a graphics device.",
        "linux" => {
            "Each of these works without a GPU too.\n\
             Debian, Ubuntu: apt install mesa-vulkan-drivers libvulkan1\n\
             Fedora: dnf install mesa-vulkan-drivers vulkan-loader\n\
             Arch: pacman -S vulkan-icd-loader vulkan-swrast"
        }
        _ => "Install a Vulkan loader and a Vulkan driver; Mesa has one that needs no GPU.",
    }
}

/// Driver files that a variable names and that are not there; `variable` reads one.
fn lost_files(variable: impl Fn(&str) -> Option<String>) -> Vec<(&'static str, String)> {
    let named = |&name: &&'static str| {
        let value = variable(name).unwrap_or_default();
        let lost = |file: &std::path::PathBuf| !file.as_os_str().is_empty() && !file.exists();
        let files: Vec<_> = std::env::split_paths(&value).filter(lost).collect();
        files.into_iter().map(move |file| (name, file.display().to_string()))
    };
    FILES.iter().flat_map(named).collect()
}

/// Who makes GPUs that Vulkan drives.
struct Maker {
    /// Number among PCI vendors, as Linux writes it.
    vendor: &'static str,
    name: &'static str,
    /// How to get a driver on Linux.
    how: &'static str,
}

const MAKERS: [Maker; 3] = [
    Maker {
        vendor: "0x10de",
        name: "NVIDIA",
        how: "Install NVIDIA's driver with its Vulkan part. Debian: apt install nvidia-driver (non-free). \
              Ubuntu: ubuntu-drivers install. Fedora: RPM Fusion's akmod-nvidia.",
    },
    Maker { vendor: "0x1002", name: "AMD", how: MESA },
    Maker { vendor: "0x8086", name: "Intel", how: MESA },
];

const MESA: &str = "Install Mesa's drivers (Debian, Ubuntu: apt install mesa-vulkan-drivers); your user must be in the \
                    group `render` or `video` (see /dev/dri).";

/// The makers of the display devices in `folder`, which is laid out as Linux does it; none on other systems.
fn undriven(folder: &Path) -> Vec<&'static Maker> {
    /// Class of display devices among PCI classes.
    const DISPLAY: &str = "0x03";
    let mut vendors = Vec::new();
    for device in std::fs::read_dir(folder).into_iter().flatten().flatten() {
        let word = |name: &str| std::fs::read_to_string(device.path().join(name)).unwrap_or_default();
        if word("class").starts_with(DISPLAY) {
            vendors.push(word("vendor").trim().to_owned());
        }
    }
    MAKERS.iter().filter(|m| vendors.iter().any(|v| v == m.vendor)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gpus_are_found_by_class_and_vendor() {
        let folder = tempfile::tempdir().unwrap();
        let device = |name: &str, class: &str, vendor: &str| {
            let path = folder.path().join(name);
            std::fs::create_dir(&path).unwrap();
            std::fs::write(path.join("class"), format!("{class}\n")).unwrap();
            std::fs::write(path.join("vendor"), format!("{vendor}\n")).unwrap();
        };
        assert!(undriven(folder.path()).is_empty() && undriven(&folder.path().join("none")).is_empty());
        device("bridge", "0x060400", "0x8086");
        device("sound", "0x040300", "0x10de");
        device("emulated", "0x030000", "0x1234");
        assert!(undriven(folder.path()).is_empty());
        device("card", "0x030200", "0x10de");
        device("display", "0x038000", "0x1002");
        let names: Vec<&str> = undriven(folder.path()).iter().map(|m| m.name).collect();
        assert_eq!(names, ["NVIDIA", "AMD"]);
    }

    #[test]
    fn driver_files_that_are_not_there_are_named() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let list = std::env::join_paths([file.path(), "lost.json".as_ref()]).unwrap().into_string().unwrap();
        let set = |name: &str| (name == "VK_DRIVER_FILES").then(|| list.clone());
        assert_eq!(lost_files(set), [("VK_DRIVER_FILES", "lost.json".to_owned())]);
        assert!(lost_files(|_| None).is_empty());
    }

    #[test]
    fn every_system_is_told_what_to_install() {
        assert!(driver("linux").contains("mesa-vulkan-drivers") && driver("linux").contains("dnf"));
        assert!(driver("windows").contains("Windows") && driver("macos").contains("Metal"));
        assert!(driver("freebsd").contains("Vulkan"));
    }
}
