//! What the tests share: where fixtures and real captures are, and how a pipeline of the repository is run.

#![allow(dead_code, clippy::unwrap_used, clippy::print_stdout)]

use std::path::{Path, PathBuf};

use pipeline::{Plan, Result, RunRequest, Silent, SimulateSource, Summary, simulate};

/// The repository's fixtures.
pub fn fixtures() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../fixtures")
}

/// Whether a real capture lies beside the project; says so where it does not.
pub fn has_capture(name: &str) -> bool {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/real").join(name);
    let there = folder.is_dir();
    if !there {
        println!("skipped: {} is not there", folder.display());
    }
    there
}

/// A request for a pipeline of the repository that writes into `out`.
pub fn request(name: &str, out: &Path) -> RunRequest {
    let plan_path = fixtures().join("pipelines").join(name).with_extension("ron");
    RunRequest {
        plan: Plan::read(&plan_path).unwrap(),
        plan_path,
        survey: None,
        calibration: None,
        out: out.to_owned(),
    }
}

/// Runs a pipeline of the repository.
pub fn run(name: &str, out: &Path) -> Result<Summary> {
    pipeline::run(&request(name, out), &Silent)
}

/// A scene of the fixtures as a survey in `folder`, its stations announced where they are.
pub fn simulated(scene: &str, seed: u64, folder: &Path) -> PathBuf {
    simulated_from(&fixtures().join(format!("scenes/{scene}.ron")), seed, folder)
}

/// The same for a scene anywhere.
pub fn simulated_from(scene: &Path, seed: u64, folder: &Path) -> PathBuf {
    let source = SimulateSource {
        scene: scene.display().to_string(),
        seed,
        approximate_position_sigma_m: 0.0,
        approximate_attitude_sigma_deg: 0.0,
        gross_error_share: 0.0,
    };
    let out = folder.join(format!("{}{seed}", scene.file_stem().unwrap().to_string_lossy()));
    simulate(&source, Path::new(""), &out, &Silent).unwrap();
    out
}

/// A scene of the fixtures with some of its text changed, as a survey in `folder`.
pub fn simulated_with(scene: &str, change: [&str; 2], folder: &Path) -> PathBuf {
    let text = std::fs::read_to_string(fixtures().join(format!("scenes/{scene}.ron"))).unwrap();
    assert!(text.contains(change[0]), "{scene} has no {}", change[0]);
    let file = folder.join("changed.ron");
    std::fs::write(&file, text.replace(change[0], change[1])).unwrap();
    simulated_from(&file, 1, folder)
}
