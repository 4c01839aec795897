use std::path::Path;

use crate::{Error, Result};

/// Longest file that is read as text.
const LONGEST_FILE: u64 = 1 << 30;

/// Reads a text file without its byte-order mark, refusing what is not UTF-8.
pub(crate) fn read_text(path: &Path) -> Result<String> {
    let length = std::fs::metadata(path).map_err(Error::io(path, "open"))?.len();
    if length > LONGEST_FILE {
        return Err(Error::format(path, format!("is {length} bytes long, expected at most {LONGEST_FILE}")));
    }
    let text = std::fs::read_to_string(path).map_err(Error::io(path, "read"))?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}
