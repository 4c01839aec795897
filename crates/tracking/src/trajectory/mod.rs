//! How well an estimated trajectory fits a known one: absolute error after alignment, relative error over steps
//! (`[Sturm2012]`).

mod absolute;
mod association;
mod relative;
mod statistics;

pub use absolute::{
    AbsoluteTrajectoryError, MatchedPose, TrajectoryAlignment, TrajectoryErrorOptions, absolute_trajectory_error,
};
pub use relative::{RelativeError, RelativePoseError, RelativeStep, relative_pose_error};
pub use statistics::ErrorStatistics;
