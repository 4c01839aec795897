//! Tracking as a command: a camera carried through the small room, losses, real frames, and input that cannot be tracked.

use std::fmt::Write;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use error_models::ModelSet;
use pipeline::{Failure, Judged, Silent, SimulateSource, Verdict, simulate};
use range_image::Raster;
use range_io::calibration::Calibration;
use range_io::survey::{InputFrame, Level, Survey, read_truth, write_frame};
use range_io::trajectory::read_tum;
use tasks::{TrackRequest, TrackSummary, TrackVerdict, track};

use crate::common;

const FRAMES: usize = 20;
/// Noise of a range, metre: that of the small room's camera on its walls.
const NOISE_M: f64 = 0.005;

/// The small room of the fixtures, seen by a camera that walks through it, with one frame of samples a place.
fn walk() -> &'static Path {
    static FOLDER: OnceLock<tempfile::TempDir> = OnceLock::new();
    let folder = FOLDER.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let scene = std::fs::read_to_string(common::fixtures().join("scenes/room_small.ron")).unwrap();
        let (head, rest) = scene.split_once("    stations: [").unwrap();
        let (_, errors) = rest.split_once("    errors:").unwrap();
        let station = |k: usize| {
            let k = k as f64;
            format!(
                "(name: \"F{k:02}\", position_m: ({}, {}, 1.5), attitude: LookAt(target_m: (5.5, {}, 1.1), roll_deg: {})),",
                1.2 + 0.04 * k,
                3.0 - 0.02 * k,
                3.0 - 0.08 * k,
                0.3 * k
            )
        };
        let stations: String = (0..FRAMES).map(station).collect();
        let head = head.replace("frames_per_station: 4", "frames_per_station: 1");
        let path = folder.path().join("walk.ron");
        std::fs::write(&path, format!("{head}    stations: [{stations}],\n    errors:{errors}")).unwrap();
        let source = SimulateSource {
            scene: path.display().to_string(),
            seed: 3,
            approximate_position_sigma_m: 0.05,
            approximate_attitude_sigma_deg: 2.0,
            gross_error_share: 0.0,
        };
        simulate(&source, Path::new(""), &folder.path().join("samples"), &Silent).unwrap();
        let samples = folder.path().join("samples");
        let mut survey = Survey::read(&samples).unwrap();
        // The simulator's stations begin at the same time; a walk goes from one to the next.
        for (k, frame) in survey.frames.iter_mut().enumerate() {
            frame.timestamp_s = Some(0.1 * k as f64);
        }
        survey.write(samples.join(Survey::FILE_NAME)).unwrap();
        write_ranges(&samples, &folder.path().join("ranges"));
        folder
    });
    folder.path()
}

/// The same as a survey of noisy ranges, as a camera delivers that corrects them itself; its lens is calibrated.
fn write_ranges(samples: &Path, ranges: &Path) {
    let mut survey = Survey::read(samples).unwrap();
    std::fs::create_dir_all(ranges.join("frames")).unwrap();
    let (width, height) = (survey.camera.width, survey.camera.height);
    for index in 0..survey.frames.len() {
        let truth = read_truth(&survey, samples, index).unwrap().unwrap();
        let mut noisy = truth.range.clone();
        for (k, range) in noisy.as_mut_slice().iter_mut().enumerate() {
            // Uniform noise of this standard deviation, spread as by chance.
            let share = ((k + index * width * height) as f64 * 12.9898).sin() * 43_758.547;
            *range += (NOISE_M * 12.0_f64.sqrt() * (share - share.floor() - 0.5)) as f32;
        }
        let frame = InputFrame::Range { range: noisy, amplitude: None, confidence: None };
        write_frame(ranges.join(&survey.frames[index].file), &frame).unwrap();
    }
    let nothing = InputFrame::Range { range: Raster::filled(width, height, 0.0), amplitude: None, confidence: None };
    write_frame(ranges.join("frames/blank.npz"), &nothing).unwrap();
    let camera = Calibration::read(samples).unwrap().camera().unwrap();
    let lens = Calibration::from_models(&camera, &ModelSet::default(), None).unwrap();
    lens.write(ranges.join(Calibration::FILE_NAME)).unwrap();
    std::fs::create_dir_all(ranges.join("truth")).unwrap();
    for file in ["stations.csv", "truth/stations.csv"] {
        std::fs::copy(samples.join(file), ranges.join(file)).unwrap();
    }
    survey.level = Level::Range;
    if let Some(truth) = &mut survey.truth {
        (truth.frames, truth.calibration) = (Vec::new(), None);
    }
    survey.write(ranges.join(Survey::FILE_NAME)).unwrap();
}

/// A request for the survey in `folder`, its results beside it.
fn request(folder: &Path) -> TrackRequest {
    let mut out = folder.file_name().unwrap().to_owned();
    out.push("-out");
    TrackRequest { survey: folder.to_owned(), guess: None, calibration: None, out: folder.with_file_name(out) }
}

