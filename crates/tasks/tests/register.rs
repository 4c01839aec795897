//! Registration as a command: small surveys and clouds with known poses, and input that cannot be registered.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use nalgebra::{Isometry3, Point3, UnitQuaternion, Vector3};
use pipeline::{Failure, Plan, RunRequest, Silent, SimulateSource, run, simulate};
use range_io::clouds::{CloudFile, Precision};
use tasks::{RegisterMethod, RegisterRequest, RegisterSummary, register};

use crate::common;

fn request(inputs: &[PathBuf], method: RegisterMethod, out: &Path) -> RegisterRequest {
    RegisterRequest { inputs: inputs.to_vec(), guess: None, method, calibration: None, out: out.to_owned() }
}

/// The small room of the fixtures, simulated once for all tests.
fn small_room() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let source = SimulateSource {
            scene: common::fixtures().join("scenes/room_small.ron").display().to_string(),
            seed: 1,
            approximate_position_sigma_m: 0.05,
            approximate_attitude_sigma_deg: 2.0,
            gross_error_share: 0.0,
        };
        simulate(&source, Path::new(""), &folder.path().join("survey"), &Silent).unwrap();
        folder
    });
    folder.path()
}

#[test]
fn a_survey_is_registered_at_once_from_its_start_poses() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let summary = register(&request(&[small_room().join("survey")], RegisterMethod::Multi, &out), &Silent).unwrap();
    println!("{summary}");
    // The bars of the pipeline's own registration of this room.
    assert!(summary.position_error_max_m.unwrap() < 0.010, "position {:?}", summary.position_error_max_m);
    assert!(summary.attitude_error_max_deg.unwrap() < 0.1, "attitude {:?}", summary.attitude_error_max_deg);
    assert_eq!(summary.stations.len(), 8);
    assert!(summary.pairs.len() >= 8 && summary.redundancy.unwrap() > 1000, "{} pairs", summary.pairs.len());
    assert!(summary.stations[0].position_sigma_m.is_none(), "the first station is the datum");
    assert!(summary.stations[1..].iter().all(|s| s.position_sigma_m.unwrap() < 0.005), "{summary}");
    check_files(&out, &summary);
}

/// Frames of structured light have no amplitudes, and neighbours share their errors: pairs of frames place them, at once.
#[test]
fn frames_of_a_depth_camera_are_registered_as_such() {
    if !common::has_capture("sevenscenes_redkitchen_dense") {
        return;
    }
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/sevenscenes_redkitchen_dense");
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    std::fs::create_dir(&survey).unwrap();
    let names = (0..4).map(|k| format!("frame-{:06}.depth.png", 10 * k)).chain(["camera-intrinsics.txt".to_owned()]);
    for name in names {
        std::fs::copy(from.join(&name), survey.join(&name)).unwrap();
    }
    let out = folder.path().join("out");
    let summary = register(&request(&[survey], RegisterMethod::Multi, &out), &Silent).unwrap();
    println!("{summary}");
    assert_eq!(summary.stations.len(), 4);
    assert!(summary.start.contains("pairs of frames"), "{}", summary.start);
    // The camera moved by 45 mm, known to a centimetre.
    let [.., last] = &summary.stations[..] else { panic!("four stations") };
    let way = Vector3::from(last.position_m).norm();
    assert!((way - 0.045).abs() < 0.01 && last.position_sigma_m.unwrap() < 0.02, "{way} {last:?}");
    // A pipeline goes the same way, but without the flags that the command sets first.
    let plan = r#"(name: "x", stages: [PointCloud(), Register(), Adjust()])"#;
    let request = RunRequest {
        plan: Plan::from_ron(plan, Path::new("x.ron")).unwrap(),
        plan_path: PathBuf::from("x.ron"),
        survey: Some(folder.path().join("survey")),
        calibration: None,
        out: folder.path().join("run"),
    };
    println!("{}", run(&request, &Silent).unwrap());
    let table = range_io::tables::read_stations(request.out.join("stations.csv")).unwrap();
    let apart = table[3].world_from_camera.translation.vector - Vector3::from(last.position_m);
    assert!(table.len() == 4 && apart.norm() < 1e-4, "{apart}");
}

#[test]
fn without_start_poses_no_wrong_pose_is_left_without_a_doubt() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    copy(&small_room().join("survey"), &survey);
    std::fs::remove_file(survey.join("stations.csv")).unwrap();
    let out = folder.path().join("out");
    let summary = match register(&request(&[survey], RegisterMethod::Multi, &out), &Silent) {
        Ok(summary) => summary,
        // A refusal that names the stations leaves no wrong pose either, and nothing on disk.
        Err(error) => {
            let words = error.to_string();
            assert!(words.contains("no alignment found") && words.contains("--guess") && !out.exists(), "{words}");
            return;
        }
    };
    println!("{summary}");
    assert!(summary.start.starts_with("none"), "{}", summary.start);
    // A room looks alike from opposite sides: right as from start poses, or said to be doubtful.
    let right = summary.position_error_max_m.unwrap() < 0.010 && summary.attitude_error_max_deg.unwrap() < 0.1;
    let doubted = summary.doubts.iter().any(|doubt| doubt.words.contains("no start poses were given"));
    assert!(right || doubted, "position {:?}, {:?}", summary.position_error_max_m, summary.doubts);
}

