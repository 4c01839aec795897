//! Pixel, ray, point and observation: there and back.

use crate::common::{cameras, object_point, pixels, plain_camera, poses};
use camera_model::{Camera, Error, LensDistortion};
use nalgebra::{Isometry3, Point3};
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn lens_off_and_on((camera, pixel, _) in pixels()) {
        let observed = camera.format.image_from_pixel(pixel);
        let again = camera.observed_image_point(camera.corrected_image_point(observed)).unwrap();
        let scale = observed[0].hypot(observed[1]) + camera.interior.principal_distance_mm;
        // Rounding of the polynomial times the condition of the inverse, which is below 3 inside the image.
        prop_assert!((again[0] - observed[0]).abs() < 1e-14 * scale, "{again:?} {observed:?}");
        prop_assert!((again[1] - observed[1]).abs() < 1e-14 * scale, "{again:?} {observed:?}");
    }

    #[test]
    fn pixel_to_point_to_pixel((camera, pixel, range) in pixels()) {
        let point = camera.point(pixel, range);
        let again = camera.project(&point).unwrap();
        // 1e-11 pixel: rounding at image coordinates of some hundred pixels.
        prop_assert!((again[0] - pixel[0]).abs() < 1e-11 && (again[1] - pixel[1]).abs() < 1e-11);
        prop_assert!((point.coords.norm() - range).abs() < 1e-14 * range);
        prop_assert!(camera.contains(again) || pixel.iter().any(|p| (p + 0.5).abs() < 1e-9));
    }

    #[test]
    fn observation_agrees_with_eq_3((camera, pixel, range) in pixels(), pose in poses()) {
        let point = object_point(&camera, &pose, pixel, range);
        let seen = camera.observe(&pose, &point).unwrap();
        let expected = camera.format.image_from_pixel(pixel);
        // World coordinates of up to 25 m against ranges from 0.1 m: 1e-12 is their rounding, seen by the camera.
        let tolerance = 1e-12 * (camera.interior.principal_distance_mm + 1.0);
        prop_assert!((seen.image_mm[0] - expected[0]).abs() < tolerance);
        prop_assert!((seen.image_mm[1] - expected[1]).abs() < tolerance);
        prop_assert!((seen.range_m - range).abs() < 1e-13 * (range + 25.0));
    }

    #[test]
    fn nothing_panics(camera in cameras(), numbers in prop::array::uniform7(any::<f64>())) {
        let wild = Camera { lens: LensDistortion::from_coefficients(numbers), ..camera };
        let point = Point3::new(numbers[0], numbers[1], -numbers[2].abs());
        let _ = wild.observed_image_point([numbers[3], numbers[4]]);
        let _ = wild.project(&point);
        let _ = wild.observe_with_jacobians(&Isometry3::identity(), &point);
        let _ = wild.ray([numbers[3], numbers[4]]);
    }
}

#[test]
fn a_pinhole_projects_by_similar_triangles() {
    let camera = Camera { lens: LensDistortion::default(), ..plain_camera() };
    let seen = camera.observe(&Isometry3::identity(), &Point3::new(0.5, 0.25, -2.0)).unwrap();
    assert!((seen.image_mm[0] - (0.11 + 8.0 * 0.25)).abs() < 1e-15);
    assert!((seen.image_mm[1] - (-0.07 + 8.0 * 0.125)).abs() < 1e-15);
    let pixel = camera.project(&Point3::new(0.5, 0.25, -2.0)).unwrap();
    // y up in the image, rows downwards.
    assert!((pixel[0] - (87.5 + 2.11 / 0.04)).abs() < 1e-12);
    assert!((pixel[1] - (71.5 - 0.93 / 0.04)).abs() < 1e-12);
}

#[test]
fn correction_is_that_of_the_equations() {
    let camera = plain_camera();
    let [x, y] = [1.3 - 0.11, -0.9 + 0.07];
    let r2: f64 = x * x + y * y;
    let radial = -2.1e-3 * r2 + 3.0e-5 * r2 * r2 - 4.0e-7 * r2 * r2 * r2;
    let dx = x * radial + 1.2e-4 * (r2 + 2.0 * x * x) + 2.0 * -0.8e-4 * x * y + 7.0e-4 * x - 4.0e-4 * y;
    let dy = y * radial + -0.8e-4 * (r2 + 2.0 * y * y) + 2.0 * 1.2e-4 * x * y;
    let found = camera.lens.correction(&camera.interior, [1.3, -0.9]);
    assert!((found[0] - dx).abs() < 1e-16 && (found[1] - dy).abs() < 1e-16);
    // Barrel distortion: the observed point is too close to the centre, the corrected one further out.
    let corrected = camera.corrected_image_point([3.0, 0.0]);
    assert!(corrected[0] > 3.0);
}

