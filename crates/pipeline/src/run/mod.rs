//! One run: survey in, stages in order, results out.

pub(crate) mod correction_maps;
pub(crate) mod document;
pub(crate) mod figures;
pub(crate) mod measure;
pub(crate) mod results;
pub(crate) mod simulate;
pub(crate) mod summary;

pub use results::OwnCloud;
pub use simulate::{Simulated, simulate};
pub use summary::{PairSummary, ReferenceSummary, RegistrationSummary, StationTruth, Summary, TruthSummary};

use std::path::{Path, PathBuf};
use std::time::Instant;

use atomic_output::Destination;
use range_io::calibration::Calibration;

use crate::command::destination::{Inputs, produce, root_of};
use crate::command::progress::Progress;
use crate::command::verdict::Failure;
use crate::plan::{NetworkCalibration, Source};
use crate::survey::load::{load, read_calibration};
use crate::survey::outcome::{Outcome, RefusedStage, StageSummary};
use crate::survey::plausibility;
use crate::survey::view::Snapshot;
use crate::survey::work::Work;
use crate::{Error, Plan, Result, Stage, stages};

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

impl RunRequest {
    /// The folder that paths in the pipeline's file are relative to.
    pub fn base(&self) -> &Path {
        self.plan_path.parent().unwrap_or(Path::new(""))
    }

    /// Everything that is there before the run and that it reads.
    fn inputs(&self) -> Inputs {
        let mut inputs = Inputs::default().path(&self.plan_path).maybe(self.calibration.as_deref());
        inputs = match (&self.survey, &self.plan.source) {
            (Some(folder), _) => inputs.survey(folder),
            (None, Some(Source::Survey { folder })) => inputs.survey(&self.base().join(folder)),
            (None, Some(Source::Simulate(source))) => inputs.path(self.base().join(&source.scene)),
            (None, None) => inputs,
        };
        match &self.plan.calibrate {
            Some(network) if self.calibration.is_none() => inputs.path(self.base().join(&network.network)),
            _ => inputs,
        }
    }

    /// Folders beside the output that the run writes before it, each with what it may not lie over.
    fn check_folders_beside(&self, inputs: &Inputs) -> Result<()> {
        let simulates = self.survey.is_none() && matches!(self.plan.source, Some(Source::Simulate(_)));
        let calibrates = self.calibration.is_none() && self.plan.calibrate.is_some();
        let endings = [(SURVEY, simulates), (NETWORK, calibrates), (CALIBRATION, calibrates)];
        endings
            .into_iter()
            .filter(|(_, is_written)| *is_written)
            .try_for_each(|(ending, _)| inputs.destination(&beside(&self.out, ending)).map(drop))
    }
}

/// Makes the calibration that a pipeline's `calibrate` asks for, for the survey in that folder, and gives its file.
pub type Calibrator<'a> = &'a dyn Fn(&NetworkCalibration, &Path) -> Result<PathBuf>;

/// Runs a pipeline and writes its results into the request's output folder; one that calibrates a network before is
/// refused: see [`run_with`].
///
/// # Errors
/// As [`run_with`].
pub fn run(request: &RunRequest, progress: &dyn Progress) -> Result<Summary> {
    let calibrator = |_: &NetworkCalibration, _: &Path| {
        let message = "the pipeline calibrates a network first, and nothing was given that does".to_owned();
        Err(Error::Request { command: "run", message })
    };
    run_with(request, &calibrator, progress)
}

/// Runs a pipeline and writes its results into the request's output folder.
///
/// Where `Register` or `Adjust` is refused by what the data show, the results of the stages before it are written, each
/// station's cloud in its own frame; the summary has the [refusal](Summary::refusal) and is
/// [`Verdict::Partial`](crate::Verdict::Partial).
///
/// # Errors
/// Where the data refuse an earlier stage, [`Error::Refused`]; then the reason is written, beside an older result where
/// there is one. Every other error leaves what was there.
pub fn run_with(request: &RunRequest, calibrator: Calibrator<'_>, progress: &dyn Progress) -> Result<Summary> {
    if request.plan.stages.is_empty() {
        let message = "`stages` is empty, expected at least one stage".to_owned();
        return Err(Error::Survey { path: request.plan_path.clone(), message });
    }
    let inputs = request.inputs();
    inputs.destination(&request.out)?;
    request.check_folders_beside(&inputs)?;
    produce(&request.out, &inputs, |destination| run_into(destination, request, calibrator, progress))
}

