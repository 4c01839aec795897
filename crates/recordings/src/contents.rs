//! What a recording holds, as far as it is known.

use crate::limits::{LARGEST_ATTACHMENT, LARGEST_ATTACHMENTS, LONGEST_TEXT, MOST_ATTACHMENTS, MOST_FAULTS};
use crate::limits::{MOST_PROPERTIES, MOST_STREAMS};
use crate::payload::Encoding;

/// What the messages of a stream are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
#[non_exhaustive]
pub enum Kind {
    /// Depths along the viewing axis.
    Depth,
    /// Ranges along the rays.
    Range,
    /// Light alone: infrared, amplitude, passive grey images.
    Intensity,
    /// Raw samples of the sensor.
    Raw,
    /// Colour images.
    Colour,
    /// Images of which is not yet known what they show: no message was read.
    Image,
    /// A camera's matrix and distortion.
    CameraInfo,
    /// Samples of an inertial unit.
    Imu,
    /// Temperatures.
    Temperature,
    /// Where coordinate systems lie in others.
    Transforms,
    /// Anything else, handed out as bytes.
    Other,
}

impl Kind {
    /// In a word or two.
    pub fn name(self) -> &'static str {
        match self {
            Self::Depth => "depth",
            Self::Range => "range",
            Self::Intensity => "intensity",
            Self::Raw => "raw",
            Self::Colour => "colour",
            Self::Image => "image",
            Self::CameraInfo => "camera info",
            Self::Imu => "imu",
            Self::Temperature => "temperature",
            Self::Transforms => "transforms",
            Self::Other => "other",
        }
    }

    /// What images of this name and encoding show. ROS writes depths as 16-bit millimetres or 32-bit metres (REP 118),
    /// and infrared images as 16-bit values too: the name tells them apart.
    pub(crate) fn of_image(name: &str, encoding: &Encoding) -> Self {
        let name = name.to_ascii_lowercase();
        let parts = || name.split(|letter: char| !letter.is_ascii_alphanumeric());
        let says = |words: &[&str]| parts().any(|part| words.contains(&part.trim_end_matches(char::is_numeric)));
        let light = says(&["ir", "infra", "infrared", "amplitude", "intensity", "ab", "grey", "gray", "nir", "mono"]);
        match encoding {
            Encoding::Mono8 | Encoding::Mono16 | Encoding::Unsigned8 => Self::Intensity,
            Encoding::Unsigned16 | Encoding::Float32
                if says(&["conf", "confidence", "flags", "phase", "sigma"]) && !says(&["depth"]) =>
            {
                Self::Raw
            }
            Encoding::Unsigned16 | Encoding::Float32 if light && !says(&["depth"]) => Self::Intensity,
            Encoding::Unsigned16 | Encoding::Float32 if says(&["range"]) && !says(&["depth"]) => Self::Range,
            Encoding::Unsigned16 | Encoding::Float32 => Self::Depth,
            Encoding::Other(_) => Self::Other,
            _ => Self::Colour,
        }
    }
}

/// One topic, track or plane of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Stream {
    /// Name: a topic such as `/camera/depth/image_raw`, a track such as `DEPTH`.
    pub name: String,
    /// What its messages are.
    pub kind: Kind,
    /// Type of its messages in the words of the file, such as `sensor_msgs/msg/Image`.
    pub type_name: String,
    /// Number of messages where the file states it.
    pub count: Option<u64>,
}

/// A file inside of a recording.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attachment {
    /// Name, such as `calibration.json`.
    pub name: String,
    /// Its bytes; `None` where it is too large to be kept.
    pub data: Option<Vec<u8>>,
    /// Bytes that it has in the file.
    pub size: u64,
}

/// Something in a recording that could not be read and was passed over.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Fault {
    /// Place in the file.
    pub at_byte: u64,
    /// What is wrong.
    pub reason: String,
}

/// How a recording ended.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Ending {
    /// With everything that belongs to it.
    Complete,
    /// In the middle: the recorder or a copy broke off. What was handed out is as it was recorded.
    CutOff {
        /// The first byte that belongs to nothing that is whole.
        at_byte: u64,
        /// Bytes that are missing at least; `None` where nothing tells.
        missing_bytes: Option<u64>,
        /// What is missing, in words.
        reason: String,
    },
    /// At a place that makes no sense, although there is more behind it.
    Damaged {
        /// Where.
        at_byte: u64,
        /// Bytes from there to the end.
        unread_bytes: u64,
        /// What is wrong.
        reason: String,
    },
}

/// What is known of a recording, for its reader to add to.
#[derive(Debug, Default)]
pub(crate) struct Contents {
    pub streams: Vec<Stream>,
    pub attachments: Vec<Attachment>,
    pub properties: Vec<(String, String)>,
    pub faults: Vec<Fault>,
    pub more_faults: u64,
    kept_bytes: u64,
}

#[cfg_attr(not(all(feature = "mcap", feature = "bag", feature = "mkv", feature = "adi")), allow(dead_code))]
impl Contents {
    pub fn fault(&mut self, at_byte: u64, reason: impl Into<String>) {
        if self.faults.len() < MOST_FAULTS {
            self.faults.push(Fault { at_byte, reason: reason.into() });
        } else {
            self.more_faults += 1;
        }
    }

    /// A new stream's index; `None` where there are too many.
    pub fn stream(&mut self, name: String, kind: Kind, type_name: String) -> Option<usize> {
        if self.streams.len() >= MOST_STREAMS {
            return None;
        }
        self.streams.push(Stream { name, kind, type_name, count: None });
        Some(self.streams.len() - 1)
    }

    /// What the first image of a stream tells of all of them.
    pub fn seen(&mut self, stream: usize, encoding: &Encoding) {
        if let Some(stream) = self.streams.get_mut(stream)
            && stream.kind == Kind::Image
        {
            stream.kind = Kind::of_image(&stream.name, encoding);
        }
    }

    pub fn property(&mut self, name: impl Into<String>, value: impl Into<String>) {
        let (name, value) = (name.into(), value.into());
        if self.properties.len() < MOST_PROPERTIES && name.len() <= LONGEST_TEXT && value.len() <= LONGEST_TEXT {
            self.properties.push((name, value));
        }
    }

    /// Whether an attachment of this size would be kept.
    pub fn keeps(&self, size: u64) -> bool {
        size <= LARGEST_ATTACHMENT && self.kept_bytes + size <= LARGEST_ATTACHMENTS
    }

    pub fn attachment(&mut self, name: String, size: u64, data: Option<Vec<u8>>) {
        if self.attachments.len() < MOST_ATTACHMENTS {
            self.kept_bytes += data.as_ref().map_or(0, |data| data.len() as u64);
            self.attachments.push(Attachment { name, data, size });
        }
    }
}
