#![doc = include_str!("../README.md")]
// Index loops over triangles and blocks mirror the formulas; iterators would hide which triangle is meant.
#![allow(clippy::needless_range_loop)]

mod cofactors;
mod combination;
mod descent;
mod equations;
mod error;
mod linearised;
mod model;
mod result;
mod testing;

pub use combination::Combination;
pub use descent::descend::Descent;
pub use descent::options::{Method, SolveOptions};
pub use descent::trace::{StepKind, TraceEntry};
pub use error::Error;
use error::Result;
pub use model::adjustment::Adjustment;
pub use model::datum_defect::DatumDefect;
pub use model::ids::{GroupId, ObservationId};
pub use nalgebra;
// Errors of observation equations, and what makes Jacobians, are reached through the crate itself.
pub use observation_equations;
pub use observation_equations::{
    BlockId, Covariance, Differentiated, Dual, Euclidean, EvaluationFailure, FunctionObservation, JacobianCheck,
    Jacobians, Kernel, LinearObservation, Manifold, Observation, ParameterBlock, Parameters, Pose, Real,
    ResidualFunction, RigidPose, Tape, check_jacobian,
};
pub use result::diagnosis::Diagnosis;
pub use result::information::{InformationCriteria, VarianceFactor};
pub use result::left_out::LeftOut;
pub use result::quality::GroupSummary;
pub use result::solution::{Scale, Solution};
pub use result::transformation::{DatumTransformation, Moving};
pub use result::weakness::{NearDefect, NearDefects, WeaknessOptions};
// Of the statistic in [`Significance`].
pub use statistics::Distribution;
pub use testing::global_test::{GlobalTest, GlobalVerdict};
pub use testing::outlier::{OutlierTest, SnoopingTest, Suspect};
pub use testing::reliability::{ComponentReliability, ExternalReliability, ReliabilityOptions};
pub use testing::significance::Significance;
pub use testing::snooping::{Rejection, SnoopedSolution, SnoopingEnd, SnoopingOptions};
pub use testing::variance_components::{
    ComponentPrecision, ComponentStatus, VarianceComponent, VarianceComponentOptions, VarianceComponents,
};
