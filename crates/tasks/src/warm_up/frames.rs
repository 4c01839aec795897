//! The frames of a survey as ranges, some in memory at a time.

use std::ops::Range;
use std::path::Path;

use commands::Progress;
use commands::memory::{FrameBytes, Memory, Work};
use pipeline::stages::Line;
use pipeline::survey::{OpenSurvey, Purpose, View, ViewData, open};
use pipeline::{DemodulateOptions, Error, Result, Stage};
use range_image::{RangeFrame, Raster};
use range_io::survey::{Level, Survey};
use rayon::prelude::*;

/// Frames in memory at a time, at most.
const FRAMES_AT_ONCE: usize = 32;

/// Reads frames and brings them to ranges, wrapped where they come from phases.
pub(crate) struct FrameSource {
    survey: OpenSurvey,
    line: Line,
    /// Frames in memory at a time.
    pub(crate) at_once: usize,
}

impl FrameSource {
    /// Refuses frames of several stations, without times, and with several integration times.
    pub(crate) fn new(path: &Path) -> Result<Self> {
        let opened = open(path, (None, "none".to_owned()), Purpose::Camera)?;
        let survey = &opened.survey;
        let refused = |message: String| Err(Error::Survey { path: path.to_owned(), message });
        let Some(first) = survey.frames.first() else { return refused("it lists no frames".to_owned()) };
        for (index, frame) in survey.frames.iter().enumerate() {
            let file = frame.file.display();
            if frame.station != first.station {
                let (a, b) = (&first.station, &frame.station);
                return refused(format!(
                    "frame {index} ({file}) is of station {b}, the first of {a}: a drift needs one"
                ));
            }
            if frame.timestamp_s.is_none() {
                return refused(format!("frame {index} ({file}) has no timestamp_s, which a drift is told by"));
            }
            if frame.integration_time_s != first.integration_time_s {
                return refused(format!(
                    "frame {index} ({file}) has another integration time than the first: ranges depend on it"
                ));
            }
        }
        let stages: &[Stage] = match survey.level {
            Level::Samples => &[Stage::Demodulate(DemodulateOptions::default())],
            _ => &[],
        };
        let bytes = FrameBytes::of(survey);
        // Sums of each pixel in two passes, and a change of each frame; a frame as it is read, as complex image and as ranges.
        let kept = 120 * bytes.pixels + 200 * survey.frames.len() as u64;
        let each = bytes.read + 2 * bytes.waiting;
        let work = Work { what: "taking the mean change of each frame", kept, each, most: FRAMES_AT_ONCE };
        let at_once = Memory::present().at_once(&work)?;
        Ok(Self { line: Line::new(stages, &opened)?, survey: opened, at_once })
    }

    pub(crate) fn survey(&self) -> &Survey {
        &self.survey.survey
    }

    /// The interval that ranges are taken modulo: that of the only frequency, or of the highest one for phases of
    /// several; `None` for ranges of several frequencies, which repeat with none of their intervals.
    pub(crate) fn interval_m(&self) -> Result<Option<f64>> {
        let survey = self.survey();
        let intervals = survey.camera.modulations()?.into_iter().map(|one| one.ambiguity_interval_m());
        let intervals: Vec<f64> = intervals.collect();
        let phases = matches!(survey.level, Level::Samples | Level::Phase);
        Ok(if phases || intervals.len() == 1 { intervals.into_iter().reduce(f64::min) } else { None })
    }

    /// Some frames, in the order of the survey.
    pub(crate) fn read(&mut self, indices: Range<usize>, progress: &dyn Progress) -> Result<Vec<RangeFrame>> {
        let views = indices.into_par_iter().map(|index| self.survey.view(index)).collect::<Vec<Result<View>>>();
        progress.frames_in_memory(self.survey.live.count());
        let views = self.line.apply(views, &mut ())?;
        views.into_par_iter().map(range_frame).collect()
    }
}

/// Ranges as they are; of phases those of the highest frequency, which is the most precise and shares the drift.
fn range_frame(view: View) -> Result<RangeFrame> {
    let frame = match view.data {
        ViewData::Range(frame) => return Ok(frame),
        ViewData::Phase(frame) => frame,
        ViewData::Samples(_) => return Err(Error::Needs { stage: "warm-up", needs: "Demodulate" }),
    };
    let highest = frame.channels.iter().max_by(|a, b| {
        let [a, b] = [a, b].map(|channel| channel.modulation.frequency_hz());
        a.total_cmp(&b)
    });
    let Some(channel) = highest else { return Err(Error::Needs { stage: "warm-up", needs: "Demodulate" }) };
    let range = channel.phase().map(|phase| channel.modulation.range_from_phase(f64::from(*phase)) as f32);
    let sigma = Raster::filled(range.width(), range.height(), f32::NAN);
    Ok(RangeFrame { range, sigma, amplitude: channel.amplitude(), flags: frame.flags })
}
