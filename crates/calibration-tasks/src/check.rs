//! Whether a calibration is still right for a survey: its terms against those that the survey's own surfaces show.

use std::fmt;
use std::path::PathBuf;

use commands::plan::DriftTreatment;
use commands::{Judged, Progress, Verdict, root_of};
use pipeline::survey::read_calibration;
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use report::Document;
use self_calibration::{CalibrationOptions, TermSelection};
use serde::Serialize;

use crate::calibrate::{
    CalibrateMethod, CalibrateRequest, CertificateRequest, OffsetModel, TableDefaults, calibrate_on_the_job,
    calibration_file,
};
use crate::diff::{CalibrationDifference, difference};

/// Which calibration to check, and how strictly.
#[derive(Debug, Clone, PartialEq)]
pub struct CheckRequest {
    /// Folder of a survey of frames whose stations overlap.
    pub survey: PathBuf,
    /// The calibration; `None`: `calibration.ron` beside the survey.
    pub calibration: Option<PathBuf>,
    /// Probability that terms that are still right are said to have moved.
    pub level: f64,
    /// Change of the range correction (root mean square, metre) below which it does not matter that they have.
    pub tolerance_m: f64,
}

/// What the survey says of the calibration.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationCheck {
    /// Whether the terms that the survey determines are, all together, other ones than those of the calibration, at the level.
    pub moved: bool,
    /// Whether that matters: they moved, and ranges change by more than the tolerance.
    pub matters: bool,
    /// The tolerance, metre.
    pub tolerance_m: f64,
    /// Root mean square change of the range correction over the survey's ranges and amplitudes, metre.
    pub change_rms_m: Option<f64>,
    /// What the survey does not determine, and so does not check, in sentences.
    pub not_checked: Vec<String>,
    /// The calibration (first) and what the survey shows (second) term by term, and what the differences do.
    pub difference: CalibrationDifference,
}

/// Checks a calibration against a survey of overlapping stations, without a target: range terms are estimated anew with
/// the poses, from surfaces that several stations see, and compared.
///
/// The test is one χ² test of all terms that the survey determines, with both covariances; single terms are tested after Holm, to
/// tell which of them moved.
///
/// # Errors
/// [`Error::Refused`] where the survey tells none of the terms; [`Error::Request`] without a calibration, or for one without range terms;
/// those of reading survey and calibration.
pub fn check(request: &CheckRequest, progress: &dyn Progress) -> Result<CalibrationCheck> {
    let wrong = |message: String| Error::Request { command: "check", message };
    if !(request.level > 0.0 && request.level < 1.0) {
        return Err(wrong(format!("--level is {}: it must lie between 0 and 1", request.level)));
    }
    if !(request.tolerance_m >= 0.0 && request.tolerance_m.is_finite()) {
        return Err(wrong(format!("--tolerance is {} m: it must be finite and not negative", request.tolerance_m)));
    }
    let (known, _) = read_calibration(&root_of(&request.survey), request.calibration.as_deref())?;
    let Some(known) = known else {
        return Err(wrong("there is no calibration.ron beside the survey: name one with --calibration".to_owned()));
    };
    if known.range_models.is_empty() {
        return Err(wrong("the calibration has no range terms: there is nothing to check".to_owned()));
    }
    let calibrate = CalibrateRequest {
        survey: request.survey.clone(),
        lens_survey: None,
        calibration: request.calibration.clone(),
        method: CalibrateMethod::Surfaces,
        options: CalibrationOptions { terms: TermSelection::Auto, ..CalibrationOptions::default() },
        offset: OffsetModel::Constant,
        warm_up: DriftTreatment::Apply,
        defaults: TableDefaults::default(),
        certificate: CertificateRequest::default(),
        out: PathBuf::new(),
    };
    let (start, found) = calibrate_on_the_job(&calibrate, progress)?;
    progress.finish();
    let found = match found {
        Ok(found) => found.outcome,
        Err(source) => {
            let refused = source.to_string();
            return Err(Error::not_calibrated(source, &Refused { refused })?);
        }
    };
    let name = request.survey.display().to_string();
    let mut shown = calibration_file::calibration(&found, &start, &name, CalibrateMethod::Surfaces.name())?;
    known_times(&known, &mut shown);
    not_known_where_held(&mut shown);
    let names = [start.words.clone(), format!("the surfaces of {name}")];
    let difference = difference(&known, &shown, names, request.level)?;
    let moved = difference.joint.as_ref().is_some_and(|joint| joint.significant);
    let change_rms_m = difference.corrections.first().map(|correction| correction.rms_m);
    Ok(CalibrationCheck {
        moved,
        matters: moved && change_rms_m.is_none_or(|change| change > request.tolerance_m),
        tolerance_m: request.tolerance_m,
        change_rms_m,
        not_checked: found.diagnosis.into_iter().skip(1).collect(),
        difference,
    })
}

/// Why nothing can be said.
#[derive(Serialize)]
struct Refused {
    refused: String,
}

/// Terms without an integration time belong to that of the calibration.
fn known_times(known: &Calibration, shown: &mut Calibration) {
    if let ([known], [shown]) = (known.range_models.as_slice(), shown.range_models.as_mut_slice()) {
        shown.integration_time_s = known.integration_time_s;
        shown.modulation_hz = known.modulation_hz;
    }
}

/// What was held says nothing of the calibration: its deviation is not known, and it is not tested.
fn not_known_where_held(shown: &mut Calibration) {
    let ranges = shown.range_models.iter_mut().flat_map(|model| &mut model.parameters);
    for parameter in
        shown.parameters.iter_mut().chain(ranges).filter(|parameter| parameter.sigma.is_nan() || parameter.sigma <= 0.0)
    {
        parameter.sigma = f64::NAN;
    }
}

impl Judged for CalibrationCheck {
    /// A calibration that is no longer right makes what is corrected with it doubtful.
    fn verdict(&self) -> Verdict {
        if self.matters { Verdict::Doubtful } else { Verdict::Done }
    }
}

impl fmt::Display for CalibrationCheck {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (level, millimetres) = (100.0 * self.difference.level, self.change_rms_m.map(|metres| 1e3 * metres));
        let change =
            millimetres.map_or_else(String::new, |mm| format!("; ranges change by {mm:.2} mm (root mean square)"));
        let tolerance = 1e3 * self.tolerance_m;
        let verdict = match (self.moved, self.matters) {
            (_, true) => {
                "is no longer right: calibrate again, or with `rangecam calibrate --method surfaces` from this survey"
                    .to_owned()
            }
            (true, false) => format!("has moved, by less than matters (--tolerance {tolerance} mm)"),
            (false, _) => "is still right, as far as this survey tells".to_owned(),
        };
        let mut document = Document::new(
            "rangecam: check of a calibration",
            format!("{} {verdict} (level {level} %){change}.", self.difference.first),
        );
        for sentence in &self.not_checked {
            document.paragraph(sentence.clone());
        }
        writeln!(f, "{document}")?;
        self.difference.fmt(f)
    }
}
