//! The repository's own tasks: `cargo xtask TASK`.

#![allow(clippy::print_stdout, clippy::print_stderr)]

mod alone;
mod bench;
mod benchmarks;
mod fixtures;
mod peers;
mod pipeline_task;
mod shell;
mod suites;
mod test;
mod tidy;
mod verify;
mod workflow;

use std::process::ExitCode;

use clap::Parser;

/// Tasks of the repository.
#[derive(Debug, Parser)]
#[command(name = "cargo xtask")]
enum Task {
    /// Run a pipeline of fixtures/pipelines by its name: `cargo xtask pipeline room`.
    Pipeline(pipeline_task::Arguments),
    /// Write the surveys of fixtures/surveys that are simulated from fixtures/networks.
    Fixtures,
    /// Everything that must be green: format, lints, tests, the small room.
    Test,
    /// Check the repository itself: READMEs, citations, lengths of files.
    Tidy,
    /// Compile each README's examples in a package that depends on that crate alone.
    Alone,
    /// Other programs beside ours on the same work: `cargo xtask peers adjust`.
    Peers(peers::Arguments),
    /// Long statistics, with the figures that docs/benchmarks.md states: `cargo xtask verify flags`.
    Verify(verify::Arguments),
    /// What a statistic says where constants are other ones: `cargo xtask sensitivity organised/search`.
    Sensitivity(verify::sensitivity::Arguments),
    /// Damaged files of every format against the readers, for some seconds.
    Fuzz(verify::fuzz::Arguments),
    /// An hour of damaged files, property tests with fresh cases, documentation, the long statistics, and cargo deny.
    Nightly(verify::nightly::Arguments),
    /// Run the benchmarks of all crates, or of those named; keep a run, or compare with one.
    Bench(bench::Arguments),
    /// The workflow of forty recordings with Snakemake, here and under Slurm, with jobs and controllers killed, byte for byte.
    Workflow(workflow::Arguments),
    /// Run statistics and write their tables into docs/benchmarks.md.
    Benchmarks(benchmarks::Arguments),
}

fn main() -> ExitCode {
    let outcome = match Task::parse() {
        Task::Pipeline(arguments) => return pipeline_task::run(&arguments),
        Task::Fixtures => fixtures::run(),
        Task::Test => test::run(),
        Task::Tidy => tidy::run(),
        Task::Alone => alone::run(),
        Task::Peers(arguments) => peers::run(&arguments),
        Task::Verify(arguments) => verify::run(&arguments),
        Task::Sensitivity(arguments) => verify::sensitivity::run(&arguments),
        Task::Fuzz(arguments) => verify::fuzz::run(&arguments),
        Task::Nightly(arguments) => verify::nightly::run(&arguments),
        Task::Bench(arguments) => bench::run(&arguments),
        Task::Workflow(arguments) => workflow::run(&arguments),
        Task::Benchmarks(arguments) => benchmarks::run(&arguments),
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(message) => {
            eprintln!("{message}");
            ExitCode::FAILURE
        }
    }
}
