//! `cargo xtask bench [CRATE ...]`: criterion benchmarks.

use crate::shell::{Outcome, cargo};

/// Which crates to measure.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Crates; all where none is named.
    crates: Vec<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let mut line = vec!["bench", "--benches"];
    if arguments.crates.is_empty() {
        line.push("--workspace");
    }
    for name in &arguments.crates {
        line.extend(["--package", name]);
    }
    cargo(&line, &[])
}
