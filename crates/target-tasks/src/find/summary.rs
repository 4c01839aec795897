//! What was found, by name.

use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use range_io::survey::SurveyCamera;
use serde::Serialize;

use crate::find::TargetsRequest;
use crate::find::pictures::Pictures;
use crate::find::sightings::Sighting;

/// Result of a search for targets.
#[derive(Debug, Clone, Serialize)]
pub struct TargetsSummary {
    /// Where it was looked.
    pub survey: String,
    /// What was looked for: `checkerboard 9x6 0.025`.
    pub kind: String,
    /// Stations that show it.
    pub boards: Vec<BoardSummary>,
    /// Stations that do not.
    pub missing: Vec<MissingBoard>,
    /// Image points in all.
    pub points: usize,
    /// Ranges in all.
    pub ranges: usize,
    /// Principal distance of the camera as it is written into `survey.ron`, pixel (columns).
    pub principal_distance_px: f64,
    /// Where that is from: `survey`, `given` or `boards`.
    pub principal_distance_from: &'static str,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// Time taken.
    pub seconds: f64,
    /// Where it was written.
    pub out: PathBuf,
}

/// A board as one station shows it.
#[derive(Debug, Clone, Serialize)]
pub struct BoardSummary {
    /// The station.
    pub station: String,
    /// Nodes seen.
    pub points: usize,
    /// Nodes of the board.
    pub of: usize,
    /// Ranges.
    pub ranges: usize,
    /// In how many ways the picture lets the nodes be numbered; 1: in no other.
    pub ambiguity: usize,
    /// Robust deviation of the nodes from a smooth map of the board onto the image, pixel.
    pub residual_px: f64,
    /// Median standard deviation of a coordinate of the nodes, pixel.
    pub sigma_px: f64,
}

/// A station without the board.
#[derive(Debug, Clone, Serialize)]
pub struct MissingBoard {
    /// The station.
    pub station: String,
    /// Why.
    pub reason: String,
}

impl TargetsSummary {
    pub(crate) fn new(
        request: &TargetsRequest,
        pictures: &Pictures,
        camera: &SurveyCamera,
        sightings: &[Sighting],
    ) -> Self {
        let [columns, rows] = request.kind.size();
        let found = |sighting: &Sighting| {
            let board = sighting.board.as_ref().ok()?;
            let sigmas = sighting.observations.iter().filter_map(|row| row.sigma_pixel).flatten();
            Some(BoardSummary {
                station: sighting.station.clone(),
                points: board.nodes.len(),
                of: columns * rows,
                ranges: sighting.ranges(),
                ambiguity: board.ambiguity,
                residual_px: board.residual_px,
                sigma_px: statistics::quantile(&mut sigmas.collect::<Vec<_>>(), 0.5),
            })
        };
        let missing = |sighting: &Sighting| {
            let reason = sighting.board.as_ref().err()?.to_string();
            Some(MissingBoard { station: sighting.station.clone(), reason })
        };
        let boards: Vec<BoardSummary> = sightings.iter().filter_map(found).collect();
        let missing: Vec<MissingBoard> = sightings.iter().filter_map(missing).collect();
        let from = match (pictures.is_folder, request.principal_distance_px) {
            (false, _) => "survey",
            (true, Some(_)) => "given",
            (true, None) => "boards",
        };
        Self {
            survey: request.survey.display().to_string(),
            kind: request.kind.to_string(),
            points: boards.iter().map(|board| board.points).sum(),
            ranges: boards.iter().map(|board| board.ranges).sum(),
            doubts: doubts(&boards, &missing, pictures.has_ranges()),
            boards,
            missing,
            principal_distance_px: camera.principal_distance_mm / camera.pixel_pitch_mm[0],
            principal_distance_from: from,
            seconds: 0.0,
            out: request.out.clone(),
        }
    }

    /// Why nothing was written.
    pub(crate) fn nothing_found(&self) -> String {
        let first = self.missing.first().map_or("no frames", |missing| missing.reason.as_str());
        let stations = self.missing.len();
        format!("none of {stations} stations shows a {}; of the first: {first}", self.kind)
    }
}

fn doubts(boards: &[BoardSummary], missing: &[MissingBoard], has_ranges: bool) -> Vec<Doubt> {
    let missing = missing.iter().map(|missing| {
        let words = format!("the board was not found: {}", missing.reason);
        Doubt::about(DoubtKind::MissingTargets, &missing.station, words)
    });
    let blind = boards.iter().filter(|board| has_ranges && board.ranges == 0).map(|board| {
        let words = "none of its points has a range: the board is out of reach, or its ink swallows the camera's light";
        Doubt::about(DoubtKind::MissingTargets, &board.station, words)
    });
    missing.chain(blind).collect()
}

impl Judged for TargetsSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}
