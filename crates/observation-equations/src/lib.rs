#![doc = include_str!("../README.md")]

mod check;
mod covariance;
mod derivatives;
mod error;
mod kernel;
mod observation;
mod parameters;
mod prior;

pub use check::{JacobianCheck, check_jacobian};
pub use covariance::Covariance;
pub use derivatives::differentiated::{Differentiated, Parameters, Pose, ResidualFunction};
pub use derivatives::dual::{Dual, Tape, TapeMemory};
pub use derivatives::real::Real;
use error::Result;
pub use error::{Error, EvaluationFailure};
pub use kernel::Kernel;
pub use nalgebra;
pub use observation::{FunctionObservation, Jacobians, LinearObservation, Named, Observation};
pub use parameters::block::ParameterBlock;
pub use parameters::block_id::BlockId;
pub use parameters::manifold::{Euclidean, Manifold};
pub use parameters::rigid_pose::RigidPose;
pub use prior::PriorObservation;
