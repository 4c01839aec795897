#![doc = include_str!("../README.md")]

mod cloud;
mod error;
mod fit;
mod flatness;
mod quantity;
mod region;
mod volume;

pub use cloud::Cloud;
pub use error::Error;
use error::Result;
pub use fit::{
    FitOptions, FittedCylinder, FittedPlane, FittedSphere, Scatter, Shape, Support, fit_cylinder, fit_plane, fit_sphere,
};
pub use flatness::{Flatness, flatness};
pub use nalgebra;
pub use point_uncertainty;
pub use quantity::{
    Direction, Estimate, Place, PlaneDistance, Quantity, Unit, angle, axis_distance, plane_distance, plane_to_plane,
    point_distance,
};
pub use region::{HalfSpace, Region};
pub use volume::{Base, Cell, Volume, VolumeOptions, volume};