fn check_files(out: &Path, summary: &RegisterSummary) {
    let cloud = range_io::ply::read_cloud(out.join("cloud.ply")).unwrap();
    let unflagged = cloud.flags.unwrap().iter().filter(|flags| **flags == 0).count();
    assert_eq!(unflagged, summary.stations.iter().map(|station| station.points).sum::<usize>());
    let stations = range_io::tables::read_stations(out.join("stations.csv")).unwrap();
    let trajectory = range_io::trajectory::read_tum(out.join("trajectory.txt")).unwrap();
    assert_eq!((stations.len(), trajectory.len()), (summary.stations.len(), summary.stations.len()));
    for (row, station) in stations.iter().zip(&summary.stations) {
        let apart = row.world_from_camera.translation.vector - Vector3::from(station.position_m);
        // The table keeps a tenth of a micrometre.
        assert!(apart.norm() < 1e-6, "{}", station.name);
    }
    let json = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["stations"].as_array().unwrap().len(), summary.stations.len());
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    for words in
        ["Before the registration", "After the registration", "Distances between surfaces", "Graph of the stations"]
    {
        assert!(report.contains(words), "{words}");
    }
    assert!(!report.contains("src=\"http") && !report.contains("href=\"http"), "the page needs no network");
}

fn copy(from: &Path, to: &Path) {
    std::fs::create_dir_all(to).unwrap();
    for entry in std::fs::read_dir(from).unwrap().flatten() {
        let target = to.join(entry.file_name());
        if entry.path().is_dir() {
            copy(&entry.path(), &target);
        } else {
            std::fs::copy(entry.path(), target).unwrap();
        }
    }
}

/// Points on a corner of a room with boxes in it, about 3 cm apart; `shift` moves them along the surfaces, so that no
/// two clouds share a point.
fn corner(shift: f64) -> Vec<Point3<f64>> {
    let mut points = Vec::new();
    let mut rectangle = |origin: [f64; 3], a: [f64; 3], b: [f64; 3]| {
        let (origin, a, b) = (Vector3::from(origin), Vector3::from(a), Vector3::from(b));
        let counts = [a, b].map(|side| (side.norm() / 0.03) as usize);
        for (i, j) in (0..counts[0]).flat_map(|i| (0..counts[1]).map(move |j| (i, j))) {
            let [u, v] = [(i as f64 + shift) / counts[0] as f64, (j as f64 + shift) / counts[1] as f64];
            // Noise of some millimetres, spread as by chance.
            let noise = |k: f64| 0.004 * (((points.len() as f64 + shift) * k).sin() * 43_758.5).fract();
            let noise = Vector3::new(noise(12.9), noise(78.2), noise(37.7));
            points.push(Point3::from(origin + u * a + v * b + noise));
        }
    };
    rectangle([0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 2.4, 0.0]);
    rectangle([0.0, 0.0, 0.0], [3.0, 0.0, 0.0], [0.0, 0.0, 1.8]);
    rectangle([0.0, 0.0, 0.0], [0.0, 2.4, 0.0], [0.0, 0.0, 1.8]);
    for ([x, y, z], [a, b, c]) in
        [([0.4, 0.6, 0.0], [0.5, 0.3, 0.7]), ([1.6, 0.3, 0.0], [0.8, 0.5, 0.4]), ([1.2, 1.5, 0.0], [0.3, 0.6, 1.1])]
    {
        rectangle([x, y, z + c], [a, 0.0, 0.0], [0.0, b, 0.0]);
        rectangle([x + a, y, z], [0.0, b, 0.0], [0.0, 0.0, c]);
        rectangle([x, y + b, z], [a, 0.0, 0.0], [0.0, 0.0, c]);
    }
    points
}

fn write(path: &Path, points: impl Iterator<Item = Point3<f64>>) {
    let file = CloudFile { points: points.map(|point| point.coords.into()).collect(), ..CloudFile::default() };
    range_io::clouds::write_any_cloud(path, &file, Precision::Double).unwrap();
}

