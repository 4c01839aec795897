//! What one station shows, whatever the kind of target.

use range_image::Raster;
use range_io::tables::TargetObservation;
use report::Mark;
use serde::Serialize;

use crate::find::sightings::Sighting;
use crate::kind::BoardKind;

/// Where a target lies on its board (metre), and where it was seen.
pub(crate) type Pair = ([f64; 2], [f64; 2]);

/// The picture of a station with its targets.
pub(crate) struct StationPicture {
    pub(crate) station: String,
    pub(crate) light: Raster<f32>,
    /// What was seen, or why nothing was.
    pub(crate) seen: Result<Seen, String>,
    pub(crate) observations: Vec<TargetObservation>,
}

/// Targets that were seen from a station.
pub(crate) struct Seen {
    /// How many there are to be seen.
    pub(crate) of: usize,
    pub(crate) ambiguity: usize,
    pub(crate) residual_px: Option<f64>,
    /// Points that look like targets and are none of them.
    pub(crate) unnamed: usize,
    /// Points whose names rest on their codes alone: neither coordinates nor other stations check them.
    pub(crate) unchecked: usize,
    pub(crate) left_out: Vec<LeftOut>,
    pub(crate) hidden: Vec<String>,
    pub(crate) marks: Vec<Mark>,
    pub(crate) line: Vec<[f64; 2]>,
    /// Of a board.
    pub(crate) pairs: Vec<Pair>,
}

/// A target that was seen and takes no part.
#[derive(Debug, Clone, Serialize)]
pub struct LeftOut {
    /// Its name, as it was read.
    pub target: String,
    /// Where it was seen (col, row).
    pub pixel: [f64; 2],
    /// Why it takes no part.
    pub reason: String,
}

impl StationPicture {
    /// That of a board.
    pub(crate) fn of_board(sighting: Sighting, kind: &BoardKind) -> Self {
        let pairs = sighting.pairs(kind).unwrap_or_default();
        let Sighting { station, light, board, observations } = sighting;
        let seen = board.map_err(|reason| reason.to_string()).map(|board| {
            let [columns, rows] = kind.size();
            let mark = |seen: &targets::NodePoint| Mark {
                at: seen.point.pixel,
                is_filled: seen.node == [0, 0],
                label: String::new(),
            };
            let first_row = board.nodes.iter().filter(|seen| seen.node[1] == 0);
            Seen {
                of: columns * rows,
                ambiguity: board.ambiguity,
                residual_px: Some(board.residual_px),
                unnamed: 0,
                unchecked: 0,
                left_out: Vec::new(),
                hidden: Vec::new(),
                marks: board.nodes.iter().map(mark).collect(),
                line: first_row.map(|seen| seen.point.pixel).collect(),
                pairs,
            }
        });
        Self { station, light, seen, observations }
    }

    /// Ranges among the observations.
    pub(crate) fn ranges(&self) -> usize {
        self.observations.iter().filter(|row| row.range_m.is_some()).count()
    }
}
