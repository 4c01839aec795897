//! Outputs where the disk fails, where the data refuse, and where a name leads astray.

use std::fs;
use std::path::{Path, PathBuf};

use atomic_output::{OutputFolder, fault};
use calibration_tasks::{CalibrateRequest, calibrate};
use pipeline::{Error, Failure, Judged, Plan, RunRequest, Silent, Verdict, run};
use tasks::{NoiseFitOptions, NoiseRequest, estimate_noise};

use crate::calibration_setup::{request as calibration_request, terms};
use crate::common::{fixtures, simulated, simulated_with};

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<_> =
        fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Every file of a folder with its bytes.
fn bytes(folder: &Path) -> Vec<(String, Vec<u8>)> {
    names(folder).into_iter().map(|name| (name.clone(), fs::read(folder.join(name)).unwrap_or_default())).collect()
}

/// Does `work`, which writes into `out`, with each change of the disk failing once.
fn fail_everywhere(out: &Path, work: impl Fn() -> Result<(), Error>) {
    work().unwrap();
    let (older, beside) = (bytes(out), names(out.parent().unwrap()));
    let mut failing = 0;
    loop {
        let (result, changes) = fault::at(Some(failing), &work);
        let Err(error) = result else {
            assert_eq!(changes, failing, "all changes failed before");
            assert!(changes > 20, "{changes} are too few to be all");
            println!("{changes} changes of the disk");
            return;
        };
        assert_eq!(error.failure(), Failure::Machine, "change {failing}: {error}");
        assert!(bytes(out) == older, "change {failing}: the older output is whole");
        assert_eq!(names(out.parent().unwrap()), beside, "change {failing}: nothing is left");
        failing += 1;
    }
}

const STAGES: &str = "Demodulate(), Average(), Unwrap(), CorrectRange(), PointCloud(), Flag()";

fn run_request(root: &Path, stages: &str) -> RunRequest {
    RunRequest {
        plan: Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), Path::new("x.ron")).unwrap(),
        plan_path: PathBuf::from("x.ron"),
        survey: None,
        calibration: None,
        out: root.join("results/out"),
    }
}

/// A room seen by a camera of few pixels.
fn small_room(root: &Path) -> PathBuf {
    simulated_with("room_small", ["width: 132, height: 108", "width: 12, height: 9"], root)
}

#[test]
fn a_run_survives_every_failure_of_the_disk() {
    let root = tempfile::tempdir().unwrap();
    let survey = small_room(root.path());
    let request = RunRequest { survey: Some(survey), ..run_request(root.path(), STAGES) };
    fail_everywhere(&request.out, || run(&request, &Silent).map(drop));
}

#[test]
fn a_calibration_survives_every_failure_of_the_disk() {
    let root = tempfile::tempdir().unwrap();
    let mut request = calibration_request(&few_stations(root.path()), &root.path().join("results/out"));
    request.options.terms = terms("d0");
    fail_everywhere(&request.out, || calibrate(&request, &Silent).map(drop));
}

/// Four stations of the field of targets, which are calibrated in a moment.
fn few_stations(root: &Path) -> PathBuf {
    let (from, to) = (fixtures().join("surveys/target_field"), root.join("survey"));
    fs::create_dir(&to).unwrap();
    for name in ["survey.ron", "targets.csv", "stations.csv", "distances.csv", "observations.csv"] {
        let text = fs::read_to_string(from.join(name)).unwrap();
        let of_few = |line: &&str| ["station", "F05", "F06", "C05", "C06"].iter().any(|name| line.starts_with(name));
        let lines: Vec<&str> = match name {
            "observations.csv" | "stations.csv" => text.lines().filter(of_few).collect(),
            _ => text.lines().filter(|line| !line.trim_start().starts_with("truth:")).collect(),
        };
        fs::write(to.join(name), lines.join("\n") + "\n").unwrap();
    }
    to
}

