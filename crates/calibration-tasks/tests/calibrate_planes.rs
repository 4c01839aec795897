//! Range terms from frames of known planes, and what a pipeline does with a calibration that was estimated.

use std::path::Path;

use calibration_tasks::{CalibrateMethod, CalibrateRequest};
use camera_model::{Camera, ImageFormat, InteriorOrientation, LensDistortion, RayTable, pose_from_euler};
use error_models::{ModelSet, RangeErrorModel, RangeTerms};
use nalgebra::Vector3;
use pipeline::{Plan, Silent, ViewData, process};
use range_image::{Flags, Modulation, RangeFrame, Raster};
use range_io::calibration::Calibration;
use range_io::npz::NpzWriter;
use range_io::tables::{ObservedPlane, Station, write_planes, write_stations};

use crate::calibration_setup;
use crate::calibration_setup::{calibrate, request, target_field, terms};

const SURVEY: &str = r"#![enable(implicit_some)]
(
    camera: (
        width: 88, height: 72, pixel_pitch_mm: (0.08, 0.08),
        principal_distance_mm: 8.0, principal_point_mm: (0.0, 0.0), modulation_hz: [20e6],
    ),
    level: range, power_on_s: 0.0,
    frames: [FRAMES],
)";

pub(crate) fn camera() -> Camera {
    let interior = InteriorOrientation { principal_point_mm: [0.0, 0.0], principal_distance_mm: 8.0 };
    Camera::new(ImageFormat::new(88, 72, [0.08, 0.08]).unwrap(), interior, LensDistortion::default()).unwrap()
}

pub(crate) fn truth() -> RangeErrorModel {
    let terms = RangeTerms { d0: 0.024, periodic: [0.01, -0.005, 0.003, 0.005, -0.009, 0.004], e1: 1.5e-3, e2: -1e-3 };
    let ambiguity_interval_m = Modulation::new(20e6).unwrap().ambiguity_interval_m();
    RangeErrorModel { terms, ..RangeErrorModel::error_free(ambiguity_interval_m) }
}

/// Seven stations, one to seven metres before the wall z = 0, turned a little; noise of 3 mm from a fixed pattern.
fn write_survey(folder: &Path) {
    write_drifting_survey(folder, |_| 0.0);
}

/// The same by a camera that drifts with the time since power-on; a frame every five minutes.
pub(crate) fn write_drifting_survey(folder: &Path, drift_m: impl Fn(f64) -> f64) {
    write_survey_with(folder, drift_m, |_| 0.0);
}

/// The same with an offset of each pixel, by column and row.
pub(crate) fn write_survey_with(folder: &Path, drift_m: impl Fn(f64) -> f64, offset_m: impl Fn([usize; 2]) -> f64) {
    std::fs::create_dir_all(folder.join("frames")).unwrap();
    let (camera, model) = (camera(), truth());
    let (mut frames, mut stations, mut planes) = (Vec::new(), Vec::new(), Vec::new());
    for index in 0..7_u32 {
        let distance = 1.0 + f64::from(index);
        let pose = pose_from_euler(Vector3::new(0.1, -0.2, distance), [0.05, -0.08 + 0.02 * f64::from(index), 0.3]);
        let wall = ranges_to_wall(&camera, &pose);
        let time_s = 60.0 + 300.0 * f64::from(index);
        let ranges: Vec<f32> = wall
            .iter()
            .enumerate()
            .map(|(pixel, true_range)| {
                let [x, y] = camera.format.image_from_pixel([(pixel % 88) as f64, (pixel / 88) as f64]);
                // A sine of a large argument stands for noise: its deviation is its amplitude over the root of two.
                let noise = 0.003 * 2.0_f64.sqrt() * (1234.5 * pixel as f64 + 77.7 * f64::from(index)).sin();
                let noise = noise + offset_m([pixel % 88, pixel / 88]);
                (model.observed_range(*true_range + drift_m(time_s), x, y, f64::NAN).unwrap() + noise) as f32
            })
            .collect();
        let mut writer = NpzWriter::create(folder.join(format!("frames/{index}.npz"))).unwrap();
        writer.add("range", &[72, 88], &ranges).unwrap();
        writer.commit().unwrap();
        let station = format!("S{index}");
        frames.push(format!(
            "(file: \"frames/{index}.npz\", station: \"{station}\", integration_time_s: 0.002, timestamp_s: {time_s:.1}),"
        ));
        planes.push(ObservedPlane {
            plane: "wall".to_owned(),
            station: station.clone(),
            known: Some(([0.0, 0.0, 2.0], 0.0)),
        });
        stations.push(Station { station, world_from_camera: pose, ..Station::default() });
    }
    std::fs::write(folder.join("survey.ron"), SURVEY.replace("FRAMES", &frames.concat())).unwrap();
    write_stations(folder.join("stations.csv"), &stations).unwrap();
    write_planes(folder.join("planes.csv"), &planes).unwrap();
}

