//! From a solved network to the outcome.

use std::collections::BTreeMap;

use adjust::{BlockId, Scale, Solution};
use error_models::{ParameterStatus, RangeErrorModel};
use nalgebra::{DMatrix, Isometry3, Matrix3, Matrix6};
use rigid_pose::{product_jacobians, symmetrised};
use statistics::Distribution;

use crate::functional_model::hyperbola_steps::covariance_of_terms;
use crate::functional_model::setup::{Calibration, RangeSet, Setup, Solved};
use crate::functional_model::terms::{
    camera_from, camera_names, camera_values, range_model_from, range_names, range_values, unit,
};
use crate::{AdjustedStation, AdjustedTarget, CalibratedParameter, Network, Result};

/// Estimated calibration parameters: names and covariance, prior-scaled.
#[derive(Debug, Clone)]
pub struct Estimate {
    /// Their names, in the order of the matrices.
    pub names: Vec<String>,
    /// Covariance of their values.
    pub covariance: DMatrix<f64>,
    /// Its first-order part: what derivatives by the parameters carry to corrected ranges and points.
    pub first_order: DMatrix<f64>,
}

impl Setup<'_> {
    /// Blocks and components of the estimated calibration parameters, with their names.
    pub fn estimated_parameters(&self, solved: &Solved) -> Vec<(String, BlockId, usize)> {
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
    pub fn estimate_of_terms(&self, solved: &Solved) -> Result<Estimate> {
        let Estimate { names, covariance, .. } = self.estimate(solved)?;
        let found = self.calibration_found(solved)?.sets;
        let of_terms = covariance_of_terms(&names, [&self.calibration.sets, &found], &self.estimated, &covariance);
        Ok(Estimate { names, covariance: of_terms.full, first_order: of_terms.first_order })
    }

    /// Estimated calibration parameters with the covariance of the adjustment's steps: a hyperbola is stepped in other
    /// numbers.
    pub fn estimate(&self, solved: &Solved) -> Result<Estimate> {
        let parameters = self.estimated_parameters(solved);
        let places: Vec<_> = parameters.iter().map(|(_, block, component)| (*block, *component)).collect();
        let covariance = covariance_of(&solved.solution, &places)?;
        let names = parameters.into_iter().map(|(name, ..)| name).collect();
        Ok(Estimate { names, first_order: covariance.clone(), covariance })
    }

    /// The calibration with the solution's values and the spans that were observed.
    pub fn calibration_found(&self, solved: &Solved) -> Result<Calibration> {
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

    /// Adjusted stations of the camera with their covariances, in the network's order.
    pub fn stations(&self, solved: &Solved) -> Result<Vec<AdjustedStation>> {
        let stations = self.network.stations.iter().zip(&solved.blocks.stations);
        let adjusted = stations.map(|(station, &block)| {
            let (world_from_camera, covariance) = match solved.blocks.mounting {
                Some(mounting) => mounted(&solved.solution, block, mounting)?,
                None => (solved.solution.pose(block)?, pose_covariance(&solved.solution, [block; 2])?),
            };
            Ok(AdjustedStation { name: station.name.clone(), world_from_camera, covariance })
        });
        adjusted.collect()
    }

    /// Adjusted targets with their covariances; those without start values are left out.
    pub fn targets(&self, solved: &Solved) -> Result<Vec<AdjustedTarget>> {
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

/// Covariance between two poses, or of one.
fn pose_covariance(solution: &Solution, [row, column]: [BlockId; 2]) -> Result<Matrix6<f64>> {
    let covariance = solution.covariance_between(row, column, Scale::Prior)?;
    Ok(Matrix6::from_fn(|row, column| covariance[(row, column)]))
}

/// The pose of a camera on a rig, with its covariance.
fn mounted(solution: &Solution, rig: BlockId, mounting: BlockId) -> Result<(Isometry3<f64>, Matrix6<f64>)> {
    let (world_from_rig, rig_from_camera) = (solution.pose(rig)?, solution.pose(mounting)?);
    let (by_rig, by_mounting) = product_jacobians(&world_from_rig, &rig_from_camera);
    let shared = by_rig * pose_covariance(solution, [rig, mounting])? * by_mounting.transpose();
    let own = by_rig * pose_covariance(solution, [rig; 2])? * by_rig.transpose()
        + by_mounting * pose_covariance(solution, [mounting; 2])? * by_mounting.transpose();
    Ok((world_from_rig * rig_from_camera, symmetrised(&(own + shared + shared.transpose()))))
}

/// Figures of the fit.
#[derive(Debug, Clone, Copy)]
pub struct Fit {
    /// Observed values that took part.
    pub observations: usize,
    /// Unknowns.
    pub unknowns: usize,
    /// Inner constraints.
    pub datum_defect: usize,
    /// Observations and inner constraints less unknowns.
    pub redundancy: i64,
    /// vᵀPv.
    pub vtpv: f64,
}

impl Fit {
    /// `vᵀPv / redundancy`.
    pub fn variance_factor(&self) -> Option<f64> {
        (self.redundancy > 0).then(|| self.vtpv / self.redundancy as f64)
    }

    /// Akaike's and Schwarz's criterion for an unknown variance factor, `n ln(vᵀPv / n) + 2 k` and `… + k ln n`, k counting
    /// the free unknowns and the variance factor.
    pub fn information_criteria(&self) -> (f64, f64) {
        let n = self.observations as f64;
        let free = self.unknowns as f64 - self.datum_defect as f64 + 1.0;
        // Without noise nothing is left over: the smallest double stands for it.
        let misfit = n * (self.vtpv / n).max(f64::MIN_POSITIVE).ln();
        (misfit + 2.0 * free, misfit + free * n.ln())
    }
}

/// Covariance of chosen parameters.
pub fn covariance_of(solution: &Solution, places: &[(BlockId, usize)]) -> Result<DMatrix<f64>> {
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
pub fn models(sets: &[RangeSet]) -> Vec<(Option<f64>, RangeErrorModel)> {
    sets.iter().map(|set| (set.time, set.model.clone())).collect()
}

/// All calibration parameters, estimated and held.
pub fn parameters(calibration: &Calibration, estimate: &Estimate, fit: &Fit) -> Vec<CalibratedParameter> {
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
pub fn set_spans(network: &Network, sets: &mut [RangeSet], used: impl Fn(usize) -> bool) {
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
