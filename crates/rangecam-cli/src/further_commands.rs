//! All commands but those of pipelines: what can be typed, and each as one call of the crate of its tasks.

use std::path::PathBuf;

use clap::Subcommand;
use live_tasks::{LiveRequest, StreamTarget};
use pipeline::commands::{Inputs, made};
use pipeline::{Judged, Verdict};

use crate::commands::Outcome;
use crate::exit;
use crate::output::Output;
use crate::requests::calibration::calibrate_arguments::CalibrateArguments;
use crate::requests::calibration::check_arguments::CheckArguments;
use crate::requests::calibration::diff_arguments::DiffArguments;
use crate::requests::calibration::plan_arguments::PlanArguments;
use crate::requests::calibration::targets_arguments::Request as Targets;
use crate::requests::calibration::targets_arguments::TargetsArguments;
use crate::requests::clouds::colour_arguments::ColourArguments;
use crate::requests::clouds::compare_arguments::CompareArguments;
use crate::requests::clouds::fuse_arguments::FuseArguments;
use crate::requests::clouds::measure_arguments::MeasureArguments;
use crate::requests::fixed_pattern_arguments::FixedPatternArguments;
use crate::requests::fleet::fleet_arguments::FleetArguments;
use crate::requests::fleet::workflow_arguments::WorkflowArguments;
use crate::requests::frames::convert_arguments::ConvertArguments;
use crate::requests::frames::explain_arguments::ExplainArguments;
use crate::requests::frames::live_arguments::LiveArguments;
use crate::requests::noise_arguments::NoiseArguments;
use crate::requests::orient_arguments::OrientArguments;
use crate::requests::register_arguments::RegisterArguments;
use crate::requests::register_arguments::Request;
use crate::requests::scattering_arguments::ScatteringArguments;
use crate::requests::warm_up_arguments::WarmUpArguments;

#[derive(Debug, Subcommand)]
pub(crate) enum FurtherCommand {
    /// Write a workflow for an archive of many recordings: what Snakemake runs on this machine, a cluster or a cloud.
    Workflow(WorkflowArguments),
    /// One table and one report of all that a workflow did: cameras whose calibration moved, shares of flags, failures by reason.
    Fleet(FleetArguments),
    /// Calibrate lens and range terms from a survey of targets or planes, with the quality of every parameter.
    Calibrate(Box<CalibrateArguments>),
    /// Find the targets of a calibration in the frames of a survey, or in a folder of images, or print some.
    Targets(Box<TargetsArguments>),
    /// Tell how well planned stations and targets would determine a calibration, and which station to add.
    Plan(Box<PlanArguments>),
    /// Estimate internal scattering (stray light in the camera) from a scene with and without bright objects.
    Scattering(Box<ScatteringArguments>),
    /// Estimate random errors (shot, dark, quantisation, or ranges by amplitude) from repeated frames.
    Noise(NoiseArguments),
    /// Estimate the range offset of each pixel (fixed pattern) from walls, and keep it only if it raises the precision.
    Fpn(FixedPatternArguments),
    /// Estimate the drift of all ranges while the camera warms up, and tell from when on it is stable.
    #[command(name = "warmup")]
    WarmUp(WarmUpArguments),
    /// Bring a survey's stations or clouds of any format into one frame, with the quality of every pose.
    Register(RegisterArguments),
    /// Find where stations stand by targets, by an inertial unit, or by the poses of a tracker, with standard deviations.
    Orient(Box<OrientArguments>),
    /// Tell what a survey, a calibration or a cloud holds, and which stages it leaves room for; of a recording (MCAP, ROS 1 bag,
    /// Azure Kinect, ADI) its streams with rates and gaps, cameras, temperatures, and where it is cut off.
    Inspect {
        /// Survey folder, calibration.ron, cloud.ply, or a recording.
        path: PathBuf,
    },
    /// Convert a recording to a survey's folder or to MCAP, or a survey to MCAP: frame by frame, with their times.
    Convert(Box<ConvertArguments>),
    /// Tell whether a calibration is still right for a survey of overlapping stations, by surfaces that they have in common: which
    /// terms moved, and what that does in millimetres. Exit code 0: it is, 1: it is not, 3: the survey cannot tell.
    Check(CheckArguments),
    /// Tell which differences of two calibrations are significant: parameters, range correction, image. Exit code 0:
    /// none, 1: some, 2: they cannot be compared.
    Diff(DiffArguments),
    /// Tell what each correction did to one pixel's range, in millimetres, and what its flags mean.
    Explain(ExplainArguments),
    /// Take frames as they come, from a pipe, a socket, a folder that fills or a recording, to clouds, a status line and a page in the
    /// browser. What comes faster than it is processed is dropped frame by frame, and counted.
    Live(Box<LiveArguments>),
    /// Put the colours of one camera of a rig onto the points of another, exposed at the same moment; points that it does not see get
    /// none.
    Colour(ColourArguments),
    /// Fuse the frames of a result into one cloud without double walls, each point with its standard deviation from all sources.
    Fuse(FuseArguments),
    /// Measure lengths, angles, radii, flatness and volumes between named regions of a result's cloud, each with its standard
    /// deviation from noise, sensor, calibration, drift and poses, and their shares.
    Measure(MeasureArguments),
    /// Compare two results: clouds (PLY, PCD, E57, VTK, xyz), trajectories (TUM, KITTI, EuRoC, Redwood log, 7-Scenes
    /// folder), stations.csv, or output folders.
    Compare(CompareArguments),
}

