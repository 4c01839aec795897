#![doc = include_str!("../README.md")]

mod absolute_orientation;
mod cloud;
mod coarse;
mod eigen;
mod error;
mod icp;
mod kernel;
#[cfg(feature = "multiview")]
mod multiview;
mod neighbours;
mod normals;
mod organised;
mod pose;
mod tracking;

pub use absolute_orientation::{Orientation, Similarity, absolute_orientation, absolute_orientation_with_scale};
pub use cloud::Cloud;
pub use coarse::{
    CoarseAlignment, CoarseOptions, Estimator, FeatureCloud, Features, Matching, SurfaceDescriptors, SurfaceRadii,
    Viewpoint, align_without_guess,
};
pub use error::{Error, Result};
pub use icp::{
    DegeneracyPolicy, IcpOptions, IcpResult, IcpTarget, Metric, MotionKind, Selection, StopReason, UndeterminedMotion,
    align,
};
pub use kernel::RobustKernel;
#[cfg(feature = "multiview")]
pub use multiview::{
    Datum, Overlap, PairAlignment, PairConstraint, PairResidual, RefusedPair, StationAdjustment,
    StationAdjustmentOptions, SurfaceAdjustment, SurfaceAdjustmentOptions, adjust_stations, adjust_surfaces,
    align_pairs, find_overlaps,
};
pub use neighbours::{Neighbour, NeighbourTree};
pub use normals::{OrganisedNormalOptions, UnorganisedNormalOptions, organised_normals, unorganised_normals};
pub use organised::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, Projection, align_frames};
pub use pose::{inverse_covariance_transport, pose_difference, step_pose};
pub use tracking::{
    Fusion, ImuIntegrator, ImuOptions, InertialSample, LossReason, MotionPrior, Relocalisation, TrackedPose, Tracker,
    TrackerOptions, TrackingState,
};
