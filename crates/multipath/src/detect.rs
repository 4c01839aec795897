//! Multipath by the contradiction between frequencies.

use std::f64::consts::{PI, TAU};

use range_image::{ComplexFrame, Flags, Modulation, Raster};
use rayon::prelude::*;

use crate::chi_squared::quantile;
use crate::error::{require_not_negative, require_probability};
use crate::pixel::{MAXIMUM_FREQUENCIES, Pixel, System, USELESS};
use crate::{FrequencyResponse, Result, Systematics};

/// What of the frequencies is compared.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Evidence {
    /// Ranges and ratios of amplitudes.
    #[default]
    RangesAndAmplitudes,
    /// Ranges alone, where the frequency response is not known.
    Ranges,
}

/// When frequencies contradict each other.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(deny_unknown_fields, default))]
pub struct DetectionOptions {
    /// Probability that a pixel with one path is flagged.
    pub false_alarm: f64,
    /// What is compared.
    pub evidence: Evidence,
    /// What calibration leaves over.
    pub systematics: Systematics,
    /// A frequency whose amplitude is smaller, in standard deviations of the complex value, does not take part: the
    /// errors of phase and logarithmic amplitude are normal only well above the noise.
    pub least_snr: f64,
}

impl Default for DetectionOptions {
    /// One false alarm in a thousand, ranges and amplitudes, amplitudes of at least ten standard deviations.
    fn default() -> Self {
        Self { false_alarm: 1e-3, evidence: Evidence::default(), systematics: Systematics::default(), least_snr: 10.0 }
    }
}

/// The test of each pixel.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Detection {
    /// Sum of the squared, weighted differences between the frequencies: chi-squared with [`Self::freedom`] if there is
    /// one path; NaN where there was no test.
    pub statistic: Raster<f32>,
    /// Degrees of freedom of the test; 0 where there was none.
    pub freedom: Raster<u8>,
    /// Pixels tested.
    pub tested: usize,
    /// Pixels found to have more than one path.
    pub flagged: usize,
}

/// The test for given frequencies, made once for many frames.
#[derive(Debug, Clone)]
pub struct Detector {
    system: System,
    options: DetectionOptions,
    /// Largest statistic of one path for each number of degrees of freedom.
    thresholds: [f64; 2 * MAXIMUM_FREQUENCIES],
}

impl Detector {
    /// Needs two to [`MAXIMUM_FREQUENCIES`] different frequencies; see [`detect`].
    pub fn new(modulations: &[Modulation], response: &FrequencyResponse, options: &DetectionOptions) -> Result<Self> {
        require_probability("false_alarm", options.false_alarm)?;
        require_not_negative("least_snr", options.least_snr)?;
        let system = System::new(modulations, response, &options.systematics, 2)?;
        let thresholds = std::array::from_fn(|freedom| quantile(options.false_alarm, freedom));
        Ok(Self { system, options: *options, thresholds })
    }

    /// The largest statistic, for a number of degrees of freedom, that one path explains; infinite where there is none.
    pub fn threshold(&self, freedom: usize) -> f64 {
        self.thresholds.get(freedom).copied().unwrap_or(f64::INFINITY)
    }

    /// Tests a frame and sets [`Flags::MULTIPATH`]; see [`detect`]. Planes of the right size are used again.
    pub fn detect_into(&self, frame: &mut ComplexFrame, range_m: &Raster<f32>, out: &mut Detection) -> Result<()> {
        self.system.require_frame(frame)?;
        frame.flags.require_same_size(range_m, "range")?;
        let (width, height) = (frame.width(), frame.height());
        if frame.flags.require_same_size(&out.statistic, "").is_err() || out.freedom.len() != out.statistic.len() {
            out.statistic = Raster::filled(width, height, f32::NAN);
            out.freedom = Raster::filled(width, height, 0);
        }
        // The flag plane is written while the channels are read.
        let mut flags = std::mem::take(&mut frame.flags);
        let statistics = out.statistic.as_mut_slice().par_chunks_mut(width);
        let freedoms = out.freedom.as_mut_slice().par_chunks_mut(width);
        let rows = flags.as_mut_slice().par_chunks_mut(width).zip(statistics).zip(freedoms).enumerate();
        let counts = rows.map(|(row, ((flags, statistics), freedoms))| {
            let mut counts = [0, 0];
            for (col, ((flags, statistic), freedom)) in flags.iter_mut().zip(statistics).zip(freedoms).enumerate() {
                let index = row * width + col;
                let range = f64::from(range_m.as_slice()[index]);
                (*statistic, *freedom) = self.test(frame, *flags, index, range);
                counts[0] += usize::from(*freedom > 0);
                if f64::from(*statistic) > self.threshold(usize::from(*freedom)) {
                    *flags |= Flags::MULTIPATH;
                    counts[1] += 1;
                }
            }
            counts
        });
        [out.tested, out.flagged] = counts.reduce(|| [0, 0], |a, b| [a[0] + b[0], a[1] + b[1]]);
        frame.flags = flags;
        Ok(())
    }

