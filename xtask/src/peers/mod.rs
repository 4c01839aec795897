//! `cargo xtask peers STAGE ...`: other programs beside ours on the same work, in turn, in one run.
//!
//! The peers come from the Python Package Index into a virtual environment below `target/peers`; nothing of it is kept
//! elsewhere. The tables are printed as they stand in docs/benchmarks.md.

mod adjust;
mod environment;
mod frame;
mod phase;
mod registration;
mod registration_real;
mod scattering;
mod table;
mod targets;

use crate::shell::Outcome;

/// What is compared.
#[derive(Debug, Clone, Copy, clap::ValueEnum)]
enum Stage {
    /// Ceres and OpenCV beside `adjust`.
    Adjust,
    /// NumPy, OpenCV, FFTW, scikit-image and KISS-ICP as one chain beside `live-frames`.
    Frame,
    /// scikit-image, OpenCV, SNAPHU, kamui and NumPy beside `phase-unwrap` and `range-image`.
    Phase,
    /// `small_gicp`, Open3D, KISS-ICP and KISS-Matcher beside `icp-registration`.
    Registration,
    /// The same on real captures beside the repository, `small_gicp` at settings sought on a half of them.
    RegistrationReal,
    /// `scipy`, FFTW and OpenCV beside `scattering-deconvolution`.
    Scattering,
    /// OpenCV beside `targets`.
    Targets,
}

/// Which stages, and how often.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// Stages.
    #[arg(required = true)]
    stages: Vec<Stage>,
    /// Runs of each program, in turn; the fastest counts.
    #[arg(long, default_value_t = 3)]
    runs: usize,
}

pub(crate) fn run(arguments: &Arguments) -> Outcome {
    for stage in &arguments.stages {
        match stage {
            Stage::Adjust => adjust::run(arguments.runs.max(1))?,
            Stage::Frame => frame::run(arguments.runs.max(1))?,
            Stage::Phase => phase::run(arguments.runs.max(1))?,
            Stage::Registration => registration::run(arguments.runs.max(1))?,
            Stage::RegistrationReal => registration_real::run(arguments.runs.max(1))?,
            Stage::Scattering => scattering::run(arguments.runs.max(1))?,
            Stage::Targets => targets::run()?,
        }
    }
    Ok(())
}
