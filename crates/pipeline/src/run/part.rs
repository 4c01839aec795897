//! A run in parts: each takes some of the views through the stages, and what all of them keep makes the whole, bit for bit as one
//! run would.

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::fs::File;
use std::io::{BufReader, BufWriter};
use std::path::{Path, PathBuf};
use std::time::Instant;

use atomic_output::{Destination, write_text};
use commands::made::{Made, program, without_times};
use commands::memory::{Memory, Work, keeping};
use commands::{Inputs, Judged, Progress, Tape, json, produce, produce_made, root_of};
use range_io::survey::Survey;
use serde::{Deserialize, Serialize};

use crate::run::files::clouds::{Clouds, OwnCloud};
use crate::run::files::results;
use crate::run::flow::Seen;
use crate::run::kept::Kept;
use crate::run::stream::{Before, Order, Part};
use crate::run::summary::Summary;
use crate::run::{RunRequest, complete, opened};
use crate::survey::open::OpenSurvey;
use crate::survey::view::View;
use crate::{Error, Plan, Result};
use commands::InputDigest;
use commands::plan::Source;

/// What a part of a run did, and what [`merge`] needs to know of it.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct PartSummary {
    /// Which part, from 1, and of how many.
    pub part: [usize; 2],
    /// The pipeline's file.
    pub pipeline: PathBuf,
    /// The survey's folder.
    pub survey: PathBuf,
    /// The calibration that was named.
    pub calibration: Option<PathBuf>,
    /// Frames read.
    pub frames: usize,
    /// Views that came out of them.
    pub views: usize,
    /// Points of the cloud in the common frame.
    pub points: u64,
    /// Points of split pixels, which end the cloud.
    pub further_points: usize,
    /// Clouds in the frames of their own cameras.
    pub own_clouds: Vec<OwnCloud>,
    /// Whether durations are left out.
    pub no_times: bool,
    /// Arguments of the whole run, where it is a command's.
    pub options: Option<Vec<String>>,
    /// Version and digest of the program.
    pub program: String,
    /// All files that were read.
    pub inputs: Vec<InputDigest>,
    /// What is kept of the frames.
    pub state: InputDigest,
}

/// Points of the parts' clouds that are read at once at most, and bytes of each: as columns of the file, and as a cloud.
const POINTS_AT_ONCE: usize = 1 << 18;
const BYTES_A_POINT: u64 = 120;

/// Name of the file with what a part keeps.
const STATE: &str = "part.bin";

impl Judged for PartSummary {}

impl fmt::Display for PartSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { part: [number, of], frames, views, .. } = self;
        write!(
            f,
            "part {number} of {of}: {frames} frames, {views} views; `rangecam merge` makes the whole of all parts"
        )
    }
}

/// Runs a pipeline on one part of a survey's frames: its figures and clouds are those of the whole run, as far as they go.
///
/// # Errors
/// [`Error::Request`] for stages that join stations, and for pipelines that simulate or calibrate first; those of
/// [`run_with`](crate::run_with).
pub fn run_part(request: &RunRequest, part: Part, progress: &dyn Progress) -> Result<PartSummary> {
    let refused = |message: String| Err(Error::Request { command: "run", message });
    if part.number == 0 || part.number > part.of {
        return refused(format!("--shard {}/{}: expected a part from 1 to the number of parts", part.number, part.of));
    }
    if let Some(stage) = request.joining() {
        return refused(format!(
            "--shard: stage {stage} brings all stations together, which no part of them can do: run without --shard, or leave \
             the stage out and register the merged result"
        ));
    }
    let folder = match (&request.survey, &request.plan.source) {
        (Some(folder), _) => folder.clone(),
        (None, Some(Source::Survey { folder })) => request.base().join(folder),
        _ => return refused("--shard needs a survey that is there already: name its folder".to_owned()),
    };
    if request.plan.calibrate.is_some() && request.calibration.is_none() {
        return refused(
            "--shard: the pipeline calibrates a network first: calibrate once, and name it with --calibration"
                .to_owned(),
        );
    }
    let inputs = request.inputs().not_read(files_of_others(&folder, &request.plan, part)?);
    produce(&request.out, &inputs, |destination| part_into(destination, request, (&folder, part), &inputs, progress))
}

