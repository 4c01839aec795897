//! Streams.

use std::path::Path;

use icp_registration::{Tracker, TrackerOptions, absolute_orientation};
use nalgebra::Point3;

use crate::Outcome;
use crate::cpu_clock::cpu_seconds;
use crate::files::Frames;
use crate::frames::projection;

/// Frames a second.
const RATE: f64 = 30.0;

/// Prints CPU time a frame, and the root of the mean squared distance of positions after the best rigid motion.
pub fn run(folder: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let mut tracker = Tracker::new(&projection(&frames)?, TrackerOptions::default())?;
    let (mut spent, mut found) = (0.0, Vec::new());
    for k in 0..frames.poses.len() {
        let points = frames.points(k)?;
        let start = cpu_seconds();
        let pose = tracker.track(k as f64 / RATE, &points, None, None)?;
        spent += 1e3 * (cpu_seconds() - start);
        found.push(Point3::from(pose.world_from_camera.translation.vector));
    }
    let truth: Vec<_> = frames.poses.iter().map(|pose| Point3::from(pose.translation.vector)).collect();
    let truth_from_found = absolute_orientation(&found, &truth, None)?.target_from_source;
    let squares = found.iter().zip(&truth).map(|(a, b)| (truth_from_found * a - b).norm_squared());
    let count = frames.poses.len() as f64;
    println!("tracker {} {}", spent / count, 1e3 * (squares.sum::<f64>() / count).sqrt());
    Ok(())
}
