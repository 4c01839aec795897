#![doc = include_str!("../README.md")]

mod absolute_orientation;
mod centred;
mod error;
mod motions;
mod tangent;
mod uncertain;

pub use absolute_orientation::{
    Orientation, RotationMethod, Similarity, absolute_orientation, absolute_orientation_by,
    absolute_orientation_with_scale,
};
pub use centred::{Centred, MotionEquations, free_of, symmetric};
pub use error::Error;
pub use motions::eigen6;
pub use nalgebra;
pub use tangent::{inverse_covariance_transport, is_finite, pose_difference, step_pose, symmetrised};
pub use uncertain::{Uncertain, inverse_jacobian, product_jacobians};