#[test]
fn two_clouds_are_brought_together_without_a_guess() {
    let folder = tempfile::tempdir().unwrap();
    let first_from_second =
        Isometry3::from_parts(Vector3::new(0.8, -0.4, 0.3).into(), UnitQuaternion::from_euler_angles(0.2, -0.3, 1.9));
    let paths = ["one.ply", "two.pcd"].map(|name| folder.path().join(name));
    write(&paths[0], corner(0.25).into_iter());
    write(&paths[1], corner(0.7).into_iter().map(|point| first_from_second.inverse() * point));
    let out = folder.path().join("out");
    let summary = register(&request(&paths, RegisterMethod::Pairs, &out), &Silent).unwrap();
    println!("{summary}");
    let found = &range_io::tables::read_stations(out.join("stations.csv")).unwrap()[1];
    assert_eq!(found.station, "two");
    let (found, sigma) = (found.world_from_camera, found.sigma_position_m);
    let apart = (found.translation.vector - first_from_second.translation.vector).norm();
    // The mean of thousands of points of 2 mm; what is left comes from neighbourhoods across edges, a small part of the
    // 3 cm between points.
    assert!(apart < 3e-3, "position off by {apart} m");
    assert!(found.rotation.angle_to(&first_from_second.rotation) < 2e-3, "attitude");
    assert!(sigma.is_some(), "every pose but the datum has a standard deviation");
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(report.contains("each in its own frame"), "nothing was known before");

    // A guess that leads nowhere is said so, and the pose is found without it.
    let guess = folder.path().join("guess.txt");
    std::fs::write(&guess, "1 0 0 500\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
    let far = RegisterRequest { guess: Some(guess), ..request(&paths, RegisterMethod::Pairs, &out) };
    let summary = register(&far, &Silent).unwrap();
    assert!(summary.doubts.iter().any(|doubt| doubt.words.contains("found without them")), "{:?}", summary.doubts);
}

#[test]
fn what_cannot_be_registered_is_refused_with_a_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    write(&path("corner.ply"), corner(0.25).into_iter());
    // A sphere and a corner have nothing in common.
    let sphere = (0..4000).map(|k| {
        let (height, turn) = (2.0 * (f64::from(k) + 0.5) / 4000.0 - 1.0, 2.399_963 * f64::from(k));
        let radius = (1.0 - height * height).sqrt();
        Point3::new(radius * turn.cos(), radius * turn.sin(), height)
    });
    write(&path("sphere.ply"), sphere);
    // None of them at the origin: zeros stand for what was not measured.
    write(&path("few.ply"), (0..10).map(|k| Point3::new(f64::from(k) + 1.0, 0.0, 0.0)));
    let text = |name: &str, text: &str| std::fs::write(path(name), text).unwrap();
    text("guess.csv", "station,x,y,z,omega,phi,kappa\nother,0,0,0,0,0,0\n");
    text("scaled.txt", "2 0 0 0\n0 2 0 0\n0 0 2 0\n0 0 0 1\n");
    text("words.txt", "hello\n");

    let refused = |names: &[&str], guess: Option<&str>, method: RegisterMethod| {
        let inputs: Vec<PathBuf> = names.iter().map(|name| path(name)).collect();
        let results = tempfile::tempdir().unwrap();
        let out = results.path().join("out");
        let request = RegisterRequest { guess: guess.map(path), ..request(&inputs, method, &out) };
        let error = register(&request, &Silent).unwrap_err();
        // A refusal leaves its reason, and wrong input nothing.
        let refused = error.failure() == Failure::Refused;
        assert_eq!(out.join("summary.json").is_file(), refused, "{error}");
        assert!(refused || !out.exists(), "nothing is left behind");
        println!("{error}");
        error.to_string()
    };
    let (pairs, multi) = (RegisterMethod::Pairs, RegisterMethod::Multi);
    assert!(refused(&[], None, pairs).contains("no input is named"));
    assert!(refused(&["corner.ply"], None, pairs).contains("one cloud"));
    assert!(refused(&["corner.ply", "absent.ply"], None, pairs).contains("absent.ply: there is no such file"));
    assert!(refused(&["corner.ply", "few.ply"], None, pairs).contains("few: 10 usable points"));
    assert!(refused(&["corner.ply", "."], None, pairs).contains("folder among several inputs"));
    let apart = refused(&["corner.ply", "sphere.ply"], None, pairs);
    assert!(apart.contains("sphere onto corner") && apart.contains("no alignment found"), "{apart}");
    let apart = refused(&["corner.ply", "sphere.ply"], None, multi);
    assert!(apart.contains("brings sphere into the frame of corner") && apart.contains("give start poses"), "{apart}");
    let two = ["corner.ply", "sphere.ply"];
    assert!(refused(&two, Some("guess.csv"), pairs).contains("has no pose of station corner"));
    assert!(refused(&two, Some("scaled.txt"), pairs).contains("no rigid motion"));
    assert!(refused(&["corner.ply", "sphere.ply", "corner.ply"], Some("scaled.txt"), pairs).contains("scaled.txt"));
    assert!(refused(&two, Some("words.txt"), pairs).contains("words.txt"));
    assert!(refused(&two, Some("nowhere.txt"), pairs).contains("nowhere.txt"));
}
