//! Whether the standard deviations that pixels carry are true: against the scatter of repeated frames.

use range_image::{ComplexFrame, RangeFrame, Raster};
use rayon::prelude::*;
use statistics::{Distribution, upper_median};

use super::bins::{MovedLimits, has_moved};
use super::ranges::{NORMAL_SHARE, Value, has_amplitudes};
use super::repeats::{Running, Thinning};
use super::steadiness::VALUES_PER_TASK;
use super::{Frames, RepeatedRanges, VarianceEstimator};
use crate::{Error, Result};

/// Pixels of like amplitude: the variance of their standardised residuals, 1 if their sigma is true.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SigmaBin {
    /// Smallest and largest amplitude.
    pub amplitude: [f64; 2],
    /// Values that counted.
    pub values: usize,
    /// Degrees of freedom.
    pub degrees: f64,
    /// Variance observed over variance claimed.
    pub ratio: f64,
    /// Where the ratio lies in 999 of 1000 cases if sigma is true in all bins.
    pub limits: [f64; 2],
}

/// What the bins say together.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SigmaVerdict {
    /// All ratios lie within their limits.
    True,
    /// Ratios lie beyond their limits, but no sigma is off by more than a tenth.
    Close,
    /// The pixels scatter more than their sigma says.
    TooSmall,
    /// The pixels scatter less than their sigma says.
    TooLarge,
    /// Too small at some amplitudes, too large at others.
    Mixed,
}

/// Standardised residuals of repeated frames by amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct SigmaCheck {
    /// Classes of equal number, by amplitude.
    pub bins: Vec<SigmaBin>,
    /// Ratio over all values.
    pub ratio: f64,
    /// Share of values that scatter as no noise does; left out.
    pub moved_share: f64,
    /// What that means.
    pub verdict: SigmaVerdict,
}

/// Classes of amplitude.
const BINS: usize = 12;

/// A sigma off by less than a tenth: a variance off by a fifth.
const CLOSE: [f64; 2] = [0.81, 1.21];

/// Checks the sigma planes of repeated range frames. Pixels that are flagged, lack a sigma, or have one that goes round a
/// known ambiguity interval (above a sixteenth of it), are left out; of many, evenly spread ones are taken.
pub fn check_range_sigma<S: Frames<RangeFrame>>(
    stations: &[RepeatedRanges<S>],
    estimator: VarianceEstimator,
) -> Result<SigmaCheck, S::Error> {
    let mut entries = Vec::new();
    for (number, station) in stations.iter().enumerate() {
        let mut values: Vec<(Value, Claimed)> = Vec::new();
        let interval_m = station.interval_m;
        let normal = interval_m.map_or(f64::INFINITY, |interval| NORMAL_SHARE * interval);
        station.each(&mut |frame| {
            if values.is_empty() {
                let thinning = Thinning::new(number, stations.len(), frame.range.as_slice().len());
                values.extend(Value::all(frame, thinning).into_iter().map(|value| (value, Claimed::default())));
            }
            let has_amplitudes = has_amplitudes(frame);
            values.par_iter_mut().with_min_len(VALUES_PER_TASK).for_each(|(value, claimed)| {
                value.add(frame, has_amplitudes, interval_m);
                claimed.add(f64::from(frame.sigma.as_slice()[value.index]), normal);
            });
            Ok(())
        })?;
        entries.extend(values.iter().filter_map(|(value, claimed)| {
            let known = value.over_frames?;
            Entry::new(&known.range, known.amplitude.mean, claimed, estimator)
        }));
    }
    Ok(SigmaCheck::new(entries)?)
}

/// Checks the sigma planes of repeated complex images: real and imaginary parts of all frequencies, of evenly spread pixels
/// where there are many. Each station is one source of frames.
pub fn check_complex_sigma<S: Frames<ComplexFrame>>(
    stations: &[S],
    estimator: VarianceEstimator,
) -> Result<SigmaCheck, S::Error> {
    let mut entries = Vec::new();
    for (number, frames) in stations.iter().enumerate() {
        let mut seen = ComplexValues::default();
        frames.each(&mut |frame| seen.add(frame, |values| Thinning::new(number, stations.len(), values)))?;
        for value in seen.values.iter().flatten().filter(|value| value.trusted) {
            let amplitude = value.real.mean.hypot(value.imaginary.mean);
            let parts = [&value.real, &value.imaginary];
            entries.extend(parts.iter().filter_map(|part| Entry::new(part, amplitude, &value.claimed, estimator)));
        }
    }
    Ok(SigmaCheck::new(entries)?)
}

/// The variance that a value claims, over the frames.
#[derive(Debug, Clone, Copy, Default)]
struct Claimed {
    sum: f64,
    /// Whether a frame had no sigma or one beyond what is normal.
    beyond: bool,
}

impl Claimed {
    fn add(&mut self, sigma: f64, normal: f64) {
        self.sum += sigma * sigma;
        self.beyond |= sigma.is_nan() || sigma >= normal;
    }
}

/// Pixels of repeated complex images, a list for each frequency.
#[derive(Default)]
struct ComplexValues {
    width: usize,
    frames: usize,
    values: Vec<Vec<ComplexValue>>,
}

#[derive(Clone, Copy)]
struct ComplexValue {
    index: usize,
    /// Whether no frame has a flag there.
    trusted: bool,
    real: Running,
    imaginary: Running,
    claimed: Claimed,
}