fn run_into(
    destination: &Destination,
    request: &RunRequest,
    calibrator: Calibrator<'_>,
    progress: &dyn Progress,
) -> Result<Summary> {
    let start = Instant::now();
    let survey = find_survey(request, progress)?;
    let calibration = match (&request.calibration, &request.plan.calibrate) {
        (None, Some(network)) => Some(calibrator(network, &survey)?),
        (named, _) => named.clone(),
    };
    let calibration = read_calibration(&root_of(&survey), calibration.as_deref())?;
    let mut work = load(&survey, calibration, &request.plan, None, progress)?;
    for stage in &request.plan.stages {
        match apply(stage, &mut work, progress) {
            // The stations stand, if not in one frame.
            Err(error) if is_registration(stage) && error.failure() == Failure::Refused => {
                work.outcome.refusal = Some(RefusedStage { stage: stage.name(), reason: error.to_string() });
                break;
            }
            done => done?,
        }
    }
    let outcome = work.outcome;
    let mut summary = measure::summarise(&request.plan, &survey, &outcome);
    summary.out = request.out.display().to_string();
    summary.seconds = start.elapsed().as_secs_f64();
    results::write(destination, &outcome, &summary, progress)?;
    progress.finish();
    Ok(summary)
}

fn is_registration(stage: &Stage) -> bool {
    matches!(stage, Stage::Register(_) | Stage::Adjust(_))
}

/// The survey's folder; simulated first where the plan says so.
fn find_survey(request: &RunRequest, progress: &dyn Progress) -> Result<PathBuf> {
    let base = request.base();
    match (&request.survey, &request.plan.source) {
        (Some(folder), _) => Ok(folder.clone()),
        (None, Some(Source::Survey { folder })) => Ok(base.join(folder)),
        (None, Some(Source::Simulate(source))) => {
            let folder = beside(&request.out, SURVEY);
            simulate::simulate(source, base, &folder, progress)?;
            Ok(folder)
        }
        (None, None) => Err(Error::Survey {
            path: request.plan_path.clone(),
            message: "the pipeline names no source: name a survey's folder".to_owned(),
        }),
    }
}

/// Ending of the folder beside the output folder that a survey is simulated into.
const SURVEY: &str = "-survey";
/// Ending of the folder of a network that is simulated before a run.
pub const NETWORK: &str = "-network";
/// Ending of the folder of its calibration.
pub const CALIBRATION: &str = "-calibration";

/// A folder beside the output folder, named after it.
pub fn beside(out: &Path, ending: &str) -> PathBuf {
    let mut name = out.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    out.with_file_name(name)
}

/// Loads a survey and applies a plan's stages, without writing anything.
pub fn process(plan: &Plan, survey: &Path, calibration: Option<&Path>, progress: &dyn Progress) -> Result<Outcome> {
    process_with(plan, survey, read_calibration(&root_of(survey), calibration)?, progress)
}

/// [`process`] with a calibration at hand, and what to call it.
pub fn process_with(
    plan: &Plan,
    survey: &Path,
    calibration: (Option<Calibration>, String),
    progress: &dyn Progress,
) -> Result<Outcome> {
    let mut work = load(survey, calibration, plan, None, progress)?;
    plan.stages.iter().try_for_each(|stage| apply(stage, &mut work, progress))?;
    Ok(work.outcome)
}

/// Applies one stage and records what it did.
fn apply(stage: &Stage, work: &mut Work, progress: &dyn Progress) -> Result<()> {
    progress.begin(stage.name(), work.outcome.views.len());
    let before: Vec<Option<Snapshot>> = work.outcome.views.iter().map(crate::survey::view::View::snapshot).collect();
    let start = Instant::now();
    plausibility::before(stage, &mut work.outcome);
    let findings = stages::apply(stage, work, progress)?;
    plausibility::after(stage, work)?;
    let seconds = start.elapsed().as_secs_f64();
    let record = StageSummary {
        name: stage.name(),
        seconds,
        findings,
        change_median_m: measure::median_change(&before, &work.outcome.views),
        truth: measure::evaluate_all(&work.outcome.views),
    };
    work.outcome.stages.push(record);
    Ok(())
}
