//! Planes and temperatures, frame by frame.

use std::collections::VecDeque;
use std::io;

use super::frame::{HEAD, Head, Plane};
use super::header::{Header, LENGTH, MARK, is_header};
use crate::contents::{Contents, Ending, Kind};
use crate::input::Input;
use crate::limits::LARGEST_RECORD;
use crate::message::Message;
use crate::payload::{Encoding, Image, ImageParts, Payload};
use crate::recording::Step;

/// Streams in the order in which they are listed.
const STREAMS: [(&str, Kind, &str); 7] = [
    ("sensor temperature", Kind::Temperature, "degree Celsius"),
    ("laser temperature", Kind::Temperature, "degree Celsius"),
    ("depth", Kind::Range, "16 bits, millimetre along the ray"),
    ("ab", Kind::Intensity, "16 bits"),
    ("conf", Kind::Raw, "32 bits, floating point"),
    ("xyz", Kind::Other, "three 16-bit millimetres a pixel"),
    ("camera", Kind::CameraInfo, "factory calibration"),
];

/// Index of the first plane's stream, and of the camera's.
const FIRST_PLANE: usize = 2;
const CAMERA: usize = 6;

/// The state of a reader.
pub(crate) struct Adi {
    header: Option<Header>,
    /// Bytes that are missing of the head of an `.adcam`.
    head_missing: u64,
    frames: u64,
    last_ns: Option<i64>,
    waiting: VecDeque<Message>,
}

impl Adi {
    /// Reads what stands before the first frame.
    pub fn open(input: &mut Input, contents: &mut Contents) -> io::Result<Self> {
        let mut adi = Self { header: None, head_missing: 0, frames: 0, last_ns: None, waiting: VecDeque::new() };
        let beginning = input.peek(256)?;
        for (name, kind, type_name) in STREAMS {
            contents.stream(name.to_owned(), kind, type_name.to_owned());
        }
        if is_header(&beginning) {
            adi.head_missing = (8 + LENGTH as u64).saturating_sub(input.left());
            if adi.head_missing > 0 {
                return Ok(adi);
            }
            input.skip(8)?;
            let bytes = input.bytes(LENGTH as u64)?;
            adi.header = Header::read(&bytes);
            match &adi.header {
                Some(header) => adi.announce(header.clone(), contents),
                None => contents.fault(8, "the head has values that are no camera's"),
            }
        } else if let Some(head) = Head::read(&beginning) {
            contents.property("mode", head.mode.to_string());
            contents.property("modulation frequencies", head.frequencies.to_string());
            let frames = input.length() / (HEAD + head.planes_length());
            for stream in &mut contents.streams {
                stream.count = Some(0);
            }
            let planes = head.planes().into_iter().map(stream_of);
            for stream in planes.chain([0, 1]) {
                contents.streams[stream].count = Some(frames);
            }
        }
        Ok(adi)
    }

    fn announce(&mut self, header: Header, contents: &mut Contents) {
        contents.property("frame rate", header.frame_rate.to_string());
        let frames = (header.frames > 0).then_some(u64::from(header.frames));
        let head = header.head_in_brightness && header.has_brightness;
        let there = [head, head, header.has_depth, header.has_brightness, false, false];
        for (stream, is_there) in contents.streams.iter_mut().zip(there) {
            stream.count = if is_there { frames } else { Some(0) };
        }
        contents.streams[CAMERA].count = Some(u64::from(header.lens.is_some()));
        if let Some(lens) = header.lens {
            let payload = Payload::CameraInfo(Box::new(lens));
            self.waiting.push_back(Message { stream: CAMERA, logged_ns: 0, stamp_ns: None, payload });
        }
    }

