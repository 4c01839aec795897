//! RON with the extensions that people expect, and errors that carry the position.

use std::path::Path;

use ron::extensions::Extensions;
use serde::de::DeserializeOwned;

use crate::{Error, Result};

/// Parses `text`; `path` names it in errors.
pub(crate) fn read_ron<T: DeserializeOwned>(text: &str, path: &Path) -> Result<T> {
    let extensions = Extensions::IMPLICIT_SOME | Extensions::UNWRAP_VARIANT_NEWTYPES;
    ron::Options::default().with_default_extension(extensions).from_str(text).map_err(|error| Error::Ron {
        path: path.to_owned(),
        line: error.span.start.line,
        column: error.span.start.col,
        message: error.code.to_string(),
    })
}
