//! Each command of pipelines: arguments to one call of `pipeline`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use pipeline::{Part, Plan, RunRequest, SimulateSource};

use crate::arguments::Command;
#[cfg(feature = "every-command")]
use crate::further_commands;
use crate::output::Output;
use crate::requests::fleet::merge_arguments::MergeArguments;

pub(crate) type Outcome = Result<ExitCode, Box<dyn Error>>;

/// Runs a command; what the shell sees where it does not fail.
pub(crate) fn dispatch(command: Command, threads: Option<usize>, output: &Output) -> Outcome {
    match command {
        Command::Run { survey, pipeline, calibration, shard, out } => {
            run((survey, calibration), &pipeline, shard, out, output)
        }
        Command::Merge(MergeArguments { parts, out }) => {
            output.result(&pipeline::merge(&parts, &out, output.progress().as_ref())?)
        }
        Command::Simulate { scene, seed, position_sigma, attitude_sigma, gross_errors, out } => {
            let source = SimulateSource {
                scene: scene.display().to_string(),
                seed,
                approximate_position_sigma_m: position_sigma,
                approximate_attitude_sigma_deg: attitude_sigma,
                gross_error_share: gross_errors,
            };
            let out = out.unwrap_or_else(|| default_out(scene.file_stem().unwrap_or_default().as_ref()));
            let simulated = pipeline::simulate(&source, Path::new(""), &out, output.progress().as_ref())?;
            output.result(&simulated)
        }
        Command::SimulateNetwork { scene, seed, out } => {
            let out = out.unwrap_or_else(|| default_out(scene.file_stem().unwrap_or_default().as_ref()));
            output.result(&calibration_tasks::simulate_network(&scene, seed, &out)?)
        }
        #[cfg(feature = "every-command")]
        Command::Further(further) => further_commands::dispatch(further, threads, output),
    }
}

fn run(
    (survey, calibration): (Option<PathBuf>, Option<PathBuf>),
    pipeline: &Path,
    shard: Option<Part>,
    out: Option<PathBuf>,
    output: &Output,
) -> Outcome {
    let plan = Plan::read(pipeline)?;
    // Parts of one run do not write over each other.
    let part_of = |part: Part| format!("{}-{}-of-{}", plan.name, part.number, part.of);
    let name = shard.map_or_else(|| plan.name.clone(), part_of);
    let out = out.unwrap_or_else(|| default_out(name.as_ref()));
    let request = RunRequest { plan, plan_path: pipeline.to_owned(), survey, calibration, out };
    if let Some(part) = shard {
        return output.result(&pipeline::run_part(&request, part, output.progress().as_ref())?);
    }
    let summary = calibration_tasks::run(&request, output.progress().as_ref())?;
    output.result(&summary)
}

pub(crate) fn default_out(name: &Path) -> PathBuf {
    Path::new("out").join(name)
}
