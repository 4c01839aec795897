//! What was measured, by name.

use std::collections::BTreeMap;
use std::path::PathBuf;

use commands::{Doubt, Judged, Verdict};
use serde::Serialize;

/// Lengths with their standard deviations.
#[derive(Debug, Clone, Default, Serialize)]
pub struct MeasureSummary {
    /// Folder of the result that was measured in.
    pub result: String,
    /// The file of regions and lengths.
    pub plan: String,
    /// The calibration that the common errors name.
    pub calibration: Option<String>,
    /// Common errors that took part; none: noise alone.
    pub common_errors: usize,
    /// Points of the cloud.
    pub points: usize,
    /// Points with a flag, which take no part.
    pub flagged_points: usize,
    /// What was found in each region.
    pub regions: BTreeMap<String, RegionSummary>,
    /// The lengths, in the order of the plan.
    pub lengths: Vec<LengthSummary>,
    /// What a reader should know, in sentences.
    pub findings: Vec<String>,
    /// What speaks against the result.
    pub doubts: Vec<Doubt>,
    /// Time taken.
    pub seconds: f64,
    /// Where it was written.
    pub out: PathBuf,
}

/// What was found in a region.
#[derive(Debug, Clone, Default, Serialize)]
pub struct RegionSummary {
    /// `plane`, `sphere`, `cylinder`, `mean`, `surface`, `nearest`, `fixed`, `direction` or `known_plane`.
    pub kind: &'static str,
    /// Points without flag in the region.
    pub points: usize,
    /// Points of it that belong to something else.
    pub left_out: usize,
    /// Points of it without position or standard deviation.
    pub unusable: usize,
    /// Middle of a plane, centre of a sphere, point of an axis, place, metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub position_m: Option<[f64; 3]>,
    /// Normal or axis.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f64; 3]>,
    /// Radius, metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f64>,
    /// Scatter of the points in parts of the stated one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sigma0: Option<f64>,
    /// Probability of so much scatter or more, if points scatter as stated.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub probability: Option<f64>,
    /// Why nothing was found.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// One length, angle or volume.
#[derive(Debug, Clone, Default, Serialize)]
pub struct LengthSummary {
    /// Name.
    pub name: String,
    /// `distance`, `angle`, `radius`, `diameter`, `flatness` or `volume`.
    pub kind: &'static str,
    /// Value; `None` where it could not be measured.
    pub value: Option<f64>,
    /// `m`, `deg` or `m3`.
    pub unit: &'static str,
    /// Standard deviation from all sources.
    pub sigma: Option<f64>,
    /// Lower and upper end of the 95 % interval.
    pub interval: Option<[f64; 2]>,
    /// Shares of the variance by source; they add up to one.
    pub shares: BTreeMap<&'static str, f64>,
    /// Standard deviation that would be stated if a source had no errors.
    pub without: Vec<SigmaWithout>,
    /// Robust spread, and what of it noise alone gives, of a flatness.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flatness: Option<FlatnessSummary>,
    /// Where the distance of planes is taken, metre.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub taken_at_m: Option<[f64; 3]>,
    /// Cells of a volume's footprint without points.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub missing: Option<MissingCells>,
    /// What belongs to the value.
    pub remarks: Vec<String>,
    /// Why it could not be measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub refused: Option<String>,
}

/// Cells of which nothing is known.
#[derive(Debug, Clone, Default, Serialize)]
pub struct MissingCells {
    /// How many.
    pub cells: usize,
    /// Their area in the footprint, square metre.
    pub area_m2: f64,
    /// Their middles on the plane, metre; of the first thousand.
    pub middles_m: Vec<[f64; 3]>,
}

/// Standard deviation and interval without a source of errors.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct SigmaWithout {
    /// The source that is left out.
    pub source: &'static str,
    /// Standard deviation of the others.
    pub sigma: f64,
    /// 95 % interval of the others.
    pub interval: [f64; 2],
}

/// Spread of a region across its plane.
#[derive(Debug, Clone, Copy, Serialize)]
pub struct FlatnessSummary {
    /// Robust standard deviation of the points across the plane, metre.
    pub spread_m: f64,
    /// What noise alone would give, metre.
    pub noise_m: f64,
    /// Probability of so much scatter or more on a perfect plane.
    pub probability: f64,
}

impl Judged for MeasureSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    fn verdict(&self) -> Verdict {
        if self.lengths.iter().any(|length| length.refused.is_some()) {
            Verdict::Partial
        } else if self.doubts.is_empty() {
            Verdict::Done
        } else {
            Verdict::Doubtful
        }
    }
}
