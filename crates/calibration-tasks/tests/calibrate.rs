//! Calibration of surveys from end to end: files in, files out, truth recovered.

use std::path::Path;

use calibration_tasks::{CalibrateMethod, CalibrationSummary, Method, NetworkPlanRequest, PlanOptions, TermSelection};
use error_models::ParameterStatus;
use pipeline::Silent;
use range_io::calibration::Calibration;
use range_io::tables::{read_residuals, read_stations, read_targets};
use serde_json::Value;

use crate::calibration_setup::{calibrate, changed, request, target_field, terms};
use crate::common::fixtures;

/// Estimated parameters lie within this many of their standard deviations of the truth. Of a few dozen normal values
/// one lies beyond 4 in one survey of five hundred, and the surveys are seeded.
const WITHIN: f64 = 4.0;

fn assert_true(summary: &CalibrationSummary, survey: &Path) {
    let truth = Calibration::read(survey.join("truth/calibration.ron")).unwrap();
    let ranges = truth.range_models.iter().flat_map(|model| &model.parameters);
    for known in truth.parameters.iter().chain(ranges) {
        let found = summary.parameters.get(&known.name).unwrap();
        if found.status == "estimated" {
            let deviation = (found.value - known.value) / found.sigma_prior;
            assert!(deviation.abs() < WITHIN, "{}: {deviation:.1} sigmas off", known.name);
        } else {
            assert!((found.value - known.value).abs() < 1e-12, "{} is held at another value", known.name);
        }
    }
}

fn summary_of(out: &Path) -> Value {
    serde_json::from_str(&std::fs::read_to_string(out.join("summary.json")).unwrap()).unwrap()
}

#[test]
fn a_target_field_gives_back_its_truth_and_all_files() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut request = request(&target_field(), &out);
    request.options.terms = TermSelection::Auto;
    let summary = calibration_tasks::calibrate(&request, &Silent).unwrap();
    assert_true(&summary, &target_field());
    // sigma0 of 1,695 degrees of freedom has a standard deviation of 0.017.
    assert!((summary.sigma0.unwrap() - 1.0).abs() < 0.07, "{:?}", summary.sigma0);
    // A share of 0.002 of 1,986 values was made wrong by 20 sigmas or more.
    assert!((2..20).contains(&summary.rejected.len()), "{:?}", summary.rejected);

    let json = summary_of(&out);
    for name in "xp yp c k1 k2 k3 p1 p2 d0 d2 d3 d4 d5 d6 d7 e1 e2 h1 h2 h3".split(' ') {
        let parameter = &json["parameters"][name];
        for key in ["value", "sigma_prior", "sigma_posterior"] {
            assert!(parameter[key].is_f64(), "{name}.{key}: {parameter}");
        }
        assert!(parameter["unit"].is_string(), "{name}");
        assert!(["estimated", "held"].contains(&parameter["status"].as_str().unwrap()), "{name}");
    }
    for key in ["observations", "unknowns", "datum_defect", "redundancy", "vtpv", "sigma0", "iterations"] {
        assert!(json[key].is_number(), "{key}: {}", json[key]);
    }
    assert_eq!(json["converged"], true);
    assert_eq!(json["datum_defect"], 6, "ranges and bars give the scale");
    let names = json["correlation"]["names"].as_array().unwrap().len();
    assert_eq!(json["correlation"]["matrix"].as_array().unwrap().len(), names);
    assert!(json["rejected"].is_array() && json["diagnosis"].is_array());

    let calibration = Calibration::read(&out).unwrap();
    assert_eq!(calibration.range_models[0].integration_time_s.to_bits(), 0.004_f64.to_bits());
    let d0 = &calibration.range_models[0].parameters[0];
    assert_eq!(d0.value.to_bits(), summary.parameters.get("d0").unwrap().value.to_bits());
    assert!(calibration.correlation.unwrap().between("xp", "p1").unwrap().abs() > 0.5, "the notorious pair");
    let residuals = read_residuals(out.join("residuals.csv")).unwrap();
    let rejected = residuals.iter().filter(|row| row.verdict == "rejected").count();
    assert_eq!(rejected, summary.rejected.len());
    assert_eq!(read_targets(out.join("adjusted_targets.csv")).unwrap().len(), 63);
    let stations = read_stations(out.join("adjusted_stations.csv")).unwrap();
    assert!(stations.len() == 14 && stations.iter().all(|station| station.sigma_position_m.is_some()));
    let report = std::fs::read_to_string(out.join("report.html")).unwrap();
    for words in ["Correlations", "Image residuals", "From above", "At 4 m", "Choice of terms", "Rejected"] {
        assert!(report.contains(words), "the report has no {words:?}");
    }
    assert!(!report.contains("NaN") && !report.contains("src=\"http"), "no holes, nothing from elsewhere");
}

