//! A camera that drifts while it warms up, from the simulation to points: by its calibration, and by its own reference.

use std::path::{Path, PathBuf};

use error_models::WarmUp;
use nalgebra::{DMatrix, DVector};
use pipeline::{DriftSource, Plan, Processed, Silent, View, ViewData, ViewDrift, process};
use rand_distr::{Distribution, StandardNormal};
use rand_pcg::Pcg64;
use range_image::Flags;
use range_io::calibration::{CalibratedDrift, Calibration, Correlation};
use range_io::survey::Survey;
use tasks::{ExplainRequest, explain};

use crate::common::simulated_from;

/// A wall two metres away, seen by a camera that was switched on a minute before the first of four frames.
const WALL: &str = "(
    scene: (objects: [(name: \"wall\", shape: Rectangle(corner_m: (-6.0, -5.0, 0.0), edge_u_m: (12.0, 0.0, 0.0),
        edge_v_m: (0.0, 10.0, 0.0)), albedo: 0.8)]),
    camera: (geometry: (format: (width: 32, height: 24, pixel_pitch_mm: (0.2, 0.2)),
        interior: (principal_point_mm: (0.0, 0.0), principal_distance_mm: 8.0)), modulation_hz: [30.0e6], /*camera*/),
    illumination: (source_power: 8.0e6, ambient_power: 5.0e4),
    exposure: (frames_per_station: 4, integration_time_s: 0.002, frame_interval_s: 300.0, start_s: 1060.0,
        power_on_s: 1000.0, /*exposure*/),
    stations: [(name: \"A\", position_m: (0.0, 0.0, 2.0),
        attitude: Euler(omega_deg: 0.0, phi_deg: 0.0, kappa_deg: 0.0))],
    errors: (/*errors*/ noise: (shot_variance_per_unit: 0.025, dark_sigma: 2.0)),
)";

const DRIFT: &str = "warm_up: (transients: [(amplitude_m: 0.03, time_constant_s: 600.0)]),";

const RANGE: &str = "range: [(ambiguity_interval_m: 4.996540966666667,
    terms: (d0: 0.010, periodic: (0.0, 0.0, 0.0, 0.0, 0.008, -0.005), e1: 1.0e-3, e2: 0.0))],";

/// The wall as a survey in `folder`.
fn survey(folder: &Path, camera: &str, exposure: &str, errors: &str) -> PathBuf {
    let text = WALL.replace("/*camera*/", camera).replace("/*exposure*/", exposure).replace("/*errors*/", errors);
    let scene = folder.join("wall.ron");
    std::fs::write(&scene, text).unwrap();
    simulated_from(&scene, 5, folder)
}

fn run(survey: &Path, stages: &str) -> pipeline::Result<Processed> {
    let plan = Plan::from_ron(&format!("(name: \"x\", stages: [{stages}])"), Path::new("x.ron"))?;
    process(&plan, survey, None, &Silent)
}

const EACH_FRAME: &str = "Demodulate(), Unwrap(), CorrectRange(), CorrectImagePoint(), PointCloud()";

fn drift(view: &View) -> Option<&ViewDrift> {
    view.correction.as_ref().unwrap().drift()
}

/// Mean error of the ranges of a view, and four times the deviation that its noise leaves of it, metre.
fn error(view: &View) -> (f64, f64) {
    let ViewData::Range(frame) = &view.data else { unreachable!("ranges at the end") };
    let truth = &view.truth.as_ref().unwrap().range;
    let known = frame.range.as_slice().iter().zip(truth.as_slice()).zip(frame.sigma.as_slice());
    let known = known.filter(|((range, truth), _)| range.is_finite() && truth.is_finite());
    let (mut sum, mut variance, mut count) = (0.0, 0.0, 0.0);
    for ((range, truth), sigma) in known {
        sum += f64::from(*range) - f64::from(*truth);
        variance += f64::from(*sigma).powi(2);
        count += 1.0;
    }
    (sum / count, 4.0 * f64::sqrt(variance) / count)
}

fn edit_calibration(survey: &Path, change: impl FnOnce(&mut Calibration)) {
    let file = survey.join("calibration.ron");
    let mut calibration = Calibration::read(&file).unwrap();
    change(&mut calibration);
    calibration.write(&file).unwrap();
}

fn edit_survey(survey: &Path, change: impl FnOnce(&mut Survey)) {
    let mut read = Survey::read(survey).unwrap();
    change(&mut read);
    read.write(survey.join(Survey::FILE_NAME)).unwrap();
}

