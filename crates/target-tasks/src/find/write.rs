//! The survey of what was found.

use atomic_output::{Destination, write_text};
use pipeline::Result;
use pipeline::survey::read_calibration;
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey, SurveyCamera};
use range_io::tables::{Target, write_observations, write_targets};

use crate::find::TargetsRequest;
use crate::find::pictures::Pictures;
use crate::find::sightings::Sighting;
use crate::kind::TargetKind;

pub(crate) fn write(
    destination: &Destination,
    request: &TargetsRequest,
    pictures: &Pictures,
    camera: &SurveyCamera,
    sightings: &[Sighting],
    (summary, page): (&str, &str),
) -> Result<()> {
    let folder = destination.open()?;
    let level = if pictures.has_ranges() { Level::Range } else { Level::Intensity };
    let known = &pictures.survey;
    let survey = Survey {
        camera_identity: known.camera_identity.clone(),
        firmware: known.firmware.clone(),
        operator: known.operator.clone(),
        ..Survey::new(camera.clone(), level, Vec::new())
    };
    survey.write(folder.file(Survey::FILE_NAME)?)?;
    let rows: Vec<_> = sightings.iter().flat_map(|sighting| &sighting.observations).cloned().collect();
    write_observations(folder.file("observations.csv")?, &rows)?;
    write_targets(folder.file("targets.csv")?, &coordinates(request, sightings))?;
    // What the ranges were freed of, and what a calibration starts from.
    if let (Some(calibration), _) = read_calibration(&pictures.root, request.calibration.as_deref())? {
        calibration.write(folder.file(Calibration::FILE_NAME)?)?;
    }
    write_text(folder.file("summary.json")?, summary)?;
    write_text(folder.file("report.html")?, page)?;
    folder.commit()?;
    Ok(())
}

/// Coordinates of all nodes that were seen from anywhere.
fn coordinates(request: &TargetsRequest, sightings: &[Sighting]) -> Vec<Target> {
    let boards = sightings.iter().filter_map(|sighting| sighting.board.as_ref().ok());
    let mut nodes: Vec<[usize; 2]> = boards.flat_map(|board| &board.nodes).map(|seen| seen.node).collect();
    nodes.sort_by_key(|[column, row]| [*row, *column]);
    nodes.dedup();
    let target = |node: [usize; 2]| Target {
        target: TargetKind::name(node),
        position_m: request.kind.node_m(node).into(),
        sigma_m: request.board_sigma_m.map(|sigma| [sigma; 3]),
    };
    nodes.into_iter().map(target).collect()
}
