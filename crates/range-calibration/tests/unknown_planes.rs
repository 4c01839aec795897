//! Range terms from planes that are not known, alone and with poses.

use crate::support::unknown_walls::*;

use camera_model::Camera;
use error_models::RangeTerms;
use nalgebra::{Isometry3, Matrix6};
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;
use range_calibration::{Error, HyperbolaUse, Plane, PlaneCalibrationOptions, PlaneCapture, Scale, calibrate_planes};
use range_image::{Flags, ImageFormat, RangeFrame, Raster};

#[test]
fn without_noise_a_common_unknown_plane_gives_the_terms_back() {
    let camera = camera(4.0);
    let poses = poses(12);
    let frames = frames(&camera, &poses, 0.0, 1);
    let calibration =
        calibrate_planes(&captures(&frames, |i| Some(poses[i]), None), &[None], &camera, INTERVAL, &options(2))
            .unwrap();
    for (found, expected) in calibration.model().parameter_values().iter().zip(truth().parameter_values()) {
        // Single-precision ranges of up to 9 m are off by 3e-7 m; d0 shares its effect with the plane, which inflates
        // the mean of thousands of them.
        assert!((found - expected).abs() < 2e-6, "{found} {expected}");
    }
    let plane = calibration.planes()[0].plane;
    assert!((plane.normal() - wall().normal()).norm() < 1e-6 || (plane.normal() + wall().normal()).norm() < 1e-6);
    assert!((plane.distance_m().abs() - wall().distance_m().abs()).abs() < 1e-5);
}

#[test]
fn without_noise_each_station_may_have_a_plane_of_its_own() {
    let camera = camera(4.0);
    let poses = poses(12);
    let frames = frames(&camera, &poses, 0.0, 1);
    let mut options = PlaneCalibrationOptions { rejection: None, ..options(1) };
    // A plane of its own at each station takes most of what e1 and e2 do to it.
    options.terms = options.terms.hold("e1", 1e-3).unwrap().hold("e2", 2e-3).unwrap();
    let calibration = calibrate_planes(&captures(&frames, |_| None, None), &[], &camera, INTERVAL, &options).unwrap();
    for (found, expected) in calibration.model().parameter_values().iter().zip(truth().parameter_values()) {
        // As above, with weaker ties.
        assert!((found - expected).abs() < 1e-5, "{found} {expected}");
    }
    assert_eq!(calibration.planes().len(), 12);
    for (index, (adjusted, pose)) in calibration.planes().iter().zip(&poses).enumerate() {
        let distance = (wall().distance_m() - wall().normal().dot(&pose.translation.vector)).abs();
        let normal = pose.rotation.inverse() * wall().normal();
        assert_eq!(adjusted.name, format!("plane of S{index}"));
        assert!((adjusted.plane.distance_m().abs() - distance).abs() < 3e-5, "{adjusted:?} {distance}");
        assert!(adjusted.plane.normal().dot(&normal).abs() > 1.0 - 1e-9);
    }
    let first = &calibration.captures()[0];
    assert_eq!((first.used, first.rejected, first.world_from_camera), (44 * 36, 0, None));
}

#[test]
fn deviations_are_those_of_the_scatter() {
    // Chi squared of 16 surveys with 9 unknowns over their number scatters by sqrt(2 / 144) = 0.12; leaving out beyond
    // four deviations and the noise in the argument of the correction (at most 0.05) are much less. 200 surveys are in
    // `examples/range_terms_monte_carlo.rs`.
    let weighted = mean_over_surveys(16, with_weighted_poses);
    assert!((weighted - 1.0).abs() < 0.36, "{weighted}");
    let own_planes = mean_over_surveys(16, with_planes_of_their_own);
    // Seven unknowns: sqrt(2 / 112) = 0.13.
    assert!((own_planes - 1.0).abs() < 0.4, "{own_planes}");
    let calibration = with_weighted_poses(7);
    assert!((calibration.sigma0() - 1.0).abs() < 0.05, "{}", calibration.sigma0());
    let (prior, posterior) =
        (calibration.covariance(Scale::Prior).unwrap(), calibration.covariance(Scale::Posterior).unwrap());
    assert!((posterior[(0, 0)] / prior[(0, 0)] - calibration.sigma0().powi(2)).abs() < 1e-12);
}

