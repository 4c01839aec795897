//! One run: survey in, stages in order, results out.

use std::path::{Path, PathBuf};
use std::time::Instant;

use error_models::ModelSet;
use range_io::calibration::Calibration;
use range_io::survey::Survey;
use self_calibration::{CalibrationOptions, TermSelection};

use crate::calibrate::{CalibrateMethod, CalibrateRequest, OffsetModel, TableDefaults, calibrate};
use crate::drift::DriftTreatment;
use crate::load::{load, read_calibration, root_of};
use crate::network_scene::simulate_network;
use crate::outcome::Outcome;
use crate::plan::{NetworkCalibration, Source};
use crate::progress::Progress;
use crate::summary::{StageSummary, Summary};
use crate::view::Snapshot;
use crate::{Error, Plan, Result, measure, plausibility, results, simulate, stages};

/// What to run on what.
#[derive(Debug, Clone)]
pub struct RunRequest {
    /// The stages.
    pub plan: Plan,
    /// Where the plan was read from; its source's paths are relative to it.
    pub plan_path: PathBuf,
    /// Survey folder; `None`: the plan's own source.
    pub survey: Option<PathBuf>,
    /// Calibration file; `None`: `calibration.ron` beside the survey, where there is one.
    pub calibration: Option<PathBuf>,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Runs a pipeline and writes its results into the request's output folder.
pub fn run(request: &RunRequest, progress: &dyn Progress) -> Result<Summary> {
    let start = Instant::now();
    let survey = find_survey(request, progress)?;
    let calibration = match (&request.calibration, &request.plan.calibrate) {
        (None, Some(network)) => Some(estimate_calibration(request, network, &survey, progress)?),
        (named, _) => named.clone(),
    };
    let outcome = process(&request.plan, &survey, calibration.as_deref(), progress)?;
    let mut summary = measure::summarise(&request.plan, &survey, &outcome);
    summary.out = request.out.display().to_string();
    summary.seconds = start.elapsed().as_secs_f64();
    results::write(&request.out, &outcome, &summary, progress)?;
    progress.finish();
    Ok(summary)
}

/// The survey's folder; simulated first where the plan says so.
fn find_survey(request: &RunRequest, progress: &dyn Progress) -> Result<PathBuf> {
    let base = request.plan_path.parent().unwrap_or(Path::new(""));
    match (&request.survey, &request.plan.source) {
        (Some(folder), _) => Ok(folder.clone()),
        (None, Some(Source::Survey { folder })) => Ok(base.join(folder)),
        (None, Some(Source::Simulate(source))) => {
            let folder = beside(&request.out, "-survey");
            simulate::simulate(source, base, &folder, progress)?;
            Ok(folder)
        }
        (None, None) => Err(Error::Survey {
            path: request.plan_path.clone(),
            message: "the pipeline names no source: name a survey's folder".to_owned(),
        }),
    }
}

/// A folder beside the output folder, named after it.
fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    out.with_file_name(name)
}

/// Simulates the network, calibrates it and gives the calibration's file. It starts from the nominal camera; noise,
/// scattering and fixed pattern, which targets do not show, are those of the survey's calibration.
fn estimate_calibration(
    request: &RunRequest,
    network: &NetworkCalibration,
    survey: &Path,
    progress: &dyn Progress,
) -> Result<PathBuf> {
    let base = request.plan_path.parent().unwrap_or(Path::new(""));
    let (folder, out) = (beside(&request.out, "-network"), beside(&request.out, "-calibration"));
    simulate_network(&base.join(&network.network), None, &folder)?;
    let start = folder.join("start.ron");
    nominal_start(&folder, survey)?.write(&start)?;
    let options = CalibrationOptions { terms: TermSelection::List(network.terms.clone()), ..Default::default() };
    calibrate(
        &CalibrateRequest {
            survey: folder,
            lens_survey: None,
            calibration: Some(start),
            method: CalibrateMethod::Network(options.method),
            options,
            offset: OffsetModel::Constant,
            // A network of the warm camera.
            warm_up: DriftTreatment::Leave,
            defaults: TableDefaults::default(),
            out: out.clone(),
        },
        progress,
    )?;
    Ok(out.join(Calibration::FILE_NAME))
}

fn nominal_start(network: &Path, survey: &Path) -> Result<Calibration> {
    let camera = Survey::read(network)?.camera.nominal_camera()?;
    let known = Calibration::read(survey)?;
    let mut start = Calibration::from_models(&camera, &ModelSet::default(), known.scattering.as_ref())?;
    (start.noise, start.range_noise, start.fixed_pattern) = (known.noise, known.range_noise, known.fixed_pattern);
    (start.noise_parameters, start.warm_up) = (known.noise_parameters, known.warm_up);
    Ok(start)
}

/// Loads a survey and applies a plan's stages, without writing anything.
pub fn process(plan: &Plan, survey: &Path, calibration: Option<&Path>, progress: &dyn Progress) -> Result<Outcome> {
    process_with(plan, survey, read_calibration(&root_of(survey), calibration)?, progress)
}

/// [`process`] with a calibration at hand, and what to call it.
pub(crate) fn process_with(
    plan: &Plan,
    survey: &Path,
    calibration: (Option<Calibration>, String),
    progress: &dyn Progress,
) -> Result<Outcome> {
    let mut work = load(survey, calibration, plan, None, progress)?;
    for stage in &plan.stages {
        progress.begin(stage.name(), work.outcome.views.len());
        let before: Vec<Option<Snapshot>> = work.outcome.views.iter().map(crate::view::View::snapshot).collect();
        let start = Instant::now();
        plausibility::before(stage, &mut work.outcome);
        let findings = stages::apply(stage, &mut work, progress)?;
        plausibility::after(stage, &mut work)?;
        let seconds = start.elapsed().as_secs_f64();
        let record = StageSummary {
            name: stage.name(),
            seconds,
            findings,
            change_median_m: measure::median_change(&before, &work.outcome.views),
            truth: measure::evaluate_all(&work.outcome.views),
        };
        work.outcome.stages.push(record);
    }
    Ok(work.outcome)
}
