//! A survey that is changed as a slip changes it: each slip shows in the exit code or in a doubt, and no slip in neither.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use pipeline::{Doubt, DoubtKind, Error, Failure, Judged, Plan, RunRequest, Silent, Stage, Summary};
use range_io::npz::{NpzReader, NpzWriter};
use range_io::tables::{read_stations, write_stations};
use tasks::{RegisterMethod, RegisterRequest, inspect, register};

use crate::calibration_setup::{copy, edit};
use crate::common::{fixtures, simulated_from};

/// The small room on fewer pixels, with two frames a station; simulated once.
fn room() -> &'static Path {
    static ROOM: OnceLock<(tempfile::TempDir, PathBuf)> = OnceLock::new();
    let (_, survey) = ROOM.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let mut text = std::fs::read_to_string(fixtures().join("scenes/room_small.ron")).unwrap();
        for (from, to) in [
            ("width: 132, height: 108", "width: 99, height: 81"),
            ("pixel_pitch_mm: (0.05333333333333334, 0.05333333333333334)", "pixel_pitch_mm: (0.0711, 0.0711)"),
            ("frames_per_station: 4", "frames_per_station: 2"),
            ("rays_per_pixel_side: 4", "rays_per_pixel_side: 2"),
        ] {
            assert!(text.contains(from), "{from}");
            text = text.replace(from, to);
        }
        let scene = folder.path().join("room.ron");
        std::fs::write(&scene, text).unwrap();
        let survey = simulated_from(&scene, 3, folder.path());
        (folder, survey)
    });
    survey
}

/// A copy of the room with a slip in it.
struct Slip {
    folder: tempfile::TempDir,
}

impl Slip {
    fn new(change: impl FnOnce(&Path)) -> Self {
        let folder = tempfile::tempdir().unwrap();
        copy(room(), &folder.path().join("survey"));
        change(&folder.path().join("survey"));
        Self { folder }
    }

    fn survey(&self) -> PathBuf {
        self.folder.path().join("survey")
    }

    /// The way to corrected points.
    fn points(&self) -> pipeline::Result<Summary> {
        self.run(|stages| stages.retain(|stage| !matches!(stage, Stage::Register(_) | Stage::Adjust(_))))
    }

    /// The whole way to one cloud.
    fn registered(&self) -> pipeline::Result<Summary> {
        self.run(|_| ())
    }

    fn run(&self, change: impl Fn(&mut Vec<Stage>)) -> pipeline::Result<Summary> {
        let plan_path = fixtures().join("pipelines/room_small.ron");
        let mut plan = Plan::read(&plan_path).unwrap();
        change(&mut plan.stages);
        let out = self.folder.path().join("out");
        let request = RunRequest { plan, plan_path, survey: Some(self.survey()), calibration: None, out };
        pipeline::run(&request, &Silent)
    }

    /// What `inspect` doubts.
    fn inspected(&self) -> Vec<Doubt> {
        inspect(&self.survey()).unwrap().doubts().to_vec()
    }
}

fn has(doubts: &[Doubt], kind: DoubtKind, subject: Option<&str>) {
    let found = doubts.iter().any(|doubt| doubt.kind == kind && doubt.subject.as_deref() == subject);
    assert!(found, "no {kind:?} of {subject:?} in {doubts:#?}");
}

/// Refused as wrong input, with the given words.
fn refused(result: pipeline::Result<Summary>, words: &[&str]) {
    let error = result.unwrap_err();
    assert_eq!(error.failure(), Failure::Usage, "{error}");
    for word in words {
        assert!(error.to_string().contains(word), "{error} does not say {word:?}");
    }
}

/// Changes the samples of a frame, given as planes of one phase step each.
fn change_samples(file: &Path, change: impl Fn(usize, usize, &mut [u16])) {
    let array = NpzReader::open(file).unwrap().read("samples", |_| Ok(())).unwrap();
    let shape = array.shape.clone();
    let range_io::npz::Values::U16(mut samples) = array.values else { panic!("the room has 16 bits") };
    let (height, width) = (shape[2], shape[3]);
    for plane in samples.chunks_mut(width * height) {
        change(width, height, plane);
    }
    let mut writer = NpzWriter::create(file).unwrap();
    writer.add("samples", &shape, &samples).unwrap();
    writer.commit().unwrap();
}

fn mirror(width: usize, _: usize, plane: &mut [u16]) {
    plane.chunks_mut(width).for_each(<[u16]>::reverse);
}

fn frame(survey: &Path, station: usize, number: usize) -> PathBuf {
    survey.join(format!("frames/{station:03}_{number}.npz"))
}

