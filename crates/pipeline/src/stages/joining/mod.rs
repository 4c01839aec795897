//! Stations brought into one frame.

pub(crate) mod adjust;
pub(crate) mod gathered;
pub(crate) mod register;

use multiview_registration::{PairAlignment, RefusedPair};
use point_cloud::Cloud;

use crate::survey::records::{AdjustmentFigures, StationPose};

pub(crate) use gathered::Gathered;

/// The stations in one frame.
#[derive(Debug, Default)]
pub(crate) struct Joined {
    /// One a view.
    pub(crate) poses: Vec<StationPose>,
    /// Aligned pairs.
    pub(crate) pairs: Vec<PairAlignment>,
    /// Pairs that overlap but could not be aligned reliably.
    pub(crate) refused: Vec<RefusedPair>,
    /// The simultaneous adjustment, where it ran.
    pub(crate) adjustment: Option<AdjustmentFigures>,
    /// Names of the stations and their unflagged points with normals, from `Register` on.
    pub(crate) names: Vec<String>,
    pub(crate) clouds: Vec<Cloud>,
}
