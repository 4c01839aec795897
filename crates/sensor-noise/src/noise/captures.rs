//! Repeated frames of a station.

use range_image::{RangeFrame, RawFrame};

use crate::{Error, Result};

/// Raw frames of one station: a scene and a camera at rest.
#[derive(Debug, Clone)]
pub struct RepeatedSamples<'a> {
    /// Name for messages.
    pub station: String,
    /// The frames in the order in which they were taken.
    pub frames: Vec<&'a RawFrame>,
}

/// Range frames of one station: a scene and a camera at rest.
#[derive(Debug, Clone)]
pub struct RepeatedRanges<'a> {
    /// Name for messages.
    pub station: String,
    /// The frames in the order in which they were taken.
    pub frames: Vec<&'a RangeFrame>,
    /// The ambiguity interval, metre, where it is known: differences are taken modulo it, and ranges so uncertain that
    /// they go all round it say nothing of noise.
    pub interval_m: Option<f64>,
}

impl RepeatedSamples<'_> {
    /// Refuses fewer than two frames, and frames that differ in size, steps or frequencies.
    pub(super) fn validate(&self) -> Result<()> {
        let shape = |frame: &RawFrame| {
            let modulations: Vec<u64> =
                frame.modulations().iter().map(|modulation| modulation.frequency_hz().to_bits()).collect();
            (frame.width(), frame.height(), frame.phase_steps(), modulations)
        };
        require_alike(&self.station, &self.frames, shape)
    }
}

impl RepeatedRanges<'_> {
    /// Refuses fewer than two frames, and frames that differ in size.
    pub(super) fn validate(&self) -> Result<()> {
        for frame in &self.frames {
            frame.validate()?;
        }
        require_alike(&self.station, &self.frames, |frame| (frame.width(), frame.height()))
    }
}

fn require_alike<F, S: PartialEq>(station: &str, frames: &[&F], shape: impl Fn(&F) -> S) -> Result<()> {
    let station = || station.to_owned();
    let [first, _, ..] = frames else {
        return Err(Error::TooFewFrames { station: station(), frames: frames.len(), needed: 2 });
    };
    match frames.iter().position(|frame| shape(frame) != shape(first)) {
        Some(frame) => Err(Error::FramesDiffer { station: station(), frame }),
        None => Ok(()),
    }
}
