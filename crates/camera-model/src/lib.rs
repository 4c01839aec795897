#![doc = include_str!("../README.md")]

mod back_projection;
mod camera;
mod covariance;
mod error;
mod footprint;
mod lenses;
mod observation;
mod pose;
mod pose_covariance;
mod projection;
mod ray_table;

#[cfg(feature = "convert")]
pub use adjust;
pub use back_projection::OrganisedCloud;
pub use camera::{Camera, InteriorOrientation, LensDistortion};
pub use covariance::{point_covariance, with_affinity_held};
pub use error::Error;
use error::Result;
pub use footprint::Footprint;
#[cfg(feature = "convert")]
pub use lenses::plumb_bob::PlumbBob;
#[cfg(feature = "convert")]
pub use lenses::rational::Rational;
pub use nalgebra;
pub use observation::{Observation, ObservationJacobians};
pub use pose::{
    computer_vision_from_photogrammetric, euler_from_pose, euler_from_rotation, pose_from_euler, rotation_from_euler,
    step_pose, with_computer_vision_axes,
};
pub use pose_covariance::pose_covariance;
pub use range_image;
pub use range_image::ImageFormat;
pub use ray_table::RayTable;