#[test]
fn frontal_captures_with_a_narrow_field_do_not_tell_d0_from_the_distance() {
    let camera = camera(30.0);
    let poses: Vec<_> = (0..10).map(|i| Isometry3::translation(0.0, 0.0, -0.4 * f64::from(i))).collect();
    let frames = frames(&camera, &poses, SIGMA_M, 2);
    let refused =
        |pose: &dyn Fn(usize) -> Option<Isometry3<f64>>, planes: &[Option<Plane>], given: &PlaneCalibrationOptions| {
            match calibrate_planes(&captures(&frames, pose, None), planes, &camera, INTERVAL, given) {
                Err(Error::PlanesNotDetermined { combination, inflation }) => (combination, inflation),
                other => panic!("{other:?}"),
            }
        };
    let mut offset_alone = options(2);
    for name in ["d2", "d3", "d4", "d5", "d6", "d7", "e1", "e2"] {
        offset_alone.terms = offset_alone.terms.hold(name, 0.0).unwrap();
    }
    let (combination, inflation) = refused(&|i| Some(poses[i]), &[None], &offset_alone);
    assert!(combination.contains("d0") && combination.contains("plane 0 distance"), "{combination}");
    assert!(inflation > 100.0, "{inflation}");
    let (combination, _) = refused(&|_| None, &[], &options(2));
    assert!(combination.contains("plane of S"), "{combination}");
    // A plane that is known, or one distance of it, is the cure.
    let known = captures(&frames, |i| Some(poses[i]), None);
    assert!(calibrate_planes(&known, &[Some(wall())], &camera, INTERVAL, &options(2)).is_ok());
}

#[test]
fn things_in_front_of_the_wall_are_left_out() {
    let camera = camera(8.0);
    let poses = poses(10);
    let mut frames = frames(&camera, &poses, SIGMA_M, 3);
    let mut random = Pcg64::seed_from_u64(77);
    let mut spoilt = 0;
    for frame in &mut frames {
        // A box in front, with mixed pixels along its edge, and single pixels anywhere.
        for (col, row) in (5..18).flat_map(|col| (10..30).map(move |row| (col, row))) {
            frame.range[(col, row)] -= if col == 17 { 0.3 * random.random::<f32>() } else { 0.3 };
            spoilt += 1;
        }
        for _ in 0..60 {
            frame.range[(20 + random.random_range(0..24), random.random_range(0..36))] += 0.2 + random.random::<f32>();
            spoilt += 1;
        }
    }
    let given = captures(&frames, |i| Some(poses[i]), None);
    let robust = calibrate_planes(&given, &[Some(wall())], &camera, INTERVAL, &options(1)).unwrap();
    let rejected: usize = robust.captures().iter().map(|capture| capture.rejected).sum();
    // Some single pixels were hit twice, some mixed ones lie within four deviations; of the 15,840 others the normal
    // distribution has one beyond.
    assert!(rejected > spoilt * 9 / 10 && rejected < spoilt + 20, "{rejected} {spoilt}");
    // What is left of the mixed pixels pulls a little: twice the normalised error of clean surveys is seldom exceeded.
    assert!(normalised_error(&robust) < 2.5, "{}", normalised_error(&robust));
    let plain = PlaneCalibrationOptions { rejection: None, ..options(1) };
    let spoiled = calibrate_planes(&given, &[Some(wall())], &camera, INTERVAL, &plain).unwrap();
    assert!(normalised_error(&spoiled) > 100.0 && spoiled.sigma0() > 5.0);
}

/// Captures of more pixels than are chosen by, a box before the wall, flagged or not.
fn frames_with_a_box(camera: &Camera, poses: &[Isometry3<f64>], flags: Flags) -> Vec<RangeFrame> {
    let mut frames = frames(camera, poses, SIGMA_M, 8);
    for frame in &mut frames {
        for (col, row) in (20..70).flat_map(|col| (80..140).map(move |row| (col, row))) {
            frame.range[(col, row)] -= 0.3;
            frame.flags[(col, row)] = flags;
        }
    }
    frames
}

#[test]
fn large_captures_chosen_by_few_pixels_give_what_all_good_pixels_give() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let camera = Camera { format, ..camera(4.0) };
    let poses = poses(8);
    let calibrate = |flags: Flags, rejection: Option<f64>| {
        let frames = frames_with_a_box(&camera, &poses, flags);
        let given = captures(&frames, |i| Some(poses[i]), None);
        let options = PlaneCalibrationOptions { rejection, ..options(1) };
        calibrate_planes(&given, &[None], &camera, INTERVAL, &options).unwrap()
    };
    let robust = calibrate(Flags::empty(), Some(4.0));
    let flagged = calibrate(Flags::MIXED_PIXEL, None);
    assert!(robust.observations() > 150_000 && robust.observations() <= flagged.observations());
    let (found, expected) = (robust.parameters(Scale::Prior).unwrap(), flagged.parameters(Scale::Prior).unwrap());
    for (found, expected) in found.iter().zip(&expected) {
        // Of 180,000 good pixels the normal distribution has a dozen beyond four deviations; without them a parameter
        // moves by about 4 sqrt(12 / 180,000) = 0.03 of its deviation.
        let miss = (found.value - expected.value).abs() / expected.sigma;
        assert!(miss < 0.12, "{} {miss}", found.name);
        assert!((found.sigma / expected.sigma - 1.0).abs() < 1e-3);
    }
}

