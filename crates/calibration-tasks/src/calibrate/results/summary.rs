//! Every figure of a calibration, by name: `summary.json`.

use std::path::PathBuf;

use commands::{Doubt, DoubtKind, Judged};
use error_models::ParameterStatus;
use nalgebra::DMatrix;
use pipeline::survey::ViewDrift;
use pipeline::trends::TrendSummary;
use range_io::calibration::Calibration;
use self_calibration::{CalibratedParameter, CalibrationOutcome, Component, ObservationQuality, Verdict};
use serde::Serialize;
use serde::ser::{SerializeMap, Serializer};

use crate::calibrate::planes::offset::{FoundTable, OffsetTableSummary};
use crate::calibrate::request::CalibrateMethod;
use crate::calibrate::results::carried::{notes, taken_over};
use crate::calibrate::results::certificate::Certificate;
use crate::calibrate::results::names::group_unit;
use crate::calibrate::results::trends::trends;
use crate::calibrate::start::Start;

/// Names and units of the parameters that a summary always has, in its order: those of camera and range terms.
fn always_listed() -> impl Iterator<Item = (&'static str, &'static str)> {
    Calibration::CAMERA_PARAMETERS.into_iter().chain(error_models::PARAMETERS)
}

/// What a calibration found and how good it is.
#[derive(Debug, Clone, Serialize)]
pub struct CalibrationSummary {
    /// The survey's folder.
    pub survey: String,
    /// Method.
    pub method: &'static str,
    /// What the method does.
    #[serde(skip)]
    pub describe: &'static str,
    /// Where the start values came from.
    pub start: String,
    /// Parts of the start calibration that the new one has as they are: `noise`, `scattering` and so on.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub taken_over: Vec<&'static str>,
    /// What the ranges of each station had drifted by, where the drift of a warming camera was taken off.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub drifts: Vec<ViewDrift>,
    /// Observed values used.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Inner constraints.
    pub datum_defect: usize,
    /// Observed values and inner constraints minus unknowns.
    pub redundancy: i64,
    /// vᵀPv; `None` where the calibration was refused.
    pub vtpv: Option<f64>,
    /// Posterior standard deviation of unit weight; `None` without redundancy or where the calibration was refused.
    pub sigma0: Option<f64>,
    /// Iterations of the final adjustment.
    pub iterations: usize,
    /// Whether there is a result to trust; without one there are no parameters either.
    pub converged: bool,
    /// All parameters, estimated and held, by name; empty where the calibration was refused.
    pub parameters: ParameterMap,
    /// Correlations of the estimated parameters.
    pub correlation: CorrelationSummary,
    /// Observed values rejected as gross errors.
    pub rejected: Vec<RejectedObservation>,
    /// What is weakly determined and what would cure it; why the calibration was refused.
    pub diagnosis: Vec<String>,
    /// What speaks against the result as a whole.
    pub doubts: Vec<Doubt>,
    /// Observation groups.
    pub groups: Vec<GroupSummary>,
    /// The ranges by amplitude, the darkest first.
    pub amplitude_classes: Vec<GroupSummary>,
    /// The look-up table of offsets, where one was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub offset_table: Option<OffsetTableSummary>,
    /// Decisions of the automatic choice of terms.
    pub decisions: Vec<DecisionSummary>,
    /// Whether the residuals of planes still depend on something.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub trends: Vec<TrendSummary>,
    /// What the certificate says; `None` where the calibration was refused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub certificate: Option<Certificate>,
    /// Wall-clock time of the whole run, second.
    pub seconds: f64,
    /// The output folder.
    pub out: PathBuf,
}

/// One parameter.
#[derive(Debug, Clone, Serialize)]
pub struct ParameterSummary {
    /// Value in [`Self::unit`].
    pub value: f64,
    /// Standard deviation from the a-priori deviations of the observations; 0 where held.
    pub sigma_prior: f64,
    /// The same scaled with sigma0; NaN (null in the file) without redundancy.
    pub sigma_posterior: f64,
    /// Unit.
    pub unit: String,
    /// `estimated` or `held`.
    pub status: &'static str,
}

/// Parameters by name, in the order of the model and not of the alphabet.
#[derive(Debug, Clone, Default)]
pub struct ParameterMap(pub Vec<(String, ParameterSummary)>);

