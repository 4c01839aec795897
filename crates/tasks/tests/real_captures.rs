//! Real captures of three cameras at three input levels, where they lie beside the project.

use pipeline::{Plan, Silent, StationPose, process};
use tasks::{RegisterMethod, RegisterRequest, register};

use crate::common::{fixtures, has_capture, run};

#[test]
fn raw_samples_of_an_mlx75027_agree_with_the_cameras_own_ranges() {
    if !has_capture("mlx75027_scene") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let summary = run("mlx75027_scene", &folder.path().join("out")).unwrap();
    println!("{summary}");
    let reference = summary.reference.unwrap();
    // The camera applies corrections of its own, with a standard deviation of about 11 mm.
    assert!(reference.robust_standard_deviation_m < 0.015, "{}", reference.robust_standard_deviation_m);
    assert!(reference.pixels > 200_000, "{} of 246 400 pixels", reference.pixels);
    assert!(summary.ruled_out.is_empty(), "nothing is ruled out for raw samples");
}

#[test]
fn the_step_of_an_sr4000_is_found_by_registration() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let summary = run("sr4000_steps", &folder.path().join("out")).unwrap();
    println!("{summary}");
    let pair = &summary.registration.as_ref().unwrap().pairs[0];
    // A plane fitted to the box gives 0.314 m; 15 mm is what the camera's systematic errors leave.
    assert!((pair.distance_m - 0.314).abs() < 0.015, "{}", pair.distance_m);
    assert!(summary.ruled_out.contains_key("Demodulate") && summary.ruled_out.contains_key("Unwrap"));
}

#[test]
fn a_depth_frame_of_an_azure_kinect_becomes_a_flagged_cloud() {
    if !has_capture("azure_kinect_mug") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let summary = run("azure_kinect_mug", &folder.path().join("out")).unwrap();
    println!("{summary}");
    assert!(summary.points > 100_000, "{} points", summary.points);
    assert!(summary.flags_fraction["mixed_pixel"] > 0.0, "the mug's outline");
    assert_eq!(summary.level, "depth");
}

/// Where the second station of the SR4000 stands: planes through floor, side wall and back wall, metre.
const SECOND: [f64; 3] = [-0.009, 0.045, -0.309];

/// Position of the second station, its standard deviations, and the tolerance that the camera's own errors ask for.
fn assert_second(name: &str, pose: &StationPose) {
    let (at, sigma) = (pose.world_from_camera.translation.vector, pose.sigmas().unwrap().0);
    println!("{name}: {:.4?} m, sigma {:.1?} mm", at.as_slice(), sigma.map(|s| 1e3 * s));
    for axis in 0..3 {
        let off = (at[axis] - SECOND[axis]).abs();
        // Cyclic errors and light by more than one way leave a centimetre between surfaces.
        assert!(off < 0.01 + 3.0 * sigma[axis], "{name}: {at} {sigma:?}");
        // Floor and two walls determine it: decimetres would be as good as nothing. How well is stated between 16 and 41 mm
        // along x, from how few pixels ever are flagged (thresholds of mixed pixels from three to eight deviations).
        assert!(sigma[axis] < 0.05, "{name}: {sigma:?}");
    }
}

#[test]
fn stations_of_an_sr4000_are_adjusted_from_every_start() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let survey = fixtures().join("surveys/sr4000_steps");
    let calibration = survey.clone();
    for (name, stages) in [
        ("neighbour", "Flag(low_amplitude: 100), Register(start: neighbour), Adjust()"),
        (
            "mixed pixels dropped",
            "Flag(low_amplitude: 100, mixed_pixels: (treatment: drop)), Register(start: neighbour), Adjust()",
        ),
        ("wider start", "Flag(low_amplitude: 100), Register(start: neighbour), Adjust(maximum_distance_m: 0.3)"),
    ] {
        let text = format!("(name: \"x\", stages: [Average(), CorrectImagePoint(), PointCloud(), {stages}])");
        let plan = Plan::from_ron(&text, "x.ron".as_ref()).unwrap();
        let outcome = process(&plan, &survey, Some(&calibration), &Silent).unwrap();
        assert_second(name, outcome.poses[1].as_ref().unwrap());
    }
}

#[test]
fn stations_of_an_sr4000_come_together_at_once_without_start_poses() {
    if !has_capture("sr4000_steps") {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let request = RegisterRequest {
        inputs: vec![fixtures().join("surveys/sr4000_steps")],
        guess: None,
        calibration: None,
        method: RegisterMethod::Multi,
        out: folder.path().join("out"),
    };
    let summary = register(&request, &Silent).unwrap();
    println!("{summary}");
    let at = summary.stations[1].position_m;
    for axis in 0..3 {
        let off = (at[axis] - SECOND[axis]).abs();
        assert!(off < 0.01 + 3.0 * summary.stations[1].position_sigma_m.unwrap(), "{at:?}");
    }
}
