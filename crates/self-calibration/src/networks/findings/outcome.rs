//! What a calibration found, and how well.

use adjust::TraceEntry;
use camera_model::Camera;
use error_models::{ParameterStatus, RangeErrorModel};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6, Point3};

use crate::networks::{Cause, Method};

/// A calibration with its quality: all that a report needs.
#[derive(Debug, Clone)]
pub struct CalibrationOutcome {
    /// Method used.
    pub method: Method,
    /// Interior orientation and lens.
    pub camera: Camera,
    /// Range models by integration time (seconds; `None` where the network names none), with the spans observed.
    pub range_models: Vec<(Option<f64>, RangeErrorModel)>,
    /// All calibration parameters, estimated and held. With several integration times, the range terms of the second
    /// and further sets carry `@<time in s>` behind their names.
    pub parameters: Vec<CalibratedParameter>,
    /// Names of the estimated parameters and their covariance (prior-scaled) and correlation matrix.
    pub estimated: Vec<String>,
    /// Prior-scaled covariance of [`Self::estimated`].
    pub covariance: DMatrix<f64>,
    /// Its first-order part: what derivatives by the parameters carry to corrected ranges and points. Another one where a
    /// hyperbola is estimated, whose coefficients have more than proportional errors.
    pub first_order_covariance: DMatrix<f64>,
    /// Adjusted stations.
    pub stations: Vec<AdjustedStation>,
    /// Adjusted targets.
    pub targets: Vec<AdjustedTarget>,
    /// One entry for every observed column, row, range and known distance.
    pub residuals: Vec<ObservationQuality>,
    /// Observation groups with their variance components.
    pub groups: Vec<GroupQuality>,
    /// Decisions of the automatic choice of terms, empty for a list.
    pub decisions: Vec<TermDecision>,
    /// Score tests of usual terms that are not estimated; empty for the automatic choice, which estimates all.
    pub unestimated: Vec<TermScore>,
    /// What is weakly determined and what would cure it, in sentences.
    pub diagnosis: Vec<String>,
    /// What speaks against the result as a whole, in sentences that end with what to do: nothing, as a rule.
    pub doubts: Vec<String>,
    /// What explains the doubts, where something does.
    pub causes: Vec<Cause>,
    /// Observed values used.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Inner constraints.
    pub datum_defect: usize,
    /// Redundancy.
    pub redundancy: i64,
    /// vᵀPv.
    pub vtpv: f64,
    /// Posterior standard deviation of unit weight.
    pub sigma0: Option<f64>,
    /// Akaike's and Schwarz's information criteria.
    pub aic: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// What each iteration did.
    pub trace: Vec<TraceEntry>,
}

/// One calibration parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct CalibratedParameter {
    /// Canonical name.
    pub name: String,
    /// Value in [`Self::unit`].
    pub value: f64,
    /// Standard deviation from the a-priori deviations of the observations; 0 where held.
    pub sigma_prior: f64,
    /// The same scaled with sigma0; 0 where held, NaN without redundancy.
    pub sigma_posterior: f64,
    /// Unit.
    pub unit: String,
    /// Estimated or held.
    pub status: ParameterStatus,
    /// Probability of a deviation from zero this large if the parameter were zero; NaN where held.
    pub significance_p: f64,
}

/// An adjusted station.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedStation {
    /// Name.
    pub name: String,
    /// Pose.
    pub world_from_camera: Isometry3<f64>,
    /// Prior-scaled covariance of the tangent step `[dt world m, dθ camera rad]`.
    pub covariance: Matrix6<f64>,
}

/// An adjusted target.
#[derive(Debug, Clone, PartialEq)]
pub struct AdjustedTarget {
    /// Name.
    pub name: String,
    /// Position, metre.
    pub point: Point3<f64>,
    /// Prior-scaled covariance, m².
    pub covariance: Matrix3<f64>,
}

