//! What a recording offers for a survey: streams of images, cameras, light beside the depths.

use commands::range_io::survey::Level;
use commands::{Progress, Result};
use recordings::{CameraInfo, Kind, Payload, Recording};

use super::{ConvertRequest, refused};
use crate::access::{each_message, failed};

/// What is known of a recording after one pass.
pub(super) struct Scan {
    pub streams: Vec<Scanned>,
    /// First camera of each stream of cameras.
    pub cameras: Vec<(usize, CameraInfo)>,
    /// The factory calibration of an Azure Kinect.
    pub factory: Option<Vec<u8>>,
    pub properties: Vec<(String, String)>,
}

/// Size and coordinate system of an image.
pub(super) type FirstImage = ([usize; 2], String);

/// One stream.
#[derive(Debug, Clone)]
pub(super) struct Scanned {
    pub name: String,
    pub kind: Kind,
    pub messages: usize,
    /// Size and coordinate system of the first image that is stored pixel by pixel.
    pub image: Option<FirstImage>,
}

/// Reads a recording once.
pub(super) fn scan(request: &ConvertRequest, progress: &dyn Progress) -> Result<Scan> {
    let mut recording = Recording::open(&request.input).map_err(failed("convert", &request.input))?;
    let mut found: Vec<(usize, Option<FirstImage>)> = Vec::new();
    let mut cameras: Vec<(usize, CameraInfo)> = Vec::new();
    each_message("convert", "looking through the recording", &mut recording, progress, |recording, message| {
        found.resize(recording.streams().len().max(found.len()), (0, None));
        let (messages, image) = &mut found[message.stream];
        *messages += 1;
        match message.payload {
            Payload::Image(first) if image.is_none() => {
                *image = Some(([first.width(), first.height()], first.frame_id().to_owned()));
            }
            Payload::CameraInfo(info) if !cameras.iter().any(|(stream, _)| *stream == message.stream) => {
                cameras.push((message.stream, *info));
            }
            _ => {}
        }
        Ok(())
    })?;
    found.resize(recording.streams().len(), (0, None));
    let streams = recording.streams().iter().zip(found).map(|(stream, (messages, image))| Scanned {
        name: stream.name.clone(),
        kind: stream.kind,
        messages,
        image,
    });
    Ok(Scan {
        streams: streams.collect(),
        cameras,
        factory: recording.attachment("calibration.json").map(<[u8]>::to_vec),
        properties: recording.properties().to_vec(),
    })
}

impl Scan {
    /// The stream whose images become frames, and what they are.
    pub fn frames(&self, request: &ConvertRequest) -> Result<(usize, Level)> {
        let stream = match &request.stream {
            Some(name) => self.named(name)?,
            None => self.only()?,
        };
        let said = match self.streams[stream].kind {
            Kind::Depth => Some(Level::Depth),
            Kind::Range => Some(Level::Range),
            Kind::Intensity => Some(Level::Intensity),
            _ => None,
        };
        let level = request.level.or(said).ok_or_else(|| {
            let Scanned { name, kind, .. } = &self.streams[stream];
            refused(format!("stream `{name}` is {}: say with --level what its values are", kind.name()))
        })?;
        Ok((stream, level))
    }

    fn named(&self, name: &str) -> Result<usize> {
        let stream = self.streams.iter().position(|stream| stream.name == name);
        let stream = stream
            .ok_or_else(|| refused(format!("there is no stream `{name}`; there are {}", self.names(|_| true))))?;
        if self.streams[stream].image.is_none() {
            let with_images = self.names(|stream| stream.image.is_some());
            return Err(refused(format!(
                "stream `{name}` has no images that are stored pixel by pixel; there are {with_images}"
            )));
        }
        Ok(stream)
    }

    fn only(&self) -> Result<usize> {
        let is_depth = |stream: &Scanned| stream.image.is_some() && matches!(stream.kind, Kind::Depth | Kind::Range);
        let mut depths = (0..self.streams.len()).filter(|index| is_depth(&self.streams[*index]));
        match (depths.next(), depths.next()) {
            (Some(only), None) => Ok(only),
            (None, _) => {
                Err(refused(format!("the recording has no depth or range images; there are {}", self.names(|_| true))))
            }
            (Some(_), Some(_)) => Err(refused(format!(
                "the recording has several depth images: name one with --stream: {}",
                self.names(is_depth)
            ))),
        }
    }

    /// The stream of light whose images belong to those of a stream: of the same camera, and no other of that size.
    pub fn light(&self, frames: usize) -> Option<usize> {
        let size = self.streams[frames].image.as_ref()?.0;
        let fits = |stream: &Scanned| {
            stream.kind == Kind::Intensity && stream.image.as_ref().is_some_and(|(found, _)| *found == size)
        };
        let mut fitting = (0..self.streams.len()).filter(|index| *index != frames && fits(&self.streams[*index]));
        fitting.next().filter(|_| fitting.next().is_none())
    }

    /// The stream of inertial samples.
    pub fn imu(&self, request: &ConvertRequest) -> Result<Option<usize>> {
        let is_imu = |stream: &Scanned| stream.kind == Kind::Imu && stream.messages > 0;
        let mut found = (0..self.streams.len()).filter(|index| is_imu(&self.streams[*index]));
        let Some(name) = &request.imu else { return Ok(found.next().filter(|_| found.next().is_none())) };
        let named = found.find(|index| self.streams[*index].name == *name);
        let words = || refused(format!("there is no inertial stream `{name}`; there are {}", self.names(is_imu)));
        named.map(Some).ok_or_else(words)
    }

    /// Names of streams, for messages.
    pub fn names(&self, fits: impl Fn(&Scanned) -> bool) -> String {
        let names: Vec<_> = self
            .streams
            .iter()
            .filter(|stream| fits(stream))
            .map(|stream| format!("`{}` ({})", stream.name, stream.kind.name()))
            .collect();
        if names.is_empty() { "none".to_owned() } else { names.join(", ") }
    }

    /// What the recording tells of itself under a name.
    pub fn property(&self, name: &str) -> Option<&str> {
        self.properties.iter().find(|(found, _)| found == name).map(|(_, value)| value.as_str())
    }
}
