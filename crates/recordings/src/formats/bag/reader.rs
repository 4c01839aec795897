//! Messages in the order of the file.

use std::collections::BTreeMap;
use std::io;

use super::records::{Connection, Fields, split};
use super::{MAGIC, index, op};
use crate::contents::{Contents, Ending, Kind};
use crate::formats::chunk::{Expanded, expand};
use crate::input::Input;
use crate::limits::LARGEST_RECORD;
use crate::message::Message;
use crate::payload::Payload;
use crate::recording::Step;
use crate::ros::{Decoded, Layout, MessageType, decode};

/// Most bytes of a record's header; those of connections hold a definition as data, not in the header.
const LONGEST_HEADER: u64 = 1 << 20;

/// The state of a reader.
#[derive(Default)]
pub(crate) struct Bag {
    connections: BTreeMap<u32, Known>,
    chunk: Option<Chunk>,
    /// Where the index begins, which is where messages end; 0 in a bag that was not closed.
    index_place: u64,
    /// Connections and chunks behind the messages, as the header states them.
    index_records: u64,
    index_seen: u64,
}

struct Known {
    stream: usize,
    message: Option<MessageType>,
}

/// The records of a chunk.
struct Chunk {
    bytes: Vec<u8>,
    at: usize,
    place: u64,
    /// Where it breaks off: how the recording ends behind it.
    ending: Option<Ending>,
}

impl Bag {
    /// Reads the header and the index, and goes to the first record.
    pub fn open(input: &mut Input, contents: &mut Contents) -> io::Result<Self> {
        let mut bag = Self::default();
        let start = MAGIC.len() as u64;
        // The header is padded to 4096 bytes.
        input.seek(start)?;
        let bytes = input.peek(4096 + 64)?;
        if let Some((header, ..)) = split(&bytes)
            && let Some(fields) = Fields::read(header)
            && fields.op() == Some(op::BAG_HEADER)
        {
            bag.index_place = fields.u64("index_pos").unwrap_or(0);
            let count = |name| fields.u32(name).map_or(0, u64::from);
            bag.index_records = count("conn_count") + count("chunk_count");
        }
        let index = index::read(input, bag.index_place)?;
        for connection in index.connections {
            bag.connection(connection, start, contents);
        }
        if !index.counts.is_empty() && bag.index_place < input.length() {
            for (id, known) in &bag.connections {
                contents.streams[known.stream].count = Some(index.counts.get(id).copied().unwrap_or(0));
            }
        }
        input.seek(start)?;
        Ok(bag)
    }