/// What was observed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Component {
    /// Column of an image point, pixel.
    Col,
    /// Row of an image point, pixel.
    Row,
    /// Range, metre.
    Range,
    /// Column in the passive camera, pixel.
    PassiveCol,
    /// Row in the passive camera, pixel.
    PassiveRow,
    /// Known distance, metre.
    Distance,
    /// Control coordinate or pose component, metre or radian.
    Control,
    /// What cameras show of a term that the automatic choice estimates: zero, in the unit of the term.
    Term,
}

/// What the outlier test says of an observation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Verdict {
    /// Used, inconspicuous.
    Used,
    /// Rejected as a gross error; its residual is that of a prediction.
    Rejected,
    /// Used, but nothing checks it (redundancy number zero).
    Uncontrolled,
    /// Left out as the method or the user asks; its residual is that of a prediction.
    LeftOut,
}

/// An observed value after the adjustment.
#[derive(Debug, Clone, PartialEq)]
pub struct ObservationQuality {
    /// Name of the station (of the first end of a distance).
    pub station: String,
    /// Name of the target (of the second end of a distance).
    pub target: String,
    /// Which component.
    pub component: Component,
    /// Observed value in the unit of the component.
    pub observed: f64,
    /// A-priori standard deviation, same unit.
    pub sigma: f64,
    /// v = observed − model, same unit.
    pub residual: f64,
    /// Redundancy number 0..1; NaN where the observation is not used.
    pub redundancy_number: f64,
    /// `v / σ_v`, posterior-scaled where there is redundancy; NaN where not controlled.
    pub standardised: f64,
    /// Smallest gross error that the test would find (internal reliability), same unit; infinite where uncontrolled.
    pub smallest_detectable: f64,
    /// Verdict.
    pub verdict: Verdict,
    /// Image point of the sighting (col, row), pixel, for plots; NaN where there is none.
    pub pixel: [f64; 2],
    /// Observed range of the sighting, metre; NaN where there is none.
    pub range_m: f64,
    /// Amplitude of the sighting; NaN where there is none.
    pub amplitude: f64,
    /// For ranges: observed range minus distance between adjusted points, without any range term taken off, metre: the
    /// error before calibration. NaN for other components.
    pub uncorrected_m: f64,
}

/// Figures of an observation group.
#[derive(Debug, Clone, PartialEq)]
pub struct GroupQuality {
    /// Name: `col`, `row`, `range`, ...
    pub name: String,
    /// Observed values.
    pub observations: usize,
    /// Part of the redundancy.
    pub redundancy: f64,
    /// Root mean square of the residuals, unit of the group.
    pub rms: f64,
    /// `√(vᵀPv / redundancy)` of the group, the first estimate of its variance component: how much larger its standard
    /// deviations seem to be than they were given.
    pub sigma0: Option<f64>,
}

/// Why a term was taken or left out.
#[derive(Debug, Clone, PartialEq)]
pub struct TermDecision {
    /// Names of the terms decided on together (a pair of periodic terms, a single coefficient).
    pub terms: Vec<String>,
    /// Whether the observations speak for them. Those that they do not speak for are estimated as well, with what cameras
    /// show of them; a spline stands in place of the sines, or not at all.
    pub taken: bool,
    /// p-value of their joint significance.
    pub significance_p: f64,
    /// Change of Schwarz's criterion when they are added; negative speaks for them.
    pub delta_bic: f64,
    /// The reason, in a sentence.
    pub reason: String,
}

/// What the residuals say of terms that are not estimated, without an adjustment with them.
#[derive(Debug, Clone, PartialEq)]
pub struct TermScore {
    /// Names of the terms, which are looked at together.
    pub terms: Vec<String>,
    /// What vᵀPv over the variance factor would fall by with them.
    pub statistic: f64,
    /// Probability of more, were they zero.
    pub p: f64,
    /// Change of Schwarz's criterion with them; negative speaks for them.
    pub delta_bic: f64,
}