/// A survey of ranges with other entries; its files are those of the walk.
fn variant(root: &Path, name: &str, change: impl Fn(&mut Survey)) -> PathBuf {
    let (from, to) = (walk().join("ranges"), root.join(name));
    copy(&from, &to);
    let mut survey = Survey::read(&from).unwrap();
    change(&mut survey);
    survey.write(to.join(Survey::FILE_NAME)).unwrap();
    to
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

#[test]
fn a_camera_is_followed_through_a_room() {
    let root = tempfile::tempdir().unwrap();
    // The order in the file does not matter.
    let folder = variant(root.path(), "walk", |survey| survey.frames.reverse());
    let summary = track(&request(&folder), &Silent).unwrap();
    println!("{summary}");
    assert_eq!((summary.verdict, summary.frames, summary.lost), (TrackVerdict::Tracked, FRAMES, 0));
    let truth = summary.truth.unwrap();
    // Some thousand pixels of 5 mm determine a pose to a fraction of a millimetre; what remains comes from edges and
    // from the 8 cm that neighbouring pixels are apart on the far walls.
    assert!(truth.position_error_rms_m < 0.005 && truth.adjusted_position_error_rms_m < 0.005, "{truth:?}");
    assert!(truth.attitude_error_max_deg < 0.2, "{truth:?}");
    // Nineteen steps of 4 cm forward and 2 cm aside.
    assert!((summary.path_length_m - 19.0 * 0.04_f64.hypot(0.02)).abs() < 0.06, "{}", summary.path_length_m);
    assert!(summary.datum.contains("stations.csv") && summary.prior == "constant velocity");
    check_files(&request(&folder).out, &summary);

    let again = TrackRequest { out: root.path().join("again"), ..request(&folder) };
    track(&again, &Silent).unwrap();
    for file in ["trajectory.txt", "trajectory_adjusted.txt", "stations.csv", "cloud.ply"] {
        let read = |out: &Path| std::fs::read(out.join(file)).unwrap();
        assert_eq!(read(&again.out), read(&request(&folder).out), "{file}: same input, same bits");
    }
}

fn check_files(out: &Path, summary: &TrackSummary) {
    for file in ["trajectory.txt", "trajectory_adjusted.txt"] {
        let poses = read_tum(out.join(file)).unwrap();
        assert_eq!(poses.len(), summary.frames - summary.lost, "{file}");
        assert!(poses.is_sorted_by(|a, b| a.timestamp_s < b.timestamp_s), "{file}");
    }
    let stations = range_io::tables::read_stations(out.join("stations.csv")).unwrap();
    assert_eq!(stations.len(), summary.frames - summary.lost);
    assert!(stations[1..].iter().all(|row| row.sigma_position_m.is_some()), "all but the datum have a sigma");
    let cloud = range_io::ply::read_cloud(out.join("cloud.ply")).unwrap();
    assert!(cloud.points.len() == summary.map_points && summary.map_points > 1000, "{} points", summary.map_points);
    assert!(cloud.sigma.unwrap().iter().all(|sigma| *sigma > 0.0) && cloud.normals.is_some());
    let json = std::fs::read_to_string(out.join("summary.json")).unwrap();
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["per_frame"].as_array().unwrap().len(), summary.frames);
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    for words in ["Path from above", "Path from the side", "State", "Time a frame", "Map from above"] {
        assert!(report.contains(words), "{words}");
    }
    assert!(!report.contains("src=\"http") && !report.contains("href=\"http"), "the page needs no network");
}

#[test]
fn raw_samples_go_through_the_stages_they_need() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("samples");
    copy(&walk().join("samples"), &folder);
    let mut survey = Survey::read(&folder).unwrap();
    survey.frames.truncate(4);
    survey.truth.as_mut().unwrap().frames.truncate(4);
    survey.write(folder.join(Survey::FILE_NAME)).unwrap();
    let summary = track(&request(&folder), &Silent).unwrap();
    println!("{summary}");
    assert_eq!((summary.verdict, summary.frames), (TrackVerdict::Tracked, 4));
    assert!(summary.calibration.contains("calibration.ron"), "{}", summary.calibration);
    // Noise of the far walls is a few centimetres a pixel; scattering and range terms are taken off.
    assert!(summary.truth.unwrap().position_error_max_m < 0.03, "{:?}", summary.truth);
}