/// True ranges to the plane z = 0, row by row.
pub(crate) fn ranges_to_wall(camera: &Camera, pose: &nalgebra::Isometry3<f64>) -> Vec<f64> {
    let pixels = (0..88 * 72).map(|pixel| [f64::from(pixel % 88), f64::from(pixel / 88)]);
    pixels.map(|pixel| -pose.translation.z / (pose.rotation * camera.ray(pixel)).z).collect()
}

pub(crate) fn planes(request: &mut CalibrateRequest) {
    request.method = CalibrateMethod::Planes;
    request.options.terms = terms("d0 d2 d3 d4 d5 d6 d7 e1 e2");
}

#[test]
fn known_planes_give_the_range_terms() {
    let folder = tempfile::tempdir().unwrap();
    write_survey(&folder.path().join("survey"));
    let summary = calibrate(folder.path(), planes).unwrap();
    for (name, value) in RangeTerms::NAMES.iter().zip(truth().terms.to_array()) {
        let found = summary.parameters.get(name).unwrap();
        // The posterior deviation follows from the scatter that the test itself puts on.
        let deviation = (found.value - value) / found.sigma_posterior;
        assert!(deviation.abs() < 4.0, "{name}: {deviation:.1} sigmas off");
        assert!(found.sigma_posterior < 1e-3, "{name}: {}", found.sigma_posterior);
        let entries = summary.parameters.0.iter().filter(|(known, _)| known == name).count();
        assert_eq!(entries, 1, "{name} stands once");
    }
    assert!((summary.groups[0].rms - 0.003).abs() < 2e-4, "{:?}", summary.groups);
    let report = std::fs::read_to_string(folder.path().join("out/report.html")).unwrap();
    assert!(report.contains("After: residuals") && !report.contains("NaN"));
}

/// The offset and the distance of an unknown plane are nearly one thing: the offset is held at a known value.
#[test]
fn a_plane_that_is_not_known_is_found_with_the_terms() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    write_survey(&survey);
    let table = survey.join("planes.csv");
    let text = std::fs::read_to_string(&table).unwrap().replace(",0,0,2,0", ",,,,");
    std::fs::write(&table, text).unwrap();
    let offset = RangeErrorModel { terms: RangeTerms { d0: 0.024, ..RangeTerms::default() }, ..truth() };
    let models = ModelSet { entries: vec![(0.002, vec![offset])] };
    let start = Calibration::from_models(&camera(), &models, None).unwrap();
    start.write(survey.join("calibration.ron")).unwrap();
    let ask = |request: &mut CalibrateRequest| {
        planes(request);
        request.options.terms = terms("d2 d3 d4 d5 d6 d7 e1 e2");
    };
    let summary = calibrate(folder.path(), ask).unwrap();
    for (name, value) in RangeTerms::NAMES.iter().zip(truth().terms.to_array()).skip(1) {
        let found = summary.parameters.get(name).unwrap();
        let deviation = (found.value - value) / found.sigma_posterior;
        assert!(deviation.abs() < 4.0, "{name}: {deviation:.1} sigmas off");
    }
    assert!((summary.parameters.get("d0").unwrap().value - 0.024).abs() < 1e-12, "held");
    assert!(summary.diagnosis.iter().any(|words| words.contains("plane") && words.contains("mm")), "{summary}");
    // Without stations.csv each capture has a plane of its own in the camera's frame.
    std::fs::remove_file(survey.join("stations.csv")).unwrap();
    let alone = calibrate(folder.path(), |request| {
        planes(request);
        request.options.terms = terms("d4 d5 d6 d7");
    });
    let alone = alone.unwrap();
    assert!(alone.unknowns > summary.unknowns, "{} and {}", alone.unknowns, summary.unknowns);
}

