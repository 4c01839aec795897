#![doc = include_str!("../README.md")]
// Index loops over triangles and blocks mirror the formulas; iterators would hide which triangle is meant.
#![allow(clippy::needless_range_loop)]

mod adjustment;
mod block;
mod check;
mod combination;
mod constraints;
mod covariance;
mod datum;
mod dense;
mod diagnosis;
mod error;
mod ids;
mod iteration;
mod kernel;
mod layout;
mod linearisation;
mod manifold;
mod normal;
mod observation;
mod options;
mod orthogonal;
mod prior;
mod quality;
mod rank;
mod rigid_pose;
mod solution;
mod trace;

pub use adjustment::Adjustment;
pub use block::ParameterBlock;
pub use check::{JacobianCheck, check_jacobian};
pub use combination::Combination;
pub use covariance::Covariance;
pub use datum::DatumDefect;
pub use diagnosis::Diagnosis;
pub use error::{Error, EvaluationFailure, Result};
pub use ids::{BlockId, GroupId, ObservationId};
pub use kernel::Kernel;
pub use manifold::{Euclidean, Manifold};
pub use observation::{FunctionObservation, Jacobians, LinearObservation, Observation};
pub use options::{Method, SolveOptions};
pub use quality::GroupSummary;
pub use rigid_pose::RigidPose;
pub use solution::{Scale, Solution};
pub use trace::{StepKind, TraceEntry};
