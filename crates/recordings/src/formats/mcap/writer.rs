//! Writing MCAP: chunks in LZ4 with their indexes, and the summary that readers seek by.

use std::collections::BTreeMap;
use std::io::{self, Write};

use lz4_flex::frame::{BlockSize, FrameEncoder, FrameInfo};

use super::{MAGIC, opcode};
use crate::Error;
use crate::error::Result;
use crate::payload::Payload;
use crate::ros::{MessageType, definition, encode};

/// Bytes of records after which a chunk is closed, before compression: what a reader has to hold for one message. Larger
/// chunks compress little better; the format's own tools take 768 KiB to 4 MiB.
const CHUNK_BYTES: usize = 1 << 20;

/// A stream that messages are written to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StreamId(u16);

/// Writes messages of ROS 2 as MCAP, which Foxglove, `ros2 bag` and the format's own tools read.
///
/// Streams are declared by their first message, so the type of each is that of what is written. Until
/// [`finish`](Self::finish) the file has no index, as if it were cut off.
pub struct McapWriter<W: Write> {
    out: W,
    position: u64,
    schemas: Vec<MessageType>,
    channels: Vec<Channel>,
    chunk: Chunk,
    chunks: Vec<ChunkIndex>,
    times: Option<[u64; 2]>,
}

struct Channel {
    topic: String,
    message: Option<MessageType>,
    messages: u64,
}

/// Records that wait for their chunk to be full, and where the messages among them stand.
#[derive(Default)]
struct Chunk {
    records: Vec<u8>,
    index: BTreeMap<u16, Vec<(u64, u64)>>,
    times: Option<[u64; 2]>,
}

struct ChunkIndex {
    times: [u64; 2],
    start: u64,
    length: u64,
    indexes: Vec<(u16, u64)>,
    indexes_length: u64,
    compressed: u64,
    uncompressed: u64,
}

impl<W: Write> McapWriter<W> {
    /// Begins a recording.
    ///
    /// # Errors
    /// What the system answers.
    pub fn new(out: W) -> io::Result<Self> {
        let mut writer = Self {
            out,
            position: 0,
            schemas: Vec::new(),
            channels: Vec::new(),
            chunk: Chunk::default(),
            chunks: Vec::new(),
            times: None,
        };
        writer.write(&MAGIC)?;
        let library = concat!("rangecam recordings ", env!("CARGO_PKG_VERSION"));
        let header = Record::default().text("ros2").text(library).finish(opcode::HEADER);
        writer.write(&header)?;
        Ok(writer)
    }

    /// A stream of this topic. Its type is that of its first message.
    ///
    /// # Errors
    /// [`Error::Value`] where there are more than MCAP can count, 65,536.
    pub fn stream(&mut self, topic: &str) -> Result<StreamId> {
        if let Some(known) = self.channels.iter().position(|channel| channel.topic == topic) {
            return Ok(StreamId(known as u16));
        }
        let id = u16::try_from(self.channels.len())
            .map_err(|_| Error::value("stream", format!("`{topic}` is one more than the 65536 that MCAP can count")))?;
        self.channels.push(Channel { topic: topic.to_owned(), message: None, messages: 0 });
        Ok(StreamId(id))
    }

