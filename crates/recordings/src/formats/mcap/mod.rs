//! MCAP: records with an opcode and a length, most of them in compressed chunks.
//!
//! A reader of its own: the format's own library brings in C for both of its compressions and some twenty crates without
//! them, cannot write a compressed chunk then, and gives up a chunk that is cut off, whose first messages are whole.

mod reader;
mod records;
mod summary;
mod writer;

pub(crate) use reader::Mcap;
pub use writer::{McapWriter, StreamId};

/// What a file begins and ends with.
pub(crate) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";

/// Kinds of records.
mod opcode {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const ATTACHMENT: u8 = 0x09;
    pub const STATISTICS: u8 = 0x0B;
    pub const METADATA: u8 = 0x0C;
    pub const DATA_END: u8 = 0x0F;
}
