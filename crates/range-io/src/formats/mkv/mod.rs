//! Matroska recordings of an Azure Kinect: uncompressed depth and infrared images.
//!
//! Images are big-endian 16-bit (`b16g`), one frame a block, as the Azure Kinect recorder writes them: track `DEPTH` with
//! depths in millimetres and 0 for none, track `IR` with the active infrared image. Colour tracks are left alone.
//!
//! A reader of its own, because all that is needed of the format is a walk over its elements: it reads no image that is
//! not asked for and takes recordings whose sizes were left open.

mod ebml;

use std::fs::File;
use std::io::{self, Read, Seek};
use std::path::{Path, PathBuf};

use range_image::Raster;

use crate::text::fault::{Fault, zeros};
use crate::text::limits::{LONGEST_ATTACHMENT, MOST_ATTACHMENTS, MOST_IMAGES, MOST_PIXELS, MOST_TRACKS};
use crate::{Error, Result};
use ebml::{Element, Elements, id};

/// Name of the depth track.
pub const DEPTH: &str = "DEPTH";
/// Name of the infrared track.
pub const INFRARED: &str = "IR";

const MOST_NANOSECONDS: u64 = i64::MAX as u64;

/// One track of a recording.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Track {
    /// Number in the file.
    pub number: u64,
    /// Name, such as [`DEPTH`].
    pub name: String,
    /// Columns.
    pub width: u64,
    /// Rows.
    pub height: u64,
    codec: String,
    codec_private: Vec<u8>,
    encoded: bool,
}

/// Where one image of a track lies.
#[derive(Debug, Clone, Copy)]
struct Block {
    track: u64,
    ticks: i64,
    offset: u64,
    size: u64,
}

/// An open recording.
#[derive(Debug)]
pub struct Recording<R = File> {
    file: PathBuf,
    reader: R,
    tracks: Vec<Track>,
    blocks: Vec<Block>,
    attachments: Vec<(String, Vec<u8>)>,
    nanoseconds_per_tick: u64,
}

/// Depth and infrared image of one moment.
#[derive(Debug, Clone, PartialEq)]
pub struct DepthFrame {
    /// Time since the recording's zero in seconds.
    pub timestamp_s: f64,
    /// Stored depths.
    pub depth: Raster<u16>,
    /// Infrared image of the same time, where there is one.
    pub infrared: Option<Raster<u16>>,
}

/// Reads depth frame `index` (from 0) of a recording with the infrared image of its time.
pub fn read_frame(path: impl AsRef<Path>, index: usize) -> Result<DepthFrame> {
    let mut recording = Recording::open(path)?;
    recording.depth_frame(index)
}

impl Recording<File> {
    /// Opens a recording and notes where its images lie.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        Self::new(path, crate::open(path)?.0)
    }
}

impl<R: Read + Seek> Recording<R> {
    /// Notes where the images of a recording lie; `name` stands for the file in messages.
    pub fn new(name: impl Into<PathBuf>, mut reader: R) -> Result<Self> {
        let file = name.into();
        let mut index = Index { nanoseconds_per_tick: 1_000_000, ..Index::default() };
        index.read(&mut reader).map_err(|error| {
            Fault::from(error)
                .with(&file, |reason| Error::format(&file, format!("is no complete Matroska file: {reason}")))
        })?;
        let Index { tracks, blocks, attachments, nanoseconds_per_tick, .. } = index;
        Ok(Self { file, reader, tracks, blocks, attachments, nanoseconds_per_tick })
    }

    /// The tracks in the order of the file.
    pub fn tracks(&self) -> &[Track] {
        &self.tracks
    }

    /// Number of images of a track.
    pub fn frames(&self, track: &str) -> usize {
        self.find(track).map_or(0, |found| self.blocks.iter().filter(|block| block.track == found.number).count())
    }

    /// An attached file by name, such as `calibration.json`.
    pub fn attachment(&self, name: &str) -> Option<&[u8]> {
        self.attachments.iter().find(|(found, _)| found == name).map(|(_, data)| data.as_slice())
    }