/// Frames and their truths that other parts read alone.
fn files_of_others(folder: &Path, plan: &Plan, part: Part) -> Result<BTreeSet<PathBuf>> {
    let (survey, root) = (Survey::read(folder)?, root_of(folder));
    let mut order = Order::new(&survey, &plan.stages, None);
    order.cut(part);
    let mine: BTreeSet<usize> = order.indices().collect();
    let truths = survey.truth.as_ref().map_or(&[][..], |truth| &truth.frames);
    let files = |is_mine: bool| -> BTreeSet<PathBuf> {
        let indices = (0..survey.frames.len()).filter(|index| mine.contains(index) == is_mine);
        let files = indices.flat_map(|index| [Some(&survey.frames[index].file), truths.get(index)]);
        files.flatten().map(|file| root.join(file)).collect()
    };
    Ok(files(false).difference(&files(true)).cloned().collect())
}

fn part_into(
    destination: &Destination,
    request: &RunRequest,
    (survey, part): (&Path, Part),
    inputs: &Inputs,
    progress: &dyn Progress,
) -> Result<PartSummary> {
    let mut flow = opened(request, survey, request.calibration.as_deref())?;
    let whole = flow.order.clone();
    let before = flow.order.cut(part);
    let tally = flow.tally(&whole, before);
    let mut kept = Kept::new(&flow.survey, flow.camera(), whole.views(), before);
    let folder = destination.open()?;
    let mut clouds = Clouds::new(&folder, &flow.survey, false, before.views);
    let mut keep = |view: View, survey: &OpenSurvey| {
        clouds.add(&view)?;
        kept.add(&view, survey)
    };
    let bytes = Kept::bytes(&flow.survey, flow.camera(), whole.views());
    let mut seen = keeping(bytes, || flow.part_of_views(tally, &mut keep, progress))?;
    let (further_points, views) = (clouds.further(), kept.views.len());
    let (own_clouds, points) = clouds.finish_part()?;
    let file = folder.file(STATE)?;
    let access = |source| Error::Access { path: file.clone(), source };
    let mut tape = Tape::onto(BufWriter::new(File::create(&file).map_err(access)?));
    flow.carry(&mut seen, &mut tape);
    kept.carry(&mut tape, &flow.survey);
    tape.finish().map_err(access)?;
    let summary = PartSummary {
        part: [part.number, part.of],
        pipeline: request.plan_path.clone(),
        survey: survey.to_owned(),
        calibration: request.calibration.clone(),
        frames: flow.order.frames(),
        views,
        points,
        further_points,
        own_clouds,
        no_times: without_times(),
        options: commands::made::options(),
        program: program(),
        inputs: inputs.digests(),
        state: InputDigest { file: STATE.to_owned(), ..InputDigest::of(&file)? },
    };
    write_text(folder.file("summary.json")?, &json(&summary)?)?;
    folder.commit()?;
    progress.finish();
    Ok(summary)
}

/// Makes the result of the whole run of the folders of all its parts, in whatever order.
///
/// # Errors
/// [`Error::Request`] where a part is missing, doubled, of another run or program, or an input has changed since; those of
/// [`run_with`](crate::run_with).
pub fn merge(parts: &[PathBuf], out: &Path, progress: &dyn Progress) -> Result<Summary> {
    let parts = read_parts(parts)?;
    let Some((_, first)) = parts.first() else { return Err(refused("name the folders of all parts")) };
    if first.no_times != without_times() {
        return Err(refused("--no-times holds for all parts and their merge, or for none of them"));
    }
    let request = RunRequest {
        plan: Plan::read(&first.pipeline)?,
        plan_path: first.pipeline.clone(),
        survey: Some(first.survey.clone()),
        calibration: first.calibration.clone(),
        out: out.to_owned(),
    };
    let files = unchanged_inputs(&parts)?;
    let inputs = parts.iter().fold(request.inputs(), |inputs, (folder, _)| inputs.path(folder));
    let record = commands::made::options().and(first.options.clone()).map(|options| Made::new(options, &files));
    let destination = inputs.destination(out)?;
    produce_made(&destination, record, |destination| merge_into(destination, &request, &parts, progress))
}

fn refused(message: impl Into<String>) -> Error {
    Error::Request { command: "merge", message: message.into() }
}

