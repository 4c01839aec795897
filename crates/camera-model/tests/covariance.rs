//! The covariance of a point against a sampled one.

use crate::common::plain_camera;
use camera_model::{Camera, LensDistortion, point_covariance, with_affinity_held};
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;

const SAMPLES: usize = 40_000;

/// Covariance of the points that `sample` draws.
fn sampled(mut sample: impl FnMut(&mut Pcg64) -> Vector3<f64>) -> Matrix3<f64> {
    let mut generator = Pcg64::seed_from_u64(20_261_121);
    let points: Vec<_> = (0..SAMPLES).map(|_| sample(&mut generator)).collect();
    let mean = points.iter().sum::<Vector3<f64>>() / SAMPLES as f64;
    points.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>() / (SAMPLES - 1) as f64
}

fn normal(generator: &mut Pcg64) -> f64 {
    StandardNormal.sample(generator)
}

/// An element of a sampled covariance scatters by sqrt((1 + rho^2) / n) of the deviations' product, at most 0.7 % for
/// 40,000 samples; 4 % is more than five times that and covers the second order that propagation leaves out.
fn require_agreement(found: &Matrix3<f64>, expected: &Matrix3<f64>) {
    for i in 0..3 {
        for j in 0..3 {
            let scale = (expected[(i, i)] * expected[(j, j)]).sqrt();
            let difference = (found[(i, j)] - expected[(i, j)]).abs();
            assert!(difference < 0.04 * scale, "({i}, {j}): {found} instead of {expected}");
        }
    }
}

#[test]
fn range_and_image_point() {
    let camera = plain_camera();
    let [pixel, range] = [[20.0, 130.0], [3.0, 0.0]];
    let found = point_covariance(&camera, pixel, range[0], 0.01, [0.3, 0.2], None);
    let expected = sampled(|generator| {
        let noisy = [pixel[0] + 0.3 * normal(generator), pixel[1] + 0.2 * normal(generator)];
        camera.point(noisy, range[0] + 0.01 * normal(generator)).coords
    });
    require_agreement(&found, &expected);
}

#[test]
fn calibration_with_its_correlations() {
    let camera = plain_camera();
    // Deviations as a self-calibration gives them, and a lower triangle that correlates all ten.
    let deviations = [0.01, 0.012, 0.02, 1e-4, 1e-5, 4e-7, 5e-5, 6e-5, 3e-4, 2e-4];
    let lower = SMatrix::<f64, 10, 10>::from_fn(|i, j| match i.cmp(&j) {
        std::cmp::Ordering::Less => 0.0,
        std::cmp::Ordering::Equal => deviations[i],
        std::cmp::Ordering::Greater => 0.4 * deviations[i] * if (i + j) % 2 == 0 { 1.0 } else { -1.0 },
    });
    let covariance = lower * lower.transpose();
    let pixel = [165.0, 12.0];
    let found = point_covariance(&camera, pixel, 4.0, 0.005, [0.0, 0.0], Some(&covariance));
    let expected = sampled(|generator| {
        let step = lower * SVector::<f64, 10>::from_fn(|_, _| normal(generator));
        let mut varied: Camera = camera;
        varied.interior.principal_point_mm[0] += step[0];
        varied.interior.principal_point_mm[1] += step[1];
        varied.interior.principal_distance_mm += step[2];
        let coefficients = camera.lens.coefficients();
        varied.lens = LensDistortion::from_coefficients(std::array::from_fn(|i| coefficients[i] + step[3 + i]));
        varied.point(pixel, 4.0 + 0.005 * normal(generator)).coords
    });
    require_agreement(&found, &expected);
    assert!((found - found.transpose()).norm() == 0.0);
}

#[test]
fn affinity_that_is_held_adds_nothing() {
    let camera = plain_camera();
    let eight = SMatrix::<f64, 8, 8>::identity() * 1e-10;
    let mut ten = with_affinity_held(&eight);
    let held = point_covariance(&camera, [3.0, 9.0], 2.0, 0.0, [0.0, 0.0], Some(&ten));
    assert!(held.trace() > 0.0);
    ten[(8, 8)] = 1e-10;
    let more = point_covariance(&camera, [3.0, 9.0], 2.0, 0.0, [0.0, 0.0], Some(&ten));
    assert!(more[(0, 0)] > held[(0, 0)]);
}

#[test]
fn range_alone_acts_along_the_ray() {
    let camera = plain_camera();
    let found = point_covariance(&camera, [0.0, 0.0], 2.0, 0.01, [0.0, 0.0], None);
    let ray = camera.ray([0.0, 0.0]);
    assert!((found - ray * ray.transpose() * 1e-4).norm() < 1e-18);
}

#[test]
fn unknown_or_impossible_deviations_give_no_number() {
    let camera = plain_camera();
    for (range, pixel) in [(f64::NAN, [0.0, 0.0]), (-0.01, [0.0, 0.0]), (0.01, [0.0, -1.0]), (0.01, [f64::NAN, 0.0])] {
        let found = point_covariance(&camera, [5.0, 5.0], 2.0, range, pixel, None);
        assert!(found.iter().all(|value| value.is_nan()));
    }
    assert!(point_covariance(&camera, [5.0, f64::NAN], 2.0, 0.01, [0.1; 2], None).iter().any(|value| value.is_nan()));
}
