//! Mountings and calibrations from observations whose truth is known.

use rig_calibration::calibrate_rig;
use rig_calibration::nalgebra::Isometry3;
use rigid_pose::pose_difference;

use crate::rigs::{NAMES, TERMS, epochs, mountings, observed, options, truth};

#[test]
fn mountings_and_range_terms_are_those_of_the_truth() {
    let outcome = calibrate_rig(&observed(1, 0.0), &options(TERMS)).unwrap();
    assert!(outcome.doubts.is_empty(), "{:?}", outcome.doubts);
    assert_eq!(outcome.epochs.len(), epochs().len());
    assert_eq!(outcome.covariance.nrows(), 12);
    for (index, (camera, mounting)) in outcome.cameras.iter().zip(mountings()).enumerate() {
        assert_eq!(camera.name, NAMES[index]);
        let off = pose_difference(&mounting, &camera.rig_from_camera);
        if index == 0 {
            assert_eq!(camera.rig_from_camera, Isometry3::identity());
            continue;
        }
        let normalised = camera.covariance.cholesky().unwrap().solve(&off).dot(&off);
        // Of six degrees of freedom one in ten thousand is beyond 27.9.
        assert!(normalised < 27.9, "{}: {normalised}", camera.name);
        assert!(off.fixed_rows::<3>(0).norm() < 2e-3, "{off}");
        assert!(camera.by_epoch.len() >= 9);
        for residual in &camera.by_epoch {
            let worst = residual.step.component_div(&residual.sigma).amax();
            assert!(worst < 6.0, "{} {}: {worst}", camera.name, residual.epoch);
        }
    }
    for (index, camera) in outcome.cameras.iter().enumerate().take(2) {
        let true_d0 = truth(index).range_model.terms.d0;
        let d0 = camera.calibration.parameter("d0").unwrap();
        assert!((d0.value - true_d0).abs() < 4.0 * d0.sigma_prior, "{}: {}", camera.name, d0.value);
    }
    // The poses of a mounted camera have the covariance of the rig's pose and of its mounting.
    let right = &outcome.cameras[1].calibration.stations;
    assert!(right.iter().all(|station| station.covariance.cholesky().is_some()));
}

#[test]
fn automatic_terms_and_gross_errors_leave_the_mountings_alone() {
    use rig_calibration::self_calibration::CalibrationOptions;
    let outcome = calibrate_rig(&observed(2, 0.01), &CalibrationOptions::default()).unwrap();
    let rejected: usize = outcome.cameras.iter().map(|camera| camera.calibration.rejected()).sum();
    assert!(rejected >= 10, "{rejected}");
    for (camera, mounting) in outcome.cameras.iter().zip(mountings()).skip(1) {
        let off = pose_difference(&mounting, &camera.rig_from_camera);
        let normalised = camera.covariance.cholesky().unwrap().solve(&off).dot(&off);
        assert!(normalised < 27.9, "{}: {normalised}", camera.name);
    }
}

#[test]
fn a_camera_whose_calibration_is_held_keeps_it() {
    let mut rig = observed(3, 0.0);
    rig.cameras[2].network.camera = truth(2).camera;
    rig.cameras[2].terms = Some(Vec::new());
    let outcome = calibrate_rig(&rig, &options(TERMS)).unwrap();
    assert_eq!(outcome.cameras[2].calibration.camera, truth(2).camera);
    assert!(outcome.cameras[2].calibration.estimated.is_empty());
}
