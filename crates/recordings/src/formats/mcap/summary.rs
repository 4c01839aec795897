//! The index at the end of a file that was closed: channels and their numbers of messages before any message is read.

use std::io;

use super::records::{Fields, message_counts};
use super::{MAGIC, opcode};
use crate::input::Input;

/// Bytes of the last record with its head, and of what stands behind it.
const FOOTER: u64 = 9 + 20 + 8;

/// Most bytes of an index that is read in advance: a million entries.
const LONGEST: u64 = 1 << 26;

/// Whether the file ends as a file that was closed does.
pub(super) fn is_closed(input: &mut Input) -> io::Result<bool> {
    let length = input.length();
    if length < FOOTER {
        return Ok(false);
    }
    input.seek(length - 8)?;
    Ok(input.array::<8>()? == MAGIC)
}

/// Schemas, channels and counts of the index, in its order; empty where there is none or it makes no sense, since all of
/// it stands in the file once more.
pub(super) fn records(input: &mut Input) -> io::Result<Vec<(u8, Vec<u8>)>> {
    let length = input.length();
    input.seek(length - FOOTER)?;
    let footer: [u8; 37] = input.array()?;
    let start = Fields(&footer[9..]).u64().unwrap_or(0);
    let end = length - FOOTER;
    if footer[0] != opcode::FOOTER || start == 0 || start >= end || end - start > LONGEST {
        return Ok(Vec::new());
    }
    input.seek(start)?;
    let bytes = input.bytes(end - start)?;
    let mut rest = bytes.as_slice();
    let mut found = Vec::new();
    while let Some((&code, behind)) = rest.split_first() {
        let mut fields = Fields(behind);
        let Some(record) = fields.u64().and_then(|length| fields.take(usize::try_from(length).ok()?)) else { break };
        if matches!(code, opcode::SCHEMA | opcode::CHANNEL | opcode::STATISTICS) {
            found.push((code, record.to_vec()));
        }
        rest = fields.0;
    }
    Ok(found)
}

/// Numbers of messages by channel.
pub(super) fn counts(record: &[u8]) -> Vec<(u16, u64)> {
    message_counts(record).unwrap_or_default()
}
