//! Where words go: results to standard output, everything else to standard error.

use std::error::Error;
use std::fmt::Display;
use std::io::{ErrorKind, IsTerminal, Write};
use std::process::ExitCode;

use pipeline::{Judged, Progress, Silent};
use serde::Serialize;

use crate::arguments::Arguments;
use crate::bar::Bar;
#[cfg(feature = "every-command")]
use crate::status_line::StatusLine;
use crate::{escape, exit};

/// How the user wants to be spoken to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Voice {
    Words,
    Json,
    Quiet,
}

/// The command's voice.
#[derive(Debug)]
pub(crate) struct Output {
    voice: Voice,
    colour: bool,
}

impl Output {
    pub(crate) fn new(arguments: &Arguments) -> Self {
        let voice = match (arguments.json, arguments.quiet) {
            (true, _) => Voice::Json,
            (false, true) => Voice::Quiet,
            (false, false) => Voice::Words,
        };
        let colour = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
        Self { voice, colour }
    }

    /// The progress to show while work runs.
    pub(crate) fn progress(&self) -> Box<dyn Progress> {
        match self.voice {
            Voice::Words => Box::new(Bar::new()),
            Voice::Json | Voice::Quiet => Box::new(Silent),
        }
    }

    /// A result: JSON where that was asked for, words otherwise. What the shell sees is its verdict.
    pub(crate) fn result<T: Serialize + Display + Judged>(&self, result: &T) -> Result<ExitCode, Box<dyn Error>> {
        match self.voice {
            Voice::Words => print(&escape::words(&result.to_string()))?,
            Voice::Json => print(&escape::json(&serde_json::to_string_pretty(result)?))?,
            Voice::Quiet => {}
        }
        Ok(exit::of_verdict(result.verdict()))
    }

    /// As [`Self::result`], on standard error: standard output is taken.
    pub(crate) fn result_aside<T: Serialize + Display + Judged>(&self, result: &T) -> Result<ExitCode, Box<dyn Error>> {
        let words = match self.voice {
            Voice::Words => escape::words(&result.to_string()).into_owned(),
            Voice::Json => escape::json(&serde_json::to_string_pretty(result)?).into_owned(),
            Voice::Quiet => return Ok(exit::of_verdict(result.verdict())),
        };
        // A reader that has closed standard error wants no more words.
        let _ = writeln!(std::io::stderr(), "{words}");
        Ok(exit::of_verdict(result.verdict()))
    }

    /// The line that tells how a stream stands.
    #[cfg(feature = "every-command")]
    pub(crate) fn status_line(&self) -> StatusLine {
        match self.voice {
            Voice::Words => StatusLine::on_terminal(),
            Voice::Json => StatusLine::page_only(),
            Voice::Quiet => StatusLine::silent(),
        }
    }

    /// What a step on the way to the result has to say, where words are wanted.
    pub(crate) fn words(&self, step: &impl Display) -> std::io::Result<()> {
        if self.voice == Voice::Words { print(&escape::words(&format!("{step}\n"))) } else { Ok(()) }
    }

    /// The summary of a refused calibration: as JSON where that was asked for, in words it is the error alone.
    pub(crate) fn refusal(&self, error: &(dyn Error + 'static)) {
        if let (Voice::Json, Some(pipeline::Error::Refused { summary, .. })) = (self.voice, error.downcast_ref())
            && let Err(error) = print(&escape::json(summary))
        {
            self.error(&error);
        }
    }

    /// Nothing had to be done.
    pub(crate) fn done_already(&self, words: &(dyn Error + 'static)) -> ExitCode {
        let words = words.to_string();
        let printed = match self.voice {
            Voice::Words => print(&escape::words(&words)),
            Voice::Json => print(&escape::json(&serde_json::json!({ "done_already": words }).to_string())),
            Voice::Quiet => Ok(()),
        };
        match printed {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => exit::of_error(&error),
        }
    }

    /// Why the command failed.
    pub(crate) fn error(&self, error: &dyn Error) {
        let head = if self.colour { "\u{1b}[31merror:\u{1b}[0m" } else { "error:" };
        // A reader that has closed standard error wants no more words; the exit code tells.
        let _ = writeln!(std::io::stderr(), "{head} {}", escape::error(&error.to_string()));
    }
}

/// Help, version, or what is wrong with the arguments, which may hold a file's name: clap knows which stream each wants.
pub(crate) fn print_usage(error: &clap::Error) {
    let plain = error.render().to_string();
    let safe = escape::words(&plain);
    if safe == plain {
        let _ = error.print();
    } else {
        let _ = write!(std::io::stderr(), "{safe}");
    }
}

/// Prints a line. A reader that has closed the pipe has read enough: that is no failure.
fn print(words: &str) -> std::io::Result<()> {
    let mut out = std::io::stdout().lock();
    match writeln!(out, "{words}").and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        result => result,
    }
}
