use std::path::{Path, PathBuf};

/// What can be wrong with an output. Every message names the file or folder first.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: cannot {operation}: {source}", .file.display())]
    Io {
        /// The file or folder.
        file: PathBuf,
        /// What was tried, such as "open".
        operation: &'static str,
        /// The system's answer.
        source: std::io::Error,
    },
    /// Results are to be written where something lies that they are made from.
    #[error("{}: cannot be the output folder: it {relation} {}, which is read; name another one", .out.display(), .input.display())]
    OverInput {
        /// The output folder as it was named.
        out: PathBuf,
        /// How the two meet: `is`, `contains` or `lies in`.
        relation: &'static str,
        /// The file or folder that is read.
        input: PathBuf,
    },
    /// A name at which nothing can be written, or what lies there is no output.
    #[error("{}: {reason}", .file.display())]
    Format {
        /// The file or folder.
        file: PathBuf,
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
}
