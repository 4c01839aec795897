//! Calibration from surfaces over many surveys of the small room: what it leaves of the ranges' errors beside the true calibration,
//! whether its covariance is true, and how often `check` is right.
//!
//! `cargo run --release -p calibration-tasks --example on_the_job [SURVEYS] [SCENE.ron]`
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use std::path::{Path, PathBuf};

use calibration_tasks::pipeline::{Silent, SimulateSource, Stage, simulate};
use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationCheck, CalibrationOptions, CertificateRequest, CheckRequest,
    OffsetModel, TableDefaults, TermSelection, calibrate, check,
};
use commands::plan::DriftTreatment;
use pipeline::{Plan, RunRequest, run};
use range_io::calibration::Calibration;

/// Level of the checks.
const LEVEL: f64 = 0.05;
const TOLERANCE_M: f64 = 0.001;
/// By what d0 is moved.
const MOVED_M: f64 = 0.005;

fn main() {
    let mut words = std::env::args().skip(1);
    let surveys: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(20);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let scene = words.next().map_or(fixtures.join("scenes/room_small.ron"), PathBuf::from);
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let plan = corrected(&fixtures);
    let mut last: Option<PathBuf> = None;
    let (mut ratios, mut squares, mut alarms, mut found) = (Vec::new(), Vec::new(), [0, 0, 0], [0, 0]);
    println!(
        "{:>6} {:>9} {:>9} {:>13} {:>11} {:>11}",
        "survey", "own, mm", "true, mm", "chi2/dof true", "p, earlier", "p, moved"
    );
    for seed in 1..=surveys {
        let survey = at(&format!("survey{seed}"));
        let source = SimulateSource {
            scene: scene.display().to_string(),
            seed,
            approximate_position_sigma_m: 0.05,
            approximate_attitude_sigma_deg: 2.0,
            gross_error_share: 0.0,
        };
        simulate(&source, Path::new(""), &survey, &Silent).unwrap();
        let truth = survey.join("truth/calibration.ron");
        let mut lens = Calibration::read(&truth).unwrap();
        lens.range_models.clear();
        lens.write(at("lens.ron")).unwrap();
        let own = at(&format!("own{seed}"));
        calibrate(&request(&survey, &at("lens.ron"), &own), &Silent).unwrap();
        let median = |calibration: &Path| {
            let request = RunRequest {
                plan: plan.clone(),
                plan_path: at("plan.ron"),
                survey: Some(survey.clone()),
                calibration: Some(calibration.to_owned()),
                out: at("out"),
            };
            run(&request, &Silent).unwrap().truth.unwrap().ranges.range_error_median_m
        };
        let medians = [median(&own.join("calibration.ron")), median(&truth)];
        ratios.push(medians[0] / medians[1]);
        let of_truth = checked(&survey, &truth);
        let joint = of_truth.difference.joint.as_ref().unwrap();
        squares.push(joint.chi_squared / joint.degrees as f64);
        let (mut of_earlier, mut of_moved) = (f64::NAN, f64::NAN);
        if let Some(last) = &last {
            let earlier = checked(&survey, last);
            of_earlier = p_value(&earlier);
            let counts = [true, earlier.moved, earlier.matters];
            alarms.iter_mut().zip(counts).for_each(|(count, counts)| *count += u32::from(counts));
            let mut moved = Calibration::read(last).unwrap();
            let d0 = moved.range_models[0].parameters.iter_mut().find(|parameter| parameter.name == "d0").unwrap();
            d0.value += MOVED_M;
            moved.write(at("moved.ron")).unwrap();
            let moved = checked(&survey, &at("moved.ron"));
            of_moved = p_value(&moved);
            found.iter_mut().zip([true, moved.matters]).for_each(|(count, counts)| *count += u32::from(counts));
        }
        println!(
            "{seed:>6} {:>9.3} {:>9.3} {:>13.2} {of_earlier:>11.4} {of_moved:>11.1e}",
            1e3 * medians[0],
            1e3 * medians[1],
            squares.last().unwrap()
        );
        last = Some(own.join("calibration.ron"));
        std::fs::remove_dir_all(&survey).unwrap();
    }
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    println!("median error with own over true calibration: mean {:.3}, largest {:.3}", mean(&ratios), largest(&ratios));
    println!("squared error over variance of all terms against the truth: {:.2} (1 expected)", mean(&squares));
    let [checks, moved, matters] = alarms;
    println!(
        "checks of an earlier survey's calibration: {checks}; moved at {LEVEL}: {moved}, and by what matters: {matters}"
    );
    println!("the same with d0 moved by {} mm: {}, found {}", 1e3 * MOVED_M, found[0], found[1]);
}

fn largest(values: &[f64]) -> f64 {
    values.iter().copied().fold(f64::NEG_INFINITY, f64::max)
}

fn p_value(check: &CalibrationCheck) -> f64 {
    check.difference.joint.as_ref().map_or(f64::NAN, |joint| joint.p_value)
}

/// The room's pipeline up to flagged, corrected points.
fn corrected(fixtures: &Path) -> Plan {
    let mut plan = Plan::read(&fixtures.join("pipelines/room_small.ron")).unwrap();
    plan.source = None;
    plan.stages.retain(|stage| !matches!(stage, Stage::Register(_) | Stage::Adjust(_)));
    plan
}

fn request(survey: &Path, lens: &Path, out: &Path) -> CalibrateRequest {
    CalibrateRequest {
        survey: survey.to_owned(),
        lens_survey: None,
        calibration: Some(lens.to_owned()),
        method: CalibrateMethod::Surfaces,
        options: CalibrationOptions { terms: TermSelection::Auto, ..CalibrationOptions::default() },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: out.to_owned(),
    }
}

fn checked(survey: &Path, calibration: &Path) -> CalibrationCheck {
    let (survey, calibration) = (survey.to_owned(), Some(calibration.to_owned()));
    check(&CheckRequest { survey, calibration, level: LEVEL, tolerance_m: TOLERANCE_M }, &Silent).unwrap()
}
