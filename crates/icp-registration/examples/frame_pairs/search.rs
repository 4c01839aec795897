//! Trusted poses that are wrong, sought among thousands of real pairs from the identity.

use icp_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, pose_difference};
use nalgebra::{Isometry3, Matrix6, Vector6};

use super::depth_frames::dense_kitchen;

/// Frames between the two of a pair.
const GAPS: [usize; 10] = [5, 10, 15, 20, 30, 40, 50, 60, 80, 100];
/// What counts as wrong: farther off than this share of the motion and more, and than so many standard deviations.
const WRONG_M: f64 = 0.04;
const WRONG_SHARE: f64 = 0.25;
const WRONG_SIGMA: f64 = 4.0;
/// Of the reference, a pair: 8 mm and 0.3 degrees.
const REFERENCE: [f64; 2] = [8e-3, 5.2e-3];

pub fn print() {
    let Some(sequence) = dense_kitchen(0..500) else {
        println!("dense kitchen: the frames are not there");
        return;
    };
    let prepare = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
    let frames: Vec<OrganisedFrame> = sequence.frames.iter().map(|f| prepare(&f.points)).collect();
    let mut aligner = FrameAligner::new(FrameAlignmentOptions::default()).unwrap();
    let (mut asked, mut trusted, mut right, mut wrong, mut over) = (0, 0, 0, 0, 0);
    for gap in GAPS {
        for a in 0..frames.len() - gap {
            let truth = sequence.frames[a].world_from_camera.inverse() * sequence.frames[a + gap].world_from_camera;
            asked += 1;
            let Ok(result) = aligner.align(&frames[a + gap], &frames[a], &Isometry3::identity()) else { continue };
            let error = pose_difference(&result.target_from_source, &truth);
            let off = error.fixed_rows::<3>(0).norm();
            let moved = truth.translation.vector.norm();
            let is_right = off < WRONG_M.max(WRONG_SHARE * moved);
            right += usize::from(is_right);
            if !result.is_trustworthy() {
                continue;
            }
            trusted += 1;
            let [metre, radian] = REFERENCE.map(|r| r * r / 3.0);
            let reference = Matrix6::from_diagonal(&Vector6::new(metre, metre, metre, radian, radian, radian));
            let variance = (result.covariance + reference).diagonal();
            let sigmas = (0..6).map(|k| error[k].abs() / variance[k].sqrt()).fold(0.0, f64::max);
            over += usize::from(sigmas > WRONG_SIGMA);
            if !is_right {
                wrong += 1;
                println!(
                    "{a} {}: {:.0} mm off of {:.0}, {sigmas:.1} standard deviations, overlap {:.2}, rms {:.1} mm",
                    a + gap,
                    1e3 * off,
                    1e3 * moved,
                    result.overlap,
                    1e3 * result.rms_m
                );
            }
        }
    }
    println!(
        "{asked} pairs: {right} right, {trusted} trusted, of these {wrong} wrong and {over} beyond {WRONG_SIGMA} standard deviations"
    );
}
