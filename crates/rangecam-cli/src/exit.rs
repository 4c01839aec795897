//! What the shell sees: the same codes for all commands (docs/formats.md, "Exit codes").

use std::error::Error;
use std::process::ExitCode;

use pipeline::{Failure, Verdict};

/// What `--help` says of them.
pub(crate) const CODES: &str = "\
Exit codes:
  0  done
  1  done but doubtful: see the lines `doubt: ...` (of diff: the calibrations differ)
  2  wrong input or usage: it fails again until one of them is changed
  3  refused by what the data show; the reason is printed and written
  4  failure of the machine (disk, memory): worth another try
  5  done in part: a later step was refused, what stands without it was written";

/// Wrong input or usage, also of arguments that cannot be read.
pub(crate) const USAGE: u8 = 2;

/// The code of a command that has a result.
pub(crate) fn of_verdict(verdict: Verdict) -> ExitCode {
    ExitCode::from(match verdict {
        Verdict::Done => 0,
        Verdict::Doubtful => 1,
        Verdict::Partial => 5,
    })
}

/// Whether the output was there already and is left as it is.
pub(crate) fn is_done_already(error: &(dyn Error + 'static)) -> bool {
    matches!(error.downcast_ref(), Some(pipeline::Error::AlreadyDone { .. }))
}

/// The code of a command that failed.
pub(crate) fn of_error(error: &(dyn Error + 'static)) -> ExitCode {
    let failure = match error.downcast_ref::<pipeline::Error>() {
        Some(error) => error.failure(),
        // What could not be printed.
        None if error.is::<std::io::Error>() => Failure::Machine,
        None => Failure::Usage,
    };
    ExitCode::from(match failure {
        Failure::Usage => USAGE,
        Failure::Refused => 3,
        Failure::Machine => 4,
    })
}
