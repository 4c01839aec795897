//! Each command: arguments to one call of `pipeline`.

use std::error::Error;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use live_tasks::{LiveRequest, StreamTarget};
use pipeline::commands::{Inputs, made};
use pipeline::{Judged, Part, Plan, RunRequest, SimulateSource, Verdict};

use crate::arguments::Command;
use crate::exit;
use crate::output::Output;
use crate::requests::calibration::calibrate_arguments::CalibrateArguments;
use crate::requests::calibration::targets_arguments::Request as Targets;
use crate::requests::fleet::merge_arguments::MergeArguments;
use crate::requests::register_arguments::Request;

type Outcome = Result<ExitCode, Box<dyn Error>>;

/// Runs a command; what the shell sees where it does not fail.
pub(crate) fn dispatch(command: Command, threads: Option<usize>, output: &Output) -> Outcome {
    match command {
        Command::Diff(arguments) => output.result(&calibration_tasks::diff(&arguments.request())?),
        Command::Check(arguments) => {
            output.result(&calibration_tasks::check(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Run { survey, pipeline, calibration, shard, out } => {
            run((survey, calibration), &pipeline, shard, out, output)
        }
        Command::Merge(MergeArguments { parts, out }) => {
            output.result(&pipeline::merge(&parts, &out, output.progress().as_ref())?)
        }
        Command::Workflow(arguments) => output.result(&workflow_tasks::write_workflow(&arguments.request(threads))?),
        Command::Fleet(arguments) => output.result(&workflow_tasks::fleet(&arguments.request())?),
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
        Command::Calibrate(arguments) => calibrate(*arguments, output),
        Command::Targets(arguments) => match arguments.request()? {
            Targets::Find(request) => output.result(&target_tasks::find_targets(&request, output.progress().as_ref())?),
            Targets::Print(request) => output.result(&target_tasks::print_targets(&request)?),
        },
        Command::Plan(arguments) => {
            output.result(&calibration_tasks::plan_network(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Scattering(arguments) => {
            output.result(&tasks::estimate_scattering(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Noise(arguments) => {
            output.result(&tasks::estimate_noise(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Fpn(arguments) => {
            output.result(&tasks::estimate_pattern(&arguments.request(), output.progress().as_ref())?)
        }
        Command::WarmUp(arguments) => {
            output.result(&tasks::estimate_warm_up(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Register(arguments) => match arguments.request() {
            Request::Register(request) => output.result(&tasks::register(&request, output.progress().as_ref())?),
            Request::Track(request) => output.result(&tasks::track(&request, output.progress().as_ref())?),
            Request::SeveralToTrack => {
                Err("register: --track follows the frames of one survey: name one folder".into())
            }
        },
        Command::Orient(arguments) => {
            output.result(&orientation_tasks::orient(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Inspect { path } if recording_tasks::is_recording(&path) => {
            output.result(&recording_tasks::inspect_recording(&path, output.progress().as_ref())?)
        }
        Command::Inspect { path } => output.result(&tasks::inspect(&path)?),
        Command::Convert(arguments) => {
            output.result(&recording_tasks::convert(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Explain(arguments) => {
            output.result(&tasks::explain(&arguments.request()?, output.progress().as_ref())?)
        }
        Command::Colour(arguments) => {
            output.result(&rig_tasks::colour(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Fuse(arguments) => {
            output.result(&cloud_tasks::fuse(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Live(arguments) => live(&arguments.request(), output),
        Command::Measure(arguments) => {
            output.result(&cloud_tasks::measure(&arguments.request(), output.progress().as_ref())?)
        }
        Command::Compare(arguments) => {
            output.result(&tasks::compare(&arguments.request(), output.progress().as_ref())?)
        }
    }
}

/// Calibrates, from targets that are found first where that is asked for. What was doubtful about these is doubtful about
/// the calibration.
fn calibrate(mut arguments: CalibrateArguments, output: &Output) -> Outcome {
    let targets = arguments.take_targets().map_err(|wrong| format!("calibrate --targets: {wrong}"))?;
    let request = arguments.request();
    let mut found = None;
    if let Some(targets) = targets {
        // The calibration reads what is found, and must leave alone what that was found in.
        let inputs = Inputs::default().survey(&targets.survey).maybe(targets.calibration.as_deref());
        inputs.destination(&request.out)?;
        let summary = made::anew(|| target_tasks::find_targets(&targets, output.progress().as_ref()))?;
        output.words(&summary)?;
        found = Some(summary);
    }
    if found.is_none() && rig_tasks::is_rig(&request.survey) {
        return output.result(&rig_tasks::calibrate_rig(&request, output.progress().as_ref())?);
    }
    let calibrated = calibration_tasks::calibrate(&request, output.progress().as_ref())?;
    let code = output.result(&calibrated)?;
    let verdict = calibrated.verdict().max(found.map_or(Verdict::Done, |found| found.verdict()));
    Ok(if verdict == calibrated.verdict() { code } else { exit::of_verdict(verdict) })
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

fn live(request: &LiveRequest, output: &Output) -> Outcome {
    let mut line = output.status_line();
    line.end_at_interrupt()?;
    let live = live_tasks::live(request, &mut line);
    line.clear();
    let trajectory = request.tracking.as_ref().and_then(|tracking| tracking.trajectory.as_ref());
    // Where results go to standard output, nothing else does.
    let targets = [request.ply.as_ref(), request.mcap.as_ref(), trajectory];
    if targets.contains(&Some(&StreamTarget::StandardOutput)) {
        output.result_aside(&live?)
    } else {
        output.result(&live?)
    }
}

fn default_out(name: &Path) -> PathBuf {
    Path::new("out").join(name)
}
