//! What was found, by name.

use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use range_io::survey::SurveyCamera;
use serde::Serialize;

use crate::find::pictures::Pictures;
use crate::find::request::TargetsRequest;
use crate::find::station::{LeftOut, StationPicture};
use crate::kind::{SingleKind, TargetKind};

/// Result of a search for targets.
#[derive(Debug, Clone, Serialize)]
pub struct TargetsSummary {
    /// Where it was looked.
    pub survey: String,
    /// What was looked for: `checkerboard 9x6 0.025`.
    pub kind: String,
    /// Stations that show it.
    pub stations: Vec<StationSummary>,
    /// Stations that do not.
    pub missing: Vec<MissingStation>,
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

/// Targets as one station shows them.
#[derive(Debug, Clone, Serialize)]
pub struct StationSummary {
    /// The station.
    pub station: String,
    /// Targets seen: nodes of a board, or single ones with names.
    pub points: usize,
    /// Nodes of the board, or targets with coordinates; where there are none, what looks like a target.
    pub of: usize,
    /// Ranges.
    pub ranges: usize,
    /// In how many ways the picture lets the nodes of a board be numbered; 1: in no other.
    pub ambiguity: usize,
    /// Robust deviation of the nodes from a smooth map of the board onto the image, or median distance of single targets from where
    /// their coordinates put them, pixel; `None` where there are no coordinates, or too few targets to judge.
    pub residual_px: Option<f64>,
    /// Median standard deviation of a coordinate of an image point, pixel.
    pub sigma_px: f64,
    /// Points that look like targets and are none of those with coordinates.
    pub unnamed: usize,
    /// Coded rings whose names rest on their codes alone, as fewer than six of the station have coordinates and no other station that
    /// shares six of its rings sees them: a code that was read wrongly would not show.
    pub unchecked: usize,
    /// Targets that were seen and take no part, each with the reason.
    pub left_out: Vec<LeftOut>,
    /// Targets with coordinates that lie in the image and were not seen.
    pub not_seen: Vec<String>,
}

/// A station without targets.
#[derive(Debug, Clone, Serialize)]
pub struct MissingStation {
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
        pictured: &[StationPicture],
    ) -> Self {
        let found = |station: &StationPicture| {
            let seen = station.seen.as_ref().ok()?;
            let sigmas = station.observations.iter().filter_map(|row| row.sigma_pixel).flatten();
            Some(StationSummary {
                station: station.station.clone(),
                points: station.observations.len(),
                of: seen.of,
                ranges: station.ranges(),
                ambiguity: seen.ambiguity,
                residual_px: seen.residual_px,
                sigma_px: statistics::quantile(&mut sigmas.collect::<Vec<_>>(), 0.5),
                unnamed: seen.unnamed,
                unchecked: seen.unchecked,
                left_out: seen.left_out.clone(),
                not_seen: seen.hidden.clone(),
            })
        };
        let missing = |station: &StationPicture| {
            let reason = station.seen.as_ref().err()?.clone();
            Some(MissingStation { station: station.station.clone(), reason })
        };
        let stations: Vec<StationSummary> = pictured.iter().filter_map(found).collect();
        let missing: Vec<MissingStation> = pictured.iter().filter_map(missing).collect();
        let from = match (pictures.is_folder, request.principal_distance_px) {
            (false, _) => "survey",
            (true, Some(_)) => "given",
            (true, None) => "boards",
        };
        Self {
            survey: request.survey.display().to_string(),
            kind: request.kind.to_string(),
            points: stations.iter().map(|station| station.points).sum(),
            ranges: stations.iter().map(|station| station.ranges).sum(),
            doubts: doubts(&request.kind, &stations, &missing, pictures.has_ranges()),
            stations,
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
        format!("none of {stations} stations shows the targets, {}; of the first: {first}", self.kind)
    }
}

fn doubts(kind: &TargetKind, stations: &[StationSummary], missing: &[MissingStation], has_ranges: bool) -> Vec<Doubt> {
    let what = match kind {
        TargetKind::Board(_) => "the board was not found",
        TargetKind::Single(_) => "no target was found",
    };
    let missing = missing.iter().map(|missing| {
        let words = format!("{what}: {}", missing.reason);
        Doubt::about(DoubtKind::MissingTargets, &missing.station, words)
    });
    // What shines may swallow the camera's light.
    let is_dark = matches!(kind, TargetKind::Single(SingleKind::Lights));
    let blind = stations.iter().filter(move |station| has_ranges && !is_dark && station.ranges == 0).map(|station| {
        let words =
            "none of its points has a range: the targets are out of reach, or their ink swallows the camera's light";
        Doubt::about(DoubtKind::MissingTargets, &station.station, words)
    });
    let left_out = stations.iter().flat_map(|station| {
        let words = |left: &LeftOut| {
            format!("{} at ({:.0}, {:.0}) is left out: {}", left.target, left.pixel[0], left.pixel[1], left.reason)
        };
        let coded = station.left_out.iter().filter(|left| !left.target.is_empty());
        coded.map(move |left| Doubt::about(DoubtKind::MissingTargets, &station.station, words(left)))
    });
    missing.chain(blind).chain(left_out).collect()
}

impl Judged for TargetsSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}