    /// The next message, or the end.
    pub fn next(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Step> {
        loop {
            if let Some(step) = self.of_chunk(contents) {
                return Ok(step);
            }
            let at = input.position();
            if input.left() == 0 {
                return Ok(Step::End(self.end(at, input.length())));
            }
            let (header, length) = match head(input)? {
                Ok(found) => found,
                Err(reason) => return Ok(Step::End(self.broken(at, input.length(), None, reason))),
            };
            let Some(fields) = Fields::read(&header) else {
                let reason = "a record's header is no list of fields".to_owned();
                return Ok(Step::End(self.broken(at, input.length(), None, reason)));
            };
            if length > input.left() {
                if fields.op() == Some(op::CHUNK) {
                    self.cut_chunk(at, length, &fields, input)?;
                    continue;
                }
                let reason = format!("a record promises {length} bytes, {} are left", input.left());
                return Ok(Step::End(self.broken(at, input.length(), Some(length - input.left()), reason)));
            }
            let end = input.position() + length;
            if let Some(message) = self.record(at, length, &fields, input, contents)? {
                return Ok(Step::Message(message));
            }
            input.seek(end)?;
        }
    }

    /// A record of the file itself.
    fn record(
        &mut self,
        at: u64,
        length: u64,
        fields: &Fields,
        input: &mut Input,
        contents: &mut Contents,
    ) -> io::Result<Option<Message>> {
        let indexed = self.index_place != 0 && at >= self.index_place;
        match fields.op() {
            Some(op::CHUNK_INFO) => self.index_seen += 1,
            Some(op::CONNECTION) if indexed => self.index_seen += 1,
            Some(op::CHUNK) => self.chunk(at, length, fields, input, contents)?,
            Some(op::CONNECTION | op::MESSAGE) if length <= LARGEST_RECORD => {
                let data = input.bytes(length)?;
                return Ok(self.inner(fields, &data, at, contents));
            }
            _ => {}
        }
        Ok(None)
    }

    /// Reads the records of a chunk into memory.
    fn chunk(
        &mut self,
        at: u64,
        length: u64,
        fields: &Fields,
        input: &mut Input,
        contents: &mut Contents,
    ) -> io::Result<()> {
        let (Some(compression), Some(stated)) = (fields.compression(), fields.u32("size")) else {
            contents.fault(at, "a chunk does not say how it is compressed, and was passed over");
            return Ok(());
        };
        if length.max(u64::from(stated)) > LARGEST_RECORD {
            contents.fault(at, format!("a chunk of {stated} bytes was passed over, expected at most {LARGEST_RECORD}"));
            return Ok(());
        }
        let Expanded { bytes, fault } = expand(&compression, input.bytes(length)?, u64::from(stated));
        if let Some(reason) = fault {
            contents.fault(at, format!("a chunk {reason}; its messages were passed over"));
            return Ok(());
        }
        self.chunk = Some(Chunk { bytes, at: 0, place: at, ending: None });
        Ok(())
    }

    /// What is there of a chunk that the file breaks off in.
    fn cut_chunk(&mut self, at: u64, length: u64, fields: &Fields, input: &mut Input) -> io::Result<()> {
        let reason = format!("a chunk promises {length} bytes, {} are left", input.left());
        let ending = self.broken(at, input.length(), Some(length - input.left()), reason);
        let bytes = match (fields.compression(), fields.u32("size")) {
            (Some(compression), Some(stated)) if input.left() <= LARGEST_RECORD => {
                let left = input.bytes(input.left())?;
                expand(&compression, left, u64::from(stated)).bytes
            }
            _ => Vec::new(),
        };
        self.chunk = Some(Chunk { bytes, at: 0, place: at, ending: Some(ending) });
        Ok(())
    }

    /// The next message of the chunk that is open; `None` where there is none any more.
    fn of_chunk(&mut self, contents: &mut Contents) -> Option<Step> {
        loop {
            let mut chunk = self.chunk.take()?;
            let rest = &chunk.bytes[chunk.at..];
            let record =
                split(rest).and_then(|(header, data, behind)| Some((Fields::read(header)?, data, behind.len())));
            let Some((fields, data, behind)) = record else {
                if chunk.ending.is_none() && !rest.is_empty() {
                    contents.fault(chunk.place, format!("the last {} bytes of a chunk are no record", rest.len()));
                }
                return chunk.ending.map(Step::End);
            };
            let message = self.inner(&fields, data, chunk.place, contents);
            chunk.at = chunk.bytes.len() - behind;
            self.chunk = Some(chunk);
            if let Some(message) = message {
                return Some(Step::Message(message));
            }
        }
    }

    /// A connection or a message.
    fn inner(&mut self, fields: &Fields, data: &[u8], at: u64, contents: &mut Contents) -> Option<Message> {
        match fields.op() {
            Some(op::CONNECTION) => match Connection::read(fields, data) {
                Some(connection) => self.connection(connection, at, contents),
                None => contents.fault(at, "a connection lacks its number, topic or type, and was passed over"),
            },
            Some(op::MESSAGE) => return self.message(fields, data, at, contents),
            _ => {}
        }
        None
    }

    fn connection(&mut self, connection: Connection, at: u64, contents: &mut Contents) {
        let Connection { id, topic, type_name } = connection;
        if self.connections.contains_key(&id) {
            return;
        }
        let message = MessageType::of(&type_name);
        // Several publishers of one topic are one stream.
        let known = contents.streams.iter().position(|stream| stream.name == topic && stream.type_name == type_name);
        let kind = message.map_or(Kind::Other, |message| message.kind(&topic));
        match known.or_else(|| contents.stream(topic, kind, type_name)) {
            Some(stream) => drop(self.connections.insert(id, Known { stream, message })),
            None => contents.fault(at, "there are too many connections; one was passed over"),
        }
    }

    fn message(&self, fields: &Fields, data: &[u8], at: u64, contents: &mut Contents) -> Option<Message> {
        let (Some(id), Some(logged_ns)) = (fields.u32("conn"), fields.time("time")) else {
            contents.fault(at, "a message lacks its connection or its time, and was passed over");
            return None;
        };
        let Some(known) = self.connections.get(&id) else {
            contents.fault(at, format!("a message is of connection {id}, which is not defined before it"));
            return None;
        };
        let Decoded { stamp_ns, payload } = match known.message {
            Some(message) => decode(data, Layout::Ros1, message),
            None => Decoded { stamp_ns: None, payload: Payload::Bytes(data.to_vec()) },
        };
        if let Payload::Image(image) = &payload {
            contents.seen(known.stream, image.encoding());
        }
        Some(Message { stream: known.stream, logged_ns, stamp_ns, payload })
    }

    /// How a bag ends between two records.
    fn end(&self, at: u64, length: u64) -> Ending {
        if self.index_place == 0 {
            let reason = "the bag was not closed: how many messages followed is not known";
            return self.broken(at, length, None, reason.to_owned());
        }
        if length < self.index_place {
            let reason = "the bag ends before its index".to_owned();
            return self.broken(at, length, None, reason);
        }
        if self.index_seen < self.index_records {
            let (seen, all) = (self.index_seen, self.index_records);
            let reason = format!("all messages are there, but {seen} of {all} records of the index behind them");
            return self.broken(at, length, None, reason);
        }
        Ending::Complete
    }

    /// What the header says of the index tells a cut from damage, and how much is missing at least.
    fn broken(&self, at_byte: u64, length: u64, missing: Option<u64>, reason: String) -> Ending {
        if self.index_place != 0 && length > self.index_place && at_byte < self.index_place {
            return Ending::Damaged { at_byte, unread_bytes: length - at_byte, reason };
        }
        // Of a bag that was closed, all up to the index is known to be missing.
        let before_index = self.index_place.checked_sub(length).filter(|missing| *missing > 0);
        Ending::CutOff { at_byte, missing_bytes: before_index.max(missing), reason }
    }
}

/// Header of the next record and the bytes of its data, or what is wrong in words.
fn head(input: &mut Input) -> io::Result<Result<(Vec<u8>, u64), String>> {
    let start = input.left();
    let short = |left: u64| Ok(Err(format!("a record of {left} bytes is shorter than its head")));
    if start < 4 {
        return short(start);
    }
    let length = u64::from(u32::from_le_bytes(input.array()?));
    if length > LONGEST_HEADER {
        return Ok(Err(format!("a record's header has {length} bytes, expected at most {LONGEST_HEADER}")));
    }
    if length + 4 > input.left() {
        return short(start);
    }
    let header = input.bytes(length)?;
    let data = u64::from(u32::from_le_bytes(input.array()?));
    Ok(Ok((header, data)))
}
