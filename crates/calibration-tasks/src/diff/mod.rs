//! Two calibrations held against each other: which differences are significant, and what they do.

pub(crate) mod drift;
pub(crate) mod pattern;
pub(crate) mod sides;
pub(crate) mod words;

pub use drift::{DriftLine, DriftPlace};
pub use pattern::PatternLine;

use std::path::PathBuf;

use commands::{Judged, Verdict};
use pipeline::{Error, Result};
use range_io::calibration::Calibration;
use residual_tests::{
    CorrectionComparison, CorrectionDifference, ImageComparison, ImageSide, JointTest, ParameterDifference,
    compare_corrections, compare_images, compare_parameters,
};
use serde::Serialize;

use crate::diff::sides::{Pair, Side};

/// Which calibrations to compare, and how strictly.
#[derive(Debug, Clone, PartialEq)]
pub struct DiffRequest {
    /// The one: `calibration.ron` or a folder with it.
    pub first: PathBuf,
    /// The other.
    pub second: PathBuf,
    /// Probability that each of the tests says of calibrations of one unchanged camera that they differ.
    pub level: f64,
}

/// What two calibrations have in common and what not.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationDifference {
    /// The first file.
    pub first: String,
    /// The second file.
    pub second: String,
    /// Level of the tests.
    pub level: f64,
    /// Whether any test says that they differ.
    pub significant: bool,
    /// Common parameters.
    pub parameters: Vec<ParameterLine>,
    /// All common parameters together; `None` where all are held.
    pub joint: Option<JointLine>,
    /// Parameters without a known standard deviation, which are not tested.
    pub not_tested: Vec<String>,
    /// Terms and models in the first file alone.
    pub only_first: Vec<String>,
    /// Terms and models in the second file alone.
    pub only_second: Vec<String>,
    /// What the differences do to ranges, for each integration time and frequency of both files.
    pub corrections: Vec<CorrectionLine>,
    /// What they do to the drift of a warming camera; `None` where not both files have one.
    pub drift: Option<DriftLine>,
    /// Tables of offsets pixel by pixel; `None` where not both files have one with standard deviations.
    pub pattern: Option<PatternLine>,
    /// What they do to image points; `None` where the second camera does not see a direction of the first.
    pub image: Option<ImageLine>,
    /// What else is to be minded.
    pub notes: Vec<String>,
}

/// One parameter.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterLine {
    /// Name, with integration time and frequency where there are several models.
    pub name: String,
    /// Unit of all numbers but the probabilities.
    pub unit: String,
    /// Value in the first file.
    pub first: f64,
    /// Value in the second file.
    pub second: f64,
    /// Second minus first.
    pub difference: f64,
    /// Standard deviation of the difference.
    pub sigma: f64,
    /// Probability of so large a difference by chance, all parameters minded; `None` where it is held in both.
    pub p_value: Option<f64>,
    /// Whether it is below the level.
    pub significant: bool,
    /// `estimated`, `held`, or which of the two files holds it.
    pub status: &'static str,
}

/// The χ² test of all parameters.
#[derive(Debug, Clone, Serialize)]
pub struct JointLine {
    /// The statistic.
    pub chi_squared: f64,
    /// Its degrees of freedom.
    pub degrees: usize,
    /// Probability of so much by chance.
    pub p_value: f64,
    /// Whether it is below the level.
    pub significant: bool,
}

/// The range correction of one model in both files.
#[derive(Debug, Clone, Serialize)]
pub struct CorrectionLine {
    /// Integration time and frequency.
    pub model: String,
    /// Ranges that both cover, metre.
    pub range_span_m: [f64; 2],
    /// Amplitudes that both cover.
    pub amplitude_span: Option<[f64; 2]>,
    /// Largest difference.
    pub largest: PlaceLine,
    /// Largest difference in units of its band.
    pub clearest: PlaceLine,
    /// Root mean square of the difference, metre.
    pub rms_m: f64,
    /// Whether it leaves the band anywhere.
    pub significant: bool,
    /// Range, difference and band along the range in the image's centre, metre.
    pub along_range_m: Vec<[f64; 3]>,
}

