//! What a recording holds.

mod document;
mod tally;
mod timing;

use std::fmt;
use std::path::Path;

use commands::{Doubt, DoubtKind, Judged, Progress, Result};
use recordings::{Payload, Recording};
use serde::Serialize;

use crate::access::{doubts, each_message, ended_badly, failed};
use tally::Tally;
pub use timing::Gap;

/// What was found in a recording.
#[derive(Debug, Clone, Serialize)]
pub struct RecordingInspection {
    /// The file as it was named.
    pub recording: String,
    /// Its format, in words.
    pub format: &'static str,
    /// Its length.
    pub bytes: u64,
    /// When the earliest message was measured, nanosecond on the clock of the recording; `None` without a message.
    pub begins_ns: Option<i64>,
    /// From the earliest to the latest message.
    pub duration_s: f64,
    /// Its streams, in the order of the file.
    pub streams: Vec<StreamReport>,
    /// Its cameras.
    pub cameras: Vec<CameraReport>,
    /// Its temperatures.
    pub temperatures: Vec<TemperatureReport>,
    /// Files inside of it.
    pub attachments: Vec<AttachmentReport>,
    /// What it tells of itself.
    pub properties: Vec<Property>,
    /// How it ended: `complete`, or what is missing.
    pub ended: String,
    doubts: Vec<Doubt>,
}

/// One stream.
#[derive(Debug, Clone, Serialize)]
pub struct StreamReport {
    /// Name.
    pub name: String,
    /// What its messages are, in a word.
    pub kind: &'static str,
    /// Their type in the words of the file.
    pub type_name: String,
    /// Size and encoding of its first image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub content: Option<String>,
    /// Messages that were read.
    pub messages: u64,
    /// Messages that there should be by the file's own word.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stated: Option<u64>,
    /// Messages that are not what their type says.
    pub unreadable: u64,
    /// When the first message was measured, second since the earliest of the recording.
    pub first_s: f64,
    /// When the last one was.
    pub last_s: f64,
    /// Median of the intervals between the first messages.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub interval_s: Option<f64>,
    /// One over that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rate_hz: Option<f64>,
    /// Intervals in which at least one message is missing; 0 for messages of other kinds, which need no rate.
    pub gaps: u64,
    /// Messages that are missing in them.
    pub missing: u64,
    /// The longest of them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub longest_gap: Option<Gap>,
    /// Messages that are not later than the one before.
    pub not_ascending: u64,
}

/// A camera's matrix and lens.
#[derive(Debug, Clone, Serialize)]
pub struct CameraReport {
    /// Its stream.
    pub stream: String,
    /// Columns and rows.
    pub size_px: [u32; 2],
    /// Focal lengths in columns and rows.
    pub focal_px: [f64; 2],
    /// Column and row of the principal point.
    pub principal_point_px: [f64; 2],
    /// Distortion model and its coefficients.
    pub distortion_model: String,
    /// The coefficients in the order of the model.
    pub distortion: Vec<f64>,
}

/// Temperatures of one stream, degree Celsius.
#[derive(Debug, Clone, Serialize)]
pub struct TemperatureReport {
    /// Their stream.
    pub stream: String,
    /// The first.
    pub first_c: f64,
    /// The last.
    pub last_c: f64,
    /// The lowest.
    pub lowest_c: f64,
    /// The highest.
    pub highest_c: f64,
}

/// A file inside of a recording.
#[derive(Debug, Clone, Serialize)]
pub struct AttachmentReport {
    /// Its name.
    pub name: String,
    /// Its length.
    pub bytes: u64,
}

/// Something that a recording tells of itself.
#[derive(Debug, Clone, Serialize)]
pub struct Property {
    /// Its name.
    pub name: String,
    /// Its value.
    pub value: String,
}

impl fmt::Display for RecordingInspection {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document::of(self).fmt(f)
    }
}

impl Judged for RecordingInspection {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

/// Reads a recording to its end and tells what it holds: streams with rates and gaps, cameras, temperatures, and where it is
/// cut off.
///
/// # Errors
/// [`commands::Error::Access`] where the system refuses, [`commands::Error::Request`] for what is no recording.
pub fn inspect_recording(path: &Path, progress: &dyn Progress) -> Result<RecordingInspection> {
    let mut recording = Recording::open(path).map_err(failed("inspect", path))?;
    let mut tallies: Vec<Tally> = Vec::new();
    let (mut cameras, mut temperatures) = (Vec::new(), Vec::new());
    each_message("inspect", "reading the recording", &mut recording, progress, |recording, message| {
        tallies.resize_with(recording.streams().len().max(tallies.len()), Tally::default);
        let stream = || recording.streams()[message.stream].name.clone();
        match &message.payload {
            Payload::CameraInfo(info) if tallies[message.stream].messages == 0 => {
                cameras.push(tally::camera(stream(), info));
            }
            Payload::Temperature(celsius) => tally::temperature(&mut temperatures, stream, *celsius),
            _ => {}
        }
        tallies[message.stream].add(&message);
        Ok(())
    })?;
    tallies.resize_with(recording.streams().len(), Tally::default);
    Ok(assembled(&recording, tallies, cameras, temperatures))
}

fn assembled(
    recording: &Recording,
    tallies: Vec<Tally>,
    cameras: Vec<CameraReport>,
    temperatures: Vec<TemperatureReport>,
) -> RecordingInspection {
    let begins_ns = tallies.iter().filter_map(|tally| Some(tally.times_ns?[0])).min();
    let ends_ns = tallies.iter().filter_map(|tally| Some(tally.times_ns?[1])).max();
    let seconds = |time_ns: i64| time_ns.saturating_sub(begins_ns.unwrap_or(0)) as f64 * 1e-9;
    let streams = recording.streams().iter().zip(tallies);
    let streams: Vec<_> = streams.map(|(stream, tally)| tally.report(stream, seconds)).collect();
    let mut doubts = doubts(recording);
    for stream in &streams {
        doubts.extend(doubt_of(stream));
    }
    RecordingInspection {
        recording: recording.file().display().to_string(),
        format: recording.format().name(),
        bytes: recording.length(),
        begins_ns,
        duration_s: ends_ns.map_or(0.0, seconds),
        streams,
        cameras,
        temperatures,
        attachments: recording
            .attachments()
            .iter()
            .map(|file| AttachmentReport { name: file.name.clone(), bytes: file.size })
            .collect(),
        properties: recording
            .properties()
            .iter()
            .map(|(name, value)| Property { name: name.clone(), value: value.clone() })
            .collect(),
        ended: ended_badly(recording).unwrap_or_else(|| "complete".to_owned()),
        doubts,
    }
}

/// What speaks against a stream.
fn doubt_of(stream: &StreamReport) -> Option<Doubt> {
    let words = if stream.unreadable > 0 {
        format!("{} of {} messages are not what their type says", stream.unreadable, stream.messages)
    } else {
        let stated = stream.stated.filter(|stated| *stated != stream.messages)?;
        format!("{} messages were read, {stated} are stated", stream.messages)
    };
    Some(Doubt::about(DoubtKind::UnreadableFrames, &stream.name, words))
}
