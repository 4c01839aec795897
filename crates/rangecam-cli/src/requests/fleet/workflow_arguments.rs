//! What can be typed behind `rangecam workflow`.

use std::path::PathBuf;

use clap::Args;
use workflow_tasks::WorkflowRequest;

/// Arguments of a workflow.
#[derive(Debug, Args)]
pub(crate) struct WorkflowArguments {
    /// The archive: a folder for each camera, in it `calibration` and a folder for each day, in that `check`, `warmup` and the
    /// recordings; each is a survey.
    archive: PathBuf,
    /// The stages of all recordings; default: pipeline.ron in the archive.
    #[arg(long, short)]
    pipeline: Option<PathBuf>,
    /// Parts that each recording is processed in. Pipelines that join stations take one.
    #[arg(long, default_value_t = 4, value_name = "N")]
    shards: usize,
    /// Output folder; default: out/<name of the archive>-workflow.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl WorkflowArguments {
    /// The request behind the arguments; `threads`: of each job.
    pub(crate) fn request(self, threads: Option<usize>) -> WorkflowRequest {
        let out = self.out.unwrap_or_else(|| {
            crate::requests::calibration::calibrate_arguments::default_out(&self.archive, "-workflow")
        });
        let threads = threads.unwrap_or(1);
        WorkflowRequest { archive: self.archive, pipeline: self.pipeline, shards: self.shards, threads, out }
    }
}
