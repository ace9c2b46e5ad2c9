//! The progress of `nephele render`.

use std::io::IsTerminal;
use std::time::Instant;

/// Seconds between lines of progress that go to no terminal.
const PROGRESS_LINE: f64 = 10.0;
/// Seconds between updates on a terminal.
const PROGRESS_TICK: f64 = 0.1;

/// Progress on stderr.
pub struct Bar {
    terminal: bool,
    lines: bool,
    begin: Instant,
    last: f64,
}

impl Bar {
    /// A bar; `forced`: lines even where stderr is no terminal.
    pub fn new(forced: bool) -> Bar {
        let terminal = std::io::stderr().is_terminal();
        Bar { terminal, lines: forced && !terminal, begin: Instant::now(), last: 0.0 }
    }

    /// Shows where run `run` of `runs` is, now and then; `share` of the way.
    pub fn show(&mut self, samples: u32, share: f64, run: u32, runs: u32) {
        let seconds = self.begin.elapsed().as_secs_f64();
        let interval = if self.terminal { PROGRESS_TICK } else { PROGRESS_LINE };
        if !(self.terminal || self.lines) || seconds - self.last < interval {
            return;
        }
        self.last = seconds;
        let left = if share > 0.0 { format!(", {:.0} s left", seconds / share - seconds) } else { String::new() };
        let of = if runs > 1 { format!(" of run {}/{runs}", run + 1) } else { String::new() };
        let text = format!("{samples} samples{of}, {:.0} %, {seconds:.1} s{left}", share * 100.0);
        if self.terminal {
            eprint!("\r\x1b[2K{text}");
        } else {
            eprintln!("{text}");
        }
    }

    /// Takes it away.
    pub fn clear(&self) {
        if self.terminal {
            eprint!("\r\x1b[2K");
        }
    }
}
