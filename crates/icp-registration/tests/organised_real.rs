//! Organised frames of real structured-light cameras; skipped with a word where they are missing.
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::print_stdout, missing_docs)]

mod common;
mod depth_frames;

use common::pose_error;
use depth_frames::{Sequence, kitchen, living_room};
use icp_registration::{FrameAlignmentOptions, OrganisedFrame, align_frames};
use nalgebra::Isometry3;

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
