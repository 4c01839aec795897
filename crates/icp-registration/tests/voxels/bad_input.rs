//! Input that has no answer gets a typed one.

use icp_registration::{Error, IcpResult, VoxelAlignmentOptions, VoxelCloud};
use nalgebra::{Isometry3, Point3, Vector3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use rigid_pose::InputError;

use super::scenes::bare;
use crate::common::{Pinhole, frame_pair};

fn good() -> Cloud {
    bare(&frame_pair(&Pinhole { width: 88, height: 72, focal_px: 76.0 }, 2).target.0)
}

fn run(source: &Cloud, target: &Cloud) -> Result<IcpResult, Error> {
    let target = VoxelCloud::new(target, None)?;
    let source = VoxelCloud::new(source, None)?;
    target.align(&source, &Isometry3::identity(), &VoxelAlignmentOptions::default())
}

#[test]
fn clouds_without_an_answer() {
    let good = good();
    let both = |bad: &Cloud, is: &dyn Fn(&Error) -> bool| {
        for error in [run(bad, &good).unwrap_err(), run(&good, bad).unwrap_err()] {
            assert!(is(&error), "{error}");
        }
    };
    both(&Cloud::default(), &|e| matches!(e, Error::Cloud(CloudError::Input(InputError::Empty { .. }))));
    both(&Cloud::new(vec![Point3::new(f64::NAN, 0.0, 0.0); 30]), &|e| {
        matches!(e, Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))
    });
    let few = |e: &Error| matches!(e, Error::Input(InputError::TooFewCorrespondences { .. }));
    both(&Cloud::new(vec![Point3::new(0.0, 0.0, -1.0)]), &few);
    both(&Cloud::new(vec![Point3::new(0.0, 0.0, -1.0); 500]), &few);
    both(&Cloud::new((0..500).map(|i| Point3::new(f64::from(i) * 0.01, 0.0, -1.0)).collect()), &few);
    both(&good.transformed(&Isometry3::translation(0.0, 1e6, 0.0)), &few);
    let rim = Cloud { rim: Some(vec![true; good.len()]), ..good.clone() };
    both(&rim, &|e| matches!(e, Error::Input(InputError::Empty { .. })));
    both(&Cloud { normals: Some(vec![]), ..good.clone() }, &|e| {
        matches!(e, Error::Cloud(CloudError::Input(InputError::LengthMismatch { .. })))
    });
}

#[test]
fn options_outside_their_domain() {
    let good = good();
    let prepared = VoxelCloud::new(&good, None).unwrap();
    let default = VoxelAlignmentOptions::default;
    for options in [
        VoxelAlignmentOptions { max_start_error_m: Some(0.0), ..default() },
        VoxelAlignmentOptions { max_motion_sigma_m: Some(-1.0), ..default() },
        VoxelAlignmentOptions { max_iterations: 0, ..default() },
    ] {
        let result = prepared.align(&prepared, &Isometry3::identity(), &options);
        assert!(matches!(result, Err(Error::Input(InputError::InvalidOption { .. }))), "{options:?}");
    }
    for voxel_m in [0.0, -1.0, f64::NAN, 1e-9, 1e-320] {
        assert!(matches!(VoxelCloud::new(&good, Some(voxel_m)), Err(Error::VoxelSize { .. })), "{voxel_m}");
    }
    let nowhere = Isometry3::translation(f64::NAN, 0.0, 0.0);
    assert!(matches!(prepared.align(&prepared, &nowhere, &default()), Err(Error::Input(InputError::NonFinite { .. }))));
}

#[test]
fn a_cloud_fits_itself_exactly() {
    let prepared = VoxelCloud::new(&good(), None).unwrap();
    let result = prepared.align(&prepared, &Isometry3::identity(), &VoxelAlignmentOptions::default()).unwrap();
    let error = result.target_from_source;
    // The step tolerance is 1e-5 of the radius.
    assert!(error.translation.vector.norm() < 1e-4 && error.rotation.angle() < 1e-4, "{error}");
    assert!(result.covariance.iter().all(|v| v.is_finite()));
}

#[test]
fn outliers_far_away_leave_the_pose_alone() {
    let mut cloud = good();
    cloud.points.extend((0..20).map(|i| Point3::from(Vector3::new(37.0, -61.0, 45.0) * f64::from(i))));
    let target = VoxelCloud::new(&cloud, None).unwrap();
    let source = VoxelCloud::new(&good(), None).unwrap();
    let result = target.align(&source, &Isometry3::identity(), &VoxelAlignmentOptions::default()).unwrap();
    // Voxels of another size: the scatter of two ways to average one cloud.
    assert!(result.target_from_source.translation.vector.norm() < 3e-3, "{}", result.target_from_source);
}
