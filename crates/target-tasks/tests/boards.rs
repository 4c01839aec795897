//! From a folder of images of a board to a calibration, and what is said where there is no board.

use std::path::Path;

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, Method, OffsetModel, TableDefaults,
    calibrate,
};
use pipeline::{DriftTreatment, Error, Judged, Silent, Verdict};
use png::{BitDepth, ColorType, Encoder};
use range_image::Raster;
use range_io::survey::{Level, Survey};
use range_io::tables::{read_observations, read_targets};
use target_tasks::{TargetKind, TargetsRequest, find_targets};
use targets::camera_model::Camera;

use crate::support::cases::light;
use crate::support::render::Optics;
use crate::support::sensor::Sensor;
use crate::support::views::{Wanted, large_camera, random_view, true_nodes};

const BOARD: Wanted =
    Wanted { columns: 9, rows: 6, square_m: 0.03, field_px: [30.0, 45.0], tilt_deg: [15.0, 40.0], inside_px: 3.0 };

/// Grey values of a view of the board, and where its nodes are.
fn view(camera: &Camera, seed: u64) -> (Raster<f32>, Vec<([usize; 2], [f64; 2])>) {
    let (pose, _) = random_view(camera, &BOARD, seed);
    let light = light(camera, &pose, &BOARD, &Optics::default());
    (Sensor::grey(2.0).expose(&light, seed), true_nodes(camera, &pose, &BOARD))
}

pub(crate) fn write_png(path: &Path, image: &Raster<f32>) {
    let file = std::fs::File::create(path).unwrap();
    let mut encoder = Encoder::new(file, image.width() as u32, image.height() as u32);
    encoder.set_color(ColorType::Grayscale);
    encoder.set_depth(BitDepth::Eight);
    let bytes: Vec<u8> = image.as_slice().iter().map(|value| value.round() as u8).collect();
    encoder.write_header().unwrap().write_image_data(&bytes).unwrap();
}

pub(crate) fn request(survey: &Path, out: &Path) -> TargetsRequest {
    TargetsRequest {
        survey: survey.to_owned(),
        calibration: None,
        kind: TargetKind::parse(&["checkerboard", "9x6", "0.03"]).unwrap(),
        principal_distance_px: None,
        board_sigma_m: None,
        out: out.to_owned(),
    }
}

pub(crate) fn calibration(survey: &Path, out: &Path) -> CalibrateRequest {
    CalibrateRequest {
        survey: survey.to_owned(),
        lens_survey: None,
        calibration: None,
        method: CalibrateMethod::Network(Method::OneStep),
        options: CalibrationOptions::default(),
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: out.to_owned(),
    }
}

#[test]
fn a_folder_of_images_becomes_a_survey_that_calibrates_the_lens() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found, out) = (folder.path().join("images"), folder.path().join("found"), folder.path().join("out"));
    std::fs::create_dir(&images).unwrap();
    let camera = large_camera();
    let mut truth = Vec::new();
    for seed in 1..=12 {
        let (image, nodes) = view(&camera, seed);
        write_png(&images.join(format!("{seed}.png")), &image);
        truth.push((seed.to_string(), nodes));
    }
    let summary = find_targets(&request(&images, &found), &Silent).unwrap();
    assert_eq!((summary.stations.len(), summary.verdict()), (12, Verdict::Done), "{summary}");
    let stations: Vec<&str> = summary.stations.iter().map(|board| board.station.as_str()).collect();
    assert_eq!(stations[8..], ["9", "10", "11", "12"], "names in the order of their numbers");

    let survey = Survey::read(&found).unwrap();
    assert_eq!((survey.level, survey.frames.len()), (Level::Intensity, 0));
    let rows = read_observations(found.join("observations.csv")).unwrap();
    assert_eq!((rows.len(), read_targets(found.join("targets.csv")).unwrap().len()), (12 * 54, 54));
    for row in &rows {
        let nodes = &truth.iter().find(|(station, _)| *station == row.station).unwrap().1;
        let node: [usize; 2] = [row.target[1..3].parse().unwrap(), row.target[4..6].parse().unwrap()];
        let place = nodes.iter().find(|(known, _)| *known == node).unwrap().1;
        let pixel = row.pixel.unwrap();
        assert!((pixel[0] - place[0]).hypot(pixel[1] - place[1]) < 0.3, "{row:?} {place:?}");
    }
    let focal_px = camera.interior.principal_distance_mm / camera.format.pixel_pitch_mm[0];
    assert!((summary.principal_distance_px / focal_px - 1.0).abs() < 0.15, "{}", summary.principal_distance_px);

    let calibrated = calibrate(&calibration(&found, &out), &Silent).unwrap();
    let c = calibrated.parameters.get("c").unwrap();
    let sigma = c.sigma_posterior;
    // The pitch of an unknown camera is 0.01 mm, that of this one as well.
    let error = c.value - camera.interior.principal_distance_mm;
    assert!(error.abs() < 4.0 * sigma && sigma < 0.02, "{error} {sigma}");
}

