//! Shader files on disk that change while the window is open (debug builds run from the source tree).

use std::path::PathBuf;
use std::time::{Duration, Instant, SystemTime};

use crate::gpu::shader::{CATALOGUE, Source};

/// Time between two looks.
const EVERY: Duration = Duration::from_secs(1);
/// Folders of shaders that the window does not use.
const UNUSED: [&str; 2] = ["bench/", "probe/"];

/// Files that are looked at from time to time.
pub struct Watch {
    files: Vec<(PathBuf, Option<SystemTime>)>,
    /// When the next look is due.
    pub next: Instant,
}

impl Watch {
    /// The window's shaders, where they are read from disk.
    pub fn shaders() -> Option<Watch> {
        let folder = Source::standard().folder?;
        let used = CATALOGUE.iter().map(|(name, _)| *name).filter(|n| !UNUSED.iter().any(|u| n.starts_with(u)));
        Some(Watch::new(used.map(|name| folder.join(format!("{name}.wgsl"))).collect()))
    }

    fn new(files: Vec<PathBuf>) -> Watch {
        let files = files.into_iter().map(|path| (path.clone(), modified(&path))).collect();
        Watch { files, next: Instant::now() + EVERY }
    }

    /// Whether a file has changed since the last look; looks only where it is time.
    pub fn changed(&mut self) -> bool {
        if Instant::now() < self.next {
            return false;
        }
        self.next = Instant::now() + EVERY;
        self.look()
    }

    fn look(&mut self) -> bool {
        let mut changed = false;
        for (path, last) in &mut self.files {
            // A file that an editor is just replacing is missing for a moment.
            if let Some(now) = modified(path).filter(|now| *last != Some(*now)) {
                *last = Some(now);
                changed = true;
            }
        }
        changed
    }
}

fn modified(path: &PathBuf) -> Option<SystemTime> {
    std::fs::metadata(path).and_then(|m| m.modified()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_change_is_seen_once() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.wgsl");
        let write = |seconds: u64| {
            std::fs::write(&path, "").expect("writes");
            let file = std::fs::File::options().write(true).open(&path).expect("opens");
            file.set_modified(SystemTime::UNIX_EPOCH + Duration::from_secs(seconds)).expect("sets its time");
        };
        write(1);
        let mut watch = Watch::new(vec![path.clone()]);
        assert!(!watch.look());
        write(2);
        assert!(!watch.changed(), "not yet due");
        assert!(watch.look());
        assert!(!watch.look());
        std::fs::remove_file(&path).expect("removes");
        assert!(!watch.look(), "an editor is at work");
        write(1);
        assert!(watch.look(), "an older file is another one too");
    }

    #[test]
    fn the_windows_own_shaders_are_watched() {
        // Release builds have theirs inside.
        let Some(watch) = Watch::shaders() else { return };
        assert!(watch.files.iter().any(|(path, at)| path.ends_with("integrate/path.wgsl") && at.is_some()));
        assert!(watch.files.iter().any(|(path, _)| path.ends_with("display/present.wgsl")));
    }
}
