#![doc = include_str!("../README.md")]

mod back_projection;
mod camera;
mod covariance;
mod error;
mod lens;
#[cfg(feature = "convert")]
mod lens_fit;
mod lens_inverse;
mod observation;
#[cfg(feature = "convert")]
mod plumb_bob;
mod pose;
mod projection;
mod ray_table;

pub use back_projection::OrganisedCloud;
pub use camera::{Camera, InteriorOrientation, LensDistortion};
pub use covariance::{point_covariance, with_affinity_held};
pub use error::{Error, Result};
pub use observation::{Observation, ObservationJacobians};
#[cfg(feature = "convert")]
pub use plumb_bob::PlumbBob;
pub use pose::{
    computer_vision_from_photogrammetric, euler_from_pose, euler_from_rotation, pose_from_euler, rotation_from_euler,
    step_pose, with_computer_vision_axes,
};
pub use range_image::ImageFormat;
pub use ray_table::RayTable;
