//! Errors of real pairs over what is stated of them, by the number of frames between the two.

use nalgebra::{Isometry3, Vector6};
use projective_registration::{FrameAligner, FrameAlignmentOptions, OrganisedFrame, SharedError};
use rigid_pose::pose_difference;

use super::depth_frames::{Sequence, dense_kitchen};

/// Positions and attitudes of the reference, a pair.
const REFERENCE_M: f64 = 8e-3;
const REFERENCE_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;
/// Frames between the two of a pair, and from one pair to the next.
const GAPS: [usize; 7] = [1, 5, 10, 20, 30, 45, 60];
const STEP: usize = 7;

pub fn print() {
    for (name, range) in [("frames 0 to 249", 0..250), ("frames 250 to 499", 250..500)] {
        let Some(sequence) = dense_kitchen(range) else {
            println!("dense kitchen: the frames are not there");
            return;
        };
        let prepare = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
        let frames: Vec<OrganisedFrame> = sequence.frames.iter().map(|f| prepare(&f.points)).collect();
        for gap in GAPS {
            for (how, shared_error) in [("shared error estimated", None), ("noise alone", Some(SharedError::none()))] {
                let options = FrameAlignmentOptions { shared_error, ..FrameAlignmentOptions::default() };
                print_gap(&format!("{name}, {gap} apart, {how}"), &sequence, &frames, gap, options);
            }
        }
    }
}

fn print_gap(name: &str, sequence: &Sequence, frames: &[OrganisedFrame], gap: usize, options: FrameAlignmentOptions) {
    let mut aligner = FrameAligner::new(options).unwrap();
    let reference = [REFERENCE_M.powi(2) / 3.0, REFERENCE_RAD.powi(2) / 3.0];
    let (mut pairs, mut square, mut stated) = (0.0, Vector6::zeros(), Vector6::zeros());
    let mut ratio = Vector6::zeros();
    for a in (0..frames.len() - gap).step_by(STEP) {
        let (target, source) = (&sequence.frames[a], &sequence.frames[a + gap]);
        let truth = target.world_from_camera.inverse() * source.world_from_camera;
        let result = aligner.align(&frames[a + gap], &frames[a], &Isometry3::identity());
        let Some(result) = result.ok().filter(icp_registration::IcpResult::is_trustworthy) else { continue };
        let error = pose_difference(&result.target_from_source, &truth);
        pairs += 1.0;
        for k in 0..6 {
            let variance = result.covariance[(k, k)];
            square[k] += error[k].powi(2);
            stated[k] += variance;
            ratio[k] += error[k].powi(2) / (variance + reference[k / 3]);
        }
    }
    let rms = |sums: &Vector6<f64>, at: usize| 1e3 * (sums.fixed_rows::<3>(at).sum() / pairs).sqrt();
    println!(
        "{name}: {pairs} pairs trusted, off {:.1} mm {:.1} mrad, stated {:.1} mm {:.1} mrad, squared error over variance {:.2?}",
        rms(&square, 0),
        rms(&square, 3),
        rms(&stated, 0),
        rms(&stated, 3),
        (ratio / pairs).as_slice()
    );
}
