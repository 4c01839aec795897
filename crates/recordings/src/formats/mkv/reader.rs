//! Frames in the order of the file.

use std::collections::VecDeque;
use std::io;

use super::blocks::{Block, imu};
use super::elements::{Next, children, id, next, text, unsigned};
use super::tags::{attachment, tags};
use super::tracks::{Coding, Track};
use crate::contents::{Contents, Ending};
use crate::input::Input;
use crate::limits::{LARGEST_ATTACHMENT, LARGEST_RECORD};
use crate::message::Message;
use crate::payload::Payload;
use crate::recording::Step;

/// Bytes of a track's entry or of tags that are read.
const LONGEST_DESCRIPTION: u64 = 1 << 20;

/// Tag that tells the device's time of the recording's zero.
const START_OFFSET: &str = "K4A_START_OFFSET_NS";

/// The state of a reader.
pub(crate) struct Matroska {
    /// Tracks and their streams.
    tracks: Vec<(Track, usize)>,
    nanoseconds_per_tick: i64,
    cluster_ticks: i64,
    /// The device's time of the recording's zero, where a tag tells it.
    start_ns: Option<i64>,
    /// What the device's times of the inertial unit are ahead of the recording's, where no tag tells it.
    imu_ahead_ns: Option<i64>,
    /// Where the file ends by its own word.
    stated_end: Option<u64>,
    closed: bool,
    waiting: VecDeque<Message>,
}

impl Matroska {
    /// Reads what stands before the first frame.
    pub fn open(input: &mut Input, contents: &mut Contents) -> io::Result<Self> {
        let mut matroska = Self {
            tracks: Vec::new(),
            nanoseconds_per_tick: 1_000_000,
            cluster_ticks: 0,
            start_ns: None,
            imu_ahead_ns: None,
            stated_end: None,
            closed: false,
            waiting: VecDeque::new(),
        };
        while let Next::Element(element) = peek(input)? {
            if element.id == id::CLUSTER || !element.is_entered() && element.size.is_none_or(|size| size > input.left())
            {
                break;
            }
            matroska.step(input, contents)?;
        }
        Ok(matroska)
    }

