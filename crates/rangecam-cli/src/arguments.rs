//! What can be typed.

use std::path::PathBuf;

use clap::{Parser, Subcommand};
use pipeline::Part;
use pipeline::commands::memory::Memory;

#[cfg(feature = "every-command")]
use crate::further_commands::FurtherCommand;
use crate::requests::fleet::merge_arguments::MergeArguments;
use crate::requests::fleet::part::part;
use crate::requests::values::{at_least_one, not_negative, share};

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
    #[cfg(feature = "every-command")]
    #[command(flatten)]
    Further(FurtherCommand),
}
