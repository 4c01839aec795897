//! Stations brought into one frame.
//!
//! `Register` brings them there with all surfaces at once, which is the simultaneous adjustment already. From the survey's
//! poses `Adjust` takes it as it is: done again, no station of the room moved by more than 0.03 µm. Where there were none it
//! adjusts again from the poses that `Register` found, as it does where each station was aligned onto the one before: in the
//! room with one pixel in a hundred wrong, stations moved by 0.03 mm, a fifth of their standard deviation, and came 5 % closer
//! to the truth.

pub(crate) mod adjust;
pub(crate) mod gathered;
pub(crate) mod register;

use multiview_registration::{PairAlignment, RefusedPair, StationRegistration, UncheckedPair, UnplacedFrame};
use nalgebra::Isometry3;
use point_cloud::Cloud;

use crate::stations::poses_in;
use crate::survey::records::{AdjustmentFigures, StationPose};

pub(crate) use gathered::Gathered;

/// The stations in one frame.
#[derive(Debug, Default)]
pub(crate) struct Joined {
    /// One a view; `None`: `left_out` says why.
    pub(crate) poses: Vec<Option<StationPose>>,
    /// Views that do not belong to the others.
    pub(crate) left_out: Vec<UnplacedFrame>,
    /// Aligned pairs.
    pub(crate) pairs: Vec<PairAlignment>,
    /// Pairs of frames that overlap but could not be aligned reliably.
    pub(crate) refused: Vec<RefusedPair>,
    /// Pairs of frames that nothing checks.
    pub(crate) unchecked: Vec<UncheckedPair>,
    /// All surfaces at once, where `Register` found them from the survey's poses.
    pub(crate) registered: Option<Registered>,
    /// The simultaneous adjustment, where it ran.
    pub(crate) adjustment: Option<AdjustmentFigures>,
    /// Names of the stations and their unflagged points with normals, from `Register` on; no points of frames without amplitudes.
    pub(crate) names: Vec<String>,
    pub(crate) clouds: Vec<Cloud>,
}

/// The simultaneous adjustment of all surfaces, without what the stations were made of.
#[derive(Debug)]
pub(crate) struct Registered {
    /// As those of [`Joined`].
    pub(crate) poses: Vec<Option<StationPose>>,
    /// Smallest overlap of its pairs; `None` of pairs of frames, which no overlap chooses.
    pub(crate) minimum_overlap: Option<f64>,
    /// Pairs of stations that share surfaces, and rounds.
    pub(crate) surfaces: usize,
    pub(crate) rounds: usize,
    /// Whether the last round moved no station any more.
    pub(crate) settled: bool,
    pub(crate) figures: AdjustmentFigures,
}

impl Registered {
    /// Moved into the world, with the pairs.
    pub(crate) fn new(
        found: StationRegistration,
        world_from_registered: &Isometry3<f64>,
        minimum_overlap: f64,
    ) -> (Self, Vec<PairAlignment>) {
        let poses = poses_in(world_from_registered, &found).into_iter().map(Some).collect();
        let StationRegistration { sigma0, redundancy, placements, rounds, settled, .. } = found;
        let figures = AdjustmentFigures { sigma0, redundancy, placements };
        let surfaces = found.surfaces.len();
        (Self { poses, minimum_overlap: Some(minimum_overlap), surfaces, rounds, settled, figures }, found.pairs)
    }
}
