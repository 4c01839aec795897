//! Shot and dark noise of raw samples.

use error_models::{NamedParameter, NoiseModel};
use range_image::{RawFrame, Samples};
use rayon::prelude::*;

use super::fit::{LineRules, VarianceFit, fit_variance};
use super::repeats::{AllRepeats, Repeats, Running, Thinning};
use super::steadiness::{self, Alike, Steadiness, VALUES_PER_TASK};
use super::{Frames, NoiseFitOptions, RepeatedSamples, SampleUnits};
use crate::{Error, Result};

/// Noise of samples and how well it is known.
#[derive(Debug, Clone, PartialEq)]
pub struct SampleNoiseEstimate {
    /// The model, as demodulation takes it. Its dark noise contains the quantisation.
    pub noise: NoiseModel,
    /// Standard deviation of the rounding of whole numbers, `raw_scale / √12`; zero for samples that are not whole.
    pub quantisation_sigma: f64,
    /// The straight line of variance over light behind it.
    pub fit: VarianceFit,
    /// Whether samples are differences of two taps, whose light is not known: then there is dark noise alone.
    pub without_light: bool,
}

/// The names of the parts of the noise, slope and level.
const PARTS: [&str; 2] = ["shot noise", "dark noise"];

/// Estimates shot and dark noise from repeated raw frames: the variance of each sample over the frames against its
/// mean (photon transfer, `[Janesick2007]`), `var = shot_variance_per_unit · mean + dark_sigma²`.
///
/// Every sample of every pixel, phase step and frequency counts by itself; its variance has the weight that χ² gives it.
/// Samples that were saturated, or zero and unsigned, in any frame are left out, and so are those that scatter as no
/// noise does. Rounding to whole numbers adds a variance of `raw_scale² / 12`, which is held: the dark noise is not
/// below it. Noise below half a stored unit is not spread over the numbers, and rounding no longer adds to it: what
/// comes out then is refused or misfits.
///
/// Frames are seen one after the other, twice: what is kept are sums of each value. Of more than four million values in all
/// stations those of evenly spread pixels are taken.
///
/// # Errors
/// Too few frames or values; frames unlike each other; a scene that moved, a light that jumped or drifted; light so
/// uniform that shot and dark noise cannot be told apart; variances that follow no straight line.
pub fn estimate_sample_noise<S: Frames<RawFrame>>(
    stations: &[RepeatedSamples<S>],
    units: &SampleUnits,
    options: &NoiseFitOptions,
) -> Result<SampleNoiseEstimate, S::Error> {
    options.validate()?;
    if !(units.raw_scale.is_finite() && units.raw_scale > 0.0) {
        let expected = "a positive scale";
        return Err(Error::OutOfDomain { name: "raw_scale", value: units.raw_scale, expected }.into());
    }
    let (mut observed, mut repeats) = (Vec::with_capacity(stations.len()), AllRepeats::default());
    for (number, station) in stations.iter().enumerate() {
        let (one, own) = Observed::new(station, |values| Thinning::new(number, stations.len(), values), units)?;
        repeats.add(&station.station, station.frames.count(), own.iter().filter_map(Value::repeats));
        observed.push(one);
    }
    let every = observed.iter().map(|station| station.every).max().unwrap_or(1);
    let whole = observed.iter().any(|station| station.whole);
    let without_light = observed.iter().any(|station| station.without_light);
    let quantisation_sigma = if whole { units.raw_scale / 12.0_f64.sqrt() } else { 0.0 };
    let least = [0.0, quantisation_sigma * quantisation_sigma];
    let rules = LineRules { least, sloped: !without_light, parts: PARTS, largest_variance: f64::INFINITY, every };
    let mut fit = fit_variance(repeats, &rules, options)?;
    let frames = fit.steadiness.iter().map(|station| station.frames).sum();
    for ((station, own), steadiness) in stations.iter().zip(&observed).zip(&mut fit.steadiness) {
        own.compare_frames(station, units, [fit.slope, fit.level], steadiness)?;
        steadiness.require_alike(options, frames)?;
    }
    let noise = NoiseModel { shot_variance_per_unit: fit.slope, dark_sigma: fit.level.sqrt() };
    Ok(SampleNoiseEstimate { noise, quantisation_sigma, fit, without_light })
}

impl SampleNoiseEstimate {
    /// Value and deviation of `shot_variance_per_unit`, `dark_sigma` and `quantisation_sigma`, as a calibration's file
    /// keeps them. The deviation of a dark noise near zero is at most the root of that of its variance.
    pub fn parameters(&self) -> Vec<NamedParameter> {
        let [shot_held, dark_held] = self.fit.held;
        let sigma = |index: usize| self.fit.covariance[index][index].sqrt();
        let dark = self.noise.dark_sigma;
        let dark_deviation = (0.5 * sigma(1) / dark).min(sigma(1).sqrt());
        vec![
            steadiness::parameter("shot_variance_per_unit", self.fit.slope, sigma(0), "amplitude", shot_held),
            steadiness::parameter("dark_sigma", dark, dark_deviation, "amplitude", dark_held),
            steadiness::parameter("quantisation_sigma", self.quantisation_sigma, 0.0, "amplitude", true),
        ]
    }
}

