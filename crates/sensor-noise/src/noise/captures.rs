//! Repeated frames of a station, one after the other.

use range_image::{RangeFrame, RawFrame};

use crate::{Error, Result};

/// The frames of one station in the order in which they were taken, shown one after the other, as often as they are asked
/// for: of many, no more need be in memory than a source reads at once. A slice of frames is a source.
pub trait Frames<F> {
    /// What reading may fail with, beside the errors of this crate.
    type Error: From<Error>;

    /// Number of frames.
    fn count(&self) -> usize;

    /// Shows each frame.
    ///
    /// # Errors
    /// What reading fails with, and the first that `see` refuses.
    fn each(&self, see: &mut dyn FnMut(&F) -> Result<()>) -> Result<(), Self::Error>;
}

impl<F> Frames<F> for &[F] {
    type Error = Error;

    fn count(&self) -> usize {
        self.len()
    }

    fn each(&self, see: &mut dyn FnMut(&F) -> Result<()>) -> Result<()> {
        self.iter().try_for_each(see)
    }
}

/// Raw frames of one station: a scene and a camera at rest.
#[derive(Debug, Clone)]
pub struct RepeatedSamples<S> {
    /// Name for messages.
    pub station: String,
    /// The frames in the order in which they were taken.
    pub frames: S,
}

/// Range frames of one station: a scene and a camera at rest.
#[derive(Debug, Clone)]
pub struct RepeatedRanges<S> {
    /// Name for messages.
    pub station: String,
    /// The frames in the order in which they were taken.
    pub frames: S,
    /// The ambiguity interval, metre, where it is known: differences are taken modulo it, and ranges so uncertain that
    /// they go all round it say nothing of noise.
    pub interval_m: Option<f64>,
}

impl<S: Frames<RawFrame>> RepeatedSamples<S> {
    /// Shows each frame; refuses fewer than two, and frames that differ in size, steps or frequencies.
    pub(super) fn each(&self, see: &mut dyn FnMut(&RawFrame) -> Result<()>) -> Result<(), S::Error> {
        let shape = |frame: &RawFrame| {
            let modulations: Vec<u64> =
                frame.modulations().iter().map(|modulation| modulation.frequency_hz().to_bits()).collect();
            Ok((frame.width(), frame.height(), frame.phase_steps(), modulations))
        };
        each_alike(&self.station, &self.frames, &shape, see)
    }
}

impl<S: Frames<RangeFrame>> RepeatedRanges<S> {
    /// Shows each frame; refuses fewer than two, and frames that differ in size.
    pub(super) fn each(&self, see: &mut dyn FnMut(&RangeFrame) -> Result<()>) -> Result<(), S::Error> {
        let shape = |frame: &RangeFrame| {
            frame.validate()?;
            Ok((frame.width(), frame.height()))
        };
        each_alike(&self.station, &self.frames, &shape, see)
    }
}

fn each_alike<F, S: Frames<F>, K: PartialEq>(
    station: &str,
    frames: &S,
    shape: &dyn Fn(&F) -> Result<K>,
    see: &mut dyn FnMut(&F) -> Result<()>,
) -> Result<(), S::Error> {
    if frames.count() < 2 {
        return Err(Error::TooFewFrames { station: station.to_owned(), frames: frames.count(), needed: 2 }.into());
    }
    let (mut first, mut number) = (None, 0);
    frames.each(&mut |frame| {
        let own = shape(frame)?;
        if first.as_ref().is_some_and(|first| *first != own) {
            return Err(Error::FramesDiffer { station: station.to_owned(), frame: number });
        }
        first.get_or_insert(own);
        number += 1;
        see(frame)
    })
}