#[test]
fn the_calibrated_drift_is_taken_off_and_stays_where_it_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), "", "", &format!("{RANGE} {DRIFT}"));
    let (corrected, left) = (
        run(&survey, EACH_FRAME).unwrap(),
        run(&survey, &EACH_FRAME.replace("CorrectRange()", "CorrectRange(warm_up: leave)")),
    );
    for ((view, left), time_s) in corrected.views.iter().zip(&left.unwrap().views).zip([60.0, 360.0, 660.0, 960.0]) {
        let expected = 0.03 * f64::exp(-time_s / 600.0);
        let found = drift(view).unwrap();
        assert!((found.drift_m - expected).abs() < 1e-12 && found.source == DriftSource::Calibration);
        let ((off, bar), (off_left, bar_left)) = (error(view), error(left));
        println!(
            "{time_s} s: drift {:.2} mm, off by {:.3} mm, left {:.3} mm, bar {:.3} mm",
            1e3 * expected,
            1e3 * off,
            1e3 * off_left,
            1e3 * bar
        );
        assert!(bar < 1e-3 && off.abs() < bar, "{off} m at {time_s} s, noise explains {bar}");
        assert!((off_left - expected).abs() < bar_left, "{off_left} m at {time_s} s, the drift is {expected}");
        assert!(drift(left).is_none());
    }
    let stage = corrected.stages.iter().find(|stage| stage.name == "CorrectRange").unwrap();
    assert!((stage.findings["drift_m"] - 0.014_913).abs() < 1e-6, "{:?}", stage.findings);
}

/// Standard deviation of the mean drift at some times and temperatures, over parameters drawn by their covariance.
fn sampled_sigma(model: &WarmUp, covariance: &DMatrix<f64>, times: &[(Option<f64>, Option<f64>)]) -> f64 {
    let factor = covariance.clone().cholesky().unwrap().l();
    let mean = |model: &WarmUp| -> f64 {
        let values = times.iter().map(|(time_s, temperature_c)| model.value(*time_s, *temperature_c).unwrap());
        values.sum::<f64>() / times.len() as f64
    };
    let (centre, runs, mut generator) = (mean(model), 20_000, Pcg64::new(4, 0));
    let mut draw = || {
        let step: DVector<f64> = &factor * DVector::from_fn(3, |_, _| StandardNormal.sample(&mut generator));
        let mut drawn = model.clone();
        drawn.transients[0].amplitude_m += step[0];
        drawn.transients[0].time_constant_s += step[1];
        drawn.temperature.as_mut().unwrap().coefficient_m_per_k += step[2];
        (mean(&drawn) - centre).powi(2)
    };
    ((0..runs).map(|_| draw()).sum::<f64>() / f64::from(runs)).sqrt()
}

#[test]
fn a_mean_of_frames_has_the_mean_of_their_drifts() {
    let folder = tempfile::tempdir().unwrap();
    let warm_up = "warm_up: (transients: [(amplitude_m: 0.03, time_constant_s: 600.0)],
        temperature: (coefficient_m_per_k: 0.0008, reference_c: 36.0)),";
    let temperature = "temperature: (cold_c: 22.0, warm_c: 36.0, time_constant_s: 900.0),";
    let survey = survey(folder.path(), "", temperature, warm_up);
    // Known to some percent, the amplitude against the time constant.
    let (deviations, names) = (vec![0.0006, 20.0, 0.00004], ["A1", "tau1", "cT"].map(str::to_owned).to_vec());
    let matrix = vec![vec![1.0, -0.7, 0.0], vec![-0.7, 1.0, 0.3], vec![0.0, 0.3, 1.0]];
    let correlation = Some(Correlation { names, matrix });
    edit_calibration(&survey, |calibration| {
        let model = calibration.warm_up.as_ref().unwrap().model.clone();
        calibration.warm_up = Some(CalibratedDrift { model, deviations, correlation });
    });
    let calibrated = Calibration::read(&survey).unwrap().warm_up.unwrap();
    let (model, covariance): (&WarmUp, _) = (&calibrated.model, calibrated.covariance().unwrap());
    let frames = Survey::read(&survey).unwrap().frames;
    let (mut mean_m, mut sigmas) = (0.0, Vec::new());
    let single = run(&survey, EACH_FRAME).unwrap();
    for (frame, view) in frames.iter().zip(&single.views) {
        let time_s = frame.timestamp_s.unwrap() - 1000.0;
        let temperature_c = 36.0 - 14.0 * f64::exp(-time_s / 900.0);
        // Decimal digits of a file.
        assert!((frame.temperature_c.unwrap() - temperature_c).abs() < 1e-9);
        let (time_s, temperature_c) = (Some(time_s), frame.temperature_c);
        let value = model.value(time_s, temperature_c).unwrap();
        let sigma = model.sigma_m(time_s, temperature_c, &covariance).unwrap();
        let found = drift(view).unwrap();
        assert!((found.drift_m - value).abs() < 1e-12 && (found.sigma_m - sigma).abs() < 1e-12, "{found:?}");
        mean_m += value / 4.0;
        sigmas.push(sigma);
        let (off, bar) = error(view);
        assert!(off.abs() < bar, "{off} m, noise explains {bar}");
    }
    let mean = run(&survey, &EACH_FRAME.replace("Unwrap()", "Average(), Unwrap()")).unwrap();
    let found = drift(&mean.views[0]).unwrap();
    assert!((found.drift_m - mean_m).abs() < 1e-12, "{found:?} instead of {mean_m}");
    let times: Vec<_> =
        frames.iter().map(|frame| (Some(frame.timestamp_s.unwrap() - 1000.0), frame.temperature_c)).collect();
    let sampled = sampled_sigma(model, &covariance, &times);
    // The deviation of 20 000 draws is known to 0.5 %; the curvature in tau adds less than that.
    assert!((found.sigma_m / sampled - 1.0).abs() < 0.02, "{found:?}, sampled {sampled}");
    // One parameter's error is the same in all frames: independent errors would be half of this.
    let single = sigmas.iter().map(|sigma| sigma * sigma).sum::<f64>().sqrt() / 4.0;
    assert!(found.sigma_m > 1.2 * single, "{found:?}, single {sigmas:?}");
    let (off, bar) = error(&mean.views[0]);
    assert!(off.abs() < bar, "{off} m, noise explains {bar}");
}

