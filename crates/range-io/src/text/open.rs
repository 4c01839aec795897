//! The one way in which files are opened for reading.

use std::fs::{File, Metadata};
use std::io::Read;
use std::path::Path;

use crate::text::limits::{LONGEST_RON, LONGEST_TEXT};
use crate::{Error, Result};

/// Opens a regular file and tells its length in bytes.
///
/// A pipe would wait for ever, a device has no end, and a folder holds no bytes: they are refused before they are opened.
pub fn open(path: impl AsRef<Path>) -> Result<(File, u64)> {
    let path = path.as_ref();
    require_regular(path, &std::fs::metadata(path).map_err(Error::io(path, "open"))?)?;
    let file = File::open(path).map_err(Error::io(path, "open"))?;
    let found = file.metadata().map_err(Error::io(path, "find the size of"))?;
    // Another file may have taken the name in between.
    require_regular(path, &found)?;
    Ok((file, found.len()))
}

/// Reads a regular file of at most `longest` bytes.
pub fn read_bytes(path: impl AsRef<Path>, longest: u64) -> Result<Vec<u8>> {
    let path = path.as_ref();
    let (file, length) = open(path)?;
    let too_long = |length: u64| {
        let reason = format!("is {length} bytes long, expected at most {longest}");
        if length > longest { Err(Error::format(path, reason)) } else { Ok(()) }
    };
    too_long(length)?;
    let mut bytes = Vec::new();
    let reserved = bytes.try_reserve_exact(usize::try_from(length).unwrap_or(usize::MAX));
    reserved.map_err(|_| Error::io(path, "reserve memory for")(std::io::ErrorKind::OutOfMemory.into()))?;
    // A file that grows while it is read ends where the limit is.
    file.take(longest.saturating_add(1)).read_to_end(&mut bytes).map_err(Error::io(path, "read"))?;
    too_long(bytes.len() as u64)?;
    Ok(bytes)
}

/// Reads a regular text file of at most [`LONGEST_TEXT`] bytes without its byte-order mark, refusing what is not UTF-8.
pub fn read_text(path: impl AsRef<Path>) -> Result<String> {
    text(path.as_ref(), LONGEST_TEXT)
}

/// As [`read_text`] for RON and JSON, of at most [`LONGEST_RON`] bytes.
pub fn read_ron_text(path: impl AsRef<Path>) -> Result<String> {
    text(path.as_ref(), LONGEST_RON)
}

fn text(path: &Path, longest: u64) -> Result<String> {
    let text = String::from_utf8(read_bytes(path, longest)?).map_err(|error| {
        let fault = error.utf8_error().valid_up_to();
        let line = error.as_bytes()[..fault].split(|byte| *byte == b'\n').count();
        Error::format(path, format!("is no text in UTF-8: byte {fault} in line {line} belongs to no character"))
    })?;
    Ok(text.strip_prefix('\u{feff}').map(str::to_owned).unwrap_or(text))
}

fn require_regular(path: &Path, found: &Metadata) -> Result<()> {
    if found.is_file() {
        return Ok(());
    }
    let kind = if found.is_dir() { "folder" } else { "pipe or device" };
    Err(Error::format(path, format!("is a {kind}, expected a file")))
}
