//! Noise of ranges as a function of the amplitude, for cameras that deliver no samples.

use error_models::{AmplitudeScale, NamedParameter, RangeNoise};
use range_image::RangeFrame;
use rayon::prelude::*;

use super::fit::{LineRules, VarianceFit, fit_variance};
use super::neighbours::shared_noise;
use super::repeats::{AllRepeats, Repeats, Running, Thinning};
use super::steadiness::{Alike, Steadiness, VALUES_PER_TASK};
use super::{Frames, NoiseFitOptions, RepeatedRanges, steadiness};
use crate::{Error, Result};

/// Noise of ranges and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct RangeNoiseEstimate {
    /// The model.
    pub noise: RangeNoise,
    /// The straight line of variance over `1 / a²` behind it: its slope is s², its level the squared floor.
    pub fit: VarianceFit,
    /// Standard deviation of the share that neighbouring pixels have in common; `None` where there is none.
    pub shared_sigma: Option<f64>,
}

/// The names of the parts of the noise, slope and level.
const PARTS: [&str; 2] = ["noise that falls with the amplitude", "floor"];

/// Estimates `σ² = (s / a)² + floor²` from repeated range frames: the variance of each pixel over the frames against
/// its mean received amplitude a, in the way of [`estimate_sample_noise`](super::estimate_sample_noise).
///
/// Whether the camera shows its amplitude as received, or times the squared range, is tried: the second is taken where
/// the variances follow it clearly better. `wrapped` ranges cannot tell and are taken as received. Of cameras that show no
/// amplitude one over the squared range stands for it.
///
/// Pixels without a range or a positive amplitude in any frame, and flagged ones, are left out. Where the ambiguity
/// interval U is known (else the largest range stands for it), so are pixels whose ranges are expected to scatter by more
/// than U / 16: their phases are no longer normal, and what was lost altogether says nothing of noise.
/// So are pixels whose frames leave `1 / a²` uncertain by more than a tenth.
///
/// What neighbouring pixels have in common is told by the correlation of the differences of successive frames, where it is more
/// than chance (one in a thousand).
///
/// Frames are seen one after the other, up to four times. Of more than four million pixels in all stations evenly spread
/// ones are taken.
///
/// # Errors
/// [`Error::NoAmplitudes`] of some stations alone, or of wrapped ranges, too few frames or values, a scene that moved, and noise that does not follow the model.
pub fn estimate_range_noise<S: Frames<RangeFrame>>(
    stations: &[RepeatedRanges<S>],
    wrapped: bool,
    options: &NoiseFitOptions,
) -> Result<RangeNoiseEstimate, S::Error> {
    let mut estimate = by_amplitude(stations, wrapped, options)?;
    if let Some((shared, sigma)) = shared_noise(stations, &estimate.noise)? {
        (estimate.noise.shared, estimate.shared_sigma) = (Some(shared), Some(sigma));
    }
    Ok(estimate)
}

/// The noise by the scale of the amplitude that suits it.
fn by_amplitude<S: Frames<RangeFrame>>(
    stations: &[RepeatedRanges<S>],
    wrapped: bool,
    options: &NoiseFitOptions,
) -> Result<RangeNoiseEstimate, S::Error> {
    options.validate()?;
    let mut observed = Vec::with_capacity(stations.len());
    for (number, station) in stations.iter().enumerate() {
        observed.push(Observed::new(station, |pixels| Thinning::new(number, stations.len(), pixels))?);
    }
    let fit = |scale| fit_as(stations, &observed, scale, options);
    if let Some(without) = observed.iter().position(|one| one.with_amplitudes < one.frames) {
        if wrapped || observed.iter().any(|one| one.with_amplitudes > 0) {
            return Err(Error::NoAmplitudes { station: stations[without].station.clone() }.into());
        }
        return Ok(fit(AmplitudeScale::InverseSquaredRange)??);
    }
    let received = fit(AmplitudeScale::AsReceived)?;
    // Light that does not vary is no reason to look for a scale in which it does.
    let another = match &received {
        Ok(_) => true,
        Err(error) => {
            matches!(error, Error::NoiseDoesNotFit { .. } | Error::SceneMoved { .. } | Error::NegativeVariance { .. })
        }
    };
    if wrapped || !another {
        return Ok(received?);
    }
    match (received, fit(AmplitudeScale::TimesSquaredRange)?) {
        (Err(_), Ok(scaled)) => Ok(scaled),
        (Ok(plain), Ok(scaled)) if scaled.fit.misfit < CLEARLY_BETTER * plain.fit.misfit => Ok(scaled),
        (received, _) => Ok(received?),
    }
}

