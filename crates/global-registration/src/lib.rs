#![doc = include_str!("../README.md")]

mod align;
mod cells;
mod description;
mod error;
mod hypotheses;
mod options;
mod verification;

pub use align::hypotheses;
pub use align::{CoarseAlignment, align_without_guess};
pub use description::feature_cloud::FeatureCloud;
pub use description::features::Features;
pub use description::rsd::SurfaceRadii;
pub use description::sift::{AmplitudeFeatureOptions, amplitude_features};
pub use error::Error;
pub use hypotheses::sparse::{SparseAlignment, SparseIcpOptions, align_features};
pub use nalgebra;
pub use options::{CoarseOptions, SharedError, SurfaceDescriptors, Viewpoint};
pub use point_cloud;
pub use rigid_pose;
pub use verification::among::{
    Placed, agreement, agreement_of_rooms, evidence, in_voxels, refined_among, with_one_voxel,
};
pub use verification::free_space::FreeSpace;
pub use verification::looked_through::{Look, LookedThrough};