/// A difference of corrections at a place.
#[derive(Debug, Clone, Serialize)]
pub struct PlaceLine {
    /// Second minus first, metre.
    pub difference_m: f64,
    /// Half the width of the band that holds everywhere at once, metre.
    pub band_m: f64,
    /// Range, metre.
    pub range_m: f64,
    /// Amplitude, where a model asks for it.
    pub amplitude: Option<f64>,
    /// Column and row.
    pub pixel: [f64; 2],
}

/// The image of one camera in the other.
#[derive(Debug, Clone, Serialize)]
pub struct ImageLine {
    /// Largest shift, pixels.
    pub largest_px: f64,
    /// Where it is.
    pub pixel: [f64; 2],
    /// Half the width of its band, pixels.
    pub band_px: f64,
    /// Root mean square, pixels.
    pub rms_px: f64,
    /// Whether a shift leaves its band anywhere.
    pub significant: bool,
}

/// Compares two calibrations.
///
/// # Errors
/// [`Error::Diff`] for calibrations of different cameras (size or pitch of the pixels) or with range models of other modulation
/// frequencies and integration times alone, of models without common ranges, and for a level that is none; [`Error::File`] for what cannot be read, another version of the format among it.
pub fn diff(request: &DiffRequest) -> Result<CalibrationDifference> {
    let [first, second] = [&request.first, &request.second].map(Calibration::read);
    let names = [&request.first, &request.second].map(|path| path.display().to_string());
    difference(&first?, &second?, names, request.level)
}

/// The same for calibrations in memory, with their names.
pub(crate) fn difference(
    first: &Calibration,
    second: &Calibration,
    [first_name, second_name]: [String; 2],
    level: f64,
) -> Result<CalibrationDifference> {
    require_one_camera(first, second)?;
    let pair = Pair::new(first, second)?;
    require_common_models(&pair)?;
    let compared =
        compare_parameters(&pair.first.parameters, &pair.second.parameters, level).map_err(|error| refused(&error))?;
    let parameters: Vec<ParameterLine> =
        compared.differences.iter().map(|found| parameter_line(found, &pair)).collect();
    let joint = compared.joint.map(joint_line);
    let mut corrections = Vec::new();
    for [i, j] in &pair.models {
        let (one, other) = (pair.first.correction(*i)?, pair.second.correction(*j)?);
        let found =
            compare_corrections(&one.side(), &other.side(), &first.camera, level).map_err(|error| refused(&error))?;
        corrections.push(correction_line(one.name.clone(), &found));
    }
    let drift = drift::line(first, second, level)?;
    let pattern = pattern::line(first, second, level);
    let image = image(&pair.first, &pair.second, level)?;
    let mut notes = pair.notes.clone();
    if image.is_none() {
        notes.push("the second camera does not see every direction of the first: images are not compared".to_owned());
    }
    let significant = joint.as_ref().is_some_and(|joint| joint.significant)
        || parameters.iter().any(|line| line.significant)
        || corrections.iter().any(|line| line.significant)
        || drift.as_ref().is_some_and(|line| line.significant)
        || pattern.as_ref().is_some_and(|line| line.significant)
        || image.as_ref().is_some_and(|line| line.significant);
    Ok(CalibrationDifference {
        first: first_name,
        second: second_name,
        level,
        significant,
        parameters,
        joint,
        not_tested: pair.not_tested,
        only_first: only(compared.only_first, pair.models_of_first, first, second),
        only_second: only(compared.only_second, pair.models_of_second, second, first),
        corrections,
        drift,
        pattern,
        image,
        notes,
    })
}