/// Another scale of the amplitude is taken where it leaves less than this share of the misfit.
const CLEARLY_BETTER: f64 = 0.7;

/// Pixels whose own frames leave `1 / a²` more uncertain than by this share say little of the slope, and flatten it.
const MOST_UNCERTAIN: f64 = 0.1;

/// Ranges that scatter by more than this share of the ambiguity interval (0.4 rad of phase) are no longer normal.
pub(super) const NORMAL_SHARE: f64 = 1.0 / 16.0;

/// The noise by one scale; its error where the frames do not determine it, beside those of reading them.
fn fit_as<S: Frames<RangeFrame>>(
    stations: &[RepeatedRanges<S>],
    observed: &[Observed],
    scale: AmplitudeScale,
    options: &NoiseFitOptions,
) -> Result<Result<RangeNoiseEstimate>, S::Error> {
    let mut repeats = AllRepeats::default();
    for (station, own) in stations.iter().zip(observed) {
        repeats.add(&station.station, station.frames.count(), own.repeats(scale));
    }
    let known = stations.iter().filter_map(|station| station.interval_m).fold(f64::INFINITY, f64::min);
    // An interval that nobody states holds at least the ranges that were seen.
    let largest = || observed.iter().map(|own| own.largest_range_m).fold(0.0, f64::max);
    let interval = if known.is_finite() { known } else { largest() };
    let largest_variance = (NORMAL_SHARE * interval).powi(2);
    let every = observed.iter().map(|own| own.every).max().unwrap_or(1);
    let rules = LineRules { least: [0.0; 2], sloped: true, parts: PARTS, largest_variance, every };
    let mut fit = match fit_variance(repeats, &rules, options) {
        Ok(fit) => fit,
        Err(error) => return Ok(Err(error)),
    };
    let variance = |amplitude: f64, range_m: f64| {
        let variance = fit.slope * scale.received(amplitude, range_m).powi(-2) + fit.level;
        (variance < largest_variance).then_some(variance)
    };
    let frames = fit.steadiness.iter().map(|station| station.frames).sum();
    for ((station, own), steadiness) in stations.iter().zip(observed).zip(&mut fit.steadiness) {
        own.compare_frames(station, variance, steadiness)?;
        if let Err(error) = steadiness.require_alike(options, frames) {
            return Ok(Err(error));
        }
    }
    let noise = RangeNoise {
        sigma_times_amplitude_m: fit.slope.sqrt(),
        floor_m: fit.level.sqrt(),
        amplitude_scale: scale,
        shared: None,
    };
    Ok(noise.validate().map_err(Error::from).map(|()| RangeNoiseEstimate { noise, fit, shared_sigma: None }))
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

/// Whether a frame has an amplitude anywhere.
pub(super) fn has_amplitudes(frame: &RangeFrame) -> bool {
    frame.amplitude.as_slice().iter().any(|amplitude| *amplitude > 0.0)
}

/// A pixel over the frames.
#[derive(Clone, Copy)]
pub(super) struct Value {
    pub(super) index: usize,
    /// Its number among those that were taken.
    pixel: usize,
    /// Its first range, metre, beside which the others are taken.
    first_m: f64,
    /// `None` once a frame had no range, no amplitude or a flag there.
    pub(super) over_frames: Option<OverFrames>,
}

#[derive(Clone, Copy, Default)]
pub(super) struct OverFrames {
    pub(super) range: Running,
    pub(super) amplitude: Running,
}

impl Value {
    /// Those of the pixels of a frame that are taken.
    pub(super) fn all(frame: &RangeFrame, thinning: Thinning) -> Vec<Self> {
        let value = |(pixel, index)| {
            let first_m = f64::from(frame.range.as_slice()[index]);
            Self { index, pixel, first_m, over_frames: Some(OverFrames::default()) }
        };
        thinning.pixels(frame.range.as_slice().len()).enumerate().map(value).collect()
    }

    /// Takes the pixel of a frame, with one over its squared range for an amplitude where the frame has none at all.
    pub(super) fn add(&mut self, frame: &RangeFrame, has_amplitudes: bool, interval_m: Option<f64>) {
        let range = frame.range.as_slice()[self.index];
        let amplitude = if has_amplitudes { frame.amplitude.as_slice()[self.index] } else { (range * range).recip() };
        let usable = range.is_finite() && amplitude > 0.0 && frame.flags.as_slice()[self.index].is_empty();
        match &mut self.over_frames {
            Some(over_frames) if usable => {
                over_frames.range.add(beside(f64::from(range), self.first_m, interval_m));
                over_frames.amplitude.add(f64::from(amplitude));
            }
            over_frames => *over_frames = None,
        }
    }
}

/// What is kept of a pixel that is usable in every frame.
struct Kept {
    index: usize,
    first_m: f64,
    /// Of its ranges; in the place of the regressor their mean.
    range: Repeats,
    /// Mean and variance.
    amplitude: [f64; 2],
}

impl Kept {
    fn new(value: &Value) -> Option<Self> {
        let OverFrames { range, amplitude } = value.over_frames?;
        let range = Repeats { pixel: value.pixel, ..range.repeats(range.mean)? };
        let amplitude = [amplitude.mean, amplitude.repeats(0.0)?.variance];
        Some(Self { index: value.index, first_m: value.first_m, range, amplitude })
    }

    /// By what its amplitude is; `None` where its frames do not tell that.
    fn repeats(&self, scale: AmplitudeScale) -> Option<Repeats> {
        let [amplitude, variance] = self.amplitude;
        let regressor = scale.received(amplitude, self.range.regressor).powi(-2);
        // d(a⁻²) = −2 a⁻³ da
        let regressor_variance = (2.0 * regressor / amplitude).powi(2) * variance / self.range.count as f64;
        let is_known = regressor_variance < (MOST_UNCERTAIN * regressor).powi(2);
        is_known.then_some(Repeats { regressor, regressor_variance, ..self.range })
    }
}

/// Pixels of a station that are usable in every frame.
#[derive(Default)]
struct Observed {
    values: Vec<Kept>,
    /// Of so many pixels one is taken.
    every: usize,
    largest_range_m: f64,
    /// Frames with amplitudes, and all.
    with_amplitudes: usize,
    frames: usize,
}

impl Observed {
    fn new<S: Frames<RangeFrame>>(
        station: &RepeatedRanges<S>,
        thinning: impl Fn(usize) -> Thinning,
    ) -> Result<Self, S::Error> {
        let (mut all, mut own) = (Self::default(), Vec::new());
        let interval_m = station.interval_m;
        station.each(&mut |frame| {
            if own.is_empty() {
                let thinning = thinning(frame.range.as_slice().len());
                (all.every, own) = (thinning.stride, Value::all(frame, thinning));
            }
            let has_amplitudes = has_amplitudes(frame);
            (all.frames, all.with_amplitudes) = (all.frames + 1, all.with_amplitudes + usize::from(has_amplitudes));
            let known = frame.range.as_slice().iter().filter(|range| range.is_finite());
            all.largest_range_m = all.largest_range_m.max(f64::from(known.fold(0.0_f32, |a, b| a.max(*b))));
            let values = own.par_iter_mut().with_min_len(VALUES_PER_TASK);
            values.for_each(|value| value.add(frame, has_amplitudes, interval_m));
            Ok(())
        })?;
        own.retain(|value| value.over_frames.is_some());
        all.values.reserve_exact(own.len());
        all.values.extend(own.iter().filter_map(Kept::new));
        Ok(all)
    }

    fn repeats(&self, scale: AmplitudeScale) -> impl Iterator<Item = Repeats> {
        self.values.iter().filter_map(move |value| value.repeats(scale))
    }

    /// Scatter of each frame over what noise explains, which gives a pixel of this amplitude and range a variance, for `steadiness`.
    fn compare_frames<S: Frames<RangeFrame>>(
        &self,
        station: &RepeatedRanges<S>,
        variance: impl Fn(f64, f64) -> Option<f64>,
        steadiness: &mut Steadiness,
    ) -> Result<(), S::Error> {
        let frames = station.frames.count();
        let expected = |value: &Kept| {
            let (range_m, own) = (value.range.regressor, value.range.variance);
            Some([range_m, own, variance(value.amplitude[0], range_m)?])
        };
        let alike = Alike::new(frames, self.values.iter().map(expected));
        let interval_m = station.interval_m;
        steadiness.frame_values = alike.values();
        station.each(&mut |frame| {
            let ranges = frame.range.as_slice();
            steadiness.frame_factors.push(alike.factor(|place| {
                let value = &self.values[place];
                beside(f64::from(ranges[value.index]), value.first_m, interval_m)
            }));
            Ok(())
        })
    }
}

/// The range that differs from the first one of its pixel by less than half an ambiguity interval, metre.
pub(super) fn beside(range_m: f64, first_m: f64, interval_m: Option<f64>) -> f64 {
    interval_m.map_or(range_m, |interval| range_m - ((range_m - first_m) / interval).round() * interval)
}
