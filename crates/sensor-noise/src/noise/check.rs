//! Whether the standard deviations that pixels carry are true: against the scatter of repeated frames.

use range_image::ComplexFrame;
use rayon::prelude::*;
use statistics::{Distribution, upper_median};

use super::bins::{MovedLimits, has_moved};
use super::ranges::{NORMAL_SHARE, values_at};
use super::repeats::{Repeats, mean_of};
use super::{RepeatedRanges, VarianceEstimator};
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
/// known ambiguity interval (above a sixteenth of it), are left out.
pub fn check_range_sigma(stations: &[RepeatedRanges<'_>], estimator: VarianceEstimator) -> Result<SigmaCheck> {
    let mut entries = Vec::new();
    for station in stations {
        station.validate()?;
        let count = station.frames.first().map_or(0, |frame| frame.range.as_slice().len());
        let collect = |index: usize| {
            let (ranges, amplitudes) = values_at(station, index)?;
            let sigmas = station.frames.iter().map(|frame| f64::from(frame.sigma.as_slice()[index]));
            let normal = station.interval_m.map_or(f64::INFINITY, |interval| NORMAL_SHARE * interval);
            sigmas
                .clone()
                .all(|sigma| sigma < normal)
                .then(|| Entry::new(&ranges, mean_of(&amplitudes), sigmas, estimator))
                .flatten()
        };
        entries.par_extend((0..count).into_par_iter().filter_map(collect));
    }
    SigmaCheck::new(entries)
}

/// Checks the sigma planes of repeated complex images: real and imaginary parts of all frequencies. Each station is
/// one list of frames.
pub fn check_complex_sigma(stations: &[Vec<ComplexFrame>], estimator: VarianceEstimator) -> Result<SigmaCheck> {
    let mut entries = Vec::new();
    for frames in stations {
        let Some(first) = frames.first() else { continue };
        for (index, frame) in frames.iter().enumerate() {
            frame.validate()?;
            if frame.channels.len() != first.channels.len() || frame.width() != first.width() {
                return Err(Error::FramesDiffer { station: String::new(), frame: index });
            }
        }
        for channel in 0..first.channels.len() {
            let collect = |index: usize| complex_entries(frames, channel, index, estimator);
            entries.par_extend((0..first.flags.as_slice().len()).into_par_iter().flat_map_iter(collect));
        }
    }
    SigmaCheck::new(entries)
}

fn complex_entries(frames: &[ComplexFrame], channel: usize, index: usize, estimator: VarianceEstimator) -> Vec<Entry> {
    let trusted = frames.iter().all(|frame| frame.flags.as_slice()[index].is_empty());
    if !trusted {
        return Vec::new();
    }
    let parts = |imaginary: bool| -> Vec<f64> {
        let plane = |frame: &ComplexFrame| {
            let channel = &frame.channels[channel];
            f64::from(if imaginary { &channel.imaginary } else { &channel.real }.as_slice()[index])
        };
        frames.iter().map(plane).collect()
    };
    let [real, imaginary] = [parts(false), parts(true)];
    let amplitude = mean_of(&real).hypot(mean_of(&imaginary));
    let sigmas = || frames.iter().map(|frame| f64::from(frame.channels[channel].sigma.as_slice()[index]));
    [real, imaginary].iter().filter_map(|values| Entry::new(values, amplitude, sigmas(), estimator)).collect()
}

/// One repeated value.
#[derive(Debug, Clone, Copy)]
struct Entry {
    amplitude: f64,
    ratio: f64,
    degrees: f64,
}

impl Entry {
    fn new(
        values: &[f64],
        amplitude: f64,
        sigmas: impl Iterator<Item = f64>,
        estimator: VarianceEstimator,
    ) -> Option<Self> {
        let repeats = Repeats::of(values, amplitude)?;
        let claimed = sigmas.map(|sigma| sigma * sigma).sum::<f64>() / repeats.count as f64;
        let ratio = estimator.variance(&repeats) / claimed;
        let usable = claimed > 0.0 && ratio.is_finite();
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
