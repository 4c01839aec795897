//! One run: survey in, stages in order, results out.
//!
//! A survey is never in memory as a whole. `stream` takes the frames of one station after the other through the stages; of
//! each view that comes out `clouds` writes the points, `kept` keeps counts, thinned pixels and small pictures, and
//! `stages::joining` the points that registration needs. `tally` gathers what each stage changed. Once all views went
//! through, `flow` joins the stations, `measure` makes the summary of what was kept, and `results` completes the output.

pub(crate) mod document;
pub(crate) mod figures;
pub(crate) mod files;
pub(crate) mod flow;
pub(crate) mod kept;
pub(crate) mod measure;
pub(crate) mod part;
pub(crate) mod stream;
pub(crate) mod summary;
pub(crate) mod tally;

pub use commands::simulate::{Simulated, simulate};
pub use files::clouds::OwnCloud;
pub use part::{PartSummary, merge, run_part};
pub use stream::{Part, follow_station};
pub use summary::{PairSummary, ReferenceSummary, RegistrationSummary, StationTruth, Summary, TruthSummary};

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use atomic_output::{Destination, OutputFolder};
use camera_model::Camera;
use commands::made::without_times;
use commands::memory::keeping;
use range_io::calibration::Calibration;
use range_io::survey::Survey;
use range_io::tables::Station;

use crate::run::document::document;
use crate::run::figures::Figures;
use crate::run::files::clouds::Clouds;
use crate::run::flow::Flow;
use crate::run::kept::Kept;
use crate::run::stream::Before;
use crate::survey::open::{OpenSurvey, read_calibration};
use crate::survey::records::{RefusedStage, StageSummary, StationPose, ViewRecord, common_poses};
use crate::survey::view::View;
use crate::{Error, Plan, Result, Stage};
use commands::Progress;
use commands::plan::{NetworkCalibration, Source};
use commands::{Doubt, Failure};
use commands::{Inputs, produce, root_of};

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

    /// The first stage that brings stations together.
    fn joining(&self) -> Option<&'static str> {
        let joins = |stage: &&Stage| matches!(stage, Stage::Register(_) | Stage::Adjust(_));
        self.plan.stages.iter().find(joins).map(Stage::name)
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
    let mut flow = opened(request, &survey, calibration.as_deref())?;
    let mut kept = Kept::new(&flow.survey, flow.camera(), flow.order.views(), Before::default());
    let folder = destination.open()?;
    let mut clouds = Clouds::new(&folder, &flow.survey, request.joining().is_some(), 0);
    let mut keep = |view: View, survey: &OpenSurvey| {
        clouds.add(&view)?;
        kept.add(&view, survey)
    };
    let bytes = Kept::bytes(&flow.survey, flow.camera(), flow.order.views());
    keeping(bytes, || flow.views(&mut keep, progress))?;
    let (summary, page) = complete(&folder, request, &survey, (flow, kept, clouds), start, progress)?;
    files::results::finish(folder, &summary, &page, progress)?;
    Ok(summary)
}

/// A survey opened for the request's plan.
pub(crate) fn opened(request: &RunRequest, survey: &Path, calibration: Option<&Path>) -> Result<Flow> {
    Flow::new(&request.plan, survey, read_calibration(&root_of(survey), calibration)?)
}

