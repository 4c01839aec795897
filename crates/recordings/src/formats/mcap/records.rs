//! The contents of records.

use crate::formats::chunk::Compression;

/// Walks through the fields of a record; `None` where it ends too early.
pub(super) struct Fields<'a>(pub &'a [u8]);

impl<'a> Fields<'a> {
    pub fn take(&mut self, count: usize) -> Option<&'a [u8]> {
        let (found, rest) = self.0.split_at_checked(count)?;
        self.0 = rest;
        Some(found)
    }

    fn array<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (found, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*found)
    }

    pub fn u16(&mut self) -> Option<u16> {
        self.array().map(u16::from_le_bytes)
    }

    pub fn u32(&mut self) -> Option<u32> {
        self.array().map(u32::from_le_bytes)
    }

    pub fn u64(&mut self) -> Option<u64> {
        self.array().map(u64::from_le_bytes)
    }

    pub fn text(&mut self) -> Option<String> {
        let length = self.u32()? as usize;
        Some(String::from_utf8_lossy(self.take(length)?).into_owned())
    }
}

/// A type of message.
#[derive(Debug, Clone)]
pub(super) struct Schema {
    pub id: u16,
    pub name: String,
}

impl Schema {
    pub fn read(record: &[u8]) -> Option<Self> {
        let mut fields = Fields(record);
        Some(Self { id: fields.u16()?, name: fields.text()? })
    }
}

/// A topic with its type.
#[derive(Debug, Clone)]
pub(super) struct Channel {
    pub id: u16,
    pub schema: u16,
    pub topic: String,
    pub encoding: String,
}

impl Channel {
    pub fn read(record: &[u8]) -> Option<Self> {
        let mut fields = Fields(record);
        Some(Self { id: fields.u16()?, schema: fields.u16()?, topic: fields.text()?, encoding: fields.text()? })
    }
}

/// What stands before the bytes of a message.
pub(super) struct MessageHead {
    pub channel: u16,
    pub log_time: u64,
}

impl MessageHead {
    /// Bytes of a head.
    pub const LENGTH: usize = 22;

    /// The head and the bytes behind it.
    pub fn read(record: &[u8]) -> Option<(Self, &[u8])> {
        let mut fields = Fields(record);
        let channel = fields.u16()?;
        fields.u32()?;
        let log_time = fields.u64()?;
        fields.u64()?;
        Some((Self { channel, log_time }, fields.0))
    }
}

/// What stands before the records of a chunk.
pub(super) struct ChunkHead {
    pub stated: u64,
    pub checksum: u32,
    pub compression: Compression,
    /// Bytes of the compressed records.
    pub length: u64,
    /// Bytes of the head itself.
    pub head: usize,
}

impl ChunkHead {
    /// Most bytes of a head: numbers, and the name of a compression.
    pub const LONGEST: u64 = 28 + 4 + 8 + 64;

    pub fn read(record: &[u8]) -> Option<Self> {
        let mut fields = Fields(record);
        fields.u64()?;
        fields.u64()?;
        let stated = fields.u64()?;
        let checksum = fields.u32()?;
        let compression = match fields.text()?.as_str() {
            "" => Compression::None,
            "lz4" => Compression::Lz4,
            "zstd" => Compression::Zstd,
            other => Compression::Other(other.to_owned()),
        };
        let length = fields.u64()?;
        Some(Self { stated, checksum, compression, length, head: record.len() - fields.0.len() })
    }
}

/// Numbers of messages by channel.
pub(super) fn message_counts(record: &[u8]) -> Option<Vec<(u16, u64)>> {
    let mut fields = Fields(record);
    // Numbers of messages, schemas, channels, attachments, metadata, chunks; first and last time.
    fields.take(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8)?;
    let length = fields.u32()? as usize;
    let mut counts = Fields(fields.take(length)?);
    let mut found = Vec::new();
    while let (Some(channel), Some(count)) = (counts.u16(), counts.u64()) {
        found.push((channel, count));
    }
    Some(found)
}

/// Name and values of a metadata record.
pub(super) fn metadata(record: &[u8]) -> Option<(String, Vec<(String, String)>)> {
    let mut fields = Fields(record);
    let name = fields.text()?;
    let length = fields.u32()? as usize;
    let mut values = Fields(fields.take(length)?);
    let mut found = Vec::new();
    while let (Some(name), Some(value)) = (values.text(), values.text()) {
        found.push((name, value));
    }
    Some((name, found))
}

/// Name of an attachment, bytes of its head and of its data.
pub(super) fn attachment(head: &[u8]) -> Option<(String, usize, u64)> {
    let mut fields = Fields(head);
    fields.u64()?;
    fields.u64()?;
    let name = fields.text()?;
    fields.text()?;
    let length = fields.u64()?;
    Some((name, head.len() - fields.0.len(), length))
}
