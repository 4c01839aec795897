//! The camera's pose.

use std::sync::Arc;

use range_image::with_wide_registers;
use tracking::nalgebra::Isometry3;
use tracking::projective_registration::Projection;
use tracking::{Relocalisation, SurfaceMap, TrackedPose, Tracker, TrackerOptions, TrackingState};

use crate::calibration::PreparedCalibration;
use crate::error::Result;
use crate::frame::ProcessedFrame;

/// Time that a cut of unknown length counts as, second: a velocity says nothing of the pose behind it, so the frame is sought.
const CUT_S: f64 = 10.0;

/// A tracker, and the points or deviations of those that it may rest on.
#[derive(Debug)]
pub(crate) struct Pose {
    tracker: Tracker,
    options: TrackerOptions,
    /// Where deviations are not known.
    points: Vec<[f32; 3]>,
    sigma: Vec<f32>,
    last: Option<TrackedPose>,
    /// The tracker's time of the last frame, and what it is ahead of the frames' clock by.
    clock: Option<[f64; 2]>,
    is_cut: bool,
}

impl Pose {
    pub(crate) fn new(calibration: &PreparedCalibration, options: &TrackerOptions) -> Result<Self> {
        let tracker = tracker(calibration, options.clone())?;
        let sigma = vec![f32::NAN; calibration.rays.directions().len()];
        Ok(Self {
            tracker,
            options: options.clone(),
            points: Vec::new(),
            sigma,
            last: None,
            clock: None,
            is_cut: false,
        })
    }

    /// A new map at the last pose, for other rays; what was seen stays in the map that is kept.
    pub(crate) fn begin_anew(&mut self, calibration: &PreparedCalibration) -> Result<()> {
        let mut options = self.options.clone();
        if let Some(last) = self.last.filter(|last| last.state.has_pose()) {
            options.world_from_first = last.world_from_camera;
        }
        let mut tracker = tracker(calibration, options)?;
        if let Some(map) = self.tracker.surface_map() {
            tracker.keep_map(map);
        }
        (self.tracker, self.clock) = (tracker, None);
        Ok(())
    }

    /// Where the first frame is; nothing has changed once tracking has started.
    pub(crate) fn place_first(&mut self, calibration: &PreparedCalibration, pose: Isometry3<f64>) -> Result<()> {
        if self.tracker.keyframes() > 0 || self.options.world_from_first == pose {
            return Ok(());
        }
        self.options.world_from_first = pose;
        let mut tracker = tracker(calibration, self.options.clone())?;
        if let Some(map) = self.tracker.surface_map() {
            tracker.keep_map(map);
        }
        self.tracker = tracker;
        Ok(())
    }

    pub(crate) fn keep_map(&mut self, map: SurfaceMap) {
        self.tracker.keep_map(map);
    }

    pub(crate) fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// The times of the frames to come have nothing to do with those before.
    pub(crate) fn cut(&mut self) {
        self.is_cut = true;
    }

    pub(crate) fn track(&mut self, timestamp_s: f64, frame: &ProcessedFrame) -> Result<TrackedPose> {
        let ahead_s = match self.clock {
            Some([last_s, _]) if self.is_cut => last_s + CUT_S - timestamp_s,
            Some([_, ahead_s]) => ahead_s,
            None => 0.0,
        };
        let time_s = timestamp_s + ahead_s;
        let pose = if frame.sigma.as_slice().iter().any(|sigma| *sigma > 0.0) {
            // Points without a deviation take no part, which leaves the points themselves where they are.
            let kept = &mut self.sigma;
            with_wide_registers(
                #[inline(always)]
                || {
                    let pixels = kept.iter_mut().zip(frame.sigma.as_slice()).zip(frame.flags.as_slice());
                    pixels.for_each(|((to, sigma), flags)| *to = if flags.is_empty() { *sigma } else { f32::NAN });
                },
            );
            self.tracker.track(time_s, &frame.points, Some(&self.sigma), None)?
        } else {
            let kept = frame.points.iter().zip(frame.flags.as_slice());
            self.points.clear();
            self.points.extend(kept.map(|(point, flags)| if flags.is_empty() { *point } else { [f32::NAN; 3] }));
            self.tracker.track(time_s, &self.points, None, None)?
        };
        self.tracker.forget_poses();
        (self.clock, self.is_cut) = (Some([time_s, ahead_s]), false);
        let pose = TrackedPose { timestamp_s, ..pose };
        // Behind a loss the last pose that was known is the one to go on from.
        if !matches!(pose.state, TrackingState::Lost(_)) {
            self.last = Some(pose);
        }
        Ok(pose)
    }
}

fn tracker(calibration: &PreparedCalibration, mut options: TrackerOptions) -> Result<Tracker> {
    // Frames do not wait for a search.
    if options.relocalisation == Relocalisation::Coarse {
        options.relocalisation = Relocalisation::Beside;
    }
    let format = calibration.rays.format();
    let directions = calibration.rays.directions();
    let projection =
        Projection::from_directions(format.width, format.height, directions).map_err(tracking::Error::from)?;
    Ok(Tracker::new(&Arc::new(projection), options)?)
}
