//! What became of a conversion.

use std::fmt;

use commands::{Doubt, Judged};
use report::{Column, Document};
use serde::Serialize;

/// What was converted, and what was left out.
#[derive(Debug, Clone, Default, Serialize)]
pub struct ConvertSummary {
    /// What was read.
    pub input: String,
    /// Its format.
    pub format: String,
    /// What was written.
    pub out: String,
    /// The stream whose images became frames; of a survey or a whole recording its level or `all`.
    pub stream: String,
    /// What the frames hold: `depth`, `range`, `intensity`; of a whole recording `messages`.
    pub level: String,
    /// Frames, or messages of a whole recording, that were written.
    pub frames: usize,
    /// Frames that were not, with the reason.
    pub skipped: Vec<Skipped>,
    /// Stream of the amplitudes that frames have.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub amplitudes: Option<String>,
    /// Frames with an amplitude.
    pub with_amplitude: usize,
    /// Frames with a temperature.
    pub with_temperature: usize,
    /// Where the camera comes from.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<CameraUsed>,
    /// Inertial samples.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub imu: Option<ImuUsed>,
    /// Streams of which nothing was taken.
    pub left_out: Vec<String>,
    /// What should be known before the result is used.
    pub findings: Vec<String>,
    /// What speaks against it.
    pub doubts: Vec<Doubt>,
}

/// Frames that were left out for one reason.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Skipped {
    /// Why.
    pub reason: String,
    /// How many.
    pub frames: usize,
}

/// The camera of the frames.
#[derive(Debug, Clone, Serialize)]
pub struct CameraUsed {
    /// A stream, an attachment or a file.
    pub source: String,
    /// Its distortion model.
    pub model: String,
    /// The largest distance, in pixels, between the lens there and the one that was written.
    pub residual_px: f64,
}

/// Inertial samples that were taken over.
#[derive(Debug, Clone, Serialize)]
pub struct ImuUsed {
    /// Their stream.
    pub stream: String,
    /// The file in the output, or the topic.
    pub written_as: String,
    /// How many.
    pub samples: usize,
    /// Samples without both angular velocity and acceleration, or not later than the one before.
    pub left_out: usize,
}

impl ConvertSummary {
    /// Counts a frame that is left out.
    pub(crate) fn skip(&mut self, reason: impl Into<String>) {
        let reason = reason.into();
        match self.skipped.iter_mut().find(|skipped| skipped.reason == reason) {
            Some(skipped) => skipped.frames += 1,
            None => self.skipped.push(Skipped { reason, frames: 1 }),
        }
    }
}

impl Judged for ConvertSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl fmt::Display for ConvertSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        document(self).fmt(f)
    }
}

fn document(summary: &ConvertSummary) -> Document {
    let mut document = Document::new("rangecam: convert", "");
    let mut rows = Vec::new();
    let mut row = |name: &str, value: String| rows.push(vec![name.to_owned(), value]);
    row("from", format!("{} ({})", summary.input, summary.format));
    row("stream", summary.stream.clone());
    row("level", summary.level.clone());
    row("frames", summary.frames.to_string());
    for skipped in &summary.skipped {
        row("left out", format!("{} frames: {}", skipped.frames, skipped.reason));
    }
    if let Some(amplitudes) = &summary.amplitudes {
        row("amplitudes", format!("{} frames, from {amplitudes}", summary.with_amplitude));
    }
    if summary.with_temperature > 0 {
        row("temperatures", format!("{} frames", summary.with_temperature));
    }
    if let Some(camera) = &summary.camera {
        let residual =
            if camera.residual_px < 1e-6 { "exact".to_owned() } else { format!("within {:.2} px", camera.residual_px) };
        row("camera", format!("{} ({}), {residual}", camera.source, camera.model));
    }
    if let Some(imu) = &summary.imu {
        row("inertial samples", format!("{} of {} in {}", imu.samples, imu.stream, imu.written_as));
        if imu.left_out > 0 {
            row("left out", format!("{} inertial samples", imu.left_out));
        }
    }
    if !summary.left_out.is_empty() {
        row("left alone", summary.left_out.join(", "));
    }
    document.table([Column::words("what"), Column::words("found")], rows);
    document.list(&summary.findings);
    document.warnings(&summary.doubts);
    document.closing(format!("Written: {}", summary.out));
    document
}