    /// Depth frame `index` (from 0) with the infrared image of its time.
    pub fn depth_frame(&mut self, index: usize) -> Result<DepthFrame> {
        let track = self.required(DEPTH)?;
        let frames = self.frames(DEPTH);
        let block = self.blocks.iter().filter(|block| block.track == track.number).nth(index).copied();
        let block = block.ok_or_else(|| {
            Error::format(&self.file, format!("has {frames} depth frames; number {index} (from 0) is asked for"))
        })?;
        let depth = self.image(&track, block)?;
        let infrared = match self.find(INFRARED).cloned() {
            None => None,
            Some(track) => {
                let same = |other: &&Block| other.track == track.number && other.ticks == block.ticks;
                let block = self.blocks.iter().find(same).copied();
                block.map(|block| self.image(&track, block)).transpose()?
            }
        };
        let timestamp_s = block.ticks as f64 * self.nanoseconds_per_tick as f64 * 1e-9;
        Ok(DepthFrame { timestamp_s, depth, infrared })
    }

    fn find(&self, name: &str) -> Option<&Track> {
        self.tracks.iter().find(|track| track.name.eq_ignore_ascii_case(name))
    }

    fn required(&self, name: &str) -> Result<Track> {
        self.find(name).cloned().ok_or_else(|| {
            let names: Vec<_> = self.tracks.iter().map(|track| format!("`{}`", track.name)).collect();
            Error::format(&self.file, format!("has no track `{name}`, only {}", names.join(", ")))
        })
    }

    fn image(&mut self, track: &Track, block: Block) -> Result<Raster<u16>> {
        let (width, height) = self.require_uncompressed(track)?;
        let expected = 2 * (width * height) as u64;
        if block.size != expected {
            let (name, size) = (&track.name, block.size);
            let reason =
                format!("track `{name}` has an image of {size} bytes, expected {expected} for {width} x {height}");
            return Err(Error::format(&self.file, reason));
        }
        let mut bytes = zeros(expected as usize).map_err(Error::io(&self.file, "reserve memory for"))?;
        let read = self.reader.seek(io::SeekFrom::Start(block.offset)).and_then(|_| self.reader.read_exact(&mut bytes));
        read.map_err(Error::io(&self.file, "read an image of"))?;
        let values = bytes.as_chunks().0.iter().map(|&pair| u16::from_be_bytes(pair)).collect();
        Raster::from_vec(width, height, values).map_err(|error| Error::format(&self.file, error.to_string()))
    }

    /// Size of a track's images, whose coding must be `b16g`.
    fn require_uncompressed(&self, track: &Track) -> Result<(usize, usize)> {
        let name = &track.name;
        // A BITMAPINFOHEADER carries the coding in its bytes 16 to 19.
        let coding = track.codec_private.get(16..20).map(String::from_utf8_lossy).unwrap_or_default();
        if track.codec != "V_MS/VFW/FOURCC" || coding != "b16g" || track.encoded {
            let codec = &track.codec;
            let reason = format!("track `{name}` is coded as {codec} `{coding}`, expected uncompressed `b16g`");
            return Err(Error::format(&self.file, reason));
        }
        let (width, height) = (track.width as usize, track.height as usize);
        if width.checked_mul(height).is_none_or(|pixels| pixels == 0 || pixels > MOST_PIXELS) {
            let reason = format!("track `{name}` has {width} x {height} pixels, expected 1 to {MOST_PIXELS} in all");
            return Err(Error::format(&self.file, reason));
        }
        Ok((width, height))
    }
}

/// What one walk through a file collects.
#[derive(Default)]
struct Index {
    tracks: Vec<Track>,
    blocks: Vec<Block>,
    attachments: Vec<(String, Vec<u8>)>,
    nanoseconds_per_tick: u64,
    cluster_ticks: i64,
    is_matroska: bool,
}

impl Index {
    fn read(&mut self, reader: &mut (impl Read + Seek)) -> io::Result<()> {
        let mut elements = Elements::new(reader)?;
        while let Some(element) = elements.next()? {
            self.is_matroska |= element.id == id::HEADER;
            if !self.is_matroska {
                return Err(invalid("it does not begin as one does"));
            }
            self.element(&mut elements, &element)?;
        }
        if self.is_matroska { Ok(()) } else { Err(invalid("it is empty")) }
    }

