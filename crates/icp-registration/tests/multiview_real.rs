//! Frames of real structured-light cameras as stations; skipped with a word where they are missing.
#![cfg(feature = "multiview")]

use crate::common::pose_error;
use crate::depth_frames::{Sequence, living_room};
use icp_registration::{Cloud, Datum, OrganisedFrame, Start, StationRegistrationOptions, register_stations};
use nalgebra::Isometry3;

/// Registers frames from where the first one stood, and holds them against the poses that come with them.
fn check(sequence: &Sequence) {
    let cloud = |points: &[[f64; 3]]| OrganisedFrame::new(&sequence.projection, points, None).unwrap().to_cloud();
    let clouds: Vec<Cloud> = sequence.frames.iter().map(|frame| cloud(&frame.points)).collect();
    let start = vec![Isometry3::identity(); clouds.len()];
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, Start::Poses(&start), Datum::Station(0), &options, &|_, _| {}).unwrap();
    println!("sigma0 {:?}, {} rounds, settled {}", found.sigma0, found.rounds, found.settled);
    assert!(found.settled && found.undetermined.is_empty());
    let first = sequence.frames[0].world_from_camera;
    for (k, (pose, frame)) in found.world_from_station.iter().zip(&sequence.frames).enumerate() {
        let (mm, degrees) = pose_error(pose, &(first.inverse() * frame.world_from_camera));
        let sigma_mm = 1e3 * found.covariance[k].fixed_view::<3, 3>(0, 0).trace().sqrt();
        println!("{k}: {mm:.1} mm {degrees:.2} deg, sigma {sigma_mm:.2} mm");
        // The poses are good to 8 mm, and depth is quantised.
        assert!(mm < 30.0 && degrees < 1.0, "frame {k}: {mm} mm, {degrees} degrees");
    }
}

#[test]
fn frames_of_a_living_room_come_together() {
    match living_room() {
        Some(sequence) => check(&sequence),
        None => println!("skipped: the living room is not there"),
    }
}
