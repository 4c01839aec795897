//! Estimation of random errors from the repeated frames of a survey.

pub(crate) mod document;
pub(crate) mod estimate;
pub(crate) mod frames;
pub(crate) mod summary;

pub use summary::{NoiseBin, NoiseParameter, NoiseStation, NoiseSummary, SharedSummary, SigmaBinSummary};

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::Destination;
use commands::{Inputs, Progress, json, produce, root_of};
use pipeline::survey::{Purpose, open, read_calibration};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use sensor_noise::NoiseFitOptions;

use crate::further_term::{provenance_with, start, write};
use crate::noise::estimate::{Estimate, NoiseTerm};
use crate::noise::frames::Failed;

/// What to estimate random errors from.
#[derive(Debug, Clone)]
pub struct NoiseRequest {
    /// Survey with several frames of each station.
    pub survey: PathBuf,
    /// Calibration that the noise is added to; `None`: the one beside the survey, or else the nominal camera.
    pub calibration: Option<PathBuf>,
    /// How the noise is estimated, and what is refused.
    pub options: NoiseFitOptions,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Estimates the noise of samples, or of ranges where a survey has no samples, and writes calibration, summary and
/// report into the request's output folder. Frames are read one after the other, three to four times.
///
/// # Errors
/// [`Error::Refused`] where the frames do not determine it: then the reason is written, beside an older result where
/// there is one. Every other error leaves what was there.
pub fn estimate_noise(request: &NoiseRequest, progress: &dyn Progress) -> Result<NoiseSummary> {
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| estimate(request, destination, progress))
}

fn estimate(request: &NoiseRequest, destination: &Destination, progress: &dyn Progress) -> Result<NoiseSummary> {
    let clock = Instant::now();
    let (mut calibration, words) = start(&request.survey, request.calibration.as_deref())?;
    let known = read_calibration(&root_of(&request.survey), request.calibration.as_deref())?;
    let survey = open(&request.survey, known, Purpose::of(&[]))?;
    let estimate = Estimate::new(&survey, &request.options, progress).map_err(|failed| match failed {
        Failed::Read(error) => error,
        Failed::Undetermined(error) => Error::estimation("noise", &request.survey)(error),
    })?;
    let mut summary = NoiseSummary::new(request, &words, &estimate);
    summary.seconds = commands::made::seconds_since(clock);
    add_to(&mut calibration, request, &estimate);
    write(destination, Some(&calibration), &json(&summary)?, &document::document(&summary).html())?;
    progress.finish();
    Ok(summary)
}

/// The noise and its parameters take the place of those of the same names.
fn add_to(calibration: &mut Calibration, request: &NoiseRequest, estimate: &Estimate) {
    match estimate.term {
        NoiseTerm::Samples(noise) => calibration.noise = Some(noise),
        NoiseTerm::Ranges(noise) => calibration.range_noise = Some(noise),
    }
    let new = &estimate.parameters;
    calibration.noise_parameters.retain(|known| new.iter().all(|parameter| parameter.name != known.name));
    calibration.noise_parameters.extend(new.iter().cloned());
    let method = format!("noise from {}", request.survey.display());
    let (redundancy, sigma0) = (estimate.fit.redundancy, estimate.fit.sigma0);
    calibration.provenance = provenance_with(&calibration.provenance, &request.survey, &method, redundancy, sigma0);
}
