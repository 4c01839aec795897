//! The camera's path as its frames pass.

use std::fmt;
use std::path::PathBuf;

use live_frames::tracking::nalgebra::{Matrix6, Vector3};
use live_frames::tracking::{SurfaceMap, TrackedPose, Tracker, TrackingState};
use serde::Serialize;

use crate::streams::pose_numbers;

/// What can be done with a path.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PathVerdict {
    /// Every frame has a pose.
    #[default]
    Tracked,
    /// Some frames have none; the camera was found again.
    Interrupted,
    /// The camera was lost and not found again until the end, or most frames have no pose: no success.
    Lost,
}

/// Frames without a pose that follow each other.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathLoss {
    /// Time of the first of them, second.
    pub from_s: f64,
    /// Time of the frame at which the camera was found again, second; `None` where it was not.
    pub found_s: Option<f64>,
    /// Frames.
    pub frames: u64,
    /// Reason at the first of them.
    pub reason: &'static str,
}

/// The pose of the last frame.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathStatus {
    /// `started`, `tracked`, `relocalised` or `lost`.
    pub state: &'static str,
    /// Why it is lost.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub reason: Option<&'static str>,
    /// Pose as in a line of a trajectory: `tx ty tz qx qy qz qw`, camera to world, computer-vision axes. `None` where the frame
    /// has none.
    pub pose: Option<[f64; 7]>,
    /// Standard deviation of the position in space since the datum, metre.
    pub position_sigma_m: Option<f64>,
    /// Standard deviation of the attitude about all axes, degree.
    pub attitude_sigma_deg: Option<f64>,
    /// Frames without a pose, so far.
    pub lost: u64,
    /// Frames without a pose since the last one that has one.
    pub lost_now: u64,
}

/// What became of a path.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PathReport {
    /// What can be done with it.
    pub verdict: PathVerdict,
    /// What fixes the world.
    pub datum: String,
    /// Frames without a pose.
    pub lost: u64,
    /// Their share.
    pub lost_share: f64,
    /// How often frames without a pose followed each other.
    pub losses: u64,
    /// How often the camera was found again.
    pub relocalised: u64,
    /// The last loss.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub last_loss: Option<PathLoss>,
    /// Length of the path over frames that have a pose, metre.
    pub length_m: f64,
    /// From the first pose to the last, metre.
    pub start_to_end_m: f64,
    /// Standard deviation of the last position in space since the datum, metre.
    pub position_sigma_m: Option<f64>,
    /// Keyframes at the end.
    pub keyframes: usize,
    /// Loops that are closed among them.
    pub loops_closed: usize,
    /// The trajectory, where it is a file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub trajectory: Option<PathBuf>,
    /// The map, where it was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub map: Option<MapReport>,
}

/// The map of what was seen.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MapReport {
    /// Its file.
    pub file: PathBuf,
    /// Points.
    pub points: usize,
    /// Edge of its voxels, metre.
    pub voxel_m: f64,
    /// How often it was full and its voxels were doubled.
    pub doubled: u32,
    /// Points that have no place in it.
    pub left_out: u64,
}

/// Figures of the path.
#[derive(Debug, Default)]
pub(super) struct Path {
    frames: u64,
    lost: u64,
    losses: u64,
    relocalised: u64,
    last_loss: Option<PathLoss>,
    length_m: f64,
    first: Option<Vector3<f64>>,
    /// The last frame.
    now: Option<TrackedPose>,
    /// The last frame that has a pose.
    known: Option<TrackedPose>,
}

impl Path {
    pub(super) fn add(&mut self, pose: &TrackedPose) {
        let (time_s, open) = (pose.timestamp_s, self.lost_now() > 0);
        self.frames += 1;
        self.now = Some(*pose);
        if let TrackingState::Lost(reason) = pose.state {
            self.lost += 1;
            match &mut self.last_loss {
                Some(loss) if open => loss.frames += 1,
                loss => {
                    *loss = Some(PathLoss { from_s: time_s, found_s: None, frames: 1, reason: reason.words() });
                    self.losses += 1;
                }
            }
            return;
        }
        if let Some(loss) = self.last_loss.as_mut().filter(|_| open) {
            loss.found_s = Some(time_s);
        }
        self.relocalised += u64::from(pose.state == TrackingState::Relocalised);
        let position = pose.world_from_camera.translation.vector;
        self.length_m += self.known.map_or(0.0, |known| (position - known.world_from_camera.translation.vector).norm());
        self.first.get_or_insert(position);
        self.known = Some(*pose);
    }

    /// Frames without a pose since the last one that has one.
    fn lost_now(&self) -> u64 {
        let is_lost = self.now.is_some_and(|now| !now.state.has_pose());
        self.last_loss.as_ref().filter(|_| is_lost).map_or(0, |loss| loss.frames)
    }