#[test]
fn faults_of_planes_name_their_row() {
    let message = |change: &dyn Fn(&Path)| {
        let folder = tempfile::tempdir().unwrap();
        write_survey(&folder.path().join("survey"));
        change(&folder.path().join("survey"));
        let message = calibrate(folder.path(), planes).unwrap_err().to_string();
        assert!(!folder.path().join("out").exists(), "nothing half-written");
        message
    };
    let edit = |from: &'static str, to: &'static str| {
        move |survey: &Path| calibration_setup::edit(&survey.join("planes.csv"), from, to)
    };
    let unknown = message(&edit("wall,S2,0,0,2,0", "wall,S9,0,0,2,0"));
    assert!(unknown.contains("planes.csv:4:2: `station`: `S9` is no station"), "{unknown}");
    let other = message(&edit("wall,S2,0,0,2,0", "wall,S2,0,0,2,1"));
    assert!(other.contains("planes.csv:4:3: `nx`: `wall` has other numbers here"), "{other}");
    let zero = message(&edit("wall,S0,0,0,2,0", "wall,S0,0,0,0,0"));
    assert!(zero.contains("planes.csv:2:3: `nx`"), "{zero}");
    let half = message(&edit("wall,S0,0,0,2,0", "wall,S0,0,,2,0"));
    assert!(half.contains("planes.csv:2:4: `ny`: is empty, expected all or none"), "{half}");
    let away = message(&edit("wall,S0,0,0,2,0", "far,S0,0,0,2,99"));
    assert!(away.contains("planes.csv:2:1: `plane`: no usable pixel of station `S0`"), "{away}");
}

/// What `calibrate` writes is what `run` reads: same integration time and frequency.
#[test]
fn a_pipeline_takes_an_estimated_calibration() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    write_survey(&survey);
    calibrate(folder.path(), planes).unwrap();
    let plan = Plan::from_ron("(name: \"x\", stages: [Average(), CorrectRange(), PointCloud()])", "x.ron".as_ref());
    let calibration = folder.path().join("out/calibration.ron");
    let outcome = process(&plan.unwrap(), &survey, Some(&calibration), &Silent).unwrap();
    for view in &outcome.views {
        let ViewData::Range(frame) = &view.data else { panic!("ranges are ranges") };
        let pose = view.approximate_world_from_camera.unwrap();
        let errors: Vec<f64> = ranges_to_wall(&camera(), &pose)
            .iter()
            .zip(frame.range.as_slice())
            .map(|(truth, range)| f64::from(*range) - truth)
            .collect();
        let mean = errors.iter().sum::<f64>() / errors.len() as f64;
        // 24 mm before; what is left is the uncertainty of the terms, a tenth of a millimetre, and of the mean.
        assert!(mean.abs() < 5e-4, "{}: mean error {mean} m", view.station);
    }
}

