//! How often `check` is right over many surveys of a simulated scene, and whether what surfaces tell errs as stated: each survey is checked
//! against the true calibration, and against the true one with d0 moved. No clouds are made, so that hundreds take minutes.
//!
//! `cargo run --release -p calibration-tasks --example checks [SURVEYS] [SCENE.ron] [FIRST_SEED]`
#![allow(clippy::print_stdout, clippy::unwrap_used, missing_docs)]

use std::path::{Path, PathBuf};

use calibration_tasks::pipeline::{Error, Silent, SimulateSource, simulate};
use calibration_tasks::{CalibrationCheck, CheckRequest, check};
use range_io::calibration::Calibration;

/// Level of the checks.
const LEVEL: f64 = 0.05;
const TOLERANCE_M: f64 = 0.001;
/// By what d0 is moved.
const MOVED_M: f64 = 0.005;

/// Standardised errors of the terms of one survey, by name.
type Errors = Vec<(String, f64)>;

fn main() {
    let mut words = std::env::args().skip(1);
    let surveys: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(20);
    let fixtures = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures");
    let scene = words.next().map_or(fixtures.join("scenes/room_small.ron"), PathBuf::from);
    let first: u64 = words.next().and_then(|word| word.parse().ok()).unwrap_or(1);
    let (mut ratios, mut errors, mut called, mut found, mut refused) = (Vec::new(), Vec::new(), 0, 0, 0);
    println!("survey  chi2/dof, true  p, true  p, moved");
    for seed in first..first + surveys {
        let work = tempfile::tempdir().unwrap();
        let [of_true, of_moved] = match checks(seed, &scene, work.path()) {
            Ok(both) => both,
            Err(error) => {
                println!("{seed:>6} {error}");
                refused += 1;
                continue;
            }
        };
        let [on_true, on_moved] = [&of_true, &of_moved].map(|check| check.difference.joint.as_ref().unwrap());
        let ratio = on_true.chi_squared / on_true.degrees as f64;
        println!("{seed:>6} {ratio:>15.2} {:>8.4} {:>9.1e}", on_true.p_value, on_moved.p_value);
        ratios.push(ratio);
        errors.push(standardised(&of_true));
        called += u32::from(of_true.moved);
        found += u32::from(of_moved.moved);
    }
    let (ratio, of_ratio) = mean(&ratios);
    println!("\nsquared error over variance of all terms together: {ratio:.3} +- {of_ratio:.3} (1 expected)");
    of_terms(&errors);
    let count = ratios.len();
    println!("the true calibration called moved at a level of {LEVEL}: {called} of {count}");
    println!("d0 moved by {} mm found: {found} of {count}", 1e3 * MOVED_M);
    println!("surveys that are refused, in no figure: {refused}");
}

/// Checks of a survey against the true calibration, and against it with d0 moved.
fn checks(seed: u64, scene: &Path, work: &Path) -> Result<[CalibrationCheck; 2], Error> {
    let survey = work.join("survey");
    let source = SimulateSource {
        scene: scene.display().to_string(),
        seed,
        approximate_position_sigma_m: 0.05,
        approximate_attitude_sigma_deg: 2.0,
        gross_error_share: 0.0,
    };
    simulate(&source, Path::new(""), &survey, &Silent)?;
    let truth = survey.join("truth/calibration.ron");
    let mut moved = Calibration::read(&truth).unwrap();
    let d0 = moved.range_models[0].parameters.iter_mut().find(|parameter| parameter.name == "d0").unwrap();
    d0.value += MOVED_M;
    moved.write(work.join("moved.ron")).unwrap();
    let checked = |calibration: PathBuf| {
        let (survey, calibration) = (survey.clone(), Some(calibration));
        check(&CheckRequest { survey, calibration, level: LEVEL, tolerance_m: TOLERANCE_M }, &Silent)
    };
    Ok([checked(truth)?, checked(work.join("moved.ron"))?])
}

fn standardised(check: &CalibrationCheck) -> Errors {
    let terms = check.difference.parameters.iter().filter(|term| term.sigma > 0.0);
    terms.map(|term| (term.name.clone(), term.difference / term.sigma)).collect()
}

/// Mean and its standard deviation.
fn mean(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let square = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (square / n).sqrt())
}

fn of_terms(all: &[Errors]) {
    println!("  term  mean error, sigmas  squared error over variance");
    let mut names: Vec<&String> = Vec::new();
    for (name, _) in all.iter().flatten() {
        if !names.contains(&name) {
            names.push(name);
        }
    }
    for name in names {
        let errors: Vec<f64> = all.iter().flatten().filter(|term| term.0 == *name).map(|term| term.1).collect();
        let squares = errors.iter().map(|error| error * error).sum::<f64>() / errors.len() as f64;
        println!("{name:>6} {:>19.2} {squares:>28.2}", mean(&errors).0);
    }
}
