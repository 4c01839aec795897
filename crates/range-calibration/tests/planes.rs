//! Reference ranges and differences of frames to a plane, and the whole two-step calibration.

use approx::assert_relative_eq;
use camera_model::{Camera, InteriorOrientation, LensDistortion};
use error_models::{RangeErrorModel, RangeTerms, correct_frame, distort_frame};
use nalgebra::{Isometry3, Point3, Vector3};
use proptest::prelude::*;
use rand::SeedableRng;
use rand_distr::{Distribution, Normal};
use rand_pcg::Pcg64;
use range_calibration::{DifferenceOptions, Plane, RangeTermOptions, differences_to_plane, estimate_range_terms};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

fn camera() -> Camera {
    let format = ImageFormat::new(44, 36, [0.16, 0.16]).unwrap();
    let interior = InteriorOrientation { principal_point_mm: [0.12, -0.2], principal_distance_mm: 8.0 };
    let lens = LensDistortion { k1: -1.5e-3, p1: 1e-4, ..LensDistortion::default() };
    Camera::new(format, interior, lens).unwrap()
}

fn true_frame(camera: &Camera, pose: &Isometry3<f64>, plane: &Plane) -> RangeFrame {
    let (width, height) = (camera.format.width, camera.format.height);
    let range = |col, row| plane.reference_range(camera, pose, [col as f64, row as f64]).map_or(f64::NAN, |(r, _)| r);
    RangeFrame {
        range: Raster::from_fn(width, height, |col, row| range(col, row) as f32),
        sigma: Raster::filled(width, height, 0.004),
        amplitude: Raster::filled(width, height, 100.0),
        flags: Raster::filled(width, height, Flags::empty()),
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn the_point_at_the_reference_range_lies_on_the_plane(
        position in proptest::array::uniform3(-2.0..2.0_f64), turn in proptest::array::uniform3(-0.5..0.5_f64),
        normal in proptest::array::uniform3(-0.3..0.3_f64), col in 0.0..43.0_f64, row in 0.0..35.0_f64,
    ) {
        let camera = camera();
        let pose = Isometry3::new(Vector3::from(position), Vector3::from(turn));
        let plane = Plane::new(&(Vector3::z() + Vector3::from(normal)), &Point3::new(0.3, 0.2, -7.0)).unwrap();
        let (range, cosine) = plane.reference_range(&camera, &pose, [col, row]).unwrap();
        let point = pose * camera.point([col, row], range);
        prop_assert!((plane.normal().dot(&point.coords) - plane.distance_m()).abs() < 1e-12);
        let direction = pose.rotation * camera.ray([col, row]);
        prop_assert!((cosine - plane.normal().dot(&direction).abs()).abs() < 1e-12);
    }
}

#[test]
fn a_facing_plane_has_its_distance_along_the_axis() {
    let camera = camera();
    let plane = Plane::facing_camera(2.5).unwrap();
    let axis = camera.format.pixel_from_image(camera.interior.principal_point_mm);
    let (range, cosine) = plane.reference_range(&camera, &Isometry3::identity(), axis).unwrap();
    assert_relative_eq!(range, 2.5, epsilon = 1e-12);
    assert_relative_eq!(cosine, 1.0, epsilon = 1e-12);
    for distance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(Plane::facing_camera(distance).is_err());
    }
    assert!(Plane::new(&Vector3::zeros(), &Point3::origin()).is_err());
    assert!(Plane::new(&Vector3::x(), &Point3::new(f64::NAN, 0.0, 0.0)).is_err());
    let behind = Plane::new(&Vector3::z(), &Point3::new(0.0, 0.0, 1.0)).unwrap();
    let answer = behind.reference_range(&camera, &Isometry3::identity(), [3.0, 4.0]);
    assert!(matches!(answer, Err(primitives::Error::PlaneNotSeen { .. })));
}