impl ParameterMap {
    /// A parameter by its name.
    pub fn get(&self, name: &str) -> Option<&ParameterSummary> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, parameter)| parameter)
    }

    pub(crate) fn new(parameters: &[CalibratedParameter]) -> Self {
        let entry = |parameter: &CalibratedParameter| {
            let summary = ParameterSummary {
                value: parameter.value,
                sigma_prior: parameter.sigma_prior,
                sigma_posterior: parameter.sigma_posterior,
                unit: parameter.unit.clone(),
                status: status_name(parameter.status),
            };
            (parameter.name.clone(), summary)
        };
        let find = |name: &str| parameters.iter().find(|parameter| parameter.name == name);
        let absent = |unit: &str| ParameterSummary {
            value: 0.0,
            sigma_prior: 0.0,
            sigma_posterior: 0.0,
            unit: unit.to_owned(),
            status: status_name(ParameterStatus::Held),
        };
        let always = always_listed().map(|(name, unit)| match find(name) {
            Some(parameter) => entry(parameter),
            None => (name.to_owned(), absent(unit)),
        });
        let further = parameters.iter().filter(|p| !always_listed().any(|(name, _)| name == p.name)).map(entry);
        Self(always.chain(further).collect())
    }
}

impl Serialize for ParameterMap {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(Some(self.0.len()))?;
        for (name, parameter) in &self.0 {
            map.serialize_entry(name, parameter)?;
        }
        map.end()
    }
}

/// `estimated` or `held`.
pub(crate) fn status_name(status: ParameterStatus) -> &'static str {
    match status {
        ParameterStatus::Estimated => "estimated",
        ParameterStatus::Held => "held",
    }
}

/// Names and the matrix row by row.
#[derive(Debug, Clone, Default, Serialize)]
pub struct CorrelationSummary {
    /// Estimated parameters.
    pub names: Vec<String>,
    /// Rows in the order of the names.
    pub matrix: Vec<Vec<f64>>,
}

impl CorrelationSummary {
    pub(crate) fn new(names: &[String], covariance: &DMatrix<f64>) -> Self {
        let n = names.len().min(covariance.nrows()).min(covariance.ncols());
        let element = |i: usize, j: usize| {
            if i == j {
                return 1.0;
            }
            // Rounding must not carry a correlation beyond 1, nor make the matrix asymmetric.
            let mean = f64::midpoint(covariance[(i, j)], covariance[(j, i)]);
            (mean / (covariance[(i, i)] * covariance[(j, j)]).sqrt()).clamp(-1.0, 1.0)
        };
        let matrix = (0..n).map(|i| (0..n).map(|j| element(i, j)).collect()).collect();
        Self { names: names[..n].to_vec(), matrix }
    }
}

/// An observed value that was rejected.
#[derive(Debug, Clone, Serialize)]
pub struct RejectedObservation {
    /// Line of `observations.csv`; `None` for what stands in another file.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub line: Option<usize>,
    /// Station.
    pub station: String,
    /// Target.
    pub target: String,
    /// Component.
    pub component: &'static str,
    /// Observed value in [`Self::unit`].
    pub observed: f64,
    /// Observed minus predicted, same unit.
    pub residual: f64,
    /// Residual over its standard deviation; NaN (null in the file) where the test states none for what it rejected.
    pub standardised_residual: f64,
    /// Residual over the a-priori standard deviation of the observation.
    pub residual_in_sigmas: f64,
    /// Unit of the component.
    pub unit: &'static str,
}

/// An observation group.
#[derive(Debug, Clone, Serialize)]
pub struct GroupSummary {
    /// Name.
    pub name: String,
    /// Observed values.
    pub observations: usize,
    /// Part of the redundancy.
    pub redundancy: f64,
    /// Root mean square of the residuals, in [`Self::unit`].
    pub rms: f64,
    /// Unit.
    pub unit: &'static str,
    /// How much larger its standard deviations are than they were given.
    pub sigma0: Option<f64>,
}

/// A decision of the automatic choice of terms.
#[derive(Debug, Clone, Serialize)]
pub struct DecisionSummary {
    /// Terms decided on together.
    pub terms: Vec<String>,
    /// Whether they are estimated.
    pub taken: bool,
    /// p-value of their joint significance.
    pub significance_p: f64,
    /// Change of Schwarz's criterion; negative speaks for them.
    pub delta_bic: f64,
    /// The reason.
    pub reason: String,
}

