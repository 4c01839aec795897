//! Covariances against true errors, and scenes that leave motions open.

use std::path::Path;

use nalgebra::{Isometry3, Vector3};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame, align_frames};
use rigid_pose::pose_difference;

use crate::Outcome;
use crate::common::{Pinhole, frame_pair, pose_error};
use crate::files::Frames;
use crate::frames::projection;
use crate::pairs::median;

/// What a normalised squared error of six parameters exceeds in 5 % of the cases.
const LIMIT: f64 = 12.592;

/// Prints the median and the mean normalised squared error over pairs, and the share below the limit of 95 %. A pose
/// without a covariance counts as outside, and not in the mean.
pub fn covariance(folder: &Path, count: u64) -> Outcome {
    let projection = projection(&Frames::open(folder)?)?;
    let (mut errors, mut covered) = (Vec::new(), 0);
    for k in 0..count {
        let pair = frame_pair(&Pinhole::medium(), 1_000 + k);
        let prepare =
            |(points, sigma): &(Vec<[f64; 3]>, Vec<f32>)| OrganisedFrame::new(&projection, points, Some(sigma));
        let [target, source] = [prepare(&pair.target)?, prepare(&pair.source)?];
        let result = align_frames(&source, &target, &Isometry3::identity(), &FrameAlignmentOptions::default())?;
        let off = pose_difference(&result.target_from_source, &pair.target_from_source);
        if let Some(weight) = result.covariance.try_inverse() {
            let error = off.dot(&(weight * off));
            covered += usize::from(error < LIMIT);
            errors.push(error);
        }
    }
    println!("mean {}\ncovered {}", errors.iter().sum::<f64>() / errors.len() as f64, covered as f64 / count as f64);
    println!("median {}", median(errors));
    Ok(())
}

/// Prints for the wall, and for the wall with the floor: whether the pose was called trustworthy, millimetres off, how
/// many motions were called open, and millimetres off across the surfaces, where the geometry does tell.
pub fn degenerate(folder: &Path) -> Outcome {
    let frames = Frames::open(folder)?;
    let projection = projection(&frames)?;
    for (name, [target, source]) in ["wall", "edge"].into_iter().zip(frames.pairs(2)) {
        let [points, other] = [frames.points(source)?, frames.points(target)?];
        let source_frame = OrganisedFrame::new(&projection, &points, None)?;
        let target_frame = OrganisedFrame::new(&projection, &other, None)?;
        let options = FrameAlignmentOptions::default();
        let result = align_frames(&source_frame, &target_frame, &Isometry3::identity(), &options)?;
        let (found, truth) = (result.target_from_source, frames.truth([target, source]));
        let (millimetre, _) = pose_error(&found, &truth);
        let across = across(&frames.poses[target], &found, &truth, &points);
        let sure = u8::from(result.is_trustworthy());
        println!("{name} {sure} {millimetre} {} {across}", result.degenerate.len());
    }
    Ok(())
}

/// Root of the mean squared distance, mm, of points from their true places across the wall (y) or the floor (z).
fn across(target: &Isometry3<f64>, found: &Isometry3<f64>, truth: &Isometry3<f64>, points: &[[f64; 3]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for &point in points.iter().filter(|point| point[0].is_finite()) {
        let [there, where_it_is] = [found, truth].map(|pose| target * (pose * nalgebra::Point3::from(point)));
        let normal = if where_it_is.z < 0.1 { Vector3::z() } else { Vector3::y() };
        sum += (there - where_it_is).dot(&normal).powi(2);
        count += 1.0;
    }
    1e3 * (sum / f64::max(count, 1.0)).sqrt()
}