#[test]
fn points_behind_are_refused() {
    let camera = plain_camera();
    for z in [0.0, 1.0, f64::NAN] {
        let answer = camera.project(&Point3::new(0.1, 0.1, z));
        assert!(matches!(answer, Err(Error::BehindCamera { .. })), "{answer:?}");
    }
    assert!(camera.observe(&Isometry3::identity(), &Point3::new(0.0, 0.0, 2.0)).is_err());
    assert!(camera.project(&Point3::new(f64::NAN, 0.0, -1.0)).is_err());
    assert!(camera.project(&Point3::new(1.0, 0.0, -1e-320)).is_err());
}

#[test]
fn the_fold_is_where_the_derivative_vanishes() {
    // One positive k1: g(r) = r - k1 r^3 grows up to r = 1 / sqrt(3 k1) and reaches 2/3 of that radius there.
    let k1 = 0.01_f64;
    let fold = 1.0 / (3.0 * k1).sqrt();
    let mut camera = Camera { lens: LensDistortion { k1, ..LensDistortion::default() }, ..plain_camera() };
    camera.interior.principal_point_mm = [0.0, 0.0];
    let reach = fold * 2.0 / 3.0;
    let direction = [0.6, 0.8];
    let before = camera.observed_image_point(direction.map(|d| d * reach * 0.999_999)).unwrap();
    let radius = before[0].hypot(before[1]);
    assert!(radius < fold && radius > 0.99 * fold, "{radius} {fold}");
    let beyond = camera.observed_image_point(direction.map(|d| d * reach * 1.000_001));
    assert!(matches!(beyond, Err(Error::NoObservedPoint { .. })), "{beyond:?}");
}

#[test]
fn strong_barrel_distortion_is_inverted_far_out() {
    // Here a fixed-point iteration diverges: the correction grows faster than the point.
    let camera = Camera { lens: LensDistortion { k1: -0.5, ..LensDistortion::default() }, ..plain_camera() };
    let corrected = camera.corrected_image_point([30.0, 40.0]);
    let observed = camera.observed_image_point(corrected).unwrap();
    assert!((observed[0] - 30.0).abs() < 1e-12 && (observed[1] - 40.0).abs() < 1e-12, "{observed:?}");
}

#[test]
fn affinity_and_shear_alone_are_a_linear_map() {
    let lens = LensDistortion { b1: 0.1, b2: -0.3, ..LensDistortion::default() };
    let camera = Camera { lens, ..plain_camera() };
    let [x, y] = camera.corrected_image_point([2.11, 0.93]);
    // From the principal point (0.11, -0.07): x = 2 - 0.1 * 2 + 0.3 * 1, y = 1.
    assert!((x - (0.11 + 2.1)).abs() < 1e-15 && (y - (-0.07 + 1.0)).abs() < 1e-15, "{x} {y}");
    let observed = camera.observed_image_point([x, y]).unwrap();
    assert!((observed[0] - 2.11).abs() < 1e-14 && (observed[1] - 0.93).abs() < 1e-14, "{observed:?}");
    // An affinity of 1 presses the image flat: nothing can be told of a point.
    let flat = Camera { lens: LensDistortion { b1: 1.0, ..lens }, ..camera };
    assert!(flat.observed_image_point([x, y]).is_err());
    assert!(matches!(camera_model::RayTable::new(&flat), Err(Error::FoldInsideImage { .. })));
}

#[test]
fn invalid_cameras_are_refused() {
    let good = plain_camera();
    let mut bad = good;
    bad.interior.principal_distance_mm = 0.0;
    assert!(bad.validate().is_err());
    bad = good;
    bad.lens.k2 = f64::NAN;
    assert!(bad.validate().is_err());
    bad = good;
    bad.lens.b2 = f64::INFINITY;
    assert!(matches!(bad.validate(), Err(Error::OutOfDomain { name: "b2", .. })));
    bad = good;
    bad.format.width = 0;
    assert!(matches!(bad.validate(), Err(Error::Image(_))));
}
