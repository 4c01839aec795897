//! Progress as a person sees it: a bar on a terminal, and in a log a line now and then.

use std::io::{IsTerminal, Write};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use pipeline::Progress;

use crate::escape;

/// Time between two lines of a log; work that is done before leaves none.
const BETWEEN_LINES: Duration = Duration::from_secs(30);

/// Steps from which on a rate and the time left mean something.
const MANY_STEPS: usize = 10;

/// A bar on standard error, which indicatif hides by itself where that is no terminal.
pub(crate) struct Bar {
    shown: Mutex<Shown>,
    is_terminal: bool,
}

/// The present piece of work.
struct Shown {
    bar: ProgressBar,
    work: String,
    steps: usize,
    begun: Instant,
    last_line: Instant,
}

impl Bar {
    pub(crate) fn new() -> Self {
        let now = Instant::now();
        let shown = Shown { bar: ProgressBar::hidden(), work: String::new(), steps: 0, begun: now, last_line: now };
        Self { shown: Mutex::new(shown), is_terminal: std::io::stderr().is_terminal() }
    }

    fn with(&self, act: impl FnOnce(&mut Shown)) {
        // A panic elsewhere while the bar was drawn does not make the bar unusable.
        let mut shown = self.shown.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        act(&mut shown);
    }
}

impl Progress for Bar {
    fn begin(&self, work: &str, steps: usize) {
        let rate = if steps < MANY_STEPS { "" } else { " {per_sec}, {eta} left," };
        let template = format!("{{prefix:>22}} {{wide_bar:.cyan/238}} {{pos}}/{{len}}{rate} {{elapsed}}");
        let work = escape::words(work).into_owned();
        let bar = ProgressBar::new(steps as u64).with_prefix(work.clone());
        if let Ok(style) = ProgressStyle::with_template(&template) {
            bar.set_style(style.progress_chars("━━╌"));
        }
        bar.enable_steady_tick(Duration::from_millis(200));
        let now = Instant::now();
        self.with(|shown| {
            shown.bar.finish_and_clear();
            *shown = Shown { bar, work, steps, begun: now, last_line: now };
        });
    }

    fn advance(&self, done: usize) {
        self.with(|shown| {
            shown.bar.set_position(done as u64);
            if !self.is_terminal && shown.last_line.elapsed() >= BETWEEN_LINES {
                shown.last_line = Instant::now();
                let line = line(&shown.work, done, shown.steps, shown.begun.elapsed());
                // A reader that has closed standard error wants no more words.
                let _ = writeln!(std::io::stderr(), "{line}");
            }
        });
    }

    fn say(&self, message: &str) {
        self.with(|shown| shown.bar.println(escape::words(message)));
    }

    fn finish(&self) {
        self.with(|shown| shown.bar.finish_and_clear());
    }
}

/// How far work is, how fast it goes, and how long it will take.
fn line(work: &str, done: usize, steps: usize, elapsed: Duration) -> String {
    let per_second = done as f64 / elapsed.as_secs_f64();
    let left_s = steps.saturating_sub(done) as f64 / per_second;
    format!("{work}: {done} of {steps}, {per_second:.1} a second, {left_s:.0} s left")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_of_a_log_tells_rate_and_time_left() {
        let line = line("frames", 600, 2000, Duration::from_secs(30));
        assert_eq!(line, "frames: 600 of 2000, 20.0 a second, 70 s left");
    }
}
