//! Rigs in folders: results, and what is refused with which exit code.

use std::fs::{create_dir_all, read_to_string, write};
use std::path::{Path, PathBuf};

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, Method, NetworkDatum, OffsetModel,
    TableDefaults,
};
use commands::{Failure, Judged, Silent, Verdict};
use pipeline::DriftTreatment;
use range_io::calibration::Calibration;
use range_io::tables::{Target, TargetObservation, write_observations, write_targets};
use rig_calibration::RigCamera;
use rig_tasks::{RigFile, RigSummary, calibrate_rig, is_rig};

use crate::rigs::{TERMS, mountings, observed, options, truth};

const RIG: &str = "(cameras: [(name: \"left\"), (name: \"right\"), (name: \"grey\", folder: \"passive camera\")])";

struct Folder(tempfile::TempDir);

impl Folder {
    /// A simulated rig as its cameras' folders have it.
    fn new() -> Self {
        let folder = Self(tempfile::tempdir().unwrap());
        let rig = observed(5, 0.002);
        for (camera, name) in rig.cameras.iter().zip(["left", "right", "passive camera"]) {
            write_camera(&folder.rig().join(name), camera);
        }
        write(folder.rig().join("rig.ron"), RIG).unwrap();
        folder
    }

    fn rig(&self) -> PathBuf {
        self.0.path().join("rig")
    }

    fn out(&self) -> PathBuf {
        self.0.path().join("out")
    }

    fn request(&self) -> CalibrateRequest {
        CalibrateRequest {
            survey: self.rig(),
            lens_survey: None,
            calibration: None,
            method: CalibrateMethod::Network(Method::OneStep),
            options: options(TERMS),
            offset: OffsetModel::Constant,
            warm_up: DriftTreatment::Apply,
            defaults: TableDefaults::default(),
            certificate: CertificateRequest::default(),
            out: self.out(),
        }
    }

    fn calibrate(&self) -> pipeline::Result<RigSummary> {
        calibrate_rig(&self.request(), &Silent)
    }

    /// How it fails, in words and kind.
    fn failure(&self) -> (Failure, String) {
        let error = self.calibrate().unwrap_err();
        (error.failure(), error.to_string())
    }

    fn edit(&self, file: &str, change: impl FnOnce(String) -> String) {
        let path = self.rig().join(file);
        write(&path, change(read_to_string(&path).unwrap())).unwrap();
    }
}

fn write_camera(folder: &Path, camera: &RigCamera) {
    create_dir_all(folder).unwrap();
    let (format, network) = (camera.network.camera.format, &camera.network);
    let [x, y] = format.pixel_pitch_mm;
    let ranged = camera.has_ranges();
    let survey = format!(
        "(camera: (width: {}, height: {}, pixel_pitch_mm: ({x}, {y}), principal_distance_mm: {}, principal_point_mm: (0.0, \
         0.0), modulation_hz: [{}], phase_steps: 4), level: {}, frames: [])",
        format.width,
        format.height,
        network.camera.interior.principal_distance_mm,
        if ranged { "19986163.9" } else { "" },
        if ranged { "range" } else { "intensity" },
    );
    write(folder.join("survey.ron"), survey).unwrap();
    let row = |seen: &rig_calibration::self_calibration::Sighting| TargetObservation {
        station: network.stations[seen.station].name.clone(),
        target: network.targets[seen.target].name.clone(),
        pixel: seen.pixel,
        range_m: seen.range_m,
        sigma_pixel: Some(seen.sigma_pixel),
        sigma_range_m: seen.range_m.map(|_| seen.sigma_range_m),
        ..TargetObservation::default()
    };
    let rows: Vec<TargetObservation> = network.sightings.iter().map(row).collect();
    write_observations(folder.join("observations.csv"), &rows).unwrap();
}

