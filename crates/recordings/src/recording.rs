//! A recording, whatever its format.

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use crate::contents::{Attachment, Contents, Ending, Fault, Stream};
use crate::error::Result;
use crate::input::Input;
use crate::message::Message;
use crate::{Error, formats};

/// Formats of recordings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[non_exhaustive]
pub enum Format {
    /// MCAP, as ROS 2 records.
    Mcap,
    /// A bag of ROS 1.
    Bag,
    /// Matroska, as the Azure Kinect records.
    Matroska,
    /// Frames of Analog Devices' cameras.
    Adi,
}

impl Format {
    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Mcap => "MCAP",
            Self::Bag => "ROS 1 bag",
            Self::Matroska => "Matroska",
            Self::Adi => "ADI frames",
        }
    }

    /// The format that a file begins as; `None` where it is none of these.
    pub fn of(beginning: &[u8]) -> Option<Self> {
        if beginning.starts_with(b"\x89MCAP") {
            Some(Self::Mcap)
        } else if beginning.starts_with(b"#ROSBAG V") {
            Some(Self::Bag)
        } else if beginning.starts_with(&[0x1A, 0x45, 0xDF, 0xA3]) {
            Some(Self::Matroska)
        } else {
            None
        }
    }
}

/// What a reader comes to.
pub(crate) enum Step {
    Message(Message),
    End(Ending),
}

/// An open recording: its streams, and its messages one after the other in the order of the file.
///
/// Memory is that of one chunk and one message. A recording that is cut off or damaged gives all messages before that
/// place; [`ending`](Self::ending) tells what is missing, [`faults`](Self::faults) what was passed over.
pub struct Recording {
    file: PathBuf,
    format: Format,
    input: Input,
    contents: Contents,
    reader: Reader,
    ending: Option<Ending>,
}

/// The reader of each format.
enum Reader {
    #[cfg(feature = "mcap")]
    Mcap(formats::mcap::Mcap),
    #[cfg(feature = "bag")]
    Bag(formats::bag::Bag),
    #[cfg(feature = "mkv")]
    Matroska(Box<formats::mkv::Matroska>),
    #[cfg(feature = "adi")]
    Adi(Box<formats::adi::Adi>),
    #[allow(dead_code)]
    None,
}

impl std::fmt::Debug for Recording {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { file, format, ending, .. } = self;
        let streams = &self.contents.streams;
        f.debug_struct("Recording")
            .field("file", file)
            .field("format", format)
            .field("streams", streams)
            .field("ending", ending)
            .finish_non_exhaustive()
    }
}

impl Recording {
    /// Opens a file by what it begins with, whatever its name.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] where it is no recording that is known; [`Error::LeftOut`] where the feature of its
    /// format is off.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let metadata = std::fs::metadata(path).map_err(Error::io(path, "open"))?;
        if !metadata.is_file() {
            return Err(Error::format(path, "is no regular file"));
        }
        let file = File::open(path).map_err(Error::io(path, "open"))?;
        Self::from_reader(path, file)
    }

    /// Opens what `source` holds; `name` stands for it in messages.
    ///
    /// # Errors
    /// As [`open`](Self::open).
    pub fn from_reader(name: impl Into<PathBuf>, source: impl Read + Seek + Send + 'static) -> Result<Self> {
        let file = name.into();
        let failed = |error| Error::io(&file, "read")(error);
        let mut input = Input::new(Box::new(source)).map_err(failed)?;
        let beginning = input.peek(LONGEST_BEGINNING).map_err(failed)?;
        let format = format_of(&beginning).ok_or_else(|| {
            Error::format(&file, "is no recording that is known: expected MCAP, a ROS 1 bag, Matroska or frames of ADI")
        })?;
        let mut contents = Contents::default();
        let reader = Reader::open(&file, format, &beginning, &mut input, &mut contents)?;
        Ok(Self { file, format, input, contents, reader, ending: None })
    }

    /// The format.
    pub fn format(&self) -> Format {
        self.format
    }

    /// The file's name as it was given.
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Bytes of the file.
    pub fn length(&self) -> u64 {
        self.input.length()
    }

    /// Bytes that were read or passed over so far.
    pub fn position(&self) -> u64 {
        self.input.position()
    }

    /// The streams that are known. Formats with an index or a header know all of them from the start; others learn of
    /// them as messages are read.
    pub fn streams(&self) -> &[Stream] {
        &self.contents.streams
    }

    /// Files inside of the recording, such as `calibration.json`, as far as it was read.
    pub fn attachments(&self) -> &[Attachment] {
        &self.contents.attachments
    }

    /// An attachment that was kept, by name.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.contents.attachments.iter().find(|found| found.name == name)?.data.as_deref()
    }

    /// What the recording tells of itself: tags, metadata, the recorder.
    pub fn properties(&self) -> &[(String, String)] {
        &self.contents.properties
    }

    /// What was passed over so far.
    pub fn faults(&self) -> &[Fault] {
        &self.contents.faults
    }

    /// How many more faults there are than [`faults`](Self::faults) lists.
    pub fn more_faults(&self) -> u64 {
        self.contents.more_faults
    }

    /// How the recording ended: known once [`next_message`](Self::next_message) has given `None`.
    pub fn ending(&self) -> Option<&Ending> {
        self.ending.as_ref()
    }

    /// The next message in the order of the file; `None` behind the last that can be read.
    ///
    /// # Errors
    /// [`Error::Io`] where the system can't deliver the file.
    pub fn next_message(&mut self) -> Result<Option<Message>> {
        if self.ending.is_some() {
            return Ok(None);
        }
        let step = self.reader.next(&mut self.input, &mut self.contents).map_err(Error::io(&self.file, "read"))?;
        Ok(match step {
            Step::Message(message) => Some(message),
            Step::End(ending) => {
                self.ending = Some(ending);
                None
            }
        })
    }
}

