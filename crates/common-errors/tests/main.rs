//! Common errors of registered stations.

#![allow(clippy::unwrap_used, clippy::float_cmp, clippy::print_stdout)]

#[path = "../../range-calibration/tests/support/round.rs"]
mod round;

use camera_model::Camera;
use common_errors::multiview_registration::{Datum, Start, StationRegistrationOptions, register_stations};
use common_errors::nalgebra::{Isometry3, Matrix6, Vector3};
use common_errors::point_cloud::{Cloud, OrganisedNormalOptions, organised_normals};
use common_errors::point_uncertainty::{Columns, Source};
use common_errors::range_io::calibration::Calibration;
use common_errors::{CommonErrorsFile, Corrected, Frame, Registered, SharedBySensor, common_errors};
use error_models::{ModelSet, NamedParameter, RangeErrorModel};
use range_image::RangeFrame;
use rigid_pose::pose_difference;

const BOTH: Corrected = Corrected { rays: true, ranges: true };

/// A calibration without range errors in which d0 and d4 are known to these deviations.
fn calibration(d0: f64, d4: f64) -> Calibration {
    let models = ModelSet { entries: vec![(0.002, vec![round::model(&[])])] };
    let mut calibration = Calibration::from_models(&round::camera(), &models, None).unwrap();
    for parameter in &mut calibration.range_models[0].parameters {
        let sigma = match parameter.name.as_str() {
            "d0" => d0,
            "d4" => d4,
            _ => continue,
        };
        *parameter = NamedParameter::estimated(&parameter.name, 0.0, sigma).unwrap();
    }
    calibration
}

/// What a camera with this correction makes of a frame.
fn cloud(frame: &RangeFrame, camera: &Camera, model: &RangeErrorModel) -> Cloud {
    let (width, height) = (frame.width(), frame.height());
    let point = |index: usize| {
        let pixel = [(index % width) as f64, (index / width) as f64];
        let [x, y] = camera.format.image_from_pixel(pixel);
        let range = f64::from(frame.range.as_slice()[index]);
        let correction = model.correction(range, x, y, 1.0).total_m();
        <[f64; 3]>::from(camera.ray(pixel) * (range - correction))
    };
    let points: Vec<[f64; 3]> = (0..width * height).map(point).collect();
    let options = OrganisedNormalOptions { half_width_px: 3, ..OrganisedNormalOptions::default() };
    let normals = organised_normals(&points, width, height, &options).unwrap();
    Cloud::from_frame(&points, Some(&normals), Some(frame.sigma.as_slice())).unwrap()
}

fn registered(
    frames: &[RangeFrame],
    model: &RangeErrorModel,
    start: &[Isometry3<f64>],
) -> (Vec<Cloud>, Vec<Isometry3<f64>>) {
    let clouds: Vec<Cloud> = frames.iter().map(|frame| cloud(frame, &round::camera(), model)).collect();
    let options = StationRegistrationOptions::default();
    let found = register_stations(&clouds, Start::Poses(start), Datum::Station(0), &options, &|_, _| {}).unwrap();
    (clouds, found.world_from_station)
}

fn stations(poses: &[Isometry3<f64>]) -> Vec<Frame> {
    let frame = |(index, pose): (usize, &Isometry3<f64>)| Frame {
        view: format!("S{index}"),
        station: format!("S{index}"),
        world_from_camera: *pose,
        stated_covariance: None,
        range_model: Some(0),
        drift_sigma_m: None,
        sensor: None,
    };
    poses.iter().enumerate().map(frame).collect()
}

