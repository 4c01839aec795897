use std::sync::{Mutex, PoisonError};

use camera_model::Camera;
use phase_unwrap::{
    ImageGeometry, KnownWraps, MultiFrequencyOptions, NoisyOptions, PhaseNoise, SpatialOptions, Unwrapped, Unwrapper,
    combined_interval_m, unwrap_multi_frequency, unwrap_noisy_absolute,
};
use range_image::{ComplexChannel, ComplexFrame, Flags, RangeFrame, Raster};
use statistics::quantile;

use crate::stages::line::Making;
use crate::stages::{Found, ViewStage};
use crate::survey::view::{View, ViewData};
use crate::{Error, Result};
use commands::plan::{UnwrapMethod, UnwrapOptions};

/// Longest range where nothing else bounds it, metre: that of a room.
const FURTHEST_M: f64 = 15.0;

/// Standard deviation, metre, of what the ranges of one frequency carry besides noise when they are unwrapped: range errors
/// are functions of the unwrapped range and are taken off later. Offsets, periodic errors and what light that bounced does
/// to two frequencies differently come to one or two centimetres. Counts that are mistaken for each other differ by tens
/// of centimetres, so that twice or half of it changes no count; but without it, a bright pixel whose frequencies disagree by a
/// centimetre counts as one that no range explains.
const SYSTEMATIC_M: f64 = 0.02;

/// Phases to ranges: by hypotheses where there are several frequencies, spatially and by amplitude where there is one.
pub(crate) struct Unwrap {
    options: UnwrapOptions,
    geometry: ImageGeometry,
    /// Of the last images: as many as there were at the same time.
    unwrappers: Mutex<Vec<Unwrapper>>,
}

impl Unwrap {
    pub(crate) fn new(options: &UnwrapOptions, making: &Making<'_>) -> Self {
        Self {
            options: options.clone(),
            geometry: image_geometry(&making.survey.calibrated_camera.unwrap_or(making.camera)),
            unwrappers: Mutex::default(),
        }
    }

    /// Whole ambiguity intervals of each frequency, and the confidence in them.
    fn wrap_counts(&self, frame: &ComplexFrame, name: &str) -> Result<(Vec<Raster<i32>>, Raster<f32>)> {
        let mask = frame.flags.map(|flags| !flags.contains(Flags::NO_DATA));
        let furthest_m = self.options.maximum_range_m;
        let fail = |error| Error::stage("Unwrap", name)(error);
        if let [channel] = frame.channels.as_slice() {
            let interval = channel.modulation.ambiguity_interval_m();
            let maximum_wraps = (furthest_m.unwrap_or(FURTHEST_M) / interval).floor().max(0.0) as u16;
            let mut sigmas: Vec<f64> = channel.sigma.as_slice().iter().map(|sigma| f64::from(*sigma)).collect();
            let noise = Some(quantile(&mut sigmas, 0.5) as f32).filter(|noise| noise.is_finite());
            let geometry = Some(self.geometry);
            let spatial = SpatialOptions { maximum_wraps, amplitude_noise: noise, geometry, ..Default::default() };
            let unwrapped = match self.options.method {
                UnwrapMethod::Tree => self.by_tree(channel, &mask, spatial),
                method => by_noise(channel, &mask, method, spatial),
            };
            let unwrapped = unwrapped.map_err(fail)?;
            return Ok((vec![unwrapped.wraps], unwrapped.confidence));
        }
        let phases: Vec<_> = frame.channels.iter().map(ComplexChannel::phase).collect();
        let sigmas: Vec<_> = frame.channels.iter().map(sigma_with_systematics).collect();
        let modulations: Vec<_> = frame.channels.iter().map(|channel| channel.modulation).collect();
        let maximum_range_m = match furthest_m {
            Some(maximum_m) => maximum_m,
            None => combined_interval_m(&modulations).map_err(fail)?.min(FURTHEST_M),
        };
        let multi = MultiFrequencyOptions { maximum_range_m: Some(maximum_range_m), ..Default::default() };
        let unwrapped = unwrap_multi_frequency(&phases, &modulations, Some(&sigmas), Some(&mask), &multi);
        let unwrapped = unwrapped.map_err(fail)?;
        Ok((unwrapped.wraps, unwrapped.confidence))
    }

