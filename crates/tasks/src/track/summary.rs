//! Every figure of tracking by name; written as `summary.json` and shown as words.

use commands::{Doubt, DoubtKind, Judged, Verdict};
use nalgebra::Isometry3;
use serde::Serialize;
use statistics::quantile;
use tracking::{Tracker, TrajectoryAlignment, TrajectoryErrorOptions, absolute_trajectory_error};

use crate::track::outcome::{FramePose, TrackLoss, TrackTruth, TrackVerdict, TrackedFrame};

/// How far the camera was followed, and how well each pose is known.
#[derive(Debug, Clone, Default, Serialize)]
pub struct TrackSummary {
    /// `track`.
    pub method: &'static str,
    /// The survey's folder.
    pub survey: String,
    /// The calibration in use, in words.
    pub calibration: String,
    /// What fixes the world.
    pub datum: String,
    /// What frames are expected by.
    pub prior: String,
    /// What can be done with the result.
    pub verdict: TrackVerdict,
    /// Frames.
    pub frames: usize,
    /// Frames without a pose.
    pub lost: usize,
    /// Their part of all frames.
    pub lost_share: f64,
    /// How often the camera was found again.
    pub relocalised: usize,
    /// Frames without a pose that follow each other.
    pub losses: Vec<TrackLoss>,
    /// Keyframes in the map.
    pub keyframes: usize,
    /// Registrations between keyframes beyond a chain: loops that were closed.
    pub loops_closed: usize,
    /// How far the loops moved a pose that had been tracked, at most, metre.
    pub adjusted_by_max_m: f64,
    /// Points of the map.
    pub map_points: usize,
    /// Time from the first to the last frame, second.
    pub duration_s: f64,
    /// Length of the adjusted path between the frames that have a pose, metre.
    pub path_length_m: f64,
    /// Distance between the first and the last of them, metre.
    pub start_to_end_m: f64,
    /// Median standard deviation of the positions since the datum, metre.
    pub position_sigma_median_m: f64,
    /// Largest standard deviation of a position, metre.
    pub position_sigma_max_m: f64,
    /// Standard deviation of the systematic error that all frames share, by the degree of polynomials over the frame: metre
    /// of range where ranges come with standard deviations, else 1/metre of inverse depth.
    pub shared_error_sigma: [f64; 5],
    /// Registrations between keyframes that it was estimated from.
    pub shared_error_registrations: usize,
    /// Median and 95 % of the wall-clock time that tracking took a frame, millisecond.
    pub track_median_ms: f64,
    /// See above.
    pub track_p95_ms: f64,
    /// The same with reading and correcting the frame.
    pub total_median_ms: f64,
    /// See above.
    pub total_p95_ms: f64,
    /// Errors where the truth is known.
    pub truth: Option<TrackTruth>,
    /// What a reader should know before the poses are used.
    pub doubts: Vec<Doubt>,
    /// Wall-clock time, second.
    pub seconds: f64,
    /// The output folder.
    pub out: String,
    /// Every frame, in the order of time.
    pub per_frame: Vec<TrackedFrame>,
}

/// All figures that follow from the poses.
pub(crate) fn summarise(
    frames: Vec<TrackedFrame>,
    poses: &[FramePose],
    truths: &[Option<Isometry3<f64>>],
    tracker: &Tracker,
) -> TrackSummary {
    let losses = losses(&frames);
    let lost = losses.iter().map(|loss| loss.frames).sum::<usize>();
    let figures = |pick: fn(&TrackedFrame) -> Option<f64>| -> Vec<f64> { frames.iter().filter_map(pick).collect() };
    let mut sigmas = figures(|frame| frame.position_sigma_m);
    let mut tracking = figures(|frame| Some(frame.track_ms));
    let mut total = figures(|frame| Some(frame.total_ms));
    let known = || poses.iter().filter(|pose| pose.is_known);
    let path: Vec<nalgebra::Vector3<f64>> = known().map(|pose| pose.adjusted.translation.vector).collect();
    let shifts = known().map(|pose| (pose.tracked.translation.vector - pose.adjusted.translation.vector).norm());
    let mut summary = TrackSummary {
        method: "track",
        verdict: verdict(frames.len(), lost, &losses),
        frames: frames.len(),
        lost,
        lost_share: lost as f64 / frames.len() as f64,
        relocalised: frames.iter().filter(|frame| frame.state == "relocalised").count(),
        keyframes: tracker.keyframes(),
        loops_closed: (tracker.registrations() + 1).saturating_sub(tracker.keyframes()),
        adjusted_by_max_m: shifts.fold(0.0, f64::max),
        map_points: tracker.map().len(),
        duration_s: poses.last().map_or(0.0, |last| last.timestamp_s - poses[0].timestamp_s),
        path_length_m: path.windows(2).map(|pair| (pair[1] - pair[0]).norm()).sum(),
        start_to_end_m: path.first().zip(path.last()).map_or(0.0, |(first, last)| (last - first).norm()),
        position_sigma_median_m: quantile(&mut sigmas, 0.5),
        position_sigma_max_m: quantile(&mut sigmas, 1.0),
        shared_error_sigma: tracker.shared_error().sigma(),
        shared_error_registrations: tracker.shared_error().registrations(),
        track_median_ms: quantile(&mut tracking, 0.5),
        track_p95_ms: quantile(&mut tracking, 0.95),
        total_median_ms: quantile(&mut total, 0.5),
        total_p95_ms: quantile(&mut total, 0.95),
        truth: truth(poses, truths),
        losses,
        per_frame: frames,
        ..TrackSummary::default()
    };
    summary.doubts = doubts(&summary);
    summary
}