#[test]
fn a_rig_gives_mountings_calibrations_and_a_report() {
    let folder = Folder::new();
    assert!(is_rig(&folder.rig()));
    let summary = folder.calibrate().unwrap();
    assert_eq!(summary.verdict(), Verdict::Done, "{:?}", summary.doubts);
    let out = folder.out();
    let table = read_to_string(out.join("mountings.csv")).unwrap();
    let right: Vec<f64> =
        table.lines().nth(2).unwrap().split(',').skip(1).map(|value| value.parse().unwrap()).collect();
    let place = mountings()[1].translation.vector;
    for axis in 0..3 {
        assert!((right[axis] - place[axis]).abs() < 5.0 * right[6 + axis], "{table}");
        assert!(right[6 + axis] < 2e-3, "{table}");
    }
    for (name, index) in [("left", 0), ("right", 1)] {
        let calibration = Calibration::read(out.join(name)).unwrap();
        let d0 = calibration.range_models[0].parameters.iter().find(|parameter| parameter.name == "d0").unwrap();
        assert!((d0.value - truth(index).range_model.terms.d0).abs() < 5.0 * d0.sigma, "{name}: {}", d0.value);
    }
    assert!(Calibration::read(out.join("grey")).unwrap().range_models.is_empty());
    let json: serde_json::Value = serde_json::from_str(&read_to_string(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(json["mountings"]["names"].as_array().unwrap().len(), 12);
    assert_eq!(json["mountings"]["correlation"][3].as_array().unwrap().len(), 12);
    assert!(json["cameras"][2]["by_epoch"].as_array().unwrap().len() >= 9);
    let page = read_to_string(out.join("report.html")).unwrap();
    assert!(page.contains("Mounting residuals by epoch") && page.contains("<svg"));
    for file in ["residuals.csv", "report.html", "summary.json", "adjusted_stations.csv"] {
        assert!(out.join("right").join(file).is_file(), "{file}");
    }
    assert!(out.join("adjusted_epochs.csv").is_file() && out.join("adjusted_targets.csv").is_file());
    assert!(summary.to_string().contains("Mountings"));
    // The same again gives the same bits.
    folder.calibrate().unwrap();
    assert_eq!(read_to_string(out.join("mountings.csv")).unwrap(), table);
}

#[test]
fn a_rig_has_a_certificate_and_predicts_epochs_left_out() {
    let folder = Folder::new();
    let mut request = folder.request();
    request.certificate = CertificateRequest {
        operator: Some("A. Name".to_owned()),
        date: Some("2026-01-01".to_owned()),
        hold_out: Some(4),
    };
    let summary = calibrate_rig(&request, &Silent).unwrap();
    assert_eq!(summary.verdict(), Verdict::Done, "{:?}", summary.doubts);
    let certificate = summary.certificate.as_ref().unwrap();
    assert_eq!((certificate.hold_out.len(), certificate.mountings.len()), (3, 3));
    assert!(certificate.mountings[1].expanded_position_m.unwrap().iter().all(|u| *u > 1e-5 && *u < 4e-3));
    // Two of image points and ranges, one of image points alone.
    let predicted = certificate.verdicts.iter().filter(|verdict| verdict.test.contains("left out"));
    assert_eq!(predicted.filter(|verdict| verdict.passed == Some(true)).count(), 5, "{:?}", certificate.verdicts);
    assert!(certificate.verdicts.iter().all(|verdict| verdict.passed == Some(true)), "{:?}", certificate.verdicts);
    let read: Vec<&str> = certificate.inputs.iter().map(|input| input.file.rsplit('/').next().unwrap()).collect();
    assert_eq!(read.iter().filter(|file| **file == "observations.csv").count(), 3, "{read:?}");
    let page = read_to_string(folder.out().join("certificate.html")).unwrap();
    for words in ["2026-01-01", "A. Name", "prediction of epochs left out: camera grey: image points", "SHA-256"] {
        assert!(page.contains(words), "{words}");
    }
    let own = read_to_string(folder.out().join("right/certificate.html")).unwrap();
    assert!(own.contains("prediction of stations left out: ranges") && own.contains("Expanded uncertainty"));
    let json: serde_json::Value =
        serde_json::from_str(&read_to_string(folder.out().join("summary.json")).unwrap()).unwrap();
    let made = &json["certificate"]["hold_out"][1]["check"]["made"];
    assert!(made["image"]["values"].as_u64().unwrap() > 50 && made["range"]["fails"] == false, "{made}");

    // Without the waves the prediction of ranges fails, and the exit code says so.
    request.options = options("xp yp c k1 k2 d0 e1 e2");
    let summary = calibrate_rig(&request, &Silent).unwrap();
    assert_eq!(summary.verdict(), Verdict::Doubtful);
    let is_told =
        |doubt: &commands::Doubt| doubt.kind == commands::DoubtKind::Prediction && doubt.words.contains("ranges");
    assert!(summary.doubts.iter().any(is_told), "{:?}", summary.doubts);
}

#[test]
fn epochs_that_are_misnamed_are_refused_by_name() {
    let folder = Folder::new();
    folder.edit("right/observations.csv", |text| {
        text.replace("E03,", "was,").replace("E05,", "E03,").replace("was,", "E05,")
    });
    let (failure, told) = folder.failure();
    assert_eq!(failure, Failure::Refused, "{told}");
    assert!(told.contains("camera `right`") && told.contains("`E03` was taken at epoch `E05`"), "{told}");
    let summary = read_to_string(folder.out().join("summary.json")).unwrap();
    assert!(summary.contains("was taken at epoch") && summary.contains("\"converged\": false"), "{summary}");
}

#[test]
fn cameras_that_share_no_epoch_are_refused_by_name() {
    let folder = Folder::new();
    folder.edit("passive camera/observations.csv", |text| text.replace("\nE", "\nother"));
    let (failure, told) = folder.failure();
    assert!(failure == Failure::Refused && told.contains("camera `grey` share no epoch"), "{told}");
}

#[test]
fn control_in_millimetres_is_wrong_input() {
    let folder = Folder::new();
    let target = |target: &rig_calibration::self_calibration::NetworkTarget| Target {
        target: target.name.clone(),
        position_m: (target.point.unwrap().coords * 1e3).into(),
        sigma_m: Some([1.0; 3]),
    };
    let rows: Vec<Target> = truth(0).targets.iter().map(target).collect();
    write_targets(folder.rig().join("targets.csv"), &rows).unwrap();
    let mut request = folder.request();
    request.options = CalibrationOptions { datum: NetworkDatum::Control, ..request.options };
    let error = calibrate_rig(&request, &Silent).unwrap_err();
    assert!(error.failure() == Failure::Usage && error.to_string().contains("millimetres"), "{error}");
}

#[test]
fn slips_are_wrong_input() {
    let folder = Folder::new();
    // The folders of a range camera and of the grey one exchanged.
    let swapped = RIG.replace("(name: \"right\")", "(name: \"right\", folder: \"passive camera\")");
    let swapped = swapped.replace("\"grey\", folder: \"passive camera\"", "\"grey\", folder: \"right\"");
    folder.edit("rig.ron", |_| swapped);
    // The names alone are exchanged then, and everything else belongs together.
    assert_eq!(folder.calibrate().unwrap().cameras[1].name, "right");
    // Observations alone exchanged: ranges where there can be none.
    folder.edit("rig.ron", |_| RIG.to_owned());
    let [right, grey] = ["right", "passive camera"].map(|name| folder.rig().join(name).join("observations.csv"));
    let (of_right, of_grey) = (read_to_string(&right).unwrap(), read_to_string(&grey).unwrap());
    write(&right, &of_grey).unwrap();
    write(&grey, &of_right).unwrap();
    let (failure, told) = folder.failure();
    assert!(failure == Failure::Usage && told.contains("another camera"), "{told}");
    write(&right, of_right).unwrap();
    write(&grey, of_grey).unwrap();

    for (rig, words) in [
        ("(cameras: [(name: \"left\")])", "expected two or more"),
        ("(cameras: [(name: \"left\"), (name: \"left\")])", "two cameras `left`"),
        ("(cameras: [(name: \"left\"), (name: \"b\", folder: \"left\")])", "one folder"),
        ("(cameras: [(name: \"left\"), (name: \"a/b\")])", "no path"),
        ("(cameras: [(name: \"left\"), (name: \"missing\")])", "missing"),
        ("(cameras: [(name: \"left\"), (name: \"right\", colour: 3)])", "colour"),
        ("", "rig.ron"),
    ] {
        folder.edit("rig.ron", |_| rig.to_owned());
        let (failure, told) = folder.failure();
        assert!(failure == Failure::Usage && told.contains(words), "{words}: {told}");
    }
    folder.edit("rig.ron", |_| RIG.to_owned());
    let mut request = folder.request();
    request.method = CalibrateMethod::Planes;
    assert_eq!(calibrate_rig(&request, &Silent).unwrap_err().failure(), Failure::Usage);
    let onto_input = CalibrateRequest { out: folder.rig().join("left"), ..folder.request() };
    assert_eq!(calibrate_rig(&onto_input, &Silent).unwrap_err().failure(), Failure::Usage);
}

#[test]
fn the_rig_that_is_documented_is_read() {
    let page = read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/formats.md")).unwrap();
    let blocks = page.split("```ron\n").skip(1).filter_map(|rest| rest.split("```").next());
    let shown: Vec<&str> = blocks.filter(|text| text.contains("cameras:")).collect();
    assert_eq!(shown.len(), 1);
    let rig = RigFile::parse(Path::new("rig.ron"), shown[0]).unwrap();
    assert_eq!(rig.cameras[2].terms, Some(Vec::new()));
    assert_eq!(rig.cameras[1].folder(), Path::new("second"));
}