#[test]
fn the_committed_survey_is_what_its_network_gives() {
    let folder = tempfile::tempdir().unwrap();
    let again = folder.path().join("target_field");
    calibration_tasks::simulate_network(&fixtures().join("networks/target_field.ron"), None, &again).unwrap();
    let mut size = 0;
    for file in [
        ".complete",
        "survey.ron",
        "observations.csv",
        "stations.csv",
        "targets.csv",
        "distances.csv",
        "truth/calibration.ron",
    ] {
        let committed = std::fs::read_to_string(target_field().join(file)).unwrap();
        let new = std::fs::read_to_string(again.join(file)).unwrap();
        assert!(committed == new, "{file} is stale: run `cargo xtask fixtures`");
        size += committed.len();
    }
    assert!(size < 300_000, "{size} bytes");
}

#[test]
fn a_passive_camera_beside_it_frees_the_poses() {
    let folder = tempfile::tempdir().unwrap();
    let survey = folder.path().join("survey");
    calibration_tasks::simulate_network(&fixtures().join("networks/joint.ron"), None, &survey).unwrap();
    for method in [Method::JointIntegrated, Method::JointTwoStep] {
        let summary = calibrate(folder.path(), |request| request.method = CalibrateMethod::Network(method)).unwrap();
        assert_true(&summary, &survey);
        assert!(summary.groups.iter().any(|group| group.name == "passive_col"), "{:?}", summary.groups);
    }
}

#[test]
fn two_steps_find_the_same_as_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut request = request(&target_field(), &folder.path().join("out"));
    request.method = CalibrateMethod::Network(Method::TwoStepDependent);
    assert_true(&calibration_tasks::calibrate(&request, &Silent).unwrap(), &target_field());
}

#[test]
fn a_wall_at_one_distance_is_refused_with_a_reason_and_without_parameters() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("weak.ron");
    let text = std::fs::read_to_string(fixtures().join("networks/target_field.ron")).unwrap();
    // One frontal distance, no roll, a flat wall, no bar.
    let (head, _) = text.split_once("    stations: [").unwrap();
    let stations: Vec<String> = ["-0.2", "-0.1", "0", "0.1", "0.2"]
        .iter()
        .enumerate()
        .map(|(k, x)| format!("(name: \"S{k}\", distance_m: 3.2, at_m: ({x}, {x}, 0))"))
        .collect();
    let head = head.replace("relief_m: 0.25", "relief_m: 0");
    std::fs::write(&scene, format!("{head}    stations: [{}],\n)", stations.join(","))).unwrap();
    calibration_tasks::simulate_network(&scene, None, &folder.path().join("survey")).unwrap();
    let error = calibrate(folder.path(), |_| {}).unwrap_err();
    assert!(matches!(error, pipeline::Error::Refused { .. }), "{error}");
    let json = summary_of(&folder.path().join("out"));
    assert_eq!(json["converged"], false);
    assert!(json["parameters"].as_object().unwrap().is_empty() && json["vtpv"].is_null());
    assert!(error.to_string().contains(json["diagnosis"][0].as_str().unwrap()));
    assert!(!folder.path().join("out/calibration.ron").exists() && !folder.path().join("out/report.html").exists());
}

#[test]
fn a_plan_promises_what_the_calibration_then_states() {
    for terms in [terms("xp yp c k1 k2 p1 p2 d0 d4 d5 d6 d7 e1 e2"), TermSelection::Auto] {
        assert_promised(terms);
    }
}

