//! The workflow of an archive, written for an engine that exists.

use std::fmt;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use atomic_output::{Destination, OutputFolder, write_text};
use commands::plan::{Plan, Stage};
use commands::{Doubt, DoubtKind, Error, Inputs, Judged, Result, json, produce_made};
use report::Document;
use serde::Serialize;

use crate::archive::{Archive, CalibrationSource};

/// What to write a workflow for.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct WorkflowRequest {
    /// The archive: `CAMERA/calibration`, `CAMERA/DAY/check`, `CAMERA/DAY/warmup`, `CAMERA/DAY/RECORDING`, each a survey.
    pub archive: PathBuf,
    /// The stages of all recordings; `None`: `pipeline.ron` in the archive.
    pub pipeline: Option<PathBuf>,
    /// Parts of each recording.
    pub shards: usize,
    /// Threads of each job.
    pub threads: usize,
    /// Output folder.
    pub out: PathBuf,
}

/// What was written.
#[derive(Debug, Clone, Serialize)]
pub struct WorkflowSummary {
    /// Cameras of the archive.
    pub cameras: usize,
    /// Days of all cameras.
    pub days: usize,
    /// Recordings of all days.
    pub recordings: usize,
    /// Parts that each of them is processed in.
    pub shards: usize,
    /// Jobs of the whole workflow.
    pub jobs: usize,
    /// What a reader should know before it runs.
    pub doubts: Vec<Doubt>,
    /// The output folder.
    pub out: PathBuf,
}

impl Judged for WorkflowSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

impl fmt::Display for WorkflowSummary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { cameras, days, recordings, shards, jobs, out, .. } = self;
        let lead = format!(
            "recordings: {recordings}; cameras: {cameras}; days: {days}; parts of each: {shards}; jobs: {jobs}"
        );
        let mut document = Document::new("rangecam: workflow", lead);
        document.warnings(&self.doubts);
        document.closing(format!(
            "written to {}: Snakefile, config.yaml, profiles, README.md says how it runs",
            out.display()
        ));
        document.fmt(f)
    }
}

const SNAKEFILE: &str = include_str!("templates/Snakefile");
const README: &str = include_str!("templates/README.md");
const LOCAL: &str = include_str!("templates/local.yaml");
const SLURM: &str = include_str!("templates/slurm.yaml");

/// Writes the workflow of an archive: `Snakefile`, `config.yaml`, `pipeline.ron`, profiles and a page that says how it runs.
///
/// # Errors
/// [`Error::Request`] for an archive without recordings, names that no job can have, and no parts; those of reading the pipeline.
pub fn write_workflow(request: &WorkflowRequest) -> Result<WorkflowSummary> {
    if request.shards == 0 || request.threads == 0 {
        let message = "--shards is 0: expected at least one part".to_owned();
        return Err(Error::Request { command: "workflow", message });
    }
    let pipeline = request.pipeline.clone().unwrap_or_else(|| request.archive.join("pipeline.ron"));
    let inputs = Inputs::default().path(&request.archive).path(&pipeline);
    let destination = inputs.destination(&request.out)?;
    // No record of what it was made from: all of an archive would be read for what takes no time to be written anew.
    produce_made(&destination, None, |destination| write_into(destination, request, &pipeline))
}

fn write_into(destination: &Destination, request: &WorkflowRequest, pipeline: &Path) -> Result<WorkflowSummary> {
    let archive = Archive::read(&request.archive)?;
    let plan = Plan::read(pipeline)?;
    let mut doubts = Vec::new();
    let joins = plan.stages.iter().find(|stage| matches!(stage, Stage::Register(_) | Stage::Adjust(_)));
    let shards = match joins {
        Some(stage) if request.shards > 1 => {
            let words = format!(
                "stage {} brings all stations of a recording together: each recording is one job, not {}",
                stage.name(),
                request.shards
            );
            doubts.push(Doubt::new(DoubtKind::Refused, words));
            1
        }
        _ => request.shards,
    };
    let folder = destination.open()?;
    write(&folder, "Snakefile", SNAKEFILE)?;
    write(&folder, "README.md", README)?;
    write(&folder, "profiles/local/config.yaml", LOCAL)?;
    write(&folder, "profiles/slurm/config.yaml", SLURM)?;
    write(&folder, "pipeline.ron", &range_io::read_ron_text(pipeline)?)?;
    let (absolute, flow) = (absolute(&request.archive)?, absolute(destination.target())?);
    write(&folder, "config.yaml", &configuration(&archive, &absolute, &flow, (shards, request.threads)))?;
    let summary = WorkflowSummary {
        cameras: archive.cameras.len(),
        days: archive.days().count(),
        recordings: archive.recordings(),
        shards,
        jobs: jobs(&archive, shards),
        doubts,
        out: destination.named().to_owned(),
    };
    write(&folder, "summary.json", &json(&summary)?)?;
    folder.commit()?;
    Ok(summary)
}

