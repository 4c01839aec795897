//! `cargo xtask fuzz [SECONDS]`: damaged files of every format against the readers.

use crate::shell::{Outcome, cargo};

/// How long, from which seed, and which reader.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// How long.
    #[arg(default_value_t = 60)]
    pub(crate) seconds: u64,
    /// Seed; default: one of the time, which is printed.
    #[arg(long)]
    pub(crate) seed: Option<u64>,
    /// The only target, such as `ply`; default: all.
    #[arg(long, requires = "seed")]
    pub(crate) target: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    let mut words: Vec<String> = vec![arguments.seconds.to_string()];
    words.extend(arguments.seed.map(|seed| seed.to_string()));
    words.extend(arguments.target.clone());
    let program = ["run", "--package", "calibration-tasks", "--all-features", "--example", "fuzz_readers", "--"];
    let all: Vec<&str> = program.into_iter().chain(words.iter().map(String::as_str)).collect();
    cargo(&all, &[])
}
