//! Messages in the order of the file.

use std::collections::BTreeMap;
use std::io;

use super::records::{Channel, ChunkHead, MessageHead, Schema, attachment, metadata};
use super::{MAGIC, opcode, summary};
use crate::contents::{Contents, Ending, Kind};
use crate::formats::chunk::{Expanded, expand};
use crate::input::Input;
use crate::limits::LARGEST_RECORD;
use crate::message::Message;
use crate::payload::Payload;
use crate::recording::Step;
use crate::ros::{Decoded, Layout, MessageType, decode};

/// Bytes of a record before its content: opcode and length.
const HEAD: u64 = 9;

/// The state of a reader.
#[derive(Default)]
pub(crate) struct Mcap {
    schemas: BTreeMap<u16, Schema>,
    channels: BTreeMap<u16, Known>,
    counts: BTreeMap<u16, u64>,
    chunk: Option<Chunk>,
    /// The file ends as one that was closed.
    closed: bool,
    data_ended: bool,
}

/// A channel that messages have come for, or may.
struct Known {
    stream: usize,
    decoder: Option<(Layout, MessageType)>,
}

/// The records of a chunk.
struct Chunk {
    bytes: Vec<u8>,
    at: usize,
    place: u64,
    /// Where it breaks off: how the recording ends behind it.
    ending: Option<Ending>,
}

impl Mcap {
    /// Reads what the index at the end tells, and goes to the first record.
    pub fn open(input: &mut Input, contents: &mut Contents) -> io::Result<Self> {
        let mut mcap = Self { closed: summary::is_closed(input)?, ..Self::default() };
        if mcap.closed {
            let mut records = summary::records(input)?;
            // Schemas before the channels that name them.
            records.sort_by_key(|(code, _)| *code);
            for (code, record) in records {
                match code {
                    opcode::STATISTICS => mcap.counts = summary::counts(&record).into_iter().collect(),
                    _ => mcap.define(code, &record, 0, contents),
                }
            }
            // A channel without an entry has no message.
            if !mcap.counts.is_empty() {
                for (id, known) in &mcap.channels {
                    contents.streams[known.stream].count = Some(mcap.counts.get(id).copied().unwrap_or(0));
                }
            }
        }
        input.seek(MAGIC.len() as u64)?;
        Ok(mcap)
    }

