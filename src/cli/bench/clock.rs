//! Time that a piece of work took.

use std::time::Instant;

/// CPU seconds of all living threads of this process; `None` where the system does not say.
///
/// From `/proc/self/task/*/schedstat` (Linux): nanoseconds on a CPU, not sampled.
pub fn cpu_seconds() -> Option<f64> {
    let mut nanoseconds = 0.0;
    for thread in std::fs::read_dir("/proc/self/task").ok()?.flatten() {
        // A thread may end while we look.
        let Ok(text) = std::fs::read_to_string(thread.path().join("schedstat")) else { continue };
        nanoseconds += text.split_whitespace().next()?.parse::<f64>().ok()?;
    }
    Some(nanoseconds * 1e-9)
}

/// Wall and CPU time since a moment.
#[derive(Clone, Copy, Debug)]
pub struct Watch {
    begin: Instant,
    cpu: Option<f64>,
}

impl Watch {
    /// Starts now.
    pub fn start() -> Watch {
        Watch { cpu: cpu_seconds(), begin: Instant::now() }
    }

    /// Wall seconds, and CPU seconds where they are known.
    pub fn seconds(&self) -> (f64, Option<f64>) {
        let wall = self.begin.elapsed().as_secs_f64();
        (wall, self.cpu.and_then(|from| Some(cpu_seconds()? - from)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_takes_time() {
        let watch = Watch::start();
        let mut x = 1u64;
        while watch.begin.elapsed().as_secs_f64() < 0.02 {
            x = x.wrapping_mul(6364136223846793005).wrapping_add(1);
        }
        let (wall, cpu) = watch.seconds();
        assert!(wall >= 0.02 && x != 0);
        // The machine may be busy, so the CPU time may be less; but a thread that computes gets some.
        assert!(cpu.is_none_or(|cpu| cpu > 0.0));
    }
}
