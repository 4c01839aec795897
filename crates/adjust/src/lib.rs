#![doc = include_str!("../README.md")]
// Index loops over triangles and blocks mirror the formulas; iterators would hide which triangle is meant.
#![allow(clippy::needless_range_loop)]

mod arrays;
mod cofactors;
mod combination;
mod descent;
mod equations;
mod error;
mod linearised;
mod model;
mod parameters;
mod result;
mod testing;

pub use combination::Combination;
pub use descent::descend::Descent;
pub use descent::options::{Method, SolveOptions};
pub use descent::trace::{StepKind, TraceEntry};
pub use error::{Error, EvaluationFailure, Result};
pub use model::adjustment::Adjustment;
pub use model::check::{JacobianCheck, check_jacobian};
pub use model::covariance::Covariance;
pub use model::datum_defect::DatumDefect;
pub use model::differentiated::{Differentiated, Parameters, Pose, ResidualFunction};
pub use model::kernel::Kernel;
pub use model::observation::{FunctionObservation, Jacobians, LinearObservation, Observation};
pub use parameters::block::ParameterBlock;
pub use parameters::differentiation::dual::{Dual, Tape};
pub use parameters::differentiation::real::Real;
pub use parameters::ids::{BlockId, GroupId, ObservationId};
pub use parameters::manifold::{Euclidean, Manifold};
pub use parameters::rigid_pose::RigidPose;
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
