//! Adjusted stations, targets and residuals as tables.

use nalgebra::Matrix3;
use pipeline::survey::StationPose;
use range_io::tables::{Residual, Station, Target};
use self_calibration::{AdjustedStation, AdjustedTarget, CalibrationOutcome, ObservationQuality};

use crate::calibrate::results::names::verdict_name;

/// Rows of `adjusted_stations.csv`.
pub(crate) fn stations(outcome: &CalibrationOutcome) -> Vec<Station> {
    let row = |station: &AdjustedStation| {
        let pose = StationPose { world_from_camera: station.world_from_camera, covariance: Some(station.covariance) };
        let sigmas = pose.sigmas().filter(|(p, a)| p.iter().chain(a).all(|sigma| sigma.is_finite() && *sigma > 0.0));
        Station {
            station: station.name.clone(),
            world_from_camera: station.world_from_camera,
            sigma_position_m: sigmas.map(|sigmas| sigmas.0),
            sigma_attitude_rad: sigmas.map(|sigmas| sigmas.1),
            doubt: None,
        }
    };
    outcome.stations.iter().map(row).collect()
}

/// Rows of `adjusted_targets.csv`.
pub(crate) fn targets(outcome: &CalibrationOutcome) -> Vec<Target> {
    let row = |target: &AdjustedTarget| Target {
        target: target.name.clone(),
        position_m: target.point.coords.into(),
        sigma_m: sigmas(&target.covariance),
    };
    outcome.targets.iter().map(row).collect()
}

/// Standard deviations; `None` where one is zero or not known, as for a target that was held.
fn sigmas(covariance: &Matrix3<f64>) -> Option<[f64; 3]> {
    let sigmas = [0, 1, 2].map(|axis| covariance[(axis, axis)].sqrt());
    sigmas.iter().all(|sigma| sigma.is_finite() && *sigma > 0.0).then_some(sigmas)
}

/// Rows of `residuals.csv`.
pub(crate) fn residuals(outcome: &CalibrationOutcome) -> Vec<Residual> {
    let row = |quality: &ObservationQuality| Residual {
        station: quality.station.clone(),
        target: quality.target.clone(),
        component: quality.component.name().to_owned(),
        observed: Some(quality.observed),
        sigma: Some(quality.sigma),
        residual: Some(quality.residual),
        redundancy_number: Some(quality.redundancy_number),
        standardised_residual: Some(quality.standardised),
        smallest_detectable: Some(quality.smallest_detectable),
        verdict: verdict_name(quality.verdict).to_owned(),
    };
    outcome.residuals.iter().map(row).collect()
}
