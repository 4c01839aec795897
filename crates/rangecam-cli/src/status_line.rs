//! How a stream stands: one line on a terminal that is written anew, and nothing in a log.

use std::io::Write;
use std::net::SocketAddr;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use indicatif::{ProgressBar, ProgressStyle};
use live_tasks::{LiveStatus, LiveWatch};
use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::flag::{register, register_conditional_shutdown};

use crate::escape;

/// The line on standard error.
pub(crate) struct StatusLine {
    bar: ProgressBar,
    tells_page: bool,
    interrupted: Arc<AtomicBool>,
}

/// Exit code of a second interrupt, as shells have it for the first.
const INTERRUPTED_TWICE: i32 = 128 + SIGINT;

impl StatusLine {
    /// A line that indicatif hides by itself where there is no terminal, and cuts to its width.
    pub(crate) fn on_terminal() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
            bar.set_style(style);
        }
        Self::new(bar, true)
    }

    /// No line, but the address of the page.
    pub(crate) fn page_only() -> Self {
        Self::new(ProgressBar::hidden(), true)
    }

    /// Nothing at all.
    pub(crate) fn silent() -> Self {
        Self::new(ProgressBar::hidden(), false)
    }

    fn new(bar: ProgressBar, tells_page: bool) -> Self {
        Self { bar, tells_page, interrupted: Arc::default() }
    }

    /// Ends the stream at an interrupt (Ctrl-C) or when the system asks to, with all results; a second one ends the program at once.
    pub(crate) fn end_at_interrupt(&self) -> std::io::Result<()> {
        for signal in [SIGINT, SIGTERM] {
            register_conditional_shutdown(signal, INTERRUPTED_TWICE, Arc::clone(&self.interrupted))?;
            register(signal, Arc::clone(&self.interrupted))?;
        }
        Ok(())
    }

    /// Leaves no line behind.
    pub(crate) fn clear(&self) {
        self.bar.finish_and_clear();
    }
}

impl LiveWatch for StatusLine {
    fn page(&mut self, address: SocketAddr) {
        if self.tells_page {
            // A reader that has closed standard error wants no more words.
            let _ = writeln!(std::io::stderr(), "page: http://{address}/");
        }
    }

    fn should_end(&mut self) -> bool {
        self.interrupted.load(Ordering::Relaxed)
    }

    fn status(&mut self, status: &LiveStatus) {
        self.bar.set_message(escape::words(&status.to_string()).into_owned());
        self.bar.tick();
    }
}
