#![doc = include_str!("../README.md")]

mod coarse;
mod error;
mod icp;
mod kernel;
#[cfg(feature = "mesh")]
mod mesh;
#[cfg(feature = "multiview")]
mod multiview;
mod organised;
pub mod parts;
mod pose_graph;
mod quality;
mod tracking;
mod trajectory;
mod voxels;

pub use coarse::{
    AmplitudeFeatureOptions, CoarseAlignment, CoarseOptions, Estimator, FeatureCloud, Features, Matching,
    SparseAlignment, SparseIcpOptions, SurfaceDescriptors, SurfaceRadii, Viewpoint, align_features,
    align_without_guess, amplitude_features,
};
pub use error::{Error, Result};
pub use icp::{
    Alternative, DegeneracyPolicy, IcpOptions, IcpResult, IcpTarget, Levels, Metric, MotionKind, Registration,
    Selection, Starts, StopReason, System, UndeterminedMotion, align,
};
pub use kernel::RobustKernel;
#[cfg(feature = "multiview")]
pub use multiview::{
    Datum, FrameRegistration, LoopClosure, PairAgreement, PairAlignment, PlacedFrame, Placement, Placements,
    PointModel, RefusedPair, SharedParameters, Start, StationPlacement, StationRegistration,
    StationRegistrationOptions, SurfacePair, UncheckedPair, UndeterminedStation, UnplacedFrame, judge_placements, register_frames,
    register_stations,
};
pub use organised::{
    FrameAligner, FrameAlignmentOptions, FrameConsistency, OrganisedFrame, Projection, SharedError, align_frames,
    frame_consistency,
};
pub use point_cloud::{self, Cloud};
pub use rigid_pose;
pub use tracking::{
    Fusion, ImuIntegrator, ImuOptions, InertialSample, LossReason, MotionPrior, Relocalisation, TrackedPose, Tracker,
    TrackerOptions, TrackingState,
};
pub use trajectory::{
    AbsoluteTrajectoryError, ErrorStatistics, MatchedPose, RelativeError, RelativePoseError, RelativeStep,
    TrajectoryAlignment, TrajectoryErrorOptions, absolute_trajectory_error, relative_pose_error,
};
pub use voxels::{VoxelAlignmentOptions, VoxelCloud, VoxelOptions, downsample};
