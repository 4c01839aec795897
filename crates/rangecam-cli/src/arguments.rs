//! What can be typed.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use pipeline::Part;
use pipeline::commands::memory::Memory;

use crate::requests::calibration::calibrate_arguments::CalibrateArguments;
use crate::requests::calibration::check_arguments::CheckArguments;
use crate::requests::calibration::diff_arguments::DiffArguments;
use crate::requests::calibration::plan_arguments::PlanArguments;
use crate::requests::calibration::targets_arguments::TargetsArguments;
use crate::requests::clouds::colour_arguments::ColourArguments;
use crate::requests::clouds::compare_arguments::CompareArguments;
use crate::requests::clouds::fuse_arguments::FuseArguments;
use crate::requests::clouds::measure_arguments::MeasureArguments;
use crate::requests::fixed_pattern_arguments::FixedPatternArguments;
use crate::requests::fleet::fleet_arguments::FleetArguments;
use crate::requests::fleet::merge_arguments::MergeArguments;
use crate::requests::fleet::part::part;
use crate::requests::fleet::workflow_arguments::WorkflowArguments;
use crate::requests::frames::convert_arguments::ConvertArguments;
use crate::requests::frames::explain_arguments::ExplainArguments;
use crate::requests::frames::live_arguments::LiveArguments;
use crate::requests::noise_arguments::NoiseArguments;
use crate::requests::orient_arguments::OrientArguments;
use crate::requests::register_arguments::RegisterArguments;
use crate::requests::scattering_arguments::ScatteringArguments;
use crate::requests::values::{at_least_one, not_negative, share};
use crate::requests::warm_up_arguments::WarmUpArguments;

/// Raw frames of a range camera in, one corrected and registered cloud out.
#[derive(Debug, Parser)]
#[command(name = "rangecam", version, about, after_help = crate::exit::CODES)]
#[allow(clippy::struct_excessive_bools)] // each is an option of its own
pub(crate) struct Arguments {
    /// No progress, no summary: only errors.
    #[arg(long, short, global = true)]
    pub(crate) quiet: bool,
    /// The result as JSON on standard output, nothing else there.
    #[arg(long, global = true)]
    pub(crate) json: bool,
    /// Threads that compute; default: one for each core. Results do not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = at_least_one)]
    pub(crate) threads: Option<usize>,
    /// Memory that may be in flight where many frames are read: 2GB, 500MB, 1.5GiB; default: a quarter of the machine's. Results do not
    /// depend on it.
    #[arg(long, global = true, value_name = "SIZE")]
    pub(crate) memory: Option<Memory>,
    /// Points above which a cloud is written as an octree of tiles (cloud.copc.laz, COPC) instead of cloud.ply, by run, merge, register
    /// and fuse; 0: always. Default: 100000000.
    #[arg(long, global = true, value_name = "POINTS")]
    pub(crate) tiles_above: Option<u64>,
    /// Leave an output folder as it is that was made from the same inputs, with the same options and by the same program, by their
    /// digests.
    #[arg(long, global = true)]
    pub(crate) skip_done: bool,
    /// No durations in summaries and reports, and no date on a certificate: the same input gives the same bytes.
    #[arg(long, global = true)]
    pub(crate) no_times: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Run a pipeline on a survey and write cloud, poses, summary and report.
    Run {
        /// Folder with survey.ron; may be left out where the pipeline names its own source.
        survey: Option<PathBuf>,
        /// The pipeline's RON file.
        #[arg(long, short)]
        pipeline: PathBuf,
        /// calibration.ron; default: the one beside survey.ron, if there is one.
        #[arg(long, short)]
        calibration: Option<PathBuf>,
        /// Process this part of the stations alone (of the frames, where nothing averages them): 1/8 to 8/8, made whole by
        /// `rangecam merge`.
        #[arg(long, value_name = "I/N", value_parser = part)]
        shard: Option<Part>,
        /// Output folder; default: out/<name of the pipeline>.
        #[arg(long, short)]
        out: Option<PathBuf>,
    },
    /// Make the result of a run of all its parts, as one run would have written it.
    Merge(MergeArguments),
    /// Write a workflow for an archive of many recordings: what Snakemake runs on this machine, a cluster or a cloud.
    Workflow(WorkflowArguments),
    /// One table and one report of all that a workflow did: cameras whose calibration moved, shares of flags, failures by reason.
    Fleet(FleetArguments),
    /// Simulate a scene and write it as a survey with its truth.
    Simulate {
        /// The scene's RON file.
        scene: PathBuf,
        /// Seed of all random numbers.
        #[arg(long, default_value_t = 1)]
        seed: u64,
        /// Standard deviation of the approximate station positions written to stations.csv, metre.
        #[arg(long, default_value_t = 0.05, value_name = "METRE", value_parser = not_negative)]
        position_sigma: f64,
        /// Standard deviation of the approximate attitudes written to stations.csv, degree.
        #[arg(long, default_value_t = 2.0, value_name = "DEGREE", value_parser = not_negative)]
        attitude_sigma: f64,
        /// Part of the pixels of each station that show anything (gross errors), from 0 to 1.
        #[arg(long, default_value_t = 0.0, value_name = "SHARE", value_parser = share)]
        gross_errors: f64,
        /// Output folder; default: out/<name of the scene's file>.
        #[arg(long, short)]
        out: Option<PathBuf>,
    },
    /// Simulate a calibration network (targets seen from stations) and write it as a survey with its truth.
    SimulateNetwork {
        /// The network's RON file.
        scene: PathBuf,
        /// Seed of all random numbers; default: the network's own.
        #[arg(long)]
        seed: Option<u64>,
        /// Output folder; default: out/<name of the network's file>.
        #[arg(long, short)]
        out: Option<PathBuf>,
    },
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
