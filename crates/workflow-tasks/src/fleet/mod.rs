//! What a workflow did, in one table and one report.

mod document;
mod gather;
mod read;
mod table;

use std::collections::BTreeMap;
use std::path::PathBuf;

use atomic_output::{Destination, write_text};
use commands::made::{self, Made};
use commands::{Doubt, DoubtKind, Inputs, Judged, Result, json, produce_made};
use serde::Serialize;

/// Where a workflow ran, and where its report goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FleetRequest {
    /// Folder with `codes`, `results`, `checks` and `logs`.
    pub folder: PathBuf,
    /// Output folder; it may lie in that folder, beside these.
    pub out: PathBuf,
}

/// Everything that the report says.
#[derive(Debug, Clone, Serialize)]
pub struct Fleet {
    /// Cameras by name.
    pub cameras: Vec<Camera>,
    /// Recordings, those that failed among them.
    pub recordings: usize,
    /// Those that have a result.
    pub with_result: usize,
    /// Steps that have no result, by exit code.
    pub failures: Vec<FailureCount>,
    /// Share of the pixels of all recordings with a result that carry each flag; `any`: at least one. Mean over recordings.
    pub flags_fraction: BTreeMap<String, f64>,
    /// Recordings by kind of doubt.
    pub doubt_kinds: Vec<DoubtCount>,
    /// A row for each recording, as in `fleet.csv`.
    #[serde(skip)]
    pub rows: Vec<RecordingRow>,
    /// What speaks against the fleet.
    pub doubts: Vec<Doubt>,
    /// The output folder.
    pub out: PathBuf,
}

/// A camera of the fleet.
#[derive(Debug, Clone, Serialize)]
pub struct Camera {
    /// Its name.
    pub camera: String,
    /// Its calibration, where the workflow made it.
    pub calibration: Option<Calibration>,
    /// Checks of the calibration, day by day.
    pub checks: Vec<DayCheck>,
    /// Recordings, and those of them that have a result.
    pub recordings: [usize; 2],
    /// Mean over its recordings of the share of flagged pixels.
    pub flagged_fraction: Option<f64>,
}

/// How a step ended.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Recorded {
    /// Exit code.
    pub code: u8,
    /// Why it has no result.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<String>,
}

/// The calibration of a camera.
#[derive(Debug, Clone, Serialize)]
pub struct Calibration {
    /// How it ended.
    #[serde(flatten)]
    pub recorded: Recorded,
    /// Standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Doubts about it.
    pub doubts: usize,
}

/// Whether a calibration was still right on a day.
#[derive(Debug, Clone, Serialize)]
pub struct DayCheck {
    /// The day.
    pub day: String,
    /// How the check ended: 0 still right, 1 no longer right, 3 the survey cannot tell.
    #[serde(flatten)]
    pub recorded: Recorded,
    /// Whether terms have moved significantly.
    pub moved: Option<bool>,
    /// Whether that matters.
    pub matters: Option<bool>,
    /// Root mean square change of the range correction, metre.
    pub change_rms_m: Option<f64>,
}

/// Steps that ended with a code that has no result.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct FailureCount {
    /// The exit code.
    pub code: u8,
    /// What it says.
    pub words: &'static str,
    /// The steps, each with its reason.
    pub steps: Vec<String>,
}

/// How many recordings have a doubt of a kind.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct DoubtCount {
    /// The kind.
    pub kind: String,
    /// Recordings.
    pub recordings: usize,
}

/// A recording.
#[derive(Debug, Clone, Default)]
pub struct RecordingRow {
    /// Camera, day and name.
    pub place: [String; 3],
    /// Exit code of its processing.
    pub code: u8,
    /// Frames and stations.
    pub frames: Option<u64>,
    /// Stations.
    pub stations: Option<u64>,
    /// Points of the cloud.
    pub points: Option<u64>,
    /// Median standard deviation of a range, metre.
    pub sigma_range_median_m: Option<f64>,
    /// Shares of pixels by flag, with `any`.
    pub flags_fraction: BTreeMap<String, f64>,
    /// Kinds of the doubts.
    pub doubt_kinds: Vec<String>,
    /// Whether the calibration was found no longer right that day.
    pub calibration_matters: Option<bool>,
    /// Root mean square change of the range correction that day, metre.
    pub calibration_change_m: Option<f64>,
    /// Version of the program, and the digest of all that it was made from.
    pub made: [Option<String>; 2],
    /// Why it has no result.
    pub reason: Option<String>,
}

impl Judged for Fleet {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

/// Gathers what a workflow did and writes `fleet.csv`, `report.html` and `summary.json`.
///
/// # Errors
/// [`Error::Request`](commands::Error::Request) for a folder in which no step was recorded; those of reading and writing.
pub fn fleet(request: &FleetRequest) -> Result<Fleet> {
    let parts = ["codes", "results", "checks", "logs"].map(|name| request.folder.join(name));
    let inputs = parts.iter().fold(Inputs::default(), Inputs::path);
    let destination = inputs.destination(&request.out)?;
    let gathered = gather::gather(&request.folder)?;
    let made = made::options().map(|options| Made::new(options, &gathered.read));
    produce_made(&destination, made, |destination| write(destination, gathered.fleet))
}

fn write(destination: &Destination, mut fleet: Fleet) -> Result<Fleet> {
    destination.named().clone_into(&mut fleet.out);
    let folder = destination.open()?;
    write_text(folder.file("fleet.csv")?, &table::csv(&fleet.rows))?;
    write_text(folder.file("summary.json")?, &json(&fleet)?)?;
    write_text(folder.file("report.html")?, &document::document(&fleet).html())?;
    folder.commit()?;
    Ok(fleet)
}

/// What an exit code without a result says.
pub(crate) fn words_of(code: u8) -> &'static str {
    match code {
        2 => "wrong input or usage",
        3 => "refused by what the data show",
        4 => "failure of the machine",
        _ => "a fault of the program",
    }
}

/// Doubts about all of it.
pub(crate) fn doubts(cameras: &[Camera], failures: &[FailureCount]) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    for camera in cameras {
        let moved: Vec<&DayCheck> = camera.checks.iter().filter(|check| check.matters == Some(true)).collect();
        if let (Some(first), Some(last)) = (moved.first(), moved.last()) {
            let change = moved.iter().filter_map(|check| check.change_rms_m).fold(0.0, f64::max);
            let words = format!(
                "its calibration is no longer right on {} of {} days checked, from {} to {}: ranges change by up to {:.1} mm (root \
                 mean square). Calibrate it anew",
                moved.len(),
                camera.checks.len(),
                first.day,
                last.day,
                1e3 * change
            );
            doubts.push(Doubt::about(DoubtKind::Calibration, &camera.camera, words));
        }
    }
    for failure in failures {
        let words =
            format!("{} steps have no result: {} (exit code {})", failure.steps.len(), failure.words, failure.code);
        doubts.push(Doubt::new(DoubtKind::Refused, words));
    }
    doubts
}
