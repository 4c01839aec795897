//! Shot and dark noise of raw samples.

use error_models::{NamedParameter, NoiseModel};
use range_image::{RawFrame, Samples};
use rayon::prelude::*;

use super::fit::{LineRules, VarianceFit, fit_variance};
use super::repeats::{Repeats, mean_of};
use super::{NoiseFitOptions, RepeatedSamples, SampleUnits, Steadiness};
use crate::noise::steadiness;
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
/// # Errors
/// Too few frames or values; frames unlike each other; a scene that moved, a light that jumped or drifted; light so
/// uniform that shot and dark noise cannot be told apart; variances that follow no straight line.
pub fn estimate_sample_noise(
    stations: &[RepeatedSamples<'_>],
    units: &SampleUnits,
    options: &NoiseFitOptions,
) -> Result<SampleNoiseEstimate> {
    options.validate()?;
    if !(units.raw_scale.is_finite() && units.raw_scale > 0.0) {
        let expected = "a positive scale";
        return Err(Error::OutOfDomain { name: "raw_scale", value: units.raw_scale, expected });
    }
    let (mut whole, mut without_light) = (false, false);
    let mut observed = Vec::with_capacity(stations.len());
    for station in stations {
        station.validate()?;
        for frame in &station.frames {
            whole |= !matches!(frame.samples(), Samples::F32(_));
            without_light |= matches!(frame.samples(), Samples::I16(_));
        }
        let repeats = repeats_of(station, units);
        observed.push((Steadiness::new(&station.station, station.frames.len(), &repeats), repeats));
    }
    let quantisation_sigma = if whole { units.raw_scale / 12.0_f64.sqrt() } else { 0.0 };
    let least = [0.0, quantisation_sigma * quantisation_sigma];
    let rules = LineRules { least, sloped: !without_light, parts: PARTS, largest_variance: f64::INFINITY };
    let mut fit = fit_variance(observed, &rules, options)?;
    for (station, steadiness) in stations.iter().zip(&mut fit.steadiness) {
        steadiness.frame_factors = frame_factors(station, units, [fit.slope, fit.level]);
        steadiness.require_alike(options)?;
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

/// Repeats of all samples that are usable in every frame.
fn repeats_of(station: &RepeatedSamples<'_>, units: &SampleUnits) -> Vec<Repeats> {
    let count = station.frames.first().map_or(0, |frame| frame.samples().len());
    let pixels = station.frames.first().map_or(1, |frame| (frame.width() * frame.height()).max(1));
    let collect = |index| {
        let values = values_at(station, units, index)?;
        let mean = mean_of(&values);
        let mut repeats = Repeats::of(&values, mean)?;
        repeats.pixel = index % pixels;
        repeats.regressor_variance = repeats.variance / repeats.count as f64;
        Some(repeats)
    };
    (0..count).into_par_iter().filter_map(collect).collect()
}

/// Scaled values of one sample in all frames; `None` where one of them was clipped or is no number.
fn values_at(station: &RepeatedSamples<'_>, units: &SampleUnits, index: usize) -> Option<Vec<f64>> {
    let usable = |frame: &RawFrame| {
        let (raw, lowest, highest) = stored(frame, index);
        let highest = units.saturation.map_or(highest, |saturation| saturation.min(highest));
        (raw.is_finite() && raw > lowest && raw < highest).then_some(raw * units.raw_scale)
    };
    station.frames.iter().map(|frame| usable(frame)).collect()
}

/// A stored sample, and the ends of its type, at which numbers are clipped.
fn stored(frame: &RawFrame, index: usize) -> (f64, f64, f64) {
    match frame.samples() {
        Samples::F32(values) => (f64::from(values[index]), f64::NEG_INFINITY, f64::INFINITY),
        Samples::U16(values) => (f64::from(values[index]), 0.0, f64::from(u16::MAX)),
        Samples::I16(values) => (f64::from(values[index]), f64::from(i16::MIN), f64::from(i16::MAX)),
    }
}

/// Mean square deviation of each frame from the mean of all, over what the noise explains; moved samples left out.
fn frame_factors(station: &RepeatedSamples<'_>, units: &SampleUnits, line: [f64; 2]) -> Vec<f64> {
    let count = station.frames.first().map_or(0, |frame| frame.samples().len());
    steadiness::frame_factors(station.frames.len(), count, |index| {
        let values = values_at(station, units, index)?;
        let variance = line[0] * mean_of(&values) + line[1];
        Some((values, variance))
    })
}