#[test]
fn losses_are_told_and_a_lost_end_is_no_success() {
    let root = tempfile::tempdir().unwrap();
    let blank = |survey: &mut Survey, frames: std::ops::Range<usize>| {
        for frame in &mut survey.frames[frames] {
            frame.file = "frames/blank.npz".into();
        }
    };
    let folder = variant(root.path(), "gap", |survey| {
        survey.frames.truncate(14);
        blank(survey, 6..8);
    });
    let summary = track(&request(&folder), &Silent).unwrap();
    println!("{summary}");
    assert_eq!((summary.verdict, summary.lost, summary.relocalised), (TrackVerdict::Interrupted, 2, 1));
    assert_eq!((summary.losses[0].frames, summary.losses[0].reason), (2, "too few points"));
    assert!(summary.doubts[0].words.contains("2 of 14 frames"), "{:?}", summary.doubts);
    assert!(summary.truth.unwrap().position_error_max_m < 0.02, "found where it is: {:?}", summary.truth);
    check_files(&request(&folder).out, &summary);

    let folder = variant(root.path(), "end", |survey| {
        survey.frames.truncate(8);
        blank(survey, 5..8);
    });
    let summary = track(&request(&folder), &Silent).unwrap();
    let words = summary.to_string();
    assert!(words.contains("not found again") && words.contains("3 of 8 frames"), "{words}");
    assert_eq!((summary.verdict, summary.verdict()), (TrackVerdict::Lost, Verdict::Partial));
    let poses = read_tum(request(&folder).out.join("trajectory.txt")).unwrap();
    assert_eq!(poses.len(), 5, "what was tracked is kept");

    // What comes before the first surface is lost, not the start.
    let folder = variant(root.path(), "late", |survey| {
        survey.frames.truncate(6);
        blank(survey, 0..2);
    });
    let truth = walk().join("ranges/truth/stations.csv");
    let summary = track(&TrackRequest { guess: Some(truth), ..request(&folder) }, &Silent).unwrap();
    assert_eq!((summary.verdict, summary.lost), (TrackVerdict::Interrupted, 2));
    assert!(summary.datum.contains("F02"), "{}", summary.datum);
    let stations = range_io::tables::read_stations(request(&folder).out.join("stations.csv")).unwrap();
    let known = range_io::tables::read_stations(walk().join("ranges/truth/stations.csv")).unwrap();
    let apart = stations[3].world_from_camera.translation.vector - known[5].world_from_camera.translation.vector;
    assert!(stations[3].station == "F05" && apart.norm() < 0.02, "in the world of the guess: {}", apart.norm());
}

#[test]
fn what_cannot_be_tracked_is_refused_with_a_reason() {
    let root = tempfile::tempdir().unwrap();
    let path = |name: &str| root.path().join(name);
    let refused = |request: &TrackRequest| {
        let error = track(request, &Silent).unwrap_err();
        // A refusal leaves its reason, and wrong input nothing.
        let refused = error.failure() == Failure::Refused;
        assert_eq!(request.out.join("summary.json").is_file(), refused, "{error}");
        assert!(refused || !request.out.exists(), "nothing is left behind");
        println!("{error}");
        error.to_string()
    };
    let of = |name: &str, change: &dyn Fn(&mut Survey)| refused(&request(&variant(root.path(), name, change)));
    assert!(of("one", &|survey| survey.frames.truncate(1)).contains("it has one frame"));
    let error = of("timeless", &|survey| survey.frames[3].timestamp_s = None);
    assert!(error.contains("frame 3") && error.contains("has no timestamp_s"), "{error}");
    let error = of("twice", &|survey| survey.frames[5].timestamp_s = survey.frames[4].timestamp_s);
    assert!(error.contains("frames 4 and 5 have the same timestamp_s"), "{error}");
    let empty = of("empty", &|survey| survey.frames.iter_mut().for_each(|f| f.file = "frames/blank.npz".into()));
    assert!(empty.contains("none of the 20 frames shows enough of a surface"), "{empty}");

    let sizes = variant(root.path(), "sizes", |_| {});
    let small = InputFrame::Range { range: Raster::filled(40, 30, 2.0), amplitude: None, confidence: None };
    let second = Survey::read(&sizes).unwrap().frames[1].file.clone();
    write_frame(sizes.join(second), &small).unwrap();
    assert!(refused(&request(&sizes)).contains("[30, 40]"));

    let plain = variant(root.path(), "plain", |_| {});
    std::fs::write(path("matrix.txt"), "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n").unwrap();
    std::fs::write(path("other.txt"), "77 0 0 0 0 0 0 1\n").unwrap();
    let guessed = |name: &str| refused(&TrackRequest { guess: Some(path(name)), ..request(&plain) });
    assert!(guessed("matrix.txt").contains("holds one matrix"));
    assert!(guessed("other.txt").contains("has no pose of frame F00"));
    assert!(guessed("absent.txt").contains("absent.txt"));
    let elsewhere = tempfile::tempdir().unwrap();
    let (survey, out) = (path("matrix.txt"), elsewhere.path().join("out"));
    assert!(refused(&TrackRequest { survey, out, ..request(&plain) }).contains("no folder of a survey"));

    let imu = |survey: &mut Survey| {
        survey.extras.insert("imu".to_owned(), "imu.csv".into());
    };
    assert!(of("imu-absent", &imu).contains("imu.csv"));
    let late = variant(root.path(), "imu-late", imu);
    write_rest(&late.join("imu.csv"), 100.0);
    assert!(refused(&request(&late)).contains("without `imu` among its extras"));
}