    /// The next message, or the end.
    pub fn next(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Step> {
        loop {
            if let Some(message) = self.waiting.pop_front() {
                return Ok(Step::Message(message));
            }
            if let Some(ending) = self.step(input, contents)? {
                return Ok(Step::End(ending));
            }
        }
    }

    /// One element; `Some` where the recording ends.
    fn step(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Option<Ending>> {
        let at = input.position();
        if input.left() == 0 {
            return Ok(Some(self.end(at)));
        }
        let element = match next(input)? {
            Next::Element(element) => element,
            Next::Nonsense => return Ok(Some(self.broken(at, input, None, "no element begins here".to_owned()))),
            Next::Short => {
                return Ok(Some(self.broken(at, input, None, "the head of an element is cut off".to_owned())));
            }
        };
        if element.is_entered() {
            if element.id == id::SEGMENT {
                // A recorder that was killed leaves the size open, or zero.
                self.stated_end =
                    element.size.filter(|size| *size > 0).map(|size| input.position().saturating_add(size));
                self.closed = self.stated_end.is_some();
            }
            return Ok(None);
        }
        let Some(size) = element.size else {
            let reason = format!("element {:#x} has no size", element.id);
            return Ok(Some(self.broken(at, input, None, reason)));
        };
        if size > input.left() {
            let reason = format!("element {:#x} promises {size} bytes, {} are left", element.id, input.left());
            return Ok(Some(self.broken(at, input, Some(size - input.left()), reason)));
        }
        let end = input.position() + size;
        self.element(element.id, at, size, input, contents)?;
        input.seek(end)?;
        Ok(None)
    }

    fn element(&mut self, id: u32, at: u64, size: u64, input: &mut Input, contents: &mut Contents) -> io::Result<()> {
        let most = match id {
            id::SIMPLE_BLOCK | id::BLOCK_GROUP => LARGEST_RECORD,
            id::ATTACHED_FILE => LARGEST_ATTACHMENT + LONGEST_DESCRIPTION,
            id::TRACK_ENTRY | id::TAG => LONGEST_DESCRIPTION,
            id::TIMESTAMP | id::TIMESTAMP_SCALE => 8,
            id::WRITING_APP | id::TITLE => 1 << 12,
            id::DURATION | id::CUES => {
                self.closed = true;
                return Ok(());
            }
            _ => return Ok(()),
        };
        if size > most {
            contents
                .fault(at, format!("element {id:#x} has {size} bytes, expected at most {most}, and was passed over"));
            return Ok(());
        }
        let data = input.bytes(size)?;
        match id {
            id::SIMPLE_BLOCK => self.block(at, &data, contents),
            id::BLOCK_GROUP => {
                for (_, block) in children(&data).filter(|(id, _)| *id == id::BLOCK) {
                    self.block(at, block, contents);
                }
            }
            id::TRACK_ENTRY => self.track(at, &data, contents),
            id::TAG => self.tag(&data, contents),
            id::TIMESTAMP => self.cluster_ticks = i64::try_from(unsigned(&data)).unwrap_or(i64::MAX),
            id::TIMESTAMP_SCALE => {
                self.nanoseconds_per_tick = i64::try_from(unsigned(&data)).unwrap_or(i64::MAX).max(1);
            }
            id::WRITING_APP => contents.property("recorder", text(&data)),
            id::TITLE => contents.property("title", text(&data)),
            _ => {
                let (name, data) = attachment(&data);
                let kept = contents.keeps(data.len() as u64);
                contents.attachment(name, data.len() as u64, kept.then_some(data));
            }
        }
        Ok(())
    }

    fn track(&mut self, at: u64, entry: &[u8], contents: &mut Contents) {
        let track = Track::read(entry);
        if self.tracks.iter().any(|(known, _)| known.number == track.number) {
            contents.fault(at, format!("track number {} is there twice; the first holds", track.number));
            return;
        }
        match contents.stream(track.name.clone(), track.kind(), track.codec.clone()) {
            Some(stream) => self.tracks.push((track, stream)),
            None => contents.fault(at, "there are too many tracks; one was passed over"),
        }
    }

    fn tag(&mut self, data: &[u8], contents: &mut Contents) {
        for tag in tags(data) {
            if tag.name == START_OFFSET {
                self.start_ns = tag.value.trim().parse().ok();
            }
            let track = tag.track_uid.and_then(|uid| self.tracks.iter().find(|(track, _)| track.uid == uid));
            let name = track.map_or(tag.name.clone(), |(track, _)| format!("{}: {}", track.name, tag.name));
            contents.property(name, tag.value);
        }
    }

    /// The frames of a block become messages.
    fn block(&mut self, at: u64, data: &[u8], contents: &mut Contents) {
        let block = match Block::read(data) {
            Ok(block) => block,
            Err(reason) => return contents.fault(at, reason),
        };
        let Some((track, stream)) = self.tracks.iter().find(|(track, _)| track.number == block.track) else {
            return contents.fault(at, format!("a block is of track {}, which is not listed", block.track));
        };
        let (track, stream) = (track.clone(), *stream);
        let ticks = self.cluster_ticks.checked_add(i64::from(block.ticks));
        let relative_ns = ticks.and_then(|ticks| ticks.checked_mul(self.nanoseconds_per_tick));
        let logged_ns = relative_ns.and_then(|time| time.checked_add(self.start_ns.unwrap_or(0)));
        let (Some(relative_ns), Some(logged_ns)) = (relative_ns, logged_ns) else {
            return contents.fault(at, "a block has a time that no clock shows");
        };
        for frame in block.frames {
            let (stamp_ns, payload) = if track.coding == Coding::Imu {
                self.sample(relative_ns, frame)
            } else {
                (None, track.payload(frame))
            };
            self.waiting.push_back(Message { stream, logged_ns, stamp_ns, payload });
        }
    }

    /// A sample of the inertial unit, on the clock of the other tracks.
    fn sample(&mut self, relative_ns: i64, frame: &[u8]) -> (Option<i64>, Payload) {
        let (times, mut sample) = match imu(frame) {
            Ok(found) => found,
            Err(reason) => return (None, Payload::Unreadable(reason)),
        };
        let [Ok(force), Ok(rate)] = times.map(i64::try_from) else {
            return (None, Payload::Unreadable(format!("has times of {times:?} ns, which no clock shows")));
        };
        let ahead = match self.start_ns {
            Some(_) => 0,
            // A block has the time of its first sample.
            None => *self.imu_ahead_ns.get_or_insert(force.saturating_sub(relative_ns)),
        };
        sample.angular_velocity_ns = Some(rate.saturating_sub(ahead));
        (Some(force.saturating_sub(ahead)), Payload::Imu(Box::new(sample)))
    }

    /// How a recording ends between two elements.
    fn end(&self, at_byte: u64) -> Ending {
        match self.stated_end {
            Some(end) if end > at_byte => Ending::CutOff {
                at_byte,
                missing_bytes: Some(end - at_byte),
                reason: "the recording states more bytes than there are".to_owned(),
            },
            _ if self.closed => Ending::Complete,
            _ => Ending::CutOff {
                at_byte,
                missing_bytes: None,
                reason: "the recording was not closed: how many frames followed is not known".to_owned(),
            },
        }
    }

    fn broken(&self, at_byte: u64, input: &Input, missing: Option<u64>, reason: String) -> Ending {
        let short = self.stated_end.and_then(|end| end.checked_sub(input.length())).filter(|missing| *missing > 0);
        if short.is_none() && (missing.is_none() || self.stated_end.is_some()) && at_byte + 12 < input.length() {
            return Ending::Damaged { at_byte, unread_bytes: input.length() - at_byte, reason };
        }
        Ending::CutOff { at_byte, missing_bytes: short.max(missing), reason }
    }
}

/// The head of the next element, without stepping over it.
fn peek(input: &mut Input) -> io::Result<Next> {
    let start = input.position();
    let found = next(input)?;
    // What comes behind the head is wanted, from its end on.
    let behind = input.position();
    input.seek(start)?;
    Ok(match found {
        Next::Element(mut element) => {
            element.size = element.size.map(|size| size.saturating_add(behind - start));
            Next::Element(element)
        }
        other => other,
    })
}
