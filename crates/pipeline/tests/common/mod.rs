//! What the tests share: where fixtures and real captures are, and how a pipeline of the repository is run.

#![allow(dead_code, clippy::unwrap_used, clippy::print_stdout)]

pub mod calibration;

use std::path::{Path, PathBuf};

use pipeline::{Plan, Result, RunRequest, Silent, Summary};

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
