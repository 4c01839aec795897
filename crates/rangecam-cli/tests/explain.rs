//! The commands `explain` and `diff` as a shell sees them.

use std::path::Path;
use std::process::{Command, Output};

fn rangecam(arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_rangecam")).args(arguments).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

/// A wall as a survey of one small frame per station.
fn survey(folder: &Path) -> String {
    let scene = "(scene: (objects: [(name: \"wall\", shape: Rectangle(corner_m: (-6.0, -5.0, 0.0), edge_u_m: (12.0, 0.0, 0.0), \
                 edge_v_m: (0.0, 10.0, 0.0)), albedo: 0.8)]), \
                 camera: (geometry: (format: (width: 16, height: 12, pixel_pitch_mm: (0.4, 0.4)), \
                 interior: (principal_point_mm: (0.0, 0.0), principal_distance_mm: 8.0)), modulation_hz: [30.0e6], phase_steps: 4), \
                 illumination: (source_power: 8.0e6, modulation_contrast: 0.5, ambient_power: 5.0e4, vignetting_exponent: 1.0), \
                 exposure: (frames_per_station: 2, integration_time_s: 0.002, frame_interval_s: 0.1), \
                 stations: [(name: \"A\", position_m: (0.0, 0.0, 2.0), attitude: Euler(omega_deg: 0.0, phi_deg: 0.0, kappa_deg: 0.0))], \
                 errors: (range: [(ambiguity_interval_m: 4.996540966666667, terms: (d0: 0.010, \
                 periodic: (0.0, 0.0, 0.0, 0.0, 0.008, -0.005), e1: 1.0e-3, e2: 0.0))], \
                 noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0)))";
    std::fs::write(folder.join("wall.ron"), scene).unwrap();
    let path = |name: &str| folder.join(name).to_str().unwrap().to_owned();
    let output = rangecam(&["simulate", &path("wall.ron"), "--out", &path("survey")]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    path("survey")
}

#[test]
fn a_pixel_in_words_and_as_json() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path());
    let words = rangecam(&["explain", &survey, "--frame", "1", "--pixel", "8,6"]);
    let said = text(&words.stdout);
    assert!(words.status.success(), "{}", text(&words.stderr));
    for word in ["pixel 8,6", "moved ", "offset d0", "-10.00 mm", "periodic, wavelength U/4", "final", "\nFlags\n"] {
        assert!(said.contains(word), "{word} in {said}");
    }
    assert!(!said.contains('\u{1b}'), "plain when piped");
    let json = rangecam(&["--json", "explain", &survey, "--frame", "1", "--pixel", "8,6"]);
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    let sum: f64 = value["stages"].as_array().unwrap().iter().filter_map(|line| line["change_m"].as_f64()).sum();
    let moved = value["range_m"].as_f64().unwrap() - value["raw_range_m"].as_f64().unwrap();
    assert!((sum - moved).abs() < 1e-9, "{sum} {moved}");
    for (arguments, message) in [
        (["--frame", "9", "--pixel", "0,0"], "there is no frame `9`; the survey has 0: "),
        (["--frame", "0", "--pixel", "16,0"], "pixel 16,0 is outside the image: columns run from 0 to 15"),
    ] {
        let output = rangecam(&[&["explain", &survey], arguments.as_slice()].concat());
        assert_eq!(output.status.code(), Some(2));
        assert!(text(&output.stderr).contains(message), "{}", text(&output.stderr));
    }
    let output = rangecam(&["explain", &survey, "--frame", "0", "--pixel", "5"]);
    assert_eq!(output.status.code(), Some(2));
    assert!(text(&output.stderr).contains("column and row"), "{}", text(&output.stderr));
}

#[test]
fn the_exit_code_of_diff_says_whether_calibrations_differ() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path());
    let first = format!("{survey}/calibration.ron");
    let changed = folder.path().join("changed.ron");
    let original = std::fs::read_to_string(&first).unwrap();
    std::fs::write(&changed, original.replacen("value: 0.01,", "value: 0.02,", 1)).unwrap();
    let same = rangecam(&["diff", &first, &survey]);
    assert_eq!(same.status.code(), Some(0), "{}", text(&same.stderr));
    assert!(text(&same.stdout).contains("no significant difference"), "{}", text(&same.stdout));
    let other = rangecam(&["diff", &first, changed.to_str().unwrap()]);
    assert_eq!(other.status.code(), Some(1), "{}", text(&other.stdout));
    assert!(text(&other.stdout).contains("+10.00 mm"), "{}", text(&other.stdout));
    let missing = rangecam(&["diff", &first, "nowhere.ron"]);
    assert_eq!(missing.status.code(), Some(2));
    assert!(text(&missing.stderr).contains("nowhere.ron"), "{}", text(&missing.stderr));
}