const REFERENCE: &str = "reference_path: (columns: (28, 31), rows: (0, 5), length_m: 0.75, power: 1.0e6),";

#[test]
fn an_optical_reference_shows_the_drift_without_any_curve() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), REFERENCE, "", &format!("{RANGE} {DRIFT}"));
    edit_calibration(&survey, |calibration| calibration.warm_up = None);
    let outcome = run(&survey, EACH_FRAME).unwrap();
    for (view, time_s) in outcome.views.iter().zip([60.0, 360.0, 660.0, 960.0]) {
        let cloud = view.cloud.as_ref().unwrap();
        let (expected, found) = (0.03 * f64::exp(-time_s / 600.0), drift(view).unwrap());
        println!(
            "{time_s} s: drift {:.2} mm, found {:.2} mm +- {:.2} mm",
            1e3 * expected,
            1e3 * found.drift_m,
            1e3 * found.sigma_m
        );
        assert!(found.source == DriftSource::ReferencePath && found.sigma_m < 2e-3);
        assert!((found.drift_m - expected).abs() < 4.0 * found.sigma_m, "{found:?} instead of {expected}");
        let (off, bar) = error(view);
        assert!(off.abs() < bar.hypot(4.0 * found.sigma_m), "{off} m, noise explains {bar}");
        // Its pixels are no part of the scene.
        let ViewData::Range(frame) = &view.data else { unreachable!("ranges at the end") };
        assert!(frame.range[(28, 0)].is_nan() && frame.flags[(31, 5)].contains(Flags::NO_DATA));
        assert_eq!(cloud.valid_count(), 32 * 24 - 24);
    }
    // Pixels that show something else do not matter as long as they are few.
    edit_survey(&survey, |survey| survey.reference_path.as_mut().unwrap().rows = [0, 6]);
    let robust = run(&survey, EACH_FRAME).unwrap();
    let (one, other) = (drift(&outcome.views[0]).unwrap(), drift(&robust.views[0]).unwrap());
    assert!((one.drift_m - other.drift_m).abs() < one.sigma_m, "{one:?} {other:?}");
    edit_survey(&survey, |survey| {
        let path = survey.reference_path.as_mut().unwrap();
        (path.columns, path.rows) = ([28, 30], [0, 0]);
    });
    let message = run(&survey, EACH_FRAME).unwrap_err().to_string();
    assert!(message.contains("of the 3 pixels of `reference_path` can be used"), "{message}");
}

