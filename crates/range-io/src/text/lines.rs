//! Lines of bounded length.

use std::io::{BufRead, Read};

use crate::text::fault::Fault;
use crate::text::limits::LONGEST_LINE;

/// The next line with its end, `None` at the end of the file; `bytes` is the room for it.
pub(crate) fn read_line<'a>(reader: &mut impl BufRead, bytes: &'a mut Vec<u8>) -> Result<Option<&'a str>, Fault> {
    bytes.clear();
    let read = Read::take(reader, LONGEST_LINE).read_until(b'\n', bytes)?;
    if read as u64 == LONGEST_LINE && bytes.last() != Some(&b'\n') {
        return Err(format!("has a line of more than {LONGEST_LINE} bytes").into());
    }
    let text = std::str::from_utf8(bytes).map_err(|_| "has a line that is no text in UTF-8")?;
    Ok((read > 0).then_some(text))
}
