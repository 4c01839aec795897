//! What a calibration found, and how well.

use adjust::TraceEntry;
use calibration_network::functional_model::{Setup, Solved};
use calibration_network::precision::{Fit, amplitude_classes, groups, models, noncentrality, parameters};
use camera_model::Camera;
use error_models::RangeErrorModel;
use nalgebra::DMatrix;

use crate::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOptions, Cause, GroupQuality, Method,
    ObservationQuality, Result, Verdict,
};

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
    /// Names of the estimated parameters, in the order of the rows of the covariances.
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
    /// Akaike's information criterion.
    pub aic: f64,
    /// Schwarz's criterion.
    pub bic: f64,
    /// What each iteration did.
    pub trace: Vec<TraceEntry>,
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

impl CalibrationOutcome {
    /// Correlation matrix of [`Self::estimated`].
    pub fn correlation(&self) -> DMatrix<f64> {
        let q = &self.covariance;
        let n = q.nrows();
        DMatrix::from_fn(n, n, |row, column| q[(row, column)] / (q[(row, row)] * q[(column, column)]).sqrt())
    }

    /// Number of rejected values.
    pub fn rejected(&self) -> usize {
        self.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected).count()
    }

    /// A parameter by its name.
    pub fn parameter(&self, name: &str) -> Option<&CalibratedParameter> {
        self.parameters.iter().find(|parameter| parameter.name == name)
    }

    /// Figures of the ranges by amplitude, in four classes of equal size, the darkest first: whether the standard
    /// deviations that were stated hold for dark and for bright targets. Empty where no range has an amplitude, or a
    /// redundancy number.
    pub fn amplitude_classes(&self) -> Vec<GroupQuality> {
        amplitude_classes(&self.residuals)
    }
}

/// The whole outcome of one adjustment: values, deviations and residuals of a camera. What speaks against them is not in it
/// yet: see [`CalibrationOutcome::doubts_of_tests`] and [`CalibrationOutcome::doubts_of_rejection`].
///
/// # Errors
/// A covariance that the solution does not have.
pub fn outcome(setup: &Setup<'_>, solved: &Solved, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    let solution = &solved.solution;
    let calibration = setup.calibration_found(solved)?;
    let estimate = setup.estimate_of_terms(solved)?;
    let residuals = setup.qualities(solved, noncentrality(options.rejection_level))?;
    let figures = Fit {
        observations: solution.observations(),
        unknowns: solution.unknowns(),
        datum_defect: solved.datum_defect,
        redundancy: solution.redundancy(),
        vtpv: solution.vtpv(),
    };
    let (aic, bic) = figures.information_criteria();
    Ok(CalibrationOutcome {
        method: options.method,
        camera: calibration.camera,
        range_models: models(&calibration.sets),
        parameters: parameters(&calibration, &estimate, &figures),
        estimated: estimate.names,
        covariance: estimate.covariance,
        first_order_covariance: estimate.first_order,
        stations: setup.stations(solved)?,
        targets: setup.targets(solved)?,
        groups: groups(&residuals),
        residuals,
        decisions: Vec::new(),
        diagnosis: Vec::new(),
        doubts: Vec::new(),
        causes: Vec::new(),
        unestimated: Vec::new(),
        observations: figures.observations,
        unknowns: figures.unknowns,
        datum_defect: figures.datum_defect,
        redundancy: figures.redundancy,
        vtpv: figures.vtpv,
        sigma0: solution.sigma0(),
        aic,
        bic,
        trace: solution.trace().to_vec(),
    })
}