/// Runs of frames without a pose.
fn losses(frames: &[TrackedFrame]) -> Vec<TrackLoss> {
    let mut losses: Vec<TrackLoss> = Vec::new();
    let mut open = false;
    for frame in frames {
        match (frame.reason, losses.last_mut()) {
            (Some(_), Some(loss)) if open => loss.frames += 1,
            (Some(reason), _) => losses.push(TrackLoss { from_s: frame.timestamp_s, found_s: None, frames: 1, reason }),
            (None, Some(loss)) if open => loss.found_s = Some(frame.timestamp_s),
            (None, _) => {}
        }
        open = frame.reason.is_some();
    }
    losses
}

fn verdict(frames: usize, lost: usize, losses: &[TrackLoss]) -> TrackVerdict {
    let ends_lost = losses.last().is_some_and(|loss| loss.found_s.is_none());
    match lost {
        0 => TrackVerdict::Tracked,
        _ if ends_lost || 2 * lost > frames => TrackVerdict::Lost,
        _ => TrackVerdict::Interrupted,
    }
}

/// Errors where every frame that has a pose has a true one of its own.
fn truth(poses: &[FramePose], truths: &[Option<Isometry3<f64>>]) -> Option<TrackTruth> {
    let known = || poses.iter().zip(truths).filter(|(pose, _)| pose.is_known);
    let truth: Vec<(f64, Isometry3<f64>)> =
        known().map(|(pose, truth)| truth.map(|truth| (pose.timestamp_s, truth))).collect::<Option<_>>()?;
    // Stations that hold still for several frames say nothing of a path.
    if truth.windows(2).all(|pair| pair[0].1 == pair[1].1) {
        return None;
    }
    // What has drifted since the datum; a path as straight as a corridor has no best rigid motion.
    let options =
        TrajectoryErrorOptions { alignment: TrajectoryAlignment::FirstPose, ..TrajectoryErrorOptions::default() };
    let errors = |world_from_camera: fn(&FramePose) -> Isometry3<f64>| {
        let estimate: Vec<_> = known().map(|(pose, _)| (pose.timestamp_s, world_from_camera(pose))).collect();
        absolute_trajectory_error(&estimate, &truth, &options).ok()
    };
    let (found, closed) = (errors(|pose| pose.tracked)?, errors(|pose| pose.adjusted)?);
    Some(TrackTruth {
        position_error_rms_m: found.position_m.rms,
        position_error_max_m: found.position_m.max,
        adjusted_position_error_rms_m: closed.position_m.rms,
        attitude_error_max_deg: found.attitude_rad.max.to_degrees(),
    })
}

fn doubts(summary: &TrackSummary) -> Vec<Doubt> {
    let mut doubts = Vec::new();
    if summary.lost > 0 {
        let words = format!("{} They are left out of the trajectories.", summary.loss_in_words());
        doubts.push(Doubt::new(DoubtKind::LostFrames, words));
    }
    doubts
}

impl TrackSummary {
    /// How many frames have no pose, and from when on.
    pub(crate) fn loss_in_words(&self) -> String {
        let share = 100.0 * self.lost_share;
        let count = format!("{} of {} frames ({share:.1} %) have no pose", self.lost, self.frames);
        match self.losses.last() {
            Some(TrackLoss { from_s, found_s: None, reason, .. }) => {
                format!("the camera was lost at {from_s} s ({reason}) and not found again: {count}.")
            }
            Some(_) => format!("{count}; the camera was found again {} times.", self.relocalised),
            None => format!("{count}."),
        }
    }
}

impl TrackSummary {
    /// What the standard deviations of the poses rest on.
    pub(crate) fn grounds_of_sigma(&self) -> String {
        match self.shared_error_registrations {
            0 => {
                "The standard deviations rest on the noise and on an error of the sensor that all frames share, as far \
                  as each frame shows it by itself: no keyframe followed."
                    .to_owned()
            }
            n => format!(
                "The standard deviations rest on the noise and on an error of the sensor that all frames share, estimated from {n} \
                 registrations between keyframes; that it is smooth over the frame and a quarter of it the same \
                 everywhere is an assumption."
            ),
        }
    }
}

impl Judged for TrackSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }

    /// A sequence that ends lost is no success, though what was tracked stands.
    fn verdict(&self) -> Verdict {
        match self.verdict {
            TrackVerdict::Lost => Verdict::Partial,
            _ if self.doubts.is_empty() => Verdict::Done,
            _ => Verdict::Doubtful,
        }
    }
}