impl CalibrationSummary {
    /// The figures of an outcome.
    pub(crate) fn new(
        survey: String,
        method: CalibrateMethod,
        start: &Start,
        outcome: &CalibrationOutcome,
        table: Option<&FoundTable>,
    ) -> Self {
        Self {
            survey,
            method: method.name(),
            describe: method.describe(),
            start: start.words.clone(),
            taken_over: taken_over(start, table.is_some()),
            drifts: start.drifts.clone(),
            observations: outcome.observations,
            unknowns: outcome.unknowns,
            datum_defect: outcome.datum_defect,
            redundancy: outcome.redundancy,
            vtpv: Some(outcome.vtpv),
            sigma0: outcome.sigma0,
            iterations: outcome.trace.len(),
            converged: true,
            parameters: ParameterMap::new(&outcome.parameters),
            correlation: CorrelationSummary::new(&outcome.estimated, &outcome.covariance),
            rejected: rejected(outcome, start),
            diagnosis: [outcome.diagnosis.clone(), notes(start, outcome, table.is_some())].concat(),
            doubts: outcome.doubts.iter().map(|words| Doubt::new(DoubtKind::Contradiction, words)).collect(),
            groups: outcome.groups.iter().map(|group| group_summary(group, &group.name)).collect(),
            amplitude_classes: outcome.amplitude_classes().iter().map(|class| group_summary(class, "range")).collect(),
            offset_table: table.map(|table| table.summary.clone()),
            decisions: decisions(outcome),
            trends: match method {
                CalibrateMethod::Planes => trends(outcome, table.and_then(FoundTable::worth_applying).as_ref()),
                // What surfaces leave is counted against others that have the same errors.
                CalibrateMethod::Surfaces | CalibrateMethod::Network(_) => Vec::new(),
            },
            certificate: None,
            seconds: 0.0,
            out: PathBuf::new(),
        }
    }

    /// What is left to say where a calibration was refused: why, and no parameter.
    pub(crate) fn refused(survey: String, method: CalibrateMethod, start: &Start, reason: String) -> Self {
        Self {
            survey,
            method: method.name(),
            describe: method.describe(),
            start: start.words.clone(),
            taken_over: Vec::new(),
            drifts: start.drifts.clone(),
            observations: 0,
            unknowns: 0,
            datum_defect: 0,
            redundancy: 0,
            vtpv: None,
            sigma0: None,
            iterations: 0,
            converged: false,
            parameters: ParameterMap::default(),
            correlation: CorrelationSummary::default(),
            rejected: Vec::new(),
            diagnosis: vec![reason],
            doubts: Vec::new(),
            groups: Vec::new(),
            amplitude_classes: Vec::new(),
            offset_table: None,
            decisions: Vec::new(),
            trends: Vec::new(),
            certificate: None,
            seconds: 0.0,
            out: PathBuf::new(),
        }
    }
}

impl Judged for CalibrationSummary {
    fn doubts(&self) -> &[Doubt] {
        &self.doubts
    }
}

fn rejected(outcome: &CalibrationOutcome, start: &Start) -> Vec<RejectedObservation> {
    let own = |quality: &ObservationQuality| {
        let seen = matches!(quality.component, Component::Col | Component::Row | Component::Range);
        let key = (quality.station.clone(), quality.target.clone());
        start.lines.get(&key).copied().filter(|_| seen)
    };
    let gross = outcome.residuals.iter().filter(|quality| quality.verdict == Verdict::Rejected);
    gross
        .map(|quality| RejectedObservation {
            line: own(quality),
            station: quality.station.clone(),
            target: quality.target.clone(),
            component: quality.component.name(),
            observed: quality.observed,
            residual: quality.residual,
            standardised_residual: quality.standardised,
            residual_in_sigmas: quality.residual / quality.sigma,
            unit: group_unit(quality.component.name()),
        })
        .collect()
}

/// `kind` is the group that the unit belongs to.
fn group_summary(group: &self_calibration::GroupQuality, kind: &str) -> GroupSummary {
    GroupSummary {
        name: group.name.clone(),
        observations: group.observations,
        redundancy: group.redundancy,
        rms: group.rms,
        unit: group_unit(kind),
        sigma0: group.sigma0,
    }
}

fn decisions(outcome: &CalibrationOutcome) -> Vec<DecisionSummary> {
    let decision = |decision: &self_calibration::TermDecision| DecisionSummary {
        terms: decision.terms.clone(),
        taken: decision.taken,
        significance_p: decision.significance_p,
        delta_bic: decision.delta_bic,
        reason: decision.reason.clone(),
    };
    outcome.decisions.iter().map(decision).collect()
}