/// The parts in their order.
fn read_parts(folders: &[PathBuf]) -> Result<Vec<(PathBuf, PartSummary)>> {
    let mut parts = Vec::new();
    for folder in folders {
        let path = folder.join("summary.json");
        let text = std::fs::read_to_string(&path)
            .map_err(|error| refused(format!("{}: is no part of a run: summary.json: {error}", folder.display())))?;
        let part: PartSummary = serde_json::from_str(&text)
            .map_err(|error| refused(format!("{}: is no part of a run: {error}", path.display())))?;
        parts.push((folder.clone(), part));
    }
    parts.sort_by_key(|(_, part)| part.part);
    let all = parts.first().map_or(0, |(_, part)| part.part[1]);
    for (index, (folder, part)) in parts.iter().enumerate() {
        let (one, other) = (&parts[0].1, format!("{}: ", folder.display()));
        let what = |p: &PartSummary| {
            (p.pipeline.clone(), p.survey.clone(), p.calibration.clone(), p.options.clone(), p.part[1])
        };
        if what(one) != what(part) {
            return Err(refused(other + "is a part of another run than the first one named"));
        }
        if part.program != program() {
            return Err(refused(other + "was made by another version of the program: run it anew"));
        }
        if part.part[0] != index + 1 {
            return Err(refused(format!(
                "expected each of {all} parts once: part {} is missing or there twice",
                index + 1
            )));
        }
    }
    if parts.len() == all { Ok(parts) } else { Err(refused(format!("expected {all} parts, found {}", parts.len()))) }
}

/// All files that were read, if those that several parts have read are still the same.
fn unchanged_inputs(parts: &[(PathBuf, PartSummary)]) -> Result<Vec<InputDigest>> {
    let mut files: BTreeMap<&str, (&InputDigest, usize)> = BTreeMap::new();
    for input in parts.iter().flat_map(|(_, part)| &part.inputs) {
        let (known, readers) = files.entry(&input.file).or_insert((input, 0));
        *readers += 1;
        if *known != input {
            return Err(refused(format!("{}: has changed between the parts: run them anew", input.file)));
        }
    }
    for (known, _) in files.values().filter(|(_, readers)| *readers == parts.len()) {
        if InputDigest::of(&known.file)? != **known {
            return Err(refused(format!("{}: has changed since the parts ran: run them anew", known.file)));
        }
    }
    Ok(files.into_values().map(|(input, _)| input.clone()).collect())
}

fn merge_into(
    destination: &Destination,
    request: &RunRequest,
    parts: &[(PathBuf, PartSummary)],
    progress: &dyn Progress,
) -> Result<Summary> {
    let start = Instant::now();
    let survey = request.survey.clone().unwrap_or_default();
    let mut flow = opened(request, &survey, request.calibration.as_deref())?;
    let mut kept = Kept::new(&flow.survey, flow.camera(), flow.order.views(), Before::default());
    let folder = destination.open()?;
    let mut clouds = Clouds::new(&folder, &flow.survey, false, 0);
    let mut seen = Seen::new(flow.tally(&flow.order, Before::default()));
    let bytes = Kept::bytes(&flow.survey, flow.camera(), flow.order.views()) + seen.tally.bytes(&flow.survey);
    let work = Work { what: "merging the parts of a run", kept: bytes, each: BYTES_A_POINT, most: POINTS_AT_ONCE };
    let points_at_once = Memory::present().at_once(&work)?;
    progress.begin("parts", parts.len());
    for (number, (path, part)) in parts.iter().enumerate() {
        let file = path.join(STATE);
        if (InputDigest { file: STATE.to_owned(), ..InputDigest::of(&file)? }) != part.state {
            return Err(refused(format!("{}: is not what its part wrote: run it anew", file.display())));
        }
        let opened = File::open(&file).map_err(|source| Error::Access { path: file.clone(), source })?;
        let mut tape = Tape::of(BufReader::new(opened));
        flow.carry(&mut seen, &mut tape);
        kept.carry(&mut tape, &flow.survey);
        if !tape.is_at_end() {
            return Err(refused(format!("{}: does not hold what its part should have kept", file.display())));
        }
        clouds.add_part(path, (part.points, part.further_points, part.own_clouds.clone()), points_at_once)?;
        progress.advance(number + 1);
    }
    flow.conclude(seen)?;
    let (summary, page) = complete(&folder, request, &survey, (flow, kept, clouds), start, progress)?;
    results::finish(folder, &summary, &page, progress)?;
    Ok(summary)
}
