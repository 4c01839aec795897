//! The outcome of two steps: what the first found, the range terms of the second, and what they share.

use adjust::Scale;
use calibration_network::functional_model::{Calibration, Row, Setup, Source};
use calibration_network::precision::{
    Estimate, Figures, Fit, Geometry, groups, models, noncentrality, parameters, set_spans,
};
use nalgebra::{DMatrix, Matrix3, Matrix6, Vector3};

use crate::methods::range_step::RangeStep;
use crate::methods::reference::Reference;
use crate::{
    AdjustedStation, AdjustedTarget, CalibrationOptions, CalibrationOutcome, Component, ObservationQuality, Result,
    Verdict,
};

/// Both steps.
pub(crate) struct Combined<'s, 'n> {
    pub(crate) setup: &'s Setup<'n>,
    /// Outcome of the first step.
    pub(crate) first: CalibrationOutcome,
    /// Names of its estimated parameters, the first rows of what the reference carries.
    pub(crate) first_names: Vec<String>,
    pub(crate) step: RangeStep,
    /// Reference of all ranges, rejected or not.
    pub(crate) reference: Reference,
    /// Adjusted poses and coordinates, in the scale of the first step.
    pub(crate) geometry: Geometry,
    /// Outcome of a network before these two.
    pub(crate) before: Option<CalibrationOutcome>,
}

/// An outcome with nothing but what was given: where there is no first step.
pub(crate) fn given(setup: &Setup<'_>, options: &CalibrationOptions) -> CalibrationOutcome {
    let network = setup.network;
    let station = |station: &crate::Station| {
        let world_from_camera = station.world_from_camera?;
        let covariance = station.covariance.unwrap_or_else(Matrix6::zeros);
        Some(AdjustedStation { name: station.name.clone(), world_from_camera, covariance })
    };
    let target = |target: &crate::NetworkTarget| {
        let covariance = target.covariance.unwrap_or_else(Matrix3::zeros);
        Some(AdjustedTarget { name: target.name.clone(), point: target.point?, covariance })
    };
    CalibrationOutcome {
        method: options.method,
        camera: setup.calibration.camera,
        range_models: Vec::new(),
        parameters: Vec::new(),
        estimated: Vec::new(),
        covariance: DMatrix::zeros(0, 0),
        first_order_covariance: DMatrix::zeros(0, 0),
        stations: network.stations.iter().filter_map(station).collect(),
        targets: network.targets.iter().filter_map(target).collect(),
        residuals: Vec::new(),
        groups: Vec::new(),
        decisions: Vec::new(),
        diagnosis: Vec::new(),
        doubts: Vec::new(),
        causes: Vec::new(),
        unestimated: Vec::new(),
        observations: 0,
        unknowns: 0,
        datum_defect: 0,
        redundancy: 0,
        vtpv: 0.0,
        sigma0: None,
        aic: f64::NAN,
        bic: f64::NAN,
        trace: Vec::new(),
    }
}

/// Puts both steps together.
pub(crate) fn combine(parts: Combined<'_, '_>, options: &CalibrationOptions) -> Result<CalibrationOutcome> {
    let ranges = parts.range_qualities(noncentrality(options.rejection_level))?;
    let estimate = parts.estimate();
    let fit = parts.fit();
    let mut calibration = Calibration { camera: parts.first.camera, sets: parts.step.sets.clone() };
    let used: std::collections::BTreeSet<usize> = parts.step.reference.sightings.iter().copied().collect();
    set_spans(parts.setup.network, &mut calibration.sets, |index| used.contains(&index));
    let (stations, targets) = parts.scaled();
    let Combined { first, step, before, .. } = parts;
    let (aic, bic) = fit.information_criteria();
    let kept = first.residuals.into_iter().filter(|quality| quality.component != Component::Range);
    let earlier = before.as_ref().map_or(&[][..], |before| &before.residuals);
    let earlier = earlier.iter().filter(|quality| quality.component != Component::Range).cloned();
    let residuals: Vec<ObservationQuality> = earlier.chain(kept).chain(ranges).collect();
    let mut trace = before.as_ref().map_or_else(Vec::new, |before| before.trace.clone());
    trace.extend(first.trace);
    trace.extend(step.solution.trace());
    let (mut all_stations, mut all_targets) =
        before.map_or_else(Default::default, |before| (before.stations, before.targets));
    all_stations.extend(stations);
    all_targets.extend(targets);
    Ok(CalibrationOutcome {
        method: options.method,
        camera: calibration.camera,
        range_models: models(&calibration.sets),
        parameters: parameters(&calibration, &estimate, &fit),
        estimated: estimate.names,
        covariance: estimate.covariance,
        first_order_covariance: estimate.first_order,
        stations: all_stations,
        targets: all_targets,
        groups: groups(&residuals),
        residuals,
        decisions: Vec::new(),
        diagnosis: Vec::new(),
        doubts: Vec::new(),
        causes: Vec::new(),
        unestimated: Vec::new(),
        observations: fit.observations,
        unknowns: fit.unknowns,
        datum_defect: fit.datum_defect,
        redundancy: fit.redundancy,
        vtpv: fit.vtpv,
        sigma0: fit.variance_factor().map(f64::sqrt),
        aic,
        bic,
        trace,
    })
}

