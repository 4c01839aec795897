//! Records: a header of named fields, then data.

use crate::formats::chunk::Compression;

/// Named fields of a header.
pub(super) struct Fields<'a>(Vec<(&'a [u8], &'a [u8])>);

impl<'a> Fields<'a> {
    /// The fields of a header; `None` where one is no `name=value` or ends too early.
    pub fn read(mut header: &'a [u8]) -> Option<Self> {
        let mut fields = Vec::new();
        while !header.is_empty() {
            let (length, rest) = header.split_first_chunk::<4>()?;
            let (field, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
            let equals = field.iter().position(|&byte| byte == b'=')?;
            fields.push((&field[..equals], &field[equals + 1..]));
            header = rest;
        }
        Some(Self(fields))
    }

    pub fn get(&self, name: &str) -> Option<&'a [u8]> {
        self.0.iter().find(|(found, _)| *found == name.as_bytes()).map(|(_, value)| *value)
    }

    pub fn op(&self) -> Option<u8> {
        self.get("op")?.first().copied()
    }

    pub fn u32(&self, name: &str) -> Option<u32> {
        Some(u32::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    pub fn u64(&self, name: &str) -> Option<u64> {
        Some(u64::from_le_bytes(self.get(name)?.try_into().ok()?))
    }

    pub fn text(&self, name: &str) -> Option<String> {
        Some(String::from_utf8_lossy(self.get(name)?).into_owned())
    }

    /// A time, nanosecond.
    pub fn time(&self, name: &str) -> Option<i64> {
        let bytes: [u8; 8] = self.get(name)?.try_into().ok()?;
        let [seconds, nanoseconds] =
            [0, 4].map(|at| u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]));
        Some(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds))
    }

    pub fn compression(&self) -> Option<Compression> {
        Some(match self.get("compression")? {
            b"none" => Compression::None,
            b"lz4" => Compression::Lz4,
            other => Compression::Other(String::from_utf8_lossy(other).into_owned()),
        })
    }
}

/// A topic with its type.
pub(super) struct Connection {
    pub id: u32,
    pub topic: String,
    pub type_name: String,
}

impl Connection {
    /// From the fields of a connection record and its data, a header of its own.
    pub fn read(fields: &Fields, data: &[u8]) -> Option<Self> {
        let type_name = Fields::read(data)?.text("type")?;
        Some(Self { id: fields.u32("conn")?, topic: fields.text("topic")?, type_name })
    }
}

/// The first record of some bytes: header, data, and the rest.
pub(super) fn split(bytes: &[u8]) -> Option<(&[u8], &[u8], &[u8])> {
    let (header, rest) = counted(bytes)?;
    let (data, rest) = counted(rest)?;
    Some((header, data, rest))
}

fn counted(bytes: &[u8]) -> Option<(&[u8], &[u8])> {
    let (length, rest) = bytes.split_first_chunk::<4>()?;
    rest.split_at_checked(u32::from_le_bytes(*length) as usize)
}