/// The refusal of a calibration is written as carefully as its results.
#[test]
fn a_refusal_survives_every_failure_of_the_disk() {
    let root = tempfile::tempdir().unwrap();
    let request = refusing(root.path());
    fs::create_dir(root.path().join("results")).unwrap();
    let mut failing = 0;
    loop {
        let (result, changes) = fault::at(Some(failing), || calibrate(&request, &Silent));
        let error = result.unwrap_err();
        if error.failure() == Failure::Refused {
            assert!(changes == failing && request.out.join("summary.json").is_file());
            break;
        }
        assert_eq!(error.failure(), Failure::Machine, "{error}");
        assert_eq!(names(&root.path().join("results")), [""; 0]);
        failing += 1;
    }
}

/// A calibration of terms that the network does not tell apart.
fn refusing(root: &Path) -> CalibrateRequest {
    let mut request = calibration_request(&fixtures().join("surveys/target_field"), &root.join("results/out"));
    request.options.terms = terms("xp yp c k1 k2 k3 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2");
    request.options.largest_inflation = 20.0;
    request
}

#[test]
fn a_refused_calibration_keeps_the_older_one() {
    let root = tempfile::tempdir().unwrap();
    let refusing = refusing(root.path());
    let mut good = refusing.clone();
    good.options.terms = terms("d0 d4 d5");
    // Alone in a new folder; refused once more, it is the newer refusal.
    for _ in 0..2 {
        let words = calibrate(&refusing, &Silent).unwrap_err().to_string();
        assert!(words.contains("summary.json") && !words.contains("older"), "{words}");
        assert_eq!(names(&refusing.out), [OutputFolder::MARKER, "summary.json"]);
    }
    calibrate(&good, &Silent).unwrap();
    let older = bytes(&good.out);
    for _ in 0..2 {
        let error = calibrate(&refusing, &Silent).unwrap_err();
        assert_eq!(error.failure(), Failure::Refused);
        let words = error.to_string();
        assert!(words.contains("refused.json") && words.contains("older result"), "{words}");
        let kept: Vec<_> = bytes(&good.out).into_iter().filter(|(name, _)| name != "refused.json").collect();
        let without_marker = |files: &[(String, Vec<u8>)]| {
            files.iter().filter(|(name, _)| name != OutputFolder::MARKER).cloned().collect::<Vec<_>>()
        };
        assert!(without_marker(&kept) == without_marker(&older), "every file of the older result stands");
        let refusal = fs::read_to_string(good.out.join("refused.json")).unwrap();
        let refusal: serde_json::Value = serde_json::from_str(&refusal).unwrap();
        assert_eq!(refusal["converged"], false);
    }
    calibrate(&good, &Silent).unwrap();
    assert!(!good.out.join("refused.json").exists(), "a later success removes it");
}

#[test]
fn refused_estimations_keep_the_older_ones() {
    let root = tempfile::tempdir().unwrap();
    let [many, one] = ["6", "1"].map(|frames| {
        let folder = root.path().join(frames);
        fs::create_dir(&folder).unwrap();
        simulated_with("repeats", ["frames_per_station: 6", &format!("frames_per_station: {frames}")], &folder)
    });
    let out = root.path().join("out");
    let request =
        |survey| NoiseRequest { survey, calibration: None, options: NoiseFitOptions::default(), out: out.clone() };
    estimate_noise(&request(many), &Silent).unwrap();
    let calibration = fs::read(out.join("calibration.ron")).unwrap();
    let words = estimate_noise(&request(one), &Silent).unwrap_err().to_string();
    assert!(words.contains("has 1 frames, 2 are needed") && words.contains("refused.json"), "{words}");
    assert!(fs::read(out.join("calibration.ron")).unwrap() == calibration);
}

