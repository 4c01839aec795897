//! The elements of a Matroska file.

use std::io;

use crate::input::Input;

/// Elements that are looked into or read; the identifiers are Matroska's.
pub(super) mod id {
    pub const SEGMENT: u32 = 0x1853_8067;
    pub const INFO: u32 = 0x1549_A966;
    pub const DURATION: u32 = 0x4489;
    pub const TIMESTAMP_SCALE: u32 = 0x2A_D7B1;
    pub const WRITING_APP: u32 = 0x5741;
    pub const TITLE: u32 = 0x7BA9;
    pub const TRACKS: u32 = 0x1654_AE6B;
    pub const TRACK_ENTRY: u32 = 0xAE;
    pub const TRACK_NUMBER: u32 = 0xD7;
    pub const TRACK_UID: u32 = 0x73C5;
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
    pub const CUES: u32 = 0x1C53_BB6B;
    pub const ATTACHMENTS: u32 = 0x1941_A469;
    pub const ATTACHED_FILE: u32 = 0x61A7;
    pub const FILE_NAME: u32 = 0x466E;
    pub const FILE_DATA: u32 = 0x465C;
    pub const TAGS: u32 = 0x1254_C367;
    pub const TAG: u32 = 0x7373;
    pub const TARGETS: u32 = 0x63C0;
    pub const TARGET_TRACK_UID: u32 = 0x63C5;
    pub const SIMPLE_TAG: u32 = 0x67C8;
    pub const TAG_NAME: u32 = 0x45A3;
    pub const TAG_STRING: u32 = 0x4487;
}

/// Elements that hold others. They are entered and need no size of their own, so recordings in which sizes were left open
/// read like finished ones.
const ENTERED: [u32; 6] = [id::SEGMENT, id::INFO, id::TRACKS, id::CLUSTER, id::ATTACHMENTS, id::TAGS];

/// The head of an element.
pub(super) struct Element {
    pub id: u32,
    /// Bytes of the data; `None` where the size is left open.
    pub size: Option<u64>,
}

impl Element {
    pub fn is_entered(&self) -> bool {
        ENTERED.contains(&self.id)
    }
}

/// What comes next in the file.
pub(super) enum Next {
    Element(Element),
    /// No element begins here.
    Nonsense,
    /// The file ends within a head.
    Short,
}

/// The head of the next element; reading stands at its data.
pub(super) fn next(input: &mut Input) -> io::Result<Next> {
    let bytes = input.peek(12)?;
    let Some((id, behind)) = number(&bytes, 4, Keep::Marker) else {
        return Ok(if bytes.first().is_some_and(|&first| first < 0x10) { Next::Nonsense } else { Next::Short });
    };
    let Some((size, rest)) = number(behind, 8, Keep::Value) else {
        return Ok(if behind.first() == Some(&0) { Next::Nonsense } else { Next::Short });
    };
    input.skip((bytes.len() - rest.len()) as u64)?;
    Ok(Next::Element(Element { id: id.unwrap_or(0) as u32, size }))
}

/// The elements within the data of one, as far as they make sense.
pub(super) fn children(mut data: &[u8]) -> impl Iterator<Item = (u32, &[u8])> {
    std::iter::from_fn(move || {
        let (id, behind) = number(data, 4, Keep::Marker)?;
        let (size, behind) = number(behind, 8, Keep::Value)?;
        let (found, rest) = behind.split_at_checked(usize::try_from(size?).ok()?)?;
        data = rest;
        Some((id? as u32, found))
    })
}

/// A whole number.
pub(super) fn unsigned(data: &[u8]) -> u64 {
    data.iter().take(8).fold(0, |value, &byte| value << 8 | u64::from(byte))
}

/// A text.
pub(super) fn text(data: &[u8]) -> String {
    String::from_utf8_lossy(data).trim_end_matches('\0').to_owned()
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Keep {
    /// Identifiers are written with the bit that marks their length.
    Marker,
    /// Sizes are meant without it.
    Value,
}

/// A number whose first byte tells its length, and what is behind it; its value is `None` where all bits are set
/// ("unknown").
pub(super) fn number(bytes: &[u8], longest: u32, keep: Keep) -> Option<(Option<u64>, &[u8])> {
    let first = *bytes.first()?;
    let length = first.leading_zeros() + 1;
    if length > longest {
        return None;
    }
    let (own, rest) = bytes.split_at_checked(length as usize)?;
    let number = own.iter().fold(0, |number, &byte| number << 8 | u64::from(byte));
    let mask = (1_u64 << (7 * length)) - 1;
    let value = match keep {
        Keep::Marker => Some(number),
        Keep::Value => Some(number & mask).filter(|&value| value != mask),
    };
    Some((value, rest))
}