impl ComplexValues {
    fn add(&mut self, frame: &ComplexFrame, thinning: impl Fn(usize) -> Thinning) -> Result<()> {
        frame.validate()?;
        let (channels, width) = (frame.channels.len(), frame.width());
        if self.frames == 0 {
            let pixels = frame.flags.as_slice().len();
            let (nothing, claimed) = (Running::default(), Claimed::default());
            let value = |index| ComplexValue { index, trusted: true, real: nothing, imaginary: nothing, claimed };
            let values: Vec<ComplexValue> = thinning(2 * channels * pixels).pixels(pixels).map(value).collect();
            (self.width, self.values) = (width, vec![values; channels]);
        }
        if self.values.len() != channels || self.width != width {
            return Err(Error::FramesDiffer { station: String::new(), frame: self.frames });
        }
        self.frames += 1;
        for (channel, values) in frame.channels.iter().zip(&mut self.values) {
            let [real, imaginary, sigma] = [&channel.real, &channel.imaginary, &channel.sigma].map(Raster::as_slice);
            values.par_iter_mut().with_min_len(VALUES_PER_TASK).for_each(|value| {
                value.trusted &= frame.flags.as_slice()[value.index].is_empty();
                value.real.add(f64::from(real[value.index]));
                value.imaginary.add(f64::from(imaginary[value.index]));
                value.claimed.add(f64::from(sigma[value.index]), f64::INFINITY);
            });
        }
        Ok(())
    }
}

/// One repeated value.
#[derive(Debug, Clone, Copy)]
struct Entry {
    amplitude: f64,
    ratio: f64,
    degrees: f64,
}

impl Entry {
    fn new(values: &Running, amplitude: f64, claimed: &Claimed, estimator: VarianceEstimator) -> Option<Self> {
        let repeats = values.repeats(amplitude)?;
        let variance = claimed.sum / repeats.count as f64;
        let ratio = estimator.variance(&repeats) / variance;
        let usable = variance > 0.0 && ratio.is_finite() && !claimed.beyond;
        usable.then(|| Self { amplitude, ratio, degrees: estimator.degrees(repeats.count) })
    }
}

impl SigmaCheck {
    fn new(mut entries: Vec<Entry>) -> Result<Self> {
        let (values, needed) = (entries.len(), 60);
        if values < needed {
            return Err(Error::TooFewRepeats { values, needed });
        }
        let mut limits = MovedLimits::default();
        // Sigma may be off as a whole: what moved is told beside the usual ratio.
        let mut ratios: Vec<f64> = entries.iter().map(|entry| entry.ratio).collect();
        let usual = upper_median(&mut ratios).max(1.0);
        entries.retain(|entry| !has_moved(entry.ratio, usual, limits.of(entry.degrees)));
        let moved_share = 1.0 - entries.len() as f64 / values as f64;
        entries.sort_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
        let length = entries.len().div_ceil(BINS).max(1);
        let bins: Vec<SigmaBin> = entries.chunks(length).map(SigmaBin::new).collect();
        let all = bins.iter().map(|bin| bin.degrees).sum::<f64>();
        let ratio = bins.iter().map(|bin| bin.degrees * bin.ratio).sum::<f64>() / all;
        Ok(Self { verdict: verdict(&bins), bins, ratio, moved_share })
    }
}

impl SigmaBin {
    fn new(entries: &[Entry]) -> Self {
        let degrees = entries.iter().map(|entry| entry.degrees).sum::<f64>();
        let squares = entries.iter().map(|entry| entry.degrees * entry.ratio).sum::<f64>();
        let distribution = Distribution::ChiSquared { dof: degrees };
        // One in a thousand over all bins and both sides.
        let tail = 0.5e-3 / BINS as f64;
        Self {
            amplitude: [entries.first(), entries.last()].map(|entry| entry.map_or(f64::NAN, |entry| entry.amplitude)),
            values: entries.len(),
            degrees,
            ratio: squares / degrees,
            limits: [distribution.quantile(tail) / degrees, distribution.upper_quantile(tail) / degrees],
        }
    }
}

fn verdict(bins: &[SigmaBin]) -> SigmaVerdict {
    if bins.iter().all(|bin| (bin.limits[0]..=bin.limits[1]).contains(&bin.ratio)) {
        return SigmaVerdict::True;
    }
    let beyond = |bin: &&SigmaBin| !(bin.limits[0]..=bin.limits[1]).contains(&bin.ratio);
    let small = bins.iter().filter(beyond).any(|bin| bin.ratio > CLOSE[1]);
    let large = bins.iter().filter(beyond).any(|bin| bin.ratio < CLOSE[0]);
    match (small, large) {
        (false, false) => SigmaVerdict::Close,
        (true, false) => SigmaVerdict::TooSmall,
        (false, true) => SigmaVerdict::TooLarge,
        (true, true) => SigmaVerdict::Mixed,
    }
}

impl std::fmt::Display for SigmaVerdict {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::True => "sigma is true at all amplitudes",
            Self::Close => "sigma is true to a tenth",
            Self::TooSmall => "sigma is too small",
            Self::TooLarge => "sigma is too large",
            Self::Mixed => "sigma is too small at some amplitudes and too large at others",
        })
    }
}