impl Combined<'_, '_> {
    /// Names and joint covariance of the parameters of both steps.
    fn estimate(&self) -> Estimate {
        let (first, second) = (self.first_names.len(), self.step.names.len());
        let shared = self.step.carried.rows(0, first);
        let joint = |of_second: &DMatrix<f64>| {
            let mut covariance = DMatrix::zeros(first + second, first + second);
            covariance.view_mut((0, 0), (first, first)).copy_from(&self.first.covariance);
            covariance.view_mut((first, first), (second, second)).copy_from(of_second);
            covariance.view_mut((0, first), (first, second)).copy_from(&shared);
            covariance.view_mut((first, 0), (second, first)).copy_from(&shared.transpose());
            covariance
        };
        let (covariance, first_order) = (joint(&self.step.covariance), joint(&self.step.first_order));
        let names = self.first_names.iter().chain(&self.step.names).cloned().collect();
        Estimate { names, covariance, first_order }
    }

    /// Figures of all steps together. What stands behind the reference ranges is unknown and observed at once in the second
    /// step, and counted in neither.
    fn fit(&self) -> Fit {
        let solution = &self.step.solution;
        let behind = self.reference.root.ncols();
        let mut fit = Fit {
            observations: self.first.observations + solution.observations() - behind,
            unknowns: self.first.unknowns + solution.unknowns() - behind,
            datum_defect: self.first.datum_defect,
            redundancy: self.first.redundancy + solution.redundancy(),
            vtpv: self.first.vtpv + solution.vtpv(),
        };
        if let Some(before) = &self.before {
            fit.observations += before.observations;
            fit.unknowns += before.unknowns;
            fit.datum_defect += before.datum_defect;
            fit.redundancy += before.redundancy;
            fit.vtpv += before.vtpv;
        }
        fit
    }

    fn range_qualities(&self, noncentrality: f64) -> Result<Vec<ObservationQuality>> {
        let solution = &self.step.solution;
        let scale = if solution.sigma0().is_some() { Scale::Posterior } else { Scale::Prior };
        let standardised = solution.standardised_residuals(scale)?;
        let redundancy = solution.redundancy_numbers();
        let behind = self.reference.root.ncols();
        let factor = self.step.scale.as_ref().map_or(1.0, |(scale, ..)| *scale);
        let mut out = Vec::new();
        for (index, seen) in self.setup.network.sightings.iter().enumerate() {
            let Some(observed) = seen.range_m else { continue };
            let place = self.reference.sightings.binary_search(&index);
            let known = place
                .map_or_else(|_| self.geometry.distance(seen.station, seen.target), |row| self.reference.values[row]);
            let reference = factor * known;
            let figures = if let Ok(row) = self.step.reference.sightings.binary_search(&index) {
                let row = behind + row;
                Figures::used(solution.residuals()[row], redundancy[row], standardised[row])
            } else {
                let rejected = self.step.rejected.contains(&index);
                let verdict = if rejected { Verdict::Rejected } else { Verdict::LeftOut };
                Figures::unused(observed - reference - self.correction(index), verdict)
            };
            let row = Row {
                source: Source::Sighting(index),
                component: Component::Range,
                observed,
                sigma: seen.sigma_range_m,
            };
            let quality = self.setup.quality(&row, figures, noncentrality, &self.geometry);
            out.push(ObservationQuality { uncorrected_m: observed - reference, ..quality });
        }
        Ok(out)
    }

    /// Correction of a sighting's range by the terms found and its known drift; NaN where they have no value.
    fn correction(&self, index: usize) -> f64 {
        let seen = &self.setup.network.sightings[index];
        let (Some(pixel), Some(range_m)) = (seen.pixel, seen.range_m) else { return f64::NAN };
        let camera = &self.first.camera;
        let [x, y] = camera.format.image_from_pixel(pixel);
        let [xp, yp] = camera.interior.principal_point_mm;
        let set = &self.step.sets[self.setup.set_of(seen.station)];
        set.model.correction(range_m, x - xp, y - yp, seen.amplitude.unwrap_or(f64::NAN)).total_m()
            + self.setup.network.stations[seen.station].drift_m
    }

    /// Stations and targets in metres: where the ranges gave the scale, enlarged from the middle of the targets, with the
    /// scale's part of their covariance.
    fn scaled(&self) -> (Vec<AdjustedStation>, Vec<AdjustedTarget>) {
        let (mut stations, mut targets) = (self.first.stations.clone(), self.first.targets.clone());
        let Some((scale, variance, shared)) = &self.step.scale else { return (stations, targets) };
        let middle = targets.iter().map(|t| t.point.coords).sum::<Vector3<f64>>() / targets.len().max(1) as f64;
        let mut shared = shared.iter().skip(self.first_names.len());
        let mut next = || Vector3::from_fn(|_, _| shared.next().copied().unwrap_or(0.0));
        // x' = g + λ (x − g): C' = λ² C + λ (c armᵀ + arm cᵀ) + σ² arm armᵀ, c being the covariance of x and λ.
        let spread = |arm: &Vector3<f64>, c: &Vector3<f64>| {
            (c * arm.transpose() + arm * c.transpose()) * *scale + arm * arm.transpose() * *variance
        };
        for station in &mut stations {
            let arm = station.world_from_camera.translation.vector - middle;
            station.world_from_camera.translation.vector = middle + arm * *scale;
            let own = station.covariance.fixed_view::<3, 3>(0, 0) * (scale * scale) + spread(&arm, &next());
            let turned = station.covariance.fixed_view::<3, 3>(0, 3) * *scale;
            station.covariance.fixed_view_mut::<3, 3>(0, 0).copy_from(&own);
            station.covariance.fixed_view_mut::<3, 3>(0, 3).copy_from(&turned);
            station.covariance.fixed_view_mut::<3, 3>(3, 0).copy_from(&turned.transpose());
        }
        for target in &mut targets {
            let arm = target.point.coords - middle;
            target.point = (middle + arm * *scale).into();
            target.covariance = target.covariance * (scale * scale) + spread(&arm, &next());
        }
        (stations, targets)
    }
}
