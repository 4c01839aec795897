//! The elements of a Matroska file, one after the other.

use std::io::{self, BufRead, BufReader, Read, Seek};

use crate::text::fault::zeros;

/// Elements that are looked into or read; the identifiers are Matroska's.
pub(super) mod id {
    pub const SEGMENT: u32 = 0x1853_8067;
    pub const INFO: u32 = 0x1549_A966;
    pub const TIMESTAMP_SCALE: u32 = 0x2A_D7B1;
    pub const TRACKS: u32 = 0x1654_AE6B;
    pub const TRACK_ENTRY: u32 = 0xAE;
    pub const TRACK_NUMBER: u32 = 0xD7;
    pub const NAME: u32 = 0x536E;
    pub const CODEC_ID: u32 = 0x86;
    pub const CODEC_PRIVATE: u32 = 0x63A2;
    pub const CONTENT_ENCODINGS: u32 = 0x6D80;
    pub const VIDEO: u32 = 0xE0;
    pub const PIXEL_WIDTH: u32 = 0xB0;
    pub const PIXEL_HEIGHT: u32 = 0xBA;
    pub const CLUSTER: u32 = 0x1F43_B675;
    pub const TIMESTAMP: u32 = 0xE7;
    pub const SIMPLE_BLOCK: u32 = 0xA3;
    pub const BLOCK_GROUP: u32 = 0xA0;
    pub const BLOCK: u32 = 0xA1;
    pub const ATTACHMENTS: u32 = 0x1941_A469;
    pub const ATTACHED_FILE: u32 = 0x61A7;
    pub const FILE_NAME: u32 = 0x466E;
    pub const FILE_DATA: u32 = 0x465C;
    pub const HEADER: u32 = 0x1A45_DFA3;
}

/// Elements that hold others. They are entered and need no size of their own, so live recordings, in which sizes are
/// left open, read like finished ones.
const ENTERED: [u32; 9] = [
    id::SEGMENT,
    id::INFO,
    id::TRACKS,
    id::TRACK_ENTRY,
    id::VIDEO,
    id::CLUSTER,
    id::BLOCK_GROUP,
    id::ATTACHMENTS,
    id::ATTACHED_FILE,
];

/// The head of an element.
pub(super) struct Element {
    pub id: u32,
    /// Place of the data in the file.
    pub offset: u64,
    /// Bytes of the data; 0 for an element that is entered.
    pub size: u64,
}

/// Walks through a file without reading what is not asked for.
pub(super) struct Elements<R> {
    reader: BufReader<R>,
    position: u64,
    length: u64,
}

impl<R: Read + Seek> Elements<R> {
    pub fn new(mut inner: R) -> io::Result<Self> {
        let length = inner.seek(io::SeekFrom::End(0))?;
        inner.rewind()?;
        Ok(Self { reader: BufReader::new(inner), position: 0, length })
    }

    /// The next element, `None` at the end of the file; the data of the one before must have been read or skipped.
    pub fn next(&mut self) -> io::Result<Option<Element>> {
        if self.reader.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let id = self.variable(4, Keep::Marker)?;
        let size = self.variable(8, Keep::Value)?;
        let (id, offset) = (id.unwrap_or(0) as u32, self.position);
        if ENTERED.contains(&id) {
            return Ok(Some(Element { id, offset, size: 0 }));
        }
        let left = self.length.saturating_sub(offset);
        match size {
            Some(size) if size <= left => Ok(Some(Element { id, offset, size })),
            Some(size) => {
                Err(invalid(format!("element {id:#x} at byte {offset} promises {size} bytes, {left} are left")))
            }
            None => Err(invalid(format!("element {id:#x} at byte {offset} has no size"))),
        }
    }

    pub fn skip(&mut self, bytes: u64) -> io::Result<()> {
        // An element ends within the file, whose length is an i64.
        self.reader.seek_relative(bytes as i64)?;
        self.position += bytes;
        Ok(())
    }

    /// The data of an element of at most `most` bytes.
    pub fn data(&mut self, element: &Element, most: u64) -> io::Result<Vec<u8>> {
        if element.size > most {
            let (id, size) = (element.id, element.size);
            return Err(invalid(format!("element {id:#x} has {size} bytes, expected at most {most}")));
        }
        let mut data = zeros(element.size as usize)?;
        self.reader.read_exact(&mut data)?;
        self.position += element.size;
        Ok(data)
    }

    pub fn unsigned(&mut self, element: &Element) -> io::Result<u64> {
        let data = self.data(element, 8)?;
        Ok(data.iter().fold(0, |value, &byte| value << 8 | u64::from(byte)))
    }

    pub fn text(&mut self, element: &Element) -> io::Result<String> {
        let data = self.data(element, 1 << 16)?;
        Ok(String::from_utf8_lossy(&data).trim_end_matches('\0').to_owned())
    }

    /// A number whose first byte tells its length; `None` where all its bits are set ("unknown").
    fn variable(&mut self, longest: u32, keep: Keep) -> io::Result<Option<u64>> {
        let mut first = [0_u8; 1];
        self.reader.read_exact(&mut first)?;
        let length = first[0].leading_zeros() + 1;
        if length > longest {
            return Err(invalid(format!("no Matroska element begins at byte {}", self.position)));
        }
        let mut bytes = [0_u8; 8];
        let rest = &mut bytes[1..length as usize];
        self.reader.read_exact(rest)?;
        self.position += u64::from(length);
        let number = rest.iter().fold(u64::from(first[0]), |number, &byte| number << 8 | u64::from(byte));
        let mask = (1_u64 << (7 * length)) - 1;
        Ok(match keep {
            Keep::Marker => Some(number),
            Keep::Value => Some(number & mask).filter(|&value| value != mask),
        })
    }
}

#[derive(Clone, Copy)]
enum Keep {
    /// Identifiers are written with the bit that marks their length.
    Marker,
    /// Sizes are meant without it.
    Value,
}

fn invalid(reason: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason)
}