/// Joins the views that went through the stages, and writes what comes of them; summary and page are left to be written.
pub(crate) fn complete(
    folder: &OutputFolder,
    request: &RunRequest,
    survey: &Path,
    (mut flow, mut kept, clouds): (Flow, Kept, Clouds<'_>),
    start: Instant,
    progress: &dyn Progress,
) -> Result<(Summary, String)> {
    let refusal = match flow.join(&request.plan, progress) {
        // The stations stand, if not in one frame.
        Err(error) if error.failure() == Failure::Refused => {
            Some(RefusedStage { stage: flow.joining, reason: error.to_string() })
        }
        Err(error) => return Err(error),
        Ok(()) => None,
    };
    progress.begin("write results", 3);
    let left_out = |view: usize| refusal.is_none() && matches!(flow.joined.poses.get(view), Some(None));
    kept.leave_out(left_out);
    let found: Vec<StationPose> = flow.joined.poses.iter().flatten().cloned().collect();
    let common = if refusal.is_some() { None } else { common_poses(&kept.views, &found) };
    let (own_clouds, tiles) = clouds.finish(common.as_deref(), &left_out)?;
    let mut summary = measure::summarise(&request.plan, survey, &flow, &mut kept, refusal, own_clouds);
    summary.tiles = tiles;
    summary.out = request.out.display().to_string();
    summary.seconds = commands::made::seconds_since(start);
    if without_times() {
        for stage in &mut summary.stages {
            stage.seconds = 0.0;
        }
    }
    if let Some(poses) = &common {
        files::results::write_poses(folder, &kept.views, poses, &summary)?;
        files::common_errors::write(folder, &flow, &request.plan, &kept.views, poses)?;
    }
    progress.advance(1);
    let figures = Figures::new(kept, &found, common.as_deref(), flow.survey.vertical_axis)?;
    let page = document(&summary, figures).html();
    Ok((summary, page))
}

/// The survey's folder; simulated first where the plan says so.
fn find_survey(request: &RunRequest, progress: &dyn Progress) -> Result<PathBuf> {
    let base = request.base();
    match (&request.survey, &request.plan.source) {
        (Some(folder), _) => Ok(folder.clone()),
        (None, Some(Source::Survey { folder })) => Ok(base.join(folder)),
        (None, Some(Source::Simulate(source))) => {
            let folder = beside(&request.out, SURVEY);
            simulate(source, base, &folder, progress)?;
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

/// What a plan makes of a survey, in memory.
#[derive(Debug)]
pub struct Processed {
    /// One view a station, or a frame where frames were not averaged; none where they were handed on.
    pub views: Vec<View>,
    /// What is kept of each view.
    pub records: Vec<ViewRecord>,
    /// What was captured.
    pub survey: Arc<Survey>,
    /// The camera whose rays make the clouds.
    pub camera: Camera,
    /// What `stations.csv` says of the stations.
    pub stated: Vec<Station>,
    /// Index of the world's axis that points up: z where poses came with the survey, y in a camera's own frame.
    pub vertical_axis: usize,
    /// One pose a view, where a stage found them; `None`: the view belongs to no other.
    pub poses: Vec<Option<StationPose>>,
    /// What each stage did.
    pub stages: Vec<StageSummary>,
    /// What speaks against survey and frames.
    pub doubts: Vec<Doubt>,
}

/// Loads a survey and applies a plan's stages, without writing anything. All views are in memory in the end; of surveys
/// that are large [`process_each`] keeps none.
pub fn process(plan: &Plan, survey: &Path, calibration: Option<&Path>, progress: &dyn Progress) -> Result<Processed> {
    let mut views = Vec::new();
    let calibration = read_calibration(&root_of(survey), calibration)?;
    let mut keep = |view: View, _: &OpenSurvey| {
        views.push(view);
        Ok(())
    };
    let processed = process_each(plan, survey, calibration, &mut keep, progress)?;
    Ok(Processed { views, ..processed })
}

/// Applies a plan's stages to a survey, one station after the other, and hands on each view, for a calibration at hand and
/// what to call it.
pub fn process_each(
    plan: &Plan,
    survey: &Path,
    calibration: (Option<Calibration>, String),
    keep: &mut dyn FnMut(View, &OpenSurvey) -> Result<()>,
    progress: &dyn Progress,
) -> Result<Processed> {
    let mut flow = Flow::new(plan, survey, calibration)?;
    let mut records = Vec::new();
    let mut keep = |view: View, survey: &OpenSurvey| {
        records.push(ViewRecord::new(&view, &survey.stated));
        keep(view, survey)
    };
    flow.views(&mut keep, progress)?;
    flow.join(plan, progress)?;
    let camera = *flow.camera();
    let Flow { survey, stages, doubts, joined, .. } = flow;
    let OpenSurvey { survey, stated, vertical_axis, .. } = survey;
    let (views, poses) = (Vec::new(), joined.poses);
    let stated = stated.into_rows();
    Ok(Processed { views, records, survey, camera, stated, vertical_axis, poses, stages, doubts })
}
