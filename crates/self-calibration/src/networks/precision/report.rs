//! From a solved network to the outcome.

use std::collections::BTreeMap;

use adjust::{BlockId, Scale, Solution};
use error_models::{ParameterStatus, RangeErrorModel};
use nalgebra::{DMatrix, Matrix3, Matrix6};
use statistics::Distribution;

use crate::Result;
use crate::networks::functional_model::hyperbola_steps::covariance_of_terms;
use crate::networks::functional_model::problem::{Calibration, RangeSet, Setup, Solved};
use crate::networks::functional_model::terms::{
    camera_from, camera_names, camera_values, range_model_from, range_names, range_values, unit,
};
use crate::networks::precision::quality::{groups, noncentrality};
use crate::networks::{
    AdjustedStation, AdjustedTarget, CalibratedParameter, CalibrationOptions, CalibrationOutcome, Network, Verdict,
};

/// Estimated calibration parameters: names and covariance, prior-scaled.
#[derive(Debug, Clone)]
pub(crate) struct Estimate {
    pub(crate) names: Vec<String>,
    pub(crate) covariance: DMatrix<f64>,
    /// See [`CalibrationOutcome::first_order_covariance`].
    pub(crate) first_order: DMatrix<f64>,
}

impl Setup<'_> {
    /// Blocks and components of the estimated calibration parameters, with their names.
    pub(crate) fn estimated_parameters(&self, solved: &Solved) -> Vec<(String, BlockId, usize)> {
        let names = camera_names().into_iter().map(str::to_owned);
        let mut out: Vec<_> =
            names.enumerate().map(|(i, name)| (name.clone(), name, solved.blocks.camera, i)).collect();
        for (set, &block) in self.calibration.sets.iter().zip(&solved.blocks.sets) {
            let names = range_names(&set.model).into_iter().enumerate();
            out.extend(names.map(|(i, name)| (format!("{name}{}", set.suffix), name, block, i)));
        }
        let estimated = out.into_iter().filter(|(_, name, ..)| self.estimated.contains(name));
        estimated.map(|(full, _, block, component)| (full, block, component)).collect()
    }

    /// Estimated calibration parameters with the covariance of their values.
    pub(crate) fn estimate_of_terms(&self, solved: &Solved) -> Result<Estimate> {
        let Estimate { names, covariance, .. } = self.estimate(solved)?;
        let found = self.calibration_found(solved)?.sets;
        let of_terms = covariance_of_terms(&names, [&self.calibration.sets, &found], &self.estimated, &covariance);
        Ok(Estimate { names, covariance: of_terms.full, first_order: of_terms.first_order })
    }

    /// Estimated calibration parameters with the covariance of the adjustment's steps: a hyperbola is stepped in other
    /// numbers.
    pub(crate) fn estimate(&self, solved: &Solved) -> Result<Estimate> {
        let parameters = self.estimated_parameters(solved);
        let places: Vec<_> = parameters.iter().map(|(_, block, component)| (*block, *component)).collect();
        let covariance = covariance_of(&solved.solution, &places)?;
        let names = parameters.into_iter().map(|(name, ..)| name).collect();
        Ok(Estimate { names, first_order: covariance.clone(), covariance })
    }

    /// The calibration with the solution's values and the spans that were observed.
    pub(crate) fn calibration_found(&self, solved: &Solved) -> Result<Calibration> {
        let values = solved.solution.values(solved.blocks.camera)?;
        let camera = camera_from(&self.calibration.camera, values).unwrap_or(self.calibration.camera);
        let mut sets = self.calibration.sets.clone();
        for (set, &block) in sets.iter_mut().zip(&solved.blocks.sets) {
            set.model = range_model_from(&set.model, solved.solution.values(block)?);
        }
        let used = |index: usize| self.uses_range(index);
        set_spans(self.network, &mut sets, used);
        Ok(Calibration { camera, sets })
    }

    /// The whole outcome of one adjustment.
    pub(crate) fn outcome(&self, solved: &Solved, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
        let solution = &solved.solution;
        let calibration = self.calibration_found(solved)?;
        let estimate = self.estimate_of_terms(solved)?;
        let residuals = self.qualities(solved, noncentrality(options))?;
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
            stations: self.stations(solved)?,
            targets: self.targets(solved)?,
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

    pub(crate) fn stations(&self, solved: &Solved) -> Result<Vec<AdjustedStation>> {
        let stations = self.network.stations.iter().zip(&solved.blocks.stations);
        let adjusted = stations.map(|(station, &block)| {
            let covariance = solved.solution.covariance(block, Scale::Prior)?;
            Ok(AdjustedStation {
                name: station.name.clone(),
                world_from_camera: solved.solution.pose(block)?,
                covariance: Matrix6::from_fn(|row, column| covariance[(row, column)]),
            })
        });
        adjusted.collect()
    }

    pub(crate) fn targets(&self, solved: &Solved) -> Result<Vec<AdjustedTarget>> {
        let targets = self.network.targets.iter().zip(&solved.blocks.targets);
        let adjusted = targets.filter_map(|(target, block)| Some((target, (*block)?))).map(|(target, block)| {
            let covariance = solved.solution.covariance(block, Scale::Prior)?;
            Ok(AdjustedTarget {
                name: target.name.clone(),
                point: nalgebra::Point3::from_slice(solved.solution.values(block)?),
                covariance: Matrix3::from_fn(|row, column| covariance[(row, column)]),
            })
        });
        adjusted.collect()
    }
}

