//! Estimation of internal scattering from two surveys of one scene, with and without bright objects in the foreground.

pub(crate) mod captures;
pub(crate) mod document;
pub(crate) mod shifts;
pub(crate) mod summary;

pub use summary::{CandidateGaussians, ScatteringCapture, ScatteringParameter, ScatteringSummary};

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::Destination;
use commands::{Inputs, Progress, json, produce};
use error_models::{NamedParameter, ParameterStatus};
use pipeline::{Error, Result};
use scattering_deconvolution::{EstimationOptions, estimate_psf};

use crate::further_term::{provenance_with, write};
use crate::scattering::captures::Captures;
pub(crate) use shifts::Shift;

/// What to estimate scattering from.
#[derive(Debug, Clone)]
pub struct ScatteringRequest {
    /// Survey with the objects in the foreground.
    pub with_object: PathBuf,
    /// Survey without them, from the same stations.
    pub without_object: PathBuf,
    /// Calibration that the point spread function is added to; `None`: the one beside the survey without objects, or
    /// else the nominal camera.
    pub calibration: Option<PathBuf>,
    /// How the point spread function is estimated.
    pub options: EstimationOptions,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Estimates the point spread function and writes calibration, summary and report into the request's output folder.
///
/// # Errors
/// [`Error::Refused`] where the captures do not determine it: then the verdict is written, beside an older result where
/// there is one. Every other error leaves what was there.
pub fn estimate_scattering(request: &ScatteringRequest, progress: &dyn Progress) -> Result<ScatteringSummary> {
    let surveys = Inputs::default().survey(&request.with_object).survey(&request.without_object);
    let inputs = surveys.maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| estimate(request, destination, progress))
}

fn estimate(
    request: &ScatteringRequest,
    destination: &Destination,
    progress: &dyn Progress,
) -> Result<ScatteringSummary> {
    let clock = Instant::now();
    let captures = Captures::read(request, progress)?;
    progress.begin("estimate scattering", 2);
    let estimate = estimate_psf(&captures.pairs(), &request.options).map_err(stage)?;
    progress.advance(1);
    let shifts = match &estimate.psf {
        Some(psf) => captures.shifts(psf, &request.options)?,
        None => Vec::new(),
    };
    let mut summary = ScatteringSummary::new(request, &captures, &estimate, &shifts);
    summary.seconds = commands::made::seconds_since(clock);
    progress.advance(2);
    let text = json(&summary)?;
    let Some(psf) = &estimate.psf else {
        progress.finish();
        return Err(Error::Refused { summary: text, source: estimate.verdict.to_string().into(), written: None });
    };
    let mut calibration = captures.calibration;
    calibration.scattering = Some(psf.clone());
    calibration.scattering_parameters = estimate.parameters.iter().map(named).collect();
    let method = format!("scattering from {}", request.with_object.display());
    let (redundancy, sigma0) = (estimate.redundancy, estimate.sigma0);
    calibration.provenance =
        provenance_with(&calibration.provenance, &request.with_object, &method, redundancy, sigma0);
    let page = document::document(&summary, document::pictures(&shifts)?).html();
    write(destination, Some(&calibration), &text, &page)?;
    progress.finish();
    Ok(summary)
}

fn stage(error: scattering_deconvolution::Error) -> Error {
    Error::stage("scattering", "all captures")(error)
}

fn named(parameter: &scattering_deconvolution::PsfParameter) -> NamedParameter {
    NamedParameter {
        name: parameter.name.clone(),
        value: parameter.value,
        sigma: parameter.sigma,
        unit: summary::unit_of(&parameter.name).to_owned(),
        status: if parameter.sigma > 0.0 { ParameterStatus::Estimated } else { ParameterStatus::Held },
    }
}
