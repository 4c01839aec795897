//! Progress as a person sees it.

use std::sync::Mutex;
use std::time::Duration;

use indicatif::{ProgressBar, ProgressStyle};
use pipeline::Progress;

use crate::escape;

/// A bar on standard error; indicatif hides it by itself where that is no terminal.
pub(crate) struct Bar {
    bar: Mutex<ProgressBar>,
}

impl Bar {
    pub(crate) fn new() -> Self {
        Self { bar: Mutex::new(ProgressBar::hidden()) }
    }

    fn with(&self, act: impl FnOnce(&mut ProgressBar)) {
        // A panic elsewhere while the bar was drawn does not make the bar unusable.
        let mut bar = self.bar.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        act(&mut bar);
    }
}

impl Progress for Bar {
    fn begin(&self, work: &str, steps: usize) {
        let style = ProgressStyle::with_template("{prefix:>22} {wide_bar:.cyan/238} {pos}/{len} {elapsed}");
        let next = ProgressBar::new(steps as u64).with_prefix(escape::words(work).into_owned());
        if let Ok(style) = style {
            next.set_style(style.progress_chars("━━╌"));
        }
        next.enable_steady_tick(Duration::from_millis(200));
        self.with(|bar| {
            bar.finish_and_clear();
            *bar = next;
        });
    }

    fn advance(&self, done: usize) {
        self.with(|bar| bar.set_position(done as u64));
    }

    fn say(&self, message: &str) {
        self.with(|bar| bar.println(escape::words(message)));
    }

    fn finish(&self) {
        self.with(|bar| bar.finish_and_clear());
    }
}