/// Figures of the fit.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Fit {
    pub(crate) observations: usize,
    pub(crate) unknowns: usize,
    pub(crate) datum_defect: usize,
    pub(crate) redundancy: i64,
    pub(crate) vtpv: f64,
}

impl Fit {
    /// `vᵀPv / redundancy`.
    pub(crate) fn variance_factor(&self) -> Option<f64> {
        (self.redundancy > 0).then(|| self.vtpv / self.redundancy as f64)
    }

    /// Akaike's and Schwarz's criterion for an unknown variance factor, `n ln(vᵀPv / n) + 2 k` and `… + k ln n`, k counting
    /// the free unknowns and the variance factor.
    pub(crate) fn information_criteria(&self) -> (f64, f64) {
        let n = self.observations as f64;
        let free = self.unknowns as f64 - self.datum_defect as f64 + 1.0;
        // Without noise nothing is left over: the smallest double stands for it.
        let misfit = n * (self.vtpv / n).max(f64::MIN_POSITIVE).ln();
        (misfit + 2.0 * free, misfit + free * n.ln())
    }
}

/// Covariance of chosen parameters.
pub(crate) fn covariance_of(solution: &Solution, places: &[(BlockId, usize)]) -> Result<DMatrix<f64>> {
    let mut between: BTreeMap<(BlockId, BlockId), DMatrix<f64>> = BTreeMap::new();
    let mut out = DMatrix::zeros(places.len(), places.len());
    for (row, &(first, i)) in places.iter().enumerate() {
        for (column, &(second, j)) in places.iter().enumerate() {
            let block = match between.entry((first, second)) {
                std::collections::btree_map::Entry::Occupied(entry) => entry.into_mut(),
                std::collections::btree_map::Entry::Vacant(entry) => {
                    entry.insert(solution.covariance_between(first, second, Scale::Prior)?)
                }
            };
            out[(row, column)] = block[(i, j)];
        }
    }
    Ok(out)
}

/// Range models by integration time.
pub(crate) fn models(sets: &[RangeSet]) -> Vec<(Option<f64>, RangeErrorModel)> {
    sets.iter().map(|set| (set.time, set.model.clone())).collect()
}

/// All calibration parameters, estimated and held.
pub(crate) fn parameters(calibration: &Calibration, estimate: &Estimate, fit: &Fit) -> Vec<CalibratedParameter> {
    let camera = camera_names().into_iter().zip(camera_values(&calibration.camera));
    let mut all: Vec<(String, String, f64)> = camera.map(|(name, value)| (name.into(), name.into(), value)).collect();
    for set in &calibration.sets {
        let terms = range_names(&set.model).into_iter().zip(range_values(&set.model));
        all.extend(terms.map(|(name, value)| (format!("{name}{}", set.suffix), name, value)));
    }
    let scale = fit.variance_factor().map_or(f64::NAN, f64::sqrt);
    let parameter = |(full, name, value): (String, String, f64)| {
        let column = estimate.names.iter().position(|known| *known == full);
        let sigma = column.map(|column| estimate.covariance[(column, column)].max(0.0).sqrt());
        let (sigma_prior, status) = sigma.map_or((0.0, ParameterStatus::Held), |s| (s, ParameterStatus::Estimated));
        let sigma_posterior = if sigma.is_some() { scale * sigma_prior } else { 0.0 };
        let student = Distribution::StudentT { dof: fit.redundancy as f64 };
        let significance_p = sigma.map_or(f64::NAN, |_| student.p_value(value / sigma_posterior));
        let unit = unit(&name).to_owned();
        CalibratedParameter { name: full, value, sigma_prior, sigma_posterior, unit, status, significance_p }
    };
    all.into_iter().map(parameter).collect()
}

/// Puts the spans of the observed ranges and amplitudes into the models.
pub(crate) fn set_spans(network: &Network, sets: &mut [RangeSet], used: impl Fn(usize) -> bool) {
    let empty = [f64::INFINITY, f64::NEG_INFINITY];
    let extend = |[low, high]: [f64; 2], value: f64| [low.min(value), high.max(value)];
    for set in sets {
        let (mut ranges, mut amplitudes) = (empty, empty);
        for (index, seen) in network.sightings.iter().enumerate() {
            let own = network.stations[seen.station].integration_time_s == set.time;
            if let Some(range_m) = seen.range_m.filter(|_| own && used(index)) {
                ranges = extend(ranges, range_m);
                amplitudes = seen.amplitude.map_or(amplitudes, |amplitude| extend(amplitudes, amplitude));
            }
        }
        set.model.range_span_m = Some(ranges).filter(|[low, high]| low <= high).or(set.model.range_span_m);
        if let Some(hyperbola) = set.model.hyperbola.as_mut()
            && amplitudes[0] <= amplitudes[1]
        {
            hyperbola.amplitude_span = amplitudes;
        }
    }
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
}
