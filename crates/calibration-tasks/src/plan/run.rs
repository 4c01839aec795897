//! One plan: tables in, expected quality out.

use std::path::PathBuf;

use atomic_output::{Destination, write_text};
use commands::{Inputs, Progress, json, produce};
use pipeline::{Error, Result};
use self_calibration::PlanOptions;

use crate::plan::document::{Figures, document};
use crate::plan::files::read_plan;
use crate::plan::summary::PlanSummary;

/// What to plan.
#[derive(Debug, Clone)]
pub struct NetworkPlanRequest {
    /// Folder with `survey.ron`, `stations.csv` and `targets.csv`.
    pub survey: PathBuf,
    /// Calibration that stands for the camera; `None`: `calibration.ron` beside the survey, or the nominal camera.
    pub calibration: Option<PathBuf>,
    /// Noise, terms, datum, candidates.
    pub options: PlanOptions,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Plans a network and writes `summary.json` and `report.html`.
///
/// # Errors
/// [`Error::Refused`] where the network does not determine the calibration at all: then the diagnosis is written, beside
/// an older result where there is one. Every other error leaves what was there.
pub fn plan_network(request: &NetworkPlanRequest, progress: &dyn Progress) -> Result<PlanSummary> {
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| plan_into(destination, request, progress))
}

fn plan_into(destination: &Destination, request: &NetworkPlanRequest, progress: &dyn Progress) -> Result<PlanSummary> {
    progress.begin("plan network", 2);
    let (network, start) = read_plan(&request.survey, request.calibration.as_deref())?;
    let survey = request.survey.display().to_string();
    let planned = self_calibration::plan(&network, &request.options);
    progress.advance(1);
    let outcome = match planned {
        Ok(outcome) => outcome,
        Err(source) => {
            progress.finish();
            let summary = PlanSummary::refused(survey, start.words, source.to_string(), &request.out);
            return Err(Error::not_calibrated(source, &summary)?);
        }
    };
    let folder = destination.open()?;
    let summary = PlanSummary::new(survey, start.words, &outcome, request);
    write_text(folder.file("summary.json")?, &json(&summary)?)?;
    let page = document(&summary, Figures::new(&network, &outcome)?);
    write_text(folder.file("report.html")?, &page.html())?;
    folder.commit()?;
    progress.advance(2);
    progress.finish();
    Ok(summary)
}
