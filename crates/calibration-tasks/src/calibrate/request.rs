//! What a calibration is asked for.

use std::path::PathBuf;

use commands::plan::DriftTreatment;
use self_calibration::{CalibrationOptions, Method};

/// How a survey is calibrated.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CalibrateMethod {
    /// From targets, by one of the network methods.
    Network(Method),
    /// Range terms from frames of planes, known or not.
    Planes,
    /// Range terms and lens together with the poses, from surfaces that several stations see.
    Surfaces,
}

impl CalibrateMethod {
    /// The method's name in files and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Network(Method::OneStep) => "one-step",
            Self::Network(Method::TwoStepIndependent) => "two-step-independent",
            Self::Network(Method::TwoStepDependent) => "two-step-dependent",
            Self::Network(Method::JointTwoStep) => "joint-two-step",
            Self::Network(Method::JointIntegrated) => "joint-integrated",
            Self::Network(Method::Laboratory) => "laboratory",
            Self::Planes => "planes",
            Self::Surfaces => "surfaces",
        }
    }

    /// What the method does, in a sentence for people.
    pub fn describe(self) -> &'static str {
        match self {
            Self::Network(Method::OneStep) => "lens, range terms, poses and targets in one adjustment",
            Self::Network(Method::TwoStepIndependent) => {
                "lens from the image points of one survey, range terms from the reference ranges of another"
            }
            Self::Network(Method::TwoStepDependent) => {
                "lens and poses from the image points, then range terms from the ranges of the same survey"
            }
            Self::Network(Method::JointTwoStep) => {
                "poses from a passive camera beside the range camera, then lens and range terms"
            }
            Self::Network(Method::JointIntegrated) => "range camera and passive camera in one adjustment",
            Self::Network(Method::Laboratory) => "range terms from distances known from outside",
            Self::Planes => "range terms from frames of planes",
            Self::Surfaces => "range terms, lens and poses from surfaces that several stations see",
        }
    }
}

/// What to calibrate, and how.
#[derive(Debug, Clone)]
pub struct CalibrateRequest {
    /// Folder with `survey.ron` and the tables.
    pub survey: PathBuf,
    /// Survey that the lens is calibrated from, for [`Method::TwoStepIndependent`].
    pub lens_survey: Option<PathBuf>,
    /// Calibration to start from; `None`: `calibration.ron` beside the survey, or the survey's nominal camera.
    pub calibration: Option<PathBuf>,
    /// Method; it wins over the one in [`Self::options`].
    pub method: CalibrateMethod,
    /// Terms, datum, stations without ranges, rejection.
    pub options: CalibrationOptions,
    /// How the offset d0 is modelled; other than a constant for [`CalibrateMethod::Planes`] only.
    pub offset: OffsetModel,
    /// What is done about the drift of a warming camera that the start values know.
    pub warm_up: DriftTreatment,
    /// What the tables leave open.
    pub defaults: TableDefaults,
    /// What the certificate says besides.
    pub certificate: CertificateRequest,
    /// Output folder; written beside and renamed when everything is done.
    pub out: PathBuf,
}

/// Values for what the tables leave open.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct TableDefaults {
    /// Standard deviation of a column or row where `observations.csv` gives none, pixel; `None`: that is refused.
    pub sigma_pixel: Option<f64>,
    /// Standard deviation of a range where `observations.csv` gives none, metre; `None`: that is refused.
    pub sigma_range_m: Option<f64>,
    /// Integration time of stations for which neither `observations.csv` nor `survey.ron` gives one, second; `None`: it is
    /// not known, and the range terms belong to no time.
    pub integration_time_s: Option<f64>,
}

/// What a certificate says beside what the survey and the adjustment say.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct CertificateRequest {
    /// Who calibrated; `None`: the operator named in `survey.ron`.
    pub operator: Option<String>,
    /// Date, as ISO 8601; `None`: that of the system's clock (UTC).
    pub date: Option<String>,
    /// Leaves out every so many stations (2 or more) and compares what the calibration from the others predicts with
    /// what these observed; `None`: not.
    pub hold_out: Option<usize>,
}

/// How the offset d0 is modelled.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum OffsetModel {
    /// One number.
    #[default]
    Constant,
    /// A look-up table beside it, an offset for each block of so many columns and rows; 1 is a pixel.
    Table {
        /// Side of a block, pixels.
        block: usize,
    },
    /// A surface over the image beside it, instead of e1 and e2.
    Surface {
        /// Highest sum of the orders in x and y, 1 to 6.
        order: usize,
    },
}
