//! RON files for people: read with the place and the field of every fault, written in lines of readable length.

mod layout;
mod locate;

use std::path::Path;

use ron::extensions::Extensions;
use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::{Error, Result, read_ron_text};

fn options() -> ron::Options {
    ron::Options::default().with_default_extension(Extensions::IMPLICIT_SOME)
}

/// Reads a RON file into a value. `#![enable(implicit_some)]` is always in force, whether written or not.
pub fn read<T: DeserializeOwned>(path: impl AsRef<Path>) -> Result<T> {
    let path = path.as_ref();
    parse(path, &read_ron_text(path)?)
}

/// Reads RON text into a value; `file` stands for it in messages.
pub fn parse<T: DeserializeOwned>(file: &Path, text: &str) -> Result<T> {
    options().from_str(text).map_err(|error| {
        let start = (error.span.start.line, error.span.start.col);
        let end = (error.span.end.line, error.span.end.col);
        let ((line, column), field) = match &error.code {
            ron::Error::NoSuchStructField { found, .. } => (start, locate::field_of_group(text, start, found)),
            ron::Error::MissingStructField { field, .. } | ron::Error::DuplicateStructField { field, .. } => {
                (start, locate::field_of_group(text, start, field))
            }
            _ => locate::field_between(text, start, end),
        };
        Error::Text { file: file.to_path_buf(), line, column, field, reason: error.code.to_string() }
    })
}

/// Writes a value as RON text with `#![enable(implicit_some)]`, one line for what fits one.
pub fn to_text<T: Serialize>(value: &T) -> Result<String> {
    let compact = options().to_string(value).map_err(|error| Error::Value {
        what: "writing RON",
        field: String::new(),
        reason: error.to_string(),
    })?;
    Ok(format!("#![enable(implicit_some)]\n{}", layout::in_lines(&compact)))
}

/// The error for a field (`stations[2].name`) of a RON text whose value was read but does not hold, at its place.
#[cfg(any(feature = "survey", feature = "calibration"))]
pub fn wrong_field(file: &Path, text: &str, field: String, reason: String) -> Error {
    at_field(file, text, crate::InvalidField { field, reason })
}

/// The error for a field that was read but does not hold, at its place in the text.
#[cfg(any(feature = "survey", feature = "calibration"))]
pub(crate) fn at_field(file: &Path, text: &str, invalid: crate::InvalidField) -> Error {
    let (line, column) = locate::place_of(text, &invalid.field);
    Error::Text { file: file.to_path_buf(), line, column, field: invalid.field, reason: invalid.reason }
}
