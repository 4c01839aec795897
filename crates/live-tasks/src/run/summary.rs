//! What a stream came to.

use std::collections::BTreeMap;
use std::fmt;
use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged, Verdict};
use serde::Serialize;

use super::drift::{DriftReport, DriftVerdict};
use super::latency::LatencySummary;
use super::path::{PathReport, PathStatus, PathVerdict};
use super::tally::RefusedFrames;

/// How a stream stands.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct LiveStatus {
    /// Frames processed.
    pub frames: u64,
    /// Frames that came while the one before was not taken yet.
    pub dropped: u64,
    /// Frames that were refused.
    pub refused: u64,
    /// Frames processed a second, from the first on.
    pub frames_per_second: Option<f64>,
    /// Latencies of all frames so far.
    pub latency: Option<LatencySummary>,
    /// Temperature of the camera.
    pub temperature_c: Option<f64>,
    /// What the calibrated drift says.
    pub drift: DriftReport,
    /// The last pose, where poses are sought.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathStatus>,
}

impl fmt::Display for LiveStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} frames, {} dropped, {} refused", self.frames, self.dropped, self.refused)?;
        if let Some(rate) = self.frames_per_second {
            write!(f, ", {rate:.1} a second")?;
        }
        if let Some(latency) = self.latency {
            write!(f, ", latency {:.1} ms (99 %: {:.1})", latency.p50_ms, latency.p99_ms)?;
        }
        if let Some(temperature_c) = self.temperature_c {
            write!(f, ", {temperature_c:.1} °C")?;
        }
        write!(f, ", {}", self.drift)?;
        self.path.as_ref().map_or(Ok(()), |path| write!(f, ", {path}"))
    }
}

/// How a stream ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ended {
    /// The source has no more frames.
    Source,
    /// As many frames as were asked for.
    Frames,
    /// Nobody reads the clouds any more.
    OutputClosed,
    /// Who watches asked for it.
    Asked,
    /// The source broke off within a frame.
    CutOff,
    /// The source cannot be read further.
    Damaged,
}

/// Result of a stream.
#[derive(Debug, Clone, Serialize)]
pub struct LiveSummary {
    /// The source.
    pub source: String,
    /// The survey whose camera it is.
    pub survey: PathBuf,
    /// The calibration.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub calibration: Option<PathBuf>,
    /// Where clouds were written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub clouds: Option<PathBuf>,
    /// The recording of images, where it is a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording: Option<PathBuf>,
    /// Frames processed.
    pub frames: u64,
    /// Frames dropped, as the one before was not taken yet when they came.
    pub dropped: u64,
    /// Frames refused, by reason.
    pub refused: Vec<RefusedFrames>,
    /// How often the clock of the frames began anew.
    pub restarts: u64,
    /// Points of all clouds that were written.
    pub points: u64,
    /// From the first frame to the results of the last, second.
    pub seconds: f64,
    /// Frames processed a second.
    pub frames_per_second: Option<f64>,
    /// Latencies.
    pub latency: Option<LatencySummary>,
    /// Share of the pixels with each flag, and with none.
    pub flags: BTreeMap<&'static str, f64>,
    /// Temperature of the camera at the first and the last frame.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub temperatures_c: Option<[f64; 2]>,
    /// What the calibrated drift says of the last frame.
    pub drift: DriftReport,
    /// What became of the camera's path, where poses were sought.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub path: Option<PathReport>,
    /// How it ended.
    pub ended: Ended,
    /// Why, where that is not what was to be expected.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ended_words: Option<String>,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
}

impl LiveSummary {
    /// Finds what speaks against the result.
    pub(super) fn judge(&mut self) {
        if self.dropped > 0 {
            let all = self.dropped + self.frames + self.refused.iter().map(|refused| refused.frames).sum::<u64>();
            let words =
                format!("{} of {all} frames were dropped, as they came faster than they were processed", self.dropped);
            self.doubts.push(Doubt::new(DoubtKind::DroppedFrames, words));
        }
        for RefusedFrames { reason, frames, first } in &self.refused {
            let words = format!("{frames} frames were refused, the first: {first}");
            self.doubts.push(Doubt::about(DoubtKind::UnreadableFrames, *reason, words));
        }
        if let (Ended::CutOff | Ended::Damaged, Some(words)) = (self.ended, &self.ended_words) {
            self.doubts.push(Doubt::about(DoubtKind::UnreadableFrames, &self.source, words));
        }
        if self.drift.verdict == DriftVerdict::Outside {
            self.doubts.push(Doubt::new(DoubtKind::Drift, self.drift.to_string()));
        }
        if let Some(words) = self.path.as_ref().and_then(PathReport::loss_in_words) {
            self.doubts.push(Doubt::new(DoubtKind::LostFrames, words));
        }
    }
}

impl Judged for LiveSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    /// A path that ends lost is no success, though what was tracked stands.
    fn verdict(&self) -> Verdict {
        match &self.path {
            Some(path) if path.verdict == PathVerdict::Lost => Verdict::Partial,
            _ if self.doubts.is_empty() => Verdict::Done,
            _ => Verdict::Doubtful,
        }
    }
}

impl fmt::Display for LiveSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let refused: u64 = self.refused.iter().map(|refused| refused.frames).sum();
        writeln!(f, "{}: {} frames, {} dropped, {refused} refused", self.source, self.frames, self.dropped)?;
        if let Some(rate) = self.frames_per_second {
            writeln!(f, "{rate:.1} frames a second in {:.1} s", self.seconds)?;
        }
        if let Some(latency) = self.latency {
            let LatencySummary { p50_ms, p95_ms, p99_ms, largest_ms } = latency;
            writeln!(f, "latency {p50_ms:.1} ms; 95 % {p95_ms:.1}, 99 % {p99_ms:.1}, largest {largest_ms:.1} ms")?;
        }
        let percent = |(name, share): (&&str, &f64)| format!("{name} {:.1} %", 100.0 * share);
        writeln!(f, "pixels by flag: {}", self.flags.iter().map(percent).collect::<Vec<_>>().join(", "))?;
        if let Some([first_c, last_c]) = self.temperatures_c {
            writeln!(f, "temperature {first_c:.1} °C, at the end {last_c:.1} °C")?;
        }
        write!(f, "{}", self.drift)?;
        if self.restarts > 0 {
            write!(f, "\nthe clock of the frames began anew {} times", self.restarts)?;
        }
        if let Some(clouds) = &self.clouds {
            write!(f, "\n{} points in {}", self.points, clouds.display())?;
        }
        if let Some(recording) = &self.recording {
            write!(f, "\nimages in {}", recording.display())?;
        }
        if let Some(path) = &self.path {
            write!(f, "\n{path}")?;
        }
        if self.ended == Ended::Asked {
            write!(f, "\nended as asked")?;
        }
        if self.ended == Ended::OutputClosed {
            write!(f, "\nended, as nobody reads the results any more")?;
        }
        for doubt in &self.doubts {
            write!(f, "\ndoubt: {doubt}")?;
        }
        Ok(())
    }
}