/// A sample over the frames; `None` once it was clipped or no number.
struct Value {
    index: usize,
    pixel: usize,
    over_frames: Option<Running>,
}

impl Value {
    fn repeats(&self) -> Option<Repeats> {
        let running = self.over_frames?;
        let mut repeats = running.repeats(running.mean)?;
        repeats.pixel = self.pixel;
        repeats.regressor_variance = repeats.variance / repeats.count as f64;
        Some(repeats)
    }
}

/// Samples of a station that are usable in every frame.
#[derive(Default)]
struct Observed {
    /// Position of each, its mean and its variance.
    values: Vec<(usize, f64, f64)>,
    /// Of so many pixels one is taken.
    every: usize,
    /// Whether samples are whole numbers, and whether they are differences of two taps.
    whole: bool,
    without_light: bool,
}

impl Observed {
    fn new<S: Frames<RawFrame>>(
        station: &RepeatedSamples<S>,
        thinning: impl Fn(usize) -> Thinning,
        units: &SampleUnits,
    ) -> Result<(Self, Vec<Value>), S::Error> {
        let (mut all, mut own) = (Self::default(), Vec::new());
        station.each(&mut |frame| {
            if own.is_empty() {
                let thinning = thinning(frame.samples().len());
                (all.every, own) = (thinning.stride, values(frame, thinning));
            }
            all.whole |= !matches!(frame.samples(), Samples::F32(_));
            all.without_light |= matches!(frame.samples(), Samples::I16(_));
            own.par_iter_mut().with_min_len(VALUES_PER_TASK).for_each(|value| {
                match (&mut value.over_frames, usable(frame, units, value.index)) {
                    (Some(running), Some(sample)) => running.add(sample),
                    (over_frames, _) => *over_frames = None,
                }
            });
            Ok(())
        })?;
        own.retain(|value| value.over_frames.is_some());
        all.values.reserve_exact(own.len());
        all.values.extend(own.iter().filter_map(|value| {
            let repeats = value.repeats()?;
            Some((value.index, repeats.regressor, repeats.variance))
        }));
        Ok((all, own))
    }

    /// Scatter of each frame over what noise with this line explains, for `steadiness`.
    fn compare_frames<S: Frames<RawFrame>>(
        &self,
        station: &RepeatedSamples<S>,
        units: &SampleUnits,
        line: [f64; 2],
        steadiness: &mut Steadiness,
    ) -> Result<(), S::Error> {
        let frames = station.frames.count();
        let expected = |(_, mean, variance): &(usize, f64, f64)| Some([*mean, *variance, line[0] * mean + line[1]]);
        let alike = Alike::new(frames, self.values.iter().map(expected));
        steadiness.frame_values = alike.values();
        station.each(&mut |frame| {
            let value = |place: usize| usable(frame, units, self.values[place].0).unwrap_or(f64::NAN);
            steadiness.frame_factors.push(alike.factor(value));
            Ok(())
        })
    }
}

/// Those of the samples of a frame that are taken.
fn values(frame: &RawFrame, thinning: Thinning) -> Vec<Value> {
    let pixels = (frame.width() * frame.height()).max(1);
    let plane = |plane: usize| {
        let value = move |(pixel, place)| {
            let over_frames = Some(Running::default());
            Value { index: plane * pixels + place, pixel, over_frames }
        };
        thinning.pixels(pixels).enumerate().map(value)
    };
    (0..frame.samples().len() / pixels).flat_map(plane).collect()
}

/// A sample in sample units; `None` where it was clipped or is no number.
fn usable(frame: &RawFrame, units: &SampleUnits, index: usize) -> Option<f64> {
    let (raw, lowest, highest) = stored(frame, index);
    let highest = units.saturation.map_or(highest, |saturation| saturation.min(highest));
    (raw.is_finite() && raw > lowest && raw < highest).then_some(raw * units.raw_scale)
}

/// A stored sample, and the ends of its type, at which numbers are clipped.
fn stored(frame: &RawFrame, index: usize) -> (f64, f64, f64) {
    match frame.samples() {
        Samples::F32(values) => (f64::from(values[index]), f64::NEG_INFINITY, f64::INFINITY),
        Samples::U16(values) => (f64::from(values[index]), 0.0, f64::from(u16::MAX)),
        Samples::I16(values) => (f64::from(values[index]), f64::from(i16::MIN), f64::from(i16::MAX)),
    }
}