    pub(super) fn status(&self) -> Option<PathStatus> {
        let now = self.now?;
        let known = now.state.has_pose();
        Some(PathStatus {
            state: now.state.name(),
            reason: if let TrackingState::Lost(reason) = now.state { Some(reason.words()) } else { None },
            pose: known.then(|| pose_numbers(&now.world_from_camera)),
            position_sigma_m: known.then(|| position_sigma_m(&now.covariance)),
            attitude_sigma_deg: known.then(|| spread(&now.covariance, 3).to_degrees()),
            lost: self.lost,
            lost_now: self.lost_now(),
        })
    }

    pub(super) fn report(&self, tracker: &Tracker, datum: String) -> PathReport {
        let end = self.known.map(|known| known.world_from_camera.translation.vector);
        PathReport {
            verdict: match self.lost {
                0 => PathVerdict::Tracked,
                _ if self.lost_now() > 0 || 2 * self.lost > self.frames => PathVerdict::Lost,
                _ => PathVerdict::Interrupted,
            },
            datum,
            lost: self.lost,
            lost_share: self.lost as f64 / self.frames.max(1) as f64,
            losses: self.losses,
            relocalised: self.relocalised,
            last_loss: self.last_loss.clone(),
            length_m: self.length_m,
            start_to_end_m: self.first.zip(end).map_or(0.0, |(first, end)| (end - first).norm()),
            position_sigma_m: self.known.map(|known| position_sigma_m(&known.covariance)),
            keyframes: tracker.keyframes(),
            loops_closed: (tracker.registrations() + 1).saturating_sub(tracker.keyframes()),
            trajectory: None,
            map: None,
        }
    }
}

impl PathReport {
    /// How many frames have no pose, and from when on; `None` where all have one.
    pub(super) fn loss_in_words(&self) -> Option<String> {
        let loss = self.last_loss.as_ref()?;
        let count = format!("{} frames ({:.1} %) have no pose", self.lost, 100.0 * self.lost_share);
        Some(match loss {
            PathLoss { from_s, found_s: None, reason, .. } => {
                format!("the camera was lost at {from_s} s ({reason}) and not found again: {count}")
            }
            PathLoss { reason, .. } => {
                format!("{count}, the last of them: {reason}; the camera was found again {} times", self.losses)
            }
        })
    }
}

impl MapReport {
    pub(super) fn of(map: &SurfaceMap, file: PathBuf) -> Self {
        let doubled = (map.voxel_m() / map.options().voxel_m).log2().round() as u32;
        Self { file, points: map.len(), voxel_m: map.voxel_m(), doubled, left_out: map.left_out() }
    }
}

fn position_sigma_m(covariance: &Matrix6<f64>) -> f64 {
    spread(covariance, 0)
}

/// Root of the sum of three variances.
fn spread(covariance: &Matrix6<f64>, first: usize) -> f64 {
    (first..first + 3).map(|axis| covariance[(axis, axis)]).sum::<f64>().sqrt()
}

impl fmt::Display for PathStatus {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let (Some([x, y, z, ..]), Some(sigma_m)) = (self.pose, self.position_sigma_m) {
            write!(f, "at {x:.3} {y:.3} {z:.3} m (σ {:.1} mm)", 1e3 * sigma_m)?;
        } else {
            let reason = self.reason.unwrap_or_default();
            write!(f, "lost for {} frames ({reason})", self.lost_now)?;
        }
        if self.lost > self.lost_now { write!(f, ", {} without a pose", self.lost) } else { Ok(()) }
    }
}

impl fmt::Display for PathReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let words = match self.verdict {
            PathVerdict::Tracked => "tracked",
            PathVerdict::Interrupted => "tracked with interruptions",
            PathVerdict::Lost => "lost",
        };
        write!(f, "path: {words}, {:.2} m long, {:.2} m from start to end", self.length_m, self.start_to_end_m)?;
        if let Some(sigma_m) = self.position_sigma_m {
            write!(f, " (σ {:.1} mm)", 1e3 * sigma_m)?;
        }
        let loops = if self.loops_closed == 1 { "loop" } else { "loops" };
        write!(f, ", {} keyframes, {} {loops} closed; datum: {}", self.keyframes, self.loops_closed, self.datum)?;
        if let Some(trajectory) = &self.trajectory {
            write!(f, "\ntrajectory in {}", trajectory.display())?;
        }
        let Some(MapReport { file, points, voxel_m, doubled, left_out }) = &self.map else { return Ok(()) };
        write!(f, "\nmap of {points} points in voxels of {voxel_m} m in {}", file.display())?;
        if *doubled > 0 {
            write!(f, " (it was full {doubled} times, and its voxels were doubled)")?;
        }
        if *left_out > 0 { write!(f, ", {left_out} points left out") } else { Ok(()) }
    }
}
