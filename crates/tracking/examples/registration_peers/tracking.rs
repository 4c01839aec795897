//! A stream of frames.

use std::path::Path;

use tracking::{TrackedPose, Tracker, TrackerOptions, TrajectoryErrorOptions, absolute_trajectory_error};

use crate::Outcome;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::frames::projection;

/// Frames a second of the streams.
const HERTZ: f64 = 30.0;

/// Prints CPU time a frame, root of the mean squared distance of positions after the best rigid motion, and frames lost;
/// then the times of all frames, ms.
pub fn run(folder: &Path, first: usize, count: usize) -> Outcome {
    let frames = Frames::open(folder)?;
    let numbers = first..frames.poses.len().min(first.saturating_add(count));
    let mut tracker = Tracker::new(&projection(&frames)?, TrackerOptions::default())?;
    let mut times = Vec::new();
    for k in numbers.clone() {
        let points = frames.points(k)?;
        let start = cpu_seconds();
        tracker.track(k as f64 / HERTZ, &points, None, None)?;
        times.push(1e3 * (cpu_seconds() - start));
    }
    let found = tracker.trajectory();
    let lost = found.iter().filter(|pose| !pose.state.has_pose()).count();
    let stamped = |pose: &TrackedPose| (pose.timestamp_s, pose.world_from_camera);
    let estimate: Vec<_> = found.iter().filter(|pose| pose.state.has_pose()).map(stamped).collect();
    let truth: Vec<_> = numbers.map(|k| (k as f64 / HERTZ, frames.poses[k])).collect();
    let error = absolute_trajectory_error(&estimate, &truth, &TrajectoryErrorOptions::default())?;
    println!("ours {} {} {lost}", times.iter().sum::<f64>() / times.len() as f64, 1e3 * error.position_m.rms);
    println!("times {}", times.iter().map(f64::to_string).collect::<Vec<_>>().join(" "));
    Ok(())
}