#[test]
fn without_a_slip_there_is_no_doubt() {
    let sound = Slip::new(|_| ());
    assert_eq!(sound.inspected(), []);
    let summary = sound.registered().unwrap();
    println!("{summary}");
    assert_eq!(summary.doubts(), []);
}

#[test]
fn another_modulation_is_refused_with_both_values_and_absurd_ones_are_named() {
    let slip =
        Slip::new(|survey| edit(&survey.join("survey.ron"), "modulation_hz: [30000000.0]", "modulation_hz: [20e6]"));
    refused(slip.points(), &["20 MHz", "30 MHz", "modulation_hz"]);
    has(&slip.inspected(), DoubtKind::Calibration, Some("calibration.ron"));

    let slip = Slip::new(|survey| {
        edit(&survey.join("survey.ron"), "modulation_hz: [30000000.0]", "modulation_hz: [30]");
        std::fs::remove_file(survey.join("calibration.ron")).unwrap();
    });
    has(&slip.inspected(), DoubtKind::Modulation, None);
}

#[test]
fn a_calibration_of_another_camera_is_refused() {
    let changed = |from: &str, to: &str| {
        let slip = Slip::new(|survey| edit(&survey.join("calibration.ron"), from, to));
        slip.points()
    };
    refused(changed("value: 4.6", "value: 6.0"), &["principal distance", "6 mm", "4.6 mm"]);
    refused(changed("0.0711", "0.04"), &["0.04", "0.0711"]);
    refused(changed("width: 99", "width: 98"), &["98 x 81", "99 x 81"]);
    refused(changed("integration_time_s: 0.002", "integration_time_s: 0.004"), &["0.002 s", "0.004 s", "calibrate at"]);
}

#[test]
fn a_span_elsewhere_does_not_pass() {
    let with_span = |span: &str| {
        Slip::new(|survey| {
            let file = survey.join("calibration.ron");
            let text = std::fs::read_to_string(&file).unwrap();
            let begin = text.find("\n    span: (").unwrap() + 1;
            let end = begin + text[begin..].find(')').unwrap() + 1;
            std::fs::write(&file, format!("{}span: ({span}){}", &text[..begin], &text[end..])).unwrap();
        })
    };
    refused(with_span("range_m: (20.0, 30.0)").points(), &["20.000 to 30.000 m", "100 %"]);
    refused(with_span("integration_time_s: (0.01, 0.02)").points(), &["0.01 to 0.02 s", "0.002 s"]);
    let part = with_span("range_m: (0.5, 3.0)").points().unwrap();
    has(part.doubts(), DoubtKind::OutsideSpan, None);
    assert!(part.flags_fraction["outside_span"] > 0.2, "{:?}", part.flags_fraction);
    let whole = with_span("range_m: (0.1, 12.0), integration_time_s: (0.002, 0.002)").points().unwrap();
    assert_eq!(whole.doubts(), []);
}

#[test]
fn a_reversed_phase_is_doubted() {
    let slip = Slip::new(|survey| edit(&survey.join("survey.ron"), "phase_sense: Positive", "phase_sense: Negative"));
    has(&slip.inspected(), DoubtKind::PhaseSense, None);
    let summary = slip.points().unwrap();
    has(summary.doubts(), DoubtKind::PhaseSense, None);
}

#[test]
fn dead_and_saturated_frames_are_doubted() {
    for value in [0, u16::MAX, 300] {
        let slip = Slip::new(|survey| change_samples(&frame(survey, 2, 1), |_, _, plane| plane.fill(value)));
        has(&slip.inspected(), DoubtKind::DeadFrames, Some("S2"));
        let all = Slip::new(|survey| {
            for station in 0..8 {
                for number in 0..2 {
                    change_samples(&frame(survey, station, number), |_, _, plane| plane.fill(value));
                }
            }
        });
        has(&all.inspected(), DoubtKind::DeadFrames, None);
        if let Ok(summary) = all.points() {
            has(summary.doubts(), DoubtKind::DeadFrames, None);
        }
    }
}

#[test]
fn frames_of_another_station_are_doubted() {
    let slip = Slip::new(|survey| {
        for number in 0..2 {
            std::fs::copy(frame(survey, 0, number), frame(survey, 3, number)).unwrap();
        }
    });
    has(&slip.inspected(), DoubtKind::RepeatedFrames, Some("S3"));
    let summary = slip.points().unwrap();
    has(summary.doubts(), DoubtKind::RepeatedFrames, Some("S3"));
    let rows = read_stations(slip.folder.path().join("out/stations.csv")).unwrap();
    let doubtful: Vec<&str> = rows.iter().filter(|row| row.doubt.is_some()).map(|row| row.station.as_str()).collect();
    assert_eq!(doubtful, ["S3"], "the table names it");
}

