//! Features of amplitude images, and ICP on sparse clouds of them.

use crate::common::{Pinhole, look_at, pose_error};
use crate::painted::frame;
use global_registration::Error;
use global_registration::{
    AmplitudeFeatureOptions, CoarseOptions, FeatureCloud, Features, SparseIcpOptions, SurfaceDescriptors,
    align_features, align_without_guess, amplitude_features,
};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use rigid_pose::InputError;

fn features(camera: &Pinhole, pose: &Isometry3<f64>) -> (Vec<[f64; 3]>, Features) {
    let (amplitude, points) = frame(camera, pose);
    let options = AmplitudeFeatureOptions::default();
    let found = amplitude_features(&amplitude, &points, camera.width, camera.height, &options).unwrap();
    (points, found)
}

/// Two views, 0.8 m nearer and turned.
fn views() -> [Isometry3<f64>; 2] {
    let turn = nalgebra::UnitQuaternion::from_axis_angle(&Vector3::z_axis(), 0.4);
    [look_at([0.0, -1.0, 1.2], [0.0, 2.0, 0.8]), look_at([0.5, -0.3, 1.3], [0.1, 2.0, 0.8]) * turn]
}

#[test]
fn painted_walls_are_aligned_by_their_amplitude() {
    let camera = Pinhole::medium();
    let [target_pose, source_pose] = views();
    let truth = target_pose.inverse() * source_pose;
    let options = CoarseOptions { descriptors: SurfaceDescriptors::None, ..CoarseOptions::default() };
    // A wall and a floor say nothing about the motion along their edge: the verification by surfaces has to be told.
    let with = |pose: &Isometry3<f64>| {
        let (points, found) = features(&camera, pose);
        assert!(found.len() > 50, "{} features", found.len());
        let cloud = Cloud::from_frame(&points, None, None).unwrap();
        FeatureCloud::new(&cloud, &options).unwrap().with_features(found)
    };
    let (target, source) = (with(&target_pose), with(&source_pose));
    let options = CoarseOptions { min_determined: 0.0, min_inside: 0.0, ..options };
    let found = align_without_guess(&source, &target, &options).unwrap();
    let (millimetre, degree) = pose_error(&found.target_from_source, &truth);
    // The criterion of a start for a fine registration.
    assert!(millimetre < 100.0 && degree < 5.0, "{millimetre} mm, {degree} deg");
}

#[test]
fn features_alone_reach_the_pose_from_a_rough_guess() {
    let camera = Pinhole::medium();
    let [target_pose, source_pose] = views();
    let truth = target_pose.inverse() * source_pose;
    let ((_, target), (_, source)) = (features(&camera, &target_pose), features(&camera, &source_pose));
    let guess = truth * Isometry3::new(Vector3::new(0.1, -0.1, 0.05), Vector3::new(0.05, 0.03, -0.04));
    let found = align_features(&source, &target, &guess, &SparseIcpOptions::new(0.4, 0.03)).unwrap();
    let (millimetre, degree) = pose_error(&found.target_from_source, &truth);
    // A keypoint takes the point of its pixel, 15 mm wide at 3 m; some 50 of them average that.
    assert!(millimetre < 15.0 && degree < 0.5, "{millimetre} mm, {degree} deg, {} pairs", found.pairs.len());
}

#[test]
fn the_range_does_not_change_a_descriptor_by_itself() {
    // The same image, seen twice as bright: logarithms differ by a constant.
    let camera = Pinhole::small();
    let (amplitude, points) = frame(&camera, &views()[0]);
    let brighter: Vec<f32> = amplitude.iter().map(|a| 2.0 * a).collect();
    let options = AmplitudeFeatureOptions::default();
    let found =
        [&amplitude, &brighter].map(|a| amplitude_features(a, &points, camera.width, camera.height, &options).unwrap());
    // Rounding may move a few keypoints over a threshold.
    assert!(found[0].len().abs_diff(found[1].len()) <= found[0].len() / 50);
}

#[test]
fn bad_frames_are_named() {
    let options = AmplitudeFeatureOptions::default();
    let nan = vec![[f64::NAN; 3]; 400];
    assert!(matches!(
        amplitude_features(&[1.0; 9], &nan, 20, 20, &options),
        Err(Error::Input(InputError::LengthMismatch { .. }))
    ));
    assert!(matches!(
        amplitude_features(&[1.0; 400], &nan, 20, 20, &options),
        Err(Error::Input(InputError::TooFewPoints { .. }))
    ));
    assert!(matches!(amplitude_features(&[], &[], 0, 0, &options), Err(Error::Input(InputError::TooFewPoints { .. }))));
    let flat = vec![[0.0, 0.0, -1.0]; 400];
    assert!(amplitude_features(&[1.0; 400], &flat, 20, 20, &options).unwrap().is_empty());
    assert!(amplitude_features(&[f32::NAN; 400], &flat, 20, 20, &options).is_err());
    let bad = AmplitudeFeatureOptions { min_contrast: f64::NAN, ..options };
    assert!(matches!(
        amplitude_features(&[1.0; 400], &flat, 20, 20, &bad),
        Err(Error::Input(InputError::InvalidOption { .. }))
    ));
    assert!(Features::new(vec![Point3::origin()], &[f32::NAN], 1).is_err());
    assert!(Features::new(vec![Point3::origin()], &[1.0], 0).is_err());
    let one = Features::new(vec![Point3::origin()], &[1.0], 1).unwrap();
    let wide = Features::new(vec![Point3::origin()], &[1.0, 0.0], 2).unwrap();
    let (identity, sparse) = (Isometry3::identity(), SparseIcpOptions::new(1.0, 0.1));
    assert!(matches!(
        align_features(&one, &wide, &identity, &sparse),
        Err(Error::Input(InputError::LengthMismatch { .. }))
    ));
    assert!(matches!(
        align_features(&one, &one, &identity, &sparse),
        Err(Error::Input(InputError::TooFewCorrespondences { .. }))
    ));
    let none = SparseIcpOptions::new(0.1, 1.0);
    assert!(matches!(
        align_features(&one, &one, &identity, &none),
        Err(Error::Input(InputError::InvalidOption { .. }))
    ));
}