#[test]
fn the_number_of_threads_changes_no_bit() {
    let format = ImageFormat::new(176, 144, [0.04, 0.04]).unwrap();
    let camera = Camera { format, ..camera(4.0) };
    let poses = poses(6);
    let frames = frames_with_a_box(&camera, &poses, Flags::empty());
    let given = captures(&frames, |i| Some(poses[i]), None);
    let calibrate = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let calibration = pool.install(|| calibrate_planes(&given, &[None], &camera, INTERVAL, &options(1)).unwrap());
        let bits = |value: &f64| value.to_bits();
        let values: Vec<u64> = calibration.model().parameter_values().iter().map(bits).collect();
        let covariance: Vec<u64> = calibration.covariance(Scale::Posterior).unwrap().iter().map(bits).collect();
        (values, covariance, calibration.captures().to_vec())
    };
    assert_eq!(calibrate(1), calibrate(5));
}

#[test]
fn a_spline_is_estimated_as_well_as_sines() {
    let camera = camera(8.0);
    let poses = poses(16);
    let frames = frames(&camera, &poses, SIGMA_M, 4);
    let mut options = options(2);
    options.terms = options.terms.with_spline(16);
    let given = captures(&frames, |i| Some(poses[i]), None);
    let calibration = calibrate_planes(&given, &[Some(wall())], &camera, INTERVAL, &options).unwrap();
    assert_eq!(calibration.estimated_names().len(), 1 + 15 + 2);
    let mut largest = 0.0_f64;
    for step in 0..50 {
        let range = 1.2 + 0.1 * f64::from(step);
        let found = calibration.model().correction(range, 0.0, 0.0, 1.0).total_m();
        largest = largest.max((found - truth().correction(range, 0.0, 0.0, 1.0).total_m()).abs());
    }
    // Sixteen knots follow a wave of four intervals to 1 % of its 12 mm; the noise leaves 4 mm / sqrt(6336 / 18).
    assert!(largest < 1.2e-3, "{largest}");
}

#[test]
fn bad_input_is_refused_by_name() {
    let camera = camera(8.0);
    let poses = poses(4);
    let mut frames = frames(&camera, &poses, SIGMA_M, 5);
    let given = captures(&frames, |i| Some(poses[i]), None);
    let calibrate = |captures: &[PlaneCapture<'_>], options: &PlaneCalibrationOptions| {
        calibrate_planes(captures, &[Some(wall())], &camera, INTERVAL, options).map(|_| ()).unwrap_err()
    };
    assert!(matches!(calibrate(&[], &options(1)), Error::TooFewDifferences { differences: 0, .. }));
    let mut elsewhere = given.clone();
    elsewhere[2].plane = 1;
    let answer = calibrate(&elsewhere, &options(1));
    assert!(matches!(answer, Error::UnknownPlane { plane: 1, planes: 1, .. }), "{answer}");
    let mut with_hyperbola = options(1);
    with_hyperbola.terms.hyperbola = HyperbolaUse::Estimate;
    assert!(matches!(calibrate(&given, &with_hyperbola), Error::HyperbolaNotHeld));
    let mut all_held = options(1);
    all_held.terms = all_held.terms.hold_terms(&RangeTerms::default());
    assert!(matches!(calibrate(&given, &all_held), Error::NothingToEstimate));
    for rejection in [f64::NAN, 0.0, 1.0, f64::INFINITY] {
        let bad = PlaneCalibrationOptions { rejection: Some(rejection), ..options(1) };
        assert!(matches!(calibrate(&given, &bad), Error::OutOfDomain { name: "rejection", .. }));
    }
    let mut bad_pose = given.clone();
    bad_pose[0].covariance = Some(-Matrix6::identity());
    assert!(matches!(calibrate(&bad_pose, &options(1)), Error::Adjust(_)));
    bad_pose[0].covariance = None;
    bad_pose[0].world_from_camera = Some(Isometry3::translation(f64::NAN, 0.0, 0.0));
    let _ = calibrate(&bad_pose, &options(1));
    assert!(calibrate_planes(&given, &[Some(wall())], &camera, -1.0, &options(1)).is_err());
    frames[1].range = Raster::filled(44, 36, f32::NAN);
    let given = captures(&frames, |i| Some(poses[i]), None);
    assert!(matches!(calibrate(&given, &options(1)), Error::NoPlane { station } if station == "S1"));
    frames[1].range = Raster::filled(3, 3, 1.0);
    let given = captures(&frames, |_| None, None);
    assert!(matches!(calibrate(&given, &options(1)), Error::Image(_)));
}
