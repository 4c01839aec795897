use std::path::{Path, PathBuf};

/// What keeps a recording from being read or written. Every message names the file first.
///
/// A recording that is cut off or damaged in the middle is no error: what could be read was handed out, and
/// [`Ending`](crate::Ending) says what is missing.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: cannot {operation}: {source}", .file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What was tried, such as "open".
        operation: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// No recording that can be read from its beginning on.
    #[error("{}: {reason}", .file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// The file is of a format that this build leaves out.
    #[error("{}: needs the feature `{feature}`, which this build leaves out", .file.display())]
    LeftOut {
        /// The file.
        file: PathBuf,
        /// The feature of this crate.
        feature: &'static str,
    },
    /// A value that no message of its kind can have.
    #[error("{what}: {reason}")]
    Value {
        /// What the value is of, such as "image".
        what: &'static str,
        /// What is wrong and what was expected.
        reason: String,
    },
}

/// Result with this crate's [`Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

impl Error {
    /// For `map_err` behind a system call on `file`.
    pub(crate) fn io(file: &Path, operation: &'static str) -> impl FnOnce(std::io::Error) -> Self {
        let file = file.to_path_buf();
        move |source| Self::Io { file, operation, source }
    }

    pub(crate) fn format(file: &Path, reason: impl Into<String>) -> Self {
        Self::Format { file: file.to_path_buf(), reason: reason.into() }
    }

    pub(crate) fn value(what: &'static str, reason: impl Into<String>) -> Self {
        Self::Value { what, reason: reason.into() }
    }
}
