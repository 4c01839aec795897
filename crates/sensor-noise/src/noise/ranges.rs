//! Noise of ranges as a function of the amplitude, for cameras that deliver no samples.

use error_models::{AmplitudeScale, NamedParameter, RangeNoise};
use range_image::RangeFrame;
use rayon::prelude::*;

use super::fit::{LineRules, VarianceFit, fit_variance};
use super::repeats::{Repeats, mean_of};
use super::{NoiseFitOptions, RepeatedRanges, Steadiness, steadiness};
use crate::{Error, Result};

/// Noise of ranges and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeNoiseEstimate {
    /// The model.
    pub noise: RangeNoise,
    /// The straight line of variance over `1 / a²` behind it: its slope is s², its level the squared floor.
    pub fit: VarianceFit,
}

/// The names of the parts of the noise, slope and level.
const PARTS: [&str; 2] = ["noise that falls with the amplitude", "floor"];

/// Estimates `σ² = (s / a)² + floor²` from repeated range frames: the variance of each pixel over the frames against
/// its mean received amplitude a, in the way of [`estimate_sample_noise`](super::estimate_sample_noise).
///
/// Whether the camera shows its amplitude as received, or times the squared range, is tried: the second is taken where
/// the variances follow it clearly better. `wrapped` ranges cannot tell and are taken as received.
///
/// Pixels without a range or a positive amplitude in any frame, and flagged ones, are left out. Where the ambiguity
/// interval U is known (else the largest range stands for it), so are pixels whose ranges are expected to scatter by more
/// than U / 16: their phases are no longer normal, and what was lost altogether says nothing of noise.
/// So are pixels whose frames leave `1 / a²` uncertain by more than a tenth.
///
/// # Errors
/// [`Error::NoAmplitudes`], too few frames or values, a scene that moved, and noise that does not follow the model.
pub fn estimate_range_noise(
    stations: &[RepeatedRanges<'_>],
    wrapped: bool,
    options: &NoiseFitOptions,
) -> Result<RangeNoiseEstimate> {
    options.validate()?;
    for station in stations {
        station.validate()?;
        let known = |frame: &&RangeFrame| frame.amplitude.as_slice().iter().any(|amplitude| *amplitude > 0.0);
        if !station.frames.iter().all(known) {
            return Err(Error::NoAmplitudes { station: station.station.clone() });
        }
    }
    let received = fit_as(stations, AmplitudeScale::AsReceived, options);
    // Light that does not vary is no reason to look for a scale in which it does.
    let another = match &received {
        Ok(_) => true,
        Err(error) => {
            matches!(error, Error::NoiseDoesNotFit { .. } | Error::SceneMoved { .. } | Error::NegativeVariance { .. })
        }
    };
    if wrapped || !another {
        return received;
    }
    match (received, fit_as(stations, AmplitudeScale::TimesSquaredRange, options)) {
        (Err(_), Ok(scaled)) => Ok(scaled),
        (Ok(plain), Ok(scaled)) if scaled.fit.misfit < CLEARLY_BETTER * plain.fit.misfit => Ok(scaled),
        (received, _) => received,
    }
}

/// Another scale of the amplitude is taken where it leaves less than this share of the misfit.
const CLEARLY_BETTER: f64 = 0.7;

/// Pixels whose own frames leave `1 / a²` more uncertain than by this share say little of the slope, and flatten it.
const MOST_UNCERTAIN: f64 = 0.1;

/// Ranges that scatter by more than this share of the ambiguity interval (0.4 rad of phase) are no longer normal.
pub(super) const NORMAL_SHARE: f64 = 1.0 / 16.0;

fn fit_as(
    stations: &[RepeatedRanges<'_>],
    scale: AmplitudeScale,
    options: &NoiseFitOptions,
) -> Result<RangeNoiseEstimate> {
    let mut observed = Vec::with_capacity(stations.len());
    for station in stations {
        let repeats = repeats_of(station, scale);
        observed.push((Steadiness::new(&station.station, station.frames.len(), &repeats), repeats));
    }
    let known = stations.iter().filter_map(|station| station.interval_m).fold(f64::INFINITY, f64::min);
    // An interval that nobody states holds at least the ranges that were seen.
    let interval = if known.is_finite() { known } else { largest_range(stations) };
    let largest_variance = (NORMAL_SHARE * interval).powi(2);
    let rules = LineRules { least: [0.0; 2], sloped: true, parts: PARTS, largest_variance };
    let mut fit = fit_variance(observed, &rules, options)?;
    for (station, steadiness) in stations.iter().zip(&mut fit.steadiness) {
        steadiness.frame_factors = steadiness::frame_factors(station.frames.len(), pixels(station), |index| {
            let (ranges, amplitudes) = values_at(station, index)?;
            let received = scale.received(mean_of(&amplitudes), mean_of(&ranges));
            let variance = fit.slope * received.powi(-2) + fit.level;
            (variance < largest_variance).then_some((ranges, variance))
        });
        steadiness.require_alike(options)?;
    }
    let noise =
        RangeNoise { sigma_times_amplitude_m: fit.slope.sqrt(), floor_m: fit.level.sqrt(), amplitude_scale: scale };
    noise.validate()?;
    Ok(RangeNoiseEstimate { noise, fit })
}

impl RangeNoiseEstimate {
    /// Value and deviation of `sigma_times_amplitude_m` and `floor_m`, as a calibration's file keeps them. The deviation
    /// of a part near zero is at most the root of that of its variance.
    pub fn parameters(&self) -> Vec<NamedParameter> {
        let part = |name: &str, index: usize, value: f64, unit: &str| {
            let variance = self.fit.covariance[index][index].sqrt();
            let sigma = (0.5 * variance / value).min(variance.sqrt());
            steadiness::parameter(name, value, sigma, unit, self.fit.held[index])
        };
        vec![
            part("sigma_times_amplitude_m", 0, self.noise.sigma_times_amplitude_m, "m*amplitude"),
            part("floor_m", 1, self.noise.floor_m, "m"),
        ]
    }
}

fn largest_range(stations: &[RepeatedRanges<'_>]) -> f64 {
    let frames = stations.iter().flat_map(|station| &station.frames);
    let ranges = frames.flat_map(|frame| frame.range.as_slice()).filter(|range| range.is_finite());
    f64::from(ranges.fold(0.0_f32, |a, b| a.max(*b)))
}

fn pixels(station: &RepeatedRanges<'_>) -> usize {
    station.frames.first().map_or(0, |frame| frame.range.as_slice().len())
}

fn repeats_of(station: &RepeatedRanges<'_>, scale: AmplitudeScale) -> Vec<Repeats> {
    let collect = |index| {
        let (ranges, amplitudes) = values_at(station, index)?;
        let amplitude = Repeats::of(&amplitudes, 0.0)?;
        let mean = mean_of(&amplitudes);
        let regressor = scale.received(mean, mean_of(&ranges)).powi(-2);
        let mut repeats = Repeats::of(&ranges, regressor)?;
        repeats.pixel = index;
        // d(a⁻²) = −2 a⁻³ da
        repeats.regressor_variance = (2.0 * regressor / mean).powi(2) * amplitude.variance / amplitude.count as f64;
        let is_known = repeats.regressor_variance < (MOST_UNCERTAIN * regressor).powi(2);
        is_known.then_some(repeats)
    };
    (0..pixels(station)).into_par_iter().filter_map(collect).collect()
}

/// Ranges and amplitudes of a pixel in all frames; `None` where one of them is missing or flagged.
pub(super) fn values_at(station: &RepeatedRanges<'_>, index: usize) -> Option<(Vec<f64>, Vec<f64>)> {
    let (mut ranges, mut amplitudes) = (Vec::new(), Vec::new());
    for frame in &station.frames {
        let (range, amplitude) = (frame.range.as_slice()[index], frame.amplitude.as_slice()[index]);
        let usable = range.is_finite() && amplitude > 0.0 && frame.flags.as_slice()[index].is_empty();
        if !usable {
            return None;
        }
        ranges.push(f64::from(range));
        amplitudes.push(f64::from(amplitude));
    }
    if let (Some(interval), Some(&first)) = (station.interval_m, ranges.first()) {
        for range in &mut ranges {
            *range -= ((*range - first) / interval).round() * interval;
        }
    }
    Some((ranges, amplitudes))
}
