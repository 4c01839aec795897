//! The same stations adjusted as few and as many.
#![allow(clippy::unwrap_used)]

use rigid_pose::pose_difference;

use super::*;
use crate::common::disturbance;
use crate::common::stations::round;

#[test]
fn stations_come_to_the_same_place_as_few_and_as_many() {
    let (clouds, truth) = round(5, 0.01, 3);
    let off = |k: usize| disturbance(0.05, 2.0, 70 + k as u64);
    let start: Vec<Isometry3<f64>> =
        truth.iter().enumerate().map(|(k, pose)| if k == 0 { *pose } else { pose * off(k) }).collect();
    let options = StationRegistrationOptions::default();
    let [few, many] = [true, false].map(|whole| {
        let start = Start::Poses(&start);
        brought_together(&clouds, start, Datum::Station(0), (&options, whole), &|_, _| {}).unwrap()
    });
    assert!(few.adjusted.settled && many.adjusted.settled);
    assert_eq!(many.placements.unwrap().doubtful().count(), 0);
    let [few, many] = [few.adjusted, many.adjusted].map(|adjusted| adjusted.state.poses);
    for (k, pose) in many.iter().enumerate() {
        let apart = |other: &Isometry3<f64>| pose_difference(pose, other).fixed_rows::<3>(0).norm();
        // Known to a millimetre. Both ways end at a tenth of that, with points given to planes from other poses.
        assert!(apart(&few[k]) < 1e-3 && apart(&truth[k]) < 5e-3, "{k}: {} {}", apart(&few[k]), apart(&truth[k]));
    }
}
