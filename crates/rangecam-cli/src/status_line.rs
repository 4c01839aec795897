//! How a stream stands: one line on a terminal that is written anew, and nothing in a log.

use std::io::Write;
use std::net::SocketAddr;

use indicatif::{ProgressBar, ProgressStyle};
use live_tasks::{LiveStatus, LiveWatch};

use crate::escape;

/// The line on standard error.
pub(crate) struct StatusLine {
    bar: ProgressBar,
    tells_page: bool,
}

impl StatusLine {
    /// A line that indicatif hides by itself where there is no terminal, and cuts to its width.
    pub(crate) fn on_terminal() -> Self {
        let bar = ProgressBar::new_spinner();
        if let Ok(style) = ProgressStyle::with_template("{wide_msg}") {
            bar.set_style(style);
        }
        Self { bar, tells_page: true }
    }

    /// No line, but the address of the page.
    pub(crate) fn page_only() -> Self {
        Self { bar: ProgressBar::hidden(), tells_page: true }
    }

    /// Nothing at all.
    pub(crate) fn silent() -> Self {
        Self { bar: ProgressBar::hidden(), tells_page: false }
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

    fn status(&mut self, status: &LiveStatus) {
        self.bar.set_message(escape::words(&status.to_string()).into_owned());
        self.bar.tick();
    }
}
