#![doc = include_str!("../README.md")]

mod cloud;
mod coincident;
mod eigen;
mod error;
mod neighbours;
mod normals;

pub use cloud::{Cloud, middle_and_radius};
pub use eigen::{eigenvalues3, eigenvector3};
pub use error::Error;
pub use nalgebra;
pub use neighbours::{Neighbour, NeighbourTree};
pub use normals::{
    OrganisedNormalOptions, SAME_SURFACE_COSINE, UnorganisedNormalOptions, no_normal, normals_with_tree,
    organised_normals, unorganised_normals,
};
pub use rigid_pose;