/// Two seconds and more of a unit at rest whose y axis points up, as the camera's does.
fn write_rest(path: &Path, from_s: f64) {
    let sample = |k: i32| range_io::tables::ImuSample {
        timestamp_s: from_s + 0.01 * f64::from(k),
        angular_rate: [0.0; 3],
        acceleration: [0.0, 9.80665, 0.0],
    };
    range_io::tables::write_imu(path, &(0..600).map(sample).collect::<Vec<_>>()).unwrap();
}

#[test]
fn an_inertial_unit_that_the_survey_names_is_used() {
    let root = tempfile::tempdir().unwrap();
    let folder = variant(root.path(), "rest", |survey| {
        survey.extras.insert("imu".to_owned(), "imu.csv".into());
        let first = survey.frames[0].file.clone();
        survey.frames.truncate(5);
        for frame in &mut survey.frames {
            frame.file = first.clone();
        }
    });
    write_rest(&folder.join("imu.csv"), -2.0);
    let summary = track(&request(&folder), &Silent).unwrap();
    assert_eq!((summary.prior.as_str(), summary.verdict), ("inertial unit", TrackVerdict::Tracked));
    // The same frame five times.
    assert!(summary.path_length_m < 1e-3, "{}", summary.path_length_m);
}

#[test]
fn folders_of_depth_images_are_read_as_they_are() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("tum");
    std::fs::create_dir_all(folder.join("depth")).unwrap();
    let depth = |col: usize, row: usize| {
        let (u, v) = (col as f64 / 40.0, row as f64 / 40.0);
        2.0 + 0.15 * (2.0 * u).sin() * (3.1 * v).cos() + 0.1 * u + 0.05 * (1.3 * v * u).cos()
    };
    let image = Raster::from_fn(160, 120, |col, row| (5000.0 * depth(col, row)) as u16);
    let mut list = "# depth maps\n# timestamp filename\n".to_owned();
    for k in 0..3 {
        let name = format!("depth/{k}.png");
        range_io::png16::write(folder.join(&name), &image).unwrap();
        writeln!(list, "{}.5 {name}", 10 + k).unwrap();
    }
    std::fs::write(folder.join("depth.txt"), list).unwrap();
    let error = track(&request(&folder), &Silent).unwrap_err().to_string();
    assert!(error.contains("camera-intrinsics.txt") && error.contains("160 x 120"), "{error}");
    std::fs::write(folder.join("camera-intrinsics.txt"), "150 0 80\n0 150 60\n0 0 1\n").unwrap();
    let survey = Survey::read(&folder).unwrap();
    let focal = survey.camera.principal_distance_mm / survey.camera.pixel_pitch_mm[0];
    assert!((focal - 150.0).abs() < 1e-9, "{focal}");
    let summary = track(&request(&folder), &Silent).unwrap();
    assert_eq!((summary.verdict, summary.frames), (TrackVerdict::Tracked, 3));
    assert!(summary.path_length_m < 1e-3, "the same image thrice: {}", summary.path_length_m);
    let poses = read_tum(request(&folder).out.join("trajectory.txt")).unwrap();
    assert!((poses[2].timestamp_s - 12.5).abs() < 1e-9);
}

#[test]
fn real_frames_of_a_moving_camera() {
    if !common::has_capture("sevenscenes_redkitchen") {
        return;
    }
    let from = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real/sevenscenes_redkitchen");
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("kitchen");
    std::fs::create_dir_all(&folder).unwrap();
    for frame in (0..=40).step_by(5) {
        for ending in ["depth.png", "pose.txt"] {
            let name = format!("frame-{frame:06}.{ending}");
            std::fs::copy(from.join(&name), folder.join(&name)).unwrap();
        }
    }
    let summary = track(&request(&folder), &Silent).unwrap();
    println!("{summary}");
    assert_eq!((summary.verdict, summary.frames), (TrackVerdict::Tracked, 9));
    let compared = tasks::compare(
        &tasks::CompareRequest {
            alignment: tasks::CompareAlignment::Rigid,
            ..tasks::CompareRequest::new(request(&folder).out, folder)
        },
        &Silent,
    )
    .unwrap();
    println!("{compared}");
    let absolute = compared.trajectory.unwrap().absolute;
    // The poses that come with them are good to about 8 mm a pair.
    assert!(absolute.last().unwrap().position_m.rms < 0.02, "{absolute:?}");
}