/// A registered result that something speaks against, or a refusal.
fn shows(result: pipeline::Result<Summary>) {
    match result {
        Ok(summary) => {
            println!("{summary}");
            assert!(!summary.doubts().is_empty(), "nothing speaks against it");
        }
        Err(error) => {
            println!("{error}");
            assert!(matches!(error.failure(), Failure::Refused | Failure::Usage), "{error}");
        }
    }
}

#[test]
fn swapped_stations_show() {
    let slip = Slip::new(|survey| {
        for number in 0..2 {
            let (one, other) = (frame(survey, 1, number), frame(survey, 4, number));
            let kept = survey.join("kept");
            std::fs::rename(&one, &kept).unwrap();
            std::fs::rename(&other, &one).unwrap();
            std::fs::rename(&kept, &other).unwrap();
        }
    });
    shows(slip.registered());
}

#[test]
fn a_mirrored_station_and_a_mirrored_frame_show() {
    let station = Slip::new(|survey| (0..2).for_each(|number| change_samples(&frame(survey, 5, number), mirror)));
    shows(station.registered());
    let one = Slip::new(|survey| change_samples(&frame(survey, 5, 1), mirror));
    shows(one.registered());
}

#[test]
fn stations_in_millimetres_are_doubted() {
    let slip = Slip::new(|survey| {
        let mut rows = read_stations(survey.join("stations.csv")).unwrap();
        for row in &mut rows {
            row.world_from_camera.translation.vector *= 1000.0;
        }
        write_stations(survey.join("stations.csv"), &rows).unwrap();
    });
    has(&slip.inspected(), DoubtKind::Units, None);
    let summary = slip.points().unwrap();
    has(summary.doubts(), DoubtKind::Units, None);
}

#[test]
fn a_longest_range_that_most_ranges_exceed_is_doubted() {
    let with_maximum = |metres: f64| {
        let summary = Slip::new(|_| ()).run(|stages| {
            stages.retain(|stage| !matches!(stage, Stage::Register(_) | Stage::Adjust(_)));
            for stage in stages {
                if let Stage::Unwrap(options) = stage {
                    options.maximum_range_m = Some(metres);
                }
            }
        });
        summary.unwrap().doubts().iter().filter(|doubt| doubt.kind == DoubtKind::BeyondMaximum).count()
    };
    // Stations see 0.4 to 7 m; 0.012 is 12 m in kilometres.
    assert_eq!(with_maximum(0.012), 8);
    assert_eq!(with_maximum(12.0), 0);
}

#[test]
fn stations_that_no_surface_holds_are_not_taken_for_placed() {
    let folder = tempfile::tempdir().unwrap();
    // One bare wall 3 m away, its middle a little further right for each station: nothing tells by how much.
    let names = [0, 1, 2].map(|station| folder.path().join(format!("{station}.xyz")));
    for (station, name) in names.iter().enumerate() {
        let points = (0..60 * 80).map(|i| {
            let (column, row) = (f64::from(i % 80), f64::from(i / 80));
            // Noise of about a millimetre that repeats nowhere within the wall.
            let noise = 1e-3 * (12.9898 * column + 78.233 * row + station as f64).sin();
            format!("{:.4} {:.4} {:.4}\n", 0.03 * column - 1.2, 0.03 * row - 0.9, 3.0 + noise)
        });
        std::fs::write(name, points.collect::<String>()).unwrap();
    }
    for method in [RegisterMethod::Multi, RegisterMethod::Pairs] {
        let request = RegisterRequest {
            inputs: names.to_vec(),
            guess: None,
            calibration: None,
            method,
            out: folder.path().join("out"),
        };
        match register(&request, &Silent) {
            Ok(summary) => assert!(!summary.doubts().is_empty(), "{method:?}: {summary}"),
            Err(error) => assert_eq!(error.failure(), Failure::Refused, "{error}"),
        }
    }
}

#[test]
fn a_principal_distance_in_metres_is_named() {
    let slip = Slip::new(|survey| {
        edit(&survey.join("survey.ron"), "principal_distance_mm: 4.6", "principal_distance_mm: 0.0046");
        std::fs::remove_file(survey.join("calibration.ron")).unwrap();
    });
    has(&slip.inspected(), DoubtKind::Units, None);
}

#[test]
fn frames_that_cannot_be_read_are_doubted() {
    let slip = Slip::new(|survey| std::fs::write(frame(survey, 1, 0), "no archive").unwrap());
    has(&slip.inspected(), DoubtKind::UnreadableFrames, Some("S1"));
    assert!(matches!(slip.points().unwrap_err(), Error::File(_)));
}
