//! Estimation of the fixed pattern from frames of walls.

pub(crate) mod document;
pub(crate) mod summary;

pub use summary::{FixedPatternSummary, PatternWall};

use std::path::PathBuf;
use std::time::Instant;

use atomic_output::Destination;
use commands::memory::keeping;
use commands::plan::{CorrectRangeOptions, DeconvolveOptions, DemodulateOptions, UnwrapOptions};
use commands::{Inputs, Progress, json, produce};
use pipeline::run::process_each;
use pipeline::stages::corrects_ranges;
use pipeline::survey::{OpenSurvey, View, ViewData};
use pipeline::{Error, Plan, Result, Stage};
use range_io::calibration::Calibration;
use range_io::survey::{Level, Survey};
use report::pattern_figures;
use sensor_noise::{PatternEstimate, PatternEstimator, PatternOptions, PatternVerdict};

use crate::further_term::{provenance_with, start, write};

/// What to estimate a fixed pattern from.
#[derive(Debug, Clone)]
pub struct FixedPatternRequest {
    /// Survey of flat walls.
    pub survey: PathBuf,
    /// Calibration that is applied before, and that the pattern is added to; `None`: the one beside the survey, or else
    /// the nominal camera.
    pub calibration: Option<PathBuf>,
    /// How the pattern is estimated and judged.
    pub options: PatternOptions,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Estimates the fixed pattern and writes summary and report, and the calibration with the pattern if that raises the
/// precision of walls that it was not estimated from. If it does not, the calibration is written without any pattern:
/// then the old one was none either. Frames are read one after the other.
///
/// # Errors
/// [`Error::Refused`] where the frames show no walls: then the reason is written, beside an older result where there is
/// one. Every other error leaves what was there.
pub fn estimate_pattern(request: &FixedPatternRequest, progress: &dyn Progress) -> Result<FixedPatternSummary> {
    let inputs = Inputs::default().survey(&request.survey).maybe(request.calibration.as_deref());
    produce(&request.out, &inputs, |destination| estimate(request, destination, progress))
}

fn estimate(
    request: &FixedPatternRequest,
    destination: &Destination,
    progress: &dyn Progress,
) -> Result<FixedPatternSummary> {
    let clock = Instant::now();
    let (mut calibration, words) = start(&request.survey, request.calibration.as_deref())?;
    // What is looked for must not be taken off before.
    calibration.fixed_pattern = None;
    let survey = Survey::read(&request.survey)?;
    check_window(request, &survey)?;
    let plan = preparation(&survey, &calibration);
    let known = (Some(calibration.clone()), words.clone());
    let stations = survey.frames.iter().map(|frame| frame.station.clone()).collect();
    let estimation = Error::estimation("fixed pattern", &request.survey);
    let estimator = PatternEstimator::new(stations, &calibration.camera()?, &request.options);
    let mut estimator = estimator.map_err(&estimation)?;
    let kept = estimator.bytes();
    let mut see = |view: View, _: &OpenSurvey| match view.data {
        ViewData::Range(frame) => estimator.add(&frame).map_err(&estimation),
        _ => Err(Error::Needs { stage: "fixed pattern", needs: "Unwrap" }),
    };
    keeping(kept, || process_each(&plan, &request.survey, known, &mut see, progress))?;
    progress.begin("estimate the fixed pattern", 1);
    let estimate = estimator.finish();
    progress.advance(1);
    let mut summary = FixedPatternSummary::new(request, &words, &estimate);
    summary.seconds = commands::made::seconds_since(clock);
    if summary.applied {
        add_to(&mut calibration, request, &estimate);
    }
    let pattern = &estimate.pattern;
    let offsets = pattern_figures(pattern.width, &pattern.offset_m, &pattern.sigma_m)?;
    let page = document::document(&summary, offsets).html();
    write(destination, Some(&calibration), &json(&summary)?, &page)?;
    progress.finish();
    Ok(summary)
}

/// A window beyond the image would be cut off without a word.
fn check_window(request: &FixedPatternRequest, survey: &Survey) -> Result<()> {
    let Some([columns, rows]) = request.options.wall.pixels.window else { return Ok(()) };
    let (width, height) = (survey.camera.width, survey.camera.height);
    for (what, [first, last], size) in [("columns", columns, width), ("rows", rows, height)] {
        if first > last || last >= size {
            let message = format!("the window's {what} {first} to {last} are not within 0 to {}", size - 1);
            return Err(Error::Survey { path: request.survey.clone(), message });
        }
    }
    Ok(())
}

fn add_to(calibration: &mut Calibration, request: &FixedPatternRequest, estimate: &PatternEstimate) {
    calibration.fixed_pattern = Some(estimate.pattern.clone());
    let method = format!("fixed pattern from {}", request.survey.display());
    let redundancy = estimate.test.blocks as i64 - 1;
    calibration.provenance = provenance_with(&calibration.provenance, &request.survey, &method, redundancy, f64::NAN);
}

/// Whether the pattern is worth applying.
fn is_applied(estimate: &PatternEstimate) -> bool {
    estimate.test.verdict == PatternVerdict::RaisesPrecision
}

/// The stages that bring each frame to ranges with all other errors taken off.
fn preparation(survey: &Survey, calibration: &Calibration) -> Plan {
    let mut stages = Vec::new();
    if survey.level == Level::Samples {
        stages.push(Stage::Demodulate(DemodulateOptions::default()));
    }
    if survey.level <= Level::Phase {
        if calibration.scattering.is_some() {
            stages.push(Stage::Deconvolve(DeconvolveOptions::default()));
        }
        stages.push(Stage::Unwrap(UnwrapOptions::default()));
    }
    if corrects_ranges(calibration) {
        stages.push(Stage::CorrectRange(CorrectRangeOptions::default()));
    }
    Plan { name: "fixed pattern".to_owned(), source: None, calibrate: None, stages }
}
