use std::path::{Path, PathBuf};

/// What can be wrong with a file. Every message names the file first.
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
    /// A text file (RON, CSV, trajectory) does not say what it should at a position.
    #[error("{}:{line}:{column}: {}{reason}", .file.display(), prefix(.field))]
    Text {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Column from 1: of the character, in a table of the field.
        column: usize,
        /// Path of the field or name of the table's column; empty where none is concerned.
        field: String,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// A survey, calibration or table held in memory contradicts itself.
    #[error("{what}: {}{reason}", prefix(.field))]
    Value {
        /// What was checked, such as "calibration".
        what: &'static str,
        /// Path of the field; empty where the whole is concerned.
        field: String,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// An array that the level needs is not in the file.
    #[error("{}: there is no array `{array}`, only {present}", .file.display())]
    MissingArray {
        /// The file.
        file: PathBuf,
        /// The array looked for.
        array: String,
        /// The arrays there are.
        present: String,
    },
    /// An array has another shape than the survey says.
    #[error("{}: array `{array}` has shape {found:?}, expected {expected}", .file.display())]
    ArrayShape {
        /// The file.
        file: PathBuf,
        /// The array.
        array: String,
        /// Its shape.
        found: Vec<usize>,
        /// The shape it should have.
        expected: String,
    },
    /// An array has another element type than the level allows.
    #[error("{}: array `{array}` holds `{found}`, expected {expected}", .file.display())]
    ArrayType {
        /// The file.
        file: PathBuf,
        /// The array.
        array: String,
        /// Its type as numpy writes it.
        found: String,
        /// The types allowed.
        expected: String,
    },
    /// The bytes or the values of an array are not what they should be.
    #[error("{}: array `{array}` {reason}", .file.display())]
    Array {
        /// The file.
        file: PathBuf,
        /// The array.
        array: String,
        /// What is wrong and what was expected.
        reason: String,
    },
    /// No value of an array is a measurement: the frame shows nothing.
    #[error("{}: array `{array}` {reason}", .file.display())]
    NothingMeasured {
        /// The file.
        file: PathBuf,
        /// The array.
        array: String,
        /// How that shows.
        reason: String,
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
    /// A file is not of the format that its name or use promises.
    #[error("{}: {reason}", .file.display())]
    Format {
        /// The file.
        file: PathBuf,
        /// What is wrong and what was expected.
        reason: String,
    },
}

/// Result with this crate's [`Error`].
pub(crate) type Result<T> = std::result::Result<T, Error>;

fn prefix(field: &str) -> String {
    if field.is_empty() { String::new() } else { format!("`{field}`: ") }
}

/// Errors of outputs are those of files.
impl From<atomic_output::Error> for Error {
    fn from(error: atomic_output::Error) -> Self {
        match error {
            atomic_output::Error::Io { file, operation, source } => Self::Io { file, operation, source },
            atomic_output::Error::OverInput { out, relation, input } => Self::OverInput { out, relation, input },
            atomic_output::Error::Format { file, reason } => Self::Format { file, reason },
            other => Self::Format { file: PathBuf::new(), reason: other.to_string() },
        }
    }
}

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

/// A field of a value in memory that does not hold; becomes [`Error::Value`], or [`Error::Text`] once its place in a file is known.
#[cfg(any(feature = "survey", feature = "calibration"))]
#[derive(Debug)]
pub(crate) struct InvalidField {
    pub field: String,
    pub reason: String,
}

#[cfg(any(feature = "survey", feature = "calibration"))]
impl InvalidField {
    pub fn new(field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { field: field.into(), reason: reason.into() }
    }

    pub fn in_memory(self, what: &'static str) -> Error {
        Error::Value { what, field: self.field, reason: self.reason }
    }
}
