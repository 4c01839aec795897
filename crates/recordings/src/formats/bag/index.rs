//! The index at the end of a bag that was closed: its connections and how many messages each has.

use std::collections::BTreeMap;
use std::io;

use super::op;
use super::records::{Connection, Fields, split};
use crate::input::Input;

/// Most bytes of an index that is read in advance: some hundred thousand chunks.
const LONGEST: u64 = 1 << 26;

/// Connections of a bag and numbers of their messages.
#[derive(Default)]
pub(super) struct Index {
    pub connections: Vec<Connection>,
    pub counts: BTreeMap<u32, u64>,
}

/// Reads the index at `place`; what makes no sense ends it, since connections stand in the chunks once more.
pub(super) fn read(input: &mut Input, place: u64) -> io::Result<Index> {
    let mut index = Index::default();
    let length = input.length();
    if place == 0 || place >= length || length - place > LONGEST {
        return Ok(index);
    }
    input.seek(place)?;
    let bytes = input.bytes(length - place)?;
    let mut rest = bytes.as_slice();
    while let Some((header, data, behind)) = split(rest) {
        rest = behind;
        let Some(fields) = Fields::read(header) else { break };
        match fields.op() {
            Some(op::CONNECTION) => index.connections.extend(Connection::read(&fields, data)),
            Some(op::CHUNK_INFO) => {
                for entry in data.as_chunks::<8>().0 {
                    let [id, count] =
                        [0, 4].map(|at| u32::from_le_bytes([entry[at], entry[at + 1], entry[at + 2], entry[at + 3]]));
                    *index.counts.entry(id).or_default() += u64::from(count);
                }
            }
            _ => {}
        }
    }
    Ok(index)
}