/// Bytes that tell the format.
const LONGEST_BEGINNING: u64 = 256;

fn format_of(beginning: &[u8]) -> Option<Format> {
    let magic = Format::of(beginning);
    #[cfg(feature = "adi")]
    let adi = formats::adi::is_header(beginning) || formats::adi::is_frame(beginning);
    #[cfg(feature = "adi")]
    let magic = magic.or(adi.then_some(Format::Adi));
    magic
}

impl Reader {
    #[allow(unused_variables)]
    fn open(file: &Path, format: Format, beginning: &[u8], input: &mut Input, contents: &mut Contents) -> Result<Self> {
        let read = |error: io::Error| Error::io(file, "read")(error);
        #[allow(unreachable_patterns)]
        match format {
            #[cfg(feature = "mcap")]
            Format::Mcap if !beginning.starts_with(&formats::mcap::MAGIC) => {
                Err(Error::format(file, "is MCAP of another version than 0, which is read"))
            }
            #[cfg(feature = "mcap")]
            Format::Mcap => Ok(Self::Mcap(formats::mcap::Mcap::open(input, contents).map_err(read)?)),
            #[cfg(feature = "bag")]
            Format::Bag if !beginning.starts_with(formats::bag::MAGIC) => {
                Err(Error::format(file, "is a bag of another version than 2.0, which is read"))
            }
            #[cfg(feature = "bag")]
            Format::Bag => Ok(Self::Bag(formats::bag::Bag::open(input, contents).map_err(read)?)),
            #[cfg(feature = "mkv")]
            Format::Matroska => {
                Ok(Self::Matroska(Box::new(formats::mkv::Matroska::open(input, contents).map_err(read)?)))
            }
            #[cfg(feature = "adi")]
            Format::Adi => Ok(Self::Adi(Box::new(formats::adi::Adi::open(input, contents).map_err(read)?))),
            _ => Err(Error::LeftOut { file: file.to_path_buf(), feature: feature(format) }),
        }
    }

    #[allow(unused_variables)]
    fn next(&mut self, input: &mut Input, contents: &mut Contents) -> io::Result<Step> {
        match self {
            #[cfg(feature = "mcap")]
            Self::Mcap(reader) => reader.next(input, contents),
            #[cfg(feature = "bag")]
            Self::Bag(reader) => reader.next(input, contents),
            #[cfg(feature = "mkv")]
            Self::Matroska(reader) => reader.next(input, contents),
            #[cfg(feature = "adi")]
            Self::Adi(reader) => reader.next(input, contents),
            Self::None => Ok(Step::End(Ending::Complete)),
        }
    }
}

/// The feature of this crate that reads a format.
fn feature(format: Format) -> &'static str {
    match format {
        Format::Mcap => "mcap",
        Format::Bag => "bag",
        Format::Matroska => "mkv",
        Format::Adi => "adi",
    }
}
