#![doc = include_str!("../README.md")]

mod board;
mod circles;
mod coded;
mod dot_grids;
mod error;
mod grid;
mod image;
mod lights;
mod print;
mod sightings;
mod spheres;

pub use board::{Checkerboard, CheckerboardOptions, find_checkerboard};
pub use camera_model;
pub use circles::eccentricity::{CircleCentre, CirclePose, centre_of_circle, poses_of_circle};
pub use circles::ellipse::Ellipse;
pub use circles::find::{CircleSighting, find_circles};
pub use circles::options::{CircleOptions, Polarity};
pub use coded::{Code, CodedOptions, CodedSighting, codes, find_coded};
pub use dot_grids::{CircleGrid, CircleGridOptions, find_circle_grid};
use error::Result;
pub use error::{Error, NotFound};
pub use lights::{LightOptions, LightSighting, find_lights};
pub use nalgebra;
pub use print::{INFRARED_NOTE, PaperSize, print_checkerboard, print_circle_grid, print_coded};
pub use range_image;
pub use sightings::measured_point::{BoardSighting, MeasuredPoint, NodePoint};
pub use sightings::principal_distance::principal_distance_px;
pub use sightings::target_range::{DarkRange, TargetRange, target_range};
pub use spheres::{SphereOptions, SphereSighting, find_spheres};
