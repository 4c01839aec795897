//! The views of a survey by station, and what they tell of noise at their level.

use error_models::{NamedParameter, RangeNoise};
use pipeline::run::Processed;
use pipeline::survey::{View, ViewData};
use pipeline::{Error, Result};
use range_image::{ComplexFrame, DemodulationOptions, Flags, NoiseModel, RangeFrame, Raster, RawFrame, demodulate};
use range_io::survey::Survey;
use sensor_noise::{
    NoiseFitOptions, RepeatedRanges, RepeatedSamples, SampleUnits, SigmaCheck, VarianceFit, check_complex_sigma,
    check_range_sigma, estimate_range_noise, estimate_sample_noise,
};

/// Noise of whatever the survey has.
pub(crate) struct Estimate {
    pub(crate) term: NoiseTerm,
    pub(crate) parameters: Vec<NamedParameter>,
    pub(crate) fit: VarianceFit,
    pub(crate) check: SigmaCheck,
}

/// Noise of samples or of ranges.
#[derive(Debug, Clone, Copy)]
pub(crate) enum NoiseTerm {
    Samples(NoiseModel),
    Ranges(RangeNoise),
}

/// What the frames themselves do not determine is no failure of the run.
type Answer = std::result::Result<Estimate, sensor_noise::Error>;

impl Estimate {
    /// From samples where there are any; else from ranges, or from phases as ranges.
    pub(crate) fn new(outcome: &Processed, options: &NoiseFitOptions) -> Result<Answer> {
        let stations = by_station(&outcome.views);
        let samples: Vec<(String, Vec<&RawFrame>)> = select(&stations, |data| match data {
            ViewData::Samples(raw) => Some(raw),
            _ => None,
        });
        if !samples.is_empty() {
            return Ok(Self::of_samples(&samples, &outcome.survey, options));
        }
        let mut ranges = Vec::new();
        for (station, views) in &stations {
            let frames: Vec<RangeFrame> = views.iter().map(|view| range_frame(view)).collect::<Result<_>>()?;
            ranges.push((station.clone(), frames));
        }
        let first = outcome.views.first();
        let wrapped = first.and_then(View::wrapped_to).is_some();
        // Several frequencies make ranges that repeat with none of their intervals.
        let single = first.filter(|view| view.modulations.len() == 1).and_then(|view| view.modulation);
        let interval_m = single.map(|modulation| modulation.ambiguity_interval_m());
        Ok(Self::of_ranges(ranges, interval_m, wrapped, options))
    }

    fn of_samples(stations: &[(String, Vec<&RawFrame>)], survey: &Survey, options: &NoiseFitOptions) -> Answer {
        let camera = &survey.camera;
        let units = SampleUnits { raw_scale: camera.raw_scale, saturation: camera.saturation };
        let repeated: Vec<RepeatedSamples<'_>> = stations
            .iter()
            .map(|(station, frames)| RepeatedSamples { station: station.clone(), frames: frames.clone() })
            .collect();
        let estimate = estimate_sample_noise(&repeated, &units, options)?;
        let demodulation = DemodulationOptions {
            noise: estimate.noise,
            low_amplitude: None,
            phase_sense: camera.phase_sense,
            phase_offset_rad: camera.phase_offset_rad,
            raw_scale: camera.raw_scale,
            saturation: camera.saturation,
        };
        let mut complex: Vec<Vec<ComplexFrame>> = Vec::new();
        for (_, frames) in stations {
            complex.push(
                frames
                    .iter()
                    .map(|frame| demodulate(frame, &demodulation))
                    .collect::<std::result::Result<_, range_image::Error>>()?,
            );
        }
        let check = check_complex_sigma(&complex, estimate.fit.estimator)?;
        let parameters = estimate.parameters();
        Ok(Self { term: NoiseTerm::Samples(estimate.noise), parameters, fit: estimate.fit, check })
    }

    fn of_ranges(
        mut stations: Vec<(String, Vec<RangeFrame>)>,
        interval_m: Option<f64>,
        wrapped: bool,
        options: &NoiseFitOptions,
    ) -> Answer {
        let estimate = estimate_range_noise(&repeated(&stations, interval_m), wrapped, options)?;
        for frame in stations.iter_mut().flat_map(|(_, frames)| frames) {
            estimate.noise.predict_sigma(frame)?;
        }
        let check = check_range_sigma(&repeated(&stations, interval_m), estimate.fit.estimator)?;
        let parameters = estimate.parameters();
        Ok(Self { term: NoiseTerm::Ranges(estimate.noise), parameters, fit: estimate.fit, check })
    }
}

fn repeated(stations: &[(String, Vec<RangeFrame>)], interval_m: Option<f64>) -> Vec<RepeatedRanges<'_>> {
    stations
        .iter()
        .map(|(station, frames)| RepeatedRanges {
            station: station.clone(),
            frames: frames.iter().collect(),
            interval_m,
        })
        .collect()
}

/// Views by station, in the order of the survey.
fn by_station(views: &[View]) -> Vec<(String, Vec<&View>)> {
    let mut out: Vec<(String, Vec<&View>)> = Vec::new();
    for view in views {
        match out.iter_mut().find(|(station, _)| *station == view.station) {
            Some((_, own)) => own.push(view),
            None => out.push((view.station.clone(), vec![view])),
        }
    }
    out
}

/// The frames of one level of each station; empty where there are none.
fn select<'a, F>(
    stations: &[(String, Vec<&'a View>)],
    of: impl Fn(&'a ViewData) -> Option<&'a F>,
) -> Vec<(String, Vec<&'a F>)> {
    let one = |(station, views): &(String, Vec<&'a View>)| {
        let frames: Vec<&'a F> = views.iter().filter_map(|view| of(&view.data)).collect();
        (!frames.is_empty()).then(|| (station.clone(), frames))
    };
    stations.iter().filter_map(one).collect()
}

/// Ranges without a sigma; phases become ranges that are wrapped.
fn range_frame(view: &View) -> Result<RangeFrame> {
    let unknown = |frame: &Raster<Flags>| Raster::filled(frame.width(), frame.height(), f32::NAN);
    match &view.data {
        ViewData::Range(frame) => Ok(RangeFrame { sigma: unknown(&frame.flags), ..frame.clone() }),
        ViewData::Phase(frame) => {
            let ([_], Some(snapshot)) = (frame.channels.as_slice(), view.snapshot()) else {
                let message = "noise from phases is estimated for one frequency; give the samples, or one frequency";
                return Err(Error::unfit("noise", &view.name(), message));
            };
            let (sigma, flags) = (unknown(&frame.flags), frame.flags.clone());
            Ok(RangeFrame { range: snapshot.range, sigma, amplitude: snapshot.amplitude, flags })
        }
        ViewData::Samples(_) => Err(Error::Needs { stage: "noise", needs: "Demodulate" }),
    }
}
