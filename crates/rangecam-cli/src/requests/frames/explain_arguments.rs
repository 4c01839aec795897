//! What can be typed behind `explain`.

use std::path::PathBuf;

use clap::Args;
use pipeline::Plan;
use tasks::ExplainRequest;

use crate::requests::values::whole;

#[derive(Debug, Args)]
pub(crate) struct ExplainArguments {
    /// Folder with survey.ron.
    survey: PathBuf,
    /// The frame: its position in the survey, counted from 0, or its file.
    #[arg(long, short)]
    frame: String,
    /// Column and row of the pixel, counted from 0.
    #[arg(long, value_name = "COL,ROW", value_parser = pixel)]
    pixel: [usize; 2],
    /// The pipeline's RON file; default: all stages that the survey's level and the calibration leave room for.
    #[arg(long, short)]
    pipeline: Option<PathBuf>,
    /// calibration.ron; default: the one beside survey.ron, if there is one.
    #[arg(long, short)]
    calibration: Option<PathBuf>,
}

impl ExplainArguments {
    pub(crate) fn request(self) -> pipeline::Result<ExplainRequest> {
        Ok(ExplainRequest {
            survey: self.survey,
            frame: self.frame,
            pixel: self.pixel,
            plan: self.pipeline.map(|path| Plan::read(&path)).transpose()?,
            calibration: self.calibration,
        })
    }
}

fn pixel(text: &str) -> Result<[usize; 2], String> {
    whole(text).ok_or_else(|| "expected two whole numbers, column and row counted from 0, as in 88,72".to_owned())
}
