//! Organised frames of real structured-light cameras; skipped with a word where they are missing.

use crate::common::{disturbance, pose_error};
use crate::depth_frames::{Sequence, dense_kitchen, kitchen, living_room};
use crate::sr4000::stations;
use nalgebra::{Isometry3, Vector3};
use projective_registration::{FrameAlignmentOptions, OrganisedFrame, SharedError, align_frames};
use rigid_pose::pose_difference;

/// Distance between the stations of the SR4000, by a plane fitted to a box.
const STEP_M: f64 = 0.314;

fn check(sequence: &Sequence) {
    let prepared: Vec<OrganisedFrame> =
        sequence.frames.iter().map(|f| OrganisedFrame::new(&sequence.projection, &f.points, None).unwrap()).collect();
    for k in 0..prepared.len() - 1 {
        let truth = sequence.frames[k].world_from_camera.inverse() * sequence.frames[k + 1].world_from_camera;
        let options = FrameAlignmentOptions::default();
        let result = align_frames(&prepared[k + 1], &prepared[k], &Isometry3::identity(), &options).unwrap();
        let (mm, degrees) = pose_error(&result.target_from_source, &truth);
        println!("{k}: {mm:.1} mm {degrees:.2} deg, overlap {:.2}", result.overlap);
        // The poses are good to 8 mm, and depth is quantised.
        assert!(mm < 30.0 && degrees < 1.0, "pair {k}: {mm} mm, {degrees} degrees");
    }
}

#[test]
fn frames_of_a_kitchen_follow_their_poses() {
    match kitchen(8) {
        Some(sequence) => check(&sequence),
        None => println!("skipped: the kitchen is not there"),
    }
}

#[test]
fn frames_of_a_living_room_follow_their_poses() {
    match living_room() {
        Some(sequence) => check(&sequence),
        None => println!("skipped: the living room is not there"),
    }
}

#[test]
fn poses_of_a_kinect_err_as_stated() {
    let Some(sequence) = dense_kitchen((260..500).step_by(10)) else {
        println!("skipped: the dense kitchen is not there");
        return;
    };
    let prepare = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap();
    let frames: Vec<OrganisedFrame> = sequence.frames.iter().map(|f| prepare(&f.points)).collect();
    // Positions and attitudes of the reference, a pair: 8 mm and 0.3 degrees.
    let reference = [8e-3_f64, 5.2e-3].map(|r| r * r / 3.0);
    let over_variance = |shared_error: Option<SharedError>| {
        let options = FrameAlignmentOptions { shared_error, ..FrameAlignmentOptions::default() };
        let (mut sum, mut count) = (0.0, 0);
        for k in 0..frames.len() - 1 {
            let truth = sequence.frames[k].world_from_camera.inverse() * sequence.frames[k + 1].world_from_camera;
            let found = align_frames(&frames[k + 1], &frames[k], &Isometry3::identity(), &options).unwrap();
            if found.is_trustworthy() {
                let error = pose_difference(&found.target_from_source, &truth);
                let ratio = |i: usize| error[i].powi(2) / (found.covariance[(i, i)] + reference[i / 3]);
                sum += (0..6).map(ratio).sum::<f64>() / 6.0;
                count += 1;
            }
        }
        println!("{count} pairs trusted, squared error over variance {:.2}", sum / f64::from(count));
        assert!(count > 10, "{count}");
        sum / f64::from(count)
    };
    let (estimated, noise) = (over_variance(None), over_variance(Some(SharedError::none())));
    // Neighbouring pairs see the same surfaces: their errors are a few draws.
    assert!((0.1..2.5).contains(&estimated), "{estimated}");
    assert!(noise > estimated, "{noise}");
}

#[test]
fn frames_of_an_sr4000_are_right_or_doubted_from_wherever_they_start() {
    let Some([target, source]) = stations() else {
        println!("skipped: the two stations are not there");
        return;
    };
    let step = |pose: &Isometry3<f64>| (pose.translation.vector - Vector3::new(0.0, 0.0, -STEP_M)).norm();
    let mut trusted = 0;
    for (metre, degrees) in [(0.0, 0.0), (0.2, 10.0), (0.5, 30.0), (1.0, 60.0), (3.0, 90.0)] {
        for seed in 0..4 {
            let guess = Isometry3::translation(0.0, 0.0, -STEP_M) * disturbance(metre, degrees, seed);
            let Ok(result) = align_frames(&source, &target, &guess, &FrameAlignmentOptions::default()) else {
                continue;
            };
            let (off, turned) = (step(&result.target_from_source), result.target_from_source.rotation.angle());
            println!("from {metre} m, {degrees} degrees: {off:.3} m, {turned:.3} rad, {:?}", result.stop);
            // A plane fitted to a box gives the step; 30 mm and 3 degrees are what the camera's systematic errors leave.
            if result.is_trustworthy() {
                assert!(off < 0.03 && turned < 0.05, "trusted {off} m and {turned} rad off");
                trusted += 1;
            }
        }
    }
    println!("{trusted} trusted");
}
