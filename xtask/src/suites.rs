//! The test programs of the workspace, several at a time.
//!
//! `cargo test` runs one after the other: most end with a single long test, while the other cores wait for it.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Instant;

use serde_json::Value;

use crate::shell::{Outcome, captured};

/// What builds them, and says where they are. With `--lib` beside it, libraries whose manifests say that they have no tests would be built too.
const BUILD: &str = "cargo test --workspace --all-features --tests --no-run --message-format json-render-diagnostics";

/// A program of tests, and the folder of its package, in which it runs.
struct Suite {
    program: PathBuf,
    package: PathBuf,
}

/// Builds all and runs as many at a time as there are cores; what each prints is printed when it has ended.
///
/// # Errors
/// The names of all that fail.
pub(crate) fn run() -> Outcome {
    println!("── {BUILD}");
    let start = Instant::now();
    let (messages, built) = captured(BUILD)?;
    built?;
    let suites: Vec<Suite> = messages.lines().filter_map(suite).collect();
    if suites.is_empty() {
        return Err(format!("{BUILD}: no program of tests was built"));
    }
    println!("── {:.0} s", start.elapsed().as_secs_f64());
    let start = Instant::now();
    println!("── {} programs of tests", suites.len());
    let (next, failed) = (AtomicUsize::new(0), Mutex::new(Vec::new()));
    std::thread::scope(|scope| {
        for _ in 0..std::thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while let Some(suite) = suites.get(next.fetch_add(1, Ordering::Relaxed)) {
                    if let Err(message) = suite.run() {
                        failed.lock().unwrap_or_else(std::sync::PoisonError::into_inner).push(message);
                    }
                }
            });
        }
    });
    println!("── {:.0} s", start.elapsed().as_secs_f64());
    let failed = failed.into_inner().unwrap_or_else(std::sync::PoisonError::into_inner);
    if failed.is_empty() { Ok(()) } else { Err(failed.join("\n")) }
}

/// The program that a message of cargo names, where it is one of tests.
fn suite(message: &str) -> Option<Suite> {
    let message: Value = serde_json::from_str(message).ok()?;
    let is_test = message["profile"]["test"].as_bool()?;
    let program = message["executable"].as_str().filter(|_| is_test)?;
    let package = Path::new(message["manifest_path"].as_str()?).parent()?;
    Some(Suite { program: program.into(), package: package.to_owned() })
}

impl Suite {
    fn run(&self) -> Outcome {
        let name = self.program.display();
        let output = Command::new(&self.program)
            .current_dir(&self.package)
            .env("CARGO_MANIFEST_DIR", &self.package)
            .output()
            .map_err(|error| format!("{name}: {error}"))?;
        let [said, wrong] = [&output.stdout, &output.stderr].map(|bytes| String::from_utf8_lossy(bytes));
        println!("     Running {name}\n{said}{wrong}");
        if output.status.success() { Ok(()) } else { Err(format!("{name}: {}", output.status)) }
    }
}
