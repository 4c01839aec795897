//! Rigs with one thing wrong: what is wrong is named, or it does no harm.

use rig_calibration::nalgebra::{Isometry3, Matrix3};
use rig_calibration::self_calibration::{CalibrationOptions, NetworkDatum, Verdict};
use rig_calibration::{Error, Rig, calibrate_rig};
use rigid_pose::pose_difference;

use crate::rigs::{TERMS, mountings, observed, options, truth};

fn refusal(rig: &Rig) -> String {
    calibrate_rig(rig, &options(TERMS)).unwrap_err().to_string()
}

fn rename(rig: &mut Rig, camera: usize, name: impl Fn(&str) -> String) {
    for station in &mut rig.cameras[camera].network.stations {
        station.name = name(&station.name);
    }
}

#[test]
fn one_camera_is_no_rig() {
    let mut rig = observed(1, 0.0);
    rig.cameras.truncate(1);
    assert_eq!(calibrate_rig(&rig, &options(TERMS)).unwrap_err(), Error::TooFewCameras { found: 1 });
}

#[test]
fn cameras_that_never_share_an_epoch_are_named() {
    let mut rig = observed(1, 0.0);
    rename(&mut rig, 2, |name| format!("other {name}"));
    let told = refusal(&rig);
    assert!(told.contains("camera `left`, camera `right` and camera `grey` share no epoch"), "{told}");
}

#[test]
fn two_epochs_that_are_exchanged_are_named() {
    let mut rig = observed(1, 0.0);
    rename(&mut rig, 1, |name| match name {
        "E03" => "E05".to_owned(),
        "E05" => "E03".to_owned(),
        other => other.to_owned(),
    });
    let told = refusal(&rig);
    assert!(
        told.contains("`E03` was taken at epoch `E05`") && told.contains("`E05` was taken at epoch `E03`"),
        "{told}"
    );
    assert!(told.contains("camera `right`"), "{told}");
}

#[test]
fn epochs_that_are_all_shifted_are_named() {
    let mut rig = observed(1, 0.0);
    rename(&mut rig, 2, |name| format!("E{:02}", (name[1..].parse::<usize>().unwrap() + 1) % 12));
    let told = refusal(&rig);
    assert!(told.contains("camera `grey`") && told.contains("`E03` was taken at epoch `E02`"), "{told}");
}

#[test]
fn one_wild_sighting_is_left_out() {
    let mut rig = observed(1, 0.0);
    let col = &mut rig.cameras[1].network.sightings[40].pixel.as_mut().unwrap()[0];
    *col += if *col < 88.0 { 7.0 } else { -7.0 };
    let outcome = calibrate_rig(&rig, &options(TERMS)).unwrap();
    let rejected: Vec<_> = outcome.cameras[1]
        .calibration
        .residuals
        .iter()
        .filter(|quality| quality.verdict == Verdict::Rejected)
        .collect();
    assert!(rejected.len() >= 2 && rejected.len() <= 4, "{rejected:?}");
    let off = pose_difference(&mountings()[1], &outcome.cameras[1].rig_from_camera);
    assert!(off.fixed_rows::<3>(0).norm() < 2e-3, "{off}");
}

#[test]
fn control_in_millimetres_is_told() {
    let mut rig = observed(1, 0.0);
    for camera in &mut rig.cameras {
        for (target, known) in camera.network.targets.iter_mut().zip(&truth(0).targets) {
            target.point = known.point.map(|point| point * 1e3);
            target.covariance = Some(Matrix3::from_diagonal_element(1.0));
        }
    }
    let options = CalibrationOptions { datum: NetworkDatum::Control, ..options(TERMS) };
    let told = calibrate_rig(&rig, &options).unwrap_err().to_string();
    assert!(told.contains("camera `left`") && told.contains("millimetres instead of metres"), "{told}");
}

#[test]
fn observations_of_another_camera_are_told() {
    // The grey camera's image points with a range camera's image.
    let mut rig = observed(1, 0.0);
    let grey = rig.cameras[2].network.clone();
    let mut right = rig.cameras[1].network.clone();
    for seen in &mut right.sightings {
        seen.range_m = None;
    }
    right.camera = grey.camera;
    rig.cameras[2].network = right;
    let told = refusal(&rig);
    assert!(told.contains("camera `grey`"), "{told}");
}

#[test]
fn cameras_that_are_exchanged_are_told_where_their_places_are_known() {
    let mut rig = observed(1, 0.0);
    let [_, right, grey] = mountings();
    rig.cameras[1].approximate = Some(right);
    rig.cameras[2].approximate = Some(grey);
    assert!(calibrate_rig(&rig, &options(TERMS)).is_ok());
    let (first, second) = rig.cameras.split_at_mut(1);
    std::mem::swap(&mut first[0].network, &mut second[0].network);
    let told = refusal(&rig);
    assert!(told.contains("cameras `left` and `right` are exchanged"), "{told}");
    rig.cameras[1].approximate = Some(Isometry3::translation(5.0, 0.0, 0.0));
    assert!(refusal(&rig).contains("from where rig.ron has it"));
}

#[test]
fn what_is_not_a_number_is_refused_by_camera() {
    let mut rig = observed(1, 0.0);
    rig.cameras[2].network.sightings[3].pixel = Some([f64::NAN, 3.0]);
    let told = refusal(&rig);
    assert!(told.contains("camera `grey`") && told.contains("NaN"), "{told}");
    let mut rig = observed(1, 0.0);
    rig.cameras[2].network.sightings.clear();
    assert!(refusal(&rig).contains("camera `grey`: it has no sightings"));
}