/// The plan of the target field, against its calibration with the same terms.
fn assert_promised(terms: TermSelection) {
    let folder = tempfile::tempdir().unwrap();
    let mut asked = request(&target_field(), &folder.path().join("out"));
    asked.options.terms = terms.clone();
    let options = PlanOptions { terms, ..PlanOptions::default() };
    // The truth stands for the planned places.
    let planned = changed(|survey| {
        for table in ["stations.csv", "targets.csv"] {
            std::fs::copy(survey.join("truth").join(table), survey.join(table)).unwrap();
        }
    });
    let plan = NetworkPlanRequest {
        survey: planned.path().join("survey"),
        calibration: Some(target_field().join("truth/calibration.ron")),
        options,
        out: folder.path().join("plan"),
    };
    let planned = calibration_tasks::plan_network(&plan, &Silent).unwrap();
    assert!(planned.accepted && !planned.candidates.is_empty());
    let summary = calibration_tasks::calibrate(&asked, &Silent).unwrap();
    for (name, parameter) in planned.parameters.0.iter().filter(|(_, parameter)| parameter.status == "estimated") {
        let ratio = summary.parameters.get(name).unwrap().sigma_prior / parameter.sigma_prior;
        // The ten rejected values of 1,986 were perhaps at a corner, where they count.
        assert!((0.95..1.1).contains(&ratio), "{name}: {ratio}");
    }
    let report = std::fs::read_to_string(folder.path().join("plan/report.html")).unwrap();
    assert!(report.contains("Further stations") && !report.contains("NaN"));
    // The report's map and the summary's mean propagate the same covariance in two ways.
    let mean = planned.point_sigma.iter().find(|point| (point.range_m - 2.0).abs() < 1e-9).unwrap().sigma_m;
    let median = report.split("At 2 m").last().unwrap().split("Median ").nth(1).unwrap();
    let median: f64 = median.split(' ').next().unwrap().parse().unwrap();
    assert!((1e3 * mean / median - 1.0).abs() < 0.1, "mean {mean} m, median {median} mm");
}

#[test]
fn a_spline_by_its_word_goes_into_the_file_and_comes_back() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("short_interval.ron");
    let text = std::fs::read_to_string(fixtures().join("networks/target_field.ron")).unwrap();
    // An ambiguity interval of 3.3 m, which ranges from 1.2 m to 4.5 m cover.
    std::fs::write(&scene, text.replace("20e6", "45e6")).unwrap();
    let survey = folder.path().join("survey");
    calibration_tasks::simulate_network(&scene, None, &survey).unwrap();
    let names = terms("xp yp c k1 k2 p1 p2 d0 spline12 e1 e2");
    let summary = calibrate(folder.path(), |request| request.options.terms = names).unwrap();

    let out = folder.path().join("out");
    let written = Calibration::read(&out).unwrap();
    let model = written.range_models[0].to_model().unwrap();
    assert_eq!(model.further.shape().spline_knots, Some(12));
    let json = summary_of(&out);
    for knot in 0..11 {
        let name = format!("s{knot}");
        let parameter = written.range_models[0].parameters.iter().find(|parameter| parameter.name == name).unwrap();
        let stated = summary.parameters.get(&name).unwrap();
        assert_eq!(parameter.status, ParameterStatus::Estimated, "{name}");
        assert_eq!(parameter.value.to_bits(), stated.value.to_bits(), "{name}");
        assert_eq!(parameter.sigma.to_bits(), stated.sigma_posterior.to_bits(), "{name}");
        assert!(parameter.sigma > 0.0 && json["parameters"][&name]["status"] == "estimated", "{name}");
        assert_eq!(json["parameters"][&name]["unit"], "m");
        assert!(written.correlation.as_ref().unwrap().between("d0", &name).is_some(), "{name}");
    }
    let again = folder.path().join("again");
    std::fs::create_dir(&again).unwrap();
    written.write(again.join(Calibration::FILE_NAME)).unwrap();
    assert_eq!(Calibration::read(&again).unwrap(), written);

    // The spline of the file is the periodic error of the truth.
    let truth = Calibration::read(survey.join("truth/calibration.ron")).unwrap().range_models[0].to_model().unwrap();
    let d0 = summary.parameters.get("d0").unwrap();
    for step in 0..=30 {
        let range_m = 1.3 + 0.1 * f64::from(step);
        let [found, expected] = [&model, &truth].map(|model| model.correction(range_m, 0.0, 0.0, f64::NAN).total_m());
        // Four deviations of the offset, which all corrections share, and 2 mm of a spline of noise 10 mm in 50 ranges a knot.
        assert!((found - expected).abs() < 4.0 * d0.sigma_prior + 0.002, "at {range_m} m: {found} {expected}");
        assert!(d0.sigma_prior < 0.003, "{}", d0.sigma_prior);
    }
    let refused = calibrate(folder.path(), |request| request.options.terms = terms("xp yp c d0 spline12 d6 d7"));
    let error = refused.unwrap_err().to_string();
    assert!(error.contains("`spline12`") && error.contains("`d6`"), "{error}");
}