    /// Absolute counts of one frequency. The tree needs no noise.
    fn by_tree(
        &self,
        channel: &ComplexChannel,
        mask: &Raster<bool>,
        spatial: SpatialOptions,
    ) -> std::result::Result<Unwrapped, phase_unwrap::Error> {
        spatial.validate()?;
        let unwrappers = || self.unwrappers.lock().unwrap_or_else(PoisonError::into_inner);
        let mut own = unwrappers().pop().unwrap_or_default();
        own.set_options(spatial);
        let unwrapped = own.unwrap(&channel.phase(), Some(&channel.amplitude()), Some(mask), KnownWraps::Nothing)?;
        unwrappers().push(own);
        Ok(unwrapped)
    }
}

impl ViewStage for Unwrap {
    fn apply(&self, view: &mut View, found: &mut Found) -> Result<()> {
        let name = view.name();
        let ViewData::Phase(frame) = &view.data else {
            return Err(Error::Needs { stage: "Unwrap", needs: "Demodulate" });
        };
        let (wraps, confidence) = self.wrap_counts(frame, &name)?;
        let channels = frame.channels.iter().zip(&wraps);
        let mut channels: Vec<RangeFrame> =
            channels.map(|(channel, wraps)| channel_range(channel, wraps, &frame.flags)).collect();
        for channel in &mut channels {
            for (flags, confidence) in channel.flags.as_mut_slice().iter_mut().zip(confidence.as_slice()) {
                if confidence.is_nan() || f64::from(*confidence) < self.options.minimum_confidence {
                    flags.insert(Flags::UNWRAP_UNSURE);
                }
            }
        }
        found.add("views", 1);
        view.set_channels(channels)
    }
}

/// Absolute counts of one frequency by what filters: that takes each pixel's noise, or its scale from the image where the raw
/// samples say nothing of it.
fn by_noise(
    channel: &ComplexChannel,
    mask: &Raster<bool>,
    method: UnwrapMethod,
    spatial: SpatialOptions,
) -> std::result::Result<Unwrapped, phase_unwrap::Error> {
    let (phase, amplitude, sigma) = (channel.phase(), channel.amplitude(), channel.sigma_phase());
    let known = sigma.as_slice().iter().any(|sigma| sigma.is_finite());
    let noise = if known { PhaseNoise::Sigma(&sigma) } else { PhaseNoise::Amplitude(&amplitude) };
    let options = NoisyOptions { method: method.into(), spatial, ..NoisyOptions::default() };
    Ok(unwrap_noisy_absolute(&phase, &amplitude, noise, Some(mask), &options)?.unwrapped)
}

/// Standard deviation of the phase, radians, by noise and by range errors that are not taken off yet; as it was where the
/// noise is not known.
fn sigma_with_systematics(channel: &ComplexChannel) -> Raster<f32> {
    let systematic = channel.modulation.phase_from_range(SYSTEMATIC_M) as f32;
    channel.sigma_phase().map(|sigma| sigma.hypot(systematic))
}

/// What unwrapping needs to know of the camera, in pixels.
pub(crate) fn image_geometry(camera: &Camera) -> ImageGeometry {
    let format = camera.format;
    let [column, row] = format.pixel_from_image(camera.interior.principal_point_mm);
    // One principal distance serves both directions: pitches differ by less than what the evidence resolves.
    let pitch = f64::midpoint(format.pixel_pitch_mm[0], format.pixel_pitch_mm[1]);
    ImageGeometry {
        principal_distance_px: (camera.interior.principal_distance_mm / pitch) as f32,
        principal_point_px: [column as f32, row as f32],
    }
}

/// The range of one frequency with its wrap counts.
fn channel_range(channel: &ComplexChannel, wraps: &Raster<i32>, flags: &Raster<Flags>) -> RangeFrame {
    let interval = channel.modulation.ambiguity_interval_m();
    let mut range = channel.phase();
    for (value, wraps) in range.as_mut_slice().iter_mut().zip(wraps.as_slice()) {
        let wrapped = channel.modulation.range_from_phase(f64::from(*value));
        *value = (wrapped + f64::from(*wraps) * interval) as f32;
    }
    RangeFrame { range, sigma: channel.sigma_range(), amplitude: channel.amplitude(), flags: flags.clone() }
}
