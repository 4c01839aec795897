//! `cargo xtask nightly [MINUTES]`: what takes too long or needs chance: damaged files with a fresh seed, property tests
//! with fresh cases, `adjust` without its default features, links of the documentation, each crate alone, the long statistics, the oldest compiler that is promised and
//! `cargo deny` where they are installed.

use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

use crate::alone;
use crate::shell::{Outcome, cargo, root};
use crate::test;
use crate::tidy::dependencies;
use crate::verify::{self, fuzz};

/// What to run, and how long.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Minutes of damaged files.
    #[arg(default_value_t = 60)]
    minutes: u64,
    /// Seed of the property tests, and of the damaged files; default: the time.
    #[arg(long)]
    seed: Option<u64>,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let seed = arguments.seed.map_or_else(seed_of_the_time, Ok)?;
    println!("── seed {seed}: `cargo xtask nightly {} --seed {seed}` does the same again", arguments.minutes);
    // One failure must not hide the others: a night is long enough for all of them.
    let outcomes = [
        fuzz::run(&fuzz::Arguments { seconds: 60 * arguments.minutes, seed: Some(seed), target: None }),
        cargo(&["test", "--workspace", "--all-features"], &[("PROPTEST_RNG_SEED", &seed.to_string())]),
        cargo(&["test", "-p", "dense-matrices", "-p", "adjust", "--no-default-features"], &[]),
        test::documentation(),
        alone::run(),
        verify::run(&verify::Arguments::all()),
        oldest_compiler(),
        deny(),
    ];
    let failures: Vec<String> = outcomes.into_iter().filter_map(Result::err).collect();
    if failures.is_empty() { Ok(()) } else { Err(failures.join("\n")) }
}

fn seed_of_the_time() -> Result<u64, String> {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).map_err(|error| error.to_string())?;
    Ok(since.as_secs())
}

/// Checks the workspace with the oldest compiler that it promises, where that is installed.
fn oldest_compiler() -> Outcome {
    let version = dependencies::rust_version(&root())?;
    let with = |toolchain: &str, arguments: &[&str]| {
        let mut command = Command::new("rustup");
        command.args(["run", toolchain]).args(arguments).current_dir(root());
        command
    };
    let answers = |toolchain: &String| {
        with(toolchain, &["rustc", "--version"]).output().is_ok_and(|output| output.status.success())
    };
    let Some(toolchain) = [version.clone(), format!("{version}.0")].into_iter().find(answers) else {
        println!("── Rust {version} is not installed: it was not tried (rustup toolchain install {version})");
        return Ok(());
    };
    println!("── cargo check with Rust {toolchain}");
    let status = with(&toolchain, &["cargo", "check", "--workspace", "--all-features"]).status();
    let status = status.map_err(|error| format!("rustup: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("cargo check with Rust {toolchain}: {status}")) }
}

/// Advisories need a database that is fetched; `cargo xtask tidy` checks licences and duplicates without it.
fn deny() -> Outcome {
    let installed = Command::new("cargo-deny").arg("--version").output().is_ok_and(|output| output.status.success());
    if !installed {
        println!("── cargo deny is not installed: advisories were not checked (cargo install cargo-deny)");
        return Ok(());
    }
    println!("── cargo deny check");
    let status = Command::new("cargo-deny").arg("check").current_dir(root()).status();
    let status = status.map_err(|error| format!("cargo deny: {error}"))?;
    if status.success() { Ok(()) } else { Err(format!("cargo deny check: {status}")) }
}
