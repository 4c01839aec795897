//! The survey of what was found.

use std::collections::BTreeSet;

use atomic_output::{Destination, write_text};
use pipeline::Result;
use pipeline::survey::read_calibration;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey, SurveyCamera};
use range_io::tables::{Target, write_observations, write_stations, write_targets};

use crate::find::pictures::Pictures;
use crate::find::request::TargetsRequest;
use crate::find::single::Singles;
use crate::find::station::StationPicture;
use crate::kind::{BoardKind, TargetKind};

/// What was found, and where.
pub(crate) struct Found<'a> {
    pub(crate) pictures: &'a Pictures,
    pub(crate) camera: &'a SurveyCamera,
    pub(crate) singles: Option<&'a Singles>,
    pub(crate) stations: &'a [StationPicture],
}

pub(crate) fn write(
    destination: &Destination,
    request: &TargetsRequest,
    found: &Found<'_>,
    (summary, page): (&str, &str),
) -> Result<()> {
    let folder = destination.open()?;
    let level = if found.pictures.has_ranges() { Level::Range } else { Level::Intensity };
    let known = &found.pictures.survey;
    let survey = Survey {
        camera_identity: known.camera_identity.clone(),
        firmware: known.firmware.clone(),
        operator: known.operator.clone(),
        ..Survey::new(found.camera.clone(), level, Vec::new())
    };
    survey.write(folder.file(Survey::FILE_NAME)?)?;
    let rows: Vec<_> = found.stations.iter().flat_map(|station| &station.observations).cloned().collect();
    write_observations(folder.file("observations.csv")?, &rows)?;
    let coordinates = coordinates(request, found);
    if !coordinates.is_empty() {
        write_targets(folder.file("targets.csv")?, &coordinates)?;
    }
    // In the frame of the coordinates, if those are the survey's.
    if let Some(singles) = found.singles.filter(|singles| !singles.poses.is_empty()) {
        write_stations(folder.file("stations.csv")?, &singles.poses)?;
    }
    // What the ranges were freed of, and what a calibration starts from.
    if let (Some(calibration), _) = read_calibration(&found.pictures.root, request.calibration.as_deref())? {
        calibration.write(folder.file(Calibration::FILE_NAME)?)?;
    }
    write_text(folder.file("summary.json")?, summary)?;
    write_text(folder.file("report.html")?, page)?;
    folder.commit()?;
    Ok(())
}

/// Coordinates of all targets that were seen from anywhere: a board's nodes row by row, others as they stand in the survey's table.
fn coordinates(request: &TargetsRequest, found: &Found<'_>) -> Vec<Target> {
    let rows = found.stations.iter().flat_map(|station| &station.observations);
    let seen: BTreeSet<&str> = rows.map(|row| row.target.as_str()).collect();
    let sigma_m = request.board_sigma_m.map(|sigma| [sigma; 3]);
    let all: Vec<Target> = match (&request.kind, found.singles) {
        (TargetKind::Board(kind), _) => {
            let [columns, rows] = kind.size();
            let nodes = (0..rows).flat_map(|row| (0..columns).map(move |column| [column, row]));
            let target = |node| Target { target: BoardKind::name(node), position_m: kind.node_m(node).into(), sigma_m };
            nodes.map(target).collect()
        }
        (TargetKind::Single(_), Some(singles)) => {
            let known = singles.known.iter().cloned();
            known.map(|target| Target { sigma_m: target.sigma_m.or(sigma_m), ..target }).collect()
        }
        (TargetKind::Single(_), None) => Vec::new(),
    };
    all.into_iter().filter(|target| seen.contains(target.target.as_str())).collect()
}