/// The calibration of a target field, whose frames another survey of the same camera has.
#[test]
fn a_calibrated_lens_and_range_go_together() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    calibration_tasks::calibrate(&request(&target_field(), &out), &Silent).unwrap();
    let survey = folder.path().join("survey");
    std::fs::create_dir_all(&survey).unwrap();
    let text = SURVEY
        .replace("width: 88, height: 72", "width: 176, height: 144")
        .replace("(0.08, 0.08)", "(0.04, 0.04)")
        .replace("FRAMES", "(file: \"0.npz\", station: \"S0\", integration_time_s: 0.004)");
    std::fs::write(survey.join("survey.ron"), text).unwrap();
    let mut writer = NpzWriter::create(survey.join("0.npz")).unwrap();
    writer.add("range", &[144, 176], &vec![2.5_f32; 144 * 176]).unwrap();
    writer.commit().unwrap();
    let stages = "(name: \"x\", stages: [CorrectRange(), CorrectImagePoint(), PointCloud()])";
    let plan = Plan::from_ron(stages, "x.ron".as_ref()).unwrap();
    let outcome = process(&plan, &survey, Some(&out), &Silent).unwrap();
    let calibration = Calibration::read(&out).unwrap();
    let model = &calibration.model_set().unwrap().entries[0].1[0];
    let camera = calibration.camera().unwrap();
    let [xp, yp] = camera.interior.principal_point_mm;
    let corrected = |col: usize, row: usize| {
        let [x, y] = camera.format.image_from_pixel([col as f64, row as f64]);
        model.corrected_range(2.5, x - xp, y - yp, f64::NAN) as f32
    };
    let plane = |value: f32| Raster::filled(176, 144, value);
    let frame = RangeFrame {
        range: Raster::from_fn(176, 144, corrected),
        sigma: plane(f32::NAN),
        amplitude: plane(f32::NAN),
        flags: Raster::filled(176, 144, Flags::empty()),
    };
    let rays = RayTable::new(&camera).unwrap();
    let mut expected = rays.back_project(&frame).unwrap();
    rays.take_off_pixel_width(&mut expected).unwrap();
    let found = &outcome.views[0].cloud.as_ref().unwrap().points;
    let at = 20 * 176 + 130;
    // Ranges are kept in single precision: 2.5 m to 0.2 micrometre.
    let [expected, found] = [expected.points[at], found[at]].map(Vector3::from);
    assert!((expected - found).norm() < 1e-6, "{expected} and {found}");
    // Frames of another integration time are refused by name.
    calibration_setup::edit(&survey.join("survey.ron"), "0.004", "0.001");
    let message = process(&plan, &survey, Some(&out), &Silent).unwrap_err().to_string();
    assert!(message.contains("0.001") && message.contains("0.004"), "{message}");
}

/// Noise of the frames is 3 mm; they state none.
#[test]
fn deviations_of_ranges_are_taken_as_given_and_told_where_they_are_not() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    write_survey(&survey);
    for (sigma_range_m, doubtful) in [(Some(0.003), false), (None, true), (Some(0.002), true)] {
        let ask = |request: &mut CalibrateRequest| {
            planes(request);
            request.defaults.sigma_range_m = sigma_range_m;
        };
        let summary = calibrate(folder.path(), ask).unwrap();
        let scale = sigma_range_m.unwrap_or(0.01) / 0.003;
        assert!((summary.sigma0.unwrap() * scale - 1.0).abs() < 0.05, "{sigma_range_m:?}: {:?}", summary.sigma0);
        let told = summary.doubts.iter().any(|doubt| doubt.words.contains("global test"));
        assert_eq!(told, doubtful, "{sigma_range_m:?}: {:?}", summary.doubts);
        let assumed = summary.diagnosis.iter().any(|said| said.contains("--sigma-range"));
        assert_eq!(assumed, sigma_range_m.is_none(), "{:?}", summary.diagnosis);
    }
}

/// One of seven stations stands 5 mm, or a tenth of a degree, from where stations.csv says, which gives no deviations.
#[test]
fn a_pose_that_is_held_and_wrong_is_told() {
    for [shift_m, turn_rad] in [[0.0, 0.0], [0.005, 0.0], [0.0, 0.002]] {
        let folder = tempfile::tempdir().unwrap();
        let survey = folder.path().join("survey");
        write_survey(&survey);
        let mut stations = range_io::tables::read_stations(survey.join("stations.csv")).unwrap();
        let pose = &mut stations[3].world_from_camera;
        let off = nalgebra::Isometry3::new(Vector3::new(0.0, 0.0, shift_m), Vector3::new(0.0, turn_rad, 0.0));
        *pose *= off;
        write_stations(survey.join("stations.csv"), &stations).unwrap();
        let ask = |request: &mut CalibrateRequest| {
            planes(request);
            request.defaults.sigma_range_m = Some(0.003);
        };
        let summary = calibrate(folder.path(), ask).unwrap();
        let told: Vec<&str> = summary.doubts.iter().map(|doubt| doubt.words.as_str()).collect();
        let named = told.iter().any(|words| words.contains("station `S3`") && words.contains("held as exact"));
        assert_eq!(named, shift_m + turn_rad > 0.0, "{told:?}");
        assert!(summary.diagnosis.iter().any(|said| said.contains("taken as exact")), "{:?}", summary.diagnosis);
        if shift_m + turn_rad == 0.0 {
            assert!(told.is_empty(), "{told:?}");
        }
    }
}
