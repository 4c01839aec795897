//! Whether what a run leaves of the errors is random, and what is said where nobody can know.

use std::path::{Path, PathBuf};

use pipeline::{Plan, RemainingErrors, RunRequest, Silent, Summary};

use crate::common::simulated_from;

/// A wall from seventy places.
const WALL: &str = "(
    scene: (objects: [(name: \"wall\", shape: Rectangle(corner_m: (-9.0, -7.0, 0.0), edge_u_m: (18.0, 0.0, 0.0),
        edge_v_m: (0.0, 14.0, 0.0)), albedo: 0.8)]),
    camera: (geometry: (format: (width: 32, height: 24, pixel_pitch_mm: (0.2, 0.2)),
        interior: (principal_point_mm: (0.0, 0.0), principal_distance_mm: 5.0)), modulation_hz: [30.0e6]),
    illumination: (source_power: 4.0e6, ambient_power: 5.0e4),
    exposure: (frames_per_station: 1, integration_time_s: 0.002, frame_interval_s: 30.0, power_on_s: 0.0),
    stations: [STATIONS],
    errors: (ERRORS, noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0)),
)";

const WAVES: &str = "range: [(ambiguity_interval_m: 4.996540966666667,
    terms: (d0: 0.010, periodic: (0.0, 0.0, 0.0, 0.0, 0.008, -0.005), e1: 1.5e-3, e2: 0.0))]";

/// Waves as long as the ambiguity interval, which even few bins of range show, and a tilt across the columns.
const LONG_WAVES: &str = "range: [(ambiguity_interval_m: 4.996540966666667,
    terms: (d0: 0.010, periodic: (0.012, -0.008, 0.0, 0.0, 0.0, 0.0), e1: 1.5e-3, e2: 0.0))]";

const DRIFT: &str = "warm_up: (transients: [(amplitude_m: -0.03, time_constant_s: 600.0)])";

fn survey(folder: &Path, errors: &str) -> PathBuf {
    let station = |index: u32| {
        // Near and far places take turns, so that range and time do not run together.
        let distance = 1.0 + 0.04 * f64::from(9 * index % 70);
        let [omega, phi] = [[-25, 8, 15, 25], [10, -20, -5, 15]].map(|tilts| tilts[index as usize % 4]);
        format!(
            "(name: \"S{index}\", position_m: (0.0, 0.0, {distance}), \
             attitude: Euler(omega_deg: {omega}.0, phi_deg: {phi}.0, kappa_deg: 0.0)),"
        )
    };
    let stations: String = (0..70).map(station).collect();
    let scene = folder.join("wall.ron");
    std::fs::write(&scene, WALL.replace("STATIONS", &stations).replace("ERRORS", errors)).unwrap();
    simulated_from(&scene, 3, folder)
}

fn run(survey: &Path, stages: &str, out: &Path) -> Summary {
    let plan_path = PathBuf::from("x.ron");
    let plan = Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), &plan_path).unwrap();
    let request =
        RunRequest { plan, plan_path, survey: Some(survey.to_owned()), calibration: None, out: out.to_owned() };
    pipeline::run(&request, &Silent).unwrap()
}

/// The same survey without its truth.
fn forget_the_truth(survey: &Path) {
    let file = survey.join("survey.ron");
    let mut read = range_io::survey::Survey::read(survey).unwrap();
    read.truth = None;
    read.write(&file).unwrap();
}

/// The survey with its first frame only.
fn one_of(survey: &Path) -> PathBuf {
    let mut read = range_io::survey::Survey::read(survey).unwrap();
    read.frames.truncate(1);
    read.write(survey.join("survey.ron")).unwrap();
    survey.to_owned()
}

fn trends(remaining: &RemainingErrors) -> Vec<&str> {
    remaining.variables.iter().filter(|test| test.verdict == "trend").map(|test| test.variable).collect()
}

const CORRECTED: &str = "Demodulate(), Unwrap(), CorrectRange(), CorrectImagePoint(), PointCloud()";

#[test]
fn corrected_ranges_are_random_and_uncorrected_ones_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), &format!("{WAVES}, {DRIFT}"));
    let out = folder.path().join("out");
    let corrected = run(&survey, CORRECTED, &out).remaining;
    println!("{corrected}");
    assert_eq!((corrected.basis, trends(&corrected)), ("truth", vec![]), "{corrected}");
    assert!(corrected.variables.iter().all(|test| test.p_value.is_some()), "all five are tested: {corrected:?}");
    let json = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["remaining"]["variables"][4]["variable"], "time (s)");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("Is what is left random?") && report.contains("no trend in range (m)"));

    let drifting = CORRECTED.replace("CorrectRange()", "CorrectRange(warm_up: leave)");
    let drifting = run(&survey, &drifting, &folder.path().join("drifting")).remaining;
    println!("{drifting}");
    assert!(trends(&drifting).contains(&"time (s)"), "{drifting}");
    assert!(drifting.verdict.contains("share errors"), "a drift is common to a frame: {drifting}");
}

#[test]
fn what_nobody_took_off_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), LONG_WAVES);
    let raw = run(&survey, &CORRECTED.replace("CorrectRange(), ", ""), &folder.path().join("raw")).remaining;
    println!("{raw}");
    assert!(["range (m)", "column (pixel)"].iter().all(|name| trends(&raw).contains(name)), "{raw}");
}

#[test]
fn without_truth_planes_tell_and_without_planes_nobody() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), WAVES);
    forget_the_truth(&survey);
    let corrected = run(&survey, CORRECTED, &folder.path().join("out")).remaining;
    println!("{corrected}");
    assert_eq!((corrected.basis, trends(&corrected)), ("planes", vec![]), "{corrected}");
    assert!(corrected.basis_words.contains("70 of 70 frames"), "{}", corrected.basis_words);
    let raw = run(&survey, &CORRECTED.replace("CorrectRange(), ", ""), &folder.path().join("raw")).remaining;
    println!("{raw}");
    assert!(trends(&raw).contains(&"range (m)"), "the waves show along tilted walls: {raw}");
    let still = run(&one_of(&survey), &CORRECTED.replace("CorrectRange(), ", ""), &folder.path().join("one")).remaining;
    println!("{still}");
    assert!(still.verdict.contains("share errors"), "what one frame shares is not called random: {still}");
    let wrapped = run(&survey, "Demodulate()", &folder.path().join("wrapped"));
    assert_eq!((wrapped.remaining.basis, wrapped.remaining.pixels), ("none", 0));
    let report = std::fs::read_to_string(folder.path().join("wrapped/report.html")).unwrap();
    assert!(report.contains("no residuals to test for trends"), "said in a sentence");
}