fn write(folder: &OutputFolder, name: &str, text: &str) -> Result<()> {
    Ok(write_text(folder.file(name)?, text)?)
}

fn absolute(path: &Path) -> Result<PathBuf> {
    std::path::absolute(path).map_err(|source| Error::Access { path: path.to_owned(), source })
}

/// Jobs of a workflow: those of the parts and their merge, of calibrations, checks and drifts, and the report.
fn jobs(archive: &Archive, shards: usize) -> usize {
    let calibrated = |source| matches!(source, CalibrationSource::Survey(_));
    let calibrations = archive.cameras.iter().filter(|camera| calibrated(camera.calibration)).count();
    let of_days: usize = archive.days().map(|(_, day)| usize::from(day.checked) + usize::from(day.warms_up)).sum();
    let of_recording = if shards > 1 { shards + 1 } else { 1 };
    calibrations + of_days + of_recording * archive.recordings() + 1
}

/// `config.yaml`: everything that a user may want to change, and then the list of recordings.
fn configuration(archive: &Archive, root: &Path, flow: &Path, (shards, threads): (usize, usize)) -> String {
    let mut text = String::new();
    let mut line = |indent: usize, words: &str| {
        let _ = writeln!(text, "{:indent$}{words}", "");
    };
    line(
        0,
        "# What the workflow is told. Everything up to `cameras` may be changed; steps whose inputs or options that touches run anew.",
    );
    line(0, "rangecam: rangecam            # the program: a name on the PATH of every machine, or a path");
    line(0, &format!("archive: {}", quoted(&root.display().to_string())));
    line(0, &format!("pipeline: {}", quoted(&flow.join("pipeline.ron").display().to_string())));
    line(0, &format!("shards: {shards}                     # parts of each recording"));
    line(0, &format!("threads: {threads}                    # of each job; results do not depend on it"));
    line(0, "memory_mb: 2000               # of each job: docs/fleet.md says how much a recording takes");
    line(0, "runtime_min: 120              # of each job, for queues that ask");
    line(0, "options: --no-times           # of every call");
    line(0, "run_options: \"\"               # of `rangecam run`");
    line(0, "check_options: \"\"             # of `rangecam check`, such as --level 0.001 --tolerance 0.002");
    line(0, "keep_parts: false             # whether the folders of parts stay after their merge");
    line(0, "cameras:");
    for camera in &archive.cameras {
        line(2, &format!("{}:", quoted(&camera.name)));
        let (kind, options) = match camera.calibration {
            CalibrationSource::Survey(options) => ("survey", options),
            CalibrationSource::File => ("file", ""),
            CalibrationSource::Recordings => ("recordings", ""),
        };
        line(4, &format!("calibration: {kind}"));
        line(4, &format!("calibrate_options: {}", quoted(options)));
        line(4, if camera.days.is_empty() { "days: {}" } else { "days:" });
        for day in &camera.days {
            line(6, &format!("{}:", quoted(&day.name)));
            line(8, &format!("check: {}", day.checked));
            line(8, &format!("warmup: {}", day.warms_up));
            let names: Vec<String> = day.recordings.iter().map(|name| quoted(name)).collect();
            line(8, &format!("recordings: [{}]", names.join(", ")));
        }
    }
    text
}

/// A word in double quotes, as YAML and JSON have it.
fn quoted(word: &str) -> String {
    serde_json::Value::from(word).to_string()
}
