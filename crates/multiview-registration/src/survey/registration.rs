//! From the clouds of many stations to one coordinate system: options and result.

use std::sync::Arc;

use nalgebra::{Isometry3, Matrix6};

use crate::adjustment::joint_covariance::JointCovariance;
use crate::adjustment::turns::MeasuredTurn;
use crate::agreement::alignments::PairAlignment;
use crate::agreement::loops::LoopClosure;
use crate::agreement::placement::Placements;
use crate::surfaces::patches::Surface;
use crate::surfaces::point_model::{PointModel, SharedParameters};
use icp_registration::UndeterminedMotion;

/// What is known of the stations beforehand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Start<'a> {
    /// Approximate poses `world_from_station`, one a station.
    Poses(&'a [Isometry3<f64>]),
    /// Stations that follow each other overlap; nothing else is known.
    Order,
    /// Nothing: all pairs are tried.
    Nothing,
}

/// Options of [`crate::register_stations`]. The defaults carry no scale: lengths left at `None` come from the clouds.
#[derive(Clone)]
pub struct StationRegistrationOptions<'a> {
    /// How far approximate poses may be off, metre, rotations at the radius of a cloud. `None`, the default: a fifth of
    /// that radius.
    pub start_error_m: Option<f64>,
    /// Size of the patches that the surfaces are divided into, metre. `None`, the default: about 25 points a patch.
    pub patch_m: Option<f64>,
    /// Smallest part of a station that must overlap another for the two to be aligned as a pair. Default 0.3.
    /// The simultaneous adjustment takes whatever overlaps.
    pub minimum_overlap: f64,
    /// Turns between stations that an inertial unit measured: they choose among the poses that features allow, and are observations of
    /// the adjustment beside the surfaces. Default: none.
    pub turns: &'a [MeasuredTurn],
    /// Parameters that all stations share, to be estimated with the poses. Default: none.
    pub model: Option<&'a dyn PointModel>,
}

impl Default for StationRegistrationOptions<'_> {
    fn default() -> Self {
        Self { start_error_m: None, patch_m: None, minimum_overlap: 0.3, turns: &[], model: None }
    }
}

impl std::fmt::Debug for StationRegistrationOptions<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("StationRegistrationOptions")
            .field("start_error_m", &self.start_error_m)
            .field("patch_m", &self.patch_m)
            .field("minimum_overlap", &self.minimum_overlap)
            .field("turns", &self.turns)
            .field("model", &self.model.map(PointModel::names))
            .finish_non_exhaustive()
    }
}

/// How the surfaces of two stations lie on each other after the adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfacePair {
    /// Index of the target station, smaller than `source`.
    pub target: usize,
    /// Index of the source station.
    pub source: usize,
    /// Part of the tiles of common surfaces that the source saw which the target saw too.
    pub overlap: f64,
    /// Tiles, of about the size of a patch, that both saw.
    pub contacts: usize,
    /// Weighted mean distance, source before target along the target's normals, metre: what a surface seen from both is
    /// apart.
    pub mean_m: f64,
    /// Weighted root mean square distance, metre.
    pub rms_m: f64,
    /// The same in expected standard deviations.
    pub rms_sigma: f64,
    /// Part of the tiles that the robust kernel took the weight from.
    pub outliers: f64,
}

/// A station with a motion that the surfaces tell no better than to the size of a patch: it stayed near its start value
/// along it.
#[derive(Debug, Clone, PartialEq)]
pub struct UndeterminedStation {
    /// Index of the station.
    pub station: usize,
    /// The motions, axes and points in the common frame.
    pub motions: Vec<UndeterminedMotion>,
}

/// What a registration looked at: for stations that see some others each, it grows with their number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Effort {
    /// Pairs of stations whose surfaces were held against each other in the last rounds.
    pub pairs_tried: usize,
    /// Blocks of two stations (or planes that very many saw) that the factor of the normal equations holds.
    pub filled_blocks: usize,
}

/// All stations in one frame.
#[derive(Debug, Clone)]
pub struct StationRegistration {
    /// Adjusted poses, in the order of the stations.
    pub world_from_station: Vec<Isometry3<f64>>,
    /// Covariance of each pose in the tangent `[dt world axes, dtheta station axes]`; zero for a station that is the
    /// datum.
    pub covariance: Vec<Matrix6<f64>>,
    /// Covariance of all unknowns.
    pub joint_covariance: JointCovariance,
    /// Pairs with much overlap by themselves, at the adjusted poses.
    pub pairs: Vec<PairAlignment>,
    /// How loops of pairs close.
    pub loops: Vec<LoopClosure>,
    /// All pairs whose surfaces took part in the adjustment, with their residuals.
    pub surfaces: Vec<SurfacePair>,
    /// Whether the stations lie where what they see agrees with what the others see: a station that fits walls in the
    /// wrong place shows in no other figure.
    pub placements: Placements,
    /// Stations that something leaves open; empty for a sound network.
    pub undetermined: Vec<UndeterminedStation>,
    /// Standard deviation of unit weight: 1 where tiles seen from several stations differ as the noise of their points
    /// says. What is beyond is in the covariance. `None` without redundancy.
    pub sigma0: Option<f64>,
    /// Observations less unknowns, tiles that are seen by k stations counted k − 1 times.
    pub redundancy: i64,
    /// Last rounds of the adjustment.
    pub rounds: usize,
    /// Whether the last round moved no station by more than the tolerance. Where it is not, stations still slide along a
    /// weak direction and may be decimetres away: do not trust the poses.
    pub settled: bool,
    /// How much was looked at.
    pub effort: Effort,
    /// Parameters of the [`PointModel`].
    pub parameters: Option<SharedParameters>,
    pub(crate) prepared: Arc<Vec<Surface>>,
}

/// Standard deviation of unit weight beyond which surfaces differ by more than the noise of their points: 0.9 to 1.1 on simulated
/// surveys, 4 to 8 on frames of a Kinect.
const MOST_OVER_NOISE: f64 = 2.0;

impl StationRegistration {
    /// Whether surfaces differ by no more than the noise of their points. Errors that neighbouring points share, as those of structured
    /// light, are no noise of surfaces: where frames have them, [`crate::register_frames`] knows them.
    pub fn fits_noise(&self) -> bool {
        self.sigma0.is_none_or(|sigma0| sigma0 <= MOST_OVER_NOISE)
    }

    /// Pose and covariance of one station in the frame of another, in the tangent `[dt target axes, dtheta source axes]`.
    ///
    /// # Errors
    /// [`crate::Error::NoSuchStation`].
    pub fn relative_pose(&self, target: usize, source: usize) -> crate::Result<(Isometry3<f64>, Matrix6<f64>)> {
        let count = self.world_from_station.len();
        if let Some(station) = [target, source].into_iter().find(|station| *station >= count) {
            return Err(crate::Error::NoSuchStation { station, count });
        }
        Ok(self.joint_covariance.relative_pose(&self.world_from_station, target, source))
    }
}
