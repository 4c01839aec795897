#![doc = include_str!("../README.md")]

// The building of the examples stands among the tests inside the crate as well.
#[cfg(test)]
extern crate self as multiview_registration;

mod adjustment;
mod agreement;
mod error;
mod pairs_of_frames;
mod places;
mod planes;
mod relative_pose;
mod surfaces;
mod survey;

pub use adjustment::joint_covariance::JointCovariance;
pub use adjustment::turns::MeasuredTurn;
pub use agreement::alignments::{PairAlignment, RefusedPair};
pub use agreement::loops::LoopClosure;
pub use agreement::placement::{PairAgreement, Placement, Placements, StationPlacement, judge_placements};
pub use error::Error;
use error::Result;
pub use global_registration;
pub use icp_registration;
pub use nalgebra;
pub use pairs_of_frames::frames::{FrameRegistration, PlacedFrame, UncheckedPair, UnplacedFrame, register_frames};
pub use point_cloud;
pub use projective_registration;
pub use rigid_pose;
pub use surfaces::point_model::{PointModel, SharedParameters};
pub use survey::datum::Datum;
pub use survey::registration::{
    Effort, Start, StationRegistration, StationRegistrationOptions, SurfacePair, UndeterminedStation,
};
pub use survey::stations::register_stations;
