//! The camera's pose.

use std::sync::Arc;

use tracking::projective_registration::Projection;
use tracking::{TrackedPose, Tracker, TrackerOptions};

use crate::calibration::PreparedCalibration;
use crate::error::Result;
use crate::frame::ProcessedFrame;

/// A tracker, and the points that it may rest on.
#[derive(Debug)]
pub(crate) struct Pose {
    tracker: Tracker,
    options: TrackerOptions,
    points: Vec<[f64; 3]>,
    last: Option<TrackedPose>,
}

impl Pose {
    pub(crate) fn new(calibration: &PreparedCalibration, options: &TrackerOptions) -> Result<Self> {
        let tracker = tracker(calibration, options.clone())?;
        let points = vec![[f64::NAN; 3]; calibration.rays.directions().len()];
        Ok(Self { tracker, options: options.clone(), points, last: None })
    }

    /// A new map at the last pose, for other rays.
    pub(crate) fn begin_anew(&mut self, calibration: &PreparedCalibration) -> Result<()> {
        let mut options = self.options.clone();
        if let Some(last) = &self.last {
            options.world_from_first = last.world_from_camera;
        }
        self.tracker = tracker(calibration, options)?;
        Ok(())
    }

    pub(crate) fn track(&mut self, timestamp_s: f64, frame: &ProcessedFrame) -> Result<TrackedPose> {
        for (to, (point, flags)) in self.points.iter_mut().zip(frame.points.iter().zip(frame.flags.as_slice())) {
            *to = if flags.is_empty() { *point } else { [f64::NAN; 3] };
        }
        let sigma = frame.sigma.as_slice();
        let known = sigma.iter().any(|sigma| *sigma > 0.0);
        let pose = self.tracker.track(timestamp_s, &self.points, known.then_some(sigma), None)?;
        self.tracker.forget_poses();
        self.last = Some(pose);
        Ok(pose)
    }
}

fn tracker(calibration: &PreparedCalibration, options: TrackerOptions) -> Result<Tracker> {
    let format = calibration.rays.format();
    let directions = calibration.rays.directions();
    let projection =
        Projection::from_directions(format.width, format.height, directions).map_err(tracking::Error::from)?;
    Ok(Tracker::new(&Arc::new(projection), options)?)
}