    /// The next message, or the end.
    pub fn next(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Step> {
        loop {
            if let Some(message) = self.waiting.pop_front() {
                return Ok(Step::Message(message));
            }
            if self.head_missing > 0 {
                let reason = "the head is cut off".to_owned();
                let missing_bytes = Some(self.head_missing);
                return Ok(Step::End(Ending::CutOff { at_byte: 0, missing_bytes, reason }));
            }
            let header = self.header.clone();
            let ending = match &header {
                Some(header) => self.record(header, input, contents)?,
                None => self.frame(input, contents)?,
            };
            if let Some(ending) = ending {
                return Ok(Step::End(ending));
            }
        }
    }

    /// One frame of a `.bin`; `Some` where the file ends.
    fn frame(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Option<Ending>> {
        let at = input.position();
        if input.left() == 0 {
            return Ok(Some(Ending::Complete));
        }
        let cut = |missing: u64, left: u64| Ending::CutOff {
            at_byte: at,
            missing_bytes: Some(missing),
            reason: format!("of the last frame {left} bytes are there"),
        };
        if input.left() < HEAD {
            return Ok(Some(cut(HEAD - input.left(), input.left())));
        }
        let Some(head) = Head::read(&input.peek(HEAD)?) else {
            let reason = "the head of a frame has values that are no camera's".to_owned();
            return Ok(Some(Ending::Damaged { at_byte: at, unread_bytes: input.left(), reason }));
        };
        let length = HEAD + head.planes_length();
        if length > input.left() {
            // A head that is damaged would promise anything: as much as it promises is missing at most.
            return Ok(Some(cut(length - input.left(), input.left())));
        }
        input.skip(HEAD)?;
        self.temperatures(&head, at, contents);
        for plane in head.planes() {
            let bytes = input.bytes(plane.bytes() * u64::from(head.width) * u64::from(head.height))?;
            self.plane(plane, [u32::from(head.width), u32::from(head.height)], head.time_ns, bytes);
        }
        self.frames += 1;
        Ok(None)
    }

    /// One frame of an `.adcam`; `Some` where the file ends.
    fn record(&mut self, header: &Header, input: &mut Input, contents: &mut Contents) -> io::Result<Option<Ending>> {
        let at = input.position();
        let (left, missing_frames) = (input.left(), u64::from(header.frames).saturating_sub(self.frames));
        if left == 0 && header.frames > 0 && missing_frames == 0 {
            return Ok(Some(Ending::Complete));
        }
        if left < 8 {
            let reason = if header.frames == 0 {
                "the recording was not closed: how many frames followed is not known".to_owned()
            } else {
                format!("{missing_frames} of {} frames are missing", header.frames)
            };
            return Ok(Some(Ending::CutOff { at_byte: at, missing_bytes: None, reason }));
        }
        let [mark, length] = [u32::from_le_bytes(input.array()?), u32::from_le_bytes(input.array()?)];
        if mark != MARK {
            let reason = "no frame begins here".to_owned();
            return Ok(Some(Ending::Damaged { at_byte: at, unread_bytes: left, reason }));
        }
        let length = u64::from(length);
        if length > input.left() {
            let reason = format!("a frame promises {length} bytes, {} are left", input.left());
            return Ok(Some(Ending::CutOff { at_byte: at, missing_bytes: Some(length - input.left()), reason }));
        }
        self.frames += 1;
        let end = input.position() + length;
        let pixels = u64::from(header.width) * u64::from(header.height);
        let planes = u64::from(header.has_depth) + u64::from(header.has_brightness);
        if length < 2 * pixels * planes || length > LARGEST_RECORD {
            contents.fault(at, format!("a frame of {length} bytes does not hold its planes, and was passed over"));
        } else {
            self.planes(header, at, input, contents)?;
        }
        input.seek(end)?;
        Ok(None)
    }

    /// Depth, then brightness, which begins with the head of the frame.
    fn planes(&mut self, header: &Header, at: u64, input: &mut Input, contents: &mut Contents) -> io::Result<()> {
        let (size, bytes) = ([header.width, header.height], 2 * u64::from(header.width) * u64::from(header.height));
        let depth = if header.has_depth { Some(input.bytes(bytes)?) } else { None };
        let mut brightness = if header.has_brightness { Some(input.bytes(bytes)?) } else { None };
        let head = brightness.as_deref().filter(|_| header.head_in_brightness).and_then(Head::read);
        // Without a head frames have no time but that of their number.
        let period_ns = 1_000_000_000 / i64::from(header.frame_rate.max(1));
        let time_ns = head.map_or((self.frames as i64 - 1).saturating_mul(period_ns), |head| head.time_ns);
        if let (Some(head), Some(brightness)) = (&head, &mut brightness) {
            self.temperatures(head, at, contents);
            // What stands there is no light.
            brightness[..HEAD as usize].fill(0);
        }
        for (plane, data) in [(Plane::Depth, depth), (Plane::Brightness, brightness)] {
            if let Some(data) = data {
                self.plane(plane, size, time_ns, data);
            }
        }
        Ok(())
    }

    fn temperatures(&mut self, head: &Head, at: u64, contents: &mut Contents) {
        if self.last_ns.is_some_and(|last| head.time_ns < last) {
            contents.fault(at, format!("frame {} is earlier than the one before it", head.number));
        }
        self.last_ns = Some(head.time_ns);
        for (stream, celsius) in [head.sensor_c, head.laser_c].into_iter().enumerate() {
            let payload = Payload::Temperature(f64::from(celsius));
            self.waiting.push_back(Message { stream, logged_ns: head.time_ns, stamp_ns: None, payload });
        }
    }

    fn plane(&mut self, plane: Plane, [width, height]: [u32; 2], logged_ns: i64, data: Vec<u8>) {
        let encoding = match plane {
            Plane::Depth => Encoding::Unsigned16,
            Plane::Brightness => Encoding::Mono16,
            Plane::Confidence => Encoding::Float32,
            Plane::Points => {
                return self.waiting.push_back(Message {
                    stream: stream_of(plane),
                    logged_ns,
                    stamp_ns: None,
                    payload: Payload::Bytes(data),
                });
            }
        };
        let (frame_id, step) = ("adi".to_owned(), width * plane.bytes() as u32);
        let image = Image::new(ImageParts { frame_id, width, height, step, encoding, big_endian: false, data });
        let payload = image.map_or_else(|error| Payload::Unreadable(error.to_string()), Payload::Image);
        self.waiting.push_back(Message { stream: stream_of(plane), logged_ns, stamp_ns: None, payload });
    }
}

fn stream_of(plane: Plane) -> usize {
    FIRST_PLANE + plane as usize
}