impl Judged for CalibrationDifference {
    /// Calibrations that differ are no longer one: doubtful.
    fn verdict(&self) -> Verdict {
        if self.significant { Verdict::Doubtful } else { Verdict::Done }
    }
}

fn only(parameters: Vec<String>, models: Vec<String>, here: &Calibration, there: &Calibration) -> Vec<String> {
    let further = drift::alone(here, there).into_iter().chain(pattern::alone(here, there));
    parameters.into_iter().chain(models).chain(further).collect()
}

fn refused(error: &residual_tests::Error) -> Error {
    Error::Diff(error.to_string())
}

fn require_one_camera(first: &Calibration, second: &Calibration) -> Result<()> {
    let words = |calibration: &Calibration| {
        let camera = &calibration.camera;
        let [x, y] = camera.pixel_pitch_mm;
        format!("{} x {} pixels of {x} x {y} mm", camera.width, camera.height)
    };
    if first.camera == second.camera {
        return Ok(());
    }
    Err(Error::Diff(format!(
        "these are calibrations of different cameras: the first has {}, the second {}",
        words(first),
        words(second)
    )))
}

/// Range models of which none belongs to the same frequency and time as one of the other file say nothing of each other.
fn require_common_models(pair: &Pair) -> Result<()> {
    let (first, second) = (&pair.models_of_first, &pair.models_of_second);
    if !pair.models.is_empty() || first.is_empty() || second.is_empty() {
        return Ok(());
    }
    Err(Error::Diff(format!(
        "these calibrations have no range model in common: the first has the {}, the second the {}",
        first.join(", the "),
        second.join(", the ")
    )))
}

fn parameter_line(found: &ParameterDifference, pair: &Pair) -> ParameterLine {
    let [first, second] = found.values;
    let status = match found.sigmas.map(|sigma| sigma > 0.0) {
        [true, true] => "estimated",
        [true, false] => "held in the second",
        [false, true] => "held in the first",
        [false, false] => "held",
    };
    ParameterLine {
        name: found.name.clone(),
        unit: pair.first.unit(&found.name),
        first,
        second,
        difference: found.difference,
        sigma: found.sigma,
        p_value: Some(found.p_value_of_all).filter(|p| p.is_finite()),
        significant: found.significant,
        status,
    }
}

fn joint_line(test: JointTest) -> JointLine {
    let JointTest { statistic, degrees, p_value, significant } = test;
    JointLine { chi_squared: statistic, degrees, p_value, significant }
}

fn correction_line(model: String, found: &CorrectionComparison) -> CorrectionLine {
    CorrectionLine {
        model,
        range_span_m: found.range_span_m,
        amplitude_span: found.amplitude_span,
        largest: place_line(&found.largest),
        clearest: place_line(&found.clearest),
        rms_m: found.rms_m,
        significant: found.significant,
        along_range_m: found.along_range.iter().map(|at| [at.range_m, at.difference_m, at.band_m]).collect(),
    }
}

fn place_line(at: &CorrectionDifference) -> PlaceLine {
    PlaceLine {
        difference_m: at.difference_m,
        band_m: at.band_m,
        range_m: at.range_m,
        amplitude: Some(at.amplitude).filter(|amplitude| amplitude.is_finite()),
        pixel: at.pixel,
    }
}

/// `None` where the second camera does not see a direction of the first.
fn image(first: &Side, second: &Side, level: f64) -> Result<Option<ImageLine>> {
    let ((one, of_one), (other, of_other)) = (first.camera()?, second.camera()?);
    let first = ImageSide { camera: &one, covariance: of_one };
    let second = ImageSide { camera: &other, covariance: of_other };
    match compare_images(&first, &second, level) {
        Ok(ImageComparison { largest_px, pixel, band_px, rms_px, significant, .. }) => {
            Ok(Some(ImageLine { largest_px, pixel, band_px, rms_px, significant }))
        }
        Err(residual_tests::Error::Camera(_)) => Ok(None),
        Err(error) => Err(refused(&error)),
    }
}
