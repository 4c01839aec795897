//! Calling cargo and `rangecam`, and where the repository is.

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, ExitStatus, Stdio};
use std::time::Instant;

/// What a task says when it fails.
pub(crate) type Outcome = Result<(), String>;

/// The repository's root.
pub(crate) fn root() -> PathBuf {
    // This package lies directly below the root.
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap_or(Path::new(".")).to_owned()
}

/// Runs cargo in the root, says what it runs and how long it took.
pub(crate) fn cargo(arguments: &[&str], environment: &[(&str, &str)]) -> Outcome {
    let line = format!("cargo {}", arguments.join(" "));
    println!("── {line}");
    let start = Instant::now();
    let outcome = cargo_quietly(arguments, environment);
    println!("── {:.0} s", start.elapsed().as_secs_f64());
    outcome
}

/// Runs cargo in the root without saying so.
pub(crate) fn cargo_quietly(arguments: &[&str], environment: &[(&str, &str)]) -> Outcome {
    let line = format!("cargo {}", arguments.join(" "));
    let status = Command::new(program())
        .args(arguments)
        .envs(environment.iter().copied())
        .current_dir(root())
        .status()
        .map_err(|error| format!("{line}: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("{line}: {status}")) }
}

/// Runs a line that begins with `cargo` in the root: what it prints, and how it ends.
pub(crate) fn captured(line: &str) -> Result<(String, Outcome), String> {
    let output = Command::new(program())
        .args(line.split_whitespace().skip(1))
        .current_dir(root())
        .stderr(Stdio::inherit())
        .output()
        .map_err(|error| format!("{line}: {error}"))?;
    let outcome = if output.status.success() { Ok(()) } else { Err(format!("{line}: {}", output.status)) };
    Ok((String::from_utf8_lossy(&output.stdout).into_owned(), outcome))
}

/// Builds the command `rangecam` with the commands of pipelines alone and runs it where the user stands; its exit code.
///
/// The tasks do not link it: those that only check the repository would wait until all of it is built.
pub(crate) fn rangecam(arguments: &[OsString]) -> Result<u8, String> {
    let status: ExitStatus = Command::new(program())
        .args(["run", "--package", "rangecam-cli", "--no-default-features", "--bin", "rangecam", "--manifest-path"])
        .arg(root().join("Cargo.toml"))
        .arg("--")
        .args(arguments)
        .status()
        .map_err(|error| format!("rangecam: {error}"))?;
    // What a signal ended has no code.
    Ok(status.code().and_then(|code| u8::try_from(code).ok()).unwrap_or(1))
}

/// The cargo that runs this task, so that its toolchain is used throughout.
fn program() -> OsString {
    std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}
