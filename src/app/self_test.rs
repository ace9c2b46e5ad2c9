//! The self-test in the window: the checks of `render::self_test`, made on a thread on a device of its own, so that the
//! picture goes on.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, mpsc};

use super::widgets::{Digits, Report, ReportAnswer, ReportLine};
use crate::error::Result;
use crate::gpu::device::Gpu;
use crate::gpu::shader::Source;
use crate::render::self_test::{CHECKS, Check, Outcome};

/// Seconds between looks for news.
const EVERY: f32 = 0.1;
/// Digits of figures.
const FIGURES: Digits = Digits::Significant(5);

/// The self-test and its card.
#[derive(Default)]
pub struct SelfTest {
    /// The card is shown.
    pub open: bool,
    adapter: String,
    found: Vec<Result<Outcome>>,
    running: Option<Running>,
    stopped: bool,
}

struct Running {
    found: mpsc::Receiver<Result<Outcome>>,
    stop: Arc<AtomicBool>,
}

impl Drop for Running {
    fn drop(&mut self) {
        self.stop.store(true, Ordering::Relaxed);
    }
}

impl SelfTest {
    /// Opens the card and begins, or closes it; the checks go on behind a closed card.
    pub fn toggle(&mut self, gpu: &Gpu) {
        self.open = !self.open;
        if self.open && self.running.is_none() && self.found.is_empty() {
            self.start(gpu, CHECKS);
        }
    }

    /// Begins `checks` from the first, on another device of the adapter of `gpu`.
    pub fn start(&mut self, gpu: &Gpu, checks: &'static [Check]) {
        let (send, found) = mpsc::channel();
        let stop = Arc::new(AtomicBool::new(false));
        let (instance, adapter, stopped) = (gpu.instance.clone(), gpu.adapter.clone(), stop.clone());
        std::thread::spawn(move || {
            let gpu = match Gpu::on(instance, adapter) {
                Ok(gpu) => Arc::new(gpu),
                Err(e) => {
                    // Nobody may wait any more, here and below.
                    let _ = send.send(Err(e));
                    return;
                }
            };
            for check in checks {
                if stopped.load(Ordering::Relaxed) || send.send(check.run(&gpu, &Source::standard())).is_err() {
                    return;
                }
            }
        });
        self.adapter = format!("{} · {}", gpu.info.name, gpu.backend());
        (self.found, self.stopped) = (Vec::new(), false);
        self.running = Some(Running { found, stop });
    }

    /// Takes what was found since the last look.
    fn poll(&mut self) {
        while let Some(running) = &self.running {
            match running.found.try_recv() {
                Ok(found) => self.found.push(found),
                Err(mpsc::TryRecvError::Empty) => return,
                Err(mpsc::TryRecvError::Disconnected) => self.running = None,
            }
        }
    }

    fn lines(&self) -> Vec<ReportLine> {
        let figures = |found: &Result<Outcome>| match found {
            Ok(o) => {
                let [measured, expected, within] = [o.measured, o.expected, o.within].map(|x| FIGURES.format(x));
                format!("{measured} for {expected} ± {within}")
            }
            Err(e) => e.what.clone(),
        };
        let line = |(i, check): (usize, &Check)| ReportLine {
            holds: self.found.get(i).map(|found| found.as_ref().is_ok_and(Outcome::passes)),
            name: check.name.into(),
            figures: self.found.get(i).map(figures).unwrap_or_default(),
        };
        CHECKS.iter().enumerate().map(line).collect()
    }

    /// How it stands, in a sentence.
    fn state(&self) -> String {
        let failed = self.found.iter().filter(|f| !f.as_ref().is_ok_and(Outcome::passes)).count();
        let done = self.found.len();
        let how = match (self.running.is_some(), self.stopped, failed) {
            (true, ..) => format!("{done} of {} made", CHECKS.len()),
            (false, true, _) => format!("stopped after {done}"),
            (false, false, 0) => format!("all {done} hold"),
            (false, false, _) => format!("{failed} of {done} fail"),
        };
        let failed = if self.running.is_some() && failed > 0 { format!(", {failed} fail") } else { String::new() };
        format!("{how}{failed}, on {}", self.adapter)
    }

    /// Everything as text.
    pub fn text(&self) -> String {
        let mut text = format!("nephele {} self-test: {}\n", env!("CARGO_PKG_VERSION"), self.state());
        for line in self.lines() {
            let word = match line.holds {
                None => "-   ",
                Some(true) => "ok  ",
                Some(false) => "FAIL",
            };
            text += format!("{word}  {}: {}", line.name, line.figures).trim_end_matches([':', ' ']);
            text.push('\n');
        }
        text
    }

    /// Shows the card while it is open.
    pub fn show(&mut self, ctx: &egui::Context, gpu: &Gpu) {
        self.poll();
        if !self.open {
            return;
        }
        let running = self.running.is_some();
        let (state, mut lines) = (self.state(), self.lines());
        if running {
            // What is done, and what is under way.
            lines.truncate(self.found.len() + 1);
        }
        let report = Report { title: "Self-test", state: &state, lines: &lines, running };
        match report.show(ctx) {
            Some(ReportAnswer::Start) => self.start(gpu, CHECKS),
            Some(ReportAnswer::Stop) => (self.running, self.stopped) = (None, true),
            Some(ReportAnswer::Copy) => ctx.copy_text(self.text()),
            Some(ReportAnswer::Close) => self.open = false,
            None => {}
        }
        if self.running.is_some() {
            ctx.request_repaint_after_secs(EVERY);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outcome(measured: f64) -> Result<Outcome> {
        Ok(Outcome { measured, expected: 1.0, within: 0.5 })
    }

    #[test]
    fn the_text_says_what_holds_and_what_does_not() {
        let (send, receive) = mpsc::channel();
        let running = Running { found: receive, stop: Arc::default() };
        let stop = running.stop.clone();
        let mut test = SelfTest { running: Some(running), ..SelfTest::default() };
        for found in [outcome(1.2), outcome(1.7), outcome(f64::NAN)] {
            send.send(found).expect("the test listens");
        }
        test.poll();
        let holds: Vec<Option<bool>> = test.lines().iter().map(|l| l.holds).collect();
        assert_eq!(holds[..4], [Some(true), Some(false), Some(false), None]);
        assert!(test.state().starts_with(&format!("3 of {} made, 2 fail", CHECKS.len())), "{}", test.state());
        let text = test.text();
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!(lines.len(), CHECKS.len() + 1);
        assert_eq!(lines[1], format!("ok    {}: 1.2000 for 1.0000 ± 0.50000", CHECKS[0].name));
        assert!(lines[2].starts_with("FAIL") && lines[3].starts_with("FAIL") && lines[4].starts_with("-"));
        // The thread ends: so does the test. One that is stopped tells the thread.
        drop(send);
        test.poll();
        assert!(test.running.is_none() && test.state().starts_with("2 of 3 fail"), "{}", test.state());
        assert!(stop.load(Ordering::Relaxed));
    }
}
