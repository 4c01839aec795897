//! One averaged point for each cube.

use std::collections::BTreeMap;

use icp_registration::{Error, downsample};
use nalgebra::{Point3, Vector3};
use point_cloud::Cloud;
use point_cloud::Error as CloudError;
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use rigid_pose::InputError;

/// Points on a bent sheet with everything that a cloud can know.
fn sheet(count: usize, seed: u64) -> Cloud {
    let mut random = Pcg64::seed_from_u64(seed);
    let mut cloud = Cloud::default();
    let (mut normals, mut sigma, mut intensity, mut rim) = (vec![], vec![], vec![], vec![]);
    for _ in 0..count {
        let (x, y) = (random.random::<f64>() * 2.0 - 1.0, random.random::<f64>() * 2.0 - 1.0);
        cloud.points.push(Point3::new(x, y, 0.3 * x * x));
        normals.push(Vector3::new(-0.6 * x, 0.0, 1.0).normalize());
        sigma.push(0.001 + 0.001 * random.random::<f64>());
        intensity.push(random.random::<f64>());
        rim.push(random.random::<f64>() < 0.4);
    }
    Cloud { normals: Some(normals), sigma: Some(sigma), intensity: Some(intensity), rim: Some(rim), ..cloud }
}

#[test]
fn averages_are_those_of_the_points_in_each_cube() {
    let (cloud, voxel) = (sheet(30_000, 1), 0.13);
    let mut cubes: BTreeMap<[i64; 3], Vec<usize>> = BTreeMap::new();
    for (i, p) in cloud.points.iter().enumerate() {
        cubes.entry([p.x, p.y, p.z].map(|v| (v / voxel).floor() as i64)).or_default().push(i);
    }
    let thin = downsample(&cloud, voxel).unwrap();
    assert_eq!(thin.len(), cubes.len());
    let mut seen = 0;
    for (k, p) in thin.points.iter().enumerate() {
        let members = &cubes[&[p.x, p.y, p.z].map(|v| (v / voxel).floor() as i64)];
        let n = members.len() as f64;
        let mean = members.iter().fold(Vector3::zeros(), |s, &i| s + cloud.points[i].coords) / n;
        // Rounding of sums over some hundred points of a metre.
        assert!((p.coords - mean).norm() < 1e-13);
        let of = |plane: &Option<Vec<f64>>, i: usize| plane.as_ref().unwrap()[i];
        let intensity = members.iter().map(|&i| of(&cloud.intensity, i)).sum::<f64>() / n;
        assert!((of(&thin.intensity, k) - intensity).abs() < 1e-13);
        let variance = members.iter().map(|&i| of(&cloud.sigma, i).powi(2)).sum::<f64>();
        assert!((of(&thin.sigma, k) - variance.sqrt() / n).abs() < 1e-13 * variance.sqrt());
        let normal = members.iter().fold(Vector3::zeros(), |s, &i| s + cloud.normals.as_ref().unwrap()[i]).normalize();
        assert!((thin.normals.as_ref().unwrap()[k] - normal).norm() < 1e-13);
        let rims = members.iter().filter(|&&i| cloud.rim.as_ref().unwrap()[i]).count();
        assert_eq!(thin.rim.as_ref().unwrap()[k], 2 * rims > members.len());
        seen += members.len();
    }
    assert_eq!(seen, cloud.len());
}

#[test]
fn unknown_values_stay_out_of_the_averages() {
    let nan = f64::NAN;
    let cloud = Cloud {
        points: [0.1, 0.2, 0.3, 1.1].map(|x| Point3::new(x, 0.1, 0.1)).to_vec(),
        normals: Some(vec![Vector3::x(), Vector3::repeat(nan), -Vector3::x(), Vector3::repeat(nan)]),
        sigma: Some(vec![0.3, nan, 0.4, nan]),
        intensity: Some(vec![nan, 2.0, 4.0, nan]),
        rim: None,
    };
    let thin = downsample(&cloud, 1.0).unwrap();
    assert_eq!(thin.len(), 2);
    // Positions are counted from a corner 256 cubes away.
    assert!((thin.points[0] - Point3::new(0.2, 0.1, 0.1)).norm() < 1e-12);
    // Signs of normals may be arbitrary: opposite ones are the same plane.
    assert!((thin.normals.as_ref().unwrap()[0] - Vector3::x()).norm() < 1e-15);
    assert!((thin.sigma.as_ref().unwrap()[0] - 0.25).abs() < 1e-15);
    assert!((thin.intensity.as_ref().unwrap()[0] - 3.0).abs() < 1e-15);
    assert!(thin.normals.unwrap()[1].x.is_nan() && thin.sigma.unwrap()[1].is_nan());
    assert!(thin.intensity.unwrap()[1].is_nan() && thin.rim.is_none());
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    /// Whatever the scale and the offset, each cube gives one point inside itself, and the mean of all is kept.
    #[test]
    fn every_scale_is_thinned_alike(scale_exponent in -60..60_i32, offset in -1e3..1e3_f64, seed in 0..9_u64) {
        let scale = 10.0_f64.powi(scale_exponent);
        let points: Vec<_> = sheet(500, seed).points.iter().map(|p| (p + Vector3::repeat(offset)) * scale).collect();
        let voxel = 0.2 * scale;
        let thin = downsample(&Cloud::new(points.clone()), voxel).unwrap();
        prop_assert!(thin.len() > 50 && thin.len() < 400);
        let mut cubes: Vec<_> = thin.points.iter().map(|p| [p.x, p.y, p.z].map(|v| (v / voxel).floor() as i64)).collect();
        cubes.sort_unstable();
        cubes.dedup();
        prop_assert_eq!(cubes.len(), thin.len());
    }
}

#[test]
fn clouds_and_sizes_without_an_answer_are_refused() {
    assert!(matches!(
        downsample(&Cloud::default(), 0.1),
        Err(Error::Cloud(CloudError::Input(InputError::Empty { .. })))
    ));
    let cloud = sheet(100, 3);
    for voxel in [0.0, -0.1, f64::NAN, f64::INFINITY, 1e-8, 1e-310] {
        assert!(matches!(downsample(&cloud, voxel), Err(Error::VoxelSize { .. })), "{voxel}");
    }
    let nan = Cloud::new(vec![Point3::new(0.0, f64::NAN, 0.0)]);
    assert!(matches!(
        downsample(&nan, 0.1),
        Err(Error::Cloud(CloudError::Input(InputError::NonFinite { index: 0, .. })))
    ));
    // One cube for all is an answer.
    assert_eq!(downsample(&cloud, 1e9).unwrap().len(), 4);
}

#[test]
fn bits_do_not_depend_on_the_threads() {
    let cloud = sheet(50_000, 4);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| downsample(&cloud, 0.05).unwrap())
    };
    let one = with(1);
    for threads in [2, 5] {
        assert_eq!(with(threads), one);
    }
}
