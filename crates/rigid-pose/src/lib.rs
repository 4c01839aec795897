#![doc = include_str!("../README.md")]

mod absolute_orientation;
mod centred;
mod error;
mod motions;
mod requirements;
mod rotation;
mod single;
mod tangent;
mod uncertain;

pub use absolute_orientation::{
    Orientation, RotationMethod, Similarity, absolute_orientation, absolute_orientation_by,
    absolute_orientation_with_scale,
};
pub use centred::{Centred, MotionEquations, free_of, motion_length, symmetric};
pub use error::InputError;
pub use motions::eigen6;
pub use nalgebra;
pub use requirements::{
    is_finite, is_usable, require_count, require_length, require_option, require_points, require_pose, require_positive,
};
pub use rotation::{inverse_left_jacobian, left_jacobian};
pub use single::SinglePose;
pub use tangent::{inverse_covariance_transport, pose_difference, step_pose, symmetrised};
pub use uncertain::{Uncertain, inverse_jacobian, product_jacobians, relative_jacobians};
