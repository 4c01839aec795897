//! What can be typed behind `rangecam merge`.

use std::path::PathBuf;

use clap::Args;

/// Arguments of a merge.
#[derive(Debug, Args)]
pub(crate) struct MergeArguments {
    /// Output folders of all parts of one run, `rangecam run --shard`, in whatever order.
    #[arg(required = true, value_name = "PART")]
    pub(crate) parts: Vec<PathBuf>,
    /// Output folder.
    #[arg(long, short)]
    pub(crate) out: PathBuf,
}
