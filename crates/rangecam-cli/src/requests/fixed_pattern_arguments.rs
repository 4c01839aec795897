//! What can be typed behind `rangecam fpn`.

use std::path::PathBuf;

use clap::Args;
use tasks::{FixedPatternRequest, PatternOptions};

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::whole;

/// Arguments of an estimation of the fixed pattern.
#[derive(Debug, Args)]
pub(crate) struct FixedPatternArguments {
    /// Survey of flat walls, best at several distances and with the camera turned, several frames each.
    survey: PathBuf,
    /// calibration.ron that is applied before and that the pattern is added to; default: the one beside the survey, or
    /// else the nominal camera.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// First and last column, first and last row of the pixels that show the wall, counted from 0; default: all.
    #[arg(long, value_name = "COL,COL,ROW,ROW", value_parser = window)]
    window: Option<[usize; 4]>,
    /// Output folder; default: out/<name of the survey>-fpn.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

impl FixedPatternArguments {
    /// The request behind the arguments.
    pub(crate) fn request(self) -> FixedPatternRequest {
        let out = self.out.unwrap_or_else(|| default_out(&self.survey, "-fpn"));
        let mut options = PatternOptions::default();
        if let Some([left, right, top, bottom]) = self.window {
            options.wall.pixels.window = Some([[left, right], [top, bottom]]);
        }
        FixedPatternRequest { survey: self.survey, calibration: self.calibration, options, out }
    }
}

/// Four numbers between commas.
fn window(text: &str) -> Result<[usize; 4], String> {
    let numbers = whole(text).filter(|[left, right, top, bottom]| left <= right && top <= bottom);
    let expected = "first and last column, first and last row, such as 48,82,16,48";
    numbers.ok_or_else(|| format!("expected four whole numbers between commas: {expected}"))
}
