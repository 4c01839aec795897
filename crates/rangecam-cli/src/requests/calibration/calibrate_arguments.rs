//! What can be typed behind `rangecam calibrate`.

use std::path::{Path, PathBuf};

use calibration_tasks::{
    CalibrateMethod, CalibrateRequest, CalibrationOptions, CertificateRequest, Method, NetworkDatum, OffsetModel,
    TableDefaults, TermSelection,
};
use clap::{Args, ValueEnum};
use pipeline::DriftTreatment;
use target_tasks::{TargetKind, TargetsRequest};

use crate::requests::values::{Terms, name, positive, terms};

/// Arguments of a calibration.
#[derive(Debug, Args)]
pub(crate) struct CalibrateArguments {
    /// Folder with survey.ron and observations.csv (for planes: frames, stations.csv and planes.csv; with --targets: frames,
    /// or images alone); or a folder with rig.ron: several cameras on one rig, each with its folder.
    survey: PathBuf,
    /// Find these targets in the frames first, as `rangecam targets --kind` does; what is found goes into the folder <out>-targets.
    #[arg(long, num_args = 1..=4, value_names = ["KIND", "SIZE", "METRE", "RATIO"])]
    targets: Vec<String>,
    /// How to calibrate.
    #[arg(long, short, value_enum, default_value_t = MethodName::OneStep)]
    method: MethodName,
    /// Terms to estimate, separated by commas (xp,yp,c,k1,k2,k3,p1,p2,b1,b2,d0,d2,...,d7,e1,e2,h1,h2,h3), all others
    /// being held at their start values; or `auto`: all, each with what cameras usually show of it where the network does not tell. From targets also
    /// spline12 (a spline with 12 knots instead of d2 to d7), polynomial3 (order 3, over the observed ranges), surface2
    /// (order 2 over the image, instead of e1 and e2).
    #[arg(long, default_value = "auto", value_name = "LIST|auto", value_parser = terms)]
    terms: Terms,
    /// What carries the datum: inner constraints on the targets, or the standard deviations in targets.csv and
    /// stations.csv.
    #[arg(long, value_enum, default_value_t = DatumName::Given)]
    datum: DatumName,
    /// Output folder; default: out/<name of the survey>-calibration.
    #[arg(long, short)]
    out: Option<PathBuf>,
    /// calibration.ron with start values; default: the one beside survey.ron, or else the nominal camera.
    #[arg(long, short, value_name = "FILE")]
    calibration: Option<PathBuf>,
    /// Survey that the lens is calibrated from, for two-step-independent.
    #[arg(long, value_name = "DIR")]
    lens_survey: Option<PathBuf>,
    /// How the passive camera of a joint setup takes part.
    #[arg(long, value_enum, default_value_t = JointName::Integrated)]
    joint: JointName,
    /// Stations whose ranges are left out, such as convergent ones whose ranges scattering would bias: S03,S04.
    #[arg(long, value_delimiter = ',', value_name = "STATIONS", value_parser = name)]
    without_ranges: Vec<String>,
    /// Significance level of the outlier test, or `none`: nothing is rejected.
    #[arg(long, default_value = "0.0001", value_name = "LEVEL|none", value_parser = level)]
    reject: Level,
    /// Largest growth of a standard deviation by correlations before the network is refused as too weak.
    #[arg(long, value_name = "FACTOR", value_parser = positive)]
    largest_inflation: Option<f64>,
    /// How the offset d0 is modelled from planes: `constant`; `table`, a look-up table beside it with an offset for each
    /// pixel (table4: for blocks of 4 x 4 pixels), written if it takes off more than its noise adds; `surface`, a
    /// polynomial over the image of order 4 (surface2: of order 2) instead of e1 and e2.
    #[arg(long, default_value = "constant", value_name = "constant|tableN|surfaceN", value_parser = offset)]
    offset: OffsetModel,
    /// The drift of a warming camera that the start values know: taken off the ranges by the times of the frames, or
    /// left in them, as the camera was warm.
    #[arg(long, value_enum, default_value_t = WarmUpName::Apply)]
    warm_up: WarmUpName,
    /// Standard deviation of a column or row where observations.csv gives none, pixel.
    #[arg(long, value_name = "PIXEL", value_parser = positive)]
    sigma_pixel: Option<f64>,
    /// Standard deviation of a range where observations.csv gives none, metre.
    #[arg(long, value_name = "METRE", value_parser = positive)]
    sigma_range: Option<f64>,
    /// Integration time of stations for which neither observations.csv nor survey.ron gives one, second.
    #[arg(long, value_name = "SECOND", value_parser = positive)]
    integration_time: Option<f64>,
    /// Who calibrates, for the certificate; default: `operator` in survey.ron.
    #[arg(long, value_name = "NAME", value_parser = name)]
    operator: Option<String>,
    /// Leave out every N-th station, and compare what the calibration from the others predicts with what these observed.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(2..))]
    hold_out: Option<u64>,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum MethodName {
    /// Lens, range terms, poses and targets in one adjustment.
    OneStep,
    /// Lens from the image points of --lens-survey, range terms from the ranges of SURVEY.
    TwoStepIndependent,
    /// Lens and poses from the image points, then range terms from the ranges of the same survey.
    TwoStepDependent,
    /// With a passive camera mounted beside the range camera (folder passive); see --joint.
    Joint,
    /// Range terms from known distances (distances.csv).
    Laboratory,
    /// Range terms from frames of planes, known or not (planes.csv).
    Planes,
    /// Range terms, and what is told of the lens, with the poses, from what stations of a survey of frames see in common: no target.
    Surfaces,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum WarmUpName {
    /// Taken off.
    Apply,
    /// Left in the ranges.
    Leave,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
enum JointName {
    /// Poses from the passive camera first, then lens and range terms.
    TwoStep,
    /// Both cameras in one adjustment.
    Integrated,
}

#[derive(Debug, Clone, Copy, ValueEnum)]
pub(crate) enum DatumName {
    /// Control where the tables have standard deviations, free otherwise.
    Given,
    /// Inner constraints on the targets.
    Free,
    /// Targets or stations with standard deviations.
    Control,
}

impl DatumName {
    pub(crate) fn datum(self) -> NetworkDatum {
        match self {
            Self::Given => NetworkDatum::Given,
            Self::Free => NetworkDatum::Free,
            Self::Control => NetworkDatum::Control,
        }
    }
}

/// Level of a test, or that there is none.
#[derive(Debug, Clone, Copy)]
struct Level(Option<f64>);

fn level(text: &str) -> Result<Level, String> {
    if text == "none" {
        return Ok(Level(None));
    }
    match text.parse::<f64>() {
        Ok(level) if level > 0.0 && level < 1.0 => Ok(Level(Some(level))),
        _ => Err("expected a probability between 0 and 1, or `none`".to_owned()),
    }
}

/// Light falls off and errors grow towards the corners: what that looks like takes an order of four.
const SURFACE_ORDER: usize = 4;

fn offset(text: &str) -> Result<OffsetModel, String> {
    let number = |digits: &str, default: usize| if digits.is_empty() { Some(default) } else { digits.parse().ok() };
    let block = text.strip_prefix("table").and_then(|digits| number(digits, 1)).filter(|block| *block > 0);
    let order = text.strip_prefix("surface").and_then(|digits| number(digits, SURFACE_ORDER));
    match (text, block, order.filter(|order| (1..=6).contains(order))) {
        ("constant", ..) => Ok(OffsetModel::Constant),
        (_, Some(block), _) => Ok(OffsetModel::Table { block }),
        (_, _, Some(order)) => Ok(OffsetModel::Surface { order }),
        _ => Err("expected `constant`, `table` or `table4` (side of a block), `surface` or `surface2` (order 1 to 6)"
            .to_owned()),
    }
}

impl CalibrateArguments {
    /// Where to find which targets first, if that is asked for; from then on what is found is what is calibrated.
    pub(crate) fn take_targets(&mut self) -> Result<Option<TargetsRequest>, String> {
        if self.targets.is_empty() {
            return Ok(None);
        }
        let kind = TargetKind::parse(&self.targets)?;
        let out = self.out.get_or_insert_with(|| default_out(&self.survey, "-calibration"));
        let mut found = out.clone().into_os_string();
        found.push("-targets");
        let survey = std::mem::replace(&mut self.survey, PathBuf::from(found));
        Ok(Some(TargetsRequest {
            survey,
            calibration: self.calibration.take(),
            kind,
            principal_distance_px: None,
            board_sigma_m: None,
            out: self.survey.clone(),
        }))
    }

    /// The request behind the arguments.
    pub(crate) fn request(self) -> CalibrateRequest {
        let method = match (self.method, self.joint) {
            (MethodName::OneStep, _) => CalibrateMethod::Network(Method::OneStep),
            (MethodName::TwoStepIndependent, _) => CalibrateMethod::Network(Method::TwoStepIndependent),
            (MethodName::TwoStepDependent, _) => CalibrateMethod::Network(Method::TwoStepDependent),
            (MethodName::Joint, JointName::TwoStep) => CalibrateMethod::Network(Method::JointTwoStep),
            (MethodName::Joint, JointName::Integrated) => CalibrateMethod::Network(Method::JointIntegrated),
            (MethodName::Laboratory, _) => CalibrateMethod::Network(Method::Laboratory),
            (MethodName::Planes, _) => CalibrateMethod::Planes,
            (MethodName::Surfaces, _) => CalibrateMethod::Surfaces,
        };
        let out = default_out(&self.survey, "-calibration");
        let standard = CalibrationOptions::default();
        let options = CalibrationOptions {
            terms: selection(self.terms),
            datum: self.datum.datum(),
            without_ranges: self.without_ranges,
            rejection_level: self.reject.0,
            largest_inflation: self.largest_inflation.unwrap_or(standard.largest_inflation),
            ..standard
        };
        CalibrateRequest {
            survey: self.survey,
            lens_survey: self.lens_survey,
            calibration: self.calibration,
            method,
            options,
            offset: self.offset,
            warm_up: match self.warm_up {
                WarmUpName::Apply => DriftTreatment::Apply,
                WarmUpName::Leave => DriftTreatment::Leave,
            },
            defaults: TableDefaults {
                sigma_pixel: self.sigma_pixel,
                sigma_range_m: self.sigma_range,
                integration_time_s: self.integration_time,
            },
            certificate: CertificateRequest {
                operator: self.operator,
                date: None,
                hold_out: self.hold_out.and_then(|every| usize::try_from(every).ok()),
            },
            out: self.out.unwrap_or(out),
        }
    }
}

/// The terms as the calibration takes them.
pub(crate) fn selection(Terms(names): Terms) -> TermSelection {
    names.map_or(TermSelection::Auto, TermSelection::List)
}

/// `out/<name of the survey><ending>`.
pub(crate) fn default_out(survey: &Path, ending: &str) -> PathBuf {
    let mut name = survey.file_name().unwrap_or_default().to_owned();
    name.push(ending);
    Path::new("out").join(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn models_of_the_offset_are_read_and_others_refused() {
        assert_eq!(offset("constant"), Ok(OffsetModel::Constant));
        assert_eq!(offset("table"), Ok(OffsetModel::Table { block: 1 }));
        assert_eq!(offset("table8"), Ok(OffsetModel::Table { block: 8 }));
        assert_eq!(offset("surface"), Ok(OffsetModel::Surface { order: 4 }));
        assert_eq!(offset("surface2"), Ok(OffsetModel::Surface { order: 2 }));
        for wrong in ["table0", "surface7", "surface0", "tables", "spline", ""] {
            assert!(offset(wrong).is_err(), "{wrong}");
        }
    }
}