#[test]
fn what_is_not_known_of_the_drift_is_named_with_a_way_out() {
    let folder = tempfile::tempdir().unwrap();
    let temperature = "temperature: (cold_c: 22.0, warm_c: 36.0, time_constant_s: 900.0),";
    let warm_up = "warm_up: (transients: [(amplitude_m: 0.03, time_constant_s: 600.0)],
        temperature: (coefficient_m_per_k: 0.0008, reference_c: 36.0)),";
    let survey = survey(folder.path(), "", temperature, warm_up);
    let whole = Survey::read(&survey).unwrap();
    let way_out = "leave the drift in the ranges by `CorrectRange(warm_up: leave)`";
    let refused = |expected: &str| {
        let message = run(&survey, EACH_FRAME).unwrap_err().to_string();
        assert!(message.contains(expected) && message.contains(way_out), "{message}\nexpected {expected}");
        assert!(run(&survey, &EACH_FRAME.replace("CorrectRange()", "CorrectRange(warm_up: leave)")).is_ok());
    };
    edit_survey(&survey, |survey| survey.power_on_s = None);
    refused("depends on the time since power-on, and survey.ron has no `power_on_s`");
    edit_survey(&survey, |survey| {
        survey.power_on_s = whole.power_on_s;
        survey.frames[2].timestamp_s = None;
    });
    refused(
        "station A, frame 2: the calibrated drift depends on the time since power-on, and survey.ron has no `frames[2].timestamp_s`",
    );
    edit_survey(&survey, |survey| {
        survey.frames.clone_from(&whole.frames);
        survey.frames[1].temperature_c = None;
    });
    refused("depends on the camera's temperature, and survey.ron has no `frames[1].temperature_c`");
    edit_survey(&survey, |survey| survey.frames[1].temperature_c = whole.frames[1].temperature_c);
    edit_calibration(&survey, |calibration| {
        calibration.warm_up.as_mut().unwrap().model.time_span_s = Some([100.0, 500.0]);
    });
    refused("the drift is not known at a time since power-on of 60 s: it was fitted from 100 to 500 s");
}

#[test]
fn the_drift_is_a_line_of_a_pixels_ledger() {
    let folder = tempfile::tempdir().unwrap();
    let survey = survey(folder.path(), REFERENCE, "", &format!("{RANGE} {DRIFT}"));
    let ask = |pixel| {
        let plan = Plan::from_ron(&format!("(name: \"x\", stages: [{EACH_FRAME}])"), Path::new("x.ron")).unwrap();
        let request =
            ExplainRequest { survey: survey.clone(), frame: "1".into(), pixel, plan: Some(plan), calibration: None };
        explain(&request, &Silent).unwrap()
    };
    let found = ask([10, 12]);
    println!("{found}");
    let line = found.stages.iter().find(|line| line.stage == "CorrectRange").unwrap();
    let part = line.parts.iter().find(|part| part.group == "warm-up").unwrap();
    assert!(part.what.starts_with("drift of the warming camera (sigma "), "{}", part.what);
    assert!((part.change_m + 0.03 * f64::exp(-0.6)).abs() < 2e-3, "{}", part.change_m);
    let sum: f64 = line.parts.iter().map(|part| part.change_m).sum();
    // Ranges of two metres in single precision.
    assert!((sum - line.change_m.unwrap()).abs() < 1e-6, "{sum} {:?}", line.change_m);
    let reference = ask([30, 2]);
    assert!(reference.flags.iter().any(|flag| flag.reason == "it sees the camera's optical reference"), "{reference}");
}

#[test]
fn ranges_at_an_integration_time_between_two_models_are_corrected() {
    let folder = tempfile::tempdir().unwrap();
    let of = |d0: f64, d4: f64| {
        format!(
            "[(ambiguity_interval_m: 4.996540966666667, terms: (d0: {d0}, periodic: (0.0, 0.0, {d4}, 0.0, 0.0, 0.0)))]"
        )
    };
    let models = format!("[(0.001, {}), (0.004, {})]", of(0.01, 0.012), of(0.04, -0.006));
    let errors = format!("range_by_integration_time: (entries: {models}), {DRIFT}");
    let survey = survey(folder.path(), "", "further_integration_times_s: [0.001, 0.003, 0.004],", &errors);
    let outcome = run(&survey, EACH_FRAME).unwrap();
    assert_eq!(outcome.views.len(), 16);
    for view in &outcome.views {
        let ((off, bar), time_s) = (error(view), view.integration_time_s.unwrap());
        assert!(bar < 1e-3 && off.abs() < bar, "{off} m at {time_s} s, noise explains {bar}");
    }
    // At 2 ms d0 is half way, in the logarithm of the time: 25 mm; neither model alone would do.
    let record = outcome.views[0].correction.as_ref().unwrap();
    assert!(record.drift().is_some());
    edit_calibration(&survey, |calibration| calibration.range_models.truncate(1));
    let message = run(&survey, EACH_FRAME).unwrap_err().to_string();
    assert!(message.contains("0.002"), "{message}");
}