/// Stations that no registration brings together: each cloud in its own frame, and nothing that pretends otherwise.
#[test]
fn what_stands_without_registration_is_written() {
    let root = tempfile::tempdir().unwrap();
    let survey = simulated("room_small", 5, root.path());
    // Stations that are said to stand tens of metres apart overlap nowhere.
    let table = fs::read_to_string(survey.join("stations.csv")).unwrap();
    let moved = table.lines().enumerate().map(|(row, line)| {
        let mut fields: Vec<String> = line.split(',').map(str::to_owned).collect();
        if let Ok(x) = fields[1].parse::<f64>() {
            fields[1] = (x + 50.0 * row as f64).to_string();
        }
        fields.join(",") + "\n"
    });
    fs::write(survey.join("stations.csv"), moved.collect::<String>()).unwrap();
    let stages = "Demodulate(low_amplitude: 20), Average(), Deconvolve(), Unwrap(maximum_range_m: 12), CorrectRange(), \
                  CorrectImagePoint(), PointCloud(), Flag(), Register(), Adjust()";
    let request = RunRequest { survey: Some(survey), ..run_request(root.path(), stages) };
    let summary = run(&request, &Silent).unwrap();
    println!("{summary}");
    assert_eq!(summary.verdict(), Verdict::Partial);
    let refusal = summary.refusal.as_ref().unwrap();
    assert_eq!(refusal.stage, "Register");
    assert!(summary.doubts[0].words.contains(&refusal.reason));
    let found = names(&request.out);
    assert_eq!(found, [OutputFolder::MARKER, "clouds", "report.html", "summary.json"]);
    assert_eq!(names(&request.out.join("clouds")).len(), 8);
    let mut points = 0;
    for (index, own) in summary.own_clouds.iter().enumerate() {
        let cloud = range_io::ply::read_cloud(request.out.join(&own.file)).unwrap();
        // The camera looks along -z from the origin of its own frame.
        assert!(cloud.points.iter().all(|point| point[2] < 0.0), "{}", own.file);
        assert!(cloud.frame.unwrap().iter().all(|frame| *frame as usize == index));
        points += cloud.flags.unwrap().iter().filter(|flags| **flags == 0).count();
    }
    assert_eq!(points, summary.points);
    assert!(summary.truth.as_ref().unwrap().position_error_max_m.is_none(), "no pose, no error of one");
    let report = fs::read_to_string(request.out.join("report.html")).unwrap();
    assert!(report.find("Before you use it").unwrap() < report.find("What each stage did").unwrap());
    let json: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(request.out.join("summary.json")).unwrap()).unwrap();
    assert_eq!((&json["refusal"]["stage"], &json["doubts"][0]["kind"]), (&"Register".into(), &"refused".into()));
}

#[test]
fn pipelines_without_a_name_of_their_own_or_stages_are_refused() {
    for name in ["../../x/y", "/tmp/x", "a/b", "a\\\\b", "..", ".", "", "a\\nb", "a\\u{1b}[31m", "C:\\\\x"] {
        let text = format!("(name: \"{name}\", stages: [Average()])");
        let error = Plan::from_ron(&text, Path::new("p.ron")).unwrap_err();
        assert!(matches!(error, Error::Name { field: "name", .. }), "{name}: {error}");
        assert_eq!(error.failure(), Failure::Usage);
        let words = error.to_string();
        assert!(words.starts_with("p.ron: `name` is \"") && !words.contains(char::is_control), "{words}");
    }
    let nothing = run(&run_request(Path::new("nowhere"), ""), &Silent).unwrap_err();
    assert!(nothing.failure() == Failure::Usage && nothing.to_string().contains("`stages` is empty"), "{nothing}");
    for name in ["room", "room 2", "Büro, früh", "..a", "a..b", ".hidden"] {
        Plan::from_ron(&format!("(name: \"{name}\", stages: [Average()])"), Path::new("p.ron")).unwrap();
    }
}

/// The folders beside the output, in which a run simulates and calibrates, leave its inputs alone as well.
#[test]
fn folders_beside_the_output_spare_what_is_read() {
    let root = tempfile::tempdir().unwrap();
    let survey = small_room(root.path());
    let text = format!(
        "(name: \"x\", source: Simulate(scene: \"{}\", seed: 1), stages: [Demodulate()])",
        fixtures().join("scenes/room_small.ron").display()
    );
    let plan = Plan::from_ron(&text, Path::new("x.ron")).unwrap();
    let named = root.path().join("q-survey");
    fs::rename(survey, &named).unwrap();
    let request = RunRequest {
        plan,
        calibration: Some(named.join("calibration.ron")),
        out: root.path().join("q"),
        ..run_request(root.path(), "Average()")
    };
    let words = run(&request, &Silent).unwrap_err().to_string();
    assert!(words.contains("q-survey: cannot be the output folder: it contains"), "{words}");
    assert!(named.join("survey.ron").is_file());
}
