//! Captures of a wall whose truth is known.

use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{RangeErrorModel, RangeTerms, distort_frame};
use nalgebra::{DVector, Isometry3, Matrix6, Point3, Vector3, Vector6};
use rand::SeedableRng;
use rand_distr::{Distribution, Normal, StandardNormal};
use rand_pcg::Pcg64;
use range_calibration::{
    DifferenceOptions, Plane, PlaneCalibration, PlaneCalibrationOptions, PlaneCapture, Scale, calibrate_planes,
};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

pub const INTERVAL: f64 = 5.0;
pub const SIGMA_M: f64 = 0.004;

/// A principal distance of 4 mm sees 41 degrees to each side, one of 8 mm 24, one of 30 mm 7.
pub fn camera(principal_distance_mm: f64) -> Camera {
    let format = ImageFormat::new(44, 36, [0.16, 0.16]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.12, -0.2], principal_distance_mm };
    Camera::new(format, interior, LensDistortion { k1: -1e-3, b1: 1e-3, ..LensDistortion::default() }).unwrap()
}

pub fn truth() -> RangeErrorModel {
    let terms = RangeTerms { d0: -0.02, periodic: [0.004, 0.005, -0.004, 0.003, 0.01, 0.006], e1: 1e-3, e2: 2e-3 };
    RangeErrorModel { terms, ..RangeErrorModel::error_free(INTERVAL) }
}

pub fn wall() -> Plane {
    Plane::new(&Vector3::new(0.1, 0.05, 1.0), &Point3::new(0.0, 0.0, -5.5)).unwrap()
}

/// Poses on a line towards the wall, each turned a little otherwise.
pub fn poses(count: usize) -> Vec<Isometry3<f64>> {
    let pose = |i: usize| {
        let t = i as f64;
        let turn = Vector3::new(0.2 * (1.3 * t).sin(), 0.25 * (0.7 * t).cos(), 0.1 * t);
        Isometry3::new(Vector3::new(0.1 * t.sin(), 0.1, -4.6 * t / count as f64), turn)
    };
    (0..count).map(pose).collect()
}

/// What the camera shows of the wall from a pose, with noise of this standard deviation.
pub fn show(camera: &Camera, pose: &Isometry3<f64>, sigma_m: f64, random: &mut Pcg64) -> RangeFrame {
    let (width, height) = (camera.format.width, camera.format.height);
    let range = |col, row| wall().reference_range(camera, pose, [col as f64, row as f64]).map_or(f64::NAN, |(r, _)| r);
    let mut frame = RangeFrame {
        range: Raster::from_fn(width, height, |col, row| range(col, row) as f32),
        sigma: Raster::filled(width, height, sigma_m.max(1e-6) as f32),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    };
    distort_frame(&mut frame, &truth(), &camera.format, camera.interior.principal_point_mm, None).unwrap();
    let noise = Normal::new(0.0, sigma_m).unwrap();
    for value in frame.range.as_mut_slice() {
        *value += noise.sample(random) as f32;
    }
    frame
}

pub fn frames(camera: &Camera, poses: &[Isometry3<f64>], sigma_m: f64, seed: u64) -> Vec<RangeFrame> {
    let mut random = Pcg64::seed_from_u64(seed);
    poses.iter().map(|pose| show(camera, pose, sigma_m, &mut random)).collect()
}

pub fn captures<'a>(
    frames: &'a [RangeFrame],
    pose: impl Fn(usize) -> Option<Isometry3<f64>>,
    covariance: Option<&Matrix6<f64>>,
) -> Vec<PlaneCapture<'a>> {
    let capture = |(index, frame)| PlaneCapture {
        name: format!("S{index}"),
        frame,
        world_from_camera: pose(index),
        drift_m: 0.0,
        covariance: covariance.copied(),
        plane: 0,
    };
    frames.iter().enumerate().map(capture).collect()
}

pub fn options(step: usize) -> PlaneCalibrationOptions {
    let mut options = PlaneCalibrationOptions::default();
    options.pixels = DifferenceOptions { step, ..options.pixels };
    options
}

/// Squared error of the estimated terms by their covariance, divided by their number: 1 on average.
pub fn normalised_error(calibration: &PlaneCalibration) -> f64 {
    let truth = truth().to_parameters();
    let error: Vec<f64> = calibration
        .estimated_names()
        .iter()
        .map(|name| {
            let value = |list: &[error_models::NamedParameter]| list.iter().find(|p| p.name == *name).unwrap().value;
            value(&calibration.parameters(Scale::Prior).unwrap()) - value(&truth)
        })
        .collect();
    let error = DVector::from_vec(error);
    let solved = calibration.covariance(Scale::Prior).unwrap().lu().solve(&error).unwrap();
    error.dot(&solved) / error.len() as f64
}

/// Mean of normalised errors over seeded surveys.
pub fn mean_over_surveys(surveys: u64, calibrate: impl Fn(u64) -> PlaneCalibration) -> f64 {
    (0..surveys).map(|seed| normalised_error(&calibrate(seed))).sum::<f64>() / surveys as f64
}

/// A survey of a known wall from ten poses that are known with standard deviations, and its calibration.
pub fn with_weighted_poses(seed: u64) -> PlaneCalibration {
    let (camera, poses) = (camera(8.0), poses(10));
    let deviations = Vector6::new(3e-3, 3e-3, 3e-3, 1e-3, 1e-3, 1e-3);
    let covariance = Matrix6::from_diagonal(&deviations.component_mul(&deviations));
    let mut random = Pcg64::seed_from_u64(1000 + seed);
    let mut disturbed = |pose: &Isometry3<f64>| {
        let step: [f64; 6] = std::array::from_fn(|i| {
            let normal: f64 = StandardNormal.sample(&mut random);
            deviations[i] * normal
        });
        camera_model::step_pose(pose, &step)
    };
    let disturbed: Vec<_> = poses.iter().map(&mut disturbed).collect();
    let frames = frames(&camera, &poses, SIGMA_M, seed);
    let captures = captures(&frames, |i| Some(disturbed[i]), Some(&covariance));
    calibrate_planes(&captures, &[Some(wall())], &camera, INTERVAL, &options(4)).unwrap()
}

/// A survey from ten unknown poses, each with a plane of its own, and its calibration; e1 and e2 are held.
pub fn with_planes_of_their_own(seed: u64) -> PlaneCalibration {
    let camera = camera(4.0);
    let mut hold = options(2);
    hold.terms = hold.terms.hold("e1", 1e-3).unwrap().hold("e2", 2e-3).unwrap();
    let frames = frames(&camera, &poses(10), SIGMA_M, seed);
    calibrate_planes(&captures(&frames, |_| None, None), &[], &camera, INTERVAL, &hold).unwrap()
}