    /// The next message, or the end.
    pub fn next(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Step> {
        loop {
            if let Some(step) = self.of_chunk(contents) {
                return Ok(step);
            }
            let at = input.position();
            if input.left() < HEAD {
                return Ok(Step::End(self.end(at, None, input)));
            }
            let code = input.array::<1>()?[0];
            let length = u64::from_le_bytes(input.array()?);
            if code == 0 {
                let reason = "no record begins here".to_owned();
                return Ok(Step::End(self.broken(at, None, input.length(), reason)));
            }
            if length > input.left() {
                if code == opcode::CHUNK && !self.closed {
                    self.cut_chunk(at, length, input)?;
                    continue;
                }
                let missing = length - input.left();
                let reason = format!("{} promises {length} bytes, {} are left", name(code), input.left());
                return Ok(Step::End(self.broken(at, Some(missing), input.length(), reason)));
            }
            let end = input.position() + length;
            if let Some(step) = self.record(code, at, length, input, contents)? {
                return Ok(step);
            }
            input.seek(end)?;
        }
    }

    /// A record of the file itself; `Some` where it is a message or the end.
    fn record(
        &mut self,
        code: u8,
        at: u64,
        length: u64,
        input: &mut Input,
        contents: &mut Contents,
    ) -> io::Result<Option<Step>> {
        match code {
            opcode::CHUNK => self.chunk(at, length, input, contents)?,
            opcode::ATTACHMENT => keep_attachment(at, length, input, contents)?,
            opcode::FOOTER => {
                input.skip(length)?;
                return Ok(Some(Step::End(self.end(at, Some(()), input))));
            }
            opcode::DATA_END => self.data_ended = true,
            // Behind the end of the data stands the index, which was read.
            opcode::HEADER | opcode::SCHEMA | opcode::CHANNEL | opcode::MESSAGE | opcode::METADATA
                if !self.data_ended =>
            {
                if length > LARGEST_RECORD {
                    contents.fault(at, format!("{} has {length} bytes, expected at most {LARGEST_RECORD}", name(code)));
                    return Ok(None);
                }
                let record = input.bytes(length)?;
                if code == opcode::MESSAGE {
                    return Ok(self.message(&record, at, contents).map(Step::Message));
                }
                self.define(code, &record, at, contents);
            }
            _ => {}
        }
        Ok(None)
    }

    /// Reads the records of a chunk into memory.
    fn chunk(&mut self, at: u64, length: u64, input: &mut Input, contents: &mut Contents) -> io::Result<()> {
        let head = ChunkHead::read(&input.peek(length.min(ChunkHead::LONGEST))?);
        let Some(head) = head.filter(|head| head.head as u64 + head.length <= length) else {
            contents.fault(at, "a chunk is shorter than its head says, and was passed over");
            return Ok(());
        };
        if head.length.max(head.stated) > LARGEST_RECORD {
            let reason = format!("a chunk of {} bytes was passed over, expected at most {LARGEST_RECORD}", head.stated);
            contents.fault(at, reason);
            return Ok(());
        }
        input.skip(head.head as u64)?;
        let compressed = input.bytes(head.length)?;
        let Expanded { bytes, fault } = expand(&head.compression, compressed, head.stated);
        let fault = fault.or_else(|| {
            let wrong = head.checksum != 0 && crc32fast::hash(&bytes) != head.checksum;
            wrong.then(|| "does not have the checksum that it states".to_owned())
        });
        if let Some(reason) = fault {
            contents.fault(at, format!("a chunk {reason}; its messages were passed over"));
            return Ok(());
        }
        self.chunk = Some(Chunk { bytes, at: 0, place: at, ending: None });
        Ok(())
    }

    /// What is there of a chunk that the file breaks off in.
    fn cut_chunk(&mut self, at: u64, length: u64, input: &mut Input) -> io::Result<()> {
        let missing = length - input.left();
        let reason = format!("a chunk promises {length} bytes, {} are left", input.left());
        let ending = Ending::CutOff { at_byte: at, missing_bytes: Some(missing), reason };
        let head = ChunkHead::read(&input.peek(ChunkHead::LONGEST)?);
        let bytes = match head {
            Some(head) if input.left() <= LARGEST_RECORD && head.stated <= LARGEST_RECORD => {
                input.skip(head.head as u64)?;
                let left = input.bytes(input.left())?;
                expand(&head.compression, left, head.stated).bytes
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
            let head = rest.first_chunk::<9>().map(|head| {
                (head[0], u64::from_le_bytes([head[1], head[2], head[3], head[4], head[5], head[6], head[7], head[8]]))
            });
            let record = head.and_then(|(code, length)| {
                let record = rest.get(HEAD as usize..)?.get(..usize::try_from(length).ok()?)?;
                Some((code, record))
            });
            let Some((code, record)) = record else {
                if chunk.ending.is_none() && !rest.is_empty() {
                    contents.fault(chunk.place, format!("the last {} bytes of a chunk are no record", rest.len()));
                }
                return chunk.ending.map(Step::End);
            };
            chunk.at += HEAD as usize + record.len();
            let message = if code == opcode::MESSAGE {
                self.message(record, chunk.place, contents)
            } else {
                self.define(code, record, chunk.place, contents);
                None
            };
            self.chunk = Some(chunk);
            if let Some(message) = message {
                return Some(Step::Message(message));
            }
        }
    }

    /// Schemas, channels and what is told of the recording as a whole.
    fn define(&mut self, code: u8, record: &[u8], at: u64, contents: &mut Contents) {
        let understood = match code {
            opcode::SCHEMA => Schema::read(record).map(|schema| drop(self.schemas.insert(schema.id, schema))),
            opcode::CHANNEL => Channel::read(record).map(|channel| self.channel(channel, at, contents)),
            opcode::METADATA => metadata(record).map(|(name, values)| {
                for (key, value) in values {
                    contents.property(format!("{name}: {key}"), value);
                }
            }),
            opcode::HEADER => {
                let mut fields = super::records::Fields(record);
                fields.text().zip(fields.text()).map(|(profile, library)| {
                    contents.property("profile", profile);
                    contents.property("library", library);
                })
            }
            _ => Some(()),
        };
        if understood.is_none() {
            contents.fault(at, format!("{} is shorter than its fields, and was passed over", name(code)));
        }
    }

    fn channel(&mut self, channel: Channel, at: u64, contents: &mut Contents) {
        if self.channels.contains_key(&channel.id) {
            return;
        }
        let type_name = self.schemas.get(&channel.schema).map_or_else(String::new, |schema| schema.name.clone());
        let layout = match channel.encoding.as_str() {
            "cdr" => Some(Layout::Cdr),
            "ros1" => Some(Layout::Ros1),
            _ => None,
        };
        let decoder = layout.zip(MessageType::of(&type_name));
        let kind = decoder.map_or(Kind::Other, |(_, message)| message.kind(&channel.topic));
        match contents.stream(channel.topic, kind, type_name) {
            Some(stream) => drop(self.channels.insert(channel.id, Known { stream, decoder })),
            None => contents.fault(at, "there are too many channels; one was passed over"),
        }
    }

    fn message(&self, record: &[u8], at: u64, contents: &mut Contents) -> Option<Message> {
        let Some((head, bytes)) = MessageHead::read(record) else {
            let reason =
                format!("a message of {} bytes is shorter than its head of {}", record.len(), MessageHead::LENGTH);
            contents.fault(at, reason);
            return None;
        };
        let Some(known) = self.channels.get(&head.channel) else {
            contents.fault(at, format!("a message is of channel {}, which is not defined before it", head.channel));
            return None;
        };
        let Ok(logged_ns) = i64::try_from(head.log_time) else {
            contents.fault(at, format!("a message was recorded at {} ns, which no clock shows", head.log_time));
            return None;
        };
        let Decoded { stamp_ns, payload } = match known.decoder {
            Some((layout, message)) => decode(bytes, layout, message),
            None => Decoded { stamp_ns: None, payload: Payload::Bytes(bytes.to_vec()) },
        };
        if let Payload::Image(image) = &payload {
            contents.seen(known.stream, image.encoding());
        }
        Some(Message { stream: known.stream, logged_ns, stamp_ns, payload })
    }

    /// How a recording ends at a place where no further record is, with a last record or without.
    fn end(&self, at: u64, footer: Option<()>, input: &Input) -> Ending {
        if footer.is_some() && self.closed {
            return Ending::Complete;
        }
        let reason = if self.data_ended || footer.is_some() {
            "all messages are there, but the index behind them is not whole"
        } else {
            "the recording was not closed: how many messages followed is not known"
        };
        self.broken(at, None, input.length(), reason.to_owned())
    }

    /// What breaks in a file that ends as a whole one does is damage, not a cut.
    fn broken(&self, at_byte: u64, missing_bytes: Option<u64>, length: u64, reason: String) -> Ending {
        if self.closed {
            Ending::Damaged { at_byte, unread_bytes: length - at_byte, reason }
        } else {
            Ending::CutOff { at_byte, missing_bytes, reason }
        }
    }
}

/// Keeps a file inside of the recording.
fn keep_attachment(at: u64, length: u64, input: &mut Input, contents: &mut Contents) -> io::Result<()> {
    // Two times, two names of at most 64 KiB, and a length.
    let head = input.peek(length.min(1 << 18))?;
    match attachment(&head) {
        Some((name, head, size)) if head as u64 + size <= length => {
            input.skip(head as u64)?;
            let data = if contents.keeps(size) { Some(input.bytes(size)?) } else { None };
            contents.attachment(name, size, data);
        }
        _ => contents.fault(at, "an attachment is shorter than its head says, and was passed over"),
    }
    Ok(())
}

/// A record in words.
fn name(code: u8) -> String {
    match code {
        opcode::HEADER => "the header".to_owned(),
        opcode::SCHEMA => "a schema".to_owned(),
        opcode::CHANNEL => "a channel".to_owned(),
        opcode::MESSAGE => "a message".to_owned(),
        opcode::CHUNK => "a chunk".to_owned(),
        opcode::ATTACHMENT => "an attachment".to_owned(),
        opcode::METADATA => "a metadata record".to_owned(),
        other => format!("a record of kind {other:#04x}"),
    }
}
