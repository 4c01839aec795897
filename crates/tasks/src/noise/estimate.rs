//! What the repeated frames of a survey tell of noise at their level.

use commands::Progress;
use error_models::{NamedParameter, RangeNoise};
use pipeline::survey::{OpenSurvey, View, ViewData};
use pipeline::{Error, Result};
use range_image::{ComplexFrame, DemodulationOptions, Flags, NoiseModel, RangeFrame, Raster, RawFrame, demodulate};
use sensor_noise::{
    Frames, NoiseFitOptions, RepeatedRanges, RepeatedSamples, SampleUnits, SigmaCheck, VarianceFit,
    check_complex_sigma, check_range_sigma, estimate_range_noise, estimate_sample_noise,
};

use crate::noise::frames::{Failed, Stations};

/// Noise of whatever the survey has.
pub(crate) struct Estimate {
    pub(crate) term: NoiseTerm,
    pub(crate) parameters: Vec<NamedParameter>,
    pub(crate) fit: VarianceFit,
    pub(crate) check: SigmaCheck,
    /// Of the share that neighbouring pixels have in common.
    pub(crate) shared_sigma: Option<f64>,
}

/// Noise of samples or of ranges.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoiseTerm {
    Samples(NoiseModel),
    Ranges(RangeNoise),
}

type Answer = std::result::Result<Estimate, Failed>;

impl Estimate {
    /// From samples where there are any; else from ranges, or from phases as ranges.
    pub(crate) fn new(survey: &OpenSurvey, options: &NoiseFitOptions, progress: &dyn Progress) -> Answer {
        let stations = Stations::new(survey, progress)?;
        let first = survey.view(0)?;
        if matches!(first.data, ViewData::Samples(_)) {
            return Self::of_samples(&stations, options);
        }
        // Several frequencies make ranges that repeat with none of their intervals.
        let single = first.modulation.filter(|_| first.modulations.len() == 1);
        let interval_m = single.map(|modulation| modulation.ambiguity_interval_m());
        Self::of_ranges(&stations, interval_m, first.wrapped_to().is_some(), options)
    }

    fn of_samples(stations: &Stations<'_>, options: &NoiseFitOptions) -> Answer {
        let camera = &stations.survey.survey.camera;
        let units = SampleUnits { raw_scale: camera.raw_scale, saturation: camera.saturation };
        let raw = |view: View| Ok(samples(view)?);
        let repeated = stations.made(&raw).into_iter();
        let repeated: Vec<_> = repeated.map(|(station, frames)| RepeatedSamples { station, frames }).collect();
        let estimate = estimate_sample_noise(&repeated, &units, options)?;
        let demodulation = DemodulationOptions {
            noise: estimate.noise,
            low_amplitude: None,
            phase_sense: camera.phase_sense,
            phase_offset_rad: camera.phase_offset_rad,
            raw_scale: camera.raw_scale,
            saturation: camera.saturation,
        };
        let complex = |view: View| -> std::result::Result<ComplexFrame, Failed> {
            Ok(demodulate(&samples(view)?, &demodulation).map_err(sensor_noise::Error::from)?)
        };
        let complex: Vec<_> = stations.made(&complex).into_iter().map(|(_, frames)| frames).collect();
        let check = check_complex_sigma(&complex, estimate.fit.estimator)?;
        let parameters = estimate.parameters();
        Ok(Self { term: NoiseTerm::Samples(estimate.noise), parameters, fit: estimate.fit, check, shared_sigma: None })
    }

    fn of_ranges(stations: &Stations<'_>, interval_m: Option<f64>, wrapped: bool, options: &NoiseFitOptions) -> Answer {
        let ranges = |view: View| Ok(range_frame(view)?);
        let estimate = estimate_range_noise(&repeated(stations.made(&ranges), interval_m), wrapped, options)?;
        let with_sigma = |view: View| {
            let mut frame = range_frame(view)?;
            estimate.noise.predict_sigma(&mut frame).map_err(sensor_noise::Error::from)?;
            Ok(frame)
        };
        let check = check_range_sigma(&repeated(stations.made(&with_sigma), interval_m), estimate.fit.estimator)?;
        let parameters = estimate.parameters();
        let (term, shared_sigma) = (NoiseTerm::Ranges(estimate.noise), estimate.shared_sigma);
        Ok(Self { term, parameters, fit: estimate.fit, check, shared_sigma })
    }
}

fn repeated<S: Frames<RangeFrame>>(stations: Vec<(String, S)>, interval_m: Option<f64>) -> Vec<RepeatedRanges<S>> {
    let one = |(station, frames)| RepeatedRanges { station, frames, interval_m };
    stations.into_iter().map(one).collect()
}

fn samples(view: View) -> Result<RawFrame> {
    match view.data {
        ViewData::Samples(raw) => Ok(raw),
        _ => Err(Error::unfit("noise", &view.name(), "it has no samples, other frames have")),
    }
}

/// Ranges without a sigma; phases become ranges that are wrapped.
fn range_frame(view: View) -> Result<RangeFrame> {
    let unknown = |frame: &Raster<Flags>| Raster::filled(frame.width(), frame.height(), f32::NAN);
    if let ViewData::Phase(frame) = &view.data {
        let ([_], Some(snapshot)) = (frame.channels.as_slice(), view.snapshot()) else {
            let message = "noise from phases is estimated for one frequency; give the samples, or one frequency";
            return Err(Error::unfit("noise", &view.name(), message));
        };
        let (sigma, flags) = (unknown(&frame.flags), frame.flags.clone());
        return Ok(RangeFrame { range: snapshot.range, sigma, amplitude: snapshot.amplitude, flags });
    }
    match view.data {
        ViewData::Range(frame) => Ok(RangeFrame { sigma: unknown(&frame.flags), ..frame }),
        _ => Err(Error::Needs { stage: "noise", needs: "Demodulate" }),
    }
}
