//! What can be typed behind `rangecam targets`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};
use target_tasks::targets::PaperSize;
use target_tasks::{PrintRequest, TargetKind, TargetsRequest};

use crate::requests::calibration::calibrate_arguments::default_out;
use crate::requests::values::positive;

/// Arguments of a search for targets, or of a page of them.
#[derive(Debug, Args)]
pub(crate) struct TargetsArguments {
    /// Survey, or folder of images (PNG, JPEG) of one camera, each of them a station.
    #[arg(required_unless_present = "print")]
    survey: Option<PathBuf>,
    /// What to look for. Boards: `checkerboard 9x6 0.025` (inner corners, side of a field in metre), `circles 10x10 0.0254` or
    /// `asymmetric-circles 4x11 0.02` (discs, metre between their centres); behind these the diameter of a larger disc at
    /// the origin over that of the others, if there is one. Single targets: `rings 0.05` (coded rings, diameter of their discs in
    /// metre; named R000 to R164 by their codes), `discs`, `spheres`, `spheres 0.1` (their radius) and `lights`, which are named by
    /// where they are among the targets of targets.csv beside the frames.
    #[arg(long, short, num_args = 1..=4, value_names = ["KIND", "SIZE", "METRE", "RATIO"], required_unless_present = "print")]
    kind: Vec<String>,
    /// Write a page to be printed instead (SVG, to scale): `checkerboard 9x6 0.025`, `circles 7x5 0.03`, `asymmetric-circles 4x11
    /// 0.015` or `rings 0.01`, written as for --kind; --out is the file.
    #[arg(long, num_args = 1..=4, value_names = ["KIND", "SIZE", "METRE", "RATIO"],
          conflicts_with_all = ["survey", "kind", "calibration", "principal_distance", "board_sigma"])]
    print: Vec<String>,
    /// Size of the paper to print on.
    #[arg(long, value_enum, ignore_case = true, default_value_t = Page::A4, conflicts_with = "survey")]
    page: Page,
    /// Codes of the rings to print, first and last; default: from 0 on, as many as the page has room for.
    #[arg(long, value_name = "FIRST-LAST", value_parser = codes, conflicts_with = "survey")]
    codes: Option<[usize; 2]>,
    /// calibration.ron whose scattering is taken off; default: the one beside the survey.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Principal distance of a folder of images; default: from the perspective of the boards. Single targets need it.
    #[arg(long, value_name = "PIXELS", value_parser = positive)]
    principal_distance: Option<f64>,
    /// Standard deviation of the board's coordinates, which makes them control (and of those of targets.csv that have none);
    /// default: they are approximate.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    board_sigma: Option<f64>,
    /// Output folder, a survey that `calibrate` takes; default: out/<name of the survey>-targets. With --print the file; default:
    /// <kind>.svg.
    #[arg(long, short)]
    out: Option<PathBuf>,
}

/// What is asked for.
pub(crate) enum Request {
    Find(TargetsRequest),
    Print(PrintRequest),
}

#[derive(Debug, Clone, Copy, ValueEnum)]
#[value(rename_all = "verbatim")]
enum Page {
    /// 210 x 297 mm.
    A4,
    /// 297 x 420 mm.
    A3,
    /// 420 x 594 mm.
    A2,
    /// 594 x 841 mm.
    A1,
    /// 841 x 1189 mm.
    A0,
}

impl Page {
    fn paper(self) -> PaperSize {
        match self {
            Self::A4 => PaperSize::A4,
            Self::A3 => PaperSize::A3,
            Self::A2 => PaperSize::A2,
            Self::A1 => PaperSize::A1,
            Self::A0 => PaperSize::A0,
        }
    }
}

fn codes(text: &str) -> Result<[usize; 2], String> {
    let (first, last) = text.split_once('-').unwrap_or((text, text));
    match (first.trim().parse(), last.trim().parse()) {
        (Ok(first), Ok(last)) => Ok([first, last]),
        _ => Err("expected the first and the last code, such as 0-23".to_owned()),
    }
}

impl TargetsArguments {
    /// The request behind the arguments, or what is wrong with the kind.
    pub(crate) fn request(self) -> Result<Request, String> {
        let Some(survey) = self.survey else {
            let name = format!("{}.svg", self.print.first().map_or("targets", String::as_str));
            return Ok(Request::Print(PrintRequest {
                kind: TargetKind::parse(&self.print).map_err(|wrong| format!("targets --print: {wrong}"))?,
                paper: self.page.paper(),
                codes: self.codes,
                out: self.out.unwrap_or_else(|| PathBuf::from(name)),
            }));
        };
        Ok(Request::Find(TargetsRequest {
            kind: TargetKind::parse(&self.kind).map_err(|wrong| format!("targets --kind: {wrong}"))?,
            out: self.out.unwrap_or_else(|| default_out(&survey, "-targets")),
            survey,
            calibration: self.calibration,
            principal_distance_px: self.principal_distance,
            board_sigma_m: self.board_sigma,
        }))
    }
}