#[test]
fn what_is_missing_is_named_and_nothing_is_written_where_all_is() {
    let folder = tempfile::tempdir().unwrap();
    let (images, found) = (folder.path().join("images"), folder.path().join("found"));
    std::fs::create_dir(&images).unwrap();
    write_png(&images.join("a.png"), &Raster::filled(160, 120, 90.0));
    let refused = find_targets(&request(&images, &found), &Silent).unwrap_err();
    assert!(matches!(refused, Error::Refused { .. }), "{refused}");
    assert!(refused.to_string().contains("none of 1 stations shows the targets, checkerboard 9x6 0.03"), "{refused}");
    let is_there = |name: &str| found.join(name).is_file();
    assert!(is_there("summary.json") && !["survey.ron", "observations.csv", "report.html"].into_iter().any(is_there));

    for seed in 1..=3 {
        write_png(&images.join(format!("{seed}.png")), &view(&large_camera(), seed).0);
    }
    let error = find_targets(&request(&images, &found), &Silent).unwrap_err().to_string();
    assert!(error.contains("1.png") || error.contains("a.png"), "another size: {error}");
    write_png(&images.join("a.png"), &Raster::filled(640, 480, 90.0));
    let summary = find_targets(&request(&images, &found), &Silent).unwrap();
    assert_eq!((summary.stations.len(), summary.missing.len(), summary.verdict()), (3, 1, Verdict::Doubtful));
    assert!(summary.to_string().contains("a: the board was not found: the image has no contrast"), "{summary}");
    let page = std::fs::read_to_string(found.join("report.html")).unwrap();
    assert!(page.matches("<circle").count() >= 3 * 54 && page.contains("Not found: the image has no contrast"));
}

#[test]
fn the_output_never_replaces_the_images() {
    let folder = tempfile::tempdir().unwrap();
    write_png(&folder.path().join("1.png"), &view(&large_camera(), 1).0);
    assert!(find_targets(&request(folder.path(), folder.path()), &Silent).is_err());
    assert!(folder.path().join("1.png").is_file());
}

#[test]
fn kinds_are_read_as_they_are_written_and_others_refused() {
    for words in
        ["checkerboard 9x6 0.025", "circles 10x10 0.0254", "asymmetric-circles 4x11 0.02", "circles 7x5 0.4 1.5"]
    {
        let kind = TargetKind::parse(&words.split(' ').collect::<Vec<_>>()).unwrap();
        assert_eq!(kind.to_string(), words);
    }
    let wrong =
        ["", "checkerboard", "checkerboard 9 0.025", "checkerboard 9x6 -1", "checkerboard 9x6 0.02 2", "dots 9x6 1"];
    for words in wrong {
        let refused = TargetKind::parse(&words.split(' ').collect::<Vec<_>>());
        assert!(refused.is_err(), "{words}");
    }
    let infinite = TargetsRequest { board_sigma_m: Some(f64::NAN), ..request(Path::new("nowhere"), Path::new("out")) };
    assert!(find_targets(&infinite, &Silent).unwrap_err().to_string().contains("--board-sigma"));
}