    fn element<R: Read + Seek>(&mut self, elements: &mut Elements<R>, element: &Element) -> io::Result<()> {
        match element.id {
            id::TRACK_ENTRY if self.tracks.len() == MOST_TRACKS => return Err(too_many("tracks", MOST_TRACKS)),
            id::TRACK_ENTRY => self.tracks.push(Track::default()),
            id::ATTACHED_FILE if self.attachments.len() == MOST_ATTACHMENTS => {
                return Err(too_many("attachments", MOST_ATTACHMENTS));
            }
            id::ATTACHED_FILE => self.attachments.push(Default::default()),
            id::TIMESTAMP_SCALE => self.nanoseconds_per_tick = elements.unsigned(element)?.clamp(1, MOST_NANOSECONDS),
            id::TIMESTAMP => self.cluster_ticks = elements.unsigned(element)?.min(MOST_NANOSECONDS) as i64,
            id::SIMPLE_BLOCK | id::BLOCK => self.block(elements, element)?,
            id::FILE_NAME | id::FILE_DATA => self.attached(elements, element)?,
            _ => return self.track(elements, element),
        }
        Ok(())
    }

    /// An element of the track that was begun last; others are skipped.
    fn track<R: Read + Seek>(&mut self, elements: &mut Elements<R>, element: &Element) -> io::Result<()> {
        let Some(track) = self.tracks.last_mut() else { return elements.skip(element.size) };
        match element.id {
            id::TRACK_NUMBER => track.number = elements.unsigned(element)?,
            id::NAME => track.name = elements.text(element)?,
            id::CODEC_ID => track.codec = elements.text(element)?,
            id::CODEC_PRIVATE => track.codec_private = elements.data(element, 1 << 20)?,
            id::PIXEL_WIDTH => track.width = elements.unsigned(element)?,
            id::PIXEL_HEIGHT => track.height = elements.unsigned(element)?,
            id::CONTENT_ENCODINGS => {
                track.encoded = true;
                elements.skip(element.size)?;
            }
            _ => elements.skip(element.size)?,
        }
        Ok(())
    }

    fn attached<R: Read + Seek>(&mut self, elements: &mut Elements<R>, element: &Element) -> io::Result<()> {
        let Some((name, data)) = self.attachments.last_mut() else { return elements.skip(element.size) };
        if element.id == id::FILE_NAME {
            *name = elements.text(element)?;
        } else if element.size <= LONGEST_ATTACHMENT {
            *data = elements.data(element, LONGEST_ATTACHMENT)?;
        } else {
            elements.skip(element.size)?;
        }
        Ok(())
    }

    /// Track number, time relative to the cluster's, flags, then one frame.
    fn block<R: Read + Seek>(&mut self, elements: &mut Elements<R>, element: &Element) -> io::Result<()> {
        let head = Element { id: element.id, offset: element.offset, size: element.size.min(11) };
        let bytes = elements.data(&head, 11)?;
        elements.skip(element.size - head.size)?;
        let length = bytes.first().map_or(8, |byte| byte.leading_zeros() as usize);
        let [number @ .., high, low, flags] = bytes.get(..length + 4).unwrap_or_default() else {
            return Err(invalid("a block is shorter than its head"));
        };
        let track = number.iter().fold(0_u64, |value, &byte| value << 8 | u64::from(byte));
        let track = track & ((1 << (7 * (length + 1))) - 1);
        let lacing = flags & 0b110;
        if lacing != 0 {
            return Err(invalid("a block holds several frames (lacing), expected one"));
        }
        if self.blocks.len() == MOST_IMAGES {
            return Err(too_many("images", MOST_IMAGES));
        }
        let ticks = self.cluster_ticks.saturating_add(i64::from(i16::from_be_bytes([*high, *low])));
        let head = length as u64 + 4;
        self.blocks.push(Block { track, ticks, offset: element.offset + head, size: element.size - head });
        Ok(())
    }
}

fn too_many(what: &str, most: usize) -> io::Error {
    invalid(&format!("it has more than {most} {what}"))
}

fn invalid(reason: &str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, reason)
}