    /// Writes one message with its time, which is both that of the measurement and of the recording.
    ///
    /// # Errors
    /// [`Error::Value`] for a time before 1970 or behind 2038, a payload without a type in ROS, or one of another type
    /// than the stream's; [`Error::Io`] where the system refuses.
    pub fn message(&mut self, stream: StreamId, time_ns: i64, payload: &Payload) -> Result<()> {
        let second = time_ns.div_euclid(1_000_000_000);
        let time = u64::try_from(time_ns).ok().filter(|_| i32::try_from(second).is_ok());
        let time = time.ok_or_else(|| {
            Error::value("message", format!("is of {second} s since 1970, expected 0 to {} s", i32::MAX))
        })?;
        let (message, bytes) = encode(time_ns, payload).ok_or_else(|| {
            Error::value("message", "has no type in ROS, expected an image, a camera, an inertial sample")
        })?;
        self.declare(stream, message)?;
        let record = Record::default()
            .u16(stream.0)
            .u32(self.channels[stream.0 as usize].messages as u32)
            .u64(time)
            .u64(time)
            .bytes(&bytes)
            .finish(opcode::MESSAGE);
        let at = self.chunk.records.len() as u64;
        self.chunk.index.entry(stream.0).or_default().push((time, at));
        self.chunk.records.extend(record);
        self.chunk.times = Some(spanned(self.chunk.times, time));
        self.times = Some(spanned(self.times, time));
        self.channels[stream.0 as usize].messages += 1;
        if self.chunk.records.len() >= CHUNK_BYTES {
            self.close_chunk().map_err(written_to())?;
        }
        Ok(())
    }

    /// Writes what waits, and the index. Returns what was written to.
    ///
    /// # Errors
    /// What the system answers.
    pub fn finish(mut self) -> io::Result<W> {
        self.close_chunk()?;
        // Its checksum is not stated: zero.
        self.write(&Record::default().u32(0).finish(opcode::DATA_END))?;
        let start = self.position;
        let mut summary = Vec::new();
        for message in self.schemas.clone() {
            summary.extend(self.schema(message));
        }
        for (id, channel) in self.channels.iter().enumerate() {
            summary.extend(self.channel_record(id as u16, channel));
        }
        summary.extend(self.statistics());
        for chunk in &self.chunks {
            summary.extend(chunk.record());
        }
        // The checksum is that of the summary and of the footer before it.
        let mut footer = vec![opcode::FOOTER];
        footer.extend(20_u64.to_le_bytes());
        footer.extend(start.to_le_bytes());
        footer.extend(0_u64.to_le_bytes());
        summary.extend(footer);
        let checksum = crc32fast::hash(&summary);
        self.write(&summary)?;
        self.write(&checksum.to_le_bytes())?;
        self.write(&MAGIC)?;
        self.out.flush()?;
        Ok(self.out)
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.out.write_all(bytes)?;
        self.position += bytes.len() as u64;
        Ok(())
    }

    /// Puts schema and channel before the first message of a stream.
    fn declare(&mut self, stream: StreamId, message: MessageType) -> Result<()> {
        let Some(channel) = self.channels.get_mut(stream.0 as usize) else {
            return Err(Error::value("stream", "is none of this writer's"));
        };
        match channel.message {
            Some(known) if known == message => return Ok(()),
            Some(known) => {
                let reason =
                    format!("is {}, but its stream `{}` has {}", message.ros2_name(), channel.topic, known.ros2_name());
                return Err(Error::value("message", reason));
            }
            None => channel.message = Some(message),
        }
        if !self.schemas.contains(&message) {
            self.schemas.push(message);
            let schema = self.schema(message);
            self.chunk.records.extend(schema);
        }
        let record = self.channel_record(stream.0, &self.channels[stream.0 as usize]);
        self.chunk.records.extend(record);
        Ok(())
    }

    /// Schemas are numbered from 1 on: 0 stands for none.
    fn schema_id(&self, message: MessageType) -> u16 {
        self.schemas.iter().position(|known| *known == message).map_or(0, |index| index as u16 + 1)
    }

    fn schema(&self, message: MessageType) -> Vec<u8> {
        let text = definition(message);
        let record = Record::default().u16(self.schema_id(message)).text(&message.ros2_name()).text("ros2msg");
        record.text(&text).finish(opcode::SCHEMA)
    }

    fn channel_record(&self, id: u16, channel: &Channel) -> Vec<u8> {
        let schema = channel.message.map_or(0, |message| self.schema_id(message));
        Record::default().u16(id).u16(schema).text(&channel.topic).text("cdr").u32(0).finish(opcode::CHANNEL)
    }

