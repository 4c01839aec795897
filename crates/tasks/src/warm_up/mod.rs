//! Estimation of the drift of a warming camera from the frames of a scene at rest.

pub(crate) mod document;
pub(crate) mod frames;
pub(crate) mod series;
pub(crate) mod summary;

pub use summary::{WarmUpBlock, WarmUpParameter, WarmUpPhase, WarmUpRateTest, WarmUpSummary, WarmUpTest};

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::Destination;
use commands::{Inputs, Progress, json, produce};
use pipeline::{Error, Result};
use range_io::calibration::{CalibratedDrift, Calibration, Correlation};
use warm_up::{ChangeOptions, DriftEstimate, DriftOptions, estimate_drift, estimate_drift_at_rates};

use crate::further_term::{provenance_with, start, write};
pub(crate) use series::Series;

/// What to estimate a drift from.
#[derive(Debug, Clone)]
pub struct WarmUpRequest {
    /// Survey with the frames of one camera and scene at rest, with their times.
    pub survey: PathBuf,
    /// Calibration that the drift is added to; `None`: no calibration is written.
    pub calibration: Option<PathBuf>,
    /// When the camera was switched on, on the clock of the frames' times; `None`: what the survey states, or else the
    /// first frame.
    pub power_on_s: Option<f64>,
    /// What an optical reference in the image is used for.
    pub reference: ReferenceUse,
    /// How the drift is estimated, and what is refused.
    pub options: DriftOptions,
    /// Which pixels tell the change of range.
    pub pixels: ChangeOptions,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// What the pixels that see an optical reference (`reference_path` of the survey) are used for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum ReferenceUse {
    /// Nothing: the drift is that of the scene.
    #[default]
    Ignore,
    /// Their change is subtracted from that of the scene: what is left is the drift that the reference does not take.
    Subtract,
    /// They take the place of the scene.
    Instead,
}

/// Estimates the drift and writes summary, report and, where one is named, the calibration with the drift into the
/// request's output folder. Frames are read one block after the other, twice.
///
/// Ranges are taken as the camera gives them: constant errors do not change them.
///
/// # Errors
/// [`Error::Refused`] where the frames do not determine it: then the reason is written, beside an older result where
/// there is one. Every other error leaves what was there.
pub fn estimate_warm_up(request: &WarmUpRequest, progress: &dyn Progress) -> Result<WarmUpSummary> {
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| estimate(request, destination, progress))
}

fn estimate(request: &WarmUpRequest, destination: &Destination, progress: &dyn Progress) -> Result<WarmUpSummary> {
    let clock = Instant::now();
    let calibration = match &request.calibration {
        Some(named) => Some(start(&request.survey, Some(named))?),
        None => None,
    };
    let (series, estimate) = find(request, progress)?;
    let calibration = calibration.map(|(known, words)| (with_drift(known, request, &estimate), words));
    let mut summary = WarmUpSummary::new(request, &series, &estimate, calibration.as_ref().map(|(_, words)| words));
    summary.seconds = commands::made::seconds_since(clock);
    let drift = document::drift_figure(&summary, &series, &estimate);
    let page = document::document(&summary, Some(drift)).html();
    write(destination, calibration.as_ref().map(|(calibration, _)| calibration), &json(&summary)?, &page)?;
    progress.finish();
    Ok(summary)
}

fn find(request: &WarmUpRequest, progress: &dyn Progress) -> Result<(Series, DriftEstimate)> {
    let series = Series::read(request, progress)?;
    progress.begin("fit drift", 1);
    let estimate = match &series.stated_rates {
        Some(rates) => estimate_drift_at_rates(&series.samples, rates, &request.options),
        None => estimate_drift(&series.samples, &request.options),
    };
    let estimate = estimate.map_err(Error::estimation("warm-up", &request.survey))?;
    progress.advance(1);
    Ok((series, estimate))
}

/// The drift takes the place of what the calibration said of it; a camera without one gets no term.
fn with_drift(mut calibration: Calibration, request: &WarmUpRequest, estimate: &DriftEstimate) -> Calibration {
    let names = estimate.model.parameter_names();
    let matrix = estimate.correlation();
    let rows = (0..names.len()).map(|row| matrix.row(row).iter().copied().collect()).collect();
    calibration.warm_up = (!estimate.model.is_empty()).then(|| CalibratedDrift {
        model: estimate.model.clone(),
        deviations: estimate.deviations(),
        correlation: Some(Correlation { names, matrix: rows }),
    });
    let method = format!("warm-up from {}", request.survey.display());
    let (redundancy, sigma0) = (estimate.redundancy, estimate.sigma0);
    calibration.provenance = provenance_with(&calibration.provenance, &request.survey, &method, redundancy, sigma0);
    calibration
}