    /// Statistic and degrees of freedom of a pixel.
    fn test(&self, frame: &ComplexFrame, flags: Flags, index: usize, range_m: f64) -> (f32, u8) {
        if flags.intersects(USELESS | Flags::MIXED_PIXEL) || !range_m.is_finite() {
            return (f32::NAN, 0);
        }
        let pixel = self.system.load(frame, index, self.options.least_snr);
        let differences = pixel.terms().len().saturating_sub(1);
        if differences == 0 {
            return (f32::NAN, 0);
        }
        let systematics = self.system.systematics();
        let ranges = range_differences(&pixel, range_m, systematics);
        let (statistic, freedom) = match self.options.evidence {
            Evidence::Ranges => (ranges, differences),
            Evidence::RangesAndAmplitudes => (ranges + amplitude_differences(&pixel, systematics), 2 * differences),
        };
        // Without noise and floor there is no scale to judge differences by.
        if statistic.is_finite() { (statistic as f32, freedom as u8) } else { (f32::NAN, 0) }
    }
}

/// Weighted squares of the frequencies' ranges about their mean; each range is the one nearest to `range_m`.
fn range_differences(pixel: &Pixel, range_m: f64, systematics: &Systematics) -> f64 {
    scatter(pixel.terms().iter().map(|term| {
        let phase = term.im.atan2(term.re) - term.wavenumber * range_m;
        let wrapped = phase - TAU * ((phase + PI) / TAU).floor();
        let sigma = term.sigma / (term.amplitude() * term.wavenumber);
        (wrapped / term.wavenumber, sigma * sigma + systematics.floor_m * systematics.floor_m)
    }))
}

/// Weighted squares of the logarithms of the amplitudes, contrast taken off, about their mean.
fn amplitude_differences(pixel: &Pixel, systematics: &Systematics) -> f64 {
    scatter(pixel.terms().iter().map(|term| {
        let (amplitude, floor) = (term.amplitude(), systematics.floor_contrast);
        let sigma = term.sigma / amplitude;
        (amplitude.ln(), sigma * sigma + floor * floor)
    }))
}

/// Sum of squared deviations from the weighted mean, of pairs of value and variance.
fn scatter(values: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (mut weights, mut mean, mut squares) = (0.0, 0.0, 0.0);
    for (value, variance) in values {
        // The mean is updated value by value: no difference of large sums.
        let weight = 1.0 / variance;
        let deviation = value - mean;
        let share = weight / (weights + weight);
        squares += weights * share * deviation * deviation;
        mean += share * deviation;
        weights += weight;
    }
    squares
}

/// Tests for each pixel whether one path explains all frequencies, and sets [`Flags::MULTIPATH`] where it does not.
///
/// One path at range `r` gives every frequency that range and amplitudes in the ratio of the `response`; with a second
/// path both differ from frequency to frequency. The statistic is the weighted sum of squared deviations of the ranges,
/// and of the logarithmic amplitudes, from their weighted means. With one path, it is chi-squared with `F - 1` degrees of
/// freedom for either, `F` being the number of usable frequencies.
///
/// - `range_m`: unwrapped range; each frequency's range is the one nearest to it.
/// - The phases must be free of each frequency's own range errors; what is left over is part of the options.
/// - Not tested: pixels flagged as saturated, moved, without data or mixed (two surfaces in one pixel are two paths as
///   well), without a range, without a known sigma, or with fewer than two frequencies of enough amplitude.
///
/// What cannot be seen: light whose detour is much smaller than `U` of the highest frequency changes all ranges alike,
/// and a path of a tenth of a percent drowns in the noise.
pub fn detect(
    frame: &mut ComplexFrame,
    range_m: &Raster<f32>,
    response: &FrequencyResponse,
    options: &DetectionOptions,
) -> Result<Detection> {
    let modulations: Vec<Modulation> = frame.channels.iter().map(|channel| channel.modulation).collect();
    let mut out = Detection::default();
    Detector::new(&modulations, response, options)?.detect_into(frame, range_m, &mut out)?;
    Ok(out)
}