#[test]
fn pixels_are_chosen_by_flag_window_step_and_incidence() {
    let camera = camera();
    let (pose, plane) = (Isometry3::identity(), Plane::facing_camera(2.0).unwrap());
    let mut frame = true_frame(&camera, &pose, &plane);
    frame.flags[(5, 5)] = Flags::MIXED_PIXEL;
    frame.flags[(6, 6)] = Flags::OUTSIDE_SPAN;
    frame.range[(7, 7)] = f32::NAN;
    frame.sigma[(8, 8)] = f32::NAN;
    let count = |options: DifferenceOptions| {
        let differences = differences_to_plane(&frame, &camera, &pose, &plane, &options).unwrap();
        assert!(differences.iter().all(|d| (d.observed_range_m - d.reference_range_m).abs() < 1e-6));
        differences.len()
    };
    let default = DifferenceOptions::default();
    assert_eq!(count(default), 44 * 36 - 2);
    assert_eq!(count(DifferenceOptions { step: 2, ..default }), 22 * 18);
    assert_eq!(count(DifferenceOptions { window: Some([[10, 19], [30, 99]]), ..default }), 10 * 6);
    assert_eq!(count(DifferenceOptions { window: Some([[50, 60], [0, 1]]), ..default }), 0);
    assert!(count(DifferenceOptions { largest_incidence_rad: 0.2, ..default }) < 44 * 36 / 2);
    let all = differences_to_plane(&frame, &camera, &pose, &plane, &default).unwrap();
    assert_eq!(all.iter().filter(|d| (d.sigma_m - default.unknown_sigma_m).abs() < 1e-12).count(), 1);
    let [x, y] = camera.format.image_from_pixel([0.0, 0.0]);
    assert_relative_eq!(all[0].x_mm, x - 0.12, epsilon = 1e-12);
    assert_relative_eq!(all[0].y_mm, y + 0.2, epsilon = 1e-12);
    for bad in [
        DifferenceOptions { step: 0, ..default },
        DifferenceOptions { unknown_sigma_m: f64::NAN, ..default },
        DifferenceOptions { largest_incidence_rad: -0.1, ..default },
    ] {
        let answer = differences_to_plane(&frame, &camera, &pose, &plane, &bad);
        assert!(matches!(answer, Err(primitives::Error::OutOfDomain { .. })));
    }
    frame.range = Raster::filled(3, 3, 1.0);
    assert!(differences_to_plane(&frame, &camera, &pose, &plane, &default).is_err());
}

#[test]
fn frames_of_a_wall_calibrate_a_camera_that_then_shows_it_flat() {
    let camera = camera();
    let principal_point = camera.interior.principal_point_mm;
    let terms = RangeTerms { d0: -0.02, periodic: [0.0, 0.005, -0.004, 0.0, 0.01, 0.006], e1: 1e-3, e2: 2e-3 };
    let truth = RangeErrorModel { terms, ..RangeErrorModel::error_free(5.0) };
    let plane = Plane::new(&Vector3::new(0.1, 0.05, 1.0), &Point3::new(0.0, 0.0, -5.5)).unwrap();
    let mut random = Pcg64::seed_from_u64(11);
    let noise = Normal::new(0.0, 0.004).unwrap();
    let mut differences = Vec::new();
    let mut frames = Vec::new();
    for station in 0..12 {
        let pose = Isometry3::new(Vector3::new(0.0, 0.1, -0.4 * f64::from(station)), Vector3::new(0.05, -0.1, 0.02));
        let mut frame = true_frame(&camera, &pose, &plane);
        distort_frame(&mut frame, &truth, &camera.format, principal_point, None).unwrap();
        for range in frame.range.as_mut_slice() {
            *range += noise.sample(&mut random) as f32;
        }
        let options = DifferenceOptions { step: 2, ..DifferenceOptions::default() };
        differences.extend(differences_to_plane(&frame, &camera, &pose, &plane, &options).unwrap());
        frames.push((frame, pose));
    }
    let calibration = estimate_range_terms(&differences, 5.0, &RangeTermOptions::default()).unwrap();
    for (frame, pose) in &mut frames {
        correct_frame(frame, calibration.model(), &camera.format, principal_point, None).unwrap();
        let rest = differences_to_plane(frame, &camera, pose, &plane, &DifferenceOptions::default()).unwrap();
        let (count, sum) = (rest.len() as f64, rest.iter().map(|d| d.observed_range_m - d.reference_range_m));
        let mean = sum.sum::<f64>() / count;
        // Noise of 4 mm averaged over a frame of 1584 pixels is 0.1 mm, the model is known to about as much; four times that.
        assert!(mean.abs() < 6e-4, "{mean}");
    }
}
