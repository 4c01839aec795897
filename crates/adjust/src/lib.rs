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
mod descent;
mod diagnosis;
mod distributions;
mod error;
mod exclusion;
mod ids;
mod information;
mod iteration;
mod joint;
mod kernel;
mod layout;
mod linearisation;
mod manifold;
mod normal;
mod observation;
mod options;
mod orthogonal;
mod outlier;
mod polish;
mod prior;
mod quality;
mod rank;
mod readmission;
mod reliability;
mod rigid_pose;
mod significance;
mod snooping;
mod solution;
mod trace;
mod transformation;
mod variance_components;
mod weakness;

pub use adjustment::Adjustment;
pub use block::ParameterBlock;
pub use check::{JacobianCheck, check_jacobian};
pub use combination::Combination;
pub use covariance::Covariance;
pub use datum::DatumDefect;
pub use diagnosis::Diagnosis;
pub use distributions::Distribution;
pub use error::{Error, EvaluationFailure, Result};
pub use ids::{BlockId, GroupId, ObservationId};
pub use information::{InformationCriteria, VarianceFactor};
pub use kernel::Kernel;
pub use manifold::{Euclidean, Manifold};
pub use observation::{FunctionObservation, Jacobians, LinearObservation, Observation};
pub use options::{Method, SolveOptions};
pub use outlier::{OutlierTest, SnoopingTest, Suspect};
pub use quality::GroupSummary;
pub use reliability::{ComponentReliability, ExternalReliability, ReliabilityOptions};
pub use rigid_pose::RigidPose;
pub use significance::Significance;
pub use snooping::{Rejection, SnoopedSolution, SnoopingEnd, SnoopingOptions};
pub use solution::{Scale, Solution};
pub use trace::{StepKind, TraceEntry};
pub use transformation::{DatumTransformation, Moving};
pub use variance_components::{
    ComponentPrecision, ComponentStatus, VarianceComponent, VarianceComponentOptions, VarianceComponents,
};
pub use weakness::{NearDefect, NearDefects, WeaknessOptions};
