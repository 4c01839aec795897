//! A survey's frames, one after the other, as they were taken.

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use commands::{Error, Result, root_of};
use range_io::survey::{FrameEntry, InputFrame, Level, Survey, read_frame};

use super::{FrameSource, Next};
use crate::wire::{FrameError, FrameHeader, LiveFrame, SampleType};

/// Longest sleep before the source may be left.
const LONGEST_SLEEP: Duration = Duration::from_millis(50);
/// Time between frames without time stamps that are played without waiting, second.
const WITHOUT_TIMES_S: f64 = 1.0;

/// Time of a recording's frame, second.
pub(crate) fn frame_time_s(entry: &FrameEntry, index: usize) -> f64 {
    entry.timestamp_s.unwrap_or(index as f64 * WITHOUT_TIMES_S)
}

pub(super) struct Recording {
    survey: Survey,
    root: PathBuf,
    next: usize,
    paced: bool,
    /// When the first frame was due, and its time stamp.
    begun: Option<(Instant, f64)>,
    /// A frame that was read and is not due yet.
    early: Option<LiveFrame>,
}

impl Recording {
    pub(super) fn open(path: &Path, paced: bool) -> Result<Self> {
        let survey = Survey::read(path)?;
        let refused = |message: String| Err(Error::Request { command: "live", message });
        if survey.level != Level::Samples {
            let level = survey.level.name();
            return refused(format!("{} is at level `{level}`, expected `samples`", path.display()));
        }
        if survey.frames.is_empty() {
            return refused(format!("{} lists no frames", path.display()));
        }
        if let Some(without) = survey.frames.iter().position(|frame| frame.timestamp_s.is_none()).filter(|_| paced) {
            return refused(format!(
                "frames[{without}].timestamp_s is missing, which a recording is played by: state it, or play without waiting"
            ));
        }
        Ok(Self { root: root_of(path), survey, next: 0, paced, begun: None, early: None })
    }

    fn read(&mut self) -> std::result::Result<LiveFrame, String> {
        let index = self.next;
        self.next += 1;
        let entry = &self.survey.frames[index];
        let read = read_frame(&self.survey, &self.root, index).map_err(|error| error.to_string())?;
        let InputFrame::Samples(raw) = read else {
            return Err(format!("frames[{index}]: {} has no samples", entry.file.display()));
        };
        let samples = raw.samples().clone();
        let header = FrameHeader {
            sample_type: SampleType::of(&samples),
            width: raw.width(),
            height: raw.height(),
            frequencies: raw.modulations().len(),
            phase_steps: raw.phase_steps(),
            timestamp_s: frame_time_s(entry, index),
            integration_time_s: entry.integration_time_s,
            temperature_c: entry.temperature_c,
        };
        Ok(LiveFrame { header, samples, arrived: Instant::now() })
    }

    /// When a frame is due. One that is earlier than the first is due at once.
    fn due(&mut self, timestamp_s: f64) -> Instant {
        let (begun, first_s) = *self.begun.get_or_insert((Instant::now(), timestamp_s));
        let after = Duration::try_from_secs_f64(timestamp_s - first_s).unwrap_or_default();
        begun.checked_add(after).unwrap_or(begun)
    }
}

impl FrameSource for Recording {
    fn next(&mut self, _: Option<LiveFrame>) -> std::result::Result<Next, FrameError> {
        let mut frame = match self.early.take() {
            Some(frame) => frame,
            None if self.next == self.survey.frames.len() => return Ok(Next::End),
            None => match self.read() {
                Ok(frame) => frame,
                Err(words) => return Ok(Next::Unreadable(words)),
            },
        };
        if self.paced {
            let left = self.due(frame.header.timestamp_s).saturating_duration_since(Instant::now());
            if !left.is_zero() {
                std::thread::sleep(left.min(LONGEST_SLEEP));
                if left > LONGEST_SLEEP {
                    self.early = Some(frame);
                    return Ok(Next::Waiting);
                }
            }
        }
        frame.arrived = Instant::now();
        Ok(Next::Frame(frame))
    }
}