#[test]
fn registered_poses_follow_the_calibration_as_is_stated() {
    let poses = round::poses(8);
    let frames = round::frames(&poses, &round::model(&[]), 5);
    let (clouds, found) = registered(&frames, &round::model(&[]), &poses);
    let known = calibration(0.002, 0.001);
    let file =
        common_errors(&stations(&found), &round::camera(), Some((&known, BOTH)), Some(Registered { clouds: &clouds }))
            .unwrap();
    let common = file.common().unwrap();
    let names: Vec<&str> = common.errors().iter().map(|error| error.name.as_str()).collect();
    assert_eq!(&names[..3], ["d0", "d4", "S1 dx"]);
    assert_eq!(names.len(), 2 + 6 * 7, "the first station is the datum");
    // A correction with d0 wrong by its deviation, registered anew: poses go where their covariance with d0 leads.
    let (_, moved) = registered(&frames, &round::model(&[("d0", 0.002)]), &found);
    let by = |row: usize| common.covariance()[(row, 0)] / common.covariance()[(0, 0)];
    let (mut worst, mut largest) = (0.0_f64, 0.0_f64);
    for station in 1..8 {
        let first = 2 + 6 * (station - 1);
        assert_eq!(file.frames[station].columns.pose, Some(first));
        let step = pose_difference(&found[station], &moved[station]);
        let stated = Vector3::new(by(first), by(first + 1), by(first + 2)) * 0.002;
        worst = worst.max((stated - step.fixed_rows::<3>(0)).norm());
        largest = largest.max(step.fixed_rows::<3>(0).norm());
    }
    // Two millimetres of d0 move stations by millimetres; robust weights and tiles that change make up the rest.
    println!("moved by {largest:.5} m, stated to {worst:.5} m");
    assert!(largest > 1e-3 && worst < 0.25 * largest, "{largest} {worst}");
    // All of it is a covariance.
    assert!(common.covariance().clone().symmetric_eigenvalues().min() > -1e-12);
}

#[test]
fn stated_poses_and_drifts_stand_beside_the_calibration() {
    let poses = round::poses(2);
    let mut frames = stations(&poses);
    for (frame, sigma) in frames.iter_mut().zip([0.002, 0.003]) {
        frame.stated_covariance = Some(Matrix6::identity() * 1e-6);
        frame.drift_sigma_m = Some(sigma);
        frame.sensor = Some(SharedBySensor { sigma_m: 0.004, share: 0.0, width_px: 8.0 });
    }
    let known = calibration(0.002, 0.0);
    let file = common_errors(&frames, &round::camera(), Some((&known, BOTH)), None).unwrap();
    let common = file.common().unwrap();
    let count = |source| common.errors().iter().filter(|error| error.source == source).count();
    assert_eq!([Source::Calibration, Source::Drift, Source::Pose].map(count), [1, 2, 12]);
    let [first, second] = [0, 1].map(|frame: usize| file.frames[frame].columns.drift.unwrap());
    assert!((common.covariance()[(first, second)] - 6e-6).abs() < 1e-15, "one curve drifts");
    // As a file and back.
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(CommonErrorsFile::FILE_NAME);
    file.write(&path).unwrap();
    let back: CommonErrorsFile = common_errors::range_io::ron_text::read(&path).unwrap();
    assert_eq!(back, file);
}

#[test]
fn what_was_not_corrected_is_not_in_it() {
    let frames = stations(&round::poses(2));
    let known = calibration(0.002, 0.001);
    let none = Corrected { rays: true, ranges: false };
    let file = common_errors(&frames, &round::camera(), Some((&known, none)), None).unwrap();
    assert!(file.errors.is_empty() && file.covariance.is_empty());
    let without = common_errors(&frames, &round::camera(), None, None).unwrap();
    assert!(without.frames.iter().all(|frame| frame.columns == Columns::default()));
}

#[test]
fn many_frames_share_errors_and_a_covariance_that_is_too_large_is_named() {
    let mut frames: Vec<Frame> = (0..1200).flat_map(|_| stations(&round::poses(1))).collect();
    for (index, frame) in frames.iter_mut().enumerate() {
        frame.view = format!("frame {index}");
        frame.drift_sigma_m = Some(1e-3 + 1e-6 * index as f64);
        frame.stated_covariance = Some(Matrix6::identity() * 1e-6);
    }
    let file = common_errors(&frames, &round::camera(), None, None).unwrap();
    let common = file.common().unwrap();
    // Drifts alone, in steps that are at most a part in 255 of their span above each frame's own.
    assert_eq!(common.errors().len(), 256);
    for (frame, of) in frames.iter().zip(&file.frames) {
        let row = of.columns.drift.unwrap();
        let above = common.covariance()[(row, row)].sqrt() - frame.drift_sigma_m.unwrap();
        assert!((-1e-12..1.2e-3 / 255.0).contains(&above), "{above}");
        assert!(of.columns.pose.is_none());
    }
    assert!(file.not_in_it[0].starts_with("poses: the covariance of 1200 frames"), "{:?}", file.not_in_it);
}