    fn close_chunk(&mut self) -> io::Result<()> {
        let chunk = std::mem::take(&mut self.chunk);
        if chunk.records.is_empty() {
            return Ok(());
        }
        let times = chunk.times.unwrap_or([0, 0]);
        // Small blocks: of a chunk that is cut off, all whole blocks are read.
        let frame = FrameInfo::new().block_size(BlockSize::Max64KB);
        let mut encoder = FrameEncoder::with_frame_info(frame, Vec::new());
        encoder.write_all(&chunk.records)?;
        let compressed = encoder.finish().map_err(io::Error::other)?;
        let start = self.position;
        let record = Record::default()
            .u64(times[0])
            .u64(times[1])
            .u64(chunk.records.len() as u64)
            .u32(crc32fast::hash(&chunk.records))
            .text("lz4")
            .u64(compressed.len() as u64)
            .bytes(&compressed)
            .finish(opcode::CHUNK);
        self.write(&record)?;
        let (length, indexes_start) = (self.position - start, self.position);
        let mut indexes = Vec::new();
        for (channel, places) in &chunk.index {
            indexes.push((*channel, self.position));
            let mut record = Record::default().u16(*channel).u32(16 * places.len() as u32);
            for (time, place) in places {
                record = record.u64(*time).u64(*place);
            }
            self.write(&record.finish(opcode::MESSAGE_INDEX))?;
        }
        self.chunks.push(ChunkIndex {
            times,
            start,
            length,
            indexes,
            indexes_length: self.position - indexes_start,
            compressed: compressed.len() as u64,
            uncompressed: chunk.records.len() as u64,
        });
        Ok(())
    }

    fn statistics(&self) -> Vec<u8> {
        let times = self.times.unwrap_or([0, 0]);
        let mut record = Record::default()
            .u64(self.channels.iter().map(|channel| channel.messages).sum())
            .u16(self.schemas.len() as u16)
            .u32(self.channels.len() as u32)
            .u32(0)
            .u32(0)
            .u32(self.chunks.len() as u32)
            .u64(times[0])
            .u64(times[1])
            .u32(10 * self.channels.len() as u32);
        for (id, channel) in self.channels.iter().enumerate() {
            record = record.u16(id as u16).u64(channel.messages);
        }
        record.finish(opcode::STATISTICS)
    }
}

impl ChunkIndex {
    fn record(&self) -> Vec<u8> {
        let record = Record::default().u64(self.times[0]).u64(self.times[1]).u64(self.start).u64(self.length);
        let mut record = record.u32(10 * self.indexes.len() as u32);
        for (channel, place) in &self.indexes {
            record = record.u16(*channel).u64(*place);
        }
        let record = record.u64(self.indexes_length).text("lz4").u64(self.compressed).u64(self.uncompressed);
        record.finish(opcode::CHUNK_INDEX)
    }
}

/// A record that is being put together.
#[derive(Default)]
struct Record(Vec<u8>);

impl Record {
    fn u16(self, value: u16) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u32(self, value: u32) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    fn u64(self, value: u64) -> Self {
        self.bytes(&value.to_le_bytes())
    }

    fn text(self, text: &str) -> Self {
        self.u32(text.len() as u32).bytes(text.as_bytes())
    }

    fn bytes(mut self, bytes: &[u8]) -> Self {
        self.0.extend(bytes);
        self
    }

    fn finish(self, code: u8) -> Vec<u8> {
        let mut record = vec![code];
        record.extend((self.0.len() as u64).to_le_bytes());
        record.extend(self.0);
        record
    }
}

fn spanned(times: Option<[u64; 2]>, time: u64) -> [u64; 2] {
    times.map_or([time, time], |[first, last]| [first.min(time), last.max(time)])
}

/// For `map_err` where the file's name is the caller's.
fn written_to() -> impl FnOnce(io::Error) -> Error {
    Error::io("recording".as_ref(), "write")
}
