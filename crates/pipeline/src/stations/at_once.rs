//! All stations registered at once: what the stages `Register` and `Adjust` and the command `rangecam register` share.

use multiview_registration::rigid_pose::Uncertain;
use multiview_registration::{
    Datum, Error, FrameRegistration, MeasuredTurn, Start, StationRegistration, StationRegistrationOptions,
    register_frames, register_stations,
};
use nalgebra::{Isometry3, Matrix6};
use point_cloud::Cloud;
use projective_registration::{FrameAlignmentOptions, OrganisedFrame};

use crate::survey::records::StationPose;
use commands::Progress;

/// Registers clouds with the first one as datum. `limits` are the smallest overlap of a pair and how far the start may be off,
/// metre; `None`: the defaults for clouds of unknown origin. `turns` are those that an inertial unit measured. Progress that has begun is advanced.
///
/// # Errors
/// As [`register_stations`].
pub fn register_at_once(
    clouds: &[Cloud],
    start: Start<'_>,
    limits: Option<(f64, f64)>,
    turns: &[MeasuredTurn],
    progress: &dyn Progress,
) -> Result<StationRegistration, Error> {
    let mut options = StationRegistrationOptions { turns, ..StationRegistrationOptions::default() };
    if let Some((minimum_overlap, start_error_m)) = limits {
        (options.minimum_overlap, options.start_error_m) = (minimum_overlap, Some(start_error_m));
    }
    register_stations(clouds, start, Datum::Station(0), &options, &|done, _| progress.advance(done))
}

/// Up to this number of stations every pair is tried where no poses are known; beyond, only those that follow each other.
pub const MOST_TRIED: usize = 16;

/// Registers frames of one camera by pairs of them, where surfaces differ by more than the noise of their points.
///
/// # Errors
/// As [`register_frames`].
pub fn register_as_frames(
    frames: &[OrganisedFrame],
    before: Option<&[Isometry3<f64>]>,
) -> Result<FrameRegistration, Error> {
    let start = match before {
        Some(poses) => Start::Poses(poses),
        None if frames.len() <= MOST_TRIED => Start::Nothing,
        None => Start::Order,
    };
    register_frames(frames, start, &FrameAlignmentOptions::default(), &|_, _| {})
}

/// The poses with their covariance, in another frame than that of the registration.
pub fn poses_in(world_from_registered: &Isometry3<f64>, found: &StationRegistration) -> Vec<StationPose> {
    let world = Uncertain::exact(*world_from_registered);
    let pose = |(pose, covariance): (&Isometry3<f64>, &Matrix6<f64>)| {
        let pose = world.then(&Uncertain { pose: *pose, covariance: *covariance });
        StationPose { world_from_camera: pose.pose, covariance: Some(pose.covariance) }
    };
    found.world_from_station.iter().zip(&found.covariance).map(pose).collect()
}
