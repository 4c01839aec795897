//! Two results held against each other: clouds, trajectories, stations, or output folders with all of them.

pub(crate) mod clouds;
pub(crate) mod document;
pub(crate) mod figures;
pub(crate) mod kind;
pub(crate) mod signed;
pub(crate) mod stations;
pub(crate) mod trajectories;

pub use clouds::{CloudAlignment, CloudComparison, DistanceHistogram, PlaneDistances};
pub use stations::{PoseComparison, PoseDifference};
pub use trajectories::{AbsoluteSummary, RelativeSummary, TrajectoryComparison, TrajectoryStatistics};

use std::path::PathBuf;

use atomic_output::{Destination, write_text};
use commands::{Doubt, Inputs, Judged, Progress, json, produce};
use pipeline::{Error, Result};
use serde::Serialize;

pub(crate) use clouds::{Deviations, millimetres_of};
pub(crate) use trajectories::{TrackCurves, TrackPoint};

/// What is to be compared, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct CompareRequest {
    /// The one.
    pub first: PathBuf,
    /// The other, taken as the reference.
    pub second: PathBuf,
    /// Whether the first is registered onto the second before they are compared.
    pub alignment: CompareAlignment,
    /// Points farther from the reference are counted and left out, metre.
    pub max_distance_m: Option<f64>,
    /// Poses of trajectories belong together if their times differ by no more, second.
    pub max_time_difference_s: f64,
    /// Folder for `comparison.json` and `report.html`; nothing is written without one.
    pub out: Option<PathBuf>,
}

/// How the first result is moved onto the second.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum CompareAlignment {
    /// Not at all: both are in one frame.
    #[default]
    None,
    /// By a rigid motion.
    Rigid,
    /// By a similarity; for trajectories, whose estimate may have no scale of its own.
    Similarity,
}

impl CompareRequest {
    /// Compares two files or folders as they stand.
    pub fn new(first: impl Into<PathBuf>, second: impl Into<PathBuf>) -> Self {
        Self {
            first: first.into(),
            second: second.into(),
            alignment: CompareAlignment::None,
            max_distance_m: None,
            max_time_difference_s: 0.01,
            out: None,
        }
    }

    fn validate(&self) -> Result<()> {
        if let Some(limit) = self.max_distance_m
            && !(limit > 0.0 && limit.is_finite())
        {
            return Err(Error::Compare(format!("the largest distance is {limit} m, expected a positive number")));
        }
        let tolerance = self.max_time_difference_s;
        if !(tolerance >= 0.0 && tolerance.is_finite()) {
            return Err(Error::Compare(format!("the difference of times is {tolerance} s, expected 0 or more")));
        }
        Ok(())
    }
}

/// How two results differ.
#[derive(Debug, Clone, Default, Serialize)]
pub struct Comparison {
    /// What was compared.
    pub first: String,
    /// What it was compared with.
    pub second: String,
    /// Distances of the first cloud's points to the second cloud.
    pub clouds: Option<CloudComparison>,
    /// Differences of stations of the same name.
    pub poses: Option<PoseComparison>,
    /// Errors of the first trajectory against the second.
    pub trajectory: Option<TrajectoryComparison>,
    /// The page that shows it, where one was written.
    pub report: Option<PathBuf>,
}

impl Judged for Comparison {
    fn doubts(&self) -> &[Doubt] {
        let alignment = self.clouds.as_ref().and_then(|clouds| clouds.alignment.as_ref());
        alignment.map_or(&[], |alignment| &alignment.doubts)
    }
}

/// What the page shows beside the figures.
#[derive(Debug, Default)]
pub(crate) struct ComparisonPictures {
    pub(crate) deviations: Option<Deviations>,
    pub(crate) tracks: Option<TrackCurves>,
}

/// Compares two clouds of any format, two trajectories, two `stations.csv` or two output folders.
pub fn compare(request: &CompareRequest, progress: &dyn Progress) -> Result<Comparison> {
    request.validate()?;
    let Some(out) = &request.out else { return compare_into(None, request, progress) };
    let inputs = Inputs::default().path(&request.first).path(&request.second);
    produce(out, &inputs, |destination| compare_into(Some(destination), request, progress))
}

fn compare_into(
    destination: Option<&Destination>,
    request: &CompareRequest,
    progress: &dyn Progress,
) -> Result<Comparison> {
    let (first, second) = (&request.first, &request.second);
    let mut comparison = Comparison {
        first: first.display().to_string(),
        second: second.display().to_string(),
        ..Comparison::default()
    };
    let mut pictures = ComparisonPictures::default();
    for part in kind::parts(first, second)? {
        match part {
            kind::Part::Clouds(a, b) => {
                let (clouds, deviations) = clouds::compare(&a, &b, request, progress)?;
                (comparison.clouds, pictures.deviations) = (Some(clouds), Some(deviations));
            }
            kind::Part::Stations(a, b) => comparison.poses = Some(stations::compare(&a, &b)?),
            kind::Part::Trajectories(a, b) => {
                let (trajectory, tracks) = trajectories::compare(&a, &b, request)?;
                (comparison.trajectory, pictures.tracks) = (Some(trajectory), Some(tracks));
            }
        }
    }
    if let Some(destination) = destination {
        comparison.report = Some(destination.named().join("report.html"));
        write(destination, &comparison, &pictures)?;
    }
    Ok(comparison)
}

fn write(destination: &Destination, comparison: &Comparison, pictures: &ComparisonPictures) -> Result<()> {
    let page = document::document(comparison, figures::Figures::new(comparison, pictures)?).html();
    let folder = destination.open()?;
    write_text(folder.file("comparison.json")?, &json(comparison)?)?;
    write_text(folder.file("report.html")?, &page)?;
    folder.commit()?;
    Ok(())
}