/// Runs a command; what the shell sees where it does not fail.
pub(crate) fn dispatch(command: FurtherCommand, threads: Option<usize>, output: &Output) -> Outcome {
    match command {
        FurtherCommand::Diff(arguments) => output.result(&calibration_tasks::diff(&arguments.request())?),
        FurtherCommand::Check(arguments) => {
            output.result(&calibration_tasks::check(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Workflow(arguments) => {
            output.result(&workflow_tasks::write_workflow(&arguments.request(threads))?)
        }
        FurtherCommand::Fleet(arguments) => output.result(&workflow_tasks::fleet(&arguments.request())?),
        FurtherCommand::Calibrate(arguments) => calibrate(*arguments, output),
        FurtherCommand::Targets(arguments) => match arguments.request()? {
            Targets::Find(request) => output.result(&target_tasks::find_targets(&request, output.progress().as_ref())?),
            Targets::Print(request) => output.result(&target_tasks::print_targets(&request)?),
        },
        FurtherCommand::Plan(arguments) => {
            output.result(&calibration_tasks::plan_network(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Scattering(arguments) => {
            output.result(&tasks::estimate_scattering(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Noise(arguments) => {
            output.result(&tasks::estimate_noise(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Fpn(arguments) => {
            output.result(&tasks::estimate_pattern(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::WarmUp(arguments) => {
            output.result(&tasks::estimate_warm_up(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Register(arguments) => match arguments.request() {
            Request::Register(request) => output.result(&tasks::register(&request, output.progress().as_ref())?),
            Request::Track(request) => output.result(&tasks::track(&request, output.progress().as_ref())?),
            Request::SeveralToTrack => {
                Err("register: --track follows the frames of one survey: name one folder".into())
            }
        },
        FurtherCommand::Orient(arguments) => {
            output.result(&orientation_tasks::orient(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Inspect { path } if recording_tasks::is_recording(&path) => {
            output.result(&recording_tasks::inspect_recording(&path, output.progress().as_ref())?)
        }
        FurtherCommand::Inspect { path } => output.result(&tasks::inspect(&path)?),
        FurtherCommand::Convert(arguments) => {
            output.result(&recording_tasks::convert(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Explain(arguments) => {
            output.result(&tasks::explain(&arguments.request()?, output.progress().as_ref())?)
        }
        FurtherCommand::Colour(arguments) => {
            output.result(&rig_tasks::colour(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Fuse(arguments) => {
            output.result(&cloud_tasks::fuse(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Live(arguments) => live(&arguments.request(), output),
        FurtherCommand::Measure(arguments) => {
            output.result(&cloud_tasks::measure(&arguments.request(), output.progress().as_ref())?)
        }
        FurtherCommand::Compare(arguments) => {
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
