#![doc = include_str!("../README.md")]

mod error;
mod options;
mod partners;
mod preparation;
mod registration;
mod shared_error;

pub use error::Error;
pub use icp_registration;
pub use nalgebra;
pub use options::FrameAlignmentOptions;
pub use partners::map::{AbsorbScratch, Agreement, thumbnail_difference};
pub use point_cloud;
pub use preparation::frame::OrganisedFrame;
pub use preparation::projection::Projection;
pub use registration::aligner::{FrameAligner, align_frames};
pub use registration::consistency::{FrameConsistency, frame_consistency};
pub use rigid_pose;
pub use shared_error::SharedError;
pub use shared_error::{ByField, COEFFICIENTS, Field, FieldMatrix, Influence};
