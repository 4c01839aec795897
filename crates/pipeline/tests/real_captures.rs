//! Real captures of three cameras at three input levels, where they lie beside the project.

use crate::common::{has_capture, run};

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
