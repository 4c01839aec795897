//! MCAP recordings.

use recordings::McapWriter;

use super::{START_NS, messages};

/// As the crate writes it.
pub fn recording() -> Vec<u8> {
    let mut writer = McapWriter::new(Vec::new()).unwrap();
    for (topic, time, payload) in messages() {
        let stream = writer.stream(topic).unwrap();
        writer.message(stream, START_NS + time, &payload).unwrap();
    }
    writer.finish().unwrap()
}

/// A record.
pub fn record(code: u8, content: &[u8]) -> Vec<u8> {
    let mut record = vec![code];
    record.extend((content.len() as u64).to_le_bytes());
    record.extend(content);
    record
}

pub fn text(text: &str) -> Vec<u8> {
    let mut bytes = (text.len() as u32).to_le_bytes().to_vec();
    bytes.extend(text.as_bytes());
    bytes
}

pub fn schema(id: u16, name: &str) -> Vec<u8> {
    record(3, &[&id.to_le_bytes()[..], &text(name), &text("ros2msg"), &text("")].concat())
}

pub fn channel(id: u16, schema: u16, topic: &str, encoding: &str) -> Vec<u8> {
    let ids = [id.to_le_bytes(), schema.to_le_bytes()].concat();
    record(4, &[ids, text(topic), text(encoding), vec![0; 4]].concat())
}

pub fn message(channel: u16, time: u64, bytes: &[u8]) -> Vec<u8> {
    let times = [[0; 4].as_slice(), &time.to_le_bytes(), &time.to_le_bytes()].concat();
    record(5, &[&channel.to_le_bytes()[..], &times, bytes].concat())
}

pub fn chunk(compression: &str, records: &[u8], compressed: &[u8], checksum: u32) -> Vec<u8> {
    let sizes = [&[0; 16][..], &(records.len() as u64).to_le_bytes(), &checksum.to_le_bytes()].concat();
    let length = (compressed.len() as u64).to_le_bytes();
    record(6, &[sizes, text(compression), length.to_vec(), compressed.to_vec()].concat())
}

/// A Zstandard frame of stored blocks.
pub fn zstd(data: &[u8]) -> Vec<u8> {
    // Magic number; one segment with a size of four bytes.
    let mut frame = vec![0x28, 0xB5, 0x2F, 0xFD, 0b1010_0000];
    frame.extend((data.len() as u32).to_le_bytes());
    let blocks = data.chunks(1 << 10).collect::<Vec<_>>();
    for (index, block) in blocks.iter().enumerate() {
        let head = (block.len() as u32) << 3 | u32::from(index + 1 == blocks.len());
        frame.extend(&head.to_le_bytes()[..3]);
        frame.extend(*block);
    }
    frame
}

/// Magic, header, what is given, and the end of a file without an index.
pub fn file(parts: &[Vec<u8>]) -> Vec<u8> {
    let magic = b"\x89MCAP0\r\n".to_vec();
    let header = record(1, &[text("ros2"), text("test")].concat());
    let end = [record(0x0F, &[0; 4]), record(2, &[0; 20])].concat();
    [magic.clone(), header, parts.concat(), end, magic].concat()
}
